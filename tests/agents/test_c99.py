"""Exported C does what the library does; what C cannot say is refused by name."""

import ctypes
import json
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import gymnasium as gym
import numpy as np
import pytest
from typer.testing import CliRunner

from agents import (
    LQ,
    LQG,
    MPC,
    PID,
    IntegralLineOfSight,
    PreviewLQ,
    WheelOver,
)
from agents.cli import app
from agents.controllers.guided import TURNS, bend
from agents.controllers.law import Turns
from agents.export.autopilot import autopilot_source
from agents.export.ship_c99 import ShipInput, advance, ship_source
from shipgym.engine.motion import Motion
from shipgym.engine.specialise import Specialisation
from shipgym.errors import InputError
from shipgym.models import load_model
from shipgym.sea import Current, Weather
from shipgym.ships.kernel_boxes import Kernel, kernel_box
from shipgym.tasks import path_following_task
from tests.agents.bridge import Bridge
from tests.agents.compiling import built
from tests.agents.policies import MARINER, random_policy

DOCS = Path(__file__).parents[2] / "docs"
#: What no sensor gives.
NO_MEASUREMENTS = (np.nan, np.inf, -np.inf, 1e30)


def sailed(folder, model, commands, given, dt):
    """States of the exported ship, shape (n + 1, 11).

    Now and then an order that is no number is refused and changes nothing.
    """
    source = ship_source(model, "ship")
    library = built(folder, "ship", source.header, source.source)
    pointer = ctypes.c_void_p
    library.ship_step.argtypes = [pointer, pointer, ctypes.c_double]
    state, inputs, states = np.zeros(11), np.zeros(4), []
    library.ship_init(ctypes.c_void_p(state.ctypes.data))
    inputs[1:] = model.service_shaft_speed, *given
    for step, rudder in enumerate(commands):
        states.append(state.copy())
        inputs[0] = rudder
        if step % 10 == 5:
            wrong = inputs.copy()
            wrong[0] = NO_MEASUREMENTS[step % 4]
            assert library.ship_step(state.ctypes.data, wrong.ctypes.data, dt) == HELD
            for no_time in (np.nan, np.inf):
                again = library.ship_step(
                    state.ctypes.data, inputs.ctypes.data, no_time
                )
                assert again == HELD
            assert np.array_equal(state, states[-1])
        assert library.ship_step(state.ctypes.data, inputs.ctypes.data, dt) == 0
    return np.array([*states, state])


HELD = 2  # status of a ship's step that was not taken


@pytest.mark.parametrize(
    ("name", "steps", "weather", "given"),
    [
        (
            "mariner",
            10_000,
            Weather(Current(0.5, 90.0)),
            (0.5 * np.cos(np.pi / 2), 0.5),
        ),
        ("container", 300, None, (0.0, 0.0)),
    ],
    ids=["mariner in a current", "container"],
)
def test_a_ship_in_c_sails_as_the_library_does(name, steps, weather, given, tmp_path):
    model, dt = load_model(name), 1.0
    rudder = np.radians(15.0) * np.sign(np.sin(0.01 * np.arange(steps) + 0.001))
    commands = np.column_stack([rudder, np.full(steps, model.service_shaft_speed)])
    trial = model.simulate(commands[:, : len(model.command_names)], dt, weather=weather)
    found = sailed(tmp_path, model, rudder, given, dt)
    for channel in model.state_names:
        expected = trial[channel]
        error = np.abs(found[:, Motion._fields.index(channel)] - expected).max()
        assert error <= 1e-12 * np.abs(expected).max(), channel


def kernel_ship():
    """A grey box whose table is a kernel of a few centres."""
    box, random = load_model("kvlcc2-rm-svm"), np.random.default_rng(0)
    kernel = Kernel(
        np.array([0.0, 0.0, 0.0, 1.0]),
        np.full(4, 0.5),
        random.normal(size=(8, 4)),
        random.normal(size=(8, 3)),
    )
    structure = kernel_box(box.dynamics, kernel)
    numbers = 1e-3 * random.normal(size=9)
    weights = dict(zip(structure.coefficient_names, numbers, strict=True))
    return replace(box, coefficients=weights, covariance=None, dynamics=structure)


@pytest.mark.parametrize("name", ["tanker", "kvlcc2-rm-svm", "kernel"])
def test_every_kind_of_ship_is_the_same_in_c_as_in_plain_python(name, tmp_path):
    model = kernel_ship() if name == "kernel" else load_model(name)
    hooks = {**model.compiled.hooks(), "HAS_SEA": True}
    plain = Specialisation(hooks).copy(advance)
    numbers = model.ship_numbers()
    ship = hooks["load_ship"](numbers, 0)
    coefficients = hooks["load_coefficients"](numbers, 0)
    rudder, shaft = np.radians(20.0), model.service_shaft_speed
    found = sailed(tmp_path, model, [rudder] * 30, (0.1, 0.2), 1.0)
    motion = Motion(*found[0].tolist())
    given = ShipInput(rudder, shaft, 0.1, 0.2)
    for row in found[1:]:
        motion = plain(motion, given, 1.0, coefficients, ship)
        np.testing.assert_allclose(row, motion, rtol=1e-12, atol=1e-15)


class Speeds(NamedTuple):
    """Parameters of `slowing`."""

    gain: float
    speed: float  # m/s


class Last(NamedTuple):
    """What `slowing` remembers."""

    order: float
    started: float


def slowing(seen, memory, p):
    """A user's law: more rudder for a slower ship, half of it at once."""
    slower = np.where(seen.surge > 0.1, p.speed / seen.surge, 1.0)
    order = p.gain * slower * slower * (seen.heading_error - 10.0 * seen.yaw_rate)
    mean = np.where(memory.started > 0.0, 0.5 * (order + memory.order), order)
    return mean, Last(mean, 1.0)


@dataclass(frozen=True, eq=False)
class Slowing(PID):
    """A user's controller with a law of its own."""

    kind = "slowing"
    law = staticmethod(slowing)
    memory_record = Last
    reads = ("yaw_rate", "surge")

    @property
    def parameters(self):
        return Speeds(self.gains["proportional"], 7.7)


def every_number():
    """LQ with preview in which every number has an effect, heel among them."""
    ship = load_model("container-4dof-output-error")
    return PreviewLQ.from_model(
        ship,
        autopilot=LQ.from_model(ship, rudder_time=0.1, rudder_band_deg=0.5),
        task=path_following_task(roll=True),
        course_share=0.4,
        current_time=1.0,
        dead_band_deg=0.3,
        reach_power=0.5,
        roll_gain=0.3,
        roll_time=0.2,
        speed_power=0.5,
        sway_gain=0.3,
        weight_2=0.2,
        weight_3=-0.1,
        weight_4=-0.05,
        yaw_time=0.1,
    )


#: Controllers, and whether C gives the same numbers bit for bit.
HEADING = {
    "pid": PID.from_model(MARINER),
    "lq": LQ.from_model(MARINER),
    "lqg": LQG.from_model(MARINER),
    "lqg_in_waves": LQG.from_model(MARINER, wave_period=9.0),
    "quiet_lq": LQ.from_model(MARINER, rudder_time=0.1, rudder_band_deg=1.0),
    "my_own": Slowing(**vars(PID.from_model(MARINER))),
}
GUIDANCE = {
    "ilos": IntegralLineOfSight.from_model(MARINER),
    "ilos_pid": IntegralLineOfSight.from_model(
        MARINER, autopilot=PID.from_model(MARINER)
    ),
    "wheel_over": WheelOver.from_model(MARINER),
    "preview": PreviewLQ.from_model(MARINER),
    "preview_all": every_number(),
}
SIZES = {
    "heading": 0.1,
    "set_point": 0.3,
    "yaw_rate": 0.01,
    "sway": 1.0,
    "surge": 8.0,
    "rudder": 0.3,
    "cross_track": 200.0,
    "next_turn_distance": 500.0,
    "second_turn_distance": 900.0,
}


def orders(agent, name, folder, steps):
    """Orders of an autopilot in C and in the library, for the same random numbers.

    A tenth of the measurements has an input that is none: C repeats the last order and
    says so, and goes on as the library does, which has not been given them.
    """
    source, bridge = autopilot_source(agent, name), Bridge(agent)
    head = f"int status_of(const {name}_state *state)"
    more = f"{head};\n{head} {{ return state->status; }}\n"
    library = built(folder, name, source.header, source.source + more)
    state = ctypes.create_string_buffer(10_000)
    step = getattr(library, f"{name}_step")
    step.restype, step.argtypes = ctypes.c_double, [ctypes.c_void_p, ctypes.c_void_p]
    getattr(library, f"{name}_init")(state)

    names = list(source.inputs)
    sizes = [SIZES.get(one, 0.5) for one in names]
    numbers = np.random.default_rng(0).normal(0.0, sizes, (steps, len(names)))
    numbers[:, names.index("set_point")] = 0.4 * (np.arange(steps) % 600 > 300)
    if "next_turn_angle" in names:
        numbers[::3, names.index("next_turn_angle")] = 0.0  # no turn ahead

    in_c, here = [], [0.0]
    for k, row in enumerate(numbers):
        wrong = k % 10 == 7 or k < len(NO_MEASUREMENTS)
        if wrong:
            row[k // 10 % len(names)] = NO_MEASUREMENTS[k % 4]
            here.append(here[-1])
        else:
            here.append(bridge.step(dict(zip(names, row.tolist(), strict=True))))
        in_c.append(step(state, row.ctypes.data))
        assert library.status_of(state) == wrong
    return np.array(in_c), np.array(here[1:])


@pytest.mark.parametrize("name", HEADING)
def test_a_heading_autopilot_in_c_is_the_law_in_python_bit_by_bit(name, tmp_path):
    in_c, here = orders(HEADING[name], name, tmp_path, 2000)
    assert np.array_equal(in_c, here)
    assert np.ptp(here) > 0.5


@pytest.mark.parametrize("name", GUIDANCE)
def test_guidance_in_c_is_the_law_in_python_to_the_last_digits(name, tmp_path):
    """NumPy's arc tangent is not that of every C library."""
    in_c, here = orders(GUIDANCE[name], name, tmp_path, 2000)
    np.testing.assert_allclose(in_c, here, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("agent", [HEADING["lq"], HEADING["lqg"]], ids=["lq", "lqg"])
def test_an_autopilot_orders_what_the_controller_commands_in_the_environment(agent):
    env = gym.make("shipgym/CourseKeeping-v0", model="mariner")
    seen, _ = env.reset(seed=3)
    names, scales = env.unwrapped.observation_names, env.unwrapped.observation_scales
    bridge, state = Bridge(agent), None
    for step in range(60):
        physical = dict(zip(names, seen * scales, strict=True))
        error = np.arctan2(seen[0], seen[1])
        given = {**physical, "set_point": error, "heading": 0.0}
        order = bridge.step({one: given[one] for one in bridge.inputs})
        action, state = agent.predict(seen, state, step == 0)
        # observations are single
        assert order / bridge.limit == pytest.approx(action[0], abs=2e-5)
        seen, *_ = env.step(action)


@pytest.mark.parametrize("kind", [WheelOver, MPC, IntegralLineOfSight])
def test_guidance_orders_what_it_commands_along_a_path(kind):
    """Its inputs are those of a bridge: path direction and course over ground."""
    env = gym.make("shipgym/PathFollowing-v0", model="mariner", max_turn_deg=60.0)
    agent = kind.from_model(MARINER, task=env.unwrapped.task)
    seen, _ = env.reset(seed=3)
    names, scales = env.unwrapped.observation_names, env.unwrapped.observation_scales
    half, radius = 0.5 * agent.gains["task_lookahead"], agent.gains.get("path_radius")
    bridge, state = Bridge(agent), None
    for step in range(60 if kind is MPC else 250):
        told = dict(zip(names, seen.astype(float) * scales, strict=True))
        shown = np.arctan2(seen[0], seen[1])  # the ship heading to the north
        over_ground = shown - np.arctan2(
            told["course_error_sin"], told["course_error_cos"]
        )
        direction = shown + np.arctan2(told["cross_track"], 2.0 * half)
        if radius is not None:
            direction -= bend(half, Turns(*(told[name] for name in TURNS)), radius)
        told |= {"set_point": direction, "heading": 0.0, "course": over_ground}
        order = bridge.step({one: told[one] for one in bridge.inputs})
        action, state = agent.predict(seen, state, step == 0)
        assert order / bridge.limit == pytest.approx(action[0], abs=2e-5)
        seen, *_ = env.step(action)


@pytest.mark.parametrize(
    ("agent", "message"),
    [
        (
            MPC.from_model(MARINER),
            "closed-form law.*got 'mpc'; closed-form are 'pid', 'lq'.*'wheel-over'",
        ),
        (random_policy(), "got 'learned'.*a learned policy leaves as ONNX"),
    ],
    ids=["mpc", "learned"],
)
def test_what_is_no_closed_law_is_refused(agent, message):
    with pytest.raises(InputError, match=message):
        autopilot_source(agent)


@pytest.mark.parametrize("kind", [PID, LQ])
def test_gains_by_speed_say_what_to_give_where_no_speed_is_measured(kind):
    """The service speed, for which the gains are; without a schedule nothing."""
    surge = autopilot_source(kind.from_model(MARINER)).inputs["surge"]
    assert surge.start == MARINER.particulars["speed"]
    assert surge.meaning.endswith(f"where it is not measured {surge.start:.4g}")
    same = autopilot_source(kind.from_model(MARINER, schedule=0.0))
    assert "surge" not in same.inputs


@pytest.mark.parametrize("name", ["9lives", "double", "é", "x" * 32])
def test_a_name_that_c_does_not_take_is_refused(name):
    with pytest.raises(InputError, match=r"name: expected at most 31 letters.*--name"):
        autopilot_source(HEADING["pid"], name)


def test_the_command_writes_c_and_says_what_it_cannot(tmp_path):
    HEADING["pid"].save(tmp_path / "pid.json")
    run = CliRunner().invoke
    found = run(
        app, ["export", str(tmp_path / "pid.json"), "--c", str(tmp_path / "out")]
    )
    assert found.exit_code == 0, found.output
    assert sorted(one.name for one in (tmp_path / "out").iterdir()) == [
        "pid.c",
        "pid.h",
    ]
    for what, name in ((tmp_path / "pid.json", "helm"), ("mariner", "hull")):
        found = run(
            app,
            [
                "export",
                str(what),
                "--c",
                str(tmp_path / name),
                "--name",
                name,
                "--json",
            ],
        )
        written = sorted(one.name for one in (tmp_path / name).iterdir())
        assert (found.exit_code, written) == (0, [f"{name}.c", f"{name}.h"])
        assert json.loads(found.stdout) == {"written": [str(tmp_path / name)]}
    found = run(app, ["export", "mariner", "--c", str(tmp_path)])
    assert (found.exit_code, (tmp_path / "mariner.c").exists()) == (
        2,
        False,
    )  # a folder with other files
    for said, *arguments in (
        ("nothing to write: give --c FOLDER", "mariner"),
        ("Did you mean 'mariner'", "marinr", "--c", tmp_path / "no"),
        (
            "--depth: expected with --c or --fmu",
            "mariner",
            "--onnx",
            tmp_path / "no",
            "--depth",
            9,
        ),
        (
            "agent: expected a file",
            "mariner",
            "--c",
            tmp_path / "no",
            "--onnx",
            tmp_path / "no.onnx",
        ),
        (
            "its folder does not exist or cannot be written",
            "mariner",
            "--c",
            tmp_path / "no",
            "--fmu",
            tmp_path / "a" / "no.fmu",
        ),
        (
            "name that ends in .fmu",
            "mariner",
            "--c",
            tmp_path / "no",
            "--fmu",
            tmp_path / "no.zip",
        ),
        (
            "--depth: expected none for an autopilot, got 9",
            tmp_path / "pid.json",
            "--c",
            tmp_path / "no",
            "--depth",
            9,
        ),
    ):
        found = run(app, ["export", *map(str, arguments)])
        assert found.exit_code == 2
        assert said in " ".join(found.output.split())
        assert not (tmp_path / "no").exists()


def test_numbers_in_c_carry_their_names_units_and_limits():
    agent = HEADING["lq"]
    lq = autopilot_source(agent, "lq")
    gain = repr(agent.parameters.gains.heading_error)
    assert f".heading_error = {gain},\n" in lq.source
    assert "heading_error; /* rad/rad */" in lq.header
    assert "; /* rad/s, to starboard positive; at most 100 */" in lq.header
    assert f'LQ_MODEL_SHA256 "{agent.model_sha256}"' in lq.header
    assert f"LQ_RUDDER_LIMIT {bridge_limit(agent)!r} /* rad" in lq.header

    ship = ship_source(MARINER, "ship")
    assert re.search(r"\.vdot_v = \(-0\.", ship.source)
    assert re.search(r"\.rudder_rate = 0\.087\d+,", ship.source)
    for note in ("vdot_v; /* of v U^1 in ", "vvr; /* of vvr U^-1 in ", "/* rad/s */"):
        assert note in ship.header
    assert not re.search(r"\bc\.c\d+\b", ship.source)
    assert f'SHIP_MODEL_SHA256 "{agent.model_sha256}"' in ship.header
    grey = ship_source(load_model("kvlcc2-rm-svm"), "ship")
    assert not re.search(r"\bc\.c\d+\b", grey.source)


def bridge_limit(agent):
    return Bridge(agent).limit


def test_a_hash_that_is_none_does_not_become_c():
    agent = replace(HEADING["pid"], model_sha256='"; int main(void) { /*')
    assert 'PID_MODEL_SHA256 "unknown"' in autopilot_source(agent, "pid").header


def test_the_control_loop_of_the_page_compiles(tmp_path):
    page = (DOCS / "howto" / "control_loop.md").read_text(encoding="utf-8")
    (loop,) = re.findall(r"```c\n(.*?)```", page, re.DOTALL)
    source = autopilot_source(HEADING["lq"], "lq")
    stubs = """
bool read_sensors(lq_input *measured) { return measured != NULL; }
bool helmsman_wants_autopilot(void) { return true; }
void send_to_gear(double order_rad) { (void)order_rad; }
void hand_over(void) {}
void wait_for_next_interval(double seconds) { (void)seconds; }
void control_loop(void);
"""
    program = built(tmp_path, "lq", source.header, source.source + loop + stubs)
    assert program.control_loop
