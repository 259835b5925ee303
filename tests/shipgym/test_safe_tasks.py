"""What goes wrong late in a task of one's own: told with its line, never a crash."""

from pathlib import Path

import gymnasium
import numpy as np
import pytest

from shipgym import InputError

EXAMPLES = Path(__file__).parents[2] / "shipgym" / "examples"
FAIRWAY = (EXAMPLES / "fairway.py").read_text(encoding="utf-8")
CASES = Path(__file__).parents[3] / "shared" / "cases" / "tasks"
COURSE = "shipgym:shipgym/CourseKeeping-v0"
SHIP = {"model": "kvlcc2", "action": "rudder-shaft"}
STEP = "    x, off = motion.x"  # first line of its step


def fairway(folder, lines):
    """Path of a fairway with lines put before its step, and where the first stands."""
    path = folder / "fairway.py"
    text = FAIRWAY.replace(STEP, f"{lines}\n{STEP}")
    text = text.replace("REPORTED", "import numpy as np\nTABLE = np.ones(3)\nREPORTED")
    path.write_text(text, encoding="utf-8")
    return path, text.splitlines().index(lines.splitlines()[0]) + 1


def sail(env):
    env.reset(seed=0)
    ahead = np.ones(env.action_space.shape, dtype=np.float32)
    ahead[..., 0] = 0.0
    for _ in range(60):
        env.step(ahead)


def test_a_late_index_beyond_an_array_is_told_with_line_index_lane_and_step(tmp_path):
    index = "int(motion.x / 300.0) * 1000000000000"
    path, line = fairway(tmp_path, f"    TABLE[{index}]")
    ships = gymnasium.make_vec(COURSE, num_envs=70, task=path, dt=10.0, **SHIP)
    message = (
        rf"fairway.py, line {line}, in step: IndexError: index 1000000000000 is out of"
        r" bounds for axis 0 with size 3, in lane 0 at step \d+$"
    )
    with pytest.raises(InputError, match=message):
        sail(ships)
    with pytest.raises(InputError, match=message):
        sail(gymnasium.make(COURSE, task=path, dt=10.0, **SHIP))


def test_a_division_by_zero_that_reaches_the_reward_is_told_with_its_line(tmp_path):
    late = "    zero = 0.0 if motion.x > 300.0 else 1.0\n"
    path, line = fairway(tmp_path, f"{late}    bad = motion.u / zero")
    path.write_text(path.read_text().replace("-delay,", "-delay - bad,"))
    ships = gymnasium.make_vec(COURSE, num_envs=3, task=path, dt=10.0, **SHIP)
    with pytest.raises(
        InputError,
        match=rf"reward_delay: expected a finite number, got -inf in lane 0 at step \d+"
        rf"; .*line {line + 1}, in step: FloatingPointError: divide by zero",
    ):
        sail(ships)


def test_a_variable_that_may_be_unset_is_refused_with_its_line(tmp_path):
    lines = "    if motion.x < 300.0:\n        late = 1.0\n    motion.u * late"
    path, line = fairway(tmp_path, lines)
    message = rf"fairway.py, line {line + 2}: expected variables that .* got 'late'"
    with pytest.raises(InputError, match=message):
        gymnasium.make(COURSE, task=path, **SHIP)
