"""The cache of compiled loops: one process compiles, and neither foreign nor broken folders end a program."""

import json
import os
import re
import signal
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

import shipgym
from shipgym.engine import cache_folder, compiling, episodes
from shipgym.engine.compiling import compiled
from shipgym.engine.voyages import sensors_for, voyages
from shipgym.tasks.definition import read_definition

WORKER = """
import os, sys
from shipgym.engine import compiling, places
def tell(what, folder):
    print("compiles", flush=True)
    {while_compiling}
compiling._announce = tell
def twice(numbers):
    for i in range(len(numbers)):
        numbers[i] *= 2.0
compiling.compiled(twice, "void(float64[::1])", {{}}, "twice")
print("done")
"""
OTHER_USER = """
import json, os, sys, warnings
import numpy as np
from shipgym.engine import cache_folder, compiling

def twice(numbers):
    for i in range(len(numbers)):
        numbers[i] *= 2.0

def thrice(numbers):
    for i in range(len(numbers)):
        numbers[i] *= 3.0

announced = []
compiling._announce = lambda what, folder: announced.append(what)

def attempt(function):
    announced.clear()
    cache_folder.usable_folder.cache_clear()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        loop = compiling.compiled(function, "void(float64[::1])", {}, "loop")
    numbers = np.ones(1)
    loop(numbers)
    return [numbers[0], len(announced), [str(one.message) for one in caught]]

folder, closed = sys.argv[1:]
found = {"before": attempt(twice)}
os.chmod(folder, 0o555)
os.chmod(closed, 0 if os.geteuid() else 0o700)
if os.geteuid() == 0:
    os.seteuid(65534)
found["filled"], found["partly"] = attempt(twice), attempt(thrice)
del os.environ["SHIPGYM_CACHE"]
os.environ.pop("XDG_CACHE_HOME", None)
for home in ("/", closed, closed + "/deeper"):
    os.environ["HOME"] = home
    found[home] = attempt(twice)
print(json.dumps(found))
"""


def start(code, *arguments, cache):
    return subprocess.Popen(
        [sys.executable, "-c", code, *arguments],
        env={**os.environ, "SHIPGYM_CACHE": str(cache)}, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip


def test_of_processes_that_start_at_once_one_compiles(tmp_path):
    workers = [start(WORKER.format(while_compiling="pass"), cache=tmp_path) for _ in range(4)]
    answers = [worker.communicate()[0].split() for worker in workers]
    assert sorted(answers) == [["compiles", "done"]] + [["done"]] * 3
    assert len(list(tmp_path.glob("*.loop"))) == 1
    assert not list(tmp_path.glob("*.new"))


@pytest.mark.skipif(os.name == "nt", reason="there is no such signal")
def test_a_process_that_is_killed_while_it_compiles_blocks_nobody(tmp_path):
    killed = start(
        WORKER.format(while_compiling=f"os.kill(os.getpid(), {int(signal.SIGKILL)})"), cache=tmp_path
    )
    assert killed.communicate()[0].split() == ["compiles"]
    assert list(tmp_path.glob("*.lock"))
    after = start(WORKER.format(while_compiling="pass"), cache=tmp_path)
    assert after.communicate(timeout=120)[0].split() == ["compiles", "done"]


@pytest.mark.parametrize(
    "damage", [lambda whole: b"", lambda whole: whole[:-100], lambda whole: whole[:-1] + b"?"]
)
def test_a_damaged_file_is_compiled_anew(tmp_path, damage):
    code = WORKER.format(while_compiling="pass")
    assert start(code, cache=tmp_path).communicate()[0].split() == ["compiles", "done"]
    (file,) = tmp_path.glob("*.loop")
    whole = file.read_bytes()
    file.write_bytes(damage(whole))
    assert start(code, cache=tmp_path).communicate()[0].split() == ["compiles", "done"]
    assert start(code, cache=tmp_path).communicate()[0].split() == ["done"]


@pytest.mark.skipif(os.name == "nt", reason="Windows has other permissions")
def test_a_cache_of_another_user_is_read_and_closed_folders_are_said():
    with tempfile.TemporaryDirectory() as home:  # pytest's own folders are closed to other users
        Path(home).chmod(0o755)
        folder, closed = Path(home) / "cache", Path(home) / "closed"
        folder.mkdir()
        closed.mkdir()
        found = json.loads(start(OTHER_USER, str(folder), str(closed), cache=folder).communicate()[0])
        folder.chmod(stat.S_IRWXU)
        closed.chmod(stat.S_IRWXU)
    assert found.pop("before") == [2.0, 1, []]
    assert found.pop("filled") == [2.0, 0, []]
    assert found["partly"][0] == 3.0
    for factor, compilations, messages in found.values():
        assert factor in (2.0, 3.0)
        assert compilations == 1
        assert re.search("cannot be written .* compiled anew in each process. Set SHIPGYM_CACHE", *messages)


def test_a_cache_that_cannot_be_made_is_said_and_survived(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("SHIPGYM_CACHE", str(tmp_path / "file" / "cache"))
    cache_folder.usable_folder.cache_clear()
    with pytest.warns(UserWarning, match="compiled anew in each process"):
        assert cache_folder.usable_folder() is None
    cache_folder.usable_folder.cache_clear()


def test_who_waits_at_a_terminal_sees_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    compiling._announce("CourseKeeping for 'mariner'", tmp_path)
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    for told in ("CourseKeeping for 'mariner'", "once", "about", str(tmp_path), "shipgym warm"):
        assert told in line
    monkeypatch.setattr("sys.stderr.isatty", lambda: False)
    compiling._announce("it", tmp_path)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("loop", "signature"),
    [
        ("sail_lanes", "void(float64[::1], uint64[::1], float64, float64[::1], int64)"),
        ("conclude_lanes", "void(float64[::1], uint64[:, ::1], float64[::1], float64[::1], int64)"),
    ],
)
def test_loops_over_ships_are_vectorised(loop, signature, monkeypatch):
    monkeypatch.setattr(compiling, "usable_folder", lambda: None)  # what comes from the cache tells no code
    vessel = shipgym.load_model("mariner-tls-svm").vessel
    found = voyages(vessel, read_definition("CourseKeeping"), sensors_for(False, False, False), False, True)
    function = compiled(getattr(episodes, loop), signature, found.parts, loop)
    (code,) = function.inspect_llvm().values()
    vectors, numbers = (
        len(re.findall(rf" = f(?:mul|add|sub) (?:contract )?{kind}", code))
        for kind in (r"<\d+ x double>", "double")
    )
    assert vectors > 100
    assert vectors > numbers / 2
