"""The load cells' table of a draft: log, empty runs, geometry, columns, calibration."""

from ploughval.loadcells.logs.units import counts_samples
from ploughval.run.setup.draft_facts import Found
from ploughval.run.setup.draft_lines import ask, listed, offer, quoted, remark
from ploughval.run.setup.log_words import WANTED
from ploughval.run.setup.survey_logs import LogFound
from ploughval.scene import LoadCells


def loadcells_text(found: Found) -> str:
    """[loadcells]."""
    logs = found.there.logs
    record = logs.log
    if record is None:
        return "# No log of load cells was found.\n# [loadcells]\n"
    names = quoted(record.names[0]) if len(record.names) == 1 else listed(record.names)
    return (
        f"[loadcells]\n{_log(record, names)}"
        f"{remark(_read_as(record))}{remark(record.trouble)}"
        f"{''.join(remark(f'also there, not taken: {name}') for name in logs.left[:5])}"
        f"{_rate(record)}{_empty(found)}"
        f"{ask(LoadCells, 'spacing_mm')}{ask(LoadCells, 'lower_to_tip_mm')}"
        f"{_rest(record)}{_columns(record)}{_calibration(found)}"
    )


def _log(record: LogFound, names: str) -> str:
    """The files of the log; a question where their columns do not say that it is one."""
    if len(record.columns) > 1:
        return f"log = {names}\n"
    return ask(LoadCells, "log", names, "the columns of this table do not say what they are")


def _read_as(record: LogFound) -> str:
    """How many rows there are and how their times and units were understood."""
    if record.time_s is None:
        return ""
    rate = f", {record.rate_hz:.4g} a second" if record.rate_hz else ""
    together = f"{len(record.names)} files that follow on: " if len(record.names) > 1 else ""
    return "\n".join([f"{together}{len(record.time_s)} rows{rate}", *record.notes])


def _rate(record: LogFound) -> str:
    """A question where the log holds no times, or numbers of samples."""
    name = record.columns.get("time_s")
    if name is not None and not counts_samples(name, ""):
        return ""
    told = "" if name else 'without any column of time, time_s = "" in [loadcells.columns]'
    return ask(LoadCells, "rate_hz", found=told)


def _empty(found: Found) -> str:
    logs, told = found.there.logs, ""
    if logs.empty_by_load:
        shares = ", ".join(f"{name} ({100 * share:.0f} %)" for name, share in logs.empty_by_load)
        names = (*found.there.empty, *(name for name, _ in logs.empty_by_load))
        told = offer(
            f"empty = {listed(names)}",
            f"guess: runs in the empty box, by their load over that of the log: {shares}",
        )
        if not found.there.empty:
            return told
    if found.there.empty:
        return f"empty = {listed(found.there.empty)}\n{told}"
    return "# empty = []   # no empty-box runs found: no friction compensation\n"


def _rest(record: LogFound) -> str:
    if record.rest_s is None:
        return (
            "# rest_s = [...]                 # window before motion; absent: found from the displacement\n"
        )
    travel = f", which travels {record.travel_mm:.4g} mm" if record.travel_mm else ""
    start, end = record.rest_s
    return f"rest_s = [{start:g}, {end:g}]           # before the displacement moves{travel}\n"


def _columns(record: LogFound) -> str:
    if all(record.columns.get(key) == key for key in WANTED):
        return ""
    lines = [
        f"{key} = {quoted(record.columns[key])}\n" if key in record.columns else f"# {key} = ?\n"
        for key in WANTED
    ]
    there = remark(f"columns of the log: {', '.join(map(repr, record.header))}") if record.header else ""
    return f"[loadcells.columns]\n{there}{''.join(lines)}"


def _calibration(found: Found) -> str:
    tables = found.there.cell_tables
    if not tables:
        return ""
    told = "guess: tables of known loads; only where the log's moments are not calibrated already"
    return offer(f"[loadcells.calibration]\n# files = {listed(tables)}", told)
