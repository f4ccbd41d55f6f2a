"""Chapter of the correlation of a pair: piv-settings.csv, and the other programs of peers.csv."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from ploughval.report.blocks import Table, value_cell
from speed_error.points import ERROR, TIME, Level, Panel, Point, Subject, read
from speed_error.words import BUSY, against, dominance, quiet, shown

TIME_LABEL = "CPU, µs a point (one thread)"


class Measured(NamedTuple):
    """A panel's quantity: its key, the case and column it is read from, and the words about it."""

    key: str
    case: str
    column: str
    title: str
    label: str


QUANTITIES = (
    Measured(
        "translation",
        "shift 0.25 noise 3",
        "rmse_px",
        "Translation, noise of 3 grey levels",
        "error, rms, px",
    ),
    Measured("affine", "affine", "rmse_px", "2 % stretch, 3 % shear, 1.5°", "error, rms, px"),
    Measured(
        "band",
        "band 4 px tanh noise 3",
        "near_rmse_px",
        "Within half a subset of a band of 4 px",
        "error, rms, px",
    ),
    Measured("star", "star", "star_period_px", "Least period measured at 90 %", "period, px"),
)
TARGETS = {"affine": (0.0015, "0.0015"), "band": (0.15, "0.15"), "star": (48.0, "48")}
APART = "adaptive, px apart"
TARGET_US = 50.0  # 20 000 points a second
DEFAULT_WORDS = "31 px, affine, quintic, adaptive, 16 px apart"
Rows = pd.DataFrame
Chosen = Callable[[Rows], pd.Series]
FAMILIES: dict[str, tuple[str, Chosen]] = {
    "adaptive, subset px": ("subset", lambda t: (t["shape"] == "adaptive") & (t["step_px"] == 16)),
    "affine, subset px": (
        "subset",
        lambda t: (t["shape"] == "fixed") & (t["order"] == 1) & (t["spline"] == 5),
    ),
    "translation, subset px": ("subset", lambda t: (t["shape"] == "fixed") & (t["order"] == 0)),
    "second order, subset px": ("subset", lambda t: (t["shape"] == "fixed") & (t["order"] == 2)),
    "affine, cubic spline": ("subset", lambda t: t["spline"] == 3),
    APART: ("step_px", lambda t: (t["shape"] == "adaptive") & (t["subset"] == 31)),
}


def subject(folder: Path) -> Subject | None:
    """The chapter, or None where piv-settings.csv is missing."""
    table = read(folder, "piv-settings.csv")
    if table is None:
        return None
    peers, cases = read(folder, "peers.csv"), read(folder, "peers-cases.csv")
    panels = tuple(_panel(table, peers, cases, quantity) for quantity in QUANTITIES)
    files = ("piv.csv", "piv-settings.csv", "peers.csv", "peers-cases.csv", "piv-real.csv")
    return Subject(
        "correlation",
        "Correlation of a pair",
        "Exact pictures of sand, 1024 x 768 px of 8 bit: rigid Gaussian grains of 2.5 to 6 px integrated "
        "over each pixel, so that nothing is interpolated in the truth. First guess and prefilter are in "
        "the times. Stars are other programs on the same pictures, one core each, rounds taken in turn, "
        "at their speed under translation.",
        panels,
        _choice(table, panels, peers, read(folder, "piv.csv")),
        tuple(t for t in (_peers_table(peers), _settings_table(table), _real_table(folder)) if t is not None),
        tuple(name for name in files if (folder / name).is_file()),
    )


def _panel(table: Rows, peers: Rows | None, cases: Rows | None, what: Measured) -> Panel:
    one = table[(table["case"] == what.case) & (table["workers"] == 1)]
    points = []
    for family, (varied, chosen) in FAMILIES.items():
        for _, row in one[chosen(one)].sort_values(varied).iterrows():
            default = _is_default(row)
            points.append(
                Point(family, f"{row[varied]:g}", float(row["cpu_us"]), float(row[what.column]), default)
            )
    levels = [Level(TIME, TARGET_US, "20 000 points/s")]
    if what.key in TARGETS:
        levels.append(Level(ERROR, TARGETS[what.key][0], f"to reach: {TARGETS[what.key][1]} px"))
    if what.key == "translation":
        row = one[[_is_default(row) for _, row in one.iterrows()]].iloc[0]
        bound = float(row["rmse_px"] / row["times_bound"])
        levels += [Level(ERROR, bound, "Cramér–Rao, 31 px", "bound")]
    return Panel(
        what.key,
        what.title,
        what.label,
        TIME_LABEL,
        tuple(points),
        _peers(peers, cases, what.case, what.column),
        tuple(levels),
        DEFAULT_WORDS,
        frozenset({APART}),
    )


def _is_default(row: pd.Series) -> bool:
    wanted = {"subset": 31, "order": 1, "spline": 5, "shape": "adaptive", "step_px": 16, "workers": 1}
    return all(row[name] == value for name, value in wanted.items())


def _peers(peers: Rows | None, cases: Rows | None, case: str, column: str) -> tuple[Point, ...]:
    if peers is None or cases is None:
        return ()
    errors = cases[cases["case"] == case].set_index("package")[column]
    speeds = pd.to_numeric(peers.set_index("package")["points_s"], errors="coerce")
    return tuple(
        Point("other programs", str(name), 1e6 / float(speeds[name]), float(errors.get(name, float("nan"))))
        for name in speeds.index
        if name != "ploughval"
    )


def _choice(
    table: Rows, panels: tuple[Panel, ...], peers: Rows | None, cases: Rows | None
) -> tuple[str, ...]:
    still, _, band, star = panels
    said = [
        f"The default ({DEFAULT_WORDS}) has an error of {shown(still.standard.error)} px under translation "
        f"at noise 3 and {shown(band.standard.error)} px beside a band of 4 px, for "
        f"{shown(still.standard.time)} and {shown(band.standard.time)} µs a point.",
        dominance(still, "Translation"),
        dominance(band, "Beside a band"),
    ]
    adaptive = "adaptive, subset px"
    for size, when in (("41", "Smooth motion, noisy pictures"), ("21", "Small details")):
        one, fine = still.of(adaptive).get(size), star.of(adaptive).get(size)
        if one is not None and fine is not None:
            said.append(
                f"{when}: a subset of {size} px {against(one, still.standard)}; it measures periods down to "
                f"{shown(fine.error)} px (31 px: {shown(star.standard.error)} px)."
            )
    fixed = {panel.key: panel.of("affine, subset px").get("31") for panel in panels}
    if all(fixed.values()):
        said.append(
            'Without shear bands: shape="fixed" in place of adaptive '
            f"{against(fixed['translation'], still.standard)} under translation; beside a band it "
            f"{against(fixed['band'], band.standard)}."
        )
    cubic = still.of("affine, cubic spline").get("31")
    if cubic is not None and fixed["translation"] is not None:
        said.append(f"A cubic spline in place of the quintic {against(cubic, fixed['translation'])}.")
    return (*said, *_step(still), *_threads(table), *_rivals(peers), *_honesty(cases))


def _step(still: Panel) -> list[str]:
    close = still.of(APART).get("8")
    if close is None:
        return []
    times = 4.0 * close.time / still.standard.time
    return [
        f"Points 8 px apart in place of 16 px are four times as many and take {shown(times)} times the time "
        f"of the picture; the error of each is {shown(close.error / still.standard.error)} times as large."
    ]


def _honesty(cases: Rows | None) -> list[str]:
    """Shares of errors within the stated deviations, by kind of case."""
    if cases is None:
        return []
    said = []
    for what, chosen in (
        ("translation", cases["case"].str.startswith("shift")),
        (
            "affine motion, rotation and changed light",
            cases["case"].isin(["affine", "rotation 15 deg", "light"]),
        ),
        ("10 % contrast", cases["case"] == "hard"),
        ("a band in the picture", cases["case"].str.startswith("band")),
        ("sinusoids at noise 3", cases["case"] == "star noise 3"),
    ):
        some = cases[chosen]
        if not some.empty:
            said.append(f"{_range(some['within_1_std'])} and {_range(some['within_2_std'])} % ({what})")
    return (
        ["Of the errors lie within one and two stated deviations: " + ", ".join(said) + "."] if said else []
    )


def _range(shares: pd.Series) -> str:
    low, high = 100.0 * float(shares.min()), 100.0 * float(shares.max())
    return f"{low:.0f}" if round(low) == round(high) else f"{low:.0f} to {high:.0f}"


def _threads(table: Rows) -> list[str]:
    case = table[table["case"] == "shift 0.25 noise 3"]
    two = case[case["workers"] == 2]
    one = case[[_is_default(row) for _, row in case.iterrows()]]
    if two.empty or one.empty:
        return []
    times = [(float(row["cpu_us"]), 1e6 / float(row["points_s"])) for row in (one.iloc[0], two.iloc[0])]
    if not quiet(*times):
        return [BUSY]
    ratio = times[0][1] / times[1][1]
    same = two["rmse_px"].iloc[0] == one["rmse_px"].iloc[0]
    numbers = "the same errors" if same else "other errors"
    return [f"Two threads do {shown(ratio)} times the points a second of one by the clock, with {numbers}."]


def _rivals(peers: Rows | None) -> list[str]:
    if peers is None:
        return []
    speeds = pd.to_numeric(peers.set_index("package")["points_s"], errors="coerce")
    near = pd.to_numeric(peers.set_index("package")["near_4"], errors="coerce")
    others = speeds.drop("ploughval", errors="ignore")
    faster = [str(name) for name in others.index if others[name] > speeds.get("ploughval", float("nan"))]
    closer = [str(name) for name in others.index if near[name] < near.get("ploughval", float("nan"))]
    return [
        "Other programs on the same pictures: "
        + (f"faster: {', '.join(faster)}" if faster else f"faster: none of {len(others)}")
        + "; more exact beside a band of 4 px: "
        + (f"{', '.join(closer)}." if closer else f"none of {len(others)}.")
    ]


def _settings_table(table: Rows) -> Table:
    head = ["Case", "Subset, px", "Order", "Spline", "Shape", "Apart, px", "Threads", "CPU, µs a point"]
    head += ["Points/s by the clock", "Rms, px", "Times the bound", "Near a band, px", "Period, px", "Valid"]
    names = [
        "case",
        "subset",
        "order",
        "spline",
        "shape",
        "step_px",
        "workers",
        "cpu_us",
        "points_s",
        "rmse_px",
    ]
    names += ["times_bound", "near_rmse_px", "star_period_px", "valid"]
    rows = [
        [value_cell(value, 3) for value in row] for row in table[names].itertuples(index=False, name=None)
    ]
    return Table("Every setting and case", head, rows, folded=True)


def _real_table(folder: Path) -> Table | None:
    real = read(folder, "piv-real.csv")
    if real is None:
        return None
    head = ["Set", "Quantity", "Stated", "Measured", "Unit", "Note"]
    rows = [
        [value_cell("" if isinstance(v, float) and v != v else v, 3) for v in row]
        for row in real.itertuples(index=False, name=None)
    ]
    return Table("Real pictures of others, against what is known of them", head, rows, folded=True)


def _peers_table(peers: Rows | None) -> Table | None:
    if peers is None:
        return None
    head = ["Program", "Version", "Bias, px", "Bias, noise 3, px", "Times the bound", "Affine, px"]
    head += [
        "Low contrast, px",
        "Near a band of 12 px",
        "Near a band of 4 px",
        "Period at 90 %, px",
        "Points/s",
    ]
    names = [
        "package",
        "version",
        "bias_0",
        "bias_3",
        "x_bound",
        "affine_rmse",
        "hard_rmse",
        "near_12",
        "near_4",
    ]
    names += ["star_90", "points_s"]
    rows = [
        [value_cell(value, 3) for value in row] for row in peers[names].itertuples(index=False, name=None)
    ]
    notes = [f"{row.package}: {row.remark}" for row in peers.itertuples() if isinstance(row.remark, str)]
    return Table("Other programs on the same pictures", head, rows, footnotes=notes)
