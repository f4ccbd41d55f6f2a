"""A site of three pages, built with the real one's extensions: what becomes of links, equations, pictures."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

EXTENSIONS = Path(__file__).parents[3] / "docs" / "extensions"
CONF = f"""
import sys
sys.path.insert(0, {str(EXTENSIONS)!r})
extensions = ["myst_parser", "equations", "own_host", "open_pages"]
myst_enable_extensions = ["dollarmath"]
html_math_renderer = "mathml"
html_theme = "basic"
"""
PAGES = {
    "index.md": "# Start\n\n```{toctree}\ntheory\nwrong\n```\n",
    "theory.md": (
        "# Theory\n\n$$ a = b \\tag{1} $$\n\nBy [Eq. (1)](#eq-1), [a page](made.html), [a table](made.csv).\n"
        "\nA length $u$, and more.\n"
    ),
    "wrong.md": (
        "# Wrong\n\n[there](theory.md#eq-1), [not there](theory.md#eq-2)\n\n"
        "$$ a \\tag{7} $$\n\n$$ b \\tag{7} $$\n\n$$ \\nosuch $$\n\n![x](https://elsewhere.example/x.png)\n"
    ),
    "made.html": "<title>made</title>",
    "made.csv": "a\n1\n",
    "conf.py": CONF,
}


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder of the built site, and what the build complained of."""
    pytest.importorskip("sphinx", reason="needs the extra docs")
    source = tmp_path_factory.mktemp("source")
    for name, text in PAGES.items():
        (source / name).write_text(text, encoding="utf-8")
    out = source / "out"
    command = [sys.executable, "-m", "sphinx", "-q", "--keep-going", str(source), str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return out, done.stderr


def test_an_equation_has_an_anchor_and_its_number_beside_it(site):
    page = (site[0] / "theory.html").read_text(encoding="utf-8")
    assert re.search(r'<div class="equation[^>]*id="eq-1">', page)
    assert '<a class="number" href="#eq-1">(1)</a>' in page


def test_what_ends_a_clause_stays_with_the_formula_before_it(site):
    page = (site[0] / "theory.html").read_text(encoding="utf-8")
    assert re.search(r'A length <span class="whole"><math.*<mi>u</mi>.*</math>,</span> and more\.', page)


def test_a_link_to_an_equation_of_this_page_or_of_another_leads_to_it(site):
    assert 'href="#eq-1">Eq. (1)</a>' in (site[0] / "theory.html").read_text(encoding="utf-8")
    assert 'href="theory.html#eq-1"' in (site[0] / "wrong.html").read_text(encoding="utf-8")


def test_a_link_to_a_page_that_was_made_opens_it_and_one_to_a_table_saves_it(site):
    links = re.findall(
        r'<a [^>]*href="_downloads/[^>]*>', (site[0] / "theory.html").read_text(encoding="utf-8")
    )
    opened, saved = sorted(links, key=lambda link: "made.csv" in link)
    assert "made.html" in opened
    assert "download" not in opened.replace("_downloads", "")
    assert 'download=""' in saved
    assert all((site[0] / re.search(r'href="([^"]*)"', link)[1]).is_file() for link in links)


@pytest.mark.parametrize(
    "fault",
    [
        "local id not found in doc 'theory': 'eq-2'",
        "equation (7) is on this page twice",
        r"this TeX cannot be shown: \nosuch is not known",
        "wrong.html has a browser fetch https://elsewhere.example",
    ],
)
def test_what_does_not_hold_is_a_warning(site, fault):
    assert fault in site[1]


def test_nothing_is_said_of_what_holds(site):
    assert "theory.md" not in site[1].replace("theory.md#", "")
