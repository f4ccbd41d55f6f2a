"""The page's colours: every text stands out from every ground it lies on, in each theme."""

import re
from importlib import resources

import pytest

LEAST = 4.5  # WCAG 2.2, 1.4.3, level AA: text of any size
LEAST_SHAPE = 3.0  # WCAG 2.2, 1.4.11: lines and marks that carry meaning
TEXTS = ("ink", "muted", "link", "differs", "measured")
SHAPES = ("measured", "model", "differs")
GROUNDS = ("page", "paper", "tile")


def sheet():
    folder = resources.files("ploughval.report").joinpath("templates")
    return folder.joinpath("style.css.j2").read_text(encoding="utf-8")


def themes():
    """Custom properties of light, dark and print; what dark and print do not name is that of light."""
    blocks = re.findall(r":root \{(.*?)\}", sheet(), re.S)
    assert len(blocks) == 3
    found = [dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6});", block)) for block in blocks]
    return {name: found[0] | own for name, own in zip(("light", "dark", "print"), found, strict=True)}


def luminance(colour):
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return sum(w * p for w, p in zip((0.2126, 0.7152, 0.0722), linear, strict=True))


def contrast(one, other):
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_contrast_of_black_on_white_is_that_of_the_standard():
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#767676", "#ffffff") == pytest.approx(4.54, abs=0.005)


@pytest.mark.parametrize("theme", ["light", "dark", "print"])
def test_texts_and_marks_stand_out_from_every_ground(theme):
    colours = themes()[theme]
    for ground in GROUNDS:
        for text in TEXTS:
            assert contrast(colours[text], colours[ground]) >= LEAST, (text, ground)
        for shape in SHAPES:
            assert contrast(colours[shape], colours[ground]) >= LEAST_SHAPE, (shape, ground)


@pytest.mark.parametrize("theme", ["light", "dark", "print"])
def test_measured_and_predicted_differ_in_lightness_or_hue_for_the_colour_blind(theme):
    """Brettel-like projection (Vienot 1999): the pair stays apart for deuteranopes and protanopes."""
    colours = themes()[theme]
    for matrix in (DEUTERANOPE, PROTANOPE):
        one, other = (seen(colours[name], matrix) for name in ("measured", "model"))
        assert sum((a - b) ** 2 for a, b in zip(one, other, strict=True)) ** 0.5 > 0.3


# Linear RGB to what is seen without the M and without the L cones (Vienot, Brettel & Mollon, 1999).
DEUTERANOPE = ((0.29275, 0.70725, 0.0), (0.29275, 0.70725, 0.0), (-0.02234, 0.02234, 1.0))
PROTANOPE = ((0.11238, 0.88762, 0.0), (0.11238, 0.88762, 0.0), (0.00401, -0.00401, 1.0))


def seen(colour, matrix):
    linear = [(int(colour[i : i + 2], 16) / 255) ** 2.2 for i in (1, 3, 5)]
    return [sum(m * v for m, v in zip(row, linear, strict=True)) for row in matrix]
