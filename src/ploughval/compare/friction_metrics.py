"""Metrics of the friction that is read from the photographs and the force."""

import pandas as pd

from ploughval.compare.case import Case
from ploughval.compare.validation import Metric, judge


def friction_metrics(case: Case, mobilised: pd.DataFrame) -> list[Metric]:
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
