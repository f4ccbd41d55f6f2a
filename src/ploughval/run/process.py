"""One test folder from its settings to its result files: the steps that its scene calls for."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

import numpy as np
import pandas as pd
import xarray as xr

from ploughval import axes
from ploughval.axes import Status
from ploughval.compare import Comparison, compare_test, metrics_mapping
from ploughval.errors import PloughvalError
from ploughval.loadcells import ForceResult, measure_force
from ploughval.model import History, simulate
from ploughval.photos import calibrate, open_frames
from ploughval.run import provenance, tables
from ploughval.run.clock import frame_displacement
from ploughval.run.doubts import doubts, heap_doubts, lean_doubt, outside_log
from ploughval.run.findings import Findings
from ploughval.run.finish import Page, clear, finish, reused
from ploughval.run.kept.lock import locked
from ploughval.run.kept.snapshots import from_arrays, to_arrays
from ploughval.run.kept.stages import BANDS, COMPARE, FORCE, Stage, digest_of, force_key, stage_key
from ploughval.run.kept.store import Key, Store
from ploughval.run.outcome import Outcome
from ploughval.run.results import refuse_inputs, write_results
from ploughval.run.walk.first_frame import first_frame
from ploughval.run.walk.photographs import Photographs
from ploughval.run.walk.window import WindowRecord
from ploughval.scene import Scene, Step, load_scene
from ploughval.tracers import BandFindings, area_balance, find_bands, layers_from_tracks
from ploughval.watch import Progress, one_step, unheard

Value = TypeVar("Value")
LEAST_FOLLOWED = 0.01  # share of the points; a frame with fewer is lost


def process_folder(
    folder: Path | str,
    *,
    out: Path | str | None = None,
    workers: int = 1,
    fresh: bool = False,
    progress: Progress = unheard,
    page: Page | None = None,
) -> Outcome:
    """Process one test folder and write every result file; the report page where someone makes it.

    A run holds its result folder for itself. Stages whose inputs, settings and code are those of what an
    earlier run kept are not run again.

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
    progress : callable
        Hears of (stage, done, total): at the beginning of each stage, after each photograph, and at the end.
    page : callable or None
        Writes the report page of a result folder and returns its path.

    Returns
    -------
    Outcome
        Where the results are, what was lost and what was reused.

    Raises
    ------
    PloughvalError
        When the input is refused (settings, photographs that cannot be opened, calibration), another run
        holds the result folder, or nothing can be written there.
    """
    start = time.perf_counter()
    scene = load_scene(folder)
    results = Path(out) if out is not None else scene.folder / "results"
    kept = Store(results, fresh=fresh)
    with locked(results):
        run = _Run(scene, kept, workers, progress)
        refuse_inputs(scene, results, run.found)
        run.open()
        clear(results, kept)
        run.go()
        with one_step(progress, "results"):
            write_results(scene, run.found, results)
        report = finish(scene, run.found, kept, page)
    return run.outcome(report, time.perf_counter() - start)


class _Run:
    """One test on its way through the steps that its scene calls for."""

    def __init__(self, scene: Scene, kept: Store, workers: int, progress: Progress) -> None:
        self.scene, self.kept, self.workers, self.progress = scene, kept, workers, progress
        self.found = Findings(input_digests=provenance.input_digests(scene))

    def open(self) -> None:
        """Open and calibrate the photographs: what is refused here leaves earlier results as they are."""
        if Step.CALIBRATION in self.scene.steps:
            with self._timed(Step.CALIBRATION.value):
                self.found.frames = open_frames(self.scene)
                self.found.calibration = calibrate(self.scene, self.found.frames)

    def go(self) -> None:
        steps, found = self.scene.steps, self.found
        if Step.FORCE in steps:
            found.force = self._attempt(Step.FORCE, self._force)
            found.warnings += [] if found.force is None else [f"force: {text}" for text in found.force.faults]
            found.faults += [] if found.force is None else [f"force: {text}" for text in found.force.lost]
        if Step.CALIBRATION in steps:
            found.window = self._attempt("photographs", self._photographs)
            self._judge_photographs()
        if found.window is not None:
            self._displacement(found.window)
            self._geometry(found.window)
        if Step.MODEL in steps:
            found.history = self._attempt(Step.MODEL, self._simulate)
        if Step.COMPARE in steps and found.history is not None:
            found.comparison = self._attempt(Step.COMPARE, self._compare)

    def outcome(self, report: Path | None, seconds: float) -> Outcome:
        """What became of the test, when all is written."""
        found = self.found
        return Outcome(
            name=self.scene.test.name,
            results=self.kept.results,
            complete=found.complete,
            faults=tuple(found.faults),
            warnings=(*found.warnings, *self.kept.refused),
            metrics={} if found.comparison is None else metrics_mapping(found.comparison),
            steps=tuple(step.value for step in self.scene.steps),
            seconds=seconds,
            report=report,
            reused=reused(self.kept),
        )

    def _attempt(self, step: str, action: Callable[[], Value]) -> Value | None:
        """Run a step; a fault that the user can cause costs this step alone, and is named."""
        with self._timed(str(step)):
            try:
                return action()
            except PloughvalError as error:
                self._lose(step, str(error))
        return None

    def _lose(self, step: str, reason: str) -> None:
        self.found.faults.append(f"{step}: {reason}")
        self.found.lost_steps.append(str(step))

    @contextmanager
    def _timed(self, stage: str) -> Iterator[None]:
        start = time.perf_counter()
        with one_step(self.progress, stage):
            try:
                yield
            finally:
                self.found.timings_s[stage] = time.perf_counter() - start

    def _photographs(self) -> WindowRecord:
        """The walk through the photographs, or what an earlier run kept of it."""
        frames, calibration = self.found.frames, self.found.calibration
        assert frames is not None
        assert calibration is not None
        first = first_frame(self.scene, frames, calibration.mm_per_px, self.found.force_record)
        if first:
            self.found.warnings.append(
                f"frame {first} shows the sand at rest, by the log: it stands for the first"
            )
        photographs = Photographs(self.scene, frames, calibration, self.found.input_digests)
        return photographs.window(self.kept, first, workers=self.workers, progress=self.progress)

    def _judge_photographs(self) -> None:
        """Name every frame and every part of the walk that gave nothing."""
        found = self.found
        assert found.frames is not None
        found.warnings += found.frames.notes
        found.warnings += filter(None, [lean_doubt(self.scene.blade.inclination_deg)])
        found.warnings += () if found.calibration is None else found.calibration.warnings
        found.faults += [
            f"photograph {name}: it has a time but is not there" for name in found.frames.missing
        ]
        window = found.window
        if window is None:
            return
        found.lost_frames = dict(window.lost_frames)
        if Step.TRACKS in self.scene.steps:
            if len(window.points_px) == 0:
                self._lose(Step.TRACKS, "no place for a point was found in the first photograph's sand")
            else:
                share = np.isin(window.status, (Status.OK, Status.REPLACED)).mean(axis=1)
                for frame in np.flatnonzero(share < LEAST_FOLLOWED).tolist():
                    found.lost_frames.setdefault(frame, "none of the points could be followed to it")
        found.faults += [f"frame {frame}: {reason}" for frame, reason in sorted(found.lost_frames.items())]
        unseen = [f for f in np.flatnonzero(np.isnan(window.blade[:, 0])) if f not in window.lost_frames]
        if len(unseen) > len(found.frames) // 2:
            what = f"the face was not found in {len(unseen)} of {len(found.frames)} photographs"
            self._lose(Step.BLADE, f"{what}; check tip_px, direction, mm_per_px and the blade's size")
        else:
            found.warnings += [f"frame {f}: the blade's face was not found in the photograph" for f in unseen]
        found.warnings += [f"frame {f}: {text}" for f, texts in window.notes.items() for text in texts]

    def _displacement(self, window: WindowRecord) -> None:
        found = self.found
        assert found.frames is not None
        time_s = found.frames.time_s
        record = found.force_record()
        found.displacement = frame_displacement(self.scene, time_s, window.blade[:, 0], record)
        source = found.displacement.source
        if source != "log":
            found.warnings.append(f"blade displacement of the frames comes from: {source}")
        if self.scene.camera is not None and self.scene.camera.clock_offset_s == "auto" and source != "log":
            found.warnings.append("the offset of the clocks could not be found: no motion that both saw")
        if source == "log" and record is not None:
            found.warnings += outside_log(found.displacement, time_s, record["time_s"].to_numpy(float))
        assert found.calibration is not None
        found.warnings += doubts(
            found.displacement, window.blade[:, 0], found.calibration.mm_per_px, found.travel_mm() or 0.0
        )
        if not np.isfinite(time_s).any():
            found.warnings.append("the times of the photographs are not known: time_s is empty")

    def _geometry(self, window: WindowRecord) -> None:
        found, steps, u_mm = self.found, self.scene.steps, self.found.frame_displacement_mm()
        assert found.calibration is not None
        assert found.frames is not None
        surface = found.surface = tables.surface_table(window, u_mm)
        blade = tables.blade_table(window, found.frames.time_s, u_mm)
        found.volume = area_balance(surface, blade, self.scene.blade.depth_mm)
        found.warnings += heap_doubts(found.volume)
        if self.scene.tracers is not None:
            found.layers = pd.DataFrame(columns=axes.LAYER_COLUMNS)
        kept = []
        if Step.TRACKS in steps:
            tracks = tables.tracks_dataset(window, found.calibration, self.scene, found.frames.time_s, u_mm)
            found.tracks = tracks
            if Step.LAYERS in steps:
                kept.append(self._attempt(Step.LAYERS, lambda: layers_from_tracks(tracks)))
            if Step.BANDS in steps:
                found.bands = self._attempt(Step.BANDS, lambda: self._bands(tracks, surface))
        if Step.DYE in steps:
            kept.append(tables.dyed_table(window, u_mm))
        tables_found = [table for table in kept if table is not None and len(table)]
        if tables_found:
            found.layers = pd.concat(tables_found, ignore_index=True)

    def _force(self) -> ForceResult:
        key = force_key(self.scene, self.found.input_digests)
        return self._kept(FORCE, key, lambda: measure_force(self.scene))

    def _bands(self, tracks: xr.Dataset, surface: pd.DataFrame) -> BandFindings:
        key = stage_key(BANDS, self.scene, tracks=digest_of(tracks), surface=digest_of(surface))
        return self._kept(BANDS, key, lambda: find_bands(tracks, surface, self.scene))

    def _kept(self, stage: Stage, key: Key, make: Callable[[], Value]) -> Value:
        """What an earlier run kept under the key, or else what is made now, and kept."""
        arrays = self.kept.load(stage.name, key)
        if arrays is not None:
            try:
                found: Value = from_arrays(arrays, stage.kinds)
            except ValueError:
                self.kept.refuse(stage.name)
            else:
                return found
        value = make()
        self.kept.save(stage.name, key, to_arrays(value))
        return value

    def _simulate(self) -> History:
        return simulate(self.scene, displacement_mm=self._travel_mm())

    def _travel_mm(self) -> float | None:
        """Travel of the blade that the model is run to, mm; None: the model's own."""
        return self.scene.model.displacement_mm or self.found.travel_mm()

    def _compare(self) -> Comparison:
        found = self.found
        assert found.history is not None
        # frames without a displacement belong to no stage of the model
        placed = bool(np.isfinite(found.frame_displacement_mm()).any())

        def places(table: pd.DataFrame | None) -> pd.DataFrame | None:
            if table is None or found.calibration is None:
                return table if placed else None
            return tables.with_calibration_std(table, found.calibration) if placed else None

        measured = {
            "force": found.force_record(),
            "bands": found.band_table() if placed else None,
            "layers": places(found.layers),
            "surface": places(found.surface),
            "increments": None if found.bands is None else found.bands.increments,
        }
        digests = {name: digest_of(table) for name, table in measured.items()}
        key = stage_key(COMPARE, self.scene, travel=repr(self._travel_mm()), **digests)
        history = found.history
        return self._kept(COMPARE, key, lambda: compare_test(self.scene, history, **measured))
