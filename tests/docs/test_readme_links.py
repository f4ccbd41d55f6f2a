"""README.md is no page of the site, whose build checks the links of all others: its own are checked here."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_every_link_of_the_readme_leads_to_a_file():
    places = re.findall(r"\]\(((?!\w+:)[^)#]+)", README)
    assert len(places) > 20
    assert [place for place in places if not (ROOT / place).exists()] == []


def test_the_readme_leads_to_the_first_page_of_the_site_and_to_the_tutorial():
    assert "](docs/index.md)" in README
    assert "](docs/tutorial.md)" in README
