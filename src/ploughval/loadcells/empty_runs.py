"""The empty-box runs of a test: read, and held against the test that they are to compensate."""

from collections.abc import Sequence

import numpy as np

from ploughval.errors import PloughvalError
from ploughval.loadcells.friction import EmptyRun, Friction, empty_run, friction_of
from ploughval.loadcells.logs import log_paths, read_cell_log
from ploughval.loadcells.response import CellResponse
from ploughval.loadcells.run_log import RunLog, arrays_of
from ploughval.loadcells.zero import Zero
from ploughval.scene import LoadCells, Scene
from ploughval.scene_faults import denied

SPEED_DIFFERS = 0.1
"""Relative difference of two speeds that is said."""
_SHORT = 0.98  # of the test's travel
_LEAST_TO_COMPARE = 3
_UNLIKE_SPREADS, _UNLIKE_SHARE = 10.0, 0.5  # of the other runs' spread, and of their friction: is said
_DRIVES = 5.0  # standard deviations below zero at which the sign of friction is doubted
_ACROSS = np.array([1.0, -1.0])


def read_empty(scene: Scene, cells: LoadCells, faults: list[str], lost: list[str]) -> list[RunLog]:
    """All empty-box runs that can be read.

    Parameters
    ----------
    scene : Scene
        The test, which finds the files.
    cells : LoadCells
        How they are read.
    faults : list of str
        What was found in the runs is added.
    lost : list of str
        Runs that are named but not there, or that cannot be read, are added.

    Returns
    -------
    list of RunLog
    """
    logs = set(log_paths(scene, cells))
    for pattern in cells.empty:
        if not scene.matches(pattern):
            said = f"empty-box run left out: no file matches {pattern[:80]!r} of [loadcells] empty"
            why = denied(scene.folder, pattern)
            lost.append(f"{said}. {why}" if why else said)
        lost += [
            f"empty-box run left out: {path}: is no file but a link, pipe or device"
            for path in scene.not_files(pattern)
        ]
    paths = sorted({path for pattern in cells.empty for path in scene.matches(pattern)} - logs)
    runs = []
    for path in paths:
        try:
            empty = read_cell_log(path, cells)
        except PloughvalError as error:
            lost.append(f"empty-box run left out: {error}")
            continue
        faults.extend(f"{path.name}: {fault}" for fault in empty.faults)
        runs.append(arrays_of(empty, path.name))
    return runs


def friction_from(
    logs: Sequence[RunLog], test: RunLog, zero: Zero, response: CellResponse, faults: list[str]
) -> Friction | None:
    """Friction from the runs that can stand for the test's; None without any.

    Parameters
    ----------
    logs : sequence of RunLog
        Empty runs.
    test : RunLog
        The test whose friction is wanted.
    zero : Zero
        The test's zeros, for runs without a rest of their own.
    response : CellResponse
        Readings to moments.
    faults : list of str
        What was found is added.

    Returns
    -------
    Friction or None
    """
    runs = []
    for log in logs:
        found = empty_run(log, zero, response)
        if found is None:
            faults.append(f"{log.name}: no motion found: left out of the friction")
            continue
        if not found.own_zero:
            faults.append(f"{log.name}: no rest before motion: the test's zeros are used")
        runs.append(found)
    runs = _alike(runs, test, faults)
    if not runs:
        return None
    if len(runs) == 1:
        faults.append(
            "a single empty-box run: friction's spread between runs is unknown, that along it is used"
        )
    _say_unlike(runs, response, faults)
    friction = friction_of(runs, response)
    _say_sign(friction, response, faults)
    return friction


def _say_unlike(runs: list[EmptyRun], response: CellResponse, faults: list[str]) -> None:
    """One run far from all others: most often not a run in the empty box."""
    if len(runs) < _LEAST_TO_COMPARE:
        return
    levels = np.stack([response.coefficients @ run.mean for run in runs])
    for k, run in enumerate(runs):
        others = np.delete(levels, k, axis=0)
        usual = others.mean(axis=0)
        off = float(np.linalg.norm(levels[k] - usual))
        spread = float(np.linalg.norm(others - usual, axis=1).max())
        if off > max(_UNLIKE_SPREADS * spread, _UNLIKE_SHARE * float(np.linalg.norm(usual))):
            faults.append(
                f"{run.name}: its friction is {levels[k][0]:.3g} and {levels[k][1]:.3g} N m, that of the "
                f"other runs {usual[0]:.3g} and {usual[1]:.3g} N m: used, but is it a run in the empty box?"
            )


def _say_sign(friction: Friction, response: CellResponse, faults: list[str]) -> None:
    """A friction that drives the blade on, beyond its doubt: columns or signs differ from the test's."""
    moments = response.coefficients @ friction.mean[:, 0]
    moment, std = moments[0] - moments[1], float(np.sqrt(_ACROSS @ friction.cov @ _ACROSS))
    if moment < -_DRIVES * std:
        faults.append(
            f"the friction of the empty-box runs drives the blade on (upper less lower moment {moment:.3g} "
            "N m): check that order and signs of their columns are those of the test"
        )


def _alike(runs: list[EmptyRun], test: RunLog, faults: list[str]) -> list[EmptyRun]:
    """Runs in the test's direction; another speed and a shorter travel are said."""
    if test.motion is None:
        return runs
    kept, travel, speed = [], test.motion.travel_mm, test.speed_mm_s
    for run in runs:
        if run.travel_mm * travel < 0:
            faults.append(
                f"{run.name}: the blade travels {run.travel_mm:.4g} mm, against the test's {travel:.4g} mm: "
                "left out of the friction, whose sign turns with the travel"
            )
            continue
        kept.append(run)
        if abs(run.speed_mm_s - speed) > SPEED_DIFFERS * abs(speed):
            faults.append(
                f"{run.name}: its speed is {run.speed_mm_s:.4g} mm/s, the test's {speed:.4g} mm/s: "
                "friction may differ"
            )
        if abs(run.travel_mm) < _SHORT * abs(travel):
            faults.append(
                f"{run.name}: it travels {abs(run.travel_mm):.4g} mm of the test's {abs(travel):.4g} mm: "
                "friction beyond is taken to be as before"
            )
    return kept
