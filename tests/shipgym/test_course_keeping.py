"""The course-keeping environment."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import shipgym
from shipgym.engine.motion import Motion, Ship
from shipgym.ships import Envelope
from shipgym.tasks import control_interval
from shipgym.tasks.contract import Interval
from shipgym.tasks.scales import OBSERVATION_NAMES, observation_scales
from shipgym.tasks.steering import Weights, integrated, steering_reward

ID = "shipgym/CourseKeeping-v0"


@pytest.fixture(scope="module")
def mariner():
    return shipgym.load_model("mariner")


def make(**options):
    return gymnasium.make(ID, **{"model": "mariner", **options})


def steer(env, policy, seed=0):
    """One episode: rewards, infos and how it ended."""
    observation, _ = env.reset(seed=seed)
    rewards, infos, over = [], [], False
    while not over:
        observation, reward, terminated, truncated, info = env.step(policy(observation))
        rewards.append(reward)
        infos.append(info)
        over = terminated or truncated
    return np.array(rewards), infos, terminated, truncated


def pd(observation):
    """A plain proportional and differential autopilot."""
    error = np.arctan2(observation[0], observation[1])
    return np.array(
        [np.clip(1.5 * error - 0.7 * observation[2], -1.0, 1.0)], dtype=np.float32
    )


def test_observation_is_the_scaled_physical_state():
    env = make().unwrapped
    observation, _ = env.reset(seed=4)
    for _ in range(40):
        observation, *_ = env.step(pd(observation))
    state, scales = env.physical_state(), env.observation_scales
    error = (state["set_point"] - state["psi"] + np.pi) % (2 * np.pi) - np.pi
    seen = dict(zip(env.observation_names, observation * scales, strict=True))
    assert env.observation_names == OBSERVATION_NAMES
    assert seen["heading_error_sin"] == pytest.approx(np.sin(error), abs=1e-6)
    assert seen["heading_error_cos"] == pytest.approx(np.cos(error), abs=1e-6)
    for name, value in (
        ("yaw_rate", "r"),
        ("sway", "v"),
        ("surge", "u"),
        ("rudder", "delta"),
    ):
        assert seen[name] == pytest.approx(state[value], rel=1e-5, abs=1e-9)


def test_the_ship_is_the_one_that_the_model_simulates(mariner):
    env = make(course_change_deg=0.0).unwrapped
    env.reset(seed=1)
    start = [env.physical_state()[name] for name in mariner.state_names]
    commands = np.sin(np.arange(100.0))[:, None] * 0.5
    for command in commands:
        env.step(command.astype(np.float32))
    trial = mariner.simulate(
        commands.astype(np.float32) * mariner.steering.limit, env.dt, start
    )
    for name in mariner.state_names:
        assert env.physical_state()[name] == pytest.approx(
            trial[name][-1], rel=1e-5, abs=1e-7
        )


def test_one_step_a_control_interval_is_accurate_enough(mariner):
    """Against 20 steps an interval the heading stays within 0.1 deg over 100 s of wild
    steering."""
    commands = np.repeat(np.random.default_rng(0).uniform(-0.5, 0.5, 100), 1)[:, None]
    dt = control_interval(mariner)
    coarse, fine = (
        mariner.simulate(commands, dt),
        mariner.simulate(np.repeat(commands, 20, axis=0), dt / 20),
    )
    assert np.degrees(np.abs(coarse["psi"] - fine["psi"][::20])).max() < 0.1


def test_the_cost_is_the_classical_one_and_the_sum_of_its_parts(mariner):
    env = make(bounded=False).unwrapped
    observation, _ = env.reset(seed=2)
    for _ in range(30):
        before = env.physical_state()
        observation, reward, *_, info = env.step(pd(observation))
        after = env.physical_state()
        error = before["set_point"] - after["psi"]
        rate = (after["delta"] - before["delta"]) / env.dt * 160.93 / 7.7175
        unit = np.radians(30.0)
        cost = (
            (error / unit) ** 2
            + 0.1 * (after["delta"] / unit) ** 2
            + 0.01 * (rate / unit) ** 2
        )
        assert info["cost"] == pytest.approx(cost, rel=1e-9)
        assert reward == -info["cost"]
        assert reward == pytest.approx(
            sum(info[name] for name in info if name.startswith("reward_"))
        )


def test_losing_control_ends_the_episode_and_never_pays():
    hard_over = lambda _: np.ones(1, dtype=np.float32)  # noqa: E731
    lost, infos, terminated, truncated = steer(make(), hard_over)
    assert terminated
    assert not truncated
    assert abs(infos[-1]["heading_error"]) > np.radians(90)
    assert infos[-1]["reward_end"] < 0.0
    idle = steer(
        make(max_heading_error_deg=180.0), lambda _: np.zeros(1, dtype=np.float32)
    )[0]
    kept = steer(make(), pd)[0]
    assert lost.sum() < idle.sum() < kept.sum()


def test_leaving_the_training_envelope_is_reported(mariner):
    calm = Envelope.from_samples(
        *(
            np.random.default_rng(0).normal(m, s, 500)
            for m, s in ((7.7, 0.05), (0.0, 0.02), (0.0, 2e-4), (0.0, 0.01))
        )
    )
    env = make(model=replace(mariner, envelope=calm), max_envelope_distance=1e6)
    _, infos, *_ = steer(env, pd)
    assert infos[-1]["extrapolating"] == (infos[-1]["envelope_distance"] > 1.0)
    assert any(info["extrapolating"] for info in infos)
    _, infos, terminated, _ = steer(make(model=replace(mariner, envelope=calm)), pd)
    assert terminated
    assert infos[-1]["envelope_distance"] > 5.0
    assert not any(
        info["extrapolating"] for info in steer(make(), pd)[1]
    )  # no envelope is known


@settings(max_examples=25, deadline=None)
@given(
    st.integers(0, 2**31 - 1),
    st.lists(st.floats(-1.0, 1.0, width=32), min_size=1, max_size=40),
)
def test_observations_stay_in_their_space_and_are_never_nan(seed, actions):
    env = make(max_heading_error_deg=180.0).unwrapped
    env.reset(seed=seed)
    for action in actions * 10:
        observation, reward, *_ = env.step(np.array([action], dtype=np.float32))
        assert observation in env.observation_space
        assert np.isfinite(reward)


def test_a_model_that_runs_away_ends_the_episode_with_numbers(mariner):
    wild = replace(
        mariner,
        coefficients={**mariner.coefficients, "N_r": 0.05, "N_vvr": 9.0, "N_v": 0.1},
    )
    env = make(model=wild).unwrapped
    rewards, _, terminated, _ = steer(env, lambda _: np.ones(1, dtype=np.float32))
    assert terminated
    assert np.all(np.isfinite(rewards))
    assert np.all(np.isfinite(list(env.physical_state().values())))


def test_scales_follow_the_ship(mariner):
    assert dict(zip(OBSERVATION_NAMES, observation_scales(mariner), strict=True)) == {
        "heading_error_sin": 1.0,
        "heading_error_cos": 1.0,
        "yaw_rate": pytest.approx(7.7175 / 160.93),
        "sway": 7.7175,
        "surge": 7.7175,
        "rudder": pytest.approx(np.radians(40)),
        "last_command": pytest.approx(np.radians(40)),
        "heading_error_integral": pytest.approx(np.radians(10) * 10 * 160.93 / 7.7175),
    }


SHIP = Ship(160.0, 8.0, 0.6, 0.05, 0.0, 1.5, np.inf, 8.0)
small = st.floats(-0.6, 0.6)


def interval(**given):
    return Interval(**dict.fromkeys(Interval._fields, 0.0) | {"dt": 0.5} | given)


@given(small, small, small, st.booleans())
def test_costs_of_steering_are_squares_by_their_scales(delta, before, heel, outside):
    """In 30 degrees of rudder, 30 degrees of it a ship length sailed (20 s), 15 degrees
    of heel."""
    weights = Weights(
        rudder_weight=0.2, rudder_rate_weight=0.03, roll_weight=0.4, roll_scale_deg=15.0
    )
    weights = weights._replace(envelope_weight=0.7)
    motion = Motion(*[0.0] * 7, heel, 0.0, delta, 0.0)
    found = steering_reward(
        motion,
        interval(rudder_before=before, extrapolating=float(outside)),
        SHIP,
        weights,
    )
    scale = np.pi / 6
    assert found.rudder == pytest.approx(-0.2 * (delta / scale) ** 2)
    assert found.rudder_rate == pytest.approx(
        -0.03 * ((delta - before) / 0.5 * 20.0 / scale) ** 2
    )
    assert found.roll == pytest.approx(-0.4 * (heel / (np.pi / 12)) ** 2)
    assert found.envelope == (-0.7 if outside else 0.0)


@given(st.floats(-30.0, 30.0), st.floats(-1.0, 1.0))
def test_the_integral_gathers_small_errors_up_to_its_bound(integral, error):
    """Up to 10 degrees; its bound is 10 degrees for the time to sail 10 ship lengths,
    200 s."""
    bound = np.radians(10.0) * 200.0
    gathered = integral + (0.5 * error if abs(error) <= np.radians(10.0) else 0.0)
    found = integrated(integral, error, interval(), SHIP, Weights())
    assert found == pytest.approx(np.clip(gathered, -bound, bound))
