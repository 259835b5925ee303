"""Integral line of sight over heading autopilots."""

import numpy as np
import pytest

from agents import (
    LQ,
    LQG,
    PID,
    IntegralLineOfSight,
    check_controller,
    load_agent,
)
from shipgym.envs.engine import Engine
from shipgym.errors import InputError
from shipgym.models import load_model
from shipgym.sea import Current, Weather
from shipgym.tasks import path_following_task

MARINER = load_model("mariner")
LENGTH, SPEED = MARINER.particulars["length"], MARINER.particulars["speed"]
CURRENT = 1.5
STRAIGHT = path_following_task(
    waypoints=[(0.0, 0.0), (300.0 * LENGTH, 0.0)],
    sea=Weather(current=Current(CURRENT, 90.0)),
    episode_steps=2600,
)


def cross_track(controller, task, n=1):
    """Cross-track errors, m, shape (n_steps, n), and rewards summed, shape (n,)."""
    engine = Engine(MARINER, n, task)
    seen, state, errors, total = engine.reset(np.arange(n)), None, [], np.zeros(n)
    for step in range(task.episode_steps):
        action, state = controller.predict(seen, state, np.full(n, step == 0))
        seen, *_ = engine.step(action)
        total -= engine.info("cost")
        errors.append(engine.info("cross_track").copy())
    return np.array(errors), total


def test_without_integral_the_offset_is_the_lookahead_times_the_tangent_of_crab():
    errors, _ = cross_track(LQ.from_model(MARINER), STRAIGHT)  # by the course shown
    crab = np.arcsin(CURRENT / SPEED)
    assert errors[-1] == pytest.approx(2.5 * LENGTH * np.tan(crab), rel=0.02)


@pytest.mark.parametrize("pilot", [LQ, PID, LQG])
def test_a_steady_current_leaves_no_error_whichever_autopilot_is_led(pilot):
    guided = IntegralLineOfSight.from_model(
        MARINER, autopilot=pilot.from_model(MARINER)
    )
    errors, _ = cross_track(guided, STRAIGHT)
    assert np.abs(errors).max() > 0.3 * LENGTH
    assert np.abs(errors[-100:]).max() < 1e-3 * LENGTH


def test_paths_with_turns_in_a_current_cost_less_with_the_integral():
    task = path_following_task(sea=Weather(current=Current(CURRENT)))
    integral, plain = (
        cross_track(pilot.from_model(MARINER), task, 16)[1]
        for pilot in (IntegralLineOfSight, LQ)
    )
    assert integral.mean() > 0.85 * plain.mean()  # rewards are negative


@pytest.mark.parametrize("pilot", [LQ, LQG])
def test_it_is_a_controller_and_a_file(pilot, tmp_path):
    guided = IntegralLineOfSight.from_model(
        MARINER, autopilot=pilot.from_model(MARINER)
    )
    check_controller(guided, MARINER, path_following_task(noise=1.0), n_steps=20)
    guided.save(tmp_path / "guided.json")
    again = load_agent(tmp_path / "guided.json", MARINER)
    assert type(again) is IntegralLineOfSight
    assert type(again.autopilot) is pilot
    task = path_following_task(episode_steps=50)
    assert np.array_equal(*(cross_track(one, task, 2)[0] for one in (guided, again)))
    assert guided.margins_on(MARINER) == guided.autopilot.margins


class Learned:
    """A policy that is none of ours."""

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.clip(observation[..., :1] - observation[..., 2:3], -1.0, 1.0), state


def test_it_leads_controllers_that_keep_a_heading():
    for autopilot in (Learned(), IntegralLineOfSight.from_model(MARINER)):
        with pytest.raises(
            InputError, match="autopilot: expected a controller that keeps a heading"
        ):
            IntegralLineOfSight.from_model(MARINER, autopilot=autopilot)
