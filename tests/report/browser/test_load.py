"""The page in a browser: it loads in silence and alone, and user's texts stay texts."""

import pytest

pytestmark = pytest.mark.browser
PAGES = ("one", "several", "bare", "blind")


@pytest.mark.parametrize("name", PAGES)
def test_the_page_loads_without_a_message_a_request_or_a_violation(visit, pages, name):
    page = visit(getattr(pages, name))
    assert page.evaluate("document.documentElement.classList.contains('scripted')")
    assert page.locator("main section").count() > 0


def test_the_watch_would_see_a_message_a_request_and_a_violation(chromium, visit, pages, tmp_path):
    """The fixture itself: a page that does all of it is told apart from one that does none."""
    bad = tmp_path / "bad.html"
    bad.write_text(
        pages.bare.read_text(encoding="utf-8").replace(
            "</body>", '<img src="https://example.invalid/x.png"><script>1</script></body>'
        )
    )
    context = chromium.new_context(offline=True)
    page = context.new_page()
    seen = []
    page.on("console", lambda message: seen.append(message.text))
    page.goto(bad.as_uri())
    context.close()
    assert len(seen) == 2
    assert all("Content Security Policy" in text for text in seen)


def test_a_hostile_name_is_the_heading_and_the_title_letter_by_letter(visit, pages, hostile):
    page = visit(pages.one)
    assert page.locator("h1").text_content() == hostile
    assert page.title().startswith(" ".join(hostile.split()))


@pytest.mark.parametrize("name", ["one", "several"])
def test_no_text_of_a_user_becomes_an_element(visit, pages, hostile, name):
    page = visit(getattr(pages, name))
    assert hostile in page.locator("body").text_content()
    assert page.locator("img[src='x'], [onerror], [onload], [onclick]").count() == 0
    assert page.evaluate("window.__hit") is None


def test_a_hostile_file_name_stands_in_the_ledger_as_it_is(visit, pages, hostile):
    text = visit(pages.one).locator("#quality").text_content()
    assert """005<img src=x onerror=window.__hit=3>&"'=.png""" in text
    assert hostile in text
