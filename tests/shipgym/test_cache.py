"""The cache of compiled loops: one process compiles, others wait and read."""

import os
import re
import subprocess
import sys

import pytest

import shipgym
from shipgym.engine.episode_program import EpisodeProgram
from shipgym.instruments.sensor_set import shipped_sensors
from shipgym.sea.open_sea import CALM_SEA, OPEN_SEA
from shipgym.tasks import read_definition

VECTOR = r"<\d+ x double>"  # as LLVM writes it
TWICE = """
import sys
import numpy as np
from shipgym.engine.compiling import compiled

sys.modules["ipykernel"] = None  # a notebook, where somebody waits

def told(numbers):
    print(numbers[0])

def twice(numbers):
    for i in range(len(numbers)):
        numbers[i] *= 2.0
    told(numbers)

compiled(twice, "void(float64[::1])", {}, "twice")(np.ones(1))
"""


def start(cache, before=""):
    return subprocess.Popen(
        [sys.executable, "-c", before + TWICE],
        env={**os.environ, "SHIPGYM_CACHE": str(cache)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def said(cache, before=""):
    """Run `twice` in a process; return what it says, but for its answer."""
    answer, said = start(cache, before).communicate(timeout=120)
    assert answer == "2.0\n"
    return said


def test_of_processes_that_start_at_once_one_compiles(tmp_path):
    workers = [start(tmp_path) for _ in range(4)]
    answers, words = zip(*[worker.communicate() for worker in workers], strict=True)
    assert answers == ("2.0\n",) * 4
    assert "".join(words).count("compiling twice") == 1
    assert len(list(tmp_path.glob("*.loop"))) == 1


def test_a_damaged_file_is_compiled_anew(tmp_path):
    assert "compiling twice" in said(tmp_path)
    (file,) = tmp_path.glob("*.loop")
    file.write_bytes(file.read_bytes()[:-100])
    assert "compiling twice" in said(tmp_path)
    assert said(tmp_path) == ""


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such limits")
def test_a_folder_that_cannot_be_written_is_said_once(tmp_path):
    full = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (500, 500))\n"
    (tmp_path / "file").write_text("")
    for cache, before in ((tmp_path, full), (tmp_path / "file" / "cache", "")):
        words = said(cache, before)
        assert words.count(": CacheWarning: ") == words.count("cannot be written") == 1
        assert "Set SHIPGYM_CACHE to a folder that can" in words
    assert not list(tmp_path.glob("*.loop"))


@pytest.mark.parametrize(
    ("task", "windy"), [("CourseKeeping", True), ("PathFollowing", False)]
)
def test_loops_over_ships_are_vectorised(task, windy, tmp_path, monkeypatch):
    monkeypatch.setenv("SHIPGYM_CACHE", str(tmp_path))  # a loop from a file shows none
    ship = shipgym.load_model("mariner-tls-svm").compiled
    sensors = shipped_sensors(windy, False, False)
    sea = OPEN_SEA if windy else CALM_SEA
    program = EpisodeProgram(ship, sea, read_definition(task), sensors, shared=True)
    (code,) = program.run.inspect_llvm().values()
    counts = [
        [
            len(re.findall(rf" = f(?:mul|add|sub) (?:contract )?{kind}", block))
            for kind in (VECTOR, "double")
        ]
        for block in re.split(r"\n\n|\n}\n", code)
    ]
    (sailing, alone), (concluding, alone_too), *_ = sorted(counts, reverse=True)
    assert sailing > 300  # the Runge-Kutta step with the ship's 40 terms
    assert concluding > 60  # reward and observations
    assert alone == alone_too == 0
