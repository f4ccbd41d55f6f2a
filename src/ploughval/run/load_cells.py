"""What the load cells say beyond the force record: the force at each photograph, and how it came about."""

from dataclasses import asdict
from typing import Any

import numpy as np
import pandas as pd

from ploughval.loadcells import ForceResult, force_at
from ploughval.run.findings import Findings


def force_at_frames(found: Findings) -> pd.DataFrame | None:
    """Force and line of action at each photograph, the clocks' doubt carried.

    Parameters
    ----------
    found : Findings
        With force, photographs and their displacement.

    Returns
    -------
    DataFrame or None
        FORCE_AT_COLUMNS, times on the log's clock. None where photographs and log share no clock.
    """
    moved, frames = found.displacement, found.frames
    if found.force is None or frames is None or moved is None or moved.source != "log":
        return None
    doubt = np.hypot(moved.clock_offset_std_s, frames.time_std_s)
    return force_at(found.force.record, frames.time_s - moved.clock_offset_s, doubt)


def load_cell_record(force: ForceResult) -> dict[str, Any]:
    """How the force came about, for run.json: from zeros and friction to motion and contact."""
    friction, contact = force.friction, force.contact
    return {
        "zero_Nm": force.zero_Nm.tolist(),
        "zero_std_Nm": force.zero_std_Nm.tolist(),
        "noise_std_Nm": force.noise_std_Nm.tolist(),
        "noise_std_N": force.noise_std_N,
        "mean_load": asdict(force.mean_load),
        "drift_Nm": force.drift_Nm.tolist(),
        "friction": None
        if friction is None
        else {
            "runs": friction.runs,
            "mean_N": force.friction_mean_N,
            "taken_off": friction.reason,
            "pieces": friction.features.shape[1],
            "reading": friction.features.mean(axis=1).tolist(),
        },
        "calibration": force.calibration.model,
        "condition": force.calibration.condition,
        "bandwidth_Hz": force.bandwidth_Hz,
        "motion_starts_s": force.onset_s,
        "contact_s": None if contact is None else contact.time_s,
        "contact_u_mm": None if contact is None else contact.u_mm,
        "contact_std_mm": None if contact is None else contact.std_mm,
    }
