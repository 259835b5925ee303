"""The fuzz finds what is wrong with a reader, and nothing with those of this project.

`make fuzz` reads many more; a fault that it finds gets a test beside the reader.
"""

import json
import math
import os
import subprocess
import sys
import time
import zipfile
from contextlib import suppress
from pathlib import Path
from random import Random

import openpyxl
import pytest
from fuzzing import processes, reading
from fuzzing.mutations import mutate
from fuzzing.processes import chunks, run
from fuzzing.reading import Kind

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


def found(read, inputs=400):
    kinds = {"planted": Kind("planted", read)}
    report = run(
        kinds, chunks(kinds.values(), inputs), 0, 1, math.inf, lambda one: None
    )["planted"]
    assert report.inputs == inputs
    return report


def read(path):
    return read_json(path, "planted file", "plant another")


def test_a_field_that_nobody_checked_is_found_with_the_one_change_that_matters(corpus):
    def unchecked(path):
        return 1.0 / float(read(path)["length"])

    report = found(unchecked)
    assert report.read > 50
    assert report.refused > 50
    kinds = {what.split()[0] for what in report.findings}
    assert {"KeyError", "TypeError", "ValueError"} <= kinds
    missing = next(
        one for what, one in report.findings.items() if what.startswith("KeyError")
    )
    assert len(missing.edits) == 1
    assert "length" not in json.loads(missing.files["a.json"])


def when(path, harm):
    if not isinstance(read(path).get("tables"), dict):
        harm()


def test_a_hang_a_bomb_and_the_death_of_the_process_are_found(corpus, monkeypatch):
    monkeypatch.setattr(reading, "LONGEST_S", 0.2)
    monkeypatch.setattr(reading, "LONGEST_WAIT_S", 0.5)
    monkeypatch.setattr(processes, "STUCK_S", 3.0)

    def hang():
        while True:
            pass

    for harm, told in (
        (hang, "HangError"),
        (lambda: time.sleep(60.0), "HangError"),
        (lambda: bytes(2**31), "MemoryError"),
        (lambda: os._exit(7), "process died with 7"),
    ):
        report = found(lambda path, harm=harm: when(path, harm), 30)
        assert any(told in what for what in report.findings), told


def test_a_refusal_must_be_fit_to_read(corpus):
    def surrogates(path):
        raise InputError(f"{path}: \ud800 found")

    def pages(path):
        error = InputError("x")
        error.args = ("x" * 10_000,)
        raise error

    for refuse, told in (
        (surrogates, "cannot be printed"),
        (pages, "more than 5000 characters"),
    ):
        report = found(lambda path, refuse=refuse: when(path, lambda: refuse(path)), 40)
        assert any(told in what for what in report.findings)


def test_the_same_seed_makes_the_same_inputs_in_any_number_of_processes(
    corpus, tmp_path, monkeypatch
):
    def sizes(workers, seed):
        kinds = {"planted": Kind("planted", lambda path: 1.0 / read(path)["length"])}
        report = run(
            kinds,
            chunks(kinds.values(), 1200),
            seed,
            workers,
            math.inf,
            lambda one: None,
        )["planted"]
        return (
            report.read,
            report.refused,
            {what: one.count for what, one in report.findings.items()},
        )

    assert sizes(1, 0) == sizes(3, 0) != sizes(1, 1)
    monkeypatch.setattr(
        processes, "LARGEST_MIB", 0
    )  # a process is replaced after each chunk
    assert sizes(3, 0) == sizes(1, 0)


@pytest.mark.parametrize(
    "name", ["a.json", "a.toml", "a.csv", "a.safetensors", "a.bin"]
)
def test_a_change_is_a_function_of_what_it_is_drawn_from(name):
    corpus = ROOT / "tests" / "corpus"
    seeds = {
        path.suffix: path.read_bytes()
        for path in sorted(corpus.rglob("*"))
        if path.is_file()
    }
    content = seeds.get(Path(name).suffix, b"some bytes")
    changed = {mutate(Random(k), name, content)[0] for k in range(100)}
    assert len(changed) > 60
    assert all(mutate(Random(k), name, content)[0] in changed for k in range(100))


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
        with suppress(InputError):
            guess_trial(path)


def with_integer(path, digits):
    """Replace the cell of 777 in a workbook."""
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w") as archive:
        for name, part in parts.items():
            archive.writestr(name, part.replace(b"<v>777<", f"<v>{digits}<".encode()))
