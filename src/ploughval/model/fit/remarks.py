"""What a record does not determine, in words."""

import numpy as np

from ploughval.model.fit.information import Information
from ploughval.model.fit.objective import Discrepancy, Objective
from ploughval.model.fit.result import SoilFit

ALIKE = 0.98  # parameters more correlated than this cannot be told apart
FAR = 2.5  # standard uncertainties: what was known beforehand does not fit the record
LATE_LENGTHS, LATE_DEPTHS = 0.1, 0.01  # before a record that starts later friction may have fallen
ROWS_IN_A_FALL = 3.0  # fewer do not show how friction falls
WIDE = 0.5  # of the range searched: an interval that long determines nothing


def remarks_on(
    found: SoilFit, objective: Objective, information: Information, *, flat: bool, allowed: Discrepancy
) -> tuple[str, ...]:
    """Remarks on a fit: undetermined parameters and why, misfit, stretched teeth, pulled knowledge."""
    remarks = []
    if flat:
        text = (
            "the record shows no softening beyond its noise: mobilization_length_mm is not determined by it"
        )
        if "residual_friction_deg" in found.parameters:
            text += ", and residual_friction_deg only if friction falls within the record's travel"
        remarks.append(text)
    for k, name in enumerate(found.parameters):
        if flat and name == "mobilization_length_mm":
            continue
        remarks.extend(_open(found, objective, k))
    for k, name in enumerate(found.parameters):
        for j in range(k):
            if abs(information.correlation[j, k]) > ALIKE:
                remarks.append(f"{found.parameters[j]} and {name} cannot be told apart")
    remarks.extend(_short(found, objective))
    if found.misfit.inflation > 1.5:
        remarks.append(
            f"the model misses the record by {np.sqrt(found.misfit.chi2):.1f} times its noise, over "
            f"{found.misfit.rows_together:.0f} rows at a time: {found.misfit.independent:.0f} of "
            f"{found.points} rows count as independent"
        )
    seen, told = found.discrepancy, allowed
    if seen.travel > told.travel:
        remarks.append(
            f"the record's teeth differ in length by {100 * seen.travel:.0f} % from the model's "
            f"({100 * told.travel:.0f} % were allowed for): their places tell little on the soil"
        )
    if seen.force > told.force:
        remarks.append(
            f"the record's force is bent by {100 * seen.force:.1f} % against the model's "
            f"({100 * told.force:.1f} % were allowed for)"
        )
    remarks.extend(
        f"{shift.name} is pulled {abs(shift.shift / shift.std):.1f} standard uncertainties from what was told"
        for shift in found.shifts
        if abs(shift.shift) > FAR * shift.std
    )
    remarks.extend(_exact(found, objective))
    return tuple(remarks)


def _exact(found: SoilFit, objective: Objective) -> list[str]:
    """Which inputs count as exact: the force tells nothing against them, and friction makes up for them."""
    scene = objective.space.scene
    stds = {
        "unit_weight_kN_m3": 0.0 if scene.soil is None else scene.soil.unit_weight_std_kN_m3,
        "wall_friction_deg": 0.0 if scene.soil is None else scene.soil.wall_friction_std_deg,
        "depth_mm": scene.blade.depth_std_mm,
    }
    names = [name for name, std in stds.items() if std == 0.0 and name not in found.parameters]
    if not names:
        return []
    listed = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
    verb = "is" if len(names) == 1 else "are"
    return [f"{listed} {verb} taken as exact: no interval holds what is wrong with that"]


def _short(found: SoilFit, objective: Objective) -> list[str]:
    """Whether friction falls within so few rows, averages over travel, that these blur how."""
    name = "mobilization_length_mm"
    if name not in found.parameters or not np.isfinite(found.std[found.parameters.index(name)]):
        return []
    row = float(np.median(np.diff(objective.record.u_mm)))
    if found.values[found.parameters.index(name)] > ROWS_IN_A_FALL * row:
        return []
    return [
        f"{name} is about the travel between rows, {row:.2g} mm, which blurs it by more than its interval"
    ]


def _open(found: SoilFit, objective: Objective, k: int) -> list[str]:
    """Whether the interval of a parameter is open or useless, and why that may be."""
    name, (low, high) = found.parameters[k], found.interval_95[k]
    first = float(objective.record.u_mm[0])
    why = ""
    late = min(LATE_LENGTHS * high, LATE_DEPTHS * objective.space.scene.blade.depth_mm)
    if name == "mobilization_length_mm" and not len(found.switches) and first > late:
        why = f": the first {first:.2g} mm are missing, and the record shows no switch"
    ends = {(False, False): "", (True, False): "below", (False, True): "above", (True, True): "at all"}
    side = ends[(not np.isfinite(low), not np.isfinite(high))]
    if side == "at all":
        return [f"{name} is not determined by this record{why}"]
    if side:
        return [f"{name} is not bounded {side} within the range searched{why}"]
    searched = objective.space.high[k] - objective.space.low[k]
    length = high - low if objective.space.angles[k] else np.log(high / low)
    return [f"{name} is hardly determined by this record{why}"] if length > WIDE * searched else []
