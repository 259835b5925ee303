"""FMUs are valid for FMPy and simulate as the library does."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree
from zipfile import ZipFile

import fmpy
import numpy as np
import pytest
from fmpy import fmi2, validation

from agents import LQ, WheelOver
from agents.export import fmu
from agents.export.autopilot_c99 import autopilot_source
from agents.export.fmu import write_fmu
from agents.export.ship_c99 import ship_source
from shipgym.errors import InputError
from shipgym.sea import Current, Weather, Wind
from shipgym.tasks.task import Task
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
        "wind_speed": 8.0,
        "wind_from": 0.5,
    }
    found = run(path, inputs, inputs.values(), start_values={"u": 7.0})
    weather = Weather(Current(0.5, 90.0), Wind(8.0, np.degrees(0.5), gust=False))
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


def known(path):
    """Variables of an FMU by name."""
    description = fmpy.read_model_description(str(path))
    return {one.name: one for one in description.modelVariables}


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


@pytest.fixture(scope="module")
def logged(tmp_path_factory):
    """An instance of a ship, and the messages that it logs."""
    path = tmp_path_factory.mktemp("logged") / "ship.fmu"
    write_fmu(ship_source(MARINER, "ship"), path)
    messages = []

    def write(*arguments):
        status, category, message = arguments[-3:]
        messages.append((status, category.decode(), message.decode()))

    given = {
        "guid": fmpy.read_model_description(str(path)).guid,
        "modelIdentifier": "ship",
        "unzipDirectory": fmpy.extract(str(path)),
    }
    functions = fmi2.fmi2CallbackFunctions()
    functions.logger = fmi2.fmi2CallbackLoggerTYPE(write)
    unit = fmi2.FMU2Slave(**given)
    unit.instantiate(callbacks=functions)
    unit.setupExperiment()
    another = fmi2.FMU2Slave(**(given | {"guid": "another"}))
    unit.refused = lambda: another.instantiate(callbacks=functions)
    yield unit, known(path), messages
    unit.freeInstance()


WRONG = {
    "unknown variable": (
        lambda u, k: u.setReal([999], [0.0]),
        "expected 0 to .*got 999",
    ),
    "no number": (
        lambda u, k: u.setReal([k["rudder"].valueReference], [np.nan]),
        "rudder: expected a finite number, got",
    ),
    "time": (
        lambda u, k: u.setReal([0], [1.0]),
        "time: expected to be set by the steps",
    ),
    "backwards": (lambda u, k: u.doStep(0.0, -1.0), "expected a finite time.*got 0 s"),
    "integer": (lambda u, k: u.getInteger([1]), "fmi2GetInteger: this FMU does not"),
    "another": (lambda u, k: u.refused(), "token: expected .*got another; the model"),
    "lost": (
        lambda u, k: (u.setReal([k["u"].valueReference], [900.0]), u.doStep(0.0, 1.0)),
        "the ship has run away or capsized",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_why_a_function_of_an_fmu_fails_is_logged(name, logged):
    unit, variables, messages = logged
    call, reason = WRONG[name]
    messages.clear()
    with pytest.raises(Exception):  # noqa: B017, PT011 - FMPy's, of several kinds
        call(unit, variables)
    ((status, category, message),) = messages
    assert (status, category) == (3, "logStatusError")
    assert re.search(reason, message)


OSP = Path(__file__).parents[2] / "examples" / "osp" / "OspSystemStructure.xml"


@pytest.fixture
def osp(tmp_path):
    """Folder of the example of the Open Simulation Platform with its FMUs."""
    pilot = autopilot_source(LQ.from_model(MARINER), "pilot")
    write_fmu(ship_source(MARINER, "ship"), tmp_path / "ship.fmu")
    write_fmu(pilot, tmp_path / "pilot.fmu")
    shutil.copy(OSP, tmp_path)
    return tmp_path


def test_the_osp_example_names_variables_that_there_are(osp):
    space = {"": "http://opensimulationplatform.com/MSMI/OSPSystemStructure"}
    structure = ElementTree.parse(osp / OSP.name)
    variables = {}
    for one in structure.iterfind(".//Simulator", space):
        variables[one.get("name")] = known(osp / one.get("source"))
        for value in one.iterfind(".//InitialValue", space):
            assert value.get("variable") in variables[one.get("name")]
    connected = list(structure.iterfind(".//VariableConnection", space))
    for output, given in connected:
        units = set()
        for end, causality in ((output, "output"), (given, "input")):
            variable = variables[end.get("simulator")][end.get("name")]
            assert variable.causality == causality
            units.add(variable.unit)
        assert len(units) == 1
    assert {one.get("name") for _, one in connected} == {
        *(name for name in ("heading", "yaw_rate", "sway", "rudder"))
    }


def test_libcosim_runs_the_osp_example(osp):
    execution_module = pytest.importorskip("libcosimpy.CosimExecution")
    observer_module = pytest.importorskip("libcosimpy.CosimObserver")
    execution = execution_module.CosimExecution.from_osp_config_file(str(osp))
    observer = observer_module.CosimObserver.create_last_value()
    execution.add_observer(observer)
    assert execution.simulate_until(300 * 10**9)
    ship = execution.slave_index_from_instance_name("ship")
    names = {
        one.name.decode(): one.reference for one in execution.slave_variables(ship)
    }
    (heading,) = observer.last_real_values(ship, [names["psi"]])
    assert heading == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize("name", [signal.SIGTERM, signal.SIGKILL])
def test_a_killed_export_leaves_nothing_half_written(name, tmp_path):
    compiler = tmp_path / "slow"
    compiler.write_text("#!/bin/sh\nsleep 20\n")
    compiler.chmod(0o700)
    out = tmp_path / "out"
    out.mkdir()
    command = ["export", "mariner", "--fmu", f"{out}/ship.fmu", "--name", "ship"]
    process = subprocess.Popen(
        [sys.executable, "-m", "agents.cli", *command],
        env={**os.environ, "CC": str(compiler)},
        start_new_session=True,
    )
    while not list(out.glob(".*/ship.c")):
        assert process.poll() is None
        time.sleep(0.05)
    process.send_signal(name)
    code = process.wait()
    left = list(out.iterdir())
    if name == signal.SIGTERM:
        assert (code, left) == (130, [])
    else:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, name)  # its compiler
        assert all(one.name.endswith(".draft") for one in left)
    write_fmu(ship_source(MARINER, "ship"), out / "ship.fmu")
    assert [one.name for one in out.iterdir()] == ["ship.fmu"]


@pytest.mark.parametrize(
    ("name", "better"),
    [("fmu", "fmu.fmu"), ("a.FMU", "a.fmu"), ("b.c", "b.fmu")],
)
def test_an_fmu_of_another_ending_is_refused_with_a_better_name(name, better, tmp_path):
    with pytest.raises(InputError, match=f"ends in .fmu.*; call it {better}$"):
        write_fmu(autopilot_source(PILOTS["lq"], "lq"), tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_names_of_c_that_an_fmu_has_itself(tmp_path):
    pilot = autopilot_source(PILOTS["lq"], "fmu")
    write_fmu(pilot, tmp_path / "fmu.fmu")
    assert validation.validate_fmu(str(tmp_path / "fmu.fmu")) == []
    with pytest.raises(
        InputError, match="name: expected another than that of a header"
    ):
        write_fmu(autopilot_source(PILOTS["lq"], "fmi2Functions"), tmp_path / "a.fmu")
