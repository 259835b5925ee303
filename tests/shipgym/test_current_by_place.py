"""A current that differs from place to place, of a file of the sea or of a task."""

import gymnasium
import numpy as np
import pytest

from shipgym import (
    Current,
    CurrentField,
    InputError,
    Weather,
    check_task,
    load_model,
    manoeuvres,
)

COURSE = "shipgym/CourseKeeping-v0"
EVEN = "def current(x, y):\n    return 0.0, 0.5\n"
STEP = """from shipgym.tasks.contract import pick

def current(x, y):
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


def by_place(path):
    return Weather(current=CurrentField(path), name="river")


def voyage(sea, steps=40, **options):
    env = gymnasium.make(COURSE, sea=sea, **options).unwrapped
    states = []
    env.reset(seed=0)
    for k in range(steps):
        states.append(env.physical_state())
        env.step(np.array([0.3 * np.sin(k / 4.0)], dtype=np.float32))
    return {name: np.array([s[name] for s in states]) for name in states[0]}


def test_one_that_is_the_same_everywhere_is_a_uniform_current(tmp_path):
    found = voyage(written(tmp_path, EVEN))
    uniform = voyage(Weather(current=Current(0.5, towards_deg=90.0)))
    assert found.keys() == uniform.keys()
    for name, values in uniform.items():
        np.testing.assert_allclose(found[name], values, rtol=1e-9, atol=1e-9)


def test_velocity_over_ground_goes_on_where_the_current_changes(tmp_path):
    """A ship who enters faster water has momentum; what changes is her velocity through
    the water, by the whole difference."""
    found = voyage(by_place(written(tmp_path, STEP)), 60)
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


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = 1\n", "river.py: expected a function current.*no 'current'"),
        ("def current(x):\n    return 0.0, 0.0\n", "river.py: current: expected"),
        ("def current(x, y):\n    return 1.0\n", "line 1, in current: .*number"),
        ("def current(x, y):\n    return y / 0.0, 0.0\n", "line 2, in current: Zero"),
        ("def current(x, y):\n    return 0.0, float('nan')\n", "expected two finite"),
        ("def current(x, y):\n    return 0.0, 1.0, 2.0\n", "line 1, .* two finite"),
    ],
)
def test_files_that_do_not_fit_are_refused(tmp_path, text, message):
    path = written(tmp_path, text)
    (problem,) = check_task("CourseKeeping", sea=path).problems[:1]
    with pytest.raises(AssertionError, match=message):
        raise AssertionError(problem)


def test_where_it_cannot_be_used_it_is_refused(tmp_path):
    sea = by_place(written(tmp_path, EVEN))
    with pytest.raises(InputError, match=r"got one by place, .*river.py"):
        manoeuvres.zigzag(load_model("mariner"), weather=sea)
    with pytest.raises(InputError, match="one current by place in all episodes"):
        gymnasium.make(COURSE, sea=["calm", sea])
    with pytest.raises(InputError, match="weather current: unknown key 'file'"):
        Weather.from_dict(sea.to_dict())
