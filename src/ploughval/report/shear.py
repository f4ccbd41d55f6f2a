"""Maps of maximum shear strain from tracked points: of one increment, and of all motion so far."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ploughval.piv.strain import (
    GAUGE_SPACINGS,
    SHEAR_FLOORS,
    StrainMeasure,
    gauge_px,
    max_shear,
    strain_field,
)
from ploughval.report.blocks import Chapter, Drawing, Pen
from ploughval.report.chapters import not_had
from ploughval.report.figures import shear_figure
from ploughval.report.figures.layers import Extent, stage
from ploughval.report.figures.shear import Band, ShearMap, highest
from ploughval.report.stages import increments_shown, view
from ploughval.report.text import number
from ploughval.results import Results
from ploughval.scene import Step

Values = NDArray[np.float64]
_NODES = 8  # of the map along a gauge
_REACH = 0.3  # of a gauge: a node further from every point has no strain


@dataclass(frozen=True, slots=True)
class _Pair:
    """Two rows of the tracks and what the points did between them."""

    place: Values  # (N, 2) mm, where strain is drawn
    reference: Values  # (N, 2) mm, where neighbours are counted
    moved: Values  # (N, 2) mm
    std: Values  # (N,) mm


@dataclass(frozen=True, slots=True)
class _Stage:
    """Both maps of a stage: frame, rows of the tracks before and after."""

    shown: tuple[int, int, int]
    increment: ShearMap
    total: ShearMap


def shear_chapter(results: Results, pen: Pen) -> Chapter | None:
    """Incremental and total maximum shear strain at the stages shown."""
    tracks = results.tracks
    if tracks is None:
        missing = not_had(results, Step.TRACKS, "The strain of the sand")
        return Chapter("shear", "Shear strain", notes=missing) if missing else None
    extent, gauge = view(results), gauge_mm(results)
    stages = [_stage(results, tracks, shown, extent, gauge) for shown in increments_shown(results)]
    tops = (highest([one.increment for one in stages]), highest([one.total for one in stages]))
    drawings = [_drawing(results, tracks, one, extent, tops, pen) for one in stages]
    if not drawings:
        return Chapter("shear", "Shear strain", notes=("No two photographs share enough tracked points.",))
    lead = (
        "Maximum shear strain (the difference of the principal strains), from planes put through the "
        f"displacements of all points within a circle of {number(gauge, 3)} mm. A band thinner than that is "
        "drawn as wide as the circle, its slip spread over it. No colour: no points. Dashed: the band of "
        "the increment. The colours of increments are those of all stages shown, and so are those of the "
        "strain since the start: stages compare."
    )
    return Chapter("shear", "Shear strain", lead=lead, grid=drawings)


def gauge_mm(results: Results) -> float:
    """Gauge length of the maps, mm: one and a half subsets."""
    scale = results.run.calibration.mm_per_px if results.run.calibration else None
    subset = results.setting("piv", "subset_px")
    spacing = results.setting("piv", "spacing_px") or 0.0
    if scale and subset:
        return float(scale) * gauge_px(float(subset), float(spacing))
    assert results.tracks is not None
    start = np.column_stack([results.tracks["x0_mm"], results.tracks["y0_mm"]])
    nearest = cKDTree(start).query(start, k=min(3, len(start)))[0][:, -1]
    return GAUGE_SPACINGS * float(np.median(nearest))


def _stage(
    results: Results,
    tracks: xr.Dataset,
    shown: tuple[int, int, int],
    extent: Extent,
    gauge: float,
) -> _Stage:
    """Both maps of a stage."""
    (frame, before, row), u = shown, tracks["u_mm"].to_numpy()
    surface = stage(results.surface, frame)
    increment, total = (
        shear_map(pair, measure, extent=extent, gauge=gauge, u_mm=float(u[row]), surface=surface)
        for pair, measure in (
            (_increment(tracks, before, row), StrainMeasure.SMALL),
            (_total(tracks, row), StrainMeasure.HENCKY),
        )
    )
    return _Stage(shown, increment, total)


def _drawing(
    results: Results,
    tracks: xr.Dataset,
    one: _Stage,
    extent: Extent,
    tops: tuple[float, float],
    pen: Pen,
) -> Drawing:
    (frame, before, row), u = one.shown, tracks["u_mm"].to_numpy()
    surface = stage(results.surface, frame)
    figure = shear_figure(
        (one.increment, one.total), tops=tops, u_mm=(float(u[before]), float(u[row])), extent=extent,
        surface=surface, band=_band(results, int(tracks["frame"].to_numpy()[before])),
        thickness_mm=results.thickness_mm,
    )  # fmt: skip
    words = f"from u = {u[before]:.1f} mm to {u[row]:.1f} mm"
    floors = " and ".join(number(m.floor, 2) for m in (one.increment, one.total))
    return pen.draw(
        figure,
        f"Maximum shear strain {words}, and since the start.",
        f"Frame {frame}: small strain of the increment {words} (above), logarithmic strain since u = 0 at "
        "the points' present places (below). "
        f"Gauge {number(one.total.gauge_mm, 3)} mm, noise floors {floors}.",
        name=f"shear-f{frame:03d}",
        data=("tracks.nc", "surface.csv", "increments.csv"),
    )


def _increment(tracks: xr.Dataset, before: int, after: int) -> _Pair:
    """Between two rows, at the later places."""
    first, last = _places(tracks, before), _places(tracks, after)
    std = np.sqrt(2.0) * tracks["std_mm"].to_numpy()[after]
    return _Pair(last, last, last - first, std)


def _total(tracks: xr.Dataset, row: int) -> _Pair:
    """Since the start along material points: neighbours of the start, drawn where they are now."""
    start = np.column_stack([tracks["x0_mm"], tracks["y0_mm"]])
    now = _places(tracks, row)
    return _Pair(now, start, now - start, tracks["std_mm"].to_numpy()[row])


def _places(tracks: xr.Dataset, row: int) -> Values:
    return np.column_stack([tracks["x_mm"].to_numpy()[row], tracks["y_mm"].to_numpy()[row]])


def shear_map(
    pair: _Pair,
    measure: StrainMeasure,
    *,
    extent: Extent,
    gauge: float,
    u_mm: float,
    surface: pd.DataFrame | None,
) -> ShearMap:
    """Maximum shear strain on a grid over the sand ahead of the blade, NaN where it is not known.

    A node takes the reference place of its nearest point and the strain of the neighbours about that.
    """
    good = np.isfinite(pair.moved).all(axis=1)
    x0, x1, y0, y1 = extent
    step = gauge / _NODES
    x, y = np.arange(x0, x1, step), np.arange(y0, y1, step)
    values = np.full((len(y), len(x)), np.nan)
    whole = (x0, x0 + len(x) * step, y0, y0 + len(y) * step)
    if good.sum() < 4:
        return ShearMap(values, whole, np.nan, gauge)
    nodes = np.stack(np.meshgrid(x + step / 2, y + step / 2), axis=-1).reshape(-1, 2)
    distance, nearest = cKDTree(pair.place[good]).query(nodes)
    inside = (distance < _REACH * gauge) & (nodes[:, 0] > u_mm) & _below(nodes, surface)
    about = pair.reference[good][nearest[inside]] + nodes[inside] - pair.place[good][nearest[inside]]
    field = strain_field(
        pair.reference[good],
        pair.moved[good],
        gauge_px=gauge,
        std_px=pair.std[good],
        measure=measure,
        at=about,
    )
    shear = max_shear(field.strain)
    floor = SHEAR_FLOORS * field.floor
    values.ravel()[np.flatnonzero(inside)] = shear
    typical = float(np.nanmedian(floor)) if np.isfinite(floor).any() else np.nan
    return ShearMap(values, whole, typical, gauge)


def _below(nodes: Values, surface: pd.DataFrame | None) -> NDArray[np.bool_]:
    """Whether nodes lie in the sand, as far as its surface was seen."""
    if surface is None:
        return np.ones(len(nodes), bool)
    line = surface.dropna(subset=["x_mm", "y_mm"]).sort_values("x_mm")
    if line.empty:
        return np.ones(len(nodes), bool)
    return np.asarray(nodes[:, 1] < np.interp(nodes[:, 0], line["x_mm"], line["y_mm"]))


def _band(results: Results, frame: int) -> Band | None:
    """Band of the increment that starts with a frame."""
    if results.increments is None:
        return None
    rows = results.increments[results.increments["frame"] == frame]
    if not len(rows) or not np.isfinite(rows[["beta_deg", "outcrop_x_mm"]].iloc[0].to_numpy(float)).all():
        return None
    row = rows.iloc[0]
    return Band(float(row["u_mm"] + row["du_mm"] / 2), float(row["beta_deg"]), float(row["outcrop_x_mm"]))
