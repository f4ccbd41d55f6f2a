"""The tables of a result folder: what each is, what a row is, and what every column means in which unit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from ploughval import axes
from ploughval.compare.bands import pairs as band_pairs
from ploughval.compare.force import envelope, pairs, peaks
from ploughval.compare.lines.distances import DISTANCE_COLUMNS
from ploughval.compare.mobilised.curve import CURVE_COLUMNS
from ploughval.compare.mobilised.frames import MOBILISED_COLUMNS
from ploughval.compare.mound.history import MOUND_COLUMNS
from ploughval.compare.softening.table import SOFTENING_COLUMNS
from ploughval.loadcells.calibration import CHOICE_COLUMNS, QUALITY_COLUMNS, RESULT_COLUMNS
from ploughval.model.fit import result as fit
from ploughval.results.meanings import MEANINGS, QUANTITIES, SIDES, TEXTS, UNITS_BY_NAME, WHOLE


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table.

    Attributes
    ----------
    name : str
    meaning : str
        In a few words, without the unit.
    unit : str
        "1" for a plain number, "" for text, "by row" where each row says it.
    """

    name: str
    meaning: str
    unit: str

    @property
    def is_text(self) -> bool:
        """Whether it holds words."""
        return self.unit == ""

    @property
    def is_whole(self) -> bool:
        """Whether it holds whole numbers."""
        return self.name in WHOLE and not self.is_text


@dataclass(frozen=True, slots=True)
class TableFile:
    """A table of a result folder.

    Attributes
    ----------
    name : str
        File in the result folder.
    about : str
        What the table is.
    row : str
        What a row of it is.
    columns : tuple of Column
        In the order of the file.
    """

    name: str
    about: str
    row: str
    columns: tuple[Column, ...]

    @property
    def key(self) -> str:
        """The name by which programs know it.

        >>> FILES["model/force.csv"].key
        'model_force'
        """
        return self.name.removesuffix(".csv").replace("/", "_")

    @property
    def units(self) -> dict[str, str]:
        """Unit of each column."""
        return {column.name: column.unit for column in self.columns}


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable of tracks.nc.

    Attributes
    ----------
    name : str
    dims : tuple of str
        "frame", "point", or both.
    meaning : str
        In a few words, without the unit.
    unit : str
        "1" for a plain number.
    """

    name: str
    dims: tuple[str, ...]
    meaning: str
    unit: str


def column_of(name: str) -> Column:
    """A column by its name.

    >>> column_of("arm_mm").unit, column_of("status").unit, column_of("drop_N_error").meaning
    ('mm', '', 'fall of the force after the peak, model less experiment')
    """
    if name in MEANINGS:
        unit = "" if name in TEXTS else UNITS_BY_NAME.get(name, axes.unit_of(name))
        return Column(name, MEANINGS[name], unit)
    ending = next(side for side in SIDES if name.endswith(side))
    quantity = name.removesuffix(ending)
    unit = "1" if ending == "_agrees" else axes.unit_of(quantity)
    return Column(name, f"{QUANTITIES[quantity]}, {SIDES[ending]}", unit)


def _table(name: str, about: str, row: str, columns: Sequence[str], **closer: str) -> TableFile:
    """A table; ``closer`` says what some columns mean in this one."""
    found = (column_of(column) for column in columns)
    said = (replace(column, meaning=closer.get(column.name, column.meaning)) for column in found)
    return TableFile(name, about, row, tuple(said))


def _wordy(table: TableFile, name: str) -> TableFile:
    """The table, with a column that holds words in this one."""
    return replace(table, columns=tuple(replace(c, unit="") if c.name == name else c for c in table.columns))


_FORCE_STATUS = "ok, or why force or line of action are missing"
_CAMERA = "time of the photograph by the camera's clock"
_OF_MODEL = {
    "force_N": "force P of the mechanism, along the resultant on the face, for the blade's whole width",
    "source": "model: predicted",
    "std_mm": "numerical standard uncertainty of the place",
    "beta_std_deg": "numerical standard uncertainty of the inclination",
    "outcrop_std_mm": "numerical standard uncertainty of the outcrop's place",
}
_P = "force P of the mechanism, along the resultant on the face"
_TABLES = (
    _table("force.csv", "The measured force.", "a row of the log", axes.FORCE_COLUMNS, status=_FORCE_STATUS),
    _table(
        "force_frames.csv",
        "The measured force at the time of each photograph.",
        "a photograph",
        axes.FORCE_AT_COLUMNS,
        status=_FORCE_STATUS,
        time_s=_CAMERA,
    ),
    _table(
        "layers.csv",
        "Tracer layers: material lines that were level before the blade moved.",
        "a point of a layer in a photograph; no place: the layer is torn there",
        axes.LAYER_COLUMNS,
        source="tracks: from tracked points; dye: dyed sand found in the photograph",
    ),
    _table("surface.csv", "The free surface.", "a point of it in a photograph", axes.SURFACE_COLUMNS),
    _table("bands.csv", "The measured shear bands.", "a band", axes.BAND_COLUMNS),
    _table(
        "increments.csv",
        "Motion between successive photographs.",
        "an increment; frame and u_mm are those of its start",
        axes.INCREMENT_COLUMNS,
        band="number of the band in bands.csv; -1: none",
        outcrop_x_mm="place along the travel where the band meets the surface, half-way",
    ),
    _table("blade.csv", "The blade in the photographs.", "a photograph", axes.BLADE_COLUMNS, time_s=_CAMERA),
    _table("volume.csv", "The heap against the area swept.", "a photograph", axes.VOLUME_COLUMNS),
    _table(
        "budget.csv",
        "Uncertainty budget of force and line of action at the mean load.",
        "a source",
        axes.BUDGET_COLUMNS,
        source="what is uncertain",
    ),
    _table(
        "cell_calibration.csv",
        "Points of the calibration of the load cells.",
        "a calibration point",
        RESULT_COLUMNS,
        arm_mm="height of the load above the tip",
    ),
    _table("cell_models.csv", "Models of the calibration of the load cells.", "a model", CHOICE_COLUMNS),
    _table(
        "cell_quality.csv",
        "Figures of quality of the load cells.",
        "a figure of a cell",
        QUALITY_COLUMNS,
    ),
    _table(
        "peaks.csv",
        "Peaks and troughs of both force histories.",
        "a peak or a trough",
        ("source", *peaks.PEAK_COLUMNS),
        source="experiment or model",
        force_N="horizontal force",
    ),
    _table(
        "peak_pairs.csv",
        "Switches of both force histories, matched one to one.",
        "a pair, or a switch without a partner",
        pairs.PAIR_COLUMNS,
    ),
    _table(
        "force_envelope.csv",
        "The model's force and what its inputs leave open.",
        "a travel",
        envelope.ENVELOPE_COLUMNS,
        force_N="horizontal force of the model, as load cells measure it",
    ),
    _table(
        "mobilised.csv",
        "Friction mobilised in the photographs.",
        "a photograph",
        MOBILISED_COLUMNS,
        force_N=_P,
        status="ok, or why the friction is missing",
    ),
    _table(
        "mobilised_curve.csv",
        "Friction mobilised between the photographs.",
        "a step of travel on a band",
        CURVE_COLUMNS,
        force_N=_P,
    ),
    _wordy(
        _table(
            "softening.csv",
            "Peak, residual and length read from the friction mobilised.",
            "a band, and all together",
            SOFTENING_COLUMNS,
            band="number of the band; all: all together",
        ),
        "band",
    ),
    _table(
        "layer_distances.csv",
        "Distances of measured layers from the model's.",
        "a layer in a photograph",
        DISTANCE_COLUMNS,
        source="tracks or dye",
        std_mm="standard uncertainty of a point by its measurement, root mean square",
        points="points with a distance",
    ),
    _table(
        "mound.csv",
        "Shape of the heap.",
        "a photograph, measured or predicted",
        MOUND_COLUMNS,
        source="experiment or model",
    ),
    _table(
        "band_pairs.csv",
        "Shear bands of both sides, matched one to one.",
        "a pair, or a band without a partner",
        band_pairs.PAIR_COLUMNS,
    ),
    _table(
        "good_practice.csv",
        "What a report on image correlation should tell.",
        "a thing to report",
        axes.PRACTICE_COLUMNS,
        source="setting, exif, measured, predicted, program, benchmark, or not told",
        note="how it was had; how to tell what is not told",
    ),
    _table("model/force.csv", "The model's force.", "an increment", axes.MODEL_FORCE_COLUMNS, **_OF_MODEL),
    _table("model/bands.csv", "The model's shear bands.", "a band", axes.BAND_COLUMNS, **_OF_MODEL),
    _table(
        "model/layers.csv",
        "The model's tracer layers.",
        "a point of a layer; no place: the layer is torn there",
        axes.LAYER_COLUMNS,
        **_OF_MODEL,
    ),
    _table("model/surface.csv", "The model's free surface.", "a point of it", axes.SURFACE_COLUMNS),
    _table(
        "fit_force.csv",
        "The force that soil parameters were fitted to.",
        "a row that was fitted",
        fit.CURVE_COLUMNS,
    ),
    _table(
        "fit_profiles.csv",
        "Cost of the fit over each parameter, the others at their best.",
        "a value of a parameter",
        fit.PROFILE_COLUMNS,
        value="value of the parameter, in its unit",
    ),
    _table(
        "fit_landscape.csv",
        "Cost of the fit over two parameters, the others at their best.",
        "a place of a map",
        fit.LANDSCAPE_COLUMNS,
    ),
)

FILES: Mapping[str, TableFile] = MappingProxyType({table.name: table for table in _TABLES})
"""Every table that a result folder may hold, by the name of its file."""

_TRACKED = ("frame", "point")
_VARIABLES = (
    ("x0_mm", ("point",), "initial position along the travel"),
    ("y0_mm", ("point",), "initial height above the tip"),
    ("layer_mm", ("point",), "initial height of the tracer layer that the point belongs to"),
    (
        "calibration_std_mm",
        ("point",),
        "standard uncertainty of the initial position from the calibration, rms of its two "
        "components; common to all frames, not in std_mm; NaN: not known",
    ),
    ("x_mm", _TRACKED, "position along the travel"),
    ("y_mm", _TRACKED, "height above the tip"),
    (
        "std_mm",
        _TRACKED,
        "standard deviation of the position, either component, gathered since frame 0",
    ),
    ("zncc", _TRACKED, "zero-normalised cross-correlation with the reference"),
    ("status", _TRACKED, "reason code"),
    ("time_s", ("frame",), _CAMERA),
    ("u_mm", ("frame",), "blade displacement"),
    ("blade_x_mm", ("frame",), "blade face found in the photograph"),
)
VARIABLES: Mapping[str, Variable] = MappingProxyType(
    {name: Variable(name, dims, meaning, axes.unit_of(name)) for name, dims, meaning in _VARIABLES}
)
"""The variables of tracks.nc by name."""
