"""Arrays, plan, random numbers and repeated records in a task; its settings."""

import gymnasium
import numpy as np
import pytest

from shipgym import InputError, register_task
from shipgym.engine.specialise import is_shipped

COURSE = "shipgym/CourseKeeping-v0"
TASK = """
from typing import Annotated, NamedTuple

from shipgym.tasks.contract import (
    ObservationSpec, Setting, Size, drawn, drawn_normal, under_way
)

REPORTED = ("luck", "gate")


def length(ship, settings):
    return ship.length


class Target(NamedTuple):
    x: float
    y: float


class Seen(NamedTuple):
    north: Annotated[float, ObservationSpec(-99.0, 99.0, "m", length)]
    east: Annotated[float, ObservationSpec(-99.0, 99.0, "m", length)]


class Settings(NamedTuple):
    speeds: Annotated[tuple[float, float], Setting("Of the targets.", at_most=9.0)] = (
        1.0, 2.0
    )
    charge: float = 0.5
    part: float = 0.5


class State(NamedTuple):
    targets: tuple[Target, Target]
    headings: Annotated[tuple[float, ...], Size(4)]
    luck: float
    gate: float
    noise: float


class Reward(NamedTuple):
    near: float


class Observation(NamedTuple):
    targets: tuple[Seen, Seen]
    nearest: Seen
    headings: Annotated[tuple[float, float], ObservationSpec(-9.0, 9.0)]
    noise: Annotated[float, ObservationSpec(-9.0, 9.0)]


def plan_length(settings):
    return 2


def begin(ship, settings, random, plan):
    plan[0] = drawn(random, 0, 1.0, 2.0)
    plan[1] = 3.0
    targets = (Target(0.0, plan[0]), Target(9.0, 9.0))
    part = settings.part
    motion = under_way(0.0, 0.0, 0.0, part * ship.speed, part * ship.shaft)
    return motion, State(targets, (0.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0)


def moved(target, speed, interval):
    return Target(target.x + speed * interval.dt, target.y)


def step(motion, state, interval, ship, settings):
    first, second = state.targets
    targets = (
        moved(first, settings.speeds[0], interval),
        moved(second, settings.speeds[1], interval),
    )
    total = 0.0
    for heading in state.headings:
        total += heading
    for target in targets:
        total += target.x
    headings = state.headings[1:] + (motion.psi,)
    after = State(targets, headings, state.luck, state.gate, state.noise)
    return after, Reward(-settings.charge - 0.001 * abs(total)), False, False


def due(motion, state, interval, ship, settings):
    return True


def on_event(motion, state, interval, ship, settings, random, plan):
    number = int(interval.steps)
    luck = drawn(random, number, 0.0, 1.0)
    gate = plan[0] + plan[1]
    noise = drawn_normal(random, number)
    return State(state.targets, state.headings, luck, gate, noise)


def seen_of(target, readings):
    return Seen(target.x - readings.x, target.y - readings.y)


def observe(readings, state, interval, ship, settings):
    first, second = state.targets
    return Observation(
        (seen_of(first, readings), seen_of(second, readings)),
        seen_of(first, readings),
        state.headings[2:],
        state.noise,
    )
"""
NAMES = (
    *("targets_0_north", "targets_0_east", "targets_1_north", "targets_1_east"),
    *("nearest_north", "nearest_east", "headings_0", "headings_1", "noise"),
)


@pytest.fixture(scope="module")
def task(tmp_path_factory):
    path = tmp_path_factory.mktemp("task") / "convoy.py"
    path.write_text(TASK, encoding="utf-8")
    return path


def sailed(env, steps):
    """Observations, rewards and luck under one and the same orders."""
    record = []
    for k in range(steps):
        order = np.full(env.action_space.shape, 0.3 * np.sin(k / 4.0), np.float32)
        observation, reward, _, _, info = env.step(order)
        record.append((observation, reward, info["luck"], info["gate"]))
    return [np.array(column) for column in zip(*record, strict=True)]


def test_arrays_plan_and_random_numbers_are_the_same_for_one_ship_and_many(task):
    many = gymnasium.make_vec(COURSE, num_envs=66, task=task)
    one = gymnasium.make(COURSE, task=task).unwrapped
    assert one.observation_names == NAMES
    assert not is_shipped(one.task.definition.step)
    first = many.reset(seed=4)[0]
    np.testing.assert_array_equal(first[65], one.reset(seed=69)[0])
    of_many = sailed(many, 30)
    of_one = sailed(one, 30)
    for all_rows, row in zip(of_many, of_one, strict=True):
        np.testing.assert_array_equal(all_rows[:, 65], row)
    observations, _, luck, gate = of_one
    assert len(np.unique(luck)) == 30  # a number of its own for each interval
    assert 0.0 <= luck.min() <= luck.max() < 1.0
    assert 4.0 <= gate[0] < 5.0
    assert np.ptp(gate) == 0.0
    headings = observations[:, NAMES.index("headings_0")]
    np.testing.assert_array_equal(headings[1:], observations[:-1, 7])
    one.reset(seed=69)
    np.testing.assert_array_equal(sailed(one, 30)[0], observations)  # again
    assert abs(np.mean(of_many[0][..., 8])) < 0.1  # 1980 normal numbers
    assert np.std(of_many[0][..., 8]) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"chrage": 1.0}, "unknown key 'chrage'. Did you mean 'charge'"),
        ({"speeds": [1.0, 2.0, 3.0]}, "speeds: expected 2 numbers"),
        ({"speeds": [1.0, 99.0]}, "speeds: number 1: expected a number <= 9"),
        ({"charge": [1.0, 2.0]}, r"charge: expected a number, got \[1.0, 2.0\]"),
    ],
)
def test_settings_are_checked(task, options, message):
    with pytest.raises(InputError, match=message):
        gymnasium.make(COURSE, task=task, **options)


WRONG = {
    "headings: Annotated[tuple[float, ...], Size(4)]": [
        ("headings: tuple[float, ...]", "State.headings: expected a float, or"),
        (
            "headings: Annotated[tuple[float, ...], Size(0)]",
            "State.headings: expected a float, or",
        ),
        ("headings: tuple[float, str]", "State.headings: expected a float"),
    ],
    "    luck: float": [
        ("    luck: tuple[float, float]", "REPORTED: expected .* each a number"),
    ],
    "    charge: float = 0.5": [
        (
            "    charge: tuple[float, float] = (1.0,)",
            "Settings.charge: default: expected",
        ),
        ("    charge: tuple[float, ...] = (1.0,)", "Settings.charge: expected a float"),
        ("    task: float = 0.5", "Settings.task: expected a name of its own"),
    ],
    "    noise: Anno": [
        ("    nearest_east: Anno", "Observation: .* got 2 fields 'nearest_east'"),
    ],
    "settings):\n    first": [
        ("settings, random):\n    first", "step: expected .* settings, random"),
    ],
}
CASES = [(old, new, message) for old, many in WRONG.items() for new, message in many]
RANDOM = {
    "import numpy as np": ("np.random.uniform()", "numpy.random"),
    "from random import gauss": ("gauss(0.0, 1.0)", "random"),
}
for head, (call, module) in RANDOM.items():
    new = f"    total = {call}\n"
    wanted = f"in (?:step|luck): expected random .* got those of {module};"
    CASES.append(("    total = 0.0\n", new + f"# {head}", wanted))


@pytest.mark.parametrize(("old", "new", "message"), CASES)
def test_what_a_task_may_not_hold_is_named_with_file_and_line(
    tmp_path, old, new, message
):
    new, _, head = new.partition("# ")
    assert old in TASK
    path = tmp_path / "wrong.py"
    path.write_text(f"{head}\n{TASK.replace(old, new, 1)}", encoding="utf-8")
    place = r", line \d+" if message.startswith("in ") else ""
    if "name of its own" in message or "got 2 fields" in message:
        place = ""
    with pytest.raises(InputError, match=rf"wrong.py{place}.* {message}"):
        register_task("harbour/Wrong-v0", path)
    assert "harbour/Wrong-v0" not in gymnasium.registry
