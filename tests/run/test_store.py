"""Stage results are found again only under their own key."""

import numpy as np

from ploughval.run.store import Store, key_of


def test_keys_of_different_parts_never_meet():
    assert key_of("ab", "c") != key_of("a", "bc")
    assert key_of("ab", "c") == key_of("ab", "c")


def test_a_stage_comes_back_only_under_its_key_and_unharmed(tmp_path):
    store = Store(tmp_path)
    arrays = {"x": np.linspace(0, 1, 5), "text": np.array('{"3": "reason"}')}
    store.save("window", key_of("one"), arrays)
    assert store.load("window", key_of("two")) is None
    kept = store.load("window", key_of("one"))
    assert np.array_equal(kept["x"], arrays["x"])
    assert str(kept["text"]) == '{"3": "reason"}'
    assert Store(tmp_path, fresh=True).load("window", key_of("one")) is None


def test_a_truncated_stage_is_run_again_not_read(tmp_path):
    store = Store(tmp_path)
    store.save("window", key_of("one"), {"x": np.arange(1000.0)})
    (path,) = (tmp_path / ".store").glob("*.npz")
    path.write_bytes(path.read_bytes()[:100])
    assert store.load("window", key_of("one")) is None


def test_a_new_key_replaces_the_old_one(tmp_path):
    store = Store(tmp_path)
    store.save("window", key_of("one"), {"x": np.arange(3)})
    store.save("window", key_of("two"), {"x": np.arange(3)})
    assert len(list((tmp_path / ".store").glob("*.npz"))) == 1
