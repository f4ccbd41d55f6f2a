"""Stage results are found again only under their own key, and whatever is broken is made again."""

import io
import shutil

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ploughval.errors import DataError
from ploughval.run.kept import store as stores
from ploughval.run.kept.store import Key, Store, key_of

ONE, TWO = Key.of(code="1", settings="a"), Key.of(code="1", settings="b")
ARRAYS = {"x": np.linspace(0, 1, 5), "text": np.array('{"3": "reason"}')}


def kept_names(folder):
    return sorted(path.name.rsplit("-", 1)[0] for path in (folder / ".store").glob("*.npz"))


def test_keys_of_different_parts_never_meet():
    assert key_of("ab", "c") != key_of("a", "bc")
    assert key_of("ab", "c") == key_of("ab", "c")
    assert Key.of(ab="c").digest != Key.of(a="bc").digest


def test_a_key_names_the_parts_that_differ_from_another():
    assert TWO.changed_from(ONE.to_json()) == ["settings"]
    assert Key.of(code="1", first_photograph="0").changed_from(ONE.to_json()) == ["first photograph"]


def test_a_stage_comes_back_only_under_its_key_and_unharmed(tmp_path):
    store = Store(tmp_path)
    assert store.save("window", ONE, ARRAYS)
    assert store.load("window", TWO) is None
    assert store.told["window"] == (False, "changed: settings")
    kept = store.load("window", ONE)
    assert store.told["window"] == (True, "same inputs, settings and code")
    assert kept.keys() == ARRAYS.keys()
    assert np.array_equal(kept["x"], ARRAYS["x"])
    assert str(kept["text"]) == '{"3": "reason"}'


def test_a_stage_of_another_name_is_not_its_own(tmp_path):
    store = Store(tmp_path)
    store.save("window", ONE, ARRAYS)
    assert store.load("bands", ONE) is None
    assert store.told["bands"] == (False, "nothing was kept")


def test_who_starts_over_finds_nothing_and_leaves_nothing(tmp_path):
    Store(tmp_path).save("window", ONE, ARRAYS)
    (tmp_path / ".store" / "notes.txt").write_text("not of the store")
    fresh = Store(tmp_path, fresh=True)
    assert fresh.load("window", ONE) is None
    assert fresh.told["window"] == (False, "asked to start over")
    fresh.clean()
    assert [path.name for path in (tmp_path / ".store").iterdir()] == ["notes.txt"]


def test_what_a_killed_run_left_half_written_is_removed_and_what_is_kept_stays(tmp_path):
    store = Store(tmp_path)
    store.save("window", ONE, ARRAYS)
    (tmp_path / ".store" / f".window-{ONE.digest[:32]}.part-abcdefgh.npz").write_bytes(b"half")
    store.clean()
    assert len(list((tmp_path / ".store").iterdir())) == 1
    assert store.load("window", ONE) is not None


def test_a_new_key_replaces_the_old_one_and_no_other_stage(tmp_path):
    store = Store(tmp_path)
    for stage in ("window", "walk-000000", "walk-000012", "walk"):
        store.save(stage, ONE, ARRAYS)
    for stage in ("window", "walk"):
        store.save(stage, TWO, ARRAYS)
    assert kept_names(tmp_path) == ["walk", "walk-000000", "walk-000012", "window"]
    assert store.load("walk-000012", ONE) is not None
    store.drop("walk")
    assert kept_names(tmp_path) == ["window"]


def test_a_file_under_another_ones_name_is_refused(tmp_path):
    """A key's name has 128 bits of its digest; the whole key stands in the file."""
    store = Store(tmp_path)
    store.save("window", ONE, ARRAYS)
    (path,) = (tmp_path / ".store").glob("*.npz")
    shutil.copy(path, path.with_name(f"window-{TWO.digest[:32]}.npz"))
    assert store.load("window", TWO) is None
    assert store.told["window"] == (False, "what was kept cannot be read")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A folder with one kept stage, and the bytes of its file."""
    folder = tmp_path_factory.mktemp("whole")
    Store(folder).save("window", ONE, {"x": np.arange(40.0), "n": np.arange(3), "s": np.array("text")})
    (path,) = (folder / ".store").glob("*.npz")
    return folder, path, path.read_bytes()


@given(data=st.data())
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_file_that_is_cut_off_or_changed_is_made_again_or_read_right(whole, data):
    folder, path, good = whole
    place = data.draw(st.integers(0, len(good) - 1))
    if data.draw(st.booleans()):
        path.write_bytes(good[:place])
    else:
        changed = bytearray(good)
        changed[place] ^= data.draw(st.integers(1, 255))
        path.write_bytes(bytes(changed))
    kept = Store(folder).load("window", ONE)
    if kept is not None:  # dates and other bytes that say nothing of the arrays
        assert np.array_equal(kept["x"], np.arange(40.0))
        assert np.array_equal(kept["n"], np.arange(3))
        assert str(kept["s"]) == "text"


def array_file():
    buffer = io.BytesIO()
    np.save(buffer, np.arange(3))
    return buffer.getvalue()


KINDS = {
    "empty": b"",
    "text": b"text\n",
    "pickle": b"\x80\x04K\x01.",
    "no members": b"PK\x05\x06" + bytes(18),
}


@pytest.mark.parametrize("content", [*KINDS.values(), array_file()], ids=[*KINDS, "one array"])
def test_a_file_of_another_kind_is_made_again(tmp_path, content):
    store = Store(tmp_path)
    store.save("window", ONE, ARRAYS)
    (path,) = (tmp_path / ".store").glob("*.npz")
    path.write_bytes(content)
    assert store.load("window", ONE) is None
    assert store.told["window"] == (False, "what was kept cannot be read")
    assert store.save("window", ONE, ARRAYS)
    assert store.load("window", ONE) is not None


def test_a_disk_that_refuses_costs_the_keeping_alone(tmp_path, monkeypatch):
    def full(path, write):
        raise DataError("no space is left", path=path)

    store = Store(tmp_path)
    store.save("window", ONE, ARRAYS)
    monkeypatch.setattr(stores, "write_aside", full)
    assert not store.save("window", TWO, ARRAYS)
    (refused,) = store.refused
    assert refused.startswith("window: not kept")
    assert "no space is left" in refused
    assert store.load("window", ONE) is not None
