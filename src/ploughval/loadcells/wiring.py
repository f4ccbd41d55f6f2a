"""Cells that were swapped or read with the wrong sign: told by where the force would act."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ploughval.loadcells.bending import CellGeometry
from ploughval.loadcells.response import CellResponse
from ploughval.loadcells.run_log import RunLog
from ploughval.loadcells.zero import zero_of

Floats = NDArray[np.float64]
LOWEST_DEPTHS, HIGHEST_DEPTHS = -0.25, 1.75
"""Sand presses on the blade between its tip and the top of the heap: this far about them, in depths."""
_MOST_ROWS = 20_000  # that are looked at
_LOADED = 10.0  # a mean force of fewer standard deviations tells nothing
_UNLIKE_FRICTION = 3.0  # and of fewer than this of the empty runs' spread
_WORDS = {
    (False, (-1, -1)): "both cells have the opposite sign",
    (False, (-1, 1)): "the upper cell has the opposite sign",
    (False, (1, -1)): "the lower cell has the opposite sign",
    (True, (1, 1)): "the two cells are swapped",
    (True, (-1, -1)): "the two cells are swapped and have the opposite sign",
    (True, (-1, 1)): "the two cells are swapped and the one read as upper has the opposite sign",
    (True, (1, -1)): "the two cells are swapped and the one read as lower has the opposite sign",
}


@dataclass(frozen=True, slots=True)
class Wiring:
    """How the two columns belong to the cells: swapped or not, then a sign for (upper, lower)."""

    swapped: bool = False
    signs: tuple[int, int] = (1, 1)
    words: str = ""

    def apply(self, readings: Floats) -> Floats:
        """Readings (2, N) of the (upper, lower) cell as they should be."""
        if not self.words:
            return readings
        return np.asarray(
            (readings[::-1] if self.swapped else readings) * np.array(self.signs, float)[:, None]
        )

    def rewired(self, log: RunLog) -> RunLog:
        """A log whose readings are those of the (upper, lower) cell as they should be."""
        return replace(log, readings=self.apply(log.readings)) if self.words else log


AS_LOGGED = Wiring()


def mean_action(moments: Floats, geometry: CellGeometry) -> tuple[float, float]:
    """Mean force, N, and height of its line of action, mm, weighted by its square, of moments (2, N)."""
    force = (moments[0] - moments[1]) * geometry.per_Nm
    power = float(force @ force)
    arm = geometry.lower_to_tip_mm - 1000.0 * float(moments[1] @ force) / power if power > 0 else np.nan
    return float(force.mean()), arm


def recognise(
    readings: Floats, response: CellResponse, geometry: CellGeometry, depth_mm: float
) -> Wiring | None:
    """The one way of wiring under which the force acts against the blade and where the sand is.

    Parameters
    ----------
    readings : (2, N) float
        Readings while the blade moves, zero and friction taken off, as logged; finite.
    response : CellResponse
        Readings to moments.
    geometry : CellGeometry
        Where the cells are.
    depth_mm : float
        Depth of the blade.

    Returns
    -------
    Wiring or None
        As logged where that is possible. None where no way is possible, or more than one.
    """
    possible = _possible(readings, response, geometry, depth_mm)
    if possible and not possible[0].words:
        return AS_LOGGED
    return possible[0] if len(possible) == 1 else None


def _possible(
    readings: Floats, response: CellResponse, geometry: CellGeometry, depth_mm: float
) -> list[Wiring]:
    """Every way of wiring under which the force is where sand can be; as logged first."""
    possible = []
    for swapped, signs in product((False, True), ((1, 1), (-1, -1), (-1, 1), (1, -1))):
        wiring = Wiring(swapped, signs, _WORDS.get((swapped, signs), ""))
        force, arm = mean_action(response.moments(wiring.apply(readings)), geometry)
        if force > 0 and LOWEST_DEPTHS * depth_mm <= arm <= HIGHEST_DEPTHS * depth_mm:
            possible.append(wiring)
    return possible


def wiring_of(
    log: RunLog,
    empty: Sequence[RunLog],
    response: CellResponse,
    geometry: CellGeometry,
    depth_mm: float,
    faults: list[str],
) -> Wiring:
    """How the columns of a test belong to the cells; what is not as logged is added to ``faults``.

    Parameters
    ----------
    log : RunLog
        The test.
    empty : sequence of RunLog
        Its empty runs, whose mean is taken off.
    response : CellResponse
        Readings to moments.
    geometry : CellGeometry
        Where the cells are.
    depth_mm : float
        Depth of the blade.
    faults : list of str
        What was found is added.

    Returns
    -------
    Wiring
        As logged where the force is too small to tell beside noise and the spread of the
        empty runs, or where no single way of wiring explains it.
    """
    loaded = _loads(log)
    if loaded is None:
        return AS_LOGGED
    net, std = loaded
    levels = [found[0].mean(axis=1) for run in empty if (found := _loads(run)) is not None]
    if levels:
        net = net - np.mean(levels, axis=0)[:, None]
    slope = response.slopes(np.zeros(2))
    across = geometry.per_Nm * np.array([1.0, -1.0]) @ slope
    known = [_LOADED * float(np.linalg.norm(across * std))]
    if len(levels) > 1:
        spread = float(np.std(np.array(levels) @ across, ddof=1))
        known.append(_UNLIKE_FRICTION * spread * (1 + 1 / len(levels)) ** 0.5)
    force, arm = mean_action(response.moments(net), geometry)
    if abs(force) <= max(known):
        return AS_LOGGED
    wiring = recognise(net, response, geometry, depth_mm)
    if wiring is None:
        several = len(_possible(net, response, geometry, depth_mm)) > 1
        faults.append(_unexplained(force, arm, several=several))
        return AS_LOGGED
    if wiring.words:
        faults.append(
            f"{wiring.words}: as logged the mean force is {force:.4g} N, {arm:.4g} mm above the tip. Read as "
            "they should be; correct [loadcells.columns] or the signs of the calibration"
        )
    return wiring


def _unexplained(force: float, arm: float, *, several: bool) -> str:
    ways = "more than one other order or sign" if several else "no other order or sign"
    return (
        f"the mean force is {force:.4g} N and acts {arm:.4g} mm above the tip, where no sand can press "
        f"on the blade, and {ways} of the cells explains it: check spacing_mm, lower_to_tip_mm, the "
        "columns and the calibration"
    )


def _loads(log: RunLog) -> tuple[Floats, Floats] | None:
    """Readings (2, N) in motion less rest, thinned, and the std (2,) of their mean; None without both."""
    zero = zero_of(log.time_s[log.resting], log.readings[:, log.resting])
    moving = log.readings[:, log.advancing]
    moving = moving[:, np.isfinite(moving).all(axis=0)]
    if zero is None or log.motion is None or moving.shape[1] == 0:
        return None
    std = np.sqrt(np.diag(zero.mean_cov) + np.diag(zero.noise_cov) / moving.shape[1])
    return moving[:, :: max(moving.shape[1] // _MOST_ROWS, 1)] - zero.mean[:, None], std
