"""What hard pictures are held to, and how they are made."""

import numpy as np
import pytest

from ploughval.axes import Status
from ploughval.synth.sand import sand_texture

WRONG_PX = 0.5
"""A returned vector that errs by more is wrong: a hundred times what clean sand gives, and half a pixel."""
SIGMAS = 6.0
"""The largest of some hundred normal errors is 3.5 standard deviations; those of textures scatter more."""
ALIAS_PX = 0.006
"""Largest error of clean 8 bit sand: grains down to 0.6 px standard deviation alias (test_correlate)."""


def _assert_honest(tracks):
    """What is valid is finite; what is not has a reason and NaN, not a number."""
    valid = tracks.valid
    assert set(tracks.status.tolist()) <= {int(s) for s in Status}
    for values in (tracks.displacement, tracks.gradient, tracks.std):
        assert np.isfinite(values[valid]).all()
        assert np.isnan(values[~valid]).all()
    assert (tracks.std[valid] >= 0).all()
    assert (tracks.pixels[valid] > 0).all()
    assert np.isfinite(tracks.zncc).all()
    assert np.abs(tracks.zncc).max(initial=0.0) <= 1 + 1e-5  # sums in single precision


def _errors(tracks, truth):
    """Larger component of the error of each vector (N,) px, NaN where there is none."""
    return np.abs(tracks.displacement - truth).max(axis=1)


def _assert_none_wrong(tracks, truth, px=WRONG_PX, share=0.0):
    """At most a share of the valid vectors is wrong by more than ``px``."""
    _assert_honest(tracks)
    error = _errors(tracks, truth)
    worst = np.argsort(-np.nan_to_num(error))[:3]
    told = [
        (tracks.points[k].tolist(), tracks.displacement[k].round(3).tolist(), tracks.std[k].round(4).tolist())
        for k in worst
    ]
    wrong = int(np.sum(error > px))
    assert wrong <= share * tracks.valid.sum(), f"{wrong} of {tracks.valid.sum()} are wrong: {told}"


def _assert_covered(tracks, truth, px=ALIAS_PX):
    """Errors stay within what the predicted standard deviation allows, beyond the aliasing of the grains."""
    _assert_honest(tracks)
    excess = (np.abs(tracks.displacement - truth) - px) / np.maximum(tracks.std, 1e-9)
    assert np.nanmax(excess) < SIGMAS


def _rounded(picture):
    return np.round(np.clip(picture, 0, 255)).astype(np.uint8)


def _noisy(picture, rng, noise):
    return _rounded(picture + rng.normal(0, noise, picture.shape))


def _places(shape):
    """Columns and rows of all pixels."""
    return np.meshgrid(np.arange(shape[1]), np.arange(shape[0]))


def _other_sand(shape, seed):
    """A picture of other sand of the same kind."""
    return _rounded(
        sand_texture(np.random.default_rng(seed), shape, margin_px=20, grey=(105, 200)).picture(shape)
    )


@pytest.fixture(scope="session")
def assert_honest():
    return _assert_honest


@pytest.fixture(scope="session")
def errors():
    return _errors


@pytest.fixture(scope="session")
def assert_none_wrong():
    return _assert_none_wrong


@pytest.fixture(scope="session")
def assert_covered():
    return _assert_covered


@pytest.fixture(scope="session")
def rounded():
    return _rounded


@pytest.fixture(scope="session")
def noisy():
    return _noisy


@pytest.fixture(scope="session")
def places():
    return _places


@pytest.fixture(scope="session")
def other_sand():
    return _other_sand
