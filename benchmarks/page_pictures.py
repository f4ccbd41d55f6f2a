"""Pictures of a report page for a developer's eye: three widths, light and dark, each chapter, and paper.

python benchmarks/page_pictures.py FOLDER_OR_PAGE OUT [--widths 390 800 1200] [--chapters player force]

Needs a Chromium: one on the path, the one named in PLOUGHVAL_BROWSER, or playwright's own.
"""

import argparse
import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
WIDTHS, SCHEMES = (390, 800, 1200), ("light", "dark")
TALLEST = 2400  # px of one picture: a chapter that is taller becomes several


def main(arguments: Sequence[str] | None = None) -> None:
    """Write OUT/<width>-<scheme>-<chapter>[-part].png and OUT/paper.pdf."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("page", type=Path, help="a page, or a folder with report.html")
    parser.add_argument("out", type=Path, help="folder for the pictures")
    parser.add_argument("--widths", type=int, nargs="*", default=WIDTHS)
    parser.add_argument("--schemes", nargs="*", default=SCHEMES)
    parser.add_argument("--chapters", nargs="*", help="ids of chapters; default: all and the head")
    parser.add_argument("--frame", type=int, help="frame that the player shows")
    options = parser.parse_args(arguments)
    path = options.page / "report.html" if options.page.is_dir() else options.page
    options.out.mkdir(parents=True, exist_ok=True)
    with browser() as chromium:
        for width in options.widths:
            for scheme in options.schemes:
                page = chromium.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
                page.goto(path.resolve().as_uri())
                if options.frame is not None:
                    page.locator("[data-player=slider]").fill(str(options.frame))
                page.evaluate(
                    """() => { document.activeElement.blur();
                    document.querySelector("nav").style.position = "static"; }"""
                )
                picture_chapters(page, options.out, f"{width}-{scheme}", options.chapters)
                page.close()
        page = chromium.new_page()
        page.goto(path.resolve().as_uri())
        page.pdf(path=options.out / "paper.pdf", format="A4", prefer_css_page_size=True)
        print(options.out / "paper.pdf")


@contextmanager
def browser() -> Iterator[Any]:
    """A Chromium of this machine, headless."""
    named = os.environ.get("PLOUGHVAL_BROWSER") or next(filter(None, map(shutil.which, NAMES)), None)
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(
            executable_path=named, args=["--disable-gpu", *(["--no-sandbox"] if root else [])]
        )
        yield chromium
        chromium.close()


def picture_chapters(page: Any, out: Path, prefix: str, wanted: Sequence[str] | None) -> None:
    """One picture of each chapter, or several where it is tall."""
    places = page.evaluate(
        """() => [["head", document.querySelector("header")],
          ...[...document.querySelectorAll("main section")].map((s) => [s.id, s])]
          .map(([name, e]) => [name, e.getBoundingClientRect()])
          .map(([name, box]) => [name, box.top + scrollY, box.height])"""
    )
    width = page.viewport_size["width"]
    for name, top, height in places:
        if wanted and name not in wanted:
            continue
        parts = max(1, -(-int(height) // TALLEST))
        for part in range(parts):
            start = top + part * TALLEST
            clip = {"x": 0, "y": start, "width": width, "height": min(TALLEST, top + height - start)}
            target = out / f"{prefix}-{name}{f'-{part + 1}' if parts > 1 else ''}.png"
            page.screenshot(path=target, clip=clip, full_page=True)
            print(target)


if __name__ == "__main__":
    main()
