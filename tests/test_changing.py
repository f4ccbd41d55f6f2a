"""What changes from photograph to photograph, taken out and put back."""

import numpy as np
import pytest

from ploughval.changing import Changing, packed, unpacked


class Part(Changing):
    CHANGES = ("row",)

    def __init__(self):
        self.row = np.zeros(3)


class Follower(Changing):
    CHANGES = ("count", "best", "parts", "seen")

    def __init__(self):
        self.count, self.best, self.parts = 0, Part(), {1.5: Part(), 2.5: Part()}
        self.seen = {"none": 0}
        self.rest = "from the first photograph"

    def follow(self):
        self.count += 1
        self.best.row += 1
        self.parts[2.5].row -= 1
        self.seen["last"] = self.count


def test_a_snapshot_stays_as_it_was_taken():
    follower = Follower()
    taken = follower.snapshot()
    follower.follow()
    assert taken["count"] == 0
    assert not taken["best"]["row"].any()
    assert not taken["parts"][2.5]["row"].any()
    assert taken["seen"] == {"none": 0}


def test_another_object_goes_on_from_it_and_leaves_it_as_it_was():
    follower = Follower()
    follower.follow()
    taken = follower.snapshot()
    other = Follower()
    other.restore(taken)
    other.follow()
    follower.follow()
    assert other.count == follower.count == 2
    assert (other.best.row == follower.best.row).all()
    assert (other.parts[2.5].row == [-2, -2, -2]).all()
    assert other.seen == follower.seen
    assert (taken["best"]["row"] == 1).all()


def test_what_is_missing_in_a_snapshot_is_refused():
    taken = Follower().snapshot()
    del taken["parts"][1.5]["row"]
    with pytest.raises(KeyError, match="row"):
        Follower().restore(taken)


@pytest.mark.parametrize("shape", [(1, 1), (7, 5), (40, 33), (0, 4)])
def test_a_mask_comes_back_from_its_bytes(shape):
    mask = np.random.default_rng(1).random(shape) < 0.5
    assert (unpacked(packed(mask.astype(np.uint8)), shape) == mask).all()


def test_a_mask_of_sand_takes_few_bytes():
    assert packed(np.tri(1000, 1000)).nbytes < 5000


@pytest.mark.parametrize(
    "data", [b"", b"no mask", bytes(packed(np.ones((9, 9)))), bytes(packed(np.ones((2, 2))))]
)
def test_bytes_of_another_mask_are_refused(data):
    with pytest.raises(ValueError, match="packed mask"):
        unpacked(np.frombuffer(data, np.uint8), (20, 20))
