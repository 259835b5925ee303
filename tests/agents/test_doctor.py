"""`shipgym doctor` and `shipgym warm`: the installation, and the cache of compiled
ships."""

import errno
import importlib.metadata
import json
import os
import re
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from agents.cli import app, doctor
from agents.cli.warm import warm_jobs, warm_names
from shipgym import InputError
from shipgym.engine.cache_folder import CacheWarning

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
    assert "compiles its ships again" in answer.stdout


def test_doctor_tells_place_and_size_of_the_cache(tmp_path, monkeypatch):
    (tmp_path / "it.loop").write_bytes(bytes(200_000))
    monkeypatch.setenv("SHIPGYM_CACHE", str(tmp_path))
    assert f"{tmp_path}, 1 files, 0.2 MB" in shipgym("doctor").stdout.replace("\n", "")


def test_doctor_tells_of_a_cache_that_is_damaged_or_open_to_others(
    tmp_path, monkeypatch
):
    (tmp_path / "it.loop").write_bytes(bytes(200))
    monkeypatch.setenv("SHIPGYM_CACHE", str(tmp_path))
    answer = shipgym("doctor", "--json")
    (cache,) = (
        one for one in json.loads(answer.stdout)["findings"] if one["what"] == "cache"
    )
    assert (answer.exit_code, cache["state"]) == (1, "wrong")
    assert "1 of them not usable: it.loop is damaged" in cache["detail"]
    if os.name != "nt":
        tmp_path.chmod(0o777)
        answer = shipgym("doctor", "--json")
        assert answer.exit_code == 1
        assert (
            f"{tmp_path} may be written by other users; chmod go-w {tmp_path}, or set"
            in answer.stdout
        )


@pytest.mark.parametrize(
    ("state", "mark"),
    [("fine", "ok"), ("absent", "absent"), ("left", "left"), ("wrong", "wrong")],
)
def test_doctor_has_a_mark_for_each_state(state, mark):
    line = doctor.Finding("cache", state, "and why").line().plain
    assert line.split() == [mark, "cache", "and", "why"]


def test_warm_compiles_into_the_cache_and_writes_nothing_else(tmp_path):
    cache, here = tmp_path / "cache", tmp_path / "here"
    here.mkdir()
    command = [
        sys.executable,
        "-m",
        "agents.cli",
        "warm",
        "shipgym/CourseKeeping-v0",
        "--json",
    ]
    environment = {**os.environ, "SHIPGYM_CACHE": str(cache), "PYTHONPATH": str(ROOT)}
    answer = subprocess.run(
        command, cwd=here, env=environment, capture_output=True, text=True, check=True
    )
    told = json.loads(answer.stdout)
    assert told["cache"] == str(cache)
    assert [one["refused"] for one in told["ready"]] == ["", ""]
    assert len(list(cache.glob("*.loop"))) == 2
    assert not list(here.iterdir())


@pytest.mark.skipif(os.name == "nt", reason="Windows has other permissions")
def test_warm_fills_no_cache_that_would_not_be_used(tmp_path):
    tmp_path.chmod(0o777)
    answer = subprocess.run(
        [sys.executable, "-m", "agents.cli", "warm"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "SHIPGYM_CACHE": str(tmp_path)},
    )
    assert answer.returncode == 2
    assert "may be written by other users" in answer.stderr
    assert "there is no cache to fill" in answer.stderr
    assert not list(tmp_path.iterdir())


def test_a_cache_that_can_only_be_read_is_of_use_if_something_is_in_it(
    tmp_path, monkeypatch
):
    def refused(**_):
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setenv("SHIPGYM_CACHE", str(tmp_path))
    monkeypatch.setattr(tempfile, "NamedTemporaryFile", refused)
    empty = doctor.cache_finding()
    assert empty.state == "wrong"
    assert "cannot be written (Read-only file system)" in empty.detail
    (tmp_path / "notes.txt").write_text("2" * 260_000)
    filled = doctor.cache_finding()
    assert filled.state == "fine"
    assert f"{tmp_path}, 1 files, 0.3 MB, to be read only" in filled.detail


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


def test_warm_takes_what_is_named_or_all_there_is():
    everything = warm_names(None, True)
    assert {"shipgym/CourseKeeping-v0", "mariner", "kvlcc2-mmg"} <= set(everything)
    assert warm_names(["tanker"], True) == everything
    assert warm_names(["tanker"], False) == ["tanker"]
    assert "shipgym/CourseKeeping-v0" in warm_names(None, False)
    assert list(warm_jobs("shipgym/CourseKeeping-v0")) == [
        "shipgym/CourseKeeping-v0 in calm water",
        "shipgym/CourseKeeping-v0 in a sea",
    ]
    assert {"tanker: zigzag", "tanker: open_loop"} <= warm_jobs("tanker").keys()


@pytest.mark.parametrize("name", ["titanic", "CartPole-v1"])
def test_warm_refuses_what_is_no_environment_and_no_model(name):
    answer = shipgym("warm", name)
    assert answer.exit_code == 2
    message = f"expected an environment's id or a model, got '{name}'"
    assert message in " ".join(answer.stderr.split())


def test_warm_makes_the_environment_of_a_task_with_a_ship_and_closes_it(monkeypatch):
    made = []

    def make(env_id, **options):
        made.append((env_id, options))
        return SimpleNamespace(close=lambda: made.append("closed"))

    monkeypatch.setattr("gymnasium.make", make)
    fairway = str(ROOT / "examples" / "fairway.py")
    jobs = warm_jobs(fairway, "kvlcc2")
    assert list(jobs) == [f"{fairway} in calm water", f"{fairway} in a sea"]
    for compile_it in jobs.values():
        compile_it()
    options = {"model": "kvlcc2", "task": fairway}
    assert made == [
        ("shipgym/CourseKeeping-v0", options),
        "closed",
        ("shipgym/CourseKeeping-v0", {**options, "sea": "rough"}),
        "closed",
    ]


def test_warm_goes_on_after_a_refusal_only_if_all_was_asked_for(monkeypatch):
    def make(env_id, **options):
        if "sea" in options:
            raise InputError("no beam")
        return SimpleNamespace(close=lambda: None)

    monkeypatch.setattr("gymnasium.make", make)
    monkeypatch.setattr("shipgym.models.list_models", list)
    answer = shipgym("warm", "--all", "--json")
    assert answer.exit_code == 0
    refused = [one["refused"] for one in json.loads(answer.stdout)["ready"]]
    assert set(refused) == {"", "no beam"}
    answer = shipgym("warm", "shipgym/CourseKeeping-v0")
    assert (answer.exit_code, answer.stderr) == (2, "error: no beam\n")


def test_warm_ends_with_an_error_if_nothing_can_be_kept(monkeypatch):
    def make(env_id, **options):
        warnings.warn("/cache: cannot be written", CacheWarning, stacklevel=1)

    monkeypatch.setattr("gymnasium.make", make)
    answer = shipgym("warm", "shipgym/CourseKeeping-v0")
    assert answer.exit_code == 2
    assert answer.stderr.endswith("in calm water: /cache: cannot be written\n")
