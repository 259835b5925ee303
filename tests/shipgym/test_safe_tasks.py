"""What goes wrong late in a task of one's own: told with its line, never a crash."""

import re
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from shipgym import InputError, check_task

EXAMPLES = Path(__file__).parents[2] / "examples"
FAIRWAY = (EXAMPLES / "fairway.py").read_text(encoding="utf-8")
CASES = Path(__file__).parents[3] / "shared" / "cases" / "tasks"
COURSE = "shipgym:shipgym/CourseKeeping-v0"
SHIP = {"model": "kvlcc2", "action": "rudder-shaft"}
STEP = "    x, off = motion.x"  # first line of its step


def fairway(folder, lines, *changes):
    """Path of a fairway with lines put before its step, and where the first stands."""
    path = folder / "fairway.py"
    text = FAIRWAY.replace(STEP, f"{lines}\n{STEP}")
    text = text.replace("REPORTED", "import numpy as np\nTABLE = np.ones(3)\nREPORTED")
    for old, new in changes:
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return path, text.splitlines().index(lines.splitlines()[0]) + 1


def late(folder):
    """Fairway that fails at two orders of the rudder, and pays a bonus."""
    return fairway(
        folder,
        """    rudder = interval.rudder_command
    index = 1000000000000 if fabs(rudder - 0.43) < 1e-6 else 0
    zero = 0.0 if fabs(rudder - 0.77) < 1e-6 else 1.0
    TABLE[index]
    bad = motion.u / zero""",
        ("Reward(-off * off, -delay", "Reward(1.0, -delay - 1e-9 * bad"),
    )


def sail(env, rudder):
    """Take two steps ahead, and one with an order that no check gives."""
    env.reset(seed=0)
    orders = np.ones(env.action_space.shape, dtype=np.float32)
    for order in (0.0, 0.0, rudder):
        orders[..., 0] = order
        env.step(orders)


def test_what_fails_late_is_told_with_line_lane_and_step(tmp_path, monkeypatch):
    path, line = late(tmp_path)
    known = tmp_path / "known.loop"  # not of an earlier run
    monkeypatch.setattr("shipgym.envs.task_checker.cached_path", lambda *_: known)
    with pytest.warns(UserWarning, match="costs, written with a minus"):
        ships = gymnasium.make_vec(COURSE, num_envs=70, task=path, **SHIP)
    gymnasium.make_vec(COURSE, num_envs=3, task=path, **SHIP)  # told once
    with pytest.raises(
        InputError,
        match=rf"fairway.py, line {line + 3}, in step: IndexError: index 1000000000000"
        r" is out of bounds for axis 0 with size 3, in lane 0 at step 3$",
    ):
        sail(ships, 0.43)
    with pytest.raises(
        InputError,
        match=r"reward_delay: expected a finite number, got -inf in lane 0 at step 3;"
        rf" .*line {line + 4}, in step: FloatingPointError: divide by zero",
    ):
        sail(ships, 0.77)


def test_positive_rewards_are_asked_about(tmp_path):
    path, _ = late(tmp_path)
    found = check_task(path, **SHIP)
    assert "problems: none, remarks: 1" in str(found)
    (positive,) = found.remarks
    assert "reward_cross_track: expected costs, written with a minus" in positive
    assert "100 % of the steps, up to 1: are these costs?" in positive


@pytest.fixture
def short(monkeypatch):
    """Calls of a user's function may take a fifth of a second."""
    for module in ("python_files", "envs.task_checker"):
        monkeypatch.setattr(f"shipgym.{module}.LONGEST_CALL", 0.2)


def check_refused(path, message, make):
    """A check names what is wrong, and an environment is not made."""
    (problem,) = check_task(path, **SHIP).problems
    assert re.search(message, problem)
    with pytest.raises(InputError, match=message):
        make(COURSE, task=path, **SHIP)


def test_a_print_is_refused_before_ships_sail(tmp_path, capsys):
    path, _ = fairway(tmp_path, "    print(motion.x)")
    assert "in step: expected no print" in check_task(path, **SHIP).problems[0]
    assert len(capsys.readouterr().out.splitlines()) < 9


LOOP = "    k = 0.0\n    while {} and k < 3e9:\n        k += 1.0"  # compiled, it ends


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (
            "    k = TABLE[int(interval.steps / 9.0)]",
            "IndexError: index 3 .* at step 27 in",
        ),
        (LOOP.format("interval.steps > 579.5"), "TimeoutError: .* does not end"),
        (LOOP.format("motion.psi > 1.0"), "TimeoutError: .* does not end"),
    ],
)
def test_a_new_task_is_checked_over_an_episode(tmp_path, short, lines, message):
    path, _ = fairway(tmp_path, lines, ("(-off", "(-0.0 * k - off"))
    check_refused(path, f"in step: {message}", gymnasium.make_vec)


@pytest.mark.parametrize(
    ("lines", "head", "message"),
    [
        (
            "helm.start",
            "def helm(x):\n    return x",
            "got helm.start; write START = helm",
        ),
        (
            "if motion.x < 8e9:\n        late = 1.0\n    motion.u * late",
            "",
            r"line \d+\): expected variables that .* got 'late'",
        ),
        ("0.0", "while True:\n    pass", "look for a loop that does not end"),
        (
            "0.0",
            "def draw(motion, state, ship, settings):\n    while True:\n        pass",
            "line 2., in draw: TimeoutError: expected a function that returns",
        ),
    ],
)
def test_what_no_environment_is_made_of(tmp_path, short, lines, head, message):
    change = ("REPORTED", f"{head}\n\n\nREPORTED")
    path, _ = fairway(tmp_path, f"    {lines}", change)
    check_refused(path, message, gymnasium.make)


@pytest.mark.skipif(not CASES.is_dir(), reason="the cases are not beside the checkout")
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("float_reward", "line 59, in step: result 2: expected Reward, got a number"),
        ("nan", "line 61, in step: FloatingPointError: divide by zero"),
        ("swap_observe_args", "observe: expected a function observe.readings, state"),
        ("vessel_start_inside", "line 51, in begin: .* write START = ferry.start"),
        ("late_index_1e12", "line 86, in step: IndexError: index 1000000000000 "),
    ],
)
def test_slips_of_users_are_told_with_their_line(name, message):
    (problem,) = check_task(CASES / f"{name}.py", dt=10.0, **SHIP).problems
    assert re.search(message, problem)
