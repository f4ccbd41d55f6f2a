"""What is found in several tests together, once, for the page and the files beside it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ploughval.compare.several import (
    Group,
    Grouping,
    LevelsTogether,
    MeanError,
    MeanHistory,
    Record,
    Repeat,
    Trend,
    Value,
    depth_trends,
    group_tests,
    levels_together,
    mean_errors,
    mean_history,
    repeats_of,
)
from ploughval.compare.several.groups import DEPTH
from ploughval.report.verdict import by_topic
from ploughval.results import MetricEntry, Results

NAN = float("nan")


@dataclass(frozen=True, slots=True)
class SeveralFindings:
    """Everything that the page of several tests says.

    Attributes
    ----------
    tests : sequence of Results
    names : sequence of str
        Their names, numbered where two share one.
    records : sequence of Record
    grouping : Grouping
    repeats : mapping of str to list of Repeat
        By group; groups of one test are absent.
    levels : list of LevelsTogether
    histories : mapping of str to MeanHistory
        By group, where two of its tests have a force.
    trends : list of Trend
        Of all series of depths.
    errors : list of MeanError
    """

    tests: Sequence[Results]
    names: Sequence[str]
    records: Sequence[Record]
    grouping: Grouping
    repeats: Mapping[str, list[Repeat]]
    levels: list[LevelsTogether]
    histories: Mapping[str, MeanHistory]
    trends: list[Trend]
    errors: list[MeanError]

    def group_label(self, place: int) -> str:
        """Label of a test's group; that of the test it copies, in brackets."""
        group = self.grouping.group_of(place)
        if group is not None:
            return group.label
        original = self.grouping.group_of(self.grouping.copies[place])
        return f"({original.label})" if original is not None else ""

    def scatter(self, group: str) -> dict[str, int]:
        """How many metrics of a group's repeats are judged, and scatter as stated, more or less."""
        words = [repeat.pooled.verdict for repeat in self.repeats[group]]
        judged = {"judged": len(words) - words.count("unknown")}
        return {**judged, **{word: words.count(word) for word in ("explained", "more", "less")}}

    def members(self, group: Group) -> str:
        """Names of a group's tests."""
        return ", ".join(self.names[place] for place in group.members)


def find_several(tests: Sequence[Results]) -> SeveralFindings:
    """Take several tests together.

    Parameters
    ----------
    tests : sequence of Results
        Two or more.
    """
    names = _names(tests)
    records = [_record(name, test) for name, test in zip(names, tests, strict=True)]
    grouping = group_tests(records)
    repeating = [group for group in grouping.groups if len(group.members) > 1]
    histories = {group.label: mean_history(group.members, records) for group in repeating}
    counted = [place for place in range(len(tests)) if place not in grouping.copies]
    series = grouping.along(DEPTH)
    return SeveralFindings(
        tests=tests,
        names=names,
        records=records,
        grouping=grouping,
        repeats={group.label: found for group in repeating if (found := repeats_of(group, records))},
        levels=levels_together(repeating, records),
        histories={label: history for label, history in histories.items() if history is not None},
        trends=[trend for groups in series for trend in depth_trends(groups, records)],
        errors=mean_errors(counted, records),
    )


def _names(tests: Sequence[Results]) -> list[str]:
    """Names of the tests, numbered where two share one."""
    names = [test.name for test in tests]
    return [f"{name} ({place + 1})" if names.count(name) > 1 else name for place, name in enumerate(names)]


def _record(name: str, test: Results) -> Record:
    metrics = {} if test.metrics is None else by_topic(test.metrics.metrics)
    inputs = {file: digest for file, digest in test.run.inputs.items() if not file.endswith(".toml")}
    return Record(
        name=name,
        settings=test.run.settings,
        values={key: _value(metric) for key, metric in metrics.items()},
        force=test.force,
        P0_N=NAN if test.P0_N is None else test.P0_N,
        inputs=inputs or {"results": str(test.folder.resolve())},
    )


def _value(metric: MetricEntry) -> Value:
    sides = ("experiment", "experiment_std", "model", "model_std", "error", "validation_std")
    found = {side: getattr(metric, side) for side in sides}
    known = {side: NAN if value is None else float(value) for side, value in found.items()}
    return Value(metric.unit, **known, agrees=metric.agrees)
