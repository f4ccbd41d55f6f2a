"""Tables come back from the store with the same values, types, rows and columns."""

import io

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ploughval.run.kept.snapshots import from_arrays, to_arrays

TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=5)
THINGS = st.one_of(st.none(), st.booleans(), st.integers(-(2**70), 2**70), st.floats(), TEXTS)
COLUMNS = {
    np.float64: st.floats(),
    np.int64: st.integers(-(2**63), 2**63 - 1),
    np.bool_: st.booleans(),
    np.int8: st.integers(-128, 127),
}


def through_a_file(value):
    """The value after its arrays went through a file."""
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **to_arrays(value))
    buffer.seek(0)
    with np.load(buffer, allow_pickle=False) as file:
        return from_arrays(dict(file), ())


@st.composite
def tables(draw):
    rows = draw(st.integers(0, 5))
    made = {}
    for name in draw(st.lists(TEXTS, max_size=4, unique=True)):
        kind = draw(st.sampled_from([*COLUMNS, "text", "category", "object"]))
        if kind in COLUMNS:
            made[name] = np.array(draw(st.lists(COLUMNS[kind], min_size=rows, max_size=rows)), kind)
        elif kind == "text":
            values = draw(st.lists(st.one_of(TEXTS, st.none()), min_size=rows, max_size=rows))
            made[name] = pd.array(values, dtype="str")
        elif kind == "category":
            values = draw(st.lists(st.sampled_from(["a", "b", None]), min_size=rows, max_size=rows))
            made[name] = pd.Categorical(values, ["b", "a", "c"], ordered=draw(st.booleans()))
        else:
            values = draw(st.lists(THINGS, min_size=rows, max_size=rows))
            made[name] = pd.Series(values, dtype=object)
    return pd.DataFrame(made, index=range(rows))


@given(table=tables())
@settings(max_examples=60, deadline=None)
def test_any_table_comes_back_as_it_was(table):
    again = through_a_file({"table": table})["table"]
    pd.testing.assert_frame_equal(again, table, check_exact=True, check_freq=False)
    for name in table.columns:
        if table[name].dtype == object:  # equal is not enough: True equals 1, and 1 equals 1.0
            assert [type(value) for value in again[name]] == [type(value) for value in table[name]]
    assert again.to_csv(float_format="%.9g") == table.to_csv(float_format="%.9g")


def test_index_and_attributes_come_back_as_they_were():
    table = pd.DataFrame({"x": [1.0, -0.0, np.nan]}, index=pd.Index(["a", "b", "c"], name="key"))
    table.attrs = {"bound_mm": 0.1, "words": ("a", None)}
    again = through_a_file(table)
    pd.testing.assert_frame_equal(again, table, check_exact=True)
    assert again.attrs == table.attrs
    assert np.signbit(again["x"].to_numpy()[1])
    later = table.iloc[1:].reset_index(drop=True).iloc[1:]
    pd.testing.assert_frame_equal(through_a_file(later), later, check_index_type="exact")


def test_an_empty_table_keeps_its_columns_and_their_types():
    texts, things = pd.array([], "str"), pd.Series([], dtype=object)
    table = pd.DataFrame({"n": np.empty(0, np.int64), "text": texts, "any": things})
    again = through_a_file(table)
    pd.testing.assert_frame_equal(again, table)
    assert again.dtypes.tolist() == table.dtypes.tolist()


def test_a_column_without_a_name_is_refused():
    with pytest.raises(TypeError, match="column that is named 0"):
        to_arrays(pd.DataFrame([[1.0]]))
