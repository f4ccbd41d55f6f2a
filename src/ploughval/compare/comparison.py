"""Model against experiment for one test: every metric with both sides' uncertainty and its verdict."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from ploughval.compare.bands.metrics import band_metrics
from ploughval.compare.case import Case
from ploughval.compare.ensemble import draw_ensemble
from ploughval.compare.force.curve import Curve, measured_curve
from ploughval.compare.force.metrics import compare_force
from ploughval.compare.friction_metrics import friction_metrics, unread_friction
from ploughval.compare.lines.metrics import layer_metrics, surface_metrics
from ploughval.compare.mobilised.frames import mobilised_table
from ploughval.compare.mound.metrics import mound_metrics
from ploughval.compare.softening.table import FrictionFindings, read_friction
from ploughval.compare.validation import Metric
from ploughval.scene import Scene

if TYPE_CHECKING:
    from ploughval.model import History


@dataclass(frozen=True, slots=True)
class Comparison:
    """What the comparison of a test found.

    Attributes
    ----------
    metrics : tuple of Metric
    mobilised : DataFrame or None
        frame, u_mm, band, slip_mm, phi_deg, phi_std_deg, beta_deg, weight_N, force_N, status.
    mobilised_curve : DataFrame or None
        CURVE_COLUMNS of ploughval.compare.mobilised.curve: the same by steps of travel, between photographs.
    softening : DataFrame or None
        SOFTENING_COLUMNS of ploughval.compare.softening.table: peak, residual and length by band.
    layer_distances : DataFrame or None
        DISTANCE_COLUMNS of ploughval.compare.lines.distances, a row a frame and layer.
    mound : DataFrame or None
        MOUND_COLUMNS of ploughval.compare.mound.history: crest, face, front, slope and area of both sides.
    band_pairs : DataFrame or None
        PAIR_COLUMNS of ploughval.compare.bands.pairs: what matches what, with differences.
    peaks : DataFrame or None
        source (experiment or model), kind (peak or trough), u_mm, force_N and what describes them.
    peak_pairs : DataFrame or None
        Switches of both sides that match: place, height, drop and spacing, their errors and uncertainties.
    force_envelope : DataFrame or None
        The model's force with the limits that its inputs leave, by travel.
    """

    metrics: tuple[Metric, ...]
    mobilised: pd.DataFrame | None = None
    mobilised_curve: pd.DataFrame | None = None
    softening: pd.DataFrame | None = None
    layer_distances: pd.DataFrame | None = None
    mound: pd.DataFrame | None = None
    band_pairs: pd.DataFrame | None = None
    peaks: pd.DataFrame | None = None
    peak_pairs: pd.DataFrame | None = None
    force_envelope: pd.DataFrame | None = None


def compare_test(
    scene: Scene,
    history: "History",
    *,
    force: pd.DataFrame | None,
    bands: pd.DataFrame | None,
    layers: pd.DataFrame | None,
    surface: pd.DataFrame | None,
    increments: pd.DataFrame | None = None,
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
        LAYER_COLUMNS; ``calibration_std_mm`` where that is known.
    surface : DataFrame or None
        SURFACE_COLUMNS; ``std_mm`` and ``calibration_std_mm`` where they are known.
    increments : DataFrame or None
        INCREMENT_COLUMNS: whether outcrops creep; None: they are taken to stay.

    Returns
    -------
    Comparison
        Metrics of a table that is None are absent; a value that one side does not have is NaN with a note,
        and so is the friction before a blade that leans, which is not read.
    """
    end_mm = float(history.force["u_mm"].iloc[-1])
    case = Case(scene, history, draw_ensemble(scene, history, end_mm))
    curve = None if force is None else measured_curve(force, case.depth_mm)
    metrics: list[Metric] = []
    friction: FrictionFindings | None = None
    peaks = switches = envelope = mobilised = None
    if force is not None and curve is None:
        note = "the record has too few rows with a force and a travel, in order"
        metrics.append(Metric("force_mean_N", "N", note=note))
    if curve is not None:
        found, peaks, switches, envelope = compare_force(case, curve)
        metrics += found
    found, shapes = _compare_shapes(case, bands, layers, surface)
    metrics += found
    if curve is not None and bands is not None and surface is not None and scene.soil is not None:
        found, friction, mobilised = _compare_friction(case, curve, bands, surface, increments)
        metrics += found
    return Comparison(
        tuple(metrics),
        mobilised=mobilised,
        mobilised_curve=None if friction is None else friction.curve,
        softening=None if friction is None else friction.softening,
        peaks=peaks,
        peak_pairs=switches,
        force_envelope=envelope,
        **shapes,
    )


def _compare_friction(
    case: Case, curve: Curve, bands: pd.DataFrame, surface: pd.DataFrame, increments: pd.DataFrame | None
) -> tuple[list[Metric], FrictionFindings | None, pd.DataFrame | None]:
    """Friction mobilised on the bands; before a blade that leans it is not read."""
    if case.scene.blade.inclination_deg != 0.0:
        return unread_friction(case), None, None
    friction = read_friction(case.scene, curve, bands, surface, increments)
    mobilised = mobilised_table(case.scene, curve, bands, surface, friction.origins_mm, increments)
    return friction_metrics(case, mobilised, friction), friction, mobilised


def _compare_shapes(
    case: Case, bands: pd.DataFrame | None, layers: pd.DataFrame | None, surface: pd.DataFrame | None
) -> tuple[list[Metric], dict[str, pd.DataFrame | None]]:
    """What the photographs show against the model: metrics, and tables by their names in a Comparison."""
    metrics: list[Metric] = []
    tables: dict[str, pd.DataFrame | None] = {}
    if bands is not None:
        found, tables["band_pairs"] = band_metrics(
            case, bands, [t for t in (layers, surface) if t is not None]
        )
        metrics += found
    if layers is not None:
        found, tables["layer_distances"] = layer_metrics(case, layers)
        metrics += found
    if surface is not None:
        found, tables["mound"] = mound_metrics(case, surface)
        metrics += surface_metrics(case, surface) + found
    return metrics, tables


def metrics_mapping(comparison: Comparison) -> dict[str, dict[str, Any]]:
    """The metrics as they stand in metrics.json.

    Parameters
    ----------
    comparison : Comparison
        Of one test.

    Returns
    -------
    dict
        The attributes of each :class:`Metric` by its name, with None for what could not be had.
    """

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
        "input_std",
        "numerical_std",
        "dominant_input",
    )
    return {m.name: {key: plain(getattr(m, key)) for key in keys} for m in comparison.metrics}
