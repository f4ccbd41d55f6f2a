"""Nested values become named arrays and come back exactly; what was stored cannot make anything else."""

import io
import json
import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays_of

from ploughval.run.kept.snapshots import TREE, from_arrays, to_arrays


class Colour(StrEnum):
    DARK = "dark"


@dataclass(frozen=True)
class Grain:
    size: object
    place: object


@dataclass(frozen=True)
class Stranger:
    size: object


arrays = st.one_of(
    arrays_of.arrays(kind, arrays_of.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=3))
    for kind in (np.float64, np.float32, np.int64, np.uint8, np.bool_, np.dtype("U3"))
)
plain = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5), st.just(Colour.DARK),
    st.builds(np.float32, st.floats(width=32)), st.builds(np.int16, st.integers(-9, 9)),
)  # fmt: skip
keys = st.one_of(st.booleans(), st.integers(), st.floats(allow_nan=False), st.text(max_size=5))
values = st.recursive(
    plain | arrays,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3),
        st.lists(inner, max_size=3).map(tuple),
        st.dictionaries(keys, inner, max_size=3),
        st.builds(Grain, inner, inner),
    ),
    max_leaves=8,
)


def stored(value):
    """The value as it comes back from a file."""
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **to_arrays(value))
    file.seek(0)
    with np.load(file, allow_pickle=False) as back:
        return from_arrays(dict(back), (Grain, Colour))


def same(one, other):
    assert type(one) is type(other)
    if isinstance(one, (np.ndarray, np.generic)):
        assert (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())
    elif isinstance(one, Grain):
        same((one.size, one.place), (other.size, other.place))
    elif isinstance(one, dict):
        same([*one.keys(), *one.values()], [*other.keys(), *other.values()])
    elif isinstance(one, (list, tuple)):
        assert len(one) == len(other)
        for a, b in zip(one, other, strict=True):
            same(a, b)
    else:
        assert repr(one) == repr(other)


@settings(max_examples=60, deadline=None, derandomize=True, database=None)
@given(values)
def test_a_nested_value_comes_back_with_its_types_and_bytes(value):
    same(value, stored(value))


def test_numbers_that_text_spoils_come_back_exactly():
    value = [0.1 + 0.2, math.nan, math.inf, -0.0, 5e-324, 2**70, np.float64(0.1), "\udc80 \0"]
    same(value, stored(value))


def test_order_of_an_array_in_memory_is_kept():
    across = np.asfortranarray(np.arange(6.0).reshape(2, 3))
    assert stored([across])[0].flags.f_contiguous


def test_only_the_named_kinds_are_made():
    arrays = to_arrays(Stranger(1))
    with pytest.raises(ValueError, match="Stranger"):
        from_arrays(arrays, (Grain,))
    for text in (
        '["object", "Grain", {"no": 1}]',
        '["call", "os"]',
        '["array", "gone"]',
        "[",
        "[1, 2, 3, 4]",
    ):
        with pytest.raises(ValueError, match=r"stored|Expecting"):
            from_arrays({TREE: np.array(text)}, (Grain,))


@pytest.mark.parametrize(
    "value", [object(), {1, 2}, np.array([object()]), {(1, 2): 3}, {np.float64(1): 2}, lambda: 0, b"bytes"]
)
def test_what_cannot_be_stored_is_refused(value):
    with pytest.raises(TypeError, match="cannot be stored"):
        to_arrays({"at": value})


def test_the_tree_is_plain_json():
    tree = to_arrays({"size": np.zeros(2), "places": (1, None)})[TREE]
    assert json.loads(str(tree)) == [
        "dict",
        [["size", ["array", "value/size"]], ["places", ["tuple", [1, None]]]],
    ]
