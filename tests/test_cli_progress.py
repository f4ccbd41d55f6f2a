"""Progress of real commands: bars that are gone at the end, lines in a pipe, JSON for machines."""

import json
import os
import re
import subprocess
import sys
import threading
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from ploughval.cli import app
from ploughval.run import Outcome
from ploughval.synth import SynthOptions, make_folder

SHOW = """
import logging, sys, time
from ploughval.talk import command, shown_progress
logging.basicConfig(level=logging.WARNING, format="%(message)s")
with command() as talk:
    with shown_progress(talk) as progress:
        heard = progress.of("d30 [bold]01")
        progress("tests", 0, 2)
        for done in range(4):
            heard("photographs", done, 4)
            time.sleep(0.26)
            if done == 1:
                talk.warn("a fault [red]in brackets")
                logging.warning("a line of the log")
                talk.say("one is done")
        heard("photographs", 4, 4)
        progress("tests", 1, 2)
    talk.say("the end")
"""
SHOW_ONE = SHOW.replace('progress.of("d30 [bold]01")', "progress")


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


def on_a_terminal(arguments, *, columns=80, stdout=None, **environment):
    """What a program writes to a terminal of a given width; its output too, unless it goes elsewhere."""
    pty = pytest.importorskip("pty", reason="pseudo-terminals are of POSIX")
    import fcntl
    import struct
    import termios

    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    unset = ("COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE")
    inherited = {name: value for name, value in os.environ.items() if name not in unset}
    process = subprocess.Popen(
        arguments,
        stdin=subprocess.DEVNULL,
        stdout=stdout or theirs,
        stderr=theirs,
        env=inherited | {"TERM": "xterm-256color"} | environment,
    )
    os.close(theirs)
    chunks = []

    def read():
        while True:
            try:
                chunk = os.read(ours, 65536)
            except OSError:  # the other end has closed
                return
            if not chunk:
                return
            chunks.append(chunk)

    reader = threading.Thread(target=read)
    reader.start()
    code = process.wait(timeout=120)
    reader.join(timeout=10)
    os.close(ours)
    return code, b"".join(chunks).decode()


def screen(written):
    """The lines that a terminal shows in the end: cursor up, return, erase line."""
    lines, row, column = [""], 0, 0
    for piece in re.findall(r"\x1b\[[?0-9;]*[A-Za-z]|[^\x1b]", written):
        if piece == "\n":
            row += 1
            if row == len(lines):
                lines.append("")
        elif piece == "\r":
            column = 0
        elif piece.endswith("A") and piece.startswith("\x1b"):
            row -= int(piece[2:-1] or 1)
        elif piece == "\x1b[2K":
            lines[row] = ""
        elif not piece.startswith("\x1b"):
            lines[row] = lines[row][:column].ljust(column) + piece + lines[row][column + 1 :]
            column += 1
    return [line.rstrip() for line in lines if line.strip()]


def test_bars_are_drawn_on_a_terminal_and_gone_at_the_end():
    code, written = on_a_terminal([sys.executable, "-c", SHOW])
    assert code == 0
    assert "━" in written
    assert "d30 [bold]01: photographs" in written
    assert "2 of 4" in written
    assert re.search(r"0\.\d s left", written)
    assert screen(written) == ["a fault [red]in brackets", "a line of the log", "one is done", "the end"]


def test_bars_of_more_tests_than_a_terminal_has_lines_are_gone_at_the_end_too():
    many = (
        "import time\nfrom ploughval.talk import command, shown_progress\n"
        "with command() as talk, shown_progress(talk) as progress:\n"
        "    progress('tests', 0, 300)\n"
        "    for n in range(64):\n"
        "        progress.of(f'test {n}')('photographs', 0, 9)\n"
        "    time.sleep(0.3)\n"
        "    for n in range(30):\n"
        "        progress.of(f'test {n}')('photographs', 9, 9)\n"
        "    time.sleep(0.3)\n"
        "    talk.warn('one is done')\n"
    )
    _, written = on_a_terminal([sys.executable, "-c", many])
    assert "tests" in written
    assert "test 3: photographs" in written
    assert "test 40: photographs" in written  # when those before it have ended
    assert "test 60: photographs" not in written
    assert screen(written) == ["one is done"]


@pytest.mark.parametrize("columns", [30, 50, 200])
def test_bars_of_a_narrow_and_a_wide_terminal_keep_to_one_line_each(columns):
    _, written = on_a_terminal([sys.executable, "-c", SHOW], columns=columns)
    assert screen(written)[-1] == "the end"
    drawn = [re.sub(r"\x1b\[[?0-9;]*[A-Za-z]", "", line) for line in re.split(r"[\r\n]", written)]
    assert max(map(len, drawn)) <= columns
    assert any("left" in line for line in drawn)
    assert len(screen(written)) == 4


@pytest.mark.parametrize("terminal", ["dumb", "unknown"])
def test_a_terminal_that_cannot_move_its_cursor_gets_lines(terminal):
    _, written = on_a_terminal([sys.executable, "-c", SHOW_ONE], TERM=terminal)
    assert "\x1b" not in written
    assert "photographs: begun" in written


def test_without_colour_bars_have_none():
    _, written = on_a_terminal([sys.executable, "-c", SHOW], NO_COLOR="1")
    assert "━" in written
    colours = re.findall(r"\x1b\[([0-9;]*)m", written)
    assert not [c for c in colours if re.search(r"(^|;)(3[0-9]|9[0-7]|38)(;|$)", c)]


def test_output_that_goes_to_a_file_gets_there_while_bars_are_drawn(tmp_path):
    with (tmp_path / "out.txt").open("w") as file:
        _, written = on_a_terminal([sys.executable, "-c", SHOW], stdout=file)
    assert (tmp_path / "out.txt").read_text() == "one is done\nthe end\n"
    assert screen(written) == ["a fault [red]in brackets", "a line of the log"]


def test_a_pipe_gets_a_few_plain_lines():
    done = subprocess.run([sys.executable, "-c", SHOW_ONE], capture_output=True, text=True, check=True)
    assert done.stdout == "one is done\nthe end\n"
    lines = re.sub(r"[\d.]+ s", "* s", done.stderr).splitlines()
    # Between, a line once a second at most: none here, but on a machine that is slower than its clock.
    assert [line for line in lines if not re.search("photographs: [123] of 4", line)] == [
        "tests: begun",
        "photographs: begun",
        "a fault [red]in brackets",
        "a line of the log",
        "photographs: took * s",
        "tests: 1 of 2, * s left",
    ]


def test_processing_several_tests_says_which_and_how_many_are_done(monkeypatch, tmp_path):
    def process(folder, *, out, progress, **_):
        progress("model", 0, 1)
        progress("model", 1, 1)
        name = Path(folder).name
        return Outcome(name, Path(out), True, (), (), {}, ("model",), 0.1, Path(out) / "report.html")

    monkeypatch.setattr("ploughval.cli._process_one", process)
    result = run("process", tmp_path / "a", tmp_path / "b", "--out", tmp_path / "o", "--workers", 1)
    assert result.exit_code == 0, result.output
    assert re.sub(r"\d\.\d s", "* s", result.stderr).splitlines() == [
        "tests: begun",
        "a: done in * s",
        "b: done in * s",
        "tests: took * s",
    ]


def commands(folder):
    """Every command with JSON: its arguments, and the exit code it ends with."""
    made = folder / "made"
    empty = folder / "empty"
    empty.mkdir()
    synth = ("--frames", 2, "--displacement", 2, "--no-photos", "--like", folder)
    return [
        (("init", empty), 0),
        (("init", empty), 2),
        (("synth", made, *synth), 0),
        (("synth", made, *synth), 2),
        (("check", folder, "--picture", folder / "p.png"), 0),
        (("check", folder / "none"), 2),
        (("simulate", folder), 0),
        (("simulate", folder / "none"), 2),
        (("process", folder), 0),
        (("process", folder / "none"), 2),
        (("report", folder), 0),
        (("report", empty / "none"), 2),
        (("fit", folder), 2),
        (("bench", "nonsense", "--out", folder / "bench"), 2),
        (("process",), 2),
        (("process", folder, "--workers", "many"), 2),
        (("simulate", folder, "--no-such-option"), 2),
        (("no-such-command",), 2),
    ]


def test_with_json_every_command_prints_one_value_and_json_lines_beside_it(model_only):
    for arguments, code in commands(model_only):
        result = run(*arguments, "--json")
        assert result.exit_code == code, (arguments, result.output)
        summary = json.loads(result.stdout)
        assert summary["exit_code"] == code, arguments
        assert (code == 0) or summary.get("error") or summary.get("tests") or summary.get("findings")
        for line in result.stderr.splitlines():
            assert json.loads(line)["event"] in ("progress", "message", "log"), arguments


def test_what_scripts_print_stays_out_of_the_json_value(monkeypatch, tmp_path):
    script = "def main(arguments):\n    print('a table', 1.5)\n    print('its end', end='')\n"
    folder = tmp_path / "scripts"
    folder.mkdir()
    (folder / "bench_one.py").write_text(script)
    monkeypatch.setattr("ploughval.run.benches.bench_folder", lambda: folder)
    monkeypatch.setattr("sys.path", [*sys.path, str(folder)])
    result = run("bench", "one", "--out", tmp_path / "o", "--json")
    assert json.loads(result.stdout) == {"exit_code": 0, "files": []}
    events = [json.loads(line) for line in result.stderr.splitlines()]
    assert [event["text"] for event in events if event["event"] == "message"] == ["a table 1.5", "its end"]
    assert [event["stage"] for event in events if event["event"] == "progress"][:2] == ["bench", "bench one"]


def test_an_interrupted_command_still_ends_with_a_json_value(monkeypatch, model_only):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("ploughval.model.simulate", interrupt)
    result = run("simulate", model_only, "--json")
    assert result.exit_code == 130
    assert json.loads(result.stdout)["exit_code"] == 130


def test_making_photographs_is_counted(tmp_path):
    heard = []
    options = SynthOptions(frames=3, displacement_mm=2.0, loadcells=False)
    make_folder(tmp_path / "t", options, progress=lambda *told: heard.append(told))
    assert heard == [("making photographs", done, 3) for done in range(4)]


def test_the_page_of_the_command_line_names_every_command_and_option():
    text = (Path(__file__).parents[1] / "docs" / "command-line.md").read_text(encoding="utf-8")
    for verb, command in typer.main.get_command(app).commands.items():
        assert f"`{verb}" in text
        for parameter in command.params:
            for option in (name for name in parameter.opts if name.startswith("--")):
                assert re.search(rf"`{option}[ `]", text), f"{verb} {option}"


def test_warnings_of_python_and_of_the_log_are_json_lines_too(model_only):
    code = (
        "import logging, sys, warnings, ploughval.model as model\n"
        "def simulate(*_, **__):\n"
        "    warnings.warn('of python')\n"
        "    logging.getLogger('ploughval').warning('of the log')\n"
        "    raise RuntimeError('a fault')\n"
        "model.simulate = simulate\n"
        "from ploughval.cli import app\n"
        f"app(['--debug', 'simulate', {str(model_only)!r}, '--json'])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == json.loads(done.stdout)["exit_code"] == 3
    events = [json.loads(line) for line in done.stderr.splitlines()]
    logged = [event["text"] for event in events if event["event"] == "log" and event["level"] == "warning"]
    assert any("of python" in text for text in logged)
    assert "of the log" in logged
    assert any("RuntimeError: a fault" in event["text"] for event in events if event["event"] == "log")
