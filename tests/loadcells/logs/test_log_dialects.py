"""Any table written in any dialect reads back to the written numbers; no spoiled file ends in a crash."""

import time

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ploughval.errors import PloughvalError
from ploughval.loadcells import read_log
from ploughval.scene import LogColumns

NAMES = ("time_s", "displacement_mm", "moment_upper_Nm", "moment_lower_Nm")
KEYS = ("time_s", "displacement_mm", "moment_upper", "moment_lower")
EXAMPLES = 300
SLOW = (HealthCheck.function_scoped_fixture, HealthCheck.too_slow)


@st.composite
def tables(draw):
    """Rows of whole numbers of 1/10**digits: exact in any decimal notation."""
    count = draw(st.integers(3, 30))
    digits = draw(st.integers(0, 6))
    step = draw(st.integers(1, 500))
    steps = np.arange(1, count + 1) * step + draw(st.integers(-10_000, 10_000))
    rows = draw(st.lists(st.integers(-(10**9), 10**9), min_size=3 * count, max_size=3 * count))
    return np.column_stack([steps, np.array(rows).reshape(count, 3)]), digits


@st.composite
def dialects(draw):
    separator = draw(st.sampled_from([",", ";", "\t", "|", " ", "  ", "; "]))
    quoted = draw(st.booleans())
    return {
        "separator": separator,
        "decimal": draw(st.sampled_from([".", ","] if separator != "," or quoted else ["."])),
        "quoted": quoted,
        "encoding": draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "latin-1"])),
        "preamble": draw(st.sampled_from([[], ["Rig 7"], ["Rig 7", "", "Prüfung 3, made; by | us"], [""]])),
        "units": draw(st.sampled_from([None, ("s", "mm", "N m", "Nm"), ("[s]", "[mm]", "", "")])),
        "brackets": draw(st.booleans()),
        "order": draw(st.permutations(range(5))),
        "end": draw(st.sampled_from(["\n", "\r\n", "\r"])),
        "last": draw(st.booleans()),
    }


def written(value, digits):
    whole, rest = divmod(abs(int(value)), 10**digits)
    return f"{'-' if value < 0 else ''}{whole}" + (f".{rest:0{digits}d}" if digits else "")


def write(path, table, digits, dialect):
    """A log in a dialect, with a fifth column that nobody asks for."""

    def line(cells):
        cells = [cells[k] for k in dialect["order"]]
        return dialect["separator"].join(f'"{c}"' if dialect["quoted"] else c for c in cells)

    names = ["t (s)", "disp [mm]", "upper (N m)", "lower / Nm", "spare"]
    lines = list(dialect["preamble"])
    blanks = " " in dialect["separator"] and not dialect["quoted"]
    lines.append(
        line([n.replace(" ", "") if blanks else n for n in names] if dialect["brackets"] else [*NAMES, "x"])
    )
    if dialect["units"] and not (blanks and not all(dialect["units"])):
        lines.append(line([u.replace(" ", "") if blanks else u for u in (*dialect["units"], "V")]))
    for row in table:
        lines.append(line([written(v, digits).replace(".", dialect["decimal"]) for v in (*row, 7)]))
    text = dialect["end"].join(lines) + dialect["end"] * dialect["last"]
    path.write_bytes(text.encode(dialect["encoding"]))


@settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=SLOW)
@given(tables(), dialects())
def test_any_table_in_any_dialect_reads_back_to_the_written_numbers(tmp_path, made, dialect):
    table, digits = made
    path = tmp_path / "log.csv"
    write(path, table, digits, dialect)
    columns = LogColumns()
    if dialect["brackets"]:
        columns = LogColumns(
            time_s="t", displacement_mm="disp", moment_upper_Nm="upper", moment_lower_Nm="lower"
        )
    log = read_log(path, columns)
    # The faults of values are another matter: random values drop out and spike.
    for k, key in enumerate(KEYS):
        values = log.data[key].to_numpy()
        assert values.size == len(table)
        expected = np.array([float(written(v, digits)) for v in table[:, k]])
        kept = np.isfinite(values)
        assert kept.all() or set(log.data["status"]) != {"ok"}
        # One unit in the last place: older readers of text round once too often.
        np.testing.assert_allclose(values[kept], expected[kept], rtol=3e-16, atol=0)


def sound_log():
    rng = np.random.default_rng(5)
    t = np.arange(80) * 0.1
    rows = np.column_stack([t, np.clip(t - 2, 0, None), rng.normal(1, 0.1, 80), rng.normal(2, 0.1, 80)])
    return ",".join(NAMES).encode() + b"\n" + b"".join(b"%.4f,%.4f,%.4f,%.4f\n" % tuple(r) for r in rows)


SOUND = sound_log()
PIECES = st.one_of(
    st.binary(max_size=8),
    st.sampled_from(
        [
            b"\0",
            b"\0" * 300,
            b"\n",
            b"\r",
            b'"',
            b"'",
            b",",
            b";",
            b"\t",
            b"1e300",
            b"-1e308",
            b"1e999",
            b"nan",
            *(
                b"inf",
                b"2026-11-27 10:00:00",
                b"11/12/2026",
                b"10:15:03",
                b"\xff\xfe",
                b"\xef\xbb\xbf",
                b"0x1f",
            ),
            *(NAMES[0].encode(), b",,,,,,,,,", b"9" * 30, b"1_000", b"True", b"\xe9", b"(s)"),
        ]
    ),
)


def ends_well(path):
    """The file is read or refused with a message that names it, without hanging."""
    begun = time.perf_counter()
    log, refused = None, path.name
    try:
        log = read_log(path, LogColumns())
    except PloughvalError as error:
        refused = str(error)
    assert path.name in refused
    if log is not None:
        steps = np.diff(log.data["time_s"])
        assert (steps > 0).all()
        assert np.isfinite(log.data["time_s"]).all()
        assert not np.isinf(log.data[list(KEYS)].to_numpy()).any()
    assert time.perf_counter() - begun < 20.0  # none may hang


@settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=SLOW)
@given(st.lists(st.tuples(st.floats(0, 1), st.integers(0, 40), PIECES), min_size=1, max_size=6))
def test_a_log_with_pieces_replaced_is_read_or_refused(tmp_path, changes):
    data = SOUND
    for place, length, piece in changes:
        at = int(place * len(data))
        data = data[:at] + piece + data[at + length :]
    path = tmp_path / "log.csv"
    path.write_bytes(data)
    ends_well(path)


@settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=SLOW)
@given(st.binary(max_size=400))
@pytest.mark.parametrize("head", [b"", ",".join(NAMES).encode() + b"\n", b"\xff\xfe"])
def test_random_bytes_are_read_or_refused(tmp_path, head, data):
    path = tmp_path / "log.csv"
    path.write_bytes(head + data)
    ends_well(path)
