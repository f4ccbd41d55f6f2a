"""A real browser for the report page: found on this machine, headless, without a network."""

import json
import os
import shutil
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ploughval.report import write_report
from ploughval.scene import load_scene

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
INSTALL = (
    "no Chromium was found; install one (Debian: apt install chromium; anywhere: pip install playwright and "
    "playwright install chromium), or name one in PLOUGHVAL_BROWSER"
)
HOSTILE = (
    """=1+1</script><script>window.__hit=1</script>"><img src=x onerror="window.__hit=2"> $\\frac{$ {{7*7}}"""
)
HOSTILE_FILE = """{frame:03d}<img src=x onerror=window.__hit=3>&"'=.png"""
MM_PER_PX, TIP_PX = 0.5, (30.0, 100.0)
CHECKS = Path(__file__).with_name("checks.js")


def _executable(playwright):
    """A Chromium of this machine, or None."""
    named = os.environ.get("PLOUGHVAL_BROWSER")
    found = [named] if named else [shutil.which(name) for name in NAMES]
    own = [] if named else [playwright.chromium.executable_path]
    return next((path for path in [*found, *own] if path and Path(path).is_file()), None)


@pytest.fixture(scope="session")
def chromium():
    """A running browser; the test is skipped where there is none."""
    sync_api = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed: pip install 'ploughval[dev]'"
    )
    with sync_api.sync_playwright() as playwright:
        executable = _executable(playwright)
        if executable is None:
            pytest.skip(INSTALL)
        flags = ["--disable-gpu", "--disable-dev-shm-usage"]
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            flags.append("--no-sandbox")  # Chromium has no sandbox for root
        browser = playwright.chromium.launch(executable_path=executable, args=flags)
        yield browser
        browser.close()


@dataclass(frozen=True)
class Pages:
    """Pages that every test of the session reads: of hostile texts, of several tests, of parts missing."""

    results: Path
    one: Path
    several: Path
    bare: Path
    blind: Path


@pytest.fixture(scope="session")
def pages(tmp_path_factory, worker_id, make_results):
    """The pages, written once for all workers."""
    root = tmp_path_factory.getbasetemp()
    root = root if worker_id == "master" else root.parent
    folder = root / "browser-pages"
    try:
        folder.mkdir()
    except FileExistsError:
        _wait_for(folder)
    else:
        try:
            _write_pages(folder, make_results)
        finally:
            (folder / "ended").touch()
    names = ("one", "several", "bare", "blind")
    return Pages(folder / "one" / "results", *(folder / f"{name}.html" for name in names))


@pytest.fixture(scope="session")
def worker_id(request):
    """Name of this worker; "master" where there are none."""
    return getattr(request.config, "workerinput", {}).get("workerid", "master")


def _wait_for(folder, seconds=300.0):
    for _ in range(int(seconds * 20)):
        if (folder / "ended").exists():
            break
        time.sleep(0.05)
    if not (folder / "complete").exists():
        pytest.fail("the pages could not be written; the worker that tried says why")


def _write_pages(folder, make_results):
    results = _photographed(folder / "one", make_results)
    write_report(results, out=folder / "one.html")
    plain = make_results(folder / "plain", name="d30-02")
    write_report([results, plain], out=folder / "several.html")
    shutil.copytree(plain / "model", folder / "model-alone" / "model")
    write_report(folder / "model-alone", out=folder / "bare.html")
    for name in ("force.csv", "model"):  # photographs cannot be read, no force, no model
        path = plain / name
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    write_report(plain, out=folder / "blind.html")
    (folder / "complete").touch()


def _photographed(folder, make_results):
    """A test folder of hostile texts whose photographs can be read; frame 5 is lost, frame 7 unreadable."""
    photos = folder / "photos"
    photos.mkdir(parents=True)
    grains = np.random.default_rng(5)
    names = [HOSTILE_FILE.format(frame=frame) for frame in range(13)]
    for name in names:
        Image.fromarray(grains.integers(90, 200, (130, 480), dtype=np.uint8)).save(photos / name)
    (photos / names[7]).write_bytes(b"no longer a photograph")
    (folder / "test.toml").write_text(
        f"[test]\nname = '''{HOSTILE}'''\n[blade]\ndepth_mm = 30.0\nwidth_mm = 218.0\n"
        f'[camera]\nphotos = "photos/*.png"\nmm_per_px = {MM_PER_PX}\ntip_px = [{TIP_PX[0]}, {TIP_PX[1]}]\n'
        "times = {start_s = 10.0, interval_s = 5.0}\n"
    )
    results = make_results(folder / "results", test_folder=folder, name=HOSTILE, stages=2)
    record = json.loads((results / "run.json").read_text())
    record["settings_hash"] = load_scene(folder).settings_hash
    record["settings"]["test"] = {"name": HOSTILE, "notes": HOSTILE}
    record["warnings"] = [HOSTILE]
    for entry, name in zip(record["frames"], names, strict=True):
        entry["file"] = name
    record["frames"][5]["reason"] = HOSTILE
    (results / "run.json").write_text(json.dumps(record))
    budget = (results / "budget.csv").read_text().splitlines()
    budget[2] = '"' + HOSTILE.replace('"', '""') + '"' + budget[2][budget[2].index(",0") :]
    (results / "budget.csv").write_text("\n".join(budget) + "\n")
    return results


@pytest.fixture(scope="session")
def hostile():
    """The name, notes, warning and reason of the test on the pages ``one`` and ``several``."""
    return HOSTILE


class Visits:
    """Opens pages of this machine and hears what each says, asks for or violates."""

    def __init__(self, chromium):
        self._chromium, self._contexts, self._troubles, self._asked = chromium, [], [], set()

    def __call__(self, path, *, width=1200, height=900, javascript=True, scheme="light", **options):
        context = self._chromium.new_context(
            viewport={"width": width, "height": height},
            java_script_enabled=javascript,
            color_scheme=scheme,
            offline=True,
            **options,
        )
        self._contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(30_000)
        page.add_init_script(path=CHECKS)
        page.on("console", lambda message: self._troubles.append(f"console: {message.text}"))
        page.on("pageerror", lambda error: self._troubles.append(f"error: {error}"))
        page.on("request", lambda request: self._judge(request.url))
        self.turn(page, path)
        return page

    def turn(self, page, path):
        """Open another file of this machine in the same window."""
        address = Path(path).resolve().as_uri()
        self._asked.add(address)
        page.goto(address)

    def _judge(self, url):
        if url.partition("#")[0] not in self._asked and not url.startswith(("data:", "blob:")):
            self._troubles.append(f"request: {url[:200]}")

    def end(self):
        """Close all pages; what went wrong on any of them."""
        for context in self._contexts:
            for page in context.pages:
                self._troubles += page.evaluate("window.checks ? checks.violations : []")
                self._troubles += page.evaluate("window.__hit ? ['a text ran: ' + window.__hit] : []")
            context.close()
        return self._troubles


@pytest.fixture
def visit(chromium):
    """Opens a page; the test fails where the page says, asks for or violates anything."""
    visits = Visits(chromium)
    yield visits
    assert visits.end() == []


@pytest.fixture(scope="module")
def one_page(chromium, pages):
    """The page of one test, open for all tests of a module, each of which sets what it needs."""
    visits = Visits(chromium)
    yield visits(pages.one)
    assert visits.end() == []
