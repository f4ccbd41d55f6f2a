"""The texture as the store keeps it gives the same grains as the picture itself, with the noise taken off."""

import numpy as np
import pytest

from ploughval.photos.pattern import pattern_of, texture_of
from ploughval.run.walk.noise import curve_from, noise_arrays
from ploughval.run.walk.pattern import NO_TEXTURE, pattern_from, pattern_record, texture_arrays
from ploughval.synth import sand_texture


def picture(noise_grey, seed):
    rng = np.random.default_rng(4)
    grains = sand_texture(rng, (300, 500)).picture((300, 500))
    return np.clip(
        np.rint(grains + noise_grey * np.random.default_rng(seed).normal(size=grains.shape)), 0, 255
    ).astype(np.uint8)


SAND = np.ones((300, 500), bool)


def test_texture_from_the_store_gives_the_pattern_of_the_picture():
    kept = texture_arrays(picture(0.0, 1), SAND)
    found = pattern_from(kept["texture"], kept["texture_squares"], None)
    assert found == pattern_of(texture_of(picture(0.0, 1), SAND))


def test_measured_noise_is_taken_off_the_contrast_within_1_percent():
    noisy = texture_arrays(picture(6.0, 1), SAND)
    measured = noise_arrays(picture(6.0, 1), picture(6.0, 2), SAND)
    noise = curve_from(measured["noise"], measured["noise_line"])
    without = pattern_of(texture_of(picture(0.0, 1), SAND), 1 / np.sqrt(12))  # of whole grey levels alone
    told = pattern_from(noisy["texture"], noisy["texture_squares"], noise)
    assert told.contrast_grey == pytest.approx(without.contrast_grey, rel=0.01)
    assert told.size_px == pytest.approx(without.size_px, rel=0.02)


def test_a_walk_without_tracks_tells_no_pattern():
    assert pattern_from(NO_TEXTURE["texture"], NO_TEXTURE["texture_squares"], None) is None
    assert pattern_record(None) is None


def test_record_holds_every_value_of_the_pattern():
    kept = texture_arrays(picture(2.0, 1), SAND)
    record = pattern_record(pattern_from(kept["texture"], kept["texture_squares"], None))
    assert record["size_px"] > 1
    assert record["squares"] == len(kept["texture"])
