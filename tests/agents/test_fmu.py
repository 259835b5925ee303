"""FMUs are valid for FMPy and simulate as the library does."""

from dataclasses import replace
from zipfile import ZipFile

import fmpy
import numpy as np
import pytest
from fmpy import validation

from agents import LQ, WheelOver
from agents.export import fmu
from agents.export.autopilot import autopilot_source
from agents.export.fmu import write_fmu
from agents.export.ship_c99 import ship_source
from shipgym.errors import InputError
from shipgym.sea import Current, Weather
from shipgym.tasks import Task
from tests.agents.bridge import Bridge
from tests.agents.policies import MARINER

DT, STEPS = 0.5, 200
RUDDER = np.radians(20.0)


def run(path, names, values, **more):
    """Outputs of an FMU with inputs that stay."""
    given = np.array(
        [(0.0, *values)], dtype=[("time", float), *((name, float) for name in names)]
    )
    return fmpy.simulate_fmu(
        str(path),
        input=given,
        stop_time=STEPS * DT,
        step_size=DT,
        output_interval=DT,
        validate=True,
        **more,
    )


def test_a_ship_turns_as_in_the_library(tmp_path):
    path = tmp_path / "ship.fmu"
    write_fmu(ship_source(MARINER, "ship"), path)
    assert validation.validate_fmu(str(path)) == []
    inputs = {
        "rudder": RUDDER,
        "current_north": 0.0,
        "current_east": 0.5,
    }
    found = run(path, inputs, inputs.values(), start_values={"u": 7.0})
    weather = Weather(Current(0.5, 90.0))
    start = MARINER.service_state.copy()
    start[MARINER.state_names.index("u")] = 7.0
    commands = np.full((STEPS, 1), RUDDER)
    trial = MARINER.simulate(commands, DT, state=start, weather=weather)
    for name in MARINER.state_names:
        np.testing.assert_allclose(found[name], trial[name], rtol=1e-9, atol=1e-9)


BY_A_BRIDGE = {
    "set_point": 0.1,
    "heading": 0.02,
    "yaw_rate": 0.001,
    "sway": 0.1,
    "surge": 7.5,
    "rudder": 0.05,
    "cross_track": 30.0,
    "course": 0.05,
    "next_turn_distance": 200.0,
    "next_turn_angle": 0.6,
    "second_turn_distance": 2000.0,
    "second_turn_angle": -0.4,
}
ALONG_ARCS = Task.of("PathFollowing", dt=2 * DT)
PILOTS = {
    "lq": LQ.from_model(MARINER, dt=2 * DT),
    "wheel_over": WheelOver.from_model(MARINER, task=ALONG_ARCS),
}


@pytest.mark.parametrize("name", PILOTS)
def test_an_autopilot_decides_once_in_each_of_its_intervals(name, tmp_path):
    agent, path = PILOTS[name], tmp_path / f"{name}.fmu"
    source = autopilot_source(agent, name)
    write_fmu(source, path)
    given = {one: BY_A_BRIDGE[one] for one in source.inputs}
    found, bridge = run(path, given, given.values()), Bridge(agent)
    orders = np.repeat([bridge.step(given) for _ in range(STEPS // 2)], 2)
    np.testing.assert_allclose(found["order"][1:], orders, rtol=0.0, atol=1e-12)


def test_what_is_in_the_way_and_what_is_missing_is_said(tmp_path, monkeypatch):
    source = autopilot_source(LQ.from_model(MARINER), "lq")
    (tmp_path / "lq.fmu").mkdir()
    with pytest.raises(
        InputError, match=r"lq\.fmu: expected a file to write to, got a folder"
    ):
        write_fmu(source, tmp_path / "lq.fmu")
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(InputError, match="compiler: expected gcc on Linux"):
        write_fmu(source, tmp_path / "other.fmu")
    assert not (tmp_path / "other.fmu").exists()
    with pytest.raises(
        InputError, match=r"lq\.zip: expected a name that ends in \.fmu"
    ):
        write_fmu(source, tmp_path / "lq.zip")
    monkeypatch.setenv("CC", "false")  # a program that fails
    with pytest.raises(InputError, match="false: cannot compile the FMU: "):
        write_fmu(source, tmp_path / "other.fmu")
    monkeypatch.setattr(fmu, "find_spec", lambda name: None)
    with pytest.raises(
        InputError, match=r"fmpy is not installed, .*pip install 'shipgym\[fmu\]'"
    ):
        write_fmu(source, tmp_path / "other.fmu")
    assert [one.name for one in tmp_path.iterdir()] == ["lq.fmu"]


@pytest.mark.parametrize(
    ("machine", "folder"), [("x86_64", "linux64"), ("aarch64", "aarch64-linux")]
)
def test_a_binary_stands_where_the_standard_has_it_beside_its_sources(
    machine, folder, tmp_path, monkeypatch
):
    """Written twice it is the same to the byte."""
    monkeypatch.setattr(fmu.platform, "machine", lambda: machine)
    monkeypatch.setattr(fmu, "_compiled", lambda *_: b"binary")
    source = autopilot_source(PILOTS["lq"], "lq")
    for name in ("one.fmu", "two.fmu"):
        write_fmu(source, tmp_path / name)
    assert (tmp_path / "one.fmu").read_bytes() == (tmp_path / "two.fmu").read_bytes()
    with ZipFile(tmp_path / "one.fmu") as archive:
        assert archive.read(f"binaries/{folder}/lq.so") == b"binary"
        names = set(archive.namelist())
        assert archive.read("sources/lq.c").decode() == source.source
    assert {"modelDescription.xml", "sources/lq_fmi.c", "sources/lq.h"} < names


def test_the_description_has_base_units_and_the_users_letters(tmp_path):
    path = tmp_path / "pilot.fmu"
    name = "Elise <\"&'> Großsegler \x00 ]]>"
    write_fmu(autopilot_source(replace(PILOTS["lq"], model_name=name)), path)
    assert validation.validate_fmu(str(path)) == []
    description = fmpy.read_model_description(str(path))
    assert "Elise <\"&'> Großsegler <U+0000> ]]>" in description.description
    bases = {one.name: one.baseUnit for one in description.unitDefinitions}
    assert (bases["rad/s"].m, bases["rad/s"].s, bases["rad/s"].rad) == (0, -1, 1)
    units = {one.unit for one in description.modelVariables} - {None}
    assert units <= bases.keys()


@pytest.mark.parametrize(
    ("name", "better"),
    [("fmu", "fmu.fmu"), ("a.FMU", "a.fmu"), ("b.c", "b.fmu")],
)
def test_an_fmu_of_another_ending_is_refused_with_a_better_name(name, better, tmp_path):
    with pytest.raises(InputError, match=f"ends in .fmu.*; call it {better}$"):
        write_fmu(autopilot_source(PILOTS["lq"], "lq"), tmp_path / name)
    assert not list(tmp_path.iterdir())
