"""Model against experiment for one test: every metric with both sides' uncertainty and its verdict."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.compare.bands import band_quantities, match_bands
from ploughval.compare.curve import Curve, measured_curve, model_curve
from ploughval.compare.history import history_metrics
from ploughval.compare.layers import Distances, line_distances, rms, surface_as_layer
from ploughval.compare.mobilised import mobilised_table
from ploughval.compare.peaks import (
    MISSING,
    Quantity,
    find_extremes,
    force_quantities,
    least_prominence,
)
from ploughval.compare.validation import (
    NAN,
    Metric,
    Perturbed,
    distance,
    input_stds,
    judge,
    perturbed_runs,
)
from ploughval.scene import Scene

if TYPE_CHECKING:
    from ploughval.model import History

Floats = NDArray[np.float64]
_STAGES = 5  # frames at which the inputs' effect on the lines is read


@dataclass(frozen=True, slots=True)
class Comparison:
    """What the comparison of a test found.

    Attributes
    ----------
    metrics : tuple of Metric
    mobilised : DataFrame or None
        frame, u_mm, band, slip_mm, phi_deg, phi_std_deg, beta_deg, weight_N, force_N, status.
    layer_distances : DataFrame or None
        frame, u_mm, layer, source, points, beyond, rms_mm, median_mm, p95_mm, std_mm.
    band_pairs : DataFrame or None
        band, u_start_mm, u_end_mm, beta_deg, outcrop_x_mm of either side (_experiment, _model).
    peaks : DataFrame or None
        source (experiment or model), kind (peak or trough), u_mm, force_N and what describes them.
    """

    metrics: tuple[Metric, ...]
    mobilised: pd.DataFrame | None = None
    layer_distances: pd.DataFrame | None = None
    band_pairs: pd.DataFrame | None = None
    peaks: pd.DataFrame | None = None


@dataclass(frozen=True, slots=True)
class _Case:
    """The model's side of a comparison: the run, and the runs with changed soil."""

    scene: Scene
    history: "History"
    runs: tuple[Perturbed, ...]

    @property
    def depth_mm(self) -> float:
        return self.scene.blade.depth_mm

    def inputs(self, values: Callable[["History"], Mapping[str, Quantity]]) -> Mapping[str, float]:
        """Standard uncertainty that the soil's leaves in every value of a history."""

        def plain(one: "History") -> dict[str, float]:
            return {name: quantity.value for name, quantity in values(one).items()}

        ends = [(plain(run.histories[0]), plain(run.histories[1]), run.span) for run in self.runs]
        return input_stds(ends)

    def numerical(self, value: Quantity) -> tuple[float, float]:
        """A model's value with its numerical uncertainty: its own, or the tolerance's share of it."""
        std = value.std if value.std > 0 else self.scene.model.tolerance * abs(value.value)
        return value.value, std


def compare_test(
    scene: Scene,
    history: "History",
    *,
    force: pd.DataFrame | None,
    bands: pd.DataFrame | None,
    layers: pd.DataFrame | None,
    surface: pd.DataFrame | None,
) -> Comparison:
    """Compare a model run with what was measured.

    Parameters
    ----------
    scene : Scene
        Blade, soil with its standard uncertainties, tolerance and the least prominence of a peak.
    history : ploughval.model.History
        The model's run of the same scene.
    force : DataFrame or None
        FORCE_COLUMNS.
    bands : DataFrame or None
        BAND_COLUMNS.
    layers : DataFrame or None
        LAYER_COLUMNS.
    surface : DataFrame or None
        SURFACE_COLUMNS.

    Returns
    -------
    Comparison
        Metrics of a table that is None are absent; a value that one side does not have is NaN with a note.
    """
    end_mm = float(history.force["u_mm"].iloc[-1])
    case = _Case(scene, history, perturbed_runs(scene, history, end_mm))
    curve = None if force is None else measured_curve(force, case.depth_mm)
    metrics: list[Metric] = []
    peaks = pairs = mobilised = table = None
    if curve is not None:
        found, peaks = _force(case, curve)
        metrics += found
    if bands is not None:
        found, pairs = _bands(case, bands, [t for t in (layers, surface) if t is not None])
        metrics += found
    if layers is not None:
        found, table = _layers(case, layers)
        metrics += found
    if surface is not None:
        metrics += _surface(case, surface)
    if curve is not None and bands is not None and surface is not None and scene.soil is not None:
        mobilised = mobilised_table(scene, curve, bands, surface)
        metrics += _residual(case, mobilised)
    return Comparison(tuple(metrics), mobilised, table, pairs, peaks)


def metrics_mapping(comparison: Comparison) -> dict[str, dict[str, Any]]:
    """The metrics as they stand in metrics.json: by name, with None for what could not be had."""

    def plain(value: Any) -> Any:
        return None if isinstance(value, float) and not np.isfinite(value) else value

    keys = (
        "unit",
        "experiment",
        "experiment_std",
        "model",
        "model_std",
        "error",
        "validation_std",
        "agrees",
        "note",
    )
    return {m.name: {key: plain(getattr(m, key)) for key in keys} for m in comparison.metrics}


def _force(case: _Case, measured: Curve) -> tuple[list[Metric], pd.DataFrame]:
    history, depth = case.history, case.depth_mm
    P0 = float(history.P0_N * history.horizontal_share)

    def curve_of(one: "History") -> Curve:
        return model_curve(one.force, one.force_std_N, one.horizontal_share)

    model = curve_of(history)
    limit = min(measured.end_mm, model.end_mm)
    measured, model = measured.until(limit), model.until(limit)
    prominence = least_prominence(measured, P0, case.scene.compare.prominence)

    def values(one: "History") -> Mapping[str, Quantity]:
        curve = curve_of(one).until(limit)
        return force_quantities(curve, find_extremes(curve, prominence), depth)

    extremes = {"experiment": find_extremes(measured, prominence), "model": find_extremes(model, prominence)}
    metrics = _joined(
        case,
        force_quantities(measured, extremes["experiment"], depth),
        values,
        f"over {limit:.4g} mm of travel",
    )
    curves = [(curve_of(run.histories[0]), curve_of(run.histories[1]), run.span) for run in case.runs]
    metrics += history_metrics(measured, model, extremes, curves, P0_N=P0, depth_mm=depth)
    tables = [table.assign(source=side) for side, table in extremes.items()]
    peaks = pd.concat(tables, ignore_index=True)
    return metrics, peaks[["source", *(name for name in peaks.columns if name != "source")]]


def _joined(
    case: _Case,
    measured: Mapping[str, Quantity],
    values: Callable[["History"], Mapping[str, Quantity]],
    note: str,
) -> list[Metric]:
    """Measured scalars set against the model's of the same name; those that neither has are left out."""
    predicted, inputs = values(case.history), case.inputs(values)
    metrics = []
    for name, experiment in measured.items():
        model = predicted.get(name, MISSING)
        missing = [
            side
            for side, value in (("experiment", experiment), ("model", model))
            if not np.isfinite(value.value)
        ]
        if len(missing) == 2:
            continue
        said = f"{note}; none in the {missing[0]}" if missing else note
        if not case.runs:
            said += "; no uncertainty of the soil is stated"
        numerical = (model.value, 0.0) if name.endswith("_count") else case.numerical(model)
        metrics.append(judge(name, experiment, numerical, input_std=inputs.get(name, 0.0), note=said))
    return metrics


def _bands(
    case: _Case, measured: pd.DataFrame, framed: Sequence[pd.DataFrame]
) -> tuple[list[Metric], pd.DataFrame]:
    travels = [float(table["u_mm"].max()) for table in framed if len(table)]
    end = max([float(measured["u_end_mm"].max())] if len(measured) else [], default=NAN)
    end = np.nanmax([end, *travels]) if travels or np.isfinite(end) else NAN
    limit = float(np.nanmin([end, float(case.history.force["u_mm"].iloc[-1])]))
    start_std = _frame_interval(framed) / np.sqrt(12.0)
    note = f"bands that begin within {limit:.4g} mm of travel"

    def values(one: "History") -> Mapping[str, Quantity]:
        return band_quantities(one.bands, limit, 0.0)

    both = dict(band_quantities(measured, limit, start_std))
    frequency = both.pop("band_frequency")
    metrics = _joined(case, both, values, note)
    predicted, inputs = values(case.history)["band_frequency"], case.inputs(values)
    if np.isfinite(frequency.value) and np.isfinite(predicted.value):
        scale = 1 / frequency.value
        metrics.append(
            judge(
                "band_frequency_ratio",
                (1.0, frequency.std * scale),
                case.numerical(Quantity(predicted.value * scale, 0.0)),
                input_std=inputs.get("band_frequency", 0.0) * scale,
                note=f"model over experiment, new bands a travel; {note}",
            )
        )
    within = case.history.bands[case.history.bands["u_start_mm"] < limit]
    pairs = match_bands(measured, within, case.depth_mm)
    alone = [int(pairs[f"band_{side}"].isna().sum()) for side in ("model", "experiment")]
    matched = len(pairs) - sum(alone)
    metrics.append(
        Metric("bands_matched_count", "1", float(matched), model=float(matched), note=f"one to one; {note}")
    )
    metrics.append(
        Metric(
            "bands_unmatched_count",
            "1",
            float(alone[0]),
            model=float(alone[1]),
            note="bands without a partner",
        )
    )
    return metrics, pairs


def _frame_interval(framed: Sequence[pd.DataFrame]) -> float:
    """Travel between frames, mm: a band's start is known no better than that."""
    for table in framed:
        steps = np.diff(np.unique(table["u_mm"].dropna().to_numpy(dtype=np.float64)))
        if steps.size:
            return float(np.median(steps))
    return NAN


def _frames(table: pd.DataFrame, end_mm: float) -> tuple[pd.DataFrame, NDArray[np.int64], Floats]:
    """Rows of a measured table that the model's travel covers, its frames and their travel."""
    inside = table[(table["u_mm"] >= 0) & (table["u_mm"] <= end_mm)]
    stages = inside.drop_duplicates("frame").sort_values("frame", kind="stable")
    return inside, stages["frame"].to_numpy(dtype=np.int64), stages["u_mm"].to_numpy(dtype=np.float64)


def _layers(case: _Case, measured: pd.DataFrame) -> tuple[list[Metric], pd.DataFrame | None]:
    history = case.history
    inside, frames, u = _frames(measured, float(history.force["u_mm"].iloc[-1]))
    if not len(frames):
        return [], None
    heights = tuple(float(h) for h in sorted(inside["layer"].dropna().unique()))
    found = line_distances(inside, history.layers(heights, u, frames))

    def lines(one: "History", picked: NDArray[np.int64]) -> pd.DataFrame:
        return pd.DataFrame(one.layers(heights, u[picked], frames[picked]))

    return _line_metrics(case, "layers", found, len(frames), lines), found.table


def _surface(case: _Case, measured: pd.DataFrame) -> list[Metric]:
    inside, frames, u = _frames(measured, float(case.history.force["u_mm"].iloc[-1]))
    if not len(frames):
        return []
    inside = surface_as_layer(inside)

    def lines(one: "History", picked: NDArray[np.int64]) -> pd.DataFrame:
        parts = []
        end = float(one.force["u_mm"].iloc[-1])
        for k in picked[u[picked] <= end]:
            line = np.asarray(one.surface(float(u[k])), dtype=np.float64)
            parts.append(
                pd.DataFrame({"frame": frames[k], "u_mm": u[k], "x_mm": line[:, 0], "y_mm": line[:, 1]})
            )
        empty = pd.DataFrame(columns=["frame", "u_mm", "x_mm", "y_mm"], dtype=np.float64)
        return surface_as_layer(pd.concat(parts, ignore_index=True) if parts else empty)

    found = line_distances(inside, lines(case.history, np.arange(len(frames))))
    return _line_metrics(case, "surface", found, len(frames), lines)


def _line_metrics(
    case: _Case,
    name: str,
    found: Distances,
    count: int,
    lines: Callable[["History", NDArray[np.int64]], pd.DataFrame],
) -> list[Metric]:
    """rms, median and 95 % of all points' distances, with what measurement and inputs explain of them."""
    d = found.distance_mm
    if d.size == 0:
        return []
    picked = np.unique(np.linspace(0, count - 1, min(_STAGES, count)).round().astype(np.int64))

    def moved(run: Perturbed) -> float:
        up, down = (lines(one, picked) for one in run.histories)
        return rms(line_distances(up, down).distance_mm) / run.span

    inputs = float(np.linalg.norm([moved(run) for run in case.runs]))
    model_std = float(np.hypot(inputs, case.scene.model.tolerance * case.depth_mm))
    beyond = int(found.table["beyond"].sum())
    note = f"normal distance of {d.size} points in {count} frames; {beyond} beyond the model's lines left out"
    values = (("rms", rms(d)), ("median", float(np.median(d))), ("p95", float(np.percentile(d, 95))))
    return [
        distance(
            f"{name}_{kind}_mm",
            value,
            experiment_std=rms(found.std_mm) if kind == "rms" else NAN,
            model_std=model_std if kind == "rms" else NAN,
            note=note,
        )
        for kind, value in values
    ]


def _residual(case: _Case, mobilised: pd.DataFrame) -> list[Metric]:
    """Friction mobilised after softening, against the residual angle that the model was given."""
    soil = case.scene.soil
    if soil is None:
        return []
    late = mobilised[(mobilised["status"] == "ok") & (mobilised["slip_mm"] > soil.mobilization_length_mm)]
    if not len(late):
        return []
    experiment = (float(late["phi_deg"].median()), float(late["phi_std_deg"].median()))
    note = (
        f"median of {len(late)} frames with more slip than the mobilization length; the model's is its input"
    )
    return [
        judge(
            "mobilised_residual_deg",
            experiment,
            (soil.residual_friction_deg, 0.0),
            input_std=soil.residual_friction_std_deg,
            note=note,
        )
    ]
