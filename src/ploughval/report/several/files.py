"""Files beside the page of several tests: every number that it shows, as JSON and as one long table."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ploughval.axes import BAND_COLUMNS, unit_of
from ploughval.report.attached import guarded
from ploughval.report.several.findings import SeveralFindings
from ploughval.run.kept.written import write_csv, write_json

COLUMNS = ("chapter", "group", "test", "metric", "unit", "quantity", "value")
WORDS = COLUMNS[:-1]
Row = tuple[str, str, str, str, str, str, float]


def write_numbers(found: SeveralFindings, page: Path) -> tuple[Path, Path]:
    """Write what the page shows beside it, under its name with .json and .csv.

    Parameters
    ----------
    found : SeveralFindings
        What was found in the tests.
    page : Path
        The page.

    Returns
    -------
    (Path, Path)
        The JSON and the CSV file.

    Raises
    ------
    DataError
        When the disk refuses.
    """
    record, table = (_beside(page, kind) for kind in (".json", ".csv"))
    write_json(record, numbers_record(found))
    rows = pd.DataFrame(list(_rows(found)), columns=list(COLUMNS))
    rows[list(WORDS)] = rows[list(WORDS)].map(guarded)
    write_csv(table, rows, COLUMNS)
    return record, table


def _beside(page: Path, kind: str) -> Path:
    """The page's name with another ending; added to it where the page itself has that ending."""
    beside = page.with_suffix(kind)
    return page.with_name(page.name + kind) if beside == page else beside


def numbers_record(found: SeveralFindings) -> dict[str, Any]:
    """What the JSON file holds: tests, groups, repeatability, histories, depth, mean errors."""
    names = found.names
    return {
        "tests": [
            {
                "name": name,
                "folder": str(test.folder),
                "group": found.group_label(place),
                "depth_mm": test.depth_mm,
                "P0_N": test.P0_N,
                "copy_of": _name(names, found.grouping.copies.get(place)),
                "metrics": {} if test.metrics is None else {
                    key: metric.model_dump() for key, metric in test.metrics.metrics.items()
                },
            }
            for place, (name, test) in enumerate(zip(names, found.tests, strict=True))
        ],
        "groups": {group.label: [names[place] for place in group.members] for group in found.grouping.groups},
        "varying": [f"{key.table}.{key.name}" for key in found.grouping.varying],
        "model_rules_varying": list(found.grouping.model_rules),
        "scatter": {group: found.scatter(group) for group in found.repeats},
        "repeatability": [_plain(repeat, names) for every in found.repeats.values() for repeat in every],
        "repeatability_over_groups": [_plain(level, names) for level in found.levels],
        "histories": {label: _plain(history, names) for label, history in found.histories.items()},
        "depth": [_plain(trend, names) for trend in found.trends],
        "errors": [_plain(error, names) for error in found.errors],
    }  # fmt: skip


def _name(names: Sequence[str], place: int | None) -> str | None:
    return None if place is None else names[place]


def _plain(item: Any, names: Sequence[str]) -> dict[str, Any]:
    """A finding as lists and numbers, its tests by name."""
    values = asdict(item)
    if "tests" in values:
        values["tests"] = [names[place] for place in values["tests"]]
    return {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in values.items()}


def _rows(found: SeveralFindings) -> Iterator[Row]:
    yield from _test_rows(found)
    yield from _repeat_rows(found)
    yield from _history_rows(found)
    for trend in found.trends:
        for part in ("measured", "predicted", "beyond", "power"):
            line = getattr(trend, part)
            for quantity, value in [] if line is None else _numbers(line):
                yield ("depth", trend.series, "", trend.metric, trend.scale, f"{part} {quantity}", value)
        yield ("depth", trend.series, "", trend.metric, "", "predicted power", trend.predicted_power)
    for error in found.errors:
        for quantity, value in (*_numbers(error), *_numbers(error.pooled)):
            yield ("errors", "", "", error.metric, error.scale, quantity, value)


def _repeat_rows(found: SeveralFindings) -> Iterator[Row]:
    for group, every in found.repeats.items():
        for word, count in found.scatter(group).items():
            yield ("repeatability", group, "", "", "1", f"metrics {word}", float(count))
        for repeat in every:
            for quantity, value in _numbers(repeat.pooled):
                yield ("repeatability", repeat.group, "", repeat.metric, repeat.unit, quantity, value)
    for level in found.levels:
        for quantity, value in _numbers(level):
            yield ("repeatability over groups", "", "", level.metric, level.scale, quantity, value)


def _history_rows(found: SeveralFindings) -> Iterator[Row]:
    for group, history in found.histories.items():
        for number, pooled in enumerate(history.switches):
            for quantity, value in _numbers(pooled):
                yield ("switches", group, "", f"switch {number + 1}", "d", quantity, value)
        for name in ("mean", "std", "stated_std", "aligned_mean", "aligned_std"):
            values = getattr(history, name)
            for place, value in enumerate([] if values is None else values):
                where = f"{name} at u/d = {history.u_d[place]:.6g}"
                yield ("histories", group, "", "force", history.scale or "N", where, float(value))


def _test_rows(found: SeveralFindings) -> Iterator[Row]:
    for place, (name, test) in enumerate(zip(found.names, found.tests, strict=True)):
        group = found.group_label(place)
        for quantity, known in (("depth_mm", test.depth_mm), ("P0_N", test.P0_N)):
            if known is not None:
                yield ("tests", group, name, "", unit_of(quantity), quantity, known)
        for metric, entry in ({} if test.metrics is None else test.metrics.metrics).items():
            for quantity, value in entry.model_dump().items():
                if isinstance(value, int | float):
                    yield ("metrics", group, name, metric, entry.unit, quantity, float(value))
        for source, bands in (("measured", test.bands), ("predicted", test.model_bands)):
            for row in [] if bands is None else bands.to_dict("records"):
                for column in BAND_COLUMNS[1:]:
                    number = f"band {row['band']:g}, {source}"
                    yield ("bands", group, name, number, unit_of(column), column, float(row[column]))


def _numbers(item: Any) -> Iterator[tuple[str, float]]:
    """Names and values of a finding's plain numbers."""
    assert is_dataclass(item)
    for field in fields(item):
        value = getattr(item, field.name)
        if isinstance(value, int | float) and value == value:
            yield field.name, float(value)
