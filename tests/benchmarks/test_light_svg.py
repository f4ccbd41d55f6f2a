"""Figures made light draw the same: every point within a tenth of a unit, pictures alike."""

import base64
import io

import numpy as np
import pytest
from PIL import Image

from drawing.svg import GREYS, TENTH, light, light_path, thinned
from light_svg import main
from ploughval.report.figures.svg import path_data

BLUE = (0, 114, 178)


def drawn(u):
    """A smooth line, as absolute points."""
    return np.column_stack([40 + 300 * u, 60 + 40 * np.sin(9 * u)])


def absolute(text):
    return "".join(f"{'L' if k else 'M'} {x:.4f} {y:.4f} " for k, (x, y) in enumerate(text))


def points_of(text):
    """Points of light path data of one line."""
    from drawing.svg import _lines

    (line, _closed), *others = list(_lines(text))
    assert not others
    return line


def test_a_line_of_many_points_is_drawn_by_few_within_a_tenth():
    line = drawn(np.linspace(0, 1, 900))
    text = light_path(path_data(absolute(line)))
    few = points_of(text)
    assert len(few) < 90
    off = np.abs(np.interp(line[:, 0], few[:, 0], few[:, 1]) - line[:, 1])
    assert off.max() < 1.5 * TENTH  # rounding to a tenth, and half a tenth of thinning, on a slope of 1
    assert len(text) < 0.15 * len(path_data(absolute(line)))


def test_corners_ends_and_closings_stay():
    assert light_path("M10 20h30v-7.5l-3 4z") == "M10 20h30v-7.5l-3 4z"
    assert light_path("M1 2h3M5 6v7z") == "M1 2h3M5 6v7z"
    assert thinned(np.array([[0, 0], [5, 0.04], [9, 0], [9, 3]])).tolist() == [True, False, True, True]


def test_curves_stay_as_they_are():
    assert light_path("M1.23 4.56q1 1 2 2") == "M1.23 4.56q1 1 2 2"


def picture(alpha):
    grey = np.random.default_rng(1).normal(120, 40, (60, 80, 1)).clip(0, 255)
    samples = np.concatenate([grey, grey, grey, np.full_like(grey, alpha)], axis=2).astype(np.uint8)
    samples[20:23, 30:33, :3] = BLUE
    buffer = io.BytesIO()
    Image.fromarray(samples).save(buffer, "PNG")
    return f'<image href="data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}"/>'


def test_a_picture_has_few_greys_and_keeps_its_colours():
    page = light(picture(255))
    assert len(page) < 0.5 * len(picture(255))
    with Image.open(io.BytesIO(base64.b64decode(page.split(",")[1].split('"')[0]))) as image:
        samples = np.asarray(image.convert("RGB"))
    assert samples.shape == (60, 80, 3)
    assert (samples[20:23, 30:33] == BLUE).all()
    assert len(np.unique(samples.reshape(-1, 3), axis=0)) == GREYS + 1
    assert float(samples.mean()) == pytest.approx(120, abs=3)


def test_a_picture_that_is_seen_through_stays():
    assert light(picture(90)) == picture(90)


def test_pages_are_lightened_in_place(tmp_path, capsys):
    (tmp_path / "a.html").write_text('<path d="M1 2h.01l.01 .01h3"/><p d>')
    main([str(tmp_path / "a.html")])
    assert (tmp_path / "a.html").read_text() == '<path d="M1 2h3"/><p d>'
    assert "characters" in capsys.readouterr().out
