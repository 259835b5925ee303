"""`shipgym doctor`: the installation, and the cache of compiled ships."""

import importlib.metadata
import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from agents.cli import app, doctor

ROOT = Path(__file__).parents[2]


def shipgym(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_doctor_finds_this_installation_fit():
    answer = shipgym("doctor", "--json")
    states = {
        finding["what"]: finding["state"]
        for finding in json.loads(answer.stdout)["findings"]
    }
    assert states["numba"] == states["cache"] == states["import agents"] == "fine"
    assert states["extra report"] == "fine"


def test_doctor_tells_of_a_cache_that_cannot_be_written(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("SHIPGYM_CACHE", str(tmp_path / "file" / "cache"))
    answer = shipgym("doctor")
    assert answer.exit_code == 1
    assert "is compiled again in each process" in answer.stdout.replace("\n", " ")


def test_doctor_tells_place_and_size_of_the_cache(tmp_path, monkeypatch):
    (tmp_path / "it.loop").write_bytes(bytes(200_000))
    monkeypatch.setenv("SHIPGYM_CACHE", str(tmp_path))
    assert f"{tmp_path}, 1 files, 0.2 MB" in shipgym("doctor").stdout.replace("\n", "")


@pytest.mark.parametrize(
    ("state", "mark"),
    [("fine", "ok"), ("absent", "absent"), ("left", "left"), ("wrong", "wrong")],
)
def test_doctor_has_a_mark_for_each_state(state, mark):
    line = doctor.Finding("cache", state, "and why").line().plain
    assert line.split() == [mark, "cache", "and", "why"]


def test_versions_of_packages_or_those_missing_are_named():
    found = doctor.package_finding("numpy", ["numpy", "scipy"], "wrong", "shipgym")
    assert found.state == "fine"
    assert re.fullmatch(r"[0-9.]+, scipy [0-9.]+", found.detail)
    found = doctor.package_finding(
        "extra", ["numpy", "nowhere-1", "nowhere-2"], "left", "'shipgym[x]'"
    )
    missing = "nowhere-1, nowhere-2 not installed: pip install 'shipgym[x]'"
    assert (found.state, found.detail) == ("left", missing)


def test_an_import_name_of_another_package_is_wrong(monkeypatch):
    assert doctor.name_finding("identification").state == "fine"
    assert doctor.name_finding("json").detail.startswith("expected ")
    assert doctor.name_finding("nowhere_1").detail.endswith(
        "got None: install shipgym again"
    )
    monkeypatch.setattr(
        importlib.metadata,
        "packages_distributions",
        lambda: {"agents": ["shipgym", "openai-agents", "alike"]},
    )
    answer = shipgym("doctor")
    assert answer.exit_code == 1
    assert "also a package of alike, openai-agents" in answer.stdout


def test_locks_are_looked_for_here_one_level_below_and_in_the_cache(
    tmp_path, monkeypatch
):
    folders = [tmp_path, tmp_path / "a", tmp_path / "b", tmp_path / "b" / "cache"]
    for folder in folders[1:]:
        folder.mkdir()
    for folder in folders:
        (folder / ".results.lock").write_text("process 1 on ship")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SHIPGYM_CACHE", str(folders[-1]))
    found = doctor.left_findings()
    assert [one.detail.partition(":")[0] for one in found] == [
        str(folder / ".results.lock") for folder in folders
    ]
    assert {one.state for one in found} == {"left"}


def test_needed_packages_and_extras_are_told_apart(monkeypatch):
    declared = [
        "numpy>=2",
        "tomli; python_version < '3.11'",
        'plotly>=6; extra == "report"',
        'shipgym[report]; extra == "dev"',
        'ruff; extra == "dev"',
        'mkdocs; extra == "docs"',
    ]
    monkeypatch.setattr(importlib.metadata, "requires", lambda name: declared)
    assert doctor.declared_packages() == {
        "": ["numpy", "tomli"],
        "report": ["plotly"],
        "dev": ["ruff"],
        "docs": ["mkdocs"],
    }
    checked = [one.what for one in doctor.examine_installation()]
    assert checked[:5] == ["shipgym", "numpy", "tomli", "extra report", "cache"]
    monkeypatch.setattr(importlib.metadata, "requires", lambda name: None)
    assert doctor.declared_packages() == {}
