"""One test folder from its settings to its result files: the steps that its scene calls for."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pandas as pd

from ploughval import axes
from ploughval.compare import Comparison, compare_test, metrics_mapping
from ploughval.errors import PloughvalError
from ploughval.loadcells import measure_force
from ploughval.model import History, simulate
from ploughval.photos import calibrate, open_frames
from ploughval.run import provenance, store, tables
from ploughval.run.clock import frame_displacement
from ploughval.run.findings import Findings
from ploughval.run.results import write_results
from ploughval.run.window import Progress, WindowRecord, watch
from ploughval.scene import Scene, Step, load_scene
from ploughval.tracers import find_bands, layers_from_tracks

Value = TypeVar("Value")


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of one test."""

    name: str
    results: Path
    complete: bool
    faults: tuple[str, ...]
    metrics: dict[str, Any]
    steps: tuple[str, ...]
    seconds: float
    report: Path | None = None


def process_folder(
    folder: Path | str,
    *,
    out: Path | str | None = None,
    workers: int = 1,
    fresh: bool = False,
    progress: Progress | None = None,
) -> Outcome:
    """Process one test folder and write every result file except the report page.

    Parameters
    ----------
    folder : path-like
        Test folder with a test.toml.
    out : path-like or None
        Result folder; None: ``results`` in the test folder.
    workers : int
        Threads; numbers do not depend on it.
    fresh : bool
        Start over instead of reusing finished stages.
    progress : callable or None
        Called with (stage, done, total).

    Returns
    -------
    Outcome
        Where the results are and what was lost.

    Raises
    ------
    PloughvalError
        When the input is refused: settings, photographs that cannot be opened, calibration.
    """
    start = time.perf_counter()
    scene = load_scene(folder)
    results = Path(out) if out is not None else scene.folder / "results"
    run = _Run(scene, store.Store(results, fresh=fresh), workers, progress)
    run.go()
    write_results(scene, run.found, results)
    comparison = run.found.comparison
    return Outcome(
        name=scene.test.name,
        results=results,
        complete=run.found.complete,
        faults=tuple(run.found.faults),
        metrics={} if comparison is None else metrics_mapping(comparison),
        steps=tuple(step.value for step in scene.steps),
        seconds=time.perf_counter() - start,
    )


class _Run:
    """One test on its way through the steps that its scene calls for."""

    def __init__(self, scene: Scene, kept: store.Store, workers: int, progress: Progress | None) -> None:
        self.scene, self.kept, self.workers, self.progress = scene, kept, workers, progress
        self.found = Findings(input_digests=provenance.input_digests(scene))

    def go(self) -> None:
        steps, found = self.scene.steps, self.found
        if Step.CALIBRATION in steps:
            self._photographs()
        if Step.FORCE in steps:
            found.force = self._attempt(Step.FORCE, lambda: measure_force(self.scene))
            found.warnings += [] if found.force is None else [f"force: {text}" for text in found.force.faults]
        if found.window is not None:
            self._displacement(found.window)
            self._geometry(found.window)
        if Step.MODEL in steps:
            found.history = self._attempt(Step.MODEL, self._simulate)
        if Step.COMPARE in steps and found.history is not None:
            found.comparison = self._attempt(Step.COMPARE, self._compare)

    def _attempt(self, step: Step, action: Callable[[], Value]) -> Value | None:
        """Run a step; a fault that the user can cause costs this step alone, and is named."""
        start = time.perf_counter()
        try:
            return action()
        except PloughvalError as error:
            self.found.faults.append(f"{step.value}: {error}")
            self.found.lost_steps.append(step.value)
            return None
        finally:
            self._time(step.value, start)

    def _time(self, stage: str, start: float) -> None:
        self.found.timings_s[stage] = time.perf_counter() - start
        if self.progress is not None:
            self.progress(stage, 1, 1)

    def _photographs(self) -> None:
        found = self.found
        start = time.perf_counter()
        found.frames = open_frames(self.scene)
        found.calibration = calibrate(self.scene, found.frames)
        self._time(Step.CALIBRATION.value, start)
        start = time.perf_counter()
        key = self._window_key()
        arrays = self.kept.load("window", key)
        if arrays is None:
            found.window = watch(
                self.scene, found.frames, found.calibration, workers=self.workers, progress=self.progress
            )
            self.kept.save("window", key, found.window.to_arrays())
        else:
            found.window = WindowRecord.from_arrays(arrays)
        self._time("photographs", start)
        found.warnings += found.frames.notes
        lost = sorted(found.window.lost_frames.items())
        found.faults += [f"frame {frame}: {reason}" for frame, reason in lost]

    def _window_key(self) -> str:
        """Key of all that the walk through the photographs depends on."""
        settings = self.scene.model_dump_json(include={"blade", "camera", "tracers", "piv", "soil", "box"})
        files = [
            f"{name}={d}" for name, d in self.found.input_digests.items() if name != self.scene.source.name
        ]
        return store.key_of(provenance.code_digest(), settings, *files)

    def _displacement(self, window: WindowRecord) -> None:
        found = self.found
        assert found.frames is not None
        time_s = found.frames.time_s
        found.displacement = frame_displacement(self.scene, time_s, window.blade[:, 0], found.force_record())
        if found.displacement.source != "log":
            found.warnings.append(f"blade displacement of the frames comes from: {found.displacement.source}")
        unseen = [k for k in np.flatnonzero(np.isnan(window.blade[:, 0])) if k not in window.lost_frames]
        found.warnings += [
            f"frame {frame}: the blade's face was not found in the photograph" for frame in unseen
        ]
        if not np.isfinite(time_s).any():
            found.warnings.append("the times of the photographs are not known: time_s is empty")

    def _geometry(self, window: WindowRecord) -> None:
        found, steps, u_mm = self.found, self.scene.steps, self.found.frame_displacement_mm()
        assert found.calibration is not None
        assert found.frames is not None
        surface = found.surface = tables.surface_table(window, u_mm)
        if self.scene.tracers is not None:
            found.layers = pd.DataFrame(columns=axes.LAYER_COLUMNS)
        kept = []
        if Step.TRACKS in steps:
            tracks = tables.tracks_dataset(window, found.calibration, self.scene, found.frames.time_s, u_mm)
            found.tracks = tracks
            if Step.LAYERS in steps:
                kept.append(self._attempt(Step.LAYERS, lambda: layers_from_tracks(tracks)))
            if Step.BANDS in steps:
                found.bands = self._attempt(Step.BANDS, lambda: find_bands(tracks, surface, self.scene))
        if Step.DYE in steps:
            kept.append(tables.dyed_table(window, u_mm))
        tables_found = [table for table in kept if table is not None and len(table)]
        if tables_found:
            found.layers = pd.concat(tables_found, ignore_index=True)

    def _simulate(self) -> History:
        travel = self.scene.model.displacement_mm or self.found.travel_mm()
        return simulate(self.scene, displacement_mm=travel)

    def _compare(self) -> Comparison:
        found = self.found
        assert found.history is not None
        return compare_test(
            self.scene,
            found.history,
            force=found.force_record(),
            bands=found.band_table(),
            layers=found.layers,
            surface=found.surface,
        )
