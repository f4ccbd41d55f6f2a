"""The player in a browser: what moves it, that it moves together, and that its lines are the results'."""

import re

import numpy as np
import pandas as pd
import pytest

pytestmark = pytest.mark.browser
LAST, LOST, UNREADABLE = 12, 5, 7  # frames of the folder on the page, of 0 to 60 mm in steps of 5
STEP_MM = 5.0
LINE_MM = 0.15  # 0.1 mm, and half a hundredth of a pixel and of the stored place
LAYERS = ("photograph", "tracks", "layers-measured", "layers-predicted", "bands", "surface", "blade")
KEYS = (
    ("Home", 0),
    ("ArrowRight", 1),
    ("Shift+ArrowRight", 11),
    ("ArrowLeft", 10),
    ("End", LAST),
    ("Shift+ArrowLeft", 2),
    ("ArrowRight", 3),
)


@pytest.fixture
def page(one_page):
    one_page.set_viewport_size({"width": 1200, "height": 900})
    return one_page


def part(page, name):
    return page.locator(f"#player [data-player='{name}']")


def frame(page):
    return int(part(page, "stage").get_attribute("data-frame"))


def go(page, number):
    part(page, "slider").fill(str(number))
    assert frame(page) == number


def ticked(texts):
    """Pixels to values along an axis, from its labels: a line through all of them."""
    place, value = np.array(texts).T
    slope, start = np.polyfit(place, value, 1)
    assert np.abs(np.polyval((slope, start), place) - value).max() < 0.02 * abs(
        slope
    )  # labels agree: 0.02 px
    return lambda px: start + slope * np.asarray(px)


def axes_of_the_lowest_panel(page):
    """Functions from pixels of the stage to mm, read off the labels of the axes."""
    texts = part(page, "stage").evaluate("(svg) => checks.texts(svg)")
    numbers = [t for t in texts if t["value"] is not None]
    below = [(t["x"], t["value"]) for t in numbers if t["anchor"] == "middle"]
    beside = [(t["y"] - 4.0, t["value"]) for t in numbers if t["anchor"] == "end"]  # 4 px: half a letter
    again = next(k for k in range(1, len(beside)) if beside[k][1] <= beside[k - 1][1])  # the next panel's
    return ticked(below), ticked(beside[again:])


def drawn_mm(page, layer):
    """Lines of a layer in the measured panel, mm."""
    to_x, to_y = axes_of_the_lowest_panel(page)
    last = f"g[clip-path] >> nth=-1 >> [data-layer='{layer}']"
    paths = part(page, "stage").locator(last).evaluate("(group) => checks.paths(group, 'path:not(.halo)')")
    return [np.column_stack([to_x(np.array(p)[:, 0]), to_y(np.array(p)[:, 1])]) for p in paths]


def distance_mm(points, lines):
    """Distance of each point to the nearest of some lines."""
    best = np.full(len(points), np.inf)
    for line in lines:
        start, along = line[:-1], np.diff(line, axis=0)
        length = np.maximum((along**2).sum(axis=1), 1e-12)
        share = np.clip(((points[:, None] - start) * along).sum(axis=2) / length, 0, 1)
        best = np.minimum(
            best, np.linalg.norm(points[:, None] - start - share[..., None] * along, axis=2).min(axis=1)
        )
    return best


def layer_lines(table, number):
    of = table[table["frame"] == number]
    return [rows[["x_mm", "y_mm"]].to_numpy() for _, rows in of.groupby("layer")]


@pytest.mark.parametrize("number", [3, 8, LAST])
def test_measured_layers_are_drawn_where_the_results_have_them(page, pages, number):
    go(page, number)
    drawn = drawn_mm(page, "layers-measured")
    lines = layer_lines(pd.read_csv(pages.results / "layers.csv"), number)
    assert distance_mm(np.concatenate(drawn), lines).max() < LINE_MM
    shown = np.concatenate(drawn)
    known = np.concatenate(lines)
    known = known[known[:, 0] <= shown[:, 0].max()]  # the picture ends before the sand
    assert len(known) > 100
    assert distance_mm(known, drawn).max() < LINE_MM


def test_the_surface_and_the_band_are_those_of_the_results(page, pages):
    go(page, 4)
    table = pd.read_csv(pages.results / "surface.csv")
    surface = table[table["frame"] == 4][["x_mm", "y_mm"]].to_numpy()
    assert distance_mm(np.concatenate(drawn_mm(page, "surface")), [surface]).max() < LINE_MM
    tips = [line[0] for line in drawn_mm(page, "bands")]
    assert len(tips) >= 2  # measured and predicted
    assert np.allclose(tips, [4 * STEP_MM, 0.0], atol=LINE_MM)


def test_the_slider_moves_the_stage_the_cursor_and_the_values_together(page):
    seen = []
    for number in (0, 4, LAST):
        go(page, number)
        chart = part(page, "force")
        cursor = part(page, "cursor")
        to_u = ticked(
            [
                (t["x"], t["value"])
                for t in chart.evaluate("(svg) => checks.texts(svg, 'text.second')")
                if t["anchor"] == "middle" and t["value"] is not None
            ]
        )
        assert to_u(float(cursor.get_attribute("x1"))) == pytest.approx(number * STEP_MM, abs=0.1)
        assert f"frame {number} of {LAST}, u {number * STEP_MM:.1f} mm" in part(page, "slider").get_attribute(
            "aria-valuetext"
        )
        assert f"Frame {number}" in part(page, "readout").inner_text()
        picture = part(page, "stage").locator("image").get_attribute("href")
        lines = part(page, "stage").evaluate(
            "(svg) => checks.paths(svg, '[data-layer=layers-measured] path')"
        )
        blade = part(page, "stage").locator("[data-layer=blade] rect").last.get_attribute("x")
        seen.append((picture, str(lines), blade))
    for things in zip(*seen, strict=True):
        assert len(set(things)) == 3


def test_the_readout_tells_force_and_band_of_the_results(page, pages):
    """At u = 20 mm the made force is 18 N with 0.05 N of noise; its std is 0.3 N."""
    go(page, 4)
    text = part(page, "readout").inner_text().replace("\u2212", "-")
    measured = re.search(r"([\d.]+) ± ([\d.]+)", text)
    assert float(measured[1]) == pytest.approx(18.0, abs=0.2)
    assert float(measured[2]) == pytest.approx(0.3, abs=0.005)


def test_keys_of_the_slider_step_jump_and_reach_both_ends(page):
    part(page, "slider").focus()
    for keys, number in KEYS:
        page.keyboard.press(keys)
        assert frame(page) == number, keys


def test_keys_in_other_controls_do_not_move_the_frame(page):
    go(page, 4)
    for name in ("toggle-bands", "speed", "save-svg", "toggle-blade"):
        part(page, name).focus()
        for key in ("Home", "ArrowRight", "ArrowLeft", "End"):
            page.keyboard.press(key)
        assert frame(page) == 4, name
    page.locator("h1").click()
    page.keyboard.press("End")
    assert frame(page) == 4


def test_play_goes_to_the_end_and_stops_there(page):
    go(page, 8)
    part(page, "speed").select_option("20")
    part(page, "play").click()
    page.wait_for_selector(f"[data-player=stage][data-frame='{LAST}']")
    page.wait_for_selector("[data-player=play][aria-label=Play]")
    assert part(page, "slider").input_value() == str(LAST)


def test_play_stops_when_asked_by_the_button_and_by_space(page):
    go(page, 0)
    part(page, "speed").select_option("2")
    for stop in (lambda: part(page, "play").click(), lambda: page.keyboard.press("Space")):
        part(page, "slider").focus()
        page.keyboard.press("Space")
        assert part(page, "play").get_attribute("aria-label") == "Pause"
        stop()
        assert part(page, "play").get_attribute("aria-label") == "Play"
        stopped = frame(page)
        assert stopped < LAST
        page.wait_for_timeout(1200)  # two frames and more, had it gone on
        assert frame(page) == stopped


def test_a_click_on_the_force_goes_to_the_travel_under_it(page):
    chart = part(page, "force")
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    go(page, 8)
    at = float(part(page, "cursor").get_attribute("x1")) / float(chart.get_attribute("viewBox").split()[2])
    go(page, 0)
    page.mouse.click(box["x"] + at * box["width"], box["y"] + box["height"] / 2)
    assert frame(page) == 8


def test_a_tap_on_a_phone_goes_to_the_travel_under_it(visit, pages):
    page = visit(pages.one, width=390, height=844, has_touch=True, is_mobile=True)
    go(page, 8)
    at = float(part(page, "cursor").get_attribute("x1"))
    go(page, 0)
    chart = part(page, "force")
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    scale = box["width"] / float(chart.get_attribute("viewBox").split()[2])
    page.touchscreen.tap(box["x"] + at * scale, box["y"] + box["height"] / 2)
    assert frame(page) == 8
    assert page.evaluate("document.scrollingElement.scrollWidth") <= 390


def test_a_drag_across_the_picture_winds(page):
    stage = part(page, "stage")
    stage.scroll_into_view_if_needed()
    go(page, 4)
    box = stage.bounding_box()
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + 200, middle)
    page.mouse.down()
    page.mouse.move(box["x"] + 200 + 4.2 * box["width"] / 13, middle, steps=4)
    page.mouse.up()
    assert frame(page) == 8


def test_every_switch_hides_its_layer_and_shows_it_again(page):
    go(page, 6)
    for name in LAYERS:
        group = part(page, "stage").locator(f"[data-layer='{name}']")
        assert group.count() >= 1, name
        part(page, f"toggle-{name}").uncheck()
        assert group.count() == 0, name
        part(page, f"toggle-{name}").check()
        assert group.count() >= 1, name


def test_points_show_motion_and_shear_with_what_their_colours_stand_for(page):
    go(page, 6)
    for choice in ("motion", "shear"):
        part(page, "dots").select_option(choice)
        assert part(page, "scale").is_visible()
        assert part(page, "stage").locator("[data-layer=tracks] path").count() >= 1
    part(page, "dots").select_option("tails")
    assert not part(page, "scale").is_visible()


def test_a_lost_frame_says_why_and_an_unreadable_photograph_leaves_its_lines(page, hostile):
    go(page, LOST)
    assert hostile in part(page, "why").text_content()
    assert hostile in part(page, "slider").get_attribute("aria-valuetext")
    go(page, UNREADABLE)
    assert part(page, "stage").locator("image").count() == 0
    assert "no photograph" in part(page, "stage").text_content()
    assert "is not a picture" in part(page, "why").text_content()
    assert "lost" not in part(page, "why").text_content()
    assert part(page, "stage").locator("[data-layer=layers-measured]").count() == 1


def test_every_photograph_of_the_player_decodes(page):
    for number in (0, 3, LAST):
        go(page, number)
        size = part(page, "stage").evaluate(
            """async (svg) => {
              const picture = new Image();
              picture.src = svg.querySelector("image").getAttribute("href");
              await picture.decode();
              return [picture.naturalWidth, picture.naturalHeight];
            }"""
        )
        assert min(size) > 50


def test_the_player_keeps_its_place_when_the_window_narrows(page):
    go(page, 4)
    page.set_viewport_size({"width": 390, "height": 800})
    for _ in range(100):
        if part(page, "stage").evaluate("(svg) => svg.viewBox.baseVal.width") <= 390:
            break
        page.wait_for_timeout(20)
    assert frame(page) == 4
    assert len(drawn_mm(page, "layers-measured")) >= 3


def test_motion_is_slow_where_the_reader_asked_for_less_of_it(visit, pages):
    page = visit(pages.one, reduced_motion="reduce")
    assert part(page, "speed").input_value() == "2"


def test_without_scripts_the_last_frame_stands_still_and_no_control_is_shown(visit, pages):
    page = visit(pages.one, javascript=False)
    assert part(page, "stage").is_visible()
    assert part(page, "stage").locator("[data-layer]").count() >= 3
    assert not part(page, "slider").is_visible()
    assert not part(page, "play").is_visible()


@pytest.mark.parametrize("name", ["bare", "blind"])
def test_a_test_that_lacks_parts_still_plays(visit, pages, name):
    page = visit(getattr(pages, name))
    part(page, "slider").focus()
    page.keyboard.press("End")
    last = frame(page)
    page.keyboard.press("Home")
    assert frame(page) < last
    assert part(page, "stage").locator("image").count() == 0
