"""Records of a result folder: run.json, metrics.json and fit.json; what could not be had is None."""

import math
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict


def _finite(value: object) -> object:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _text(value: object) -> object:
    return "" if value is None else str(value)


Number = Annotated[float | None, BeforeValidator(_finite)]
Text = Annotated[str, BeforeValidator(_text)]


class _Entry(BaseModel):
    """Base of every record; a field may be called model_std, which pydantic keeps for itself before 2.10."""

    model_config = ConfigDict(frozen=True, extra="ignore", protected_namespaces=())


class FrameEntry(_Entry):
    """One line of the frame ledger."""

    frame: int
    file: Text = ""
    time_s: Number = None
    time_std_s: Number = None
    u_mm: Number = None
    status: Text = "ok"
    reason: Text = ""
    notes: tuple[Text, ...] = ()

    @property
    def used(self) -> bool:
        """Whether the frame went through."""
        return self.status == "ok"


class CalibrationEntry(_Entry):
    """How pixels became millimetres."""

    method: Text = ""
    mm_per_px: Number = None
    scale_std: Number = None
    residual_px: Number = None


class NoiseEntry(_Entry):
    """Noise of the camera against grey level."""

    grey: tuple[float, ...]
    std: tuple[float, ...]
    std_std: tuple[float, ...]
    gain: Number = None
    floor: Number = None
    misfit: Number = None
    mean_grey: Number = None
    std_at_mean_grey: Number = None


class FrictionEntry(_Entry):
    """What was taken off for friction."""

    runs: int = 0
    mean_N: Number = None
    taken_off: Text = ""
    pieces: int = 1


class MeanLoadEntry(_Entry):
    """What the budget of the force adds up to."""

    force_N: Number = None
    force_std_N: Number = None
    arm_mm: Number = None
    arm_std_mm: Number = None


class LoadCellEntry(_Entry):
    """How the force came about; pairs are of the (upper, lower) cell."""

    zero_Nm: tuple[Number, ...] = ()
    zero_std_Nm: tuple[Number, ...] = ()
    noise_std_Nm: tuple[Number, ...] = ()
    noise_std_N: Number = None
    mean_load: MeanLoadEntry | None = None
    drift_Nm: tuple[Number, ...] = ()
    friction: FrictionEntry | None = None
    calibration: Text = ""
    condition: Number = None
    bandwidth_Hz: Number = None
    motion_starts_s: Number = None
    contact_s: Number = None
    contact_u_mm: Number = None
    contact_std_mm: Number = None


class RunRecord(_Entry):
    """run.json: versions, settings, inputs, frames."""

    ploughval: Text = ""
    test: Text = ""
    folder: Text = ""
    settings: dict[str, Any] = {}
    settings_hash: Text = ""
    versions: dict[str, Text] = {}
    inputs: dict[str, Text] = {}
    steps: tuple[str, ...] = ()
    frames: tuple[FrameEntry, ...] = ()
    calibration: CalibrationEntry | None = None
    loadcells: LoadCellEntry | None = None
    noise: NoiseEntry | None = None
    complete: bool = False
    timings_s: dict[str, Number] = {}
    faults: tuple[Text, ...] = ()
    warnings: tuple[Text, ...] = ()


class MetricEntry(_Entry):
    """One metric of metrics.json; None is a value that could not be had."""

    unit: Text = ""
    experiment: Number = None
    experiment_std: Number = None
    model: Number = None
    model_std: Number = None
    error: Number = None
    validation_std: Number = None
    agrees: bool | None = None
    note: Text = ""
    input_std: Number = None
    numerical_std: Number = None
    dominant_input: Text = ""


class MetricsRecord(_Entry):
    """metrics.json."""

    test: Text = ""
    metrics: dict[str, MetricEntry] = {}
    warnings: tuple[Text, ...] = ()


class ParameterEntry(_Entry):
    """A fitted parameter."""

    value: Number = None
    interval_68: tuple[Number, ...] = ()
    interval_95: tuple[Number, ...] = ()
    told_by: Text = ""


class SwitchEntry(_Entry):
    """A change of the band in the record and in the model."""

    switch: int
    record_u_mm: Number = None
    model_u_mm: Number = None
    stretch: Number = None


class ShiftEntry(_Entry):
    """Something known beforehand, and where the fit puts it."""

    shift: Number = None
    std: Number = None


class InformationEntry(_Entry):
    """What a stretch of the record tells of a parameter."""

    share: Number = None
    widening: Number = None


class FitRecord(_Entry):
    """fit.json."""

    parameters: dict[str, ParameterEntry]
    shifts: dict[str, ShiftEntry] = {}
    switches: tuple[SwitchEntry, ...] = ()
    discrepancy: dict[str, Number] = {}
    information: dict[str, dict[str, InformationEntry]] = {}
    rises: dict[str, Number] = {}
    residual_rms_N: Number = None
    chi2_reduced: Number = None
    points: int = 0
    independent_points: Number = None
    message: Text = ""
    posterior: dict[str, tuple[Number, ...]] | None = None
