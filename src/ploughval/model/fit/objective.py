"""What a fit makes least: rows after registration, the price of the stretch, and what is known beforehand."""

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import ConvergenceError
from ploughval.model.fit.record import Record
from ploughval.model.fit.registration import Teeth, laid_on, prices, starts_in_record, teeth_of
from ploughval.model.fit.variables import WIDTHS, Space
from ploughval.model.settings import STEP_PER_TOLERANCE, run_march, scene_law

Floats = NDArray[np.float64]

AHEAD = 1.3  # ends of the record up to which the model is run: its switches may come later
VISIBLE = 0.5  # of the record's threshold: smaller teeth of the model are no switches
SWITCH_ERROR = 0.5  # of the tolerance, in depths: place of a switch of the model, with its sign unknown
REACH_DEPTHS = 0.2  # that a switch of the record may move by
IMPOSSIBLE = 1e4  # standard deviations: no mechanism at all
KNOT_DEPTHS = 0.5  # between travels at which the discrepancy in force is an unknown
TRAVEL_WIDTH = 2e-4  # depths, of differences over the place of a switch
KEPT = 64  # marches


@dataclass(frozen=True, slots=True)
class SharedErrors:
    """Errors that move all rows of a record together, as standard uncertainties.

    Attributes
    ----------
    offset_N : float
        Added to every row: friction of the box, zeros.
    gain : float
        Times the force: calibration of the cells, width of the blade.
    start_mm : float
        Of u = 0.
    """

    offset_N: float = 0.0
    gain: float = 0.0
    start_mm: float = 0.0


@dataclass(frozen=True, slots=True)
class Discrepancy:
    """How far the model may be from sand, as relative standard deviations; 0: it is right.

    Attributes
    ----------
    travel : float
        Of the length of a tooth.
    force : float
        Of the force: independent at peak, at trough and at every half depth of travel.
    """

    travel: float = 0.03
    force: float = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class Modelled:
    """One march: travel, horizontal force in N, its teeth."""

    u_mm: Floats
    force_N: Floats
    teeth: Teeth


@dataclass(frozen=True, slots=True, eq=False)
class Objective:
    """Residuals of a fit, in standard deviations; their squares add up to what is made least.

    docs/theory-fit.md, Eq. (1).

    The unknowns, in this order: soil variables of ``space``; offset and gain in their standard uncertainties,
    where there are any; start of the record in its standard uncertainties, where it is uncertain; the
    discrepancy in force at ``knots_mm``, in its standard deviations; one place in the record for each of its
    switches, in mm.
    """

    space: Space
    record: Record
    shared: SharedErrors
    discrepancy: Discrepancy
    knots_mm: Floats
    tolerance: float
    inflation: float = 1.0
    marches: dict[bytes, Modelled | None] = field(default_factory=dict)

    def at(self, *, travel_std: float | None = None, tolerance: float | None = None) -> "Objective":
        """The same with another price of the stretch, or another tolerance of the model."""
        apart = self.discrepancy
        apart = apart if travel_std is None else replace(apart, travel=travel_std)
        aim = self.tolerance if tolerance is None else tolerance
        marches = self.marches if aim == self.tolerance else {}
        return replace(self, discrepancy=apart, tolerance=aim, marches=marches)

    def inflated(self, factor: float) -> "Objective":
        """The same with the noise of all rows so much larger."""
        return replace(self, inflation=factor)

    @property
    def soils(self) -> int:
        """Number of soil variables."""
        return len(self.space.low)

    @property
    def blocks(self) -> tuple[bool, bool, bool]:
        """Whether offset, gain and start are unknowns."""
        return self.shared.offset_N > 0.0, self.shared.gain > 0.0, self.record.start_std_mm > 0.0

    @property
    def shape(self) -> slice:
        """Where the model's discrepancy in force stands among the unknowns."""
        first = self.soils + sum(self.blocks)
        return slice(first, first + len(self.knots_mm))

    @property
    def switches(self) -> slice:
        """Where the places of the switches stand among the unknowns."""
        return slice(self.shape.stop, None)

    def bounds(self, unknowns: Floats) -> tuple[Floats, Floats]:
        """Least and greatest values of all unknowns; switches stay near where they are now."""
        middle = self.shape.stop - self.soils
        places = unknowns[self.switches]
        near = REACH_DEPTHS * self.space.scene.blade.depth_mm
        if len(places):
            gaps = np.diff(np.concatenate([[self.record.start_mm], places, [self.record.end_mm + 2 * near]]))
            near = float(min(near, 0.3 * gaps.min()))
        low = np.concatenate([self.space.low, np.full(middle, -6.0), places - near])
        high = np.concatenate([self.space.high, np.full(middle, 6.0), places + near])
        return low, high

    def modelled(self, soil: Floats) -> Modelled | None:
        """The march of these soil variables, kept for the next call; None: no mechanism."""
        key = soil.tobytes()
        if key not in self.marches:
            if len(self.marches) >= KEPT:
                self.marches.pop(next(iter(self.marches)))
            self.marches[key] = self._march(soil)
        return self.marches[key]

    def _march(self, searched: Floats) -> Modelled | None:
        scene, soil = self.space.scene_with(searched)
        step = STEP_PER_TOLERANCE * self.tolerance * self.space.scene.blade.depth_mm
        try:
            law = scene_law(scene, soil)
            rows = run_march(scene, law, AHEAD * self.record.end_mm, step, store=False).rows
        except ConvergenceError:
            return None
        # load cells feel the horizontal part; the law's wall holds the inclination of the face too
        scale = 1e-6 * soil.unit_weight_kN_m3 * scene.blade.width_mm * math.cos(law.wall)
        teeth = teeth_of(rows, soil.mobilization_length_mm, VISIBLE * self.record.threshold)
        return Modelled(rows[:, 0], scale * rows[:, 2], teeth)

    def start(self, soil: Floats) -> Floats:
        """All unknowns for these soil variables: nothing shared, switches where the record shows them."""
        modelled = self.modelled(soil)
        middles = self.record.middles_mm
        places = middles if modelled is None else starts_in_record(middles, modelled.teeth)
        floor = self.record.start_mm + 1e-3 * (1.0 + np.arange(len(places)))
        return np.concatenate([soil, np.zeros(self.shape.stop - self.soils), np.maximum(places, floor)])

    def curve(self, unknowns: Floats) -> Floats:
        """Modelled force at the rows of the record, registered, with offset and gain, N."""
        modelled = self.modelled(unknowns[: self.soils])
        if modelled is None:
            return np.full(len(self.record.u_mm), np.nan)
        offset, gain, start = self._shared(unknowns)
        places = unknowns[self.switches]
        travel = laid_on(self.record.u_mm, start, places, self.record.end_mm, modelled.teeth)
        force = np.interp(travel, modelled.u_mm, modelled.force_N)
        factor = 1.0 + gain * self.shared.gain + self._apart(unknowns)
        return np.asarray(factor * force + offset * self.shared.offset_N)

    def _apart(self, unknowns: Floats) -> Floats:
        """Discrepancy in force at the rows of the record, relative."""
        if self.discrepancy.force <= 0.0:
            return np.zeros(len(self.record.u_mm))
        shares = np.interp(self.record.u_mm, self.knots_mm, unknowns[self.shape])
        return np.asarray(self.discrepancy.force * shares)

    def residuals(self, unknowns: Floats) -> Floats:
        """Rows, then prices of the stretch, then what is known beforehand."""
        modelled = self.modelled(unknowns[: self.soils])
        places = unknowns[self.switches]
        if modelled is None:
            return np.full(self.count(len(places)), IMPOSSIBLE)
        start = self._shared(unknowns)[2]
        spread = (
            self.discrepancy.travel,
            SWITCH_ERROR * self.tolerance * self.space.scene.blade.depth_mm,
        )
        rows = (self.curve(unknowns) - self.record.force_N) / (self.inflation * self.record.noise_std_N)
        cost = prices(start, places, self.record.end_mm, modelled.teeth, spread)
        known = unknowns[len(self.space.fitted) : self.switches.start]
        return np.concatenate([rows, cost, known])

    def count(self, switches: int) -> int:
        """Number of residuals."""
        known = self.shape.stop - len(self.space.fitted)
        return len(self.record.u_mm) + switches + 1 + int(known)

    def cost(self, unknowns: Floats) -> float:
        """Sum of the squared residuals."""
        return float(np.sum(self.residuals(unknowns) ** 2))

    def jacobian(self, unknowns: Floats, width: float) -> Floats:
        """Derivatives of the residuals by central differences; ``width`` in degrees for the soil."""
        low, high = self.bounds(unknowns)
        widths = np.full(len(unknowns), 0.1)
        widths[: self.soils] = [width * WIDTHS[angle] for angle in self.space.angles]
        widths[self.switches] = TRAVEL_WIDTH * self.space.scene.blade.depth_mm
        columns = []
        for k, step in enumerate(widths):
            sides = []
            ends = np.clip([unknowns[k] - step, unknowns[k] + step], low[k], high[k])
            for end in ends:
                moved = unknowns.copy()
                moved[k] = end
                sides.append(self.residuals(moved))
            columns.append((sides[1] - sides[0]) / (ends[1] - ends[0]))
        return np.column_stack(columns)

    def _shared(self, unknowns: Floats) -> tuple[float, float, float]:
        """Offset and gain in standard uncertainties, start in mm."""
        middle = list(unknowns[self.soils : self.shape.start])
        offset, gain, start = (float(middle.pop(0)) if there else 0.0 for there in self.blocks)
        return offset, gain, self.record.start_mm + start * self.record.start_std_mm


def objective_of(
    space: Space, record: Record, shared: SharedErrors, discrepancy: Discrepancy, tolerance: float
) -> Objective:
    """The objective of a fit; the discrepancy in force is an unknown at :func:`_knots`."""
    knots = _knots(record, space.scene.blade.depth_mm) if discrepancy.force > 0.0 else np.empty(0)
    return Objective(space, record, shared, discrepancy, knots, tolerance)


def _knots(record: Record, depth_mm: float) -> Floats:
    """Peaks and troughs, whose ratio the model may miss too; between them every half depth of travel."""
    spacing = KNOT_DEPTHS * depth_mm
    even = np.linspace(0.0, record.end_mm, 2 + int(record.end_mm / spacing))
    inner = record.turns_mm[(record.turns_mm > 0.0) & (record.turns_mm < record.end_mm)]
    far = [k for k in even[1:-1] if not inner.size or np.abs(inner - k).min() > 0.25 * spacing]
    return np.unique(np.concatenate([even[[0, -1]], far, inner]))
