"""Rows of the correlation and of strain: what was set, what the program does, what benchmarks say."""

from dataclasses import dataclass

import numpy as np

from ploughval.axes import Status
from ploughval.piv.references import RENEW, WORN
from ploughval.piv.strain import GAUGE_SUBSETS, gauge_px
from ploughval.run import provenance
from ploughval.run.findings import Findings
from ploughval.run.practice.rows import Group, Row, Source, untold
from ploughval.scene import Scene, Step
from ploughval.tracers.points import spacing_px

CORRELATION, STRAIN = Group.CORRELATION, Group.STRAIN
_ORDERS = ("a shift (order 0)", "affine (order 1)", "second order (order 2)")
_SPLINES = {3: "cubic B-spline", 5: "quintic B-spline"}
_ADAPTS = (
    "where residuals and neighbours call for it: second order, two sides and a band, or a smaller window "
    "beside a band"
)


@dataclass(frozen=True, slots=True)
class Benchmark:
    """What reports/speed-error says of subset, order and spline; px.

    bias_px, bias_noise_px : largest bias over shifts of 0 to 1 px, without noise and with 3 grey levels
    (piv.csv); period_px : of the motion that is measured at 90 % (piv-settings.csv)
    """

    bias_px: float
    bias_noise_px: float
    period_px: float


BENCHMARKS = {(31, 1, 5): Benchmark(bias_px=0.0005, bias_noise_px=0.001, period_px=46.0)}


def correlation_rows(scene: Scene, found: Findings) -> list[Row]:
    """How points were found again, and how many were."""
    if Step.TRACKS not in scene.steps or found.calibration is None or found.frames is None:
        return []
    piv, scale = scene.piv, found.calibration.mm_per_px
    side, step = side_px(scene), spacing_px(scene.piv)
    first = found.frames.name(_first(found))
    return [
        _fixed("Software", f"ploughval {provenance.ploughval_version()}"),
        _fixed("Matching criterion", "zero-mean normalised sum of squared differences"),
        _fixed("Optimisation", "inverse-compositional Gauss-Newton"),
        _fixed("Filter", "none of the grey levels; a low pass of their slopes, chosen by the noise"),
        _fixed("Reference", f"{first}; renewed for a point whose correlation stays below {RENEW:g} of its "
               f"first for {WORN} photographs"),
        _set("Subset", side, "px", f"{side * scale:.3g} mm"),
        _set("Step", step, "px", f"{step * scale:.3g} mm; a third of it along layers, twice it below the tip",
             given=piv.spacing_px is not None),
        Row(CORRELATION, "Shape function", Source.SETTING, text=_ORDERS[piv.order], note=_ADAPTS),
        Row(CORRELATION, "Interpolant", Source.SETTING, text=_SPLINES[piv.spline]),
        _set("Least correlation", piv.zncc_min, "1", "of what noise leaves; and a normalised median test"),
        *_followed(found),
        *_benchmarks(scene, scale),
    ]  # fmt: skip


def side_px(scene: Scene) -> int:
    """Side of the subsets, px: odd."""
    return scene.piv.subset_px + 1 - scene.piv.subset_px % 2


def _first(found: Findings) -> int:
    """Number of the first photograph that was looked at."""
    assert found.frames is not None
    seen = [k for k in range(len(found.frames)) if k not in found.lost_frames]
    return seen[0] if seen else 0


def _fixed(item: str, text: str) -> Row:
    return Row(CORRELATION, item, Source.PROGRAM, text=text)


def _set(item: str, value: float, unit: str, note: str, *, given: bool = True) -> Row:
    source = Source.SETTING if given else Source.PROGRAM
    return Row(CORRELATION, item, source, float(value), unit=unit, note=note)


def _followed(found: Findings) -> list[Row]:
    """Points, how many were followed to the end and why others were not."""
    if found.tracks is None:
        return []
    status = found.tracks["status"].to_numpy()
    count = status.shape[1]
    grid = int(np.isnan(found.tracks["layer_mm"].to_numpy()).sum())
    points = Row(CORRELATION, "Points", Source.MEASURED, float(count), unit="1",
                 note=f"{grid} on the grid, {count - grid} on layers")  # fmt: skip
    seen = np.flatnonzero((status != Status.FRAME_MISSING).any(axis=1)) if count else np.empty(0, int)
    if not count or not seen.size:
        return [points]
    last = status[seen[-1]]
    followed = np.isin(last, (Status.OK, Status.REPLACED))
    lost = sorted(
        ((int(np.sum(last == s)), s.meaning.replace("_", " ")) for s in Status if s != Status.OK),
        reverse=True,
    )
    why = ", ".join(f"{100 * n / count:.1f} % {name}" for n, name in lost[:4] if n)
    share = 100 * float(followed.mean())
    zncc = found.tracks["zncc"].to_numpy()[seen[-1]][followed]
    rows = [
        points,
        Row(CORRELATION, "Followed to the end", Source.MEASURED, share, unit="%", note=why),
    ]
    if zncc.size:
        middle = float(np.median(zncc))
        note = "of the points in the last photograph"
        rows.append(
            Row(CORRELATION, "Median correlation at the end", Source.MEASURED, middle, unit="1", note=note)
        )
    return rows


def _benchmarks(scene: Scene, scale: float) -> list[Row]:
    """Bias and resolution that were measured on made pictures with the same settings."""
    key = (side_px(scene), scene.piv.order, scene.piv.spline)
    known = BENCHMARKS.get(key)
    bias, period = "Bias of interpolation, at most", "Period of a motion that is measured at 90 %"
    if known is None:
        usual = "; ".join(f"subset {s} px, order {o}, spline {p}" for s, o, p in BENCHMARKS)
        remedy = f"Measured for {usual} alone; others with: ploughval bench."
        return [untold(CORRELATION, bias, remedy, "px"), untold(CORRELATION, period, remedy, "px")]
    return [
        Row(CORRELATION, bias, Source.BENCHMARK, known.bias_px, unit="px",
            note=f"{known.bias_noise_px:g} px with noise of 3 grey levels; reports/speed-error/piv.csv"),
        Row(CORRELATION, period, Source.BENCHMARK, known.period_px, unit="px",
            note=f"{known.period_px * scale:.3g} mm; reports/speed-error/piv-settings.csv"),
    ]  # fmt: skip


def strain_rows(scene: Scene, found: Findings) -> list[Row]:
    """Measures of strain and their gauges; docs/good-practice.md, Eqs (5) and (6)."""
    if Step.TRACKS not in scene.steps or found.calibration is None:
        return []
    scale, side, step = found.calibration.mm_per_px, side_px(scene), spacing_px(scene.piv)
    gauge = gauge_px(scene.piv.subset_px, scene.piv.spacing_px or 0.0)
    points = int(gauge / step) + 1
    virtual = (points - 1) * step + side
    return [
        Row(STRAIN, "Measure", Source.PROGRAM,
            text="small strain of an increment; logarithmic (Hencky) strain since the start",
            note="least-squares plane through the displacements within the gauge; shear as the difference of "
            "the principal strains"),
        Row(STRAIN, "Gauge", Source.PROGRAM, gauge, unit="px",
            note=f"{gauge * scale:.3g} mm: diameter of the circle of points, {GAUGE_SUBSETS:g} subsets or "
            "three spacings"),
        Row(STRAIN, "Virtual strain gauge", Source.PROGRAM, virtual, unit="px",
            note=f"{virtual * scale:.3g} mm: ({points} points - 1) x step + subset, all pixels that one "
            "strain rests on"),
    ]  # fmt: skip
