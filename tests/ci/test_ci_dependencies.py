"""The scripts of CI that look at dependencies: what they let pass, what they stop, what was not done."""

import pytest

HOLE = {"id": "PYSEC-2026-1", "fix_versions": ["2.0"]}
SKIPPED = {"name": "b", "skip_reason": "not found"}


@pytest.fixture
def licences(script):
    return script("licences")


@pytest.fixture
def audit(script):
    return script("audit")


def test_every_licence_at_run_time_is_printed_and_none_is_a_gpl(licences, capsys):
    assert licences.main() == 0
    lines = capsys.readouterr().out.splitlines()
    assert {"numpy", "scipy", "pydantic-core"} <= {line.split()[0] for line in lines if line}
    assert "ploughval" not in {line.split()[0] for line in lines if line}


def test_an_environment_without_the_project_is_named(licences, monkeypatch):
    monkeypatch.setattr(licences, "PROJECT", "no-such-project")
    with pytest.raises(SystemExit, match=r"no-such-project is not installed for .*; run: make licences"):
        licences.main()


@pytest.mark.parametrize(
    "said", ["GPL-3.0-only", "GNU Affero General Public License v3", "LGPL-2.1", "unknown"]
)
def test_a_licence_that_is_unknown_or_a_gpl_stops_unless_it_is_listed(licences, monkeypatch, capsys, said):
    monkeypatch.setattr(licences, "licence", lambda package: said if package.name == "numpy" else "MIT")
    assert licences.main() == 1
    assert f"numpy: {said} licence; replace it, or list it with a reason" in capsys.readouterr().out
    monkeypatch.setattr(licences, "allowed", lambda: {"numpy": "for a reason"})
    assert licences.main() == 0


def test_a_vulnerability_stops(audit, monkeypatch, capsys):
    monkeypatch.setattr(audit, "audited", lambda: [{"name": "a", "version": "1.0", "vulns": [HOLE]}, SKIPPED])
    assert audit.main() == 1
    assert capsys.readouterr().out.splitlines() == [
        "a 1.0: PYSEC-2026-1; mended in: 2.0",
        "audit: 1 packages, 1 findings; not to be had: b",
    ]


def test_an_audit_that_could_look_nothing_up_says_that_it_was_not_done(audit, monkeypatch, capsys):
    monkeypatch.setattr(audit, "audited", lambda: [SKIPPED, SKIPPED])
    assert audit.main() == 0
    assert "NOT DONE: none of 2 packages" in capsys.readouterr().out


def test_an_audit_without_its_tool_says_that_it_was_not_done(audit, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(audit, "TOOL", tmp_path / "pip-audit")
    monkeypatch.setattr(audit, "run", lambda *command: "no index")
    assert audit.main() == 0
    assert "NOT DONE: pip-audit could not be installed: no index" in capsys.readouterr().out


@pytest.mark.parametrize(("name", "known"), [("licences", {"nptdms"}), ("audit", [])])
def test_what_is_let_pass_has_a_reason(name, known, script, monkeypatch, tmp_path):
    module = script(name)
    assert set(module.allowed()) == set(known)
    monkeypatch.setattr(module, "ALLOWED", tmp_path / "allowed.txt")
    module.ALLOWED.write_text("numpy\n")
    with pytest.raises(SystemExit, match="has no reason"):
        module.allowed()
