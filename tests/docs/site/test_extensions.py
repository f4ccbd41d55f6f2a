"""What the site's own extensions promise; `make docs` builds the whole, and each warning fails it."""

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

EXTENSIONS = Path(__file__).parents[3] / "docs" / "extensions"


@pytest.fixture
def extension(monkeypatch: pytest.MonkeyPatch) -> Iterator[object]:
    """An extension of the site by its name."""
    pytest.importorskip("sphinx", reason="needs the extra docs")
    monkeypatch.syspath_prepend(str(EXTENSIONS))
    names: list[str] = []

    def load(name: str) -> ModuleType:
        names.append(name)
        return importlib.import_module(name)

    yield load
    for name in names:
        sys.modules.pop(name, None)


@pytest.mark.parametrize(
    "markup",
    [
        '<script src="https://elsewhere.example/x.js"></script>',
        '<link rel="stylesheet" href="//elsewhere.example/x.css">',
        '<img srcset="https://elsewhere.example/x.png 2x" src="x.png">',
        '<p style="background: url(https://elsewhere.example/x.png)">',
        "<style>@import 'https://elsewhere.example/x.css';</style>",
    ],
)
def test_what_a_page_fetches_from_another_host_is_found(extension, markup):
    found = extension("own_host").fetched_elsewhere(f"<body>{markup}</body>")
    assert len(found) == 1
    assert "//elsewhere.example" in found[0]


def test_links_to_follow_and_files_of_the_site_are_not_fetched_from_another_host(extension):
    page = '<a href="https://elsewhere.example">x</a><img src="x.png"><script>let a = "//x";</script>'
    assert extension("own_host").fetched_elsewhere(page) == []


def test_a_font_of_another_host_in_a_style_sheet_is_found(extension):
    sheet = "@font-face { src: url('https://elsewhere.example/a.woff2') }  p { background: url(a.png) }"
    found = extension("own_host").fetched_elsewhere(sheet, style_sheet=True)
    assert found == ["https://elsewhere.example/a.woff2"]


def test_a_citation_of_an_equation_links_to_its_anchor(extension):
    line = "Passive force (docs/theory-model.md, Eq. (4)), see docs/theory-fit.md."
    assert extension("citations").linked(line) == (
        "Passive force (`docs/theory-model.md, Eq. (4) <../theory-model.html#eq-4>`__), "
        "see `docs/theory-fit.md <../theory-fit.html>`__."
    )


def test_tex_becomes_mathml_without_its_tag(extension):
    markup = extension("tex").mathml(r"P_0 = \frac{\gamma d^2}{2} \tag{4}", block=True)
    assert markup.startswith("<math")
    assert 'display="block"' in markup
    assert "<mfrac>" in markup
    assert "tag" not in markup
    assert ">4<" not in markup


def test_names_of_functions_stand_apart_from_what_they_are_applied_to(extension):
    markup = extension("tex").mathml(r"P \cos\varphi + \sin(x) \tan y", block=False)
    assert 'lspace="0.17em" rspace="0.17em">cos</mo>' in markup
    assert 'lspace="0" rspace="0">sin</mo>' in markup
    assert 'lspace="0.17em" rspace="0.17em">tan</mo>' in markup


def test_words_are_one_piece_and_bars_stand_close(extension):
    markup = extension("tex").mathml(r"|u_{\mathrm{rms}}|", block=False)
    assert "<mi>rms</mi>" in markup
    assert markup.count('<mo lspace="0" rspace="0" stretchy="false">&#x0007C;</mo>') == 2


def test_primes_are_as_large_as_their_letter(extension):
    markup = extension("tex").mathml(r"\frac{h'(x)}{2}", block=False)
    assert '<mrow><mi>h</mi><mo lspace="0" rspace="0">&#x02032;</mo></mrow>' in markup
    assert "<msup>" not in markup


def test_signs_between_letters_are_operators(extension):
    markup = extension("tex").mathml(r"a \sim b \pm c", block=False)
    assert "<mo>&#x0223C;</mo>" in markup
    assert "<mo>&#x000B1;</mo>" in markup


def test_brackets_of_a_stated_size_grow_as_a_pair(extension):
    mathml = extension("tex").mathml
    sized = mathml(r"\Bigl( \frac{a}{b} \Bigr)^2", block=True)
    assert sized == mathml(r"\left( \frac{a}{b} \right)^2", block=True)


@pytest.mark.parametrize("tex", [r"\nosuchthing x", r"\frac{1}{2", r"\left( x"])
def test_tex_that_cannot_be_shown_is_refused(extension, tex):
    with pytest.raises(ValueError, match=r"nosuchthing is not known|not as many"):
        extension("tex").mathml(tex, block=False)
