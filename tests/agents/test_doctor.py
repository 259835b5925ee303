"""`shipgym doctor`: the installation, and the cache of compiled ships."""

import importlib.metadata
import json

from typer.testing import CliRunner

from agents.cli import app


def doctor():
    """Findings by name, and the exit code."""
    answer = CliRunner().invoke(app, ["doctor", "--json"])
    findings = json.loads(answer.stdout)["findings"]
    found = {one["what"]: (one["state"], one["detail"]) for one in findings}
    return found, answer.exit_code


def test_doctor_finds_this_installation_fit():
    found, code = doctor()
    for what in ("numba", "cache", "import agents", "extra report"):
        assert found[what][0] == "fine"
    assert code == 0


def test_doctor_tells_where_the_cache_is_and_that_it_cannot_be_written(
    tmp_path, monkeypatch
):
    monkeypatch.setenv("SHIPGYM_CACHE", str(tmp_path / "cache"))
    assert doctor()[0]["cache"] == ("fine", str(tmp_path / "cache"))
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("SHIPGYM_CACHE", str(tmp_path / "file" / "cache"))
    found, code = doctor()
    assert (found["cache"][0], code) == ("wrong", 1)
    assert "is compiled again in each process" in found["cache"][1]


def test_needed_packages_extras_and_names_of_others_are_told_apart(monkeypatch):
    declared = [
        "numpy>=2",
        "nowhere-1; python_version < '3.99'",
        'plotly>=6; extra == "report"',
        'nowhere-2; extra == "absent"',
        'shipgym[report]; extra == "dev"',
        'ruff; extra == "dev"',
    ]
    monkeypatch.setattr(importlib.metadata, "requires", lambda name: declared)
    monkeypatch.setattr(
        importlib.metadata,
        "packages_distributions",
        lambda: {"agents": ["shipgym", "openai-agents"]},
    )
    found, code = doctor()
    assert code == 1
    states = {what: state for what, (state, _) in found.items()}
    assert states["numpy"] == states["extra report"] == "fine"
    assert (states["nowhere-1"], states["extra absent"]) == ("wrong", "absent")
    assert "extra dev" not in states
    missing = "nowhere-2 not installed: pip install 'shipgym[absent]'"
    assert found["extra absent"][1] == missing
    assert found["import agents"][1].startswith("also a package of openai-agents")
