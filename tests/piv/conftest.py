"""Exact pictures of sand for the tests of correlation: rigid Gaussian grains, rounded to 8 bit."""

from dataclasses import dataclass

import numpy as np
import pytest

from ploughval.synth.sand import Grains, sand_texture


@dataclass(frozen=True)
class Sand:
    """Grains, and pictures of them after any motion."""

    grains: Grains
    shape: tuple[int, int]

    def picture(self, motion=None, *, noise=0.0, seed=0, kind=np.uint8):
        """Picture after a motion (function of points (N, 2), or one shift), with noise, rounded."""
        where = self.grains.positions_px
        moved = np.zeros(2) if motion is None else motion(where) if callable(motion) else np.asarray(motion)
        picture = self.grains.moved(moved).picture(self.shape).astype(float)
        picture += np.random.default_rng(seed).normal(0, noise, self.shape) if noise else 0.0
        if kind == np.uint16:
            picture *= 200
        if kind == np.float32:
            return picture.astype(np.float32)
        return np.round(picture.clip(0, np.iinfo(kind).max)).astype(kind)

    def points(self, spacing, margin=24):
        """Grid of points away from the border, (N, 2) px."""
        height, width = self.shape
        axes = np.arange(margin, width - margin, spacing), np.arange(margin, height - margin, spacing)
        return np.stack([a.ravel() for a in np.meshgrid(*axes)], axis=1).astype(float)


@pytest.fixture(scope="session")
def sand():
    shape = (220, 260)
    return Sand(sand_texture(np.random.default_rng(11), shape, margin_px=80, grey=(105, 200)), shape)
