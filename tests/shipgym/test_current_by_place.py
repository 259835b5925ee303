"""A current that differs from place to place, of a task."""

import gymnasium
import numpy as np
import pytest

COURSE = "shipgym/CourseKeeping-v0"
STEP = """
from shipgym.tasks.course_keeping import *
from shipgym.tasks.contract import pick

def current(x, y, settings):
    return 0.0, pick(y > 100.0, 1.0, 0.0)
"""
OWN = """
from shipgym.tasks.course_keeping import *

def current(x, y, settings):
    return 0.0, settings.course_change_deg * x / 1000.0
"""


def written(folder, text):
    path = folder / "river.py"
    path.write_text(text, encoding="utf-8")
    return str(path)


def voyage(sea, steps=40, **options):
    env = gymnasium.make(COURSE, sea=sea, **options).unwrapped
    states = []
    env.reset(seed=0)
    for k in range(steps):
        states.append(env.physical_state())
        env.step(np.array([0.3 * np.sin(k / 4.0)], dtype=np.float32))
    return {name: np.array([s[name] for s in states]) for name in states[0]}


def test_velocity_over_ground_goes_on_where_the_current_changes(tmp_path):
    """A ship who enters faster water has momentum; what changes is her velocity through
    the water, by the whole difference."""
    found = voyage("calm", 60, task=written(tmp_path, STEP))
    cosine, sine = np.cos(found["psi"]), np.sin(found["psi"])
    east = found["u"] * sine + found["v"] * cosine + found["current_east"]
    enters = int(np.argmax(found["current_east"] > 0.0))
    assert enters > 0
    assert found["y"][enters] > 100.0 >= found["y"][enters - 1]
    assert abs(east[enters] - east[enters - 1]) < 0.1
    change = np.diff(found["u"] * sine + found["v"] * cosine)[enters - 1]
    assert change == pytest.approx(-1.0, abs=0.1)
    moved = np.diff(found["y"])[enters:]
    assert moved == pytest.approx(east[enters:-1], rel=0.05)  # dt is 1 s


def test_a_task_has_one_by_its_settings(tmp_path):
    path = written(tmp_path, OWN)
    found = voyage("calm", task=path, course_change_deg=0.5)
    assert found["current_east"] == pytest.approx(0.5 * found["x"] / 1000.0)
    assert np.ptp(found["x"]) > 1.0
    many = gymnasium.make_vec(COURSE, num_envs=3, task=path, course_change_deg=0.5)
    many.reset(seed=0)
    for k in range(39):
        many.step(np.full((3, 1), 0.3 * np.sin(k / 4.0), dtype=np.float32))
    state = many.unwrapped.physical_state()
    assert state["x"][0] == found["x"][-1]
    assert state["current_east"][0] == found["current_east"][-1]
