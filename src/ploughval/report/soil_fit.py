"""The chapter on the soil fitted to the force, where fit.json is among the results."""

from collections.abc import Iterable, Mapping

import pandas as pd

from ploughval.model.fit import FITTED
from ploughval.model.fit.information import STRETCHES
from ploughval.report.blocks import Cell, Chapter, Drawing, Pen, Table, value_cell
from ploughval.report.figures import landscape_figure, profiles_figure, soil_fit_figure
from ploughval.report.figures.soil_fit import quantity
from ploughval.report.text import MISSING, brief, label, number
from ploughval.results import Results, read_record
from ploughval.results.records import FitRecord

_HEAD = ("Parameter", "Best", "68 % interval", "95 % interval", "Told in [soil]", "Hangs on")
_OPEN = "open"


def soil_fit_chapter(results: Results, pen: Pen) -> Chapter | None:
    """Soil parameters from the force: best fit, intervals, profiles, landscapes."""
    fit = read_record(results.folder / "fit.json", FitRecord)
    if fit is None or not fit.parameters:
        return None
    lead = (
        "Soil parameters fitted to the measured force with the model. Record and model are laid on each "
        "other where they change their band; a tooth may be longer or shorter than the model's, at a price. "
        "Limits by profile likelihood; open: not bounded within the range searched."
    )
    tables = [
        _parameters(fit, results),
        *_information(fit),
        *_posterior(fit),
        *_switches(fit),
        *_shifts(fit),
    ]
    return Chapter(
        "soil-fit",
        "Soil from the force",
        lead=lead,
        drawings=_drawings(fit, results, pen),
        tables=tables,
        notes=tuple(part.strip() for part in fit.message.split(";") if part.strip()),
    )


def _drawings(fit: FitRecord, results: Results, pen: Pen) -> list[Drawing]:
    found = []
    curve = results.table("fit_force.csv")
    profiles = results.table("fit_profiles.csv")
    landscape = results.table("fit_landscape.csv")
    best = {name: entry.value for name, entry in fit.parameters.items() if entry.value is not None}
    if curve is not None and len(curve):
        found.append(_fit_drawing(fit, curve, pen))
    if profiles is not None and len(profiles):
        levels = {f"{name} %": rise for name, rise in fit.rises.items() if rise is not None}
        found.append(
            pen.draw(
                profiles_figure(profiles, levels),
                f"Rise of the least cost over {_names(fit)}; the intervals end where it crosses the dashed "
                "lines.",
                "Profiles: the least cost with one parameter held. Points are fits; between them the root of "
                "the rise is straight.",
                name="soil-fit-profiles",
                data=("fit_profiles.csv", "fit.json"),
            )
        )
    if landscape is not None and len(landscape):
        found.append(
            pen.draw(
                landscape_figure(landscape, best),
                f"Cost over pairs of {_names(fit)}, least at the cross.",
                "Landscapes: the cost over two parameters with the others at their best. One valley: the "
                "search cannot end elsewhere. A valley aslant: the two are told together only.",
                name="soil-fit-landscapes",
                data=("fit_landscape.csv", "fit.json"),
            )
        )
    return found


def _fit_drawing(fit: FitRecord, curve: pd.DataFrame, pen: Pen) -> Drawing:
    places = [s.record_u_mm for s in fit.switches if s.record_u_mm is not None]
    figure = soil_fit_figure(curve, pd.Series(places, dtype=float).to_numpy())
    rows = f"{fit.points} rows"
    if fit.independent_points is not None and fit.independent_points < fit.points - 0.5:
        rows += f", {fit.independent_points:.0f} of them independent"
    return pen.draw(
        figure,
        f"Measured force and best fit over displacement, {number(fit.residual_rms_N, 2)} N apart (rms).",
        f"Best fit: {number(fit.residual_rms_N, 2)} N rms over {rows}. Below: what is missed, in standard "
        "deviations of the noise. Dotted: the record changes its band.",
        name="soil-fit",
        data=("fit_force.csv", "fit.json"),
    )


def _names(fit: FitRecord) -> str:
    return ", ".join(label(name).lower() for name in _ordered([fit.parameters]))


def _parameters(fit: FitRecord, results: Results) -> Table:
    rows = []
    for name in _ordered([fit.parameters]):
        entry = fit.parameters[name]
        rows.append(
            [
                Cell(quantity(name)),
                value_cell(entry.value),
                Cell(_interval(entry.interval_68)),
                Cell(_interval(entry.interval_95)),
                value_cell(results.setting("soil", name)),
                Cell(entry.told_by),
            ]
        )
    travel, force = (fit.discrepancy.get(name) for name in ("travel", "force"))
    notes: tuple[str, ...] = ()
    if travel is not None and force is not None:
        notes = (
            f"The model was trusted to {100 * travel:.1f} % of the length of a tooth and {100 * force:.1f} % "
            "of the force (standard deviations).",
        )
    return Table("Soil parameters from the force", _HEAD, rows, footnotes=notes)


def _interval(limits: tuple[float | None, ...]) -> str:
    if len(limits) != 2:  # a fit that states none
        return MISSING
    low, high = (_OPEN if limit is None else brief(limit) for limit in limits)
    return _OPEN if low == high == _OPEN else f"{low} to {high}"


def _information(fit: FitRecord) -> list[Table]:
    """Share of the information by stretches of the record."""
    if not fit.information:
        return []
    names = _ordered(fit.information.values())
    order = [stretch for stretch in STRETCHES if stretch in fit.information]
    rows = []
    for stretch in order:
        told = fit.information[stretch]
        shares = [told[name].share if name in told else None for name in names]
        cells = [value_cell(None if share is None else 100 * share, 2) for share in shares]
        rows.append([Cell(stretch[:1].upper() + stretch[1:]), *cells])
    head = ("Stretch of the record", *(f"{label(name)}, %" for name in names))
    note = (
        "Of each parameter, were all others known; what two parameters share is seen in the intervals only."
    )
    return [Table("Where the information stands in the record", head, rows, folded=True, footnotes=(note,))]


def _ordered(entries: Iterable[Mapping[str, object]]) -> list[str]:
    """Names of parameters in the order of [soil]."""
    present = {name for entry in entries for name in entry}
    return [name for name in FITTED if name in present]


def _posterior(fit: FitRecord) -> list[Table]:
    if not fit.posterior:
        return []
    head = ("Parameter", "2.5 %", "16 %", "Median", "84 %", "97.5 %")
    rows = [[Cell(quantity(n)), *map(value_cell, v)] for n, v in fit.posterior.items()]
    return [Table("Posterior by the sampler, flat over the range searched", head, rows, folded=True)]


def _switches(fit: FitRecord) -> list[Table]:
    if not fit.switches:
        return []
    head = ("Switch", "Record, mm", "Model, mm", "Tooth longer by, %")
    rows = [
        [
            value_cell(s.switch),
            value_cell(s.record_u_mm),
            value_cell(s.model_u_mm),
            value_cell(None if s.stretch is None else 100 * s.stretch, 2),
        ]
        for s in fit.switches
    ]
    return [Table("Where record and model change their band", head, rows, folded=True)]


def _shifts(fit: FitRecord) -> list[Table]:
    if not fit.shifts:
        return []
    head = ("Quantity", "Moved by", "Known to (std)")
    rows = [[Cell(quantity(n)), value_cell(s.shift, 3), value_cell(s.std, 3)] for n, s in fit.shifts.items()]
    return [Table("What was known beforehand, and where the fit puts it", head, rows, folded=True)]
