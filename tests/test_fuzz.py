"""The fuzz finds what is wrong with a reader, and nothing with those of this project.

`make fuzz` reads many more; a fault that it finds gets a test beside the reader.
"""

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path
from random import Random

import numpy as np
import openpyxl
import pytest
from fuzzing import reading
from fuzzing.reading import Kind, run_kind

from shipgym.errors import InputError
from shipgym.files import read_json
from shipgym.trials.guesses import guess_trial

ROOT = Path(__file__).parents[1]
INPUTS = 2000  # of the fast kinds


@pytest.fixture
def corpus(tmp_path, monkeypatch):
    """A corpus of one file."""
    (tmp_path / "planted").mkdir()
    (tmp_path / "planted" / "a.json").write_text(
        json.dumps({"length": 3.0, "names": ["x", "y"], "tables": {"b": 1}})
    )
    monkeypatch.setattr(reading, "CORPUS", tmp_path)


def read(path):
    return read_json(path, "planted file", "plant another")


def when(path, harm):
    if not isinstance(read(path).get("tables"), dict):
        harm()


def endless():
    while True:
        pass


def test_a_reader_that_does_not_check_is_found(corpus):
    report = run_kind(
        Kind("planted", lambda path: 1.0 / float(read(path)["length"])), 400, 0
    )
    assert report.inputs == 400
    assert report.read > 50
    assert report.refused > 50
    kinds = {what.split()[0] for what in report.faults}
    assert {"KeyError", "TypeError", "ValueError"} <= kinds


@pytest.mark.parametrize(
    ("harm", "told"),
    [
        (endless, "HangError"),
        (lambda: bytes(2**31), "MemoryError"),
        (lambda: os._exit(7), "process died with 7"),
    ],
    ids=["endless", "large", "dead"],
)
def test_a_hang_a_bomb_and_the_death_of_the_process_are_found(
    harm, told, corpus, monkeypatch
):
    monkeypatch.setattr(reading, "LONGEST_S", 0.2)
    report = run_kind(Kind("planted", lambda path: when(path, harm)), 12, 0)
    assert any(
        told in what or told in one.message for what, one in report.faults.items()
    )


def test_a_refusal_must_be_fit_to_print(corpus):
    def refuse():
        raise InputError("\ud800")

    report = run_kind(Kind("planted", lambda path: when(path, refuse)), 40, 0)
    assert any("cannot be printed" in what for what in report.faults)


def test_every_kind_of_file_is_read_or_refused():
    command = [sys.executable, "scripts/fuzz.py", f"--inputs={INPUTS}", "--workers=1"]
    done = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_integers_of_spreadsheets_are_numbers_or_refused(tmp_path):
    draw = Random(38)
    path = tmp_path / "log.xlsx"
    for _ in range(15):
        book = openpyxl.Workbook()
        book.active.append(["t", "psi", "r", "delta"])
        for k in range(20):
            book.active.append([k, 30 + k % 7, 1, k % 3])
        book.active.cell(draw.randint(2, 20), draw.randint(1, 4)).value = 777
        book.save(path)
        with_integer(path, draw.choice(["1", "-1"]) + "0" * draw.randint(1, 5000))
        said, read = read_or_refused(path)
        assert all(np.isfinite(values).all() for values in read)
        assert read or str(path) in said


def read_or_refused(path):
    """What a refusal says, and the channels that were read."""
    try:
        guess = guess_trial(path)
    except InputError as refusal:
        return str(refusal), []
    if guess.trial is None:
        return str(guess.decisions), []
    return "", list(guess.trial.channels.values())


def with_integer(path, digits):
    """Replace the cell of 777 in a workbook."""
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w") as archive:
        for name, part in parts.items():
            archive.writestr(name, part.replace(b"<v>777<", f"<v>{digits}<".encode()))
