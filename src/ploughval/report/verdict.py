"""The head of a page: how well the model agrees, in one line, in tiles and in a table."""

from collections.abc import Mapping

from ploughval.report.blocks import Cell, Chapter, Drawing, Pen, Table, Tile, pair_cell
from ploughval.report.figures import agreement_figure
from ploughval.report.text import label, number, unit, with_limit
from ploughval.results import MetricEntry, Results

HEAD = (
    "Metric",
    "Experiment ± std",
    "Model ± std",
    "Error E",
    "2\u00a0u_val",
    "Agrees",
    "u_val mostly from",
    "Note",
)
SHORT_HEAD = HEAD[:6]


def verdict(results: Results) -> str:
    """One line: what agrees, or why nothing can be said."""
    lost = [entry for entry in results.run.frames if not entry.used]
    tail = f" {len(lost)} of {len(results.run.frames)} photographs were lost." if lost else ""
    if results.metrics is None or not results.metrics.metrics:
        if results.model_force is None:
            return f"Measured only: no model was run for this test.{tail}"
        if results.force is None and results.tracks is None:
            return "Predicted only: there is no measurement to compare the model with."
        return f"The model was run, but no comparison is in this folder.{tail}"
    agree, differ, unknown = counts(results.metrics.metrics)
    known = agree + differ
    if not known:
        return f"No metric can be judged: an uncertainty or a value is missing for each of {unknown}.{tail}"
    word = "The model agrees" if not differ else f"The model agrees on {agree} of {known} metrics"
    if not differ:
        word += (
            f" on all {known} metrics that can be judged,"
            if known > 1
            else " on the one metric that can be judged,"
        )
    left = f" {unknown} more lack a value or a validation uncertainty and are not judged." if unknown else ""
    return f"{word} within twice the validation uncertainty.{left}{tail}"


def counts(metrics: Mapping[str, MetricEntry]) -> tuple[int, int, int]:
    """How many metrics agree, differ and cannot be judged."""
    answers = [metric.agrees for metric in metrics.values()]
    return answers.count(True), answers.count(False), answers.count(None)


def tiles(results: Results) -> list[Tile]:
    """The summary in a few large numbers."""
    found: list[Tile] = []
    if results.metrics is not None and results.metrics.metrics:
        agree, differ, unknown = counts(results.metrics.metrics)
        detail = f"{unknown} not judged" if unknown else "within 2 u_val"
        found.append(Tile("metrics agree", f"{agree} / {agree + differ}", detail))
    peak = results.metric("first_peak_N")
    if peak is not None and peak.experiment is not None:
        predicted = f"model {number(peak.model, 3)} {peak.unit}" if peak.model is not None else ""
        found.append(
            Tile("first peak of force", f"{number(peak.experiment, 3)} {peak.unit or 'N'}", predicted)
        )
    travel = travel_mm(results)
    depth = results.depth_mm
    if travel is not None:
        detail = f"{travel / depth:.2f} d, d = {number(depth, 3)} mm" if depth else ""
        found.append(Tile("travel of the blade", f"{number(travel, 3)} mm", detail))
    if results.bands is not None:
        predicted = "" if results.model_bands is None else f"model {len(results.model_bands)}"
        found.append(Tile("shear bands", str(len(results.bands)), predicted))
    if results.run.frames:
        used = sum(entry.used for entry in results.run.frames)
        detail = "" if results.tracks is None else f"{results.tracks.sizes['point']} points followed"
        found.append(Tile("photographs used", f"{used} / {len(results.run.frames)}", detail))
    return found


def travel_mm(results: Results) -> float | None:
    """The blade's travel, of the first table that tells it; None where none does."""
    for table in (results.force, results.layers, results.model_force):
        if table is not None and table["u_mm"].notna().any():
            return float(table["u_mm"].max())
    return None


_SHORT = (
    "first_peak_N", "force_mean_N", "first_switch_u_d", "peak_spacing_d", "force_rms_P0",
    "first_band_beta_deg", "first_outcrop_x_mm", "layers_rms_mm", "surface_crest_end_mm",
    "mobilised_peak_deg",
)  # fmt: skip
_WORST = 3  # so many others that differ stand with them
_FEW = 20  # so many metrics need no shorter table before them
_NAMED = 4  # so many metrics outside are named below a picture that names them all


def short_chapter(results: Results) -> Chapter | None:
    """The metrics that one looks at first, where there are too many to look at all."""
    if results.metrics is None or len(results.metrics.metrics) <= _FEW:
        return None
    found = results.metrics.metrics
    chosen = [name for name in _SHORT if name in found and found[name].agrees is not None]
    others = [name for name, metric in found.items() if metric.agrees is False and name not in chosen]
    others.sort(key=lambda name: -abs(_ratio(found[name]) or 0.0))
    worst = list({topic(name): name for name in reversed(others)}.values())  # of each topic the worst
    worst.sort(key=others.index)
    rows = [_short_row(name, found[name]) for name in (*chosen, *worst[:_WORST])]
    if not rows:
        return None
    lead = (
        "E is model minus experiment; grey in the picture of an error: within 2\u00a0u_val, where both agree."
    )
    table = Table("The test in a few numbers", SHORT_HEAD, rows, kind="short")
    return Chapter("short", "In short", lead=lead, tables=[table], notes=_cautions(results, found))


def _cautions(results: Results, metrics: Mapping[str, MetricEntry]) -> list[str]:
    """What a reader must know before believing the counts."""
    judged = [metric for metric in metrics.values() if metric.agrees is not None]
    said = []
    if judged and not any(metric.input_std for metric in judged):
        said.append(
            "No standard uncertainty of an input (soil, depth, friction on the blade) is stated: u_val holds "
            "those of measurement and numerics alone, so it is too small by what the inputs would add."
        )
    said.append(
        "Many metrics are read from the same record (a mean and a root mean square of one quantity, one "
        "force in N and in P₀): their count is not one of independent tests."
    )
    left = [(len(results.run.faults), "fault"), (len(results.run.warnings), "warning")]
    counted = " and ".join(f"{n} {word}{'s' * (n > 1)}" for n, word in left if n)
    if counted:
        said.append(f"The run has {counted}, listed under “Quality”: read them before the numbers.")
    return said


def agreement_chapter(results: Results, pen: Pen) -> Chapter | None:
    """The tables of metrics, and their errors in validation uncertainties."""
    if results.metrics is None or not results.metrics.metrics:
        return None
    return Chapter(
        key="agreement",
        title="Agreement",
        lead="E is model minus experiment; u_val gathers the standard uncertainties of experiment, "
        "input and numerics. Where |E| is at most 2 u_val, model and experiment agree as far as can be told.",
        drawings=agreement_drawings(by_topic(results.metrics.metrics), pen),
        tables=agreement_tables(results),
        notes=[text for text in results.metrics.warnings if text not in results.run.warnings],
    )


def agreement_tables(results: Results) -> list[Table]:
    """The metrics, a table each for what they are about, and one of those that are not judged."""
    metrics = by_topic({} if results.metrics is None else results.metrics.metrics)
    judged = {name: metric for name, metric in metrics.items() if metric.agrees is not None}
    others = {name: metric for name, metric in metrics.items() if metric.agrees is None}
    tables = [
        _table(
            title,
            {name: metric for name, metric in judged.items() if topic(name) == title},
            folded=len(judged) > _FEW,
        )
        for title in dict.fromkeys(topic(name) for name in judged)
    ]
    if others:
        tables.append(_table("Metrics that are not judged", others, folded=bool(judged)))
    return tables


_FIRST_WORDS = (
    ("layer", "Layers"),
    ("surface", "Free surface"),
    ("mound", "Free surface"),
    ("mobilised", "Friction"),
)
_TOPICS = ("Force", "Shear bands", "Layers", "Free surface", "Friction")


def by_topic(metrics: Mapping[str, MetricEntry]) -> dict[str, MetricEntry]:
    """Metrics in the order of what they are about."""
    return dict(sorted(metrics.items(), key=lambda item: _TOPICS.index(topic(item[0]))))


def topic(name: str) -> str:
    """What a metric is about, from its name.

    >>> topic("first_peak_N"), topic("second_outcrop_x_mm"), topic("layers_rms_mm")
    ('Force', 'Shear bands', 'Layers')
    """
    words = set(name.split("_"))
    if words & {"band", "bands", "outcrop", "beta"}:
        return "Shear bands"
    for first, title in _FIRST_WORDS:
        if name.startswith(first):
            return title
    return "Force"


def agreement_drawings(metrics: Mapping[str, MetricEntry], pen: Pen) -> list[Drawing]:
    """One picture a topic: errors in validation uncertainties, and what these are made of."""
    shown = {
        name: metric for name, metric in metrics.items() if metric.error is not None and metric.validation_std
    }
    drawings = []
    for title in dict.fromkeys(topic(name) for name in shown):
        some = {name: metric for name, metric in shown.items() if topic(name) == title}
        ratios = [_ratio(metric) or 0.0 for metric in some.values()]
        names = [named(name, metric) for name, metric in some.items()]
        outside = [name for name, ratio in zip(names, ratios, strict=True) if abs(ratio) > 2]
        said = f"Outside two of them: {'; '.join(outside)}." if outside else "All are within two."
        words = f"{title}: errors of {len(ratios)} metrics in validation uncertainties. "
        counted = said if len(outside) <= _NAMED else f"{len(outside)} of them are outside two."
        shares = [parts(metric) for metric in some.values()]
        known = all(share is not None for share in shares)
        figure = agreement_figure(names, ratios, [share for share in shares if share] if known else None)
        name = f"agreement-{title}"
        drawings.append(pen.draw(figure, words + said, words + counted, name=name, data=("metrics.json",)))
    return drawings


def parts(metric: MetricEntry) -> tuple[float, float, float] | None:
    """Shares of the validation uncertainty's square that experiment, inputs and numerics have."""
    squares = [
        std**2 for std in (metric.experiment_std, metric.input_std, metric.numerical_std) if std is not None
    ]
    if len(squares) < 3 or not sum(squares) > 0:
        return None
    total = sum(squares)
    return squares[0] / total, squares[1] / total, squares[2] / total


def _mostly(metric: MetricEntry) -> str:
    """The greatest part of a validation uncertainty, and the input that it comes from."""
    shares = parts(metric)
    if shares is None:
        return ""
    name = ("experiment", "inputs", "numerics")[shares.index(max(shares))]
    return label(metric.dominant_input).lower() if name == "inputs" and metric.dominant_input else name


def _table(title: str, metrics: Mapping[str, MetricEntry], *, folded: bool = False) -> Table:
    notes = list(dict.fromkeys(metric.note for metric in metrics.values() if metric.note))
    rows = [_row(name, metric, notes) for name, metric in metrics.items()]
    return Table(title, HEAD, rows, folded=folded, kind="metrics", footnotes=notes)


def named(name: str, metric: MetricEntry) -> str:
    """A metric's name with its unit."""
    measure = unit("P0" if name.endswith("_P0") else metric.unit)
    return f"{label(name)}, {measure}" if measure else label(name)


def _ratio(metric: MetricEntry) -> float | None:
    """The error over its validation uncertainty, where both are known."""
    return (
        metric.error / metric.validation_std if metric.error is not None and metric.validation_std else None
    )


def _row(name: str, metric: MetricEntry, notes: list[str]) -> list[Cell]:
    twice = None if metric.validation_std is None else 2 * metric.validation_std
    words = {True: ("yes", "agrees"), False: ("no", "differs"), None: ("unknown", "unknown")}
    word, mark = words[metric.agrees]
    return [
        Cell(named(name, metric)),
        pair_cell(metric.experiment, metric.experiment_std),
        pair_cell(metric.model, metric.model_std),
        Cell(with_limit(metric.error, twice), metric.error),
        Cell(number(twice, 2), twice),
        Cell(word, mark=mark),
        Cell(_mostly(metric)),
        Cell(_letter(notes.index(metric.note)) if metric.note in notes else ""),
    ]


def _short_row(name: str, metric: MetricEntry) -> list[Cell]:
    """A row of :data:`SHORT_HEAD`; the answer has a picture of the error beside it."""
    *values, answer = _row(name, metric, [])[: len(SHORT_HEAD)]
    return [*values, Cell(answer.text, mark=answer.mark, ratio=_ratio(metric))]


def _letter(place: int) -> str:
    """Letters of footnotes as an ordered list counts them: a to z, aa, ab."""
    letter = chr(ord("a") + place % 26)
    return letter if place < 26 else _letter(place // 26 - 1) + letter
