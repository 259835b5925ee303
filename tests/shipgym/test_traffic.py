"""Other ships in a task: how they sail, how they are met, how they are drawn."""

import re
from math import pi
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from stable_baselines3 import PPO

from shipgym import InputError, ShipVecEnv, check_task, load_model
from shipgym.engine.motion import Motion
from shipgym.tasks import traffic
from shipgym.tasks.encounters import IMAZU
from shipgym.tasks.shapes import Circle, Line, ShipOutline
from shipgym.tasks.traffic import Target

ROOT = Path(__file__).parents[2]
ENCOUNTER = (ROOT / "shipgym" / "examples" / "encounter.py").read_text(encoding="utf-8")
COURSE = "shipgym/CourseKeeping-v0"


def sailing(x, y, psi, u):
    return Motion(x, y, psi, u, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def sail_until_the_end(env):
    env.reset(seed=0)
    over = False
    while not over:
        *_, over, _, _ = env.step(np.zeros(1, dtype=np.float32))


@pytest.mark.interpreted
def test_a_vessel_sails_as_the_model_is_simulated():
    mariner = load_model("mariner")
    sail = traffic.vessel(mariner, steps=1)
    motion, dt = sail.start, 1.0
    expected = mariner.simulate(np.full((50, 1), 0.2), dt)
    for _ in range(50):
        motion = sail(motion, 0.2, sail.start.n, dt)
    for name in ("x", "y", "psi", "u", "v", "r"):
        assert getattr(motion, name) == pytest.approx(expected[name][-1], rel=1e-9)


@pytest.mark.interpreted
@pytest.mark.parametrize(
    ("other", "dcpa", "tcpa", "kind"),
    [
        (Target(2000.0, 0.0, pi, 5.0), 0.0, 200.0, traffic.HEAD_ON),
        (Target(1000.0, 1000.0, -pi / 2, 5.0), 0.0, 200.0, traffic.GIVE_WAY),
        (Target(1000.0, -1000.0, pi / 2, 5.0), 0.0, 200.0, traffic.STAND_ON),
        (Target(500.0, 0.0, 0.0, 2.5), 0.0, 200.0, traffic.OVERTAKING),
        (Target(-500.0, 0.0, 0.0, 7.5), 0.0, 200.0, traffic.OVERTAKEN),
        (Target(-500.0, 0.0, 0.0, 2.5), 0.0, -200.0, traffic.CLEAR),
        (Target(2000.0, 800.0, pi, 5.0), 800.0, 200.0, traffic.CLEAR),
    ],
)
def test_encounters_by_the_rules(other, dcpa, tcpa, kind):
    """Own ship at 5 m/s northwards, at the origin."""
    near = traffic.approach(sailing(0.0, 0.0, 0.0, 5.0), other)
    assert near.dcpa == pytest.approx(dcpa, abs=1e-3)
    assert near.tcpa == pytest.approx(tcpa)
    assert traffic.encounter(near, 300.0, 600.0) == kind
    later = traffic.advance(other, tcpa)
    assert np.hypot(later.x - 5.0 * tcpa, later.y) == pytest.approx(dcpa, abs=1e-3)


def test_the_cases_of_imazu_are_collisions():
    """A ship who keeps her course is met by the first in each case."""
    assert IMAZU.shape == (22, 3)
    n_others = np.isfinite(IMAZU).sum(axis=1).tolist()
    assert n_others == [1] * 4 + [2] * 7 + [3] * 11
    task = ROOT / "shipgym" / "examples" / "encounter.py"
    ship = gymnasium.make(COURSE, task=task, dt=5.0, model="mariner", scatter=0.0)
    for case in range(1, 23):
        seen, _ = ship.reset(seed=0, options={"case": case})
        collided = False
        for _ in range(70):
            rudder = -3.0 * seen[:1] - seen[2:3]
            seen, _, collided, *_ = ship.step(np.clip(rudder, -1.0, 1.0))
            if collided:
                break
        assert collided, case


def test_the_example_is_a_task_of_one_screen_that_is_learned(tmp_path):
    assert ENCOUNTER.count("\n") < 122
    path = ROOT / "shipgym" / "examples" / "encounter.py"
    assert str(check_task(path, dt=5.0)) == "encounter: sound"
    ships = ShipVecEnv(COURSE, num_envs=4, seed=0, task=path, dt=5.0)
    agent = PPO("MlpPolicy", ships, n_steps=16, batch_size=32, n_epochs=1)
    agent.learn(128)
    assert agent.num_timesteps == 128


def test_a_target_that_leaves_the_physical_range_is_named(tmp_path):
    tug = re.search(
        r'```python\n("""Tug.*?)```',
        (ROOT / "docs/ship_of_your_own.md").read_text(),
        re.S,
    )[1]
    wild = tug.replace("X_uu: float = -0.0025", "X_uu: float = 0.5")
    (tmp_path / "tug.py").write_text(wild.replace('"tug"', '"wild tug"'))
    path = tmp_path / "encounter.py"
    path.write_text(ENCOUNTER.replace('"mariner"', repr(str(tmp_path / "tug.py"))))
    message = (
        r"encounter.py, line \d+, in step: State\.[a-z.1]+: expected a target ship"
        r" within the physical range.* at step \d+.*tug.py, line \d+, in accelerations"
    )
    with pytest.raises(InputError, match=message):
        sail_until_the_end(gymnasium.make(COURSE, task=path, dt=5.0))
    (problem,) = check_task(path, dt=5.0).problems
    assert re.search(message, problem)


def test_a_task_draws_what_it_wants_shown(tmp_path):
    path = tmp_path / "encounter.py"
    path.write_text(ENCOUNTER)
    plain = ENCOUNTER[: ENCOUNTER.index("def draw(")]
    (tmp_path / "plain.py").write_text(plain)
    pictures = []
    for name in ("encounter.py", "plain.py"):
        env = gymnasium.make(
            COURSE, task=tmp_path / name, dt=5.0, case=2, render_mode="rgb_array"
        )
        env.reset(seed=0)
        pictures.append(env.render())
    assert pictures[0].shape == (600, 600, 3)
    assert np.any(pictures[0] != pictures[1])
    many = gymnasium.make_vec(
        COURSE, 2, task=path, dt=5.0, case=2, render_mode="rgb_array"
    )
    many.reset(seed=0)
    np.testing.assert_array_equal(many.render()[0], pictures[0])
    path.write_text(ENCOUNTER.replace("    return shapes\n", "    return [1.0]\n"))
    (problem,) = check_task(path, dt=5.0).problems
    assert "in draw: expected a list of Line, Circle" in problem


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Line([(0.0, 0.0)]), "Line: points: expected two points or more"),
        (lambda: Circle(0.0, 0.0, -1.0), "Circle: radius: expected a number > 0"),
        (lambda: Circle(0.0, 0.0, 1.0, "pink"), "Circle: colour"),
        (
            lambda: ShipOutline(0.0, np.nan, 0.0, 1.0),
            "ShipOutline: x, y, psi: expected",
        ),
    ],
)
def test_shapes_that_cannot_be_drawn_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()
