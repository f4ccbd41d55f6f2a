"""Force histories of repeated tests: mean and spread over travel in depths, scatter of the switches."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.compare.force.alignment import aligned_u
from ploughval.compare.force.curve import Curve, measured_curve
from ploughval.compare.force.peaks import least_prominence, weak_prominence
from ploughval.compare.force.reading import read_force
from ploughval.compare.several.pooling import Pooled, pool
from ploughval.compare.several.record import Record

Floats = NDArray[np.float64]
_STEPS_PER_DEPTH = 200


@dataclass(frozen=True, slots=True)
class MeanHistory:
    """Histories of K tests at N places, travel in depths, force scaled.

    Attributes
    ----------
    tests : tuple of int
    scale : str
        What forces are divided by; "" where they are in N.
    u_d : (N,) float, depths
        Travel that all tests have, in depths.
    forces : (K, N) float
    mean, std, stated_std : (N,) float
        Over tests at the same travel; the last is the root mean square of the stated uncertainties.
    aligned : (K, N) float or None
        Histories, travel stretched so that switches coincide at their mean places; None without any.
    aligned_mean, aligned_std : (N,) float or None
    switches_d : (K, S) float, depths
        Travel at the first S switches, S the number that every test has.
    switch_counts : tuple of int
        Switches of each test.
    switches : tuple of Pooled
        Scatter of each switch's place.
    """

    tests: tuple[int, ...]
    scale: str
    u_d: Floats
    forces: Floats
    mean: Floats
    std: Floats
    stated_std: Floats
    aligned: Floats | None
    aligned_mean: Floats | None
    aligned_std: Floats | None
    switches_d: Floats
    switch_counts: tuple[int, ...]
    switches: tuple[Pooled, ...]


def mean_history(places: Sequence[int], records: Sequence[Record]) -> MeanHistory | None:
    """Mean and spread of the force histories of tests that repeat each other.

    Parameters
    ----------
    places : sequence of int
        Tests of one group.
    records : sequence of Record
        All tests.

    Returns
    -------
    MeanHistory or None
        None with fewer than two histories in motion over a common travel.
    """
    found = {place: curve for place in places if (curve := _curve(records[place])) is not None}
    if len(found) < 2:
        return None
    tests, curves = tuple(found), list(found.values())
    depths = [records[place].depth_mm for place in tests]
    start = max(curve.u_mm[0] / d for curve, d in zip(curves, depths, strict=True))
    end = min(curve.end_mm / d for curve, d in zip(curves, depths, strict=True))
    if end - start < 0.1:
        return None
    u_d = np.linspace(start, end, max(int((end - start) * _STEPS_PER_DEPTH), 2) + 1)
    scales = [records[place].scale("N") for place in tests]
    words = scales[0].words if all(scales) and scales[0] is not None else ""
    sizes = [scale.size if scale is not None and words else 1.0 for scale in scales]
    rows = [curve.at(u_d * d) for curve, d in zip(curves, depths, strict=True)]
    forces, stds = (
        np.array([row[side] / size for row, size in zip(rows, sizes, strict=True)]) for side in (0, 1)
    )
    places_d = [_switches(curve, records[place], end) for place, curve in found.items()]
    common = min(len(one[0]) for one in places_d)
    switches = np.array([one[0][:common] for one in places_d])
    switch_stds = np.array([one[1][:common] for one in places_d])
    aligned = _aligned(curves, depths, sizes, u_d, switches) if common else None
    return MeanHistory(
        tests=tests, scale=words, u_d=u_d, forces=forces,
        mean=forces.mean(axis=0), std=forces.std(axis=0, ddof=1),
        stated_std=np.sqrt(np.mean(stds**2, axis=0)),
        aligned=aligned,
        aligned_mean=None if aligned is None else aligned.mean(axis=0),
        aligned_std=None if aligned is None else aligned.std(axis=0, ddof=1),
        switches_d=switches, switch_counts=tuple(len(one[0]) for one in places_d),
        switches=tuple(pool(list(switches[:, k]), list(switch_stds[:, k])) for k in range(common)),
    )  # fmt: skip


def _curve(record: Record) -> Curve | None:
    if record.force is None or not np.isfinite(record.depth_mm):
        return None
    return measured_curve(record.force, record.depth_mm)


def _switches(curve: Curve, record: Record, end_d: float) -> tuple[Floats, Floats]:
    """Places of the switches within the common travel and their standard uncertainties, in depths."""
    depth = record.depth_mm
    P0 = record.P0_N if np.isfinite(record.P0_N) else float(np.max(curve.force_N)) / 2
    stated = record.number("compare", "prominence")
    prominence = least_prominence(curve, P0, stated if np.isfinite(stated) else None)
    switches = read_force(
        curve.until(end_d * depth), prominence, depth, weak_N=weak_prominence(curve, P0)
    ).switches
    u_mm, std_mm = (switches[name].to_numpy(dtype=np.float64) for name in ("u_mm", "u_std_mm"))
    return u_mm / depth, std_mm / depth


def _aligned(
    curves: Sequence[Curve], depths: Sequence[float], sizes: Sequence[float], u_d: Floats, switches: Floats
) -> Floats:
    """Each history at the same stage between switches; NaN beyond its end."""
    mean = switches.mean(axis=0)
    return np.array(
        [
            curve.at(aligned_u(u_d, mean, own) * d)[0] / size
            for curve, d, size, own in zip(curves, depths, sizes, switches, strict=True)
        ]
    )
