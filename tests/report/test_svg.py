"""Drawings written small: the same places, styles and texts as matplotlib's own file, in fewer bytes."""

import base64
import io
import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from ploughval.report.figures import style
from ploughval.report.figures.style import MEASURED, new_figure, styled, to_svg
from ploughval.report.figures.svg import compact, path_data

QUANTUM = 0.005 + 1e-9  # half a hundredth of a user unit (pt)
NUMBER = r"-?(?:\d+\.?\d*|\.\d+)"
SVG = "{http://www.w3.org/2000/svg}"


def absolute(text):
    """Ends of all segments of a path of M, l, h, v, q, c, z: letter and place."""
    x = y = x0 = y0 = 0.0
    points = []
    for letter, rest in re.findall(r"([MlhvqczLQC])([^MlhvqczLQC]*)", text):
        values = [float(value) for value in re.findall(NUMBER, rest)]
        if letter == "z":
            x, y = x0, y0
            points.append(("z", x, y))
        size = {"M": 2, "l": 2, "h": 1, "v": 1, "q": 4, "c": 6, "L": 2, "Q": 4, "C": 6, "z": 1}[letter]
        assert len(values) % size == 0
        for i in range(0, len(values), size):
            part = values[i : i + size]
            if letter == "h":
                x += part[0]
            elif letter == "v":
                y += part[0]
            elif letter.isupper():
                x, y = part[-2:]
            else:
                x, y = x + part[-2], y + part[-1]
            if letter == "M":
                x0, y0 = x, y
            points.append((letter.upper().replace("H", "L").replace("V", "L"), x, y))
    return points


coordinate = st.floats(-2000, 2000, allow_nan=False)


@given(st.lists(st.tuples(coordinate, coordinate), min_size=2, max_size=60))
def test_every_point_of_a_line_stays_within_a_two_hundredth(points):
    source = "M " + " L ".join(f"{x:f} {y:f}" for x, y in points)
    got = np.array([(x, y) for _, x, y in absolute(path_data(source))])
    for x, y in points:
        assert np.hypot(*(np.abs(got - (x, y)) / QUANTUM).T).min() <= np.sqrt(2) + 1e-3


def test_steps_do_not_add_up_to_a_drift_over_ten_thousand_points():
    x = np.arange(10_000) * 0.0437
    y = 100 + np.cumsum(np.random.default_rng(1).normal(0, 0.013, x.size))
    source = "M " + " L ".join(f"{a:f} {b:f}" for a, b in zip(x, y, strict=True))
    last = absolute(path_data(source))[-1]
    assert abs(last[1] - x[-1]) <= QUANTUM
    assert abs(last[2] - y[-1]) <= QUANTUM


def test_curves_closed_parts_and_lines_of_no_length_are_kept():
    source = "M 1 1 \nC 2 3.333 4 5 6 7 \nQ 1 2 3 4.456 \nz\nM 5 5 \nL 5 5 \n"
    got = path_data(source)
    assert got == "M1 1c1 2.33 3 4 5 6q-5-5-3-2.54zM5 5h0"
    assert [letter for letter, *_ in absolute(got)] == ["M", "C", "Q", "z", "M", "L"]


def test_path_data_of_other_letters_are_left_alone():
    assert path_data("M 0 0 A 1 1 0 0 1 2 2") == "M 0 0 A 1 1 0 0 1 2 2"


@styled
def example():
    figure = new_figure(3.0)
    left, right = figure.subplots(1, 2)
    rng = np.random.default_rng(3)
    u = np.linspace(0, 50, 500)
    left.fill_between(u, u - 1, u + 1, color=MEASURED, alpha=0.25, lw=0, label="<b>& 'x' #0072b2 url(#a)")
    left.plot(u, u + rng.normal(0, 0.3, u.size), "--", color=MEASURED)
    left.legend()
    left.set_xlabel("u, mm")
    left.set_ylabel(r"shear $\gamma_{xy}$, 1")
    right.scatter(rng.random(40), rng.random(40), c=rng.random(40))
    right.imshow(rng.random((4, 4)), extent=(0, 1, 0, 1), aspect="auto")
    right.errorbar([0.1, 0.5], [0.2, 0.4], yerr=0.1, fmt="o", mfc="none")
    return figure


@pytest.fixture(scope="module")
def pair():
    """The drawing as matplotlib writes it and as the page has it, as trees."""
    sources = []

    def keep(source, key, restyle):
        sources.append(source)
        return compact(source, key, restyle)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(style, "compact", keep)
        text = to_svg(example(), "f1", 'alt "text" <x>')
    return ET.fromstring(sources[0]), ET.fromstring(text), sources[0], text


def marks(root, rules):
    """What is drawn, in order: kind, style (classes looked up), places and text; groups leave no mark."""
    found = []
    for element in root.iter():
        tag = element.tag.replace(SVG, "")
        if tag not in ("path", "use", "text", "tspan", "image", "rect"):
            continue
        given = element.get("style")
        own = re.sub(r"\s*([:;])\s*", r"\1", given) if given else ""
        worn = style._themed(own) if own else rules.get(element.get("class"), "")
        given = [element.get(name) or "" for name in ("x", "y", "width", "height")]
        places = [float(value) for text in given for value in text.split()]
        d = element.get("d")
        places += [v for _, x, y in (absolute(d) if d else ()) for v in (x, y)]
        found.append((tag, worn, np.array(places), (element.text or "").strip()))
    return found


def test_every_mark_keeps_its_style_its_text_and_its_place_to_a_hundredth_of_a_point(pair):
    plain, small, _, text = pair
    rules = dict(re.findall(r"\.(f1_\w+)\{([^}]*)\}", text))
    before, after = marks(plain, {}), marks(small, rules)
    before = [mark for mark in before if mark[0] != "style"]
    assert [mark[0] for mark in after] == [mark[0] for mark in before]
    for old, new in zip(before, after, strict=True):
        assert new[1] == old[1]
        assert new[3] == old[3]
        if len(old[2]) == len(new[2]):
            assert np.abs(old[2] - new[2]).max(initial=0) <= 0.01
        else:  # points that fell on their neighbour are left out: no new place, the same reach
            assert old[0] == "path"
            a, b = old[2].reshape(-1, 2), new[2].reshape(-1, 2)
            assert np.abs(a.min(0) - b.min(0)).max() <= 0.01
            assert np.abs(a.max(0) - b.max(0)).max() <= 0.01


def test_it_takes_less_than_half_the_bytes(pair):
    *_, source, text = pair
    assert len(text) < len(source) / 2


def test_texts_in_a_figure_are_no_markup_and_no_colours_of_the_theme(pair):
    _, small, _, text = pair
    assert "<b>" not in text
    assert any("<b>& 'x' #0072b2 url(#a)" in (element.text or "") for element in small.iter())
    assert small.get("aria-label") == 'alt "text" <x>'


def test_every_reference_is_met_and_no_name_is_another_figures(pair):
    *_, text = pair
    ids = re.findall(r'\bid="([^"]+)"', text)
    asked = set(re.findall(r'(?:href="#|url\(#)(f1[^)"]+)', text))
    assert asked
    assert asked == set(ids)
    assert len(ids) == len(set(ids))
    other = to_svg(example(), "f11", "")
    names = set(ids) | set(re.findall(r"\.(f1_\w+)\{", text))
    assert not names & {*re.findall(r'\bid="([^"]+)"', other), *re.findall(r"\.(f11_\w+)\{", other)}


def test_the_same_figure_gives_the_same_bytes():
    assert to_svg(example(), "f1", "a") == to_svg(example(), "f1", "a")


@styled
def many_points():
    figure = new_figure(3.0)
    axes = figure.subplots()
    rng = np.random.default_rng(5)
    axes.scatter(*rng.random((2, 3000)), c=rng.random(3000), s=9, lw=0, rasterized=True)
    return figure


def test_points_drawn_as_a_picture_get_a_palette_and_look_the_same():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(style, "_PALETTE_BYTES", 10**9)
        whole = picture(to_svg(many_points(), "f1", ""))
    small = picture(to_svg(many_points(), "f1", ""))
    assert len(small) < len(whole) / 3
    a, b = (composed(data).astype(float) for data in (whole, small))
    assert np.abs(a - b).max() < 64  # of 255, at the rims of single dots
    assert np.abs(a - b).mean() < 3


def picture(text):
    return base64.b64decode(re.search(r"data:image/png;base64,([^\"]+)", text).group(1))


def composed(data):
    top = Image.open(io.BytesIO(data)).convert("RGBA")
    ground = Image.new("RGBA", top.size, "#fdfdfc")
    ground.alpha_composite(top)
    return np.asarray(ground.convert("RGB"))
