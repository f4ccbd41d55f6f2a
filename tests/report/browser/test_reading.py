"""The page on every screen: widths, dark, print, without scripts, from the keyboard, read aloud."""

import itertools
import re

import pytest

pytestmark = pytest.mark.browser
PAGES = ("one", "several", "bare", "blind")
LEAST_CONTRAST, LEAST_CONTRAST_LARGE = 4.5, 3.0  # WCAG 2.2, 1.4.3, level AA
LARGE_PX, LARGE_BOLD_PX = 24.0, 18.66  # 18 pt, 14 pt bold: the same place


def least_contrast(text):
    large = text["size"] >= LARGE_PX or (text["size"] >= LARGE_BOLD_PX and text["weight"] >= 700)
    return LEAST_CONTRAST_LARGE if large else LEAST_CONTRAST


@pytest.mark.parametrize("name", PAGES)
def test_the_page_does_not_scroll_sideways(visit, pages, name):
    page = visit(getattr(pages, name), width=1200)
    for width in (1200, 800, 390):
        page.set_viewport_size({"width": width, "height": 900})
        wide = page.evaluate("document.scrollingElement.scrollWidth")
        assert wide <= width, page.evaluate("checks.beyondTheEdge()")[:5]


@pytest.mark.parametrize("name", ["one", "several"])
def test_every_text_stands_out_from_its_ground_in_light_and_dark(visit, pages, name):
    page = visit(getattr(pages, name))
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        found = page.evaluate("checks.contrasts()")
        assert len(found) > 5
        assert [text for text in found if text["contrast"] < least_contrast(text)] == [], scheme


@pytest.mark.parametrize("name", ["one", "several"])
def test_tab_reaches_every_control_in_the_order_of_the_page_and_shows_where_it_is(visit, pages, name):
    page = visit(getattr(pages, name))
    seats = page.evaluate("checks.seats()")
    assert seats > 10
    met = []
    for _ in range(seats):
        page.keyboard.press("Tab")
        met.append(page.evaluate("checks.focused()"))
    assert [one["seat"] for one in met] == list(range(1, seats + 1))
    assert [one["html"] for one in met if not one["seen"]] == []


@pytest.mark.parametrize("name", PAGES)
def test_headings_are_in_order_ids_are_single_and_everything_has_a_name(visit, pages, name):
    page = visit(getattr(pages, name))
    levels = page.evaluate("[...document.querySelectorAll('h1,h2,h3,h4,h5,h6')].map((h) => +h.tagName[1])")
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after <= before + 1 for before, after in itertools.pairwise(levels))
    assert page.evaluate("checks.doubledIds()") == []
    assert page.evaluate("checks.namelessPictures()") == []
    assert page.evaluate("checks.namelessControls()") == []


def test_without_scripts_figures_are_there_and_no_control_that_would_need_them(visit, pages):
    page = visit(pages.one, javascript=False)
    assert not page.evaluate("document.documentElement.classList.contains('scripted')")
    assert page.locator("main :is(button, input, select):visible").count() == 0
    assert page.locator("main figure > svg:visible").count() > 5


def test_print_hides_controls_and_fills_pages_of_paper(visit, pages):
    page = visit(pages.one, scheme="dark")
    pdf = page.pdf(format="A4")
    assert len(re.findall(rb"/Type\s*/Page\b", pdf)) > 4
    page.emulate_media(media="print")
    assert page.evaluate("checks.visible('button, input, select, nav')") == []
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
