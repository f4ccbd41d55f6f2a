"""What the steps of one test have found: passed from step to step and then to the result files."""

from dataclasses import dataclass, field

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from ploughval.compare import Comparison
from ploughval.loadcells import ForceResult
from ploughval.model import History
from ploughval.photos import Calibration, FrameSeries
from ploughval.photos.pattern import Pattern
from ploughval.run.clock import Displacement
from ploughval.run.walk.noise import curve_from
from ploughval.run.walk.pattern import pattern_from
from ploughval.run.walk.window import WindowRecord
from ploughval.tracers import BandFindings


@dataclass(slots=True)
class Findings:
    """Results of the steps so far; None where a step was not called for or was lost."""

    frames: FrameSeries | None = None
    calibration: Calibration | None = None
    window: WindowRecord | None = None
    displacement: Displacement | None = None
    force: ForceResult | None = None
    tracks: xr.Dataset | None = None
    surface: pd.DataFrame | None = None
    volume: pd.DataFrame | None = None
    layers: pd.DataFrame | None = None
    bands: BandFindings | None = None
    history: History | None = None
    comparison: Comparison | None = None
    lost_frames: dict[int, str] = field(default_factory=dict)  # frame -> reason
    faults: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    lost_steps: list[str] = field(default_factory=list)
    timings_s: dict[str, float] = field(default_factory=dict)
    input_digests: dict[str, str] = field(default_factory=dict)

    @property
    def complete(self) -> bool:
        """Whether no frame, step or empty-box run was lost, and no photograph is missing."""
        missing = self.frames is not None and self.frames.missing
        runs = self.force is not None and self.force.lost
        return not (self.lost_frames or self.lost_steps or missing or runs)

    def frame_displacement_mm(self) -> NDArray[np.float64]:
        """Blade displacement of each frame, mm; empty without photographs."""
        return np.empty(0) if self.displacement is None else self.displacement.u_mm

    def travel_mm(self) -> float | None:
        """Largest blade displacement that was measured, mm; None where nothing was."""
        known = [self.frame_displacement_mm()]
        if self.force is not None:
            known.append(self.force.record["u_mm"].to_numpy(float))
        travels = [float(np.nanmax(u)) for u in known if np.isfinite(u).any()]
        return max(travels) if travels and max(travels) > 0 else None

    def pattern(self) -> Pattern | None:
        """The sand's grains in the first photograph, or None where no points were tracked."""
        if self.window is None:
            return None
        noise = curve_from(self.window.noise, self.window.noise_line)
        return pattern_from(self.window.texture, self.window.texture_squares, noise)

    def force_record(self) -> pd.DataFrame | None:
        """The force record, or None."""
        return None if self.force is None else self.force.record

    def band_table(self) -> pd.DataFrame | None:
        """The measured bands, or None."""
        return None if self.bands is None else self.bands.bands
