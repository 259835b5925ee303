"""Course autopilots follow paths by the heading error to the line of sight."""

import gymnasium
import numpy as np
import pytest

from agents import LQ, PID
from shipgym import load_model


def sailed(controller, model, n=64, **options):
    """Shares of episodes with success, of those aground, of time in the corridor."""
    env = gymnasium.make_vec(
        "shipgym/PathFollowing-v0",
        num_envs=n,
        model=model,
        autoreset_mode="NextStep",
        **options,
    )
    controller.check_fits(env.observation_names, env.observation_scales)
    seen, _ = env.reset(seed=0)
    steps = within = 0
    over, success, grounded = np.zeros((3, n), dtype=np.bool_)
    while not over.all():
        seen, _, terminated, truncated, infos = env.step(controller.predict(seen)[0])
        steps, within = (
            steps + (~over).sum(),
            within + (infos["in_corridor"] & ~over).sum(),
        )
        success |= infos["success"] & ~over
        grounded |= infos["grounded"] & ~over
        over |= terminated | truncated
    return success.mean(), grounded.mean(), within / steps


@pytest.mark.parametrize("name", ["mariner", "kvlcc2", "container"])
@pytest.mark.parametrize("design", [PID, LQ])
def test_paths_in_calm_water_are_followed_to_their_end(name, design):
    model = load_model(name)
    success, grounded, within = sailed(design.from_model(model), model)
    assert success == 1.0
    assert grounded == 0.0
    assert within > 0.98


@pytest.mark.parametrize("name", ["mariner", "kvlcc2"])
def test_most_paths_in_a_rough_sea_too(name):
    model = load_model(name)
    success, grounded, within = sailed(PID.from_model(model), model, sea="rough")
    assert success >= 0.95
    assert grounded == 0.0
    assert within > 0.95


def test_a_ship_left_to_herself_runs_aground():
    class Nothing(PID):
        def predict(
            self, observation, state=None, episode_start=None, deterministic=True
        ):
            return np.zeros((len(observation), 1), np.float32), state

    model = load_model("mariner")
    success, grounded, _ = sailed(Nothing(**vars(PID.from_model(model))), model)
    assert success < 0.05
    assert grounded > 0.9
