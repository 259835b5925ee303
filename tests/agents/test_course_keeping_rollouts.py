"""Rollouts over many ships: complete, repeatable, clear about missing answers."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from agents import LQ, PID, sail, step_response
from shipgym.errors import InputError
from shipgym.models import load_model
from shipgym.tasks import course_keeping_task

MARINER = load_model("mariner")
PILOT = PID.from_model(MARINER)
SHORT = course_keeping_task(episode_steps=150)


class Helmsman:
    """A user's controller: what `answer` makes of the number of ships."""

    def __init__(self, answer):
        self.answer = answer

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return self.answer(len(observation)), state


def with_yaw(factors):
    """The Mariner with other yaw coefficients."""
    coefficients = dict(MARINER.coefficients)
    for name, factor in factors.items():
        coefficients[name] *= factor
    return replace(MARINER, coefficients=coefficients)


TURNED = with_yaw({"N_d": -1.0, "Y_d": -1.0})  # rudder to the other side


def fleet(n, seed=0):
    """Ships whose yaw coefficients scatter by 5 per cent."""
    rng = np.random.default_rng(seed)
    yaw = [name for name in MARINER.coefficients if name.startswith("N_")]
    scatter = 1.0 + 0.05 * rng.standard_normal((n, len(yaw)))
    return [with_yaw(dict(zip(yaw, row, strict=True))) for row in scatter]


def test_an_episode_depends_on_its_ship_and_seed_alone():
    ships, seeds = fleet(70), np.arange(70) + 5
    together = sail(PILOT, ships, SHORT, seeds)
    again = sail(PILOT, ships, SHORT, seeds)
    np.testing.assert_array_equal(together.cost, again.cost)
    for i in (0, 33, 69):
        alone = sail(PILOT, ships[i], SHORT, seeds=[seeds[i]])
        assert alone.cost[0] == together.cost[i]
        assert alone.rudder_travel_deg_min[0] == together.rudder_travel_deg_min[i]


def test_costs_are_those_of_the_environment():
    assert sail(PILOT, MARINER, SHORT.changed(dt=0.5), seeds=0).duration_s == 75.0
    env = gymnasium.make("shipgym/CourseKeeping-v0", model=MARINER, episode_steps=150)
    observation, _ = env.reset(seed=0)
    cost, errors, over, state = 0.0, [], False, None
    while not over:
        action, state = PILOT.predict(observation, state)
        observation, _, terminated, truncated, info = env.step(action)
        cost += info["cost"]
        errors.append(info["heading_error"])
        over = terminated or truncated
    episode = sail(PILOT, MARINER, SHORT, seeds=0)
    assert episode.cost == pytest.approx(cost, rel=1e-6)
    assert episode.heading_rmse_deg == pytest.approx(
        np.degrees(np.sqrt(np.mean(np.square(errors)))), rel=1e-6
    )


def test_a_lost_ship_is_counted_and_pays_for_the_rest_of_the_episode():
    episodes = sail(PILOT, [MARINER, TURNED, MARINER], SHORT, seeds=[1, 1, 1])
    assert episodes.terminated.tolist() == [False, True, False]
    assert episodes.cost[0] == episodes.cost[2] < 0.05 * episodes.cost[1]
    remaining = 150.0 - episodes.duration_s[1]
    assert 0.0 < remaining < 150.0
    assert episodes.cost[1] > 9.0 * remaining


def test_step_responses_of_many_ships_are_those_of_each():
    ships = fleet(5)
    together = step_response(PILOT, ships, 15.0)
    assert together.t[-1] == pytest.approx(16.0 * 160.93 / 7.7175, abs=1.0)
    assert together.heading.shape == together.rudder.shape == (5, len(together.t))
    assert np.all(together.heading[:, 0] == 0.0)
    np.testing.assert_array_equal(
        step_response(PILOT, ships[3], 15.0).heading[0], together.heading[3]
    )
    assert np.degrees(together.heading[:, -1]) == pytest.approx(
        np.full(5, 15.0), abs=0.5
    )
    assert np.ptp(together.heading, axis=0).max() > np.radians(0.1)


def test_a_step_response_is_the_environments_own_turn():
    """Without noise a set-point of the task is the same as the one shown here."""
    from shipgym.envs.engine import Engine

    engine = Engine(MARINER, 1)
    observations = engine.reset([3])
    first = engine.physical_state()
    step_deg = float(np.degrees(first["set_point"][0] - first["psi"][0]))
    for pilot in (PILOT, LQ.from_model(MARINER)):
        observations = engine.reset([3])
        turned, state = [0.0], None
        for _ in range(90):
            action, state = pilot.predict(observations, state)
            observations, *_ = engine.step(action)
            turned.append(float(engine.physical_state()["psi"][0] - first["psi"][0]))
        shown = step_response(pilot, MARINER, step_deg, duration=90.0)
        np.testing.assert_allclose(shown.heading[0], turned, atol=2e-6)


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (lambda n: np.full((n, 1), np.nan), r"step 0: .*got \[nan\] for ship 0"),
        (lambda n: np.zeros(n), r"step 0: .*of shape \(2, 1\), got \(2,\)"),
        (lambda n: [["port"]] * n, "step 0: expected an array of numbers, got list"),
        (lambda n: None, "Helmsman.predict: step 0: expected"),
    ],
)
def test_a_controller_that_gives_no_command_is_named(answer, message):
    with pytest.raises(InputError, match=message):
        sail(Helmsman(answer), MARINER, SHORT, seeds=[0, 1])
    with pytest.raises(InputError, match=message):
        step_response(Helmsman(answer), [MARINER, MARINER])


def test_a_model_found_unstable_is_steered_only_where_asked():
    marked = replace(MARINER, provenance={"stable": False})
    for call in (sail, step_response):
        with pytest.raises(InputError, match="found unstable when it was identified"):
            call(PILOT, marked)
    with pytest.warns(UserWarning, match="found unstable when it was identified"):
        asked = sail(PILOT, marked, task=SHORT, allow_unstable=True)
    plain = sail(PILOT, MARINER, task=SHORT)
    np.testing.assert_array_equal(asked.cost, plain.cost)


def test_seeds_are_one_for_each_model_or_for_all():
    ships = [MARINER, TURNED, MARINER]
    with pytest.raises(InputError, match=r"seeds: .* each of 3 models, .* got 2"):
        sail(PILOT, ships, SHORT, seeds=[0, 1])
