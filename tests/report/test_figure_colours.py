"""Colours of what is compared stay apart for eyes that lack red or green."""

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from skimage.color import rgb2lab

from ploughval.report.figures import style
from ploughval.report.figures.differences import STEPS

# Machado, Oliveira & Fernandes (2009), severity 1, for linear RGB.
DICHROMATS = {
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
                   [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
                     [-0.011820, 0.042940, 0.968881]],
}  # fmt: skip


@pytest.mark.parametrize("matrix", DICHROMATS.values(), ids=DICHROMATS.keys())
def test_measured_and_predicted_stay_apart_without_red_or_green(matrix):
    def lightness_and_hue(colour):
        rgb = np.array(to_rgb(colour))
        linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        seen = np.clip(np.array(matrix) @ linear, 0, 1)
        back = np.where(seen <= 0.0031308, 12.92 * seen, 1.055 * seen ** (1 / 2.4) - 0.055)
        return rgb2lab(back[None, None])[0, 0]

    pairs = ((style.MEASURED, style.MODEL), (style.MEASURED, style.INK), (style.MODEL, style.INK))
    pairs += ((style.MODEL, style.SAND), (STEPS[0], STEPS[-1]), (STEPS[3], STEPS[4]))
    for one, other in pairs:  # 20 is ten times what is told apart side by side
        assert np.linalg.norm(lightness_and_hue(one) - lightness_and_hue(other)) > 20, (one, other)
