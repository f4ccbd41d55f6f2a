"""Equations, sections and sources that the code cites stand on the pages that it names."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
MODULES = sorted((ROOT / "src").rglob("*.py"))
EQUATIONS = r"Eqs?\.? (\(\d+\)(?:(?:, | and | to )\(\d+\))*)"
CITED = re.compile(r"docs/([a-z-]+)\.md, " + EQUATIONS)
SECTION = re.compile(r"docs/([a-z-]+)\.md, section (\d+)")
OF_THE_PAPER = re.compile(EQUATIONS + " of the paper")
OF_LITERATURE = re.compile(r"(?:19|20)\d\d, eqs?\.? [\d-]+(?: and [\d-]+)?")
ON_PAGES = re.compile(EQUATIONS + r"(?: of \[([a-z-]+)\.md\]\(\2\.md\))?(?! of the paper)")
NAME = r"(?:[Vv]an )?[A-Z][A-Za-zéö]+"
SOURCE = re.compile(
    rf"\b({NAME})(?:,? et al\.|(?:, {NAME})*,? (?:and|&) {NAME})?(?:'s)?,? \(?((?:17|18|19|20)\d\d)\b"
)
NO_SOURCE = ("JPEG", "2000")

# Equations that only lead to others or bound them: no code computes these
DERIVED = {
    "theory-calibration": {7},
    "theory-model": {1, 2},
    "theory-model-nodes": {3, 4},
    "theory-model-avalanche": {3, 4, 5, 6, 8},
    "theory-model-outcrop": set(range(1, 13)),
    "theory-model-march": {2, 3},
    "theory-model-two-blocks": {1},
}

# What the paper leaves out or misprints: the page, its section, and the module that does it
LEFT_OUT = [
    ("model/mechanism.py", "docs/theory-model.md, Eqs (3) and (4)"),
    ("model/surface.py", "docs/theory-model-nodes.md, section 1"),
    ("model/surface.py", "docs/theory-model-avalanche.md, section 3"),
    ("model/march.py", "docs/theory-model-outcrop.md, section 1"),
]


def plain(text):
    """Text with line breaks, and the signs of comments, taken out."""
    return re.sub(r"\s*\n\s*(?:# ?)?", " ", text)


def code(path):
    return plain(path.read_text(encoding="utf-8"))


def page(name):
    return (DOCS / f"{name}.md").read_text(encoding="utf-8")


def numbers_in(group):
    """Numbers of ``(2), (4) to (6)``."""
    found = []
    for joint, number in re.findall(r"(, | and | to |)\((\d+)\)", group):
        found.extend(range(found[-1] + 1 if joint == " to " else int(number), int(number) + 1))
    return found


def numbered(name):
    """Numbers of the equations of a page, in their order."""
    return re.findall(r"\\tag\{([^{}]+)\}", page(name))


def parts(name):
    """A page before its list of references, and that list, one source an entry."""
    body, _, listed = page(name).partition("\n## References\n")
    return body, re.findall(r"^- (.+)$", listed, re.MULTILINE)


def stands_in(entries, author, year):
    return any(author in entry and year in entry for entry in entries)


PAGES = sorted(path.stem for path in DOCS.glob("*.md"))
NUMBERED = [name for name in PAGES if numbered(name)]
THEORY = [name for name in PAGES if name.startswith("theory-")]


def cited():
    """Pages and numbers of equations that the code cites, with the module."""
    for path in MODULES:
        for name, group in CITED.findall(code(path)):
            yield path.relative_to(ROOT), name, numbers_in(group)


@pytest.mark.parametrize("name", NUMBERED)
def test_equations_of_a_page_are_numbered_from_one_in_their_order(name):
    assert numbered(name) == [str(k + 1) for k in range(len(numbered(name)))]


def test_theory_pages_write_their_equations_in_tex_with_numbers():
    assert set(THEORY) <= set(NUMBERED)
    for name in THEORY:
        assert not re.findall(r"^ {4}\(\d+\) .*=.*$", page(name), re.MULTILINE), name


def test_every_equation_that_the_code_cites_is_on_its_page():
    wrong = [
        f"{module}: {name}, ({number})"
        for module, name, numbers in cited()
        for number in numbers
        if name not in PAGES or str(number) not in numbered(name)
    ]
    assert wrong == []


def test_code_cites_equations_in_one_form_that_tells_pages_from_paper_and_literature():
    odd = []
    for path in MODULES:
        text = code(path)
        for form in (CITED, OF_THE_PAPER, OF_LITERATURE):
            text = form.sub("", text)
        odd += [f"{path.relative_to(ROOT)}: {x}" for x in re.findall(r".{0,30}\b[Ee]qs?\b[. ].{0,20}", text)]
    assert odd == []


def test_every_equation_is_cited_by_the_code_that_computes_it():
    known = {name: set() for name in NUMBERED}
    for _, name, numbers in cited():
        known[name].update(numbers)
    left = {name: {int(n) for n in numbered(name)} - known[name] for name in NUMBERED}
    assert {name: numbers for name, numbers in left.items() if numbers} == DERIVED


def test_pages_and_sections_that_the_code_names_are_there():
    wrong = []
    for path in MODULES:
        text, module = code(path), path.relative_to(ROOT)
        wrong += [f"{module}: {x}" for x in re.findall(r"(?<!docs/)\btheory-[a-z-]+", text)]
        wrong += [f"{module}: {x}" for x in re.findall(r"docs/([a-z-]+)\.md", text) if x not in PAGES]
        for name, number in SECTION.findall(text):
            if not re.search(rf"^## {number}\. ", page(name), re.MULTILINE):
                wrong.append(f"{module}: {name}, section {number}")
    assert wrong == []


@pytest.mark.parametrize(("module", "citation"), LEFT_OUT)
def test_what_the_paper_leaves_out_is_cited_by_the_module_that_does_it(module, citation):
    assert citation in code(ROOT / "src" / "ploughval" / module)


@pytest.mark.parametrize("name", NUMBERED)
def test_equations_that_pages_refer_to_are_there(name):
    text = re.sub(
        r"Eqs? \(\d+\)(?: and \(\d+\))? (?:of|, ).{0,3}the paper|[Pp]aper's Eqs? \(\d+\).{0,10}",
        "",
        page(name),
    )
    for group, other in ON_PAGES.findall(plain(text)):
        assert {str(n) for n in numbers_in(group)} <= set(numbered(other or name)), (group, other)


@pytest.mark.parametrize("name", sorted({*NUMBERED, *THEORY}))
def test_sources_named_on_a_page_stand_in_its_list(name):
    body, listed = parts(name)
    assert [s for s in set(SOURCE.findall(plain(body))) if not stands_in(listed, *s)] == []


def test_sources_named_in_code_stand_in_the_list_of_a_page_that_it_cites():
    everywhere = [entry for name in PAGES for entry in parts(name)[1]]
    everywhere += re.findall(
        r"^- (.+)$", page("notation").partition("\n## 4. Other sources\n")[2], re.MULTILINE
    )
    missing = []
    for path in MODULES:
        text = code(path)
        own = [entry for name in set(re.findall(r"docs/([a-z-]+)\.md", text)) for entry in parts(name)[1]]
        for source in set(SOURCE.findall(text)) - {NO_SOURCE}:
            if not stands_in(own or everywhere, *source):
                missing.append(f"{path.relative_to(ROOT)}: {' '.join(source)}")
    assert missing == []
