"""What the pages show is what happens: commands, Python, settings."""

import csv
import re
import shutil
import tomllib
from collections import Counter
from pathlib import Path

import pytest

from ploughval.scene import Scene
from ploughval.scene_faults import known_keys, table_of

ROOT = Path(__file__).resolve().parents[2]
KINDS = {"console", "python", "toml", "text", "json", "bibtex", "matlab"}


def test_the_tutorial_does_what_it_shows(followed):
    assert not followed.failures, "\n\n".join(followed.failures)


def test_a_page_does_what_it_shows(page, pages, followed, follower, tmp_path):
    shutil.copytree(followed.folder, tmp_path / "lab")
    shutil.copytree(ROOT / "data" / "example", tmp_path / "lab" / "my-test")
    someone = follower(tmp_path / "lab")
    someone.follow(pages[page])
    assert not someone.failures, "\n\n".join(someone.failures)


def test_what_is_not_run_is_said_where_it_stands(pages):
    excused = Counter(
        block.page for blocks in pages.values() for block in blocks if block.excuse and block.kind in KINDS
    )
    assert excused == NOT_RUN


def test_blocks_are_of_kinds_that_are_looked_at(pages):
    odd = [
        f"{block.place}: {block.kind!r}"
        for blocks in pages.values()
        for block in blocks
        if block.kind not in KINDS and not block.kind.startswith("{")
    ]
    assert odd == []


def test_settings_on_pages_can_be_read_and_their_keys_exist(pages):
    wrong = []
    for block in (b for blocks in pages.values() for b in blocks if b.kind == "toml"):
        try:
            wrong += [f"{block.place}: {key}" for key in unknown_keys(Scene, tomllib.loads(block.text))]
        except tomllib.TOMLDecodeError as error:
            wrong.append(f"{block.place}: {error}")
    assert wrong == []


def unknown_keys(table, values, path=""):
    """Keys that a table of test.toml does not know."""
    for key, value in values.items():
        if key not in known_keys(table):
            yield f"{path}{key}"
            continue
        inner = table_of(table.model_fields[key].annotation)
        for part in value if isinstance(value, list) else [value]:
            if inner is not None and isinstance(part, dict):
                yield from unknown_keys(inner, part, f"{path}{key}.")


def test_the_table_of_subsets_is_that_of_the_report():
    with (ROOT / "reports" / "speed-error" / "piv-settings.csv").open() as file:
        rows = list(csv.DictReader(file))

    def measured(case, subset, column):
        found = [
            r[column]
            for r in rows
            if (r["case"], r["subset"], r["shape"]) == (case, subset, "adaptive")
            and (r["order"], r["spline"], r["step_px"], r["workers"]) == ("1", "5", "16", "1")
        ]
        return float(found[0])

    page = (ROOT / "docs" / "howto-subset-and-step.md").read_text(encoding="utf-8")
    shown = re.findall(r"^\| (\d\d) px \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|", page, re.MULTILINE)
    assert [row[0] for row in shown] == ["21", "31", "41"]
    for subset, smooth, band, period in shown:
        assert float(smooth) == pytest.approx(measured("shift 0.25 noise 3", subset, "rmse_px"), abs=6e-4)
        assert float(band) == pytest.approx(
            measured("band 4 px tanh noise 3", subset, "near_rmse_px"), abs=6e-4
        )
        assert float(period) == pytest.approx(measured("star", subset, "star_period_px"), abs=0.6)


PAGE = """\
```console
$ ls
other
$ ls nowhere
...
```

*Not run by the tests: it would fail.*

```console
$ ls nowhere
```

Save this as `kept.toml`:

```toml
[test]
```

```python
from pathlib import Path

print(Path("kept.toml").read_text(), 2 + 2)
```

```text
[test] 5
```
"""


def test_what_a_page_shows_wrongly_is_found(blocks_of, follower, tmp_path):
    someone = follower(tmp_path)
    someone.follow(blocks_of("page.md", PAGE))
    assert [failure.partition("\n")[0] for failure in someone.failures] == [
        "page.md, line 1: ls",
        "page.md, line 1: ls nowhere: exit code 2",
        "page.md, line 26",
    ]


@pytest.mark.parametrize(
    ("shown", "printed", "same"),
    [
        ("done in ... s", "done in 12.3 s", True),
        ("0.30 mm/px", "0.3099 mm/px", True),
        ("0.30 mm/px", "0.32 mm/px", False),
        ("3 bands", "4 bands", False),
        ("a  b\n c", "a b c", True),
        ("3 bands", "3 bands and more", False),
        ("d30-01: done", "d30-02: done", False),
    ],
)
def test_figures_may_differ_in_their_last_decimal_and_words_not_at_all(says, shown, printed, same):
    assert says(shown, printed) is same


NOT_RUN = Counter(
    {
        "docs/figures.md": 1,
        "docs/howto-cluster.md": 4,
        "docs/howto-export.md": 2,
    }
)
"""Blocks by page that cannot run here: other machines, other programs."""
