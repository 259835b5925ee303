"""A manoeuvre of a user's own, given by one file outside the package."""

import importlib.util
import json

import pytest
from typer.testing import CliRunner

from agents.cli import app
from shipgym import load_model, manoeuvres
from shipgym.manoeuvres.standard import FAMILIES

PARALLEL_SHIFT = '''
"""The parallel course manoeuvre.

Rudder over, then as much to the other side, then amidships.
"""

from dataclasses import dataclass

import numpy as np

from shipgym import manoeuvres


@dataclass(frozen=True)
class ShiftIndices:
    shift_lengths: float
    heading_change_deg: float


def parallel_shift(model, rudder_deg=10.0, water_depth=np.inf):
    travel = model.particulars["length"] / model.particulars["speed"]
    dt = travel / 50
    rudder = np.radians(rudder_deg) * np.repeat([1.0, -1.0, 0.0], [100, 100, 50])
    commands = np.repeat(model.service_command[None], len(rudder), axis=0)
    commands[:, 0] = rudder
    return model.simulate(commands, dt)


def shift_indices(trial):
    lengths = trial["y"][-1] / trial.length
    return ShiftIndices(lengths, float(np.degrees(trial["psi"][-1])))


def variants(model):
    return {"parallel shift to starboard": manoeuvres.Manoeuvre(
        parallel_shift, shift_indices, ShiftIndices, "Heading and rudder in degrees.")}


manoeuvres.register_manoeuvre("shifts", variants, "Parallel courses")
'''


@pytest.fixture
def shifts(tmp_path):
    path = tmp_path / "parallel_shift.py"
    path.write_text(PARALLEL_SHIFT)
    spec = importlib.util.spec_from_file_location("parallel_shift", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    yield module
    del FAMILIES["shifts"]


def test_a_manoeuvre_from_a_folder_of_ones_own_is_sailed_and_reported(shifts, tmp_path):
    page = tmp_path / "page.html"
    command = [
        "trials",
        "mariner-tls-svm",
        "--draws",
        "3",
        "--json",
        "--out",
        str(page),
    ]
    answer = CliRunner().invoke(app, command)
    assert answer.exit_code == 0, answer.stderr
    found = json.loads(answer.stdout)["manoeuvres"]["parallel shift to starboard"]
    assert found["shift_lengths"]["value"] > 0.5
    low, high = found["shift_lengths"]["interval_95"]
    assert low < found["shift_lengths"]["value"] < high
    assert "Parallel courses" in page.read_text()
    assert "Heading and rudder in degrees." in page.read_text()


def test_the_documentation_names_every_manoeuvre():
    from pathlib import Path

    text = (Path(__file__).parents[2] / "docs" / "manoeuvres.md").read_text(
        encoding="utf-8"
    )
    for name in manoeuvres.standard_manoeuvres(load_model("tanker")):
        assert name in text
