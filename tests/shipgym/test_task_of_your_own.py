"""A task, a reward and a sensor set from files outside the package: those of their
documentation page."""

import re
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AsyncVectorEnv

from shipgym import InputError, check_task, register_task
from shipgym.engine.source import (
    read_source,
)
from shipgym.tasks import Task
from tests.shipgym.vector_checker import check_vector_env

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "task_of_your_own.md").read_text(encoding="utf-8")
EXAMPLE = ROOT / "examples" / "fairway.py"
FAIRWAY = EXAMPLE.read_text(encoding="utf-8")
REWARD, SENSORS = (
    re.search(rf'```python\n("""{name}.*?)```', PAGE, re.DOTALL)[1]  # type: ignore[index]
    for name in ("my_reward", "my_sensors")
)
COURSE = "shipgym/CourseKeeping-v0"
SHIP = {"model": "kvlcc2", "action": "rudder-shaft"}


def written(folder, name, text):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture
def fairway(tmp_path):
    known = set(gymnasium.registry)
    register_task(
        "harbour/Fairway-v0", written(tmp_path, "fairway.py", FAIRWAY), **SHIP
    )
    yield "harbour/Fairway-v0"
    for name in set(gymnasium.registry) - known:
        del gymnasium.registry[name]


def test_the_example_is_a_task_of_one_screen_and_sound():
    assert FAIRWAY.count("\n") < 120
    assert f"```python\n{FAIRWAY}```" in PAGE
    assert str(check_task(EXAMPLE, **SHIP)) == "fairway: sound"


def test_a_task_works_everywhere(fairway):
    env = gymnasium.make(fairway, render_mode="rgb_array", episode_steps=60).unwrapped
    check_env(env)
    assert env.observation_names[-1] == "to_zone"
    seen, info = env.reset(seed=70)
    assert {
        "speeding",
        "cross_track",
        "reward_delay",
        "reward_over_speed",
        "reward_end",
    } <= info.keys()
    assert env.render().shape == (600, 600, 3)
    many = gymnasium.make_vec(fairway, num_envs=71, episode_steps=60)
    check_vector_env(
        lambda: gymnasium.make_vec(fairway, num_envs=3, episode_steps=60),
        lambda: gymnasium.make(fairway, episode_steps=60),
    )
    np.testing.assert_array_equal(many.reset(seed=0)[0][70], seen)
    for k in range(50):
        action = np.array([0.2 * np.sin(k), 0.8], dtype=np.float32)
        seen, reward, *_, info = env.step(action)
        all_seen, rewards, *_ = many.step(np.tile(action, (71, 1)))
        np.testing.assert_array_equal(all_seen[70], seen)
        assert rewards[70] == reward
        parts = [info[name] for name in env.task.reward_parts]
        assert info["cost"] == pytest.approx(-sum(parts))


def test_spawned_workers_read_the_file(tmp_path):
    path = str(written(tmp_path, "fairway.py", FAIRWAY))

    def make():
        return gymnasium.make(
            f"shipgym:{COURSE}", task=path, model="kvlcc2", action="rudder-shaft"
        )

    workers = AsyncVectorEnv([make, make], context="spawn")
    try:
        seen, _ = workers.reset(seed=3)
    finally:
        workers.close()
    np.testing.assert_array_equal(seen[1], make().reset(seed=4)[0])


def test_a_reward_of_ones_own_is_paid_for_the_same_voyage(tmp_path):
    path = written(tmp_path, "my_reward.py", REWARD)
    assert check_task("CourseKeeping", reward=path).problems == ()
    plain = gymnasium.make(COURSE).unwrapped
    env = gymnasium.make(COURSE, reward=str(path), bounded=False).unwrapped
    check_env(env)
    for one in (plain, env):
        one.reset(seed=5)
    for k in range(40):
        action = np.array([np.sin(k / 5.0)], dtype=np.float32)
        expected, *_ = plain.step(action)
        seen, reward, *_, info = env.step(action)
        np.testing.assert_array_equal(seen, expected)
        rudder = env.physical_state()["delta"] / env.model.steering.limit
        assert info["reward_rudder"] == pytest.approx(-0.5 * rudder**2)
        assert reward == pytest.approx(-(info["heading_error"] ** 2) - 0.5 * rudder**2)
    many = gymnasium.make_vec(COURSE, num_envs=3, reward=path)
    many.reset(seed=5)
    assert set(many.step(np.zeros((3, 1), dtype=np.float32))[4]) >= {
        "reward_heading",
        "reward_end",
    }


def test_sensors_of_ones_own_show_the_same_voyage_otherwise(tmp_path):
    path = written(tmp_path, "my_sensors.py", SENSORS)
    assert check_task("CourseKeeping", sensors=path).problems == ()
    plain = gymnasium.make(COURSE, model="mariner").unwrapped
    env = gymnasium.make(
        COURSE, model="mariner", sensors=str(path), compass_error=0.2
    ).unwrapped
    for one in (plain, env):
        one.reset(seed=5)
    lagged, part = env.physical_state()["u"], env.dt / (20.0 + env.dt)
    for _ in range(20):
        action = np.array([0.7], dtype=np.float32)
        expected, reward, *_ = plain.step(action)
        seen, same, *_ = env.step(action)
        assert same == reward
        error = np.arctan2(*expected[:2]) - np.arctan2(*seen[:2])
        assert error == pytest.approx(0.2, abs=1e-5)
        lagged += part * (env.physical_state()["u"] - lagged)
        assert seen[4] * env.observation_scales[4] == pytest.approx(lagged, rel=1e-6)
    with pytest.raises(
        InputError,
        match=r"sensors: expected .* got .*my_sensors.py and noise or measurement",
    ):
        gymnasium.make(COURSE, sensors=path, noise=1.0)
    with pytest.raises(InputError, match="log_time_constant: expected a number > 0"):
        gymnasium.make(COURSE, sensors=path, log_time_constant=0.0)
    path = written(
        tmp_path, "my_sensors.py", SENSORS.replace("log_time_constant", "rudder_weight")
    )
    with pytest.raises(
        InputError,
        match=r"my_sensors.py: Settings.rudder_weight: expected a name of its own",
    ):
        gymnasium.make(COURSE, sensors=path)


def test_a_file_that_was_changed_is_read_and_compiled_anew(tmp_path):
    path = written(tmp_path, "my_reward.py", REWARD)
    first = gymnasium.make(COURSE, reward=path).unwrapped
    more = REWARD.replace(
        "    rudder: float\n", "    rudder: float\n    bonus: float\n"
    )
    written(tmp_path, "my_reward.py", more.replace("** 2", "** 2, 7.0"))
    second = gymnasium.make(COURSE, reward=path).unwrapped
    assert [len(env.task.definition.reward_names) for env in (first, second)] == [2, 3]
    for env in (first, second):
        env.reset(seed=1)
    action = np.array([0.3], dtype=np.float32)
    costs = [env.step(action)[-1]["cost"] for env in (first, second)]
    assert costs[0] - costs[1] == pytest.approx(7.0)
    assert Task.of("CourseKeeping", reward=path).definition is second.task.definition


def wrong_fairway(folder, text, old, new, message):
    """Write a task with a change, and name its line, the next, and that of its
    function."""
    assert old in text
    here = text[: text.index(old)].count("\n") + 1
    head = text.splitlines()[:here]
    text = text.replace(old, new, 1)
    start = max(k for k, line in enumerate(head, 1) if k == 1 or line[:4] == "def ")
    lines = {"HERE": here, "NEXT": here + 1, "DEF": start}
    for name, number in lines.items():
        message = message.replace(f"line {name}", f"line {number}")
    return written(folder, "fairway.py", text), message


WRONG = [
    (
        "class State",
        "class Sate",
        "fairway.py: expected a NamedTuple 'State' .* got no 'State'",
    ),
    (
        "def begin(ship, settings,",
        "def begin(ship,",
        "begin: expected a function begin.* got one of arguments",
    ),
    ('"speeding", ', '"speding", ', "REPORTED: expected a tuple .* got 'speding'"),
    (
        "    delay: float",
        "    end: float",
        "Reward.end: expected another name",
    ),
    (
        "half_width: Annotated",
        "dt: Annotated",
        "Settings.dt: expected a name of its own",
    ),
    (
        "class Reward",
        "class Reward(",
        "fairway.py, line .*: cannot be executed: SyntaxError",
    ),
    ("drawn(random, 1,", "drwn(random, 1,", "in begin.*drwn"),
    (
        "return 2.0 + settings.over_speed_weight",
        "pass",
        "in worst_cost: .*expected a number, got nothing",
    ),
    (
        "return 2.0 + ",
        "return -2.0 - ",
        "fairway.py: worst_cost: expected a number >= 0, got -52",
    ),
    ("max(motion.u", "mox(motion.u", "line DEF, in step: NameError: name 'mox'"),
    ("Reward(-off * off, ", "Reward(", "line HERE, in step: TypeError: .*'over_speed'"),
    (
        "Reward(-off",
        "(-off",
        r"in step: result 2: expected Reward, got \(a number, a number, a number\)",
    ),
    (
        "    return Observation(",
        "    return [sine]\n    (",
        "line DEF, in observe: returned value: expected Observation, got list",
    ),
    (
        "fabs(off) > 1.0, ",
        "",
        r"line DEF, in step: returned value: .* got \(State, Reward, a boolean\)",
    ),
    (
        "def begin",
        "def plan_length(_):\n    return -1\n\n\ndef begin",
        "plan_length: expected an integer of at least 0, got -1",
    ),
    (
        "def begin",
        "def check(s, m):\n    1 / 0\n\n\ndef begin",
        "line NEXT, in check: ZeroDivisionError",
    ),
    (
        "    aside = 0.5",
        "    plan[40] = 1.0\n    aside = 0.5",
        "line HERE, in begin: IndexError: index 40",
    ),
    (
        "def step",
        "import numba\n\n\n@numba.njit\ndef step",
        "step: expected a function step.* got no plain function",
    ),
    (
        "return 2.0 + ",
        "return worst_cost(settings) + ",
        "line DEF, in worst_cost: expected a function that can be compiled, got",
    ),
    (
        "REPORTED = (",
        "EPISODE_STEPS = -1\nREPORTED = (",
        "fairway.py: EPISODE_STEPS: expected an integer of at least 1, got -1",
    ),
    (
        "REPORTED = (",
        "raise SystemExit(3)\nREPORTED = (",
        "line HERE: cannot be executed: SystemExit: 3",
    ),
]


@pytest.mark.parametrize(
    ("old", "new", "message"), WRONG, ids=[new for _, new, _ in WRONG]
)
def test_what_is_wrong_is_named_and_nothing_is_registered(tmp_path, old, new, message):
    path, message = wrong_fairway(tmp_path, FAIRWAY, old, new, message)
    found = check_task(path, **SHIP)
    assert len(found.problems) == 1
    assert re.search(message, found.problems[0])
    with pytest.raises(InputError, match=message):
        register_task("harbour/Wrong-v0", path, **SHIP)
    assert "harbour/Wrong-v0" not in gymnasium.registry
    if not message.endswith("expected Reward"):  # compiled, a tuple does as well
        with pytest.raises(InputError, match=message):
            gymnasium.make(COURSE, task=str(path), **SHIP)


@pytest.mark.parametrize(
    ("new", "message"),
    [
        (
            "    if x > 3.0:\n        fathom\n",
            "fairway.py, line DEF, in step: NameError: name 'fathom'",
        ),
        (
            "    if x > 3.0:\n        return 1.0, 2.0\n",
            r"in step \(.*fairway.py, line \d+\): Can't unify",
        ),
        (
            "    global N\n    N = 1\n",
            r"\(.*fairway.py, line NEXT\): .*STORE_GLOBAL. found.$",
        ),
        (
            "    if x > 3.0:\n        Reward(1.0)\n",
            r"cannot be compiled: .*Reward.*'delay'",
        ),
    ],
)
def test_what_only_numba_finds_is_told_with_function_and_line(tmp_path, new, message):
    added = f"{new}    inside ="
    assert_refused(*wrong_fairway(tmp_path, FAIRWAY, "    inside =", added, message))


def assert_refused(path, message):
    with pytest.raises(InputError, match=message):
        gymnasium.make(COURSE, task=path, **SHIP)
    with pytest.raises(InputError, match=message):
        register_task("harbour/Wrong-v0", path, **SHIP)
    assert "harbour/Wrong-v0" not in gymnasium.registry


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("head", "new", "message"),
    [
        (
            "W = [1.0]",
            "W[0]",
            ("step: global 'W': expected a tuple or an array of numbers, got a list"),
        ),
        (
            "W = {'a': 1.0}",
            "W['a']",
            "in step: global 'W': expected a tuple or an array",
        ),
        (
            "import numpy as np",
            "np.clip(x, 0.0, 9.0)",
            r"fairway.py, line HERE\): No implementation .*clip",
        ),
        (
            "from numpy import ones\nW = ones(3)",
            "W[0]; W[0] = x",
            r"line HERE\): expected global arrays to be only read",
        ),
        (
            "import calendar",
            "calendar.isleap(x)",
            "write from calendar import isleap",
        ),
        (
            "def k(x, *, n=1.0):\n    return x",
            "k(x)",
            "in k: expected no keyword-only arguments",
        ),
    ],
)
def test_what_a_function_takes_from_its_file_is_fit_for_the_compiler(
    tmp_path, head, new, message
):
    text = FAIRWAY.replace(
        "from math import fabs\n", f"from math import fabs\n{head}\n"
    )
    added = f"    x += {new}\n    inside ="
    assert_refused(*wrong_fairway(tmp_path, text, "    inside =", added, message))


def test_a_division_by_zero_before_the_first_step_is_named_with_its_line(tmp_path):
    text = FAIRWAY.replace(
        "to_zone = max(", "to_zone = readings.x / interval.steps + max("
    )
    path = written(tmp_path, "fairway.py", text)
    line = 1 + text[: text.index("to_zone = readings")].count("\n")
    (problem,) = check_task(path, **SHIP).problems
    assert f"{path}, line {line}, in observe: FloatingPointError: invalid" in problem


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(
        InputError, match=r"none.py: expected a Python file, got no such file"
    ):
        read_source(tmp_path / "none.py")


def test_a_reward_that_is_not_finite_is_named(tmp_path):
    text = REWARD.replace(
        "** 2", "** 2 + (interval.steps >= 3.0) * (interval.dt - interval.dt) / 0.0"
    )
    path = written(
        tmp_path,
        "my_reward.py",
        text.replace("/ 0.0", "/ (state.heading_setpoint - state.heading_setpoint)"),
    )
    message = r"reward_rudder: expected a finite number, got nan in lane 0 at step 1"
    env = gymnasium.make(COURSE, reward=path)
    env.reset(seed=0)
    with pytest.raises(InputError, match=message):
        env.step(env.action_space.sample())
    with pytest.raises(InputError, match="in reward: FloatingPointError"):
        gymnasium.make_vec(COURSE, num_envs=2, reward=path)
    problem = check_task("CourseKeeping", reward=path).problems[0]
    assert re.search(r"my_reward.py, line \d+, in reward: FloatingPoint", problem)


def test_what_fails_in_plain_python_is_told_with_its_line_and_step(tmp_path):
    text = "from math import acos\n\n" + REWARD.replace(
        "** 2", "** 2 + acos(2.0 + interval.dt)"
    )
    path = written(tmp_path, "my_reward.py", text)
    line = next(k for k, one in enumerate(text.splitlines(), 1) if "interval.dt" in one)
    (problem,) = check_task("CourseKeeping", reward=path).problems
    assert re.search(
        rf"line {line}, in \w+: ValueError: .*, at step 1 in plain Python", problem
    )


def test_ids_are_taken_once(fairway, tmp_path):
    register_task(
        fairway, tmp_path / "fairway.py", **SHIP
    )  # the same again changes nothing
    with pytest.raises(
        InputError,
        match=r"harbour/Fairway-v0: expected an unused id, .* for .*fairway.py",
    ):
        register_task(fairway, "PathFollowing")
    with pytest.raises(
        InputError,
        match="expected an id such as 'harbour/fairway-v0', got 'Fair way'",
    ):
        register_task("Fair way", tmp_path / "fairway.py", **SHIP)
    with pytest.raises(InputError, match="Did you mean 'speed_limit'"):
        register_task(
            "harbour/Other-v0", tmp_path / "fairway.py", speed_limt=0.5, **SHIP
        )
    assert "harbour/Other-v0" not in gymnasium.registry
    with pytest.raises(
        InputError,
        match="expected an id such as 'harbour/fairway-v0', got 'harbour/Fairway'",
    ):
        register_task("harbour/Fairway", tmp_path / "fairway.py", **SHIP)
    with pytest.raises(InputError, match=r"render_mode: expected .* got 'film'"):
        register_task(
            "harbour/Film-v0", tmp_path / "fairway.py", render_mode="film", **SHIP
        )
    written(tmp_path, "fairway.py", FAIRWAY.replace("max(motion.u", "mox(motion.u"))
    with pytest.raises(InputError, match="name 'mox' is not defined"):
        register_task(fairway, tmp_path / "fairway.py", **SHIP)


def test_bounds_of_an_observation_are_finite_and_in_order(tmp_path):
    for bounds, wrong in {
        "1.0, 1.0": "upper bound: expected a number > 1, got 1",
        "-float('inf'), 1.0": "lower bound: expected a number, got -inf",
        "-1.0, 1.0, option='rol'": "option: expected one of '', 'roll', 'shaft'",
        "-1.0, 1.0, scale=-2.0": "scale: expected a number > 0, got -2",
        "-1.0, 1.0, scale=lambda ship: 1.0": (
            "scale: expected a function of ship and settings, got one of arguments ship"
        ),
        "-1.0, 1.0, scale=lambda ship, _: 0.0": (
            "scale for 'kvlcc2': expected a number > 0, got 0"
        ),
        "-1.0, 1.0, scale=lambda ship, _: ship.w": (
            "AttributeError: 'Ship' object has no attribute 'w'"
        ),
    }.items():
        text = FAIRWAY.replace(
            "g_sin: Annotated[float, ObservationSpec(-1.0, 1.0)]",
            f"g_sin: Annotated[float, ObservationSpec({bounds})]",
        )
        path = written(tmp_path, "fairway.py", text)
        (problem,) = check_task(path).problems
        assert problem.startswith(str(path)), problem
        assert wrong in problem, problem


def test_a_lost_ship_that_costs_nothing_more_is_remarked_on(tmp_path):
    name = "def worst_cost(settings):"
    free = FAIRWAY.replace(name, "def not_it(settings):")
    found = check_task(written(tmp_path, "fairway.py", free))
    assert any("the sooner lost, the cheaper" in remark for remark in found.remarks)
    with_it = check_task(written(tmp_path, "with_it.py", FAIRWAY))
    assert not any("the sooner" in remark for remark in with_it.remarks)
