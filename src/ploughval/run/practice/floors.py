"""Noise floors: scatter of what should not move, beside what the stated uncertainties predict."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from ploughval.loadcells import ForceResult
from ploughval.piv.strain import SHEAR_FLOORS, StrainMeasure, gauge_px, max_shear, strain_field
from ploughval.run.findings import Findings
from ploughval.run.practice.rest import Rest, off_line, rest_of, spread
from ploughval.run.practice.rows import NAN, Group, Row, Source, plain, untold
from ploughval.scene import Scene, Step

Floats = NDArray[np.float64]

FLOORS = Group.FLOORS
LEAST_POINTS = 20
"""Points, places or rows that a scatter is told from."""
LEAST_TRIPLES = 6
STRAINED = 3
"""Photographs whose strain at rest is looked at."""
_SHARED = 4.0  # neighbouring subsets overlap by half: about so many points hold the information of one
_MAD_LOSS = 1.64  # scatter of a standard deviation from the median absolute deviation, over a plain one's


def floor_rows(scene: Scene, found: Findings) -> list[Row]:
    """Noise floor of each quantity that the test measures."""
    rest = rest_of(scene, found)
    rows: list[Row] = []
    if found.tracks is not None:
        rows += _displacement(scene, found.tracks, rest, found)
        rows += _strain(scene, found.tracks, rest, found)
    if found.layers is not None and found.calibration is not None:
        rows += [_layers(found.layers, rest, source) for source in ("tracks", "dye") if _has(found, source)]
    if found.surface is not None and len(found.surface):
        rows.append(_surface(found.surface, rest))
    if Step.BLADE in scene.steps and found.window is not None:
        rows.append(_blade(found))
    if found.bands is not None:
        rows += _bands(found.bands.increments)
    if found.force is not None:
        rows += _force(found.force)
    return rows


def _stated(item: str, unit: str, predicted: float, why: str) -> Row:
    """A row of what is predicted alone; untold where even that is not known."""
    if not np.isfinite(predicted):
        return untold(FLOORS, item, why, unit)
    return Row(FLOORS, item, Source.PREDICTED, unit=unit, predicted=float(predicted), note=why)


@dataclass(frozen=True, slots=True)
class _Still:
    """Motion (N, 2) of points at rest in one photograph, their initial places and stated stds, mm."""

    start: Floats
    moved: Floats
    std: Floats


def _still(tracks: xr.Dataset, rest: Rest | None) -> list[_Still]:
    """Points at rest, photograph by photograph; those with too few are left out."""
    if rest is None:
        return []
    start = np.column_stack([tracks["x0_mm"].to_numpy(), tracks["y0_mm"].to_numpy()])
    out = []
    for frame in rest.frames:
        now = np.column_stack([tracks["x_mm"].to_numpy()[frame], tracks["y_mm"].to_numpy()[frame]])
        std = tracks["std_mm"].to_numpy()[frame]
        kept = rest.points(frame, start[:, 0], start[:, 1]) & np.isfinite(now).all(axis=1) & np.isfinite(std)
        if kept.sum() >= LEAST_POINTS:
            out.append(_Still(start[kept], (now - start)[kept], std[kept]))
    return out


def _displacement(scene: Scene, tracks: xr.Dataset, rest: Rest | None, found: Findings) -> list[Row]:
    """Scatter and mean of the motion of points that rest (docs/good-practice.md, Eq. (7))."""
    assert found.calibration is not None
    scale, still = found.calibration.mm_per_px, _still(tracks, rest)
    items = ("Displacement along the travel", "Displacement upwards")
    if not still:
        stated = tracks["std_mm"].to_numpy()[1:]
        known = stated[np.isfinite(stated)]
        predicted = float(np.sqrt(np.mean(known**2))) if known.size else NAN
        why = f"fewer than {LEAST_POINTS} points of the sand rest in any photograph"
        return [_stated(item, "mm", predicted, why) for item in items]
    predicted = float(np.sqrt(np.mean(np.concatenate([s.std for s in still]) ** 2)))
    count = float(np.median([len(s.std) for s in still]))
    where = _where(rest, still)
    rows = []
    for axis, item in enumerate(items):
        value = float(np.median([spread(s.moved[:, axis]) for s in still]))
        std = _MAD_LOSS * value * np.sqrt(_SHARED / (2 * count))
        note = f"{plain(value / scale)} px; {where}"
        rows.append(Row(FLOORS, item, Source.MEASURED, value, std, "mm", predicted=predicted, note=note))
    for axis, item in enumerate(items):
        middles = np.array([np.median(s.moved[:, axis]) for s in still])
        value = float(np.median(middles))
        std = 1.25 * float(np.median([spread(s.moved[:, axis]) for s in still])) * np.sqrt(_SHARED / count)
        note = f"{plain(value / scale)} px: bias, and whatever the sand itself has moved"
        mean = f"Mean motion of sand at rest, {item.removeprefix('Displacement ')}"
        rows.append(Row(FLOORS, mean, Source.MEASURED, value, std, "mm", note=note))
    return rows


def _where(rest: Rest | None, still: list[_Still]) -> str:
    """Which sand in which photographs."""
    assert rest is not None
    points = f"{np.median([len(s.std) for s in still]):.0f} points"
    pictures = f"{len(still)} photograph" + ("s" if len(still) > 1 else "")
    if rest.whole:
        return f"{points} in {pictures} before motion"
    return f"{points} below the tip or beyond the outcrop in {pictures}"


def _strain(scene: Scene, tracks: xr.Dataset, rest: Rest | None, found: Findings) -> list[Row]:
    """Strain of sand that rests, over the gauge of the maps."""
    assert found.calibration is not None
    gauge = gauge_px(scene.piv.subset_px, scene.piv.spacing_px or 0.0) * found.calibration.mm_per_px
    gradients, shears, floors = [], [], []
    for still in _still(tracks, rest)[:STRAINED]:
        field = strain_field(
            still.start, still.moved, gauge_px=gauge, std_px=still.std, measure=StrainMeasure.SMALL
        )
        known = np.isfinite(field.floor)
        gradients.append(field.gradient[known].ravel())
        shears.append(max_shear(field.strain[known]))
        floors.append(field.floor[known])
    places = sum(map(len, floors))
    if places < LEAST_POINTS:
        why = (
            "Too few points of the sand at rest lie within one gauge; the maps state their predicted floors."
        )
        return [untold(FLOORS, "Component of a displacement gradient", why, "1"),
                untold(FLOORS, "Maximum shear strain", why, "1")]  # fmt: skip
    stated = float(np.sqrt(np.mean(np.concatenate(floors) ** 2)))
    value = float(np.median([spread(g) for g in gradients if len(g) > 2]))
    shear = float(np.mean(np.concatenate(shears)))
    note = (
        f"within the gauge of {gauge:.3g} mm; subsets that overlap err alike, which the prediction leaves out"
    )
    return [
        Row(FLOORS, "Component of a displacement gradient", Source.MEASURED, value, unit="1",
            predicted=stated, note=note),
        Row(FLOORS, "Maximum shear strain", Source.MEASURED, shear, unit="1",
            predicted=SHEAR_FLOORS * stated, note="mean of what noise alone gives: it is never negative"),
    ]  # fmt: skip


def _has(found: Findings, source: str) -> bool:
    return found.layers is not None and bool((found.layers["source"] == source).any())


def _layers(layers: pd.DataFrame, rest: Rest | None, source: str) -> Row:
    """Height of a layer's points about a straight line, where the layer rests."""
    item = {"tracks": "Height of a tracked layer", "dye": "Height of a dyed layer"}[source]
    table = layers[(layers["source"] == source) & layers["y_mm"].notna()]
    frames = () if rest is None else (*rest.frames, *((rest.first,) if source == "dye" else ()))
    off, stated = [], []
    for _, line in table[table["frame"].isin(frames)].groupby(["frame", "layer"]):
        frame = int(line["frame"].iloc[0])
        x, y = line["x_mm"].to_numpy(float), line["y_mm"].to_numpy(float)
        assert rest is not None
        kept = x > rest.margin_mm if frame == rest.first else rest.ahead(frame, x)
        if kept.sum() >= LEAST_POINTS:
            off.append(off_line(x[kept], y[kept]))
            stated.append(line["std_mm"].to_numpy(float)[kept])
    note = "about straight lines, where the layers rest"
    if source == "dye":
        note += ": holds how evenly they were laid"
    return _scatter(item, off, stated, table["std_mm"].to_numpy(float), note)


def _surface(surface: pd.DataFrame, rest: Rest | None) -> Row:
    """Height of the surface about a straight line in the first photograph."""
    stated = surface["std_mm"].to_numpy(float)
    if rest is None:
        return _scatter("Height of the surface", [], [], stated, "")
    line = surface[(surface["frame"] == rest.first) & (surface["x_mm"] > rest.margin_mm)].dropna()
    off = [off_line(line["x_mm"].to_numpy(float), line["y_mm"].to_numpy(float))]
    note = "about a straight line in the first photograph: holds how evenly the sand was levelled"
    enough = len(line) >= LEAST_POINTS
    return _scatter(
        "Height of the surface", off if enough else [], [line["std_mm"].to_numpy(float)], stated, note
    )


def _scatter(item: str, off: list[Floats], stated: list[Floats], anywhere: Floats, note: str) -> Row:
    """A row of a scatter, mm; without one, what is stated on the whole."""
    if not off:
        known = anywhere[np.isfinite(anywhere) & (anywhere > 0)]
        predicted = float(np.sqrt(np.mean(known**2))) if known.size else NAN
        why = "not enough of it rests in any photograph"
        return _stated(item, "mm", predicted, why)
    values, expected = np.concatenate(off), np.concatenate(stated)
    value = spread(values)
    return Row(
        FLOORS,
        item,
        Source.MEASURED,
        value,
        _MAD_LOSS * value / np.sqrt(2 * len(values)),
        "mm",
        predicted=float(np.sqrt(np.nanmean(expected**2))),
        note=f"{note}; {len(values)} places",
    )


def _blade(found: Findings) -> Row:
    """The blade seen against the displacement of the log, about a straight line."""
    item = "Place of the blade"
    assert found.window is not None
    seen, std = found.window.blade.T
    u = found.frame_displacement_mm()
    known = np.isfinite(seen) & np.isfinite(u)
    predicted = float(np.nanmedian(std[known])) if np.isfinite(std[known]).any() else NAN
    by_log = found.displacement is not None and found.displacement.source == "log"
    if not by_log or known.sum() < LEAST_TRIPLES:
        why = "no displacement of the log to hold it against" if not by_log else "seen in too few photographs"
        return _stated(item, "mm", predicted, why)
    off = off_line(u[known], (seen - u)[known])
    value = spread(off)
    std_of = _MAD_LOSS * value / np.sqrt(2 * int(known.sum()))
    note = "about a straight line against the displacement of the log, whose noise it holds"
    return Row(FLOORS, item, Source.MEASURED, value, std_of, "mm", predicted=predicted, note=note)


def _bands(increments: pd.DataFrame) -> list[Row]:
    """Scatter of inclination and outcrop between increments of one band, from second differences."""
    rows = []
    for item, key, std_key, unit in (
        ("Inclination of a band, one increment", "beta_deg", "beta_std_deg", "degree"),
        ("Outcrop of a band, one increment", "outcrop_x_mm", "outcrop_std_mm", "mm"),
    ):
        stated = increments.loc[increments[key].notna(), std_key].to_numpy(float)
        predicted = float(np.nanmedian(stated)) if np.isfinite(stated).any() else NAN
        if not np.isfinite(predicted):
            continue
        second = _second_differences(increments, key)
        if second.size < LEAST_TRIPLES:
            why = f"fewer than {LEAST_TRIPLES} times three increments of one band in a row"
            rows.append(_stated(item, unit, predicted, why))
            continue
        value = 1.4826 * float(np.median(np.abs(second))) / np.sqrt(6)
        std = _MAD_LOSS * value / np.sqrt(2 * second.size / 2)
        note = f"scatter between increments, {second.size} second differences; bands do bend a little"
        rows.append(Row(FLOORS, item, Source.MEASURED, value, std, unit, predicted=predicted, note=note))
    return rows


def _second_differences(increments: pd.DataFrame, key: str) -> Floats:
    """Second differences of a column over three increments in a row of one band."""
    band, value = increments["band"].to_numpy(), increments[key].to_numpy(float)
    frame = increments["frame"].to_numpy()
    if len(value) < 3:
        return np.empty(0)
    alike = (band[:-2] == band[1:-1]) & (band[1:-1] == band[2:]) & (band[1:-1] >= 0)
    evenly = np.diff(frame, 2) == 0
    second = np.diff(value, 2)
    return np.asarray(second[alike & evenly & np.isfinite(second)])


def _force(force: ForceResult) -> list[Row]:
    """Force of one sample before motion, the displacement sensor, and the line of action."""
    record = force.record
    before = record["time_s"].to_numpy(float) < force.onset_s
    still = record.loc[before, "force_N"].to_numpy(float)
    still = still[np.isfinite(still)]
    rows = []
    if still.size >= LEAST_POINTS:
        value = float(np.std(still, ddof=1))
        note = f"{still.size} samples before motion; mean {plain(float(np.mean(still)))} N"
        rows.append(
            Row(FLOORS, "Force, one sample", Source.MEASURED, value, value / np.sqrt(2 * still.size), "N",
                predicted=force.noise_std_N, note=note)
        )  # fmt: skip
        travel = record.loc[before, "u_mm"].to_numpy(float)
        travel = travel[np.isfinite(travel)]
        if travel.size >= LEAST_POINTS:
            sensor = float(np.std(travel, ddof=1))
            rows.append(Row(FLOORS, "Displacement of the log, one sample", Source.MEASURED, sensor,
                            sensor / np.sqrt(2 * travel.size), "mm", note="before motion"))  # fmt: skip
    else:
        why = f"fewer than {LEAST_POINTS} samples before motion"
        rows.append(
            Row(
                FLOORS, "Force, one sample", Source.PREDICTED, unit="N", predicted=force.noise_std_N, note=why
            )
        )
    mean = force.mean_load
    why = f"by the budget at {mean.force_N:.3g} N, every source of uncertainty"
    rows.append(_stated("Force at the mean load", "N", mean.force_std_N, why))
    why = "by the budget at the mean load: at rest there is no force and so no line of action"
    rows.append(_stated("Line of action, one sample", "mm", mean.arm_std_mm, why))
    return rows
