"""The exported C does what the library does, and what cannot be written as C is refused by name."""

import ctypes
import json
import math
import subprocess
from dataclasses import replace
from typing import NamedTuple

import gymnasium as gym
import numpy as np
import pytest
from typer.testing import CliRunner

from agents import (
    LQ,
    LQG,
    PID,
    FilteredPID,
    IntegralLineOfSight,
    PreviewMPC,
    ScheduledLQ,
    Shielded,
    TurnRate,
    WheelOver,
    load_agent,
)
from agents.cli import app
from agents.controllers.adaptive_lq import AdaptiveLQ
from agents.controllers.los_autopilot import AdaptiveLineOfSight
from agents.deployment.autopilot import Autopilot
from agents.deployment.c99 import (
    ShipInput,
    _environment,
    advance,
    autopilot_source,
    checked_name,
    ship_source,
)
from agents.deployment.translator import Translator, c_name, literal
from shipgym.engine import mathematics
from shipgym.engine.motion import Motion
from shipgym.engine.specialise import Specialisation
from shipgym.errors import InputError
from shipgym.sea.conditions import Current, Weather, Wind
from shipgym.sea.open_sea import sea_functions
from shipgym.sea.weather_column import CALM
from shipgym.ships import load_model
from shipgym.ships.kernel_boxes import Kernel, kernel_box
from shipgym.tasks.task import Task, path_following_task
from tests.agents.policies import MARINER, random_network, random_policy

FLAGS = [
    "-std=c99",
    "-O2",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-pedantic",
    "-shared",
    "-fPIC",
]


def built(folder, name, *texts):
    """The shared library of a header and a source."""
    for suffix, text in zip("hc", texts, strict=True):
        (folder / f"{name}.{suffix}").write_text(text)
    command = ["gcc", *FLAGS, f"{name}.c", "-o", f"{name}.so", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    return ctypes.CDLL(str(folder / f"{name}.so"))


def sailed(folder, model, commands, given, dt):
    """States of the exported ship, shape (n + 1, 11)."""
    source = ship_source(model, "ship")
    library = built(folder, "ship", source.header, source.source)
    library.ship_step.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_double]
    state, inputs, states = np.zeros(11), np.zeros(6), []
    library.ship_init(ctypes.c_void_p(state.ctypes.data))
    inputs[1:] = model.service_shaft_speed, *given
    for rudder in commands:
        states.append(state.copy())
        inputs[0] = rudder
        assert library.ship_step(state.ctypes.data, inputs.ctypes.data, dt) == 0
    return np.array([*states, state])


@pytest.mark.parametrize(("name", "steps"), [("mariner", 10_000), ("container", 300)])
def test_a_ship_in_c_sails_as_the_library_does(name, steps, tmp_path):
    model, dt, windy = load_model(name), 1.0, name == "mariner"
    weather = (
        Weather(Current(0.5, 90.0), Wind(8.0, 30.0, gust=False)) if windy else None
    )
    given = (
        (0.5 * np.cos(np.pi / 2), 0.5, 8.0, np.radians(30.0))
        if windy
        else (0.0, 0.0, 0.0, 0.0)
    )
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
    shapes = ((8, 4), (8, 3))
    kernel = Kernel(
        np.array([0.0, 0.0, 0.0, 1.0]),
        np.full(4, 0.5),
        *(random.normal(size=one) for one in shapes),
    )
    structure = kernel_box(box.dynamics, kernel)
    weights = dict(
        zip(structure.coefficient_names, 1e-3 * random.normal(size=9), strict=True)
    )
    return replace(box, coefficients=weights, covariance=None, own_table=structure)


@pytest.mark.parametrize("name", ["tanker", "kvlcc2-rm-svm", "kernel"])
def test_every_kind_of_ship_is_the_same_in_c_as_in_plain_python(name, tmp_path):
    model = kernel_ship() if name == "kernel" else load_model(name)
    hooks = {**model.compiled.hooks(), **sea_functions(True)}
    plain = Specialisation(hooks).copy(advance)
    numbers = model.ship_numbers()
    ship = hooks["load_ship"](numbers, 0)
    coefficients = hooks["load_coefficients"](numbers, 0)
    rudder, shaft = np.radians(20.0), model.service_shaft_speed
    found = sailed(tmp_path, model, [rudder] * 30, (0.1, 0.2, 0.0, 0.0), 1.0)
    motion, given = (
        Motion(*found[0].tolist()),
        ShipInput(rudder, shaft, 0.1, 0.2, 0.0, 0.0),
    )
    for row in found[1:]:
        motion = plain(motion, given, 1.0, coefficients, ship, CALM)
        np.testing.assert_allclose(row, motion, rtol=1e-12, atol=1e-15)


def test_functions_of_the_engine_are_the_same_in_c_bit_by_bit(tmp_path):
    c = Translator({}, "it")
    names = [
        c.function(one, float)[0]
        for one in (mathematics.exponential, mathematics.two_to, mathematics.wrap)
    ]
    names.append(c.function(mathematics.arctan, float)[0])
    prelude = (
        ship_source(MARINER, "ship")
        .source.partition("typedef")[0]
        .replace('"ship.h"', '"it.h"')
    )
    public = [
        f"double f{k}(double x);\ndouble f{k}(double x) {{ return {one}(x); }}"
        for k, one in enumerate(names)
    ]
    library = built(
        tmp_path, "it", "", "\n".join([prelude, *c.structures, *c.functions, *public])
    )
    plain = (
        mathematics.exponential,
        mathematics.two_to,
        mathematics.wrap,
        mathematics.arctan,
    )
    for k, function in enumerate(plain):
        in_c = getattr(library, f"f{k}")
        in_c.restype, in_c.argtypes = ctypes.c_double, [ctypes.c_double]
        for x in np.linspace(-9.0, 0.0 if k == 1 else 9.0, 37).tolist():
            assert in_c(x) == function(x)


LIMIT, EXACT = 3, True


class Pair(NamedTuple):
    """Two numbers."""

    left: float
    right: float


def within(x):
    return 1 if -1.0 < x <= 2.0 else 0.25


def either(x):
    outside = x > 1.0 or (x < -1.0 and x != -3.0)
    return 0.5 if not outside else -x


def summed(x):
    total = 0.0
    for k in range(LIMIT):
        total = total + x * (k + 1) / 2 - k / 2
    return total


def swapped(x):
    a, b = x, 2.0
    a, b = b, a
    return a - b * 3.0 - (a - 1)


def powers(x):
    return (1.0 + x * x) ** 0.5 + x**3 + (1.0 + x * x) ** -1 + (2.0 + x) ** 0


def branches(x):
    y = (x - 1.0) if EXACT else unwritable(x)
    unread = unwritable(y)
    if not EXACT:
        y = unread
    if y > 0.0:
        y = y / 4
        z = y - 1.0
    else:
        z = -(y + 1)
    return y + 2.0 * z


def limited(x):
    return (
        abs(min(x, 0.5))
        + max(-x, math.floor(x))
        + float(int(x)) / 2
        + np.arctan2(x, 1.5)
    )


def paired(x):
    pair = Pair(x, right=2.0)
    left, right = turned(pair)
    return left / right


def turned(pair):
    return pair.right, pair.left + 9.0


def test_each_construct_of_python_is_the_same_in_c(tmp_path):
    c, plain = (
        Translator({}, "it"),
        (within, either, summed, swapped, powers, branches, limited, paired),
    )
    names = [c.function(one, float)[0] for one in plain]
    prelude = (
        ship_source(MARINER, "ship")
        .source.partition("typedef")[0]
        .replace('"ship.h"', '"it.h"')
    )
    public = [
        f"double f{k}(double x);\ndouble f{k}(double x) {{ return {one}(x); }}"
        for k, one in enumerate(names)
    ]
    text = "\n".join([prelude, *c.structures, *c.functions, *public])
    (tmp_path / "it.h").write_text("")
    (tmp_path / "it.c").write_text(text)
    command = ["gcc", "-std=c99", "-shared", "-fPIC", "it.c", "-o", "it.so", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True)
    library = ctypes.CDLL(str(tmp_path / "it.so"))
    for k, function in enumerate(plain):
        in_c = getattr(library, f"f{k}")
        in_c.restype, in_c.argtypes = ctypes.c_double, [ctypes.c_double]
        for x in (-3.0, -1.3, -1.0, -0.4, 0.0, 0.3, 0.7, 1.0, 1.9, 2.0, 2.6):
            assert in_c(x) == pytest.approx(function(x), rel=1e-15, abs=1e-15), (
                function.__name__,
                x,
            )


def over_wheel_over():
    """A policy with weights at random that adds to what wheel-over commands."""
    task = Task.of("PathFollowing-v1")
    shown, base = task.observed(MARINER), WheelOver.from_model(MARINER, task=task)
    names, scales = zip(*((one.name, one.scale) for one in shown), strict=True)
    network = random_network(len(names) + 1, 16, 1)
    return random_policy(
        network=network,
        observation_names=names,
        observation_scales=scales,
        base=base,
        authority=0.3,
    )


CONTROLLERS = {
    "pid": PID.from_model(MARINER),
    "filtered": FilteredPID.from_model(
        MARINER, wave_period=9.0, largest_turn_rate_deg_s=0.5
    ),
    "lq": LQ.from_model(MARINER),
    "scheduled": ScheduledLQ.from_model(MARINER),
    "lqg": LQG.from_model(MARINER, wave_period=9.0),
    "ilos": IntegralLineOfSight.from_model(MARINER),
    "alos": AdaptiveLineOfSight.from_model(MARINER, autopilot=PID.from_model(MARINER)),
    "turn_rate": TurnRate.from_model(MARINER),
    "wheel_over": WheelOver.from_model(MARINER, task=Task.of("PathFollowing-v1")),
    "wheel_over_legs": WheelOver.from_model(
        MARINER, autopilot=TurnRate.from_model(MARINER), task=path_following_task()
    ),
    "ppo": load_agent("mariner-calm-ppo"),
    "path_ppo": load_agent("container-roll-path-ppo"),
    "limited": random_policy(
        base=LQ.from_model(MARINER), action_repeat=3, rate_limit=0.1
    ),
    "residual": over_wheel_over(),
    "orders": random_policy(action="rudder-discrete", frame_stack=3, action_repeat=2),
}
LONG = ("lq", "turn_rate", "wheel_over", "wheel_over_legs")
SIZES = {
    "heading": 0.1,
    "set_point": 0.3,
    "yaw_rate": 0.01,
    "sway": 1.0,
    "surge": 8.0,
    "rudder": 0.3,
    "cross_track": 200.0,
    "turn_distance": 300.0,
    "next_turn_distance": 500.0,
    "second_turn_distance": 900.0,
    "rate_of_turn": 0.004,
}


@pytest.mark.parametrize("name", CONTROLLERS)
def test_an_autopilot_in_c_orders_what_the_library_orders(name, tmp_path):
    agent, steps = CONTROLLERS[name], 10_000 if name in LONG else 1000
    source, bridge = autopilot_source(agent, name), Autopilot(agent)
    library = built(tmp_path, name, source.header, source.source)
    state, step = ctypes.create_string_buffer(10_000), getattr(library, f"{name}_step")
    step.restype, step.argtypes = ctypes.c_double, [ctypes.c_void_p, ctypes.c_void_p]
    getattr(library, f"{name}_init")(state)
    random = np.random.default_rng(0)
    numbers = random.normal(
        0.0, [SIZES.get(one, 0.5) for one in source.inputs], (steps, len(source.inputs))
    )
    numbers[:, 0] = 0.4 * (np.arange(steps) % 600 > 300)  # the set-point stands first
    for column in np.flatnonzero(
        np.isin([*source.inputs], ["rate_of_turn", "turn_angle", "next_turn_angle"])
    ):
        numbers[::3, column] = 0.0  # no rate ordered, no turn ahead
    within = (
        1e-12
        if name not in ("ppo", "path_ppo", "limited", "residual", "orders")
        else 1e-6
    )
    for row in numbers:
        expected = bridge.step(dict(zip(source.inputs, row.tolist(), strict=True)))
        assert abs(step(state, row.ctypes.data) - expected) <= within


SHIELDED = Shielded.from_model(MARINER, random_policy())


@pytest.mark.parametrize(
    "agent",
    [CONTROLLERS["lq"], CONTROLLERS["ppo"], SHIELDED],
    ids=["lq", "ppo", "shield"],
)
def test_an_autopilot_orders_what_the_controller_commands_in_the_environment(agent):
    env = gym.make("shipgym/CourseKeeping-v0", model="mariner")
    seen, _ = env.reset(seed=3)
    scales, bridge, state = env.unwrapped.observation_scales, Autopilot(agent), None
    for step in range(60):
        physical = dict(
            zip(env.unwrapped.observation_names, seen * scales, strict=True)
        )
        error = np.arctan2(seen[0], seen[1])
        order = bridge.step({**physical, "set_point": error, "heading": 0.0})
        action, state = agent.predict(seen, state, step == 0)
        assert order / bridge.limit == pytest.approx(
            action[0], abs=2e-5
        )  # observations are single
        seen, *_ = env.step(action)


@pytest.mark.parametrize(
    ("version", "kind"),
    [(1, WheelOver), (0, WheelOver), (1, PreviewMPC), (1, IntegralLineOfSight)],
)
def test_guidance_orders_what_it_commands_along_a_path(version, kind):
    """Its inputs are those of a bridge: the direction of the path, and the course over ground."""
    env = gym.make(
        f"shipgym/PathFollowing-v{version}", model="mariner", max_turn_deg=60.0
    )
    task = env.unwrapped.task
    agent = kind.from_model(MARINER, task=task)
    seen, _ = env.reset(seed=3)
    names, scales = env.unwrapped.observation_names, env.unwrapped.observation_scales
    bridge, state = Autopilot(agent), None
    for step in range(60 if kind is PreviewMPC else 250):
        told = dict(zip(names, seen.astype(float) * scales, strict=True))
        turns = [np.array([told[name]]) for name in agent.turns_ahead]
        course = np.arctan2(
            seen[0], seen[1]
        )  # the environment's, the ship heading to the north
        ground = course - np.arctan2(told["course_error_sin"], told["course_error_cos"])
        direction = course + np.arctan2(
            told["cross_track"], agent.gains["task_lookahead"]
        )
        direction -= float(np.squeeze(agent.shift(turns)))
        order = bridge.step(
            {**told, "set_point": direction, "heading": 0.0, "course": ground}
        )
        action, state = agent.predict(seen, state, step == 0)
        assert order / bridge.limit == pytest.approx(action[0], abs=2e-5)
        seen, *_ = env.step(action)


def test_what_is_no_closed_law_is_refused():
    with pytest.raises(
        InputError,
        match=r"'preview-mpc' found, .*'alos', 'wheel-over' over one of these",
    ):
        autopilot_source(PreviewMPC.from_model(MARINER))
    said = (
        "'lq-adaptive' found, which is not a closed-form law and cannot be written as"
        " C. Export 'pid', 'lq'"
    )
    with pytest.raises(InputError, match=said):
        autopilot_source(AdaptiveLQ.from_model(MARINER))
    with pytest.raises(
        InputError, match=r"commands rudder-shaft .*expected rudder alone"
    ):
        autopilot_source(random_policy(action="rudder-shaft"))


@pytest.mark.parametrize("name", ["9lives", "double", "", "x" * 32])
def test_a_name_that_c_does_not_take_is_refused(name):
    with pytest.raises(InputError, match=r"expected at most 31 letters.*--name"):
        autopilot_source(CONTROLLERS["pid"], name or "é")


def unwritable(x):
    """What C has no word for."""
    return sum([x, x])


def test_python_that_is_not_arithmetic_is_refused_with_its_line():
    with pytest.raises(
        InputError, match=r"unwritable, line 3: '\[x, x\]' found, which cannot be"
    ):
        Translator({}, "it").function(unwritable, float)


def of_a_sequence(x):
    total = 0.0
    for one in x:
        total = total + one
    return total


def of_too_few(x):
    return unwritable()


def of_itself(x):
    return of_itself(x - 1.0)


def of_a_text(x):
    return "x"


@pytest.mark.parametrize("function", [of_a_sequence, of_too_few, of_itself, of_a_text])
def test_what_c_has_no_words_for_is_refused(function):
    with pytest.raises(
        InputError,
        match=rf"test_c99.{function.__name__}, line [2-5]: .* cannot be written as C",
    ):
        Translator({}, "it").function(function, float)


def test_numbers_and_names_are_those_of_c():
    numbers = {0.1: "0.1", -2.0: "(-2.0)", 3: "3", True: "1", 1e300: "1e+300"}
    numbers |= {math.inf: "HUGE_VAL", -math.inf: "(-HUGE_VAL)"}
    assert {number: literal(number) for number in numbers} == numbers
    assert literal(math.nan) == "NAN"
    assert [c_name(name) for name in ("double", "heading")] == ["double_", "heading"]
    with pytest.raises(InputError, match="name 'é' found, expected letters of ASCII"):
        c_name("é")


def test_things_of_one_name_are_numbered_from_the_second_on():
    made = Translator({}, "ship")
    taken = []
    for _ in range(3):
        taken.append(made._free("sine", taken))
    assert taken == ["ship_sine", "ship_sine2", "ship_sine3"]


def test_a_lambda_is_refused():
    double = lambda x: 2 * x  # noqa: E731
    with pytest.raises(
        InputError, match=r"line 1: 'double = lambda x: 2 \* x' found, which cannot be"
    ):
        Translator({}, "it").function(double, float)


def test_the_command_writes_c_and_says_what_it_cannot(tmp_path):
    CONTROLLERS["pid"].save(tmp_path / "pid.json")
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
            "--depth found, which are for --c and --fmu",
            "mariner",
            "--onnx",
            tmp_path / "no",
            "--depth",
            9,
        ),
        (
            "agent: 'mariner' found",
            "mariner",
            "--c",
            tmp_path / "no",
            "--onnx",
            tmp_path / "no.onnx",
        ),
        (
            "its folder does not exist",
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
            "--fmi: 2.0 found, which is for --fmu alone",
            "mariner",
            "--c",
            tmp_path / "no",
            "--fmi",
            "2.0",
        ),
        (
            "--depth: 9 found, but",
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


def test_texts_have_angles_speeds_and_headings_in_four_digits():
    """A heading is below 360 degrees, also where it is rounded."""
    made = _environment().filters
    assert made["deg"](np.radians(-12.34567)) == -12.3457
    assert made["knots"](1852.0 / 3600.0 * 7.12345) == 7.1235
    headings = [
        made["heading"](np.radians(one))
        for one in (-90.0, 12.34567, 359.99997, -1e-9, 720.5)
    ]
    assert headings == [270.0, 12.3457, 0.0, 0.0, 0.5]
    assert made["float32"](0.1) == "1.000000000e-01f"


def test_a_long_name_is_shown_by_its_beginning():
    with pytest.raises(InputError) as refused:
        checked_name("x" * 100)
    assert f"name: '{'x' * 60}' found" in str(refused.value)
    title = ship_source(replace(MARINER, name="m" * 300), "ship").header.partition(
        "*/"
    )[0]
    assert "Ship model _" + "m" * 108 in title  # 120 characters
    assert "m" * 109 not in title


def test_a_ship_without_particulars_for_wind_is_written_without_it_and_says_so():
    unknown = replace(MARINER.particulars, beam=None, draught=None)
    source = ship_source(replace(MARINER, particulars=unknown), "ship")
    assert set(source.inputs) == {"rudder", "current_north", "current_east"}
    (note,) = source.notes
    assert note.startswith("wind is left out: ")
    assert "wind_speed" in ship_source(MARINER, "ship").inputs
