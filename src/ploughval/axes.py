"""Axes, signs, units, column names and status codes: defined here and nowhere else.

World axes: x along the travel of the blade from its initial face, y up from the level of the
blade's tip, both in mm. Image axes: x right, y down, pixel centres at integers, in px.
``ploughval.photos.calibration`` is the only place that converts one into the other.
Angles are in degrees, measured from the horizontal, positive upwards ahead of the blade.
Compression is negative in strains; forces on the blade are positive against its travel.
"""

from enum import IntEnum, StrEnum
from types import MappingProxyType

WORLD = "x along the travel of the blade from its initial face, y up from the level of the tip, mm"
"""The world axes in words, as files tell them."""


class Status(IntEnum):
    """Reason code of a measured vector or tracked point; anything but OK and REPLACED is NaN."""

    OK = 0
    MASKED = 1
    LOW_CORRELATION = 2
    OUTLIER = 3
    REPLACED = 4
    EDGE = 5
    NOT_CONVERGED = 6
    FRAME_MISSING = 7
    BURIED = 8
    SHEARED = 9
    AVALANCHED = 10
    OUT_OF_PICTURE = 11
    FLAT = 12
    LOST = 13
    AMBIGUOUS = 14

    @property
    def meaning(self) -> str:
        """The code's name as written into files: lower case, words joined by underscores."""
        return self.name.lower()


class Region(IntEnum):
    """What a pixel of a photograph shows; TRENCH: all behind the blade's back above the tip's level."""

    AIR = 0
    SAND = 1
    BLADE = 2
    TRENCH = 3
    OUTSIDE = 4


class ForceStatus(StrEnum):
    """Reason code of one row of the force record."""

    OK = "ok"
    NO_ARM = "force_too_small_for_arm"
    NOT_FINITE = "not_finite"
    SATURATED = "saturated"
    DROPOUT = "dropout"
    GAP = "gap"
    OUTSIDE_LOG = "outside_log"
    SPIKE = "spike"
    STUCK = "stuck"


class Direction(StrEnum):
    """The way the blade travels in the photograph."""

    RIGHT = "right"
    LEFT = "left"

    @property
    def sign(self) -> int:
        """+1 when image x and world x run the same way, -1 when they are opposed."""
        return 1 if self is Direction.RIGHT else -1


UNITS = MappingProxyType(
    {
        "_mm": "mm",
        "_px": "px",
        "_s": "s",
        "_N": "N",
        "_Nm": "N m",
        "_deg": "degree",
        "_kN_m3": "kN/m^3",
        "_N_m": "N/m",
        "_mJ": "mJ",
        "_mm2": "mm^2",
        "_P0": "P0",
        "_d": "d",
        "_per_depth": "1/d",
        "_percent": "%",
    }
)

FORCE_COLUMNS = (
    "time_s",
    "u_mm",
    "force_N",
    "force_std_N",
    "arm_mm",
    "arm_std_mm",
    "force_raw_N",
    "friction_N",
    "status",
)
FORCE_AT_COLUMNS = (
    "frame",
    "time_s",
    "time_std_s",
    "u_mm",
    "force_N",
    "force_std_N",
    "arm_mm",
    "arm_std_mm",
    "status",
)
LAYER_COLUMNS = ("frame", "u_mm", "layer", "source", "x_mm", "y_mm", "std_mm")
SURFACE_COLUMNS = ("frame", "u_mm", "x_mm", "y_mm")
BAND_COLUMNS = (
    "band",
    "u_start_mm",
    "u_end_mm",
    "beta_deg",
    "beta_std_deg",
    "outcrop_x_mm",
    "outcrop_std_mm",
    "slip_mm",
)
INCREMENT_COLUMNS = (
    "frame",
    "u_mm",
    "du_mm",
    "beta_deg",
    "beta_std_deg",
    "outcrop_x_mm",
    "outcrop_std_mm",
    "slip_mm",
    "band",
    "velocity_x",
    "velocity_x_std",
    "velocity_y",
    "velocity_y_std",
    "mechanism",
    "evidence",
)
BLADE_COLUMNS = ("frame", "time_s", "u_mm", "blade_x_mm", "blade_std_mm")
VOLUME_COLUMNS = ("frame", "u_mm", "area_mm2", "swept_mm2", "difference_mm2", "std_mm2", "ratio")
BUDGET_COLUMNS = (
    "source",
    "value",
    "std",
    "unit",
    "sensitivity_N",
    "share",
    "sensitivity_mm",
    "arm_share",
)
PRACTICE_COLUMNS = ("group", "item", "value", "std", "unit", "text", "source", "predicted", "note")
MODEL_FORCE_COLUMNS = ("u_mm", "force_N", "beta_deg", "outcrop_x_mm", "band")


def unit_of(name: str) -> str:
    """Unit of a quantity from its name's ending; ``"1"`` for a plain number.

    >>> unit_of("outcrop_x_mm"), unit_of("zncc"), unit_of("force_std_N")
    ('mm', '1', 'N')
    """
    for ending in sorted(UNITS, key=len, reverse=True):
        if name.endswith(ending):
            return UNITS[ending]
    return "1"
