"""Options of the environments: instruments, observations, commands, seas, depth, and
ships that differ."""

import re
from dataclasses import replace
from pathlib import Path

import document_settings
import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import FrameStackObservation

import shipgym
from shipgym import InputError
from shipgym.envs.randomisation import N_SPEEDS, POOL_SIZE
from shipgym.instruments.noise import SEA_TRIAL
from shipgym.sea import Waves, Weather
from shipgym.ships import Envelope
from shipgym.tasks import course_keeping_task, read_definition

pytestmark = pytest.mark.interpreted

COURSE, PATH = "shipgym/CourseKeeping-v0", "shipgym/PathFollowing-v0"
UNBOUND = {"course_change_deg": 0.0, "max_heading_error_deg": 180.0}


def make(name=COURSE, **options):
    return gymnasium.make(name, **{"model": "mariner", **options}).unwrapped


def many(num_envs, name=COURSE, **options):
    return gymnasium.make_vec(
        name, num_envs=num_envs, **{"model": "mariner", **options}
    )


def idle(env):
    shape = env.action_space.shape
    return np.zeros(shape, dtype=np.float32)


def misreadings(env, seen):
    """What is shown less what is so, SI units, by name."""
    state, shown = (
        env.physical_state(),
        dict(zip(env.observation_names, seen.T, strict=True)),
    )
    scales = dict(zip(env.observation_names, env.observation_scales, strict=True))
    wrong = {
        name: shown[name] * scales[name] - state[channel]
        for name, channel in (("yaw_rate", "r"), ("sway", "v"), ("surge", "u"))
    }
    error = np.arctan2(shown["heading_error_sin"], shown["heading_error_cos"])
    wrong["psi"] = (error - state["set_point"] + state["psi"] + np.pi) % (
        2 * np.pi
    ) - np.pi
    return wrong


@pytest.mark.compiled
@pytest.mark.parametrize("noise", [1.0, 3.0])
def test_noise_has_the_deviation_of_a_sea_trials_sensors(noise):
    """Within 5 standard errors of a deviation, sigma / sqrt(2 n)."""
    count = 4000
    env = many(count, noise=noise, **UNBOUND)
    env.reset(seed=0)
    first = misreadings(env, env.step(idle(env))[0])
    second = misreadings(env, env.step(idle(env))[0])
    for name, channel in (
        ("psi", "heading"),
        ("yaw_rate", "yaw_rate"),
        ("sway", "speed"),
        ("surge", "speed"),
    ):
        deviation = noise * SEA_TRIAL[channel]
        assert np.std(second[name]) == pytest.approx(
            deviation, rel=5.0 / np.sqrt(2 * count)
        ), name
        assert abs(np.mean(second[name])) < 5.0 * deviation / np.sqrt(count)
        assert abs(np.corrcoef(first[name], second[name])[0, 1]) < 5.0 / np.sqrt(count)
    assert abs(np.corrcoef(second["sway"], second["surge"])[0, 1]) < 5.0 / np.sqrt(
        count
    )


def waves_shown(measurement, **options):
    """Part of the variance of first-order yaw rate and heading that is shown, half of
    64 ships show less."""
    env = many(
        64,
        sea=Weather(waves=Waves(3.0, 9.0)),
        measurement=measurement,
        **options,
        **UNBOUND,
    )
    env.reset(seed=1)
    wrong, waves = [], []
    for _ in range(400):
        found, state = misreadings(env, env.step(idle(env))[0]), env.physical_state()
        wrong.append([found["yaw_rate"], found["psi"]])
        waves.append([state["r_wave"], state["psi_wave"]])
    shown, first_order = (np.var(np.array(one)[100:], axis=0) for one in (wrong, waves))
    return np.median(shown / first_order, axis=-1)


@pytest.mark.compiled
def test_a_filter_takes_most_of_the_waves_out_of_what_is_shown():
    """Four fifths of its variance; raw shows it all."""
    rate, heading = waves_shown("filtered", noise=1e-6)
    assert rate < 0.2
    assert heading < 0.25
    assert waves_shown("raw") == pytest.approx([1.0, 1.0], rel=1e-6)


def test_roll_is_observed_and_priced_where_it_is_asked_for():
    env = make(model="container", roll=True, roll_weight=2.0, sea="moderate", **UNBOUND)
    env.reset(seed=0)
    names = env.observation_names
    assert names[-2:] == ("roll", "roll_rate")
    heels = []
    for k in range(150):
        order = 1.0 if k % 50 < 25 else -1.0
        seen, _, terminated, _, info = env.step(np.array([order], dtype=np.float32))
        state = env.physical_state()
        shown = dict(zip(names, seen * env.observation_scales, strict=True))
        assert shown["roll"] == pytest.approx(state["phi"], abs=1e-6)
        assert shown["roll_rate"] == pytest.approx(state["p"], abs=1e-6)
        assert info["reward_roll"] == pytest.approx(
            -2.0 * (state["phi"] / np.radians(30.0)) ** 2, abs=1e-12
        )
        heels.append(state["phi"])
        assert not terminated
    assert np.ptp(heels) > np.radians(2.0)
    blind = make(model="container", sea="moderate")
    blind.reset(seed=0)
    assert "roll" not in blind.observation_names
    assert blind.step(np.ones(1, dtype=np.float32))[-1]["reward_roll"] == 0.0


@pytest.mark.parametrize(
    ("name", "model", "shown"),
    [
        (PATH, "kvlcc2", ("last_shaft_command",)),
        (COURSE, "tanker", ("shaft_speed", "last_shaft_command")),
    ],
)
def test_rudder_and_shaft_are_commanded(name, model, shown):
    env = make(name, model=model, action="rudder-shaft")
    assert env.observation_names[-len(shown) :] == shown
    env.reset(seed=0)
    speed = env.physical_state()["u"]
    for _ in range(40):
        seen, *_ = env.step(np.array([0.0, 0.5], dtype=np.float32))
    state = env.physical_state()
    by_name = dict(zip(env.observation_names, seen, strict=True))
    assert by_name["last_shaft_command"] == 0.5
    assert state["n_command"] == pytest.approx(0.5 * env.model.service_shaft_speed)
    assert state["u"] < 0.97 * speed
    if "n" in state:
        assert by_name["shaft_speed"] == pytest.approx(
            state["n"] / env.model.service_shaft_speed, rel=1e-6
        )
        assert (
            0.5 * env.model.service_shaft_speed
            < state["n"]
            < env.model.service_shaft_speed
        )


def test_a_tanker_goes_astern():
    """Her propeller is known there: ordered full astern she has hardly any way left
    after five minutes."""
    env = make(model="tanker", action="rudder-shaft", **UNBOUND)
    env.reset(seed=0)
    for _ in range(int(300 / env.dt)):
        env.step(np.array([0.0, -1.0], dtype=np.float32))
    assert env.physical_state()["n"] < 0.0
    assert env.physical_state()["u"] < 0.6 * env.model.particulars["speed"]


@pytest.mark.parametrize("repeat", [1, 4])
def test_a_step_holds_its_command_and_moves_it_at_a_limited_rate(repeat):
    rate = 0.07
    paced, plain = make(action_repeat=repeat, rate_limit=rate), make()
    assert paced.dt == repeat * plain.dt
    for env in (paced, plain):
        env.reset(seed=2)
    paced.action_space.seed(1)
    held, over = np.zeros(1, dtype=np.float32), False
    while not over:
        action = paced.action_space.sample()
        seen, reward, *ends, info = paced.step(action)
        rewards = costs = 0.0
        for _ in range(repeat):
            held = np.clip(action, held - rate, held + rate)
            expected, part, *expected_ends, last = plain.step(held)
            rewards, costs = rewards + part, costs + last["cost"]
            if any(expected_ends):
                break
        np.testing.assert_array_equal(seen, expected)
        assert (reward, info["cost"]) == pytest.approx((rewards, costs), rel=1e-12)
        assert info["heading_error"] == last["heading_error"]
        assert ends == expected_ends
        over = any(ends)


def test_frames_are_those_of_gymnasiums_wrapper():
    ours, theirs = make(frame_stack=4), FrameStackObservation(make(), 4)
    assert ours.observation_space == theirs.observation_space
    np.testing.assert_array_equal(ours.reset(seed=1)[0], theirs.reset(seed=1)[0])
    for _ in range(6):
        action = ours.action_space.sample()
        np.testing.assert_array_equal(ours.step(action)[0], theirs.step(action)[0])


def test_discrete_orders_are_the_continuous_ones():
    discrete, continuous = make(action="rudder-discrete"), make()
    assert discrete.action_space == gymnasium.spaces.Discrete(9)
    for env in (discrete, continuous):
        env.reset(seed=1)
    orders = {0: -1.0, 8: 1.0, 3: -0.1, 4: 0.0, 5: 0.1, 1: -0.5, 7: 0.5}
    for k, order in orders.items():
        ours = discrete.step(k)
        theirs = continuous.step(np.array([order], dtype=np.float32))
        np.testing.assert_array_equal(ours[0], theirs[0])
        assert ours[1:] == theirs[1:]


def test_extrapolating_costs_what_was_asked():
    normal = np.random.default_rng(0).normal
    known = Envelope.from_samples(
        *(
            normal(m, s, 500)
            for m, s in ((7.7, 0.1), (0.0, 0.05), (0.0, 5e-4), (0.0, 0.02))
        )
    )
    ship = replace(shipgym.load_model("mariner"), envelope=known)
    env = make(model=ship, envelope_weight=0.7, max_envelope_distance=1e6, **UNBOUND)
    env.reset(seed=0)
    costs = []
    for k in range(120):
        *_, info = env.step(np.array([0.0 if k < 60 else 1.0], dtype=np.float32))
        assert info["reward_envelope"] == (-0.7 if info["extrapolating"] else 0.0)
        costs.append(info["reward_envelope"])
    assert costs[0] == 0.0
    assert costs[-1] == -0.7


def test_shallow_water_makes_a_tanker_turn_wider():
    rates = []
    for depth in (np.inf, 23.0):
        env = make(model="tanker", water_depth=depth, **UNBOUND)
        env.reset(seed=0)
        for _ in range(200):
            env.step(np.array([0.5], dtype=np.float32))
        rates.append(env.physical_state()["r"])
    assert 0.0 < rates[1] < 0.8 * rates[0]


def turned(count=600, steps=30, **options):
    """Yaw rates after hard rudder for half a minute, in the order of the rows."""
    env = many(count, **UNBOUND, **options)
    env.reset(seed=0)
    for _ in range(steps):
        env.step(np.ones((count, 1), dtype=np.float32))
    return env.physical_state()["r"]


@pytest.mark.compiled
def test_an_ensemble_gives_each_episode_one_of_its_ships():
    mariner = shipgym.load_model("mariner")
    weak = replace(
        mariner, name="weak", coefficients={**mariner.coefficients, "N_d": 0.0011}
    )
    rates = np.unique(turned(ensemble=[weak]).round(9))
    assert len(rates) == 2
    assert rates.max() == pytest.approx(turned(2)[0], abs=1e-8)


@pytest.mark.compiled
def test_a_covariance_gives_each_episode_a_draw():
    rates = turned(model="mariner-tls-svm", model_uncertainty="covariance")
    nominal = turned(1, model="mariner-tls-svm")[0]
    assert 200 < len(np.unique(rates)) <= POOL_SIZE
    assert rates.mean() == pytest.approx(nominal, abs=0.5 * rates.std() + 1e-6)
    assert np.all(np.isfinite(rates))
    ship = shipgym.load_model("mariner-tls-svm")
    drawn = [turned(1, model=one)[0] for one in ship.sample(60, 1)]
    assert rates.std() == pytest.approx(np.std(drawn), rel=0.4)


def test_speed_and_loading_come_from_their_ranges():
    env = many(300, speed_range=(0.6, 0.9), loading_range=(1.0, 1.0), **UNBOUND)
    seen, _ = env.reset(seed=0)
    speeds = env.physical_state()["u"] / 7.7175
    levels = np.unique(speeds.round(9))
    np.testing.assert_allclose(levels, np.linspace(0.6, 0.9, N_SPEEDS), atol=1e-9)
    surge = seen[:, env.observation_names.index("surge")]
    np.testing.assert_allclose(
        surge, speeds, rtol=1e-6
    )  # seen in one scale, so that an agent can tell
    light, heavy = (
        turned(2, steps=4, loading_range=(load, load))[0] for load in (0.8, 1.25)
    )
    assert (
        0.6 < heavy / light < 0.75
    )  # 0.64 at first, while the rudder's moment is all there is


def test_a_model_found_unstable_is_refused_unless_asked_for():
    marked = replace(shipgym.load_model("mariner"), provenance={"stable": False})
    for build in (make, lambda *args, **options: many(2, *args, **options)):
        with pytest.raises(InputError, match="allow_unstable=True"):
            build(PATH, model=marked)
        with pytest.warns(UserWarning, match="found unstable"):
            build(PATH, model=marked, allow_unstable=True)


@pytest.mark.parametrize("path", document_settings.PAGES, ids=lambda path: path.stem)
def test_pages_name_every_setting_with_its_default(path):
    text = path.read_text(encoding="utf-8")
    assert document_settings.page(text) == text, (
        "run python scripts/document_settings.py"
    )


PAGES = Path(__file__).parents[2] / "docs" / "environments"


def documented(page):
    """Bounds of observations by name, as a page has them."""
    found = {}
    for line in (PAGES / f"{page}.md").read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        names, bounds = (
            re.findall(r"`(\w+)`", " ".join(cells[:2])),
            re.findall(r"(\S+) to (-?[0-9.]+)", cells[-1]),
        )
        if bounds and len(cells) == 5:
            found |= {
                name: (float(low), float(high))
                for name, (low, high) in zip(names, bounds, strict=False)
            }
    return found


@pytest.mark.parametrize(
    ("name", "page", "count"),
    [
        ("CourseKeeping", "course_keeping", 12),
        ("PathFollowing", "path_following", 7),
    ],
)
def test_observations_have_the_bounds_of_their_page(name, page, count):
    own = {
        path.rpartition(".")[2]: (seen.low, seen.high)
        for path, seen in read_definition(name).observations.items()
    }
    found = documented(page)
    assert len(found) == count
    assert {key: own[key] for key in found} == found
    assert own.keys() == found.keys() | documented("course_keeping").keys()


def test_an_interval_is_at_most_five_ship_lengths():
    mariner = shipgym.load_model("mariner")
    longest = 5.0 * 160.93 / 7.7175
    course_keeping_task(dt=longest - 0.01).check_fits(mariner)
    with pytest.raises(
        InputError,
        match=r"^dt: expected a number <= 104.263 .s: 5 ship lengths., got 104.3$",
    ):
        course_keeping_task(dt=104.3).check_fits(mariner)


def test_a_decision_of_discrete_course_keeping_lasts_half_a_ship_length():
    discrete = gymnasium.make("shipgym/CourseKeepingDiscrete-v0").unwrapped
    assert discrete.dt == pytest.approx(0.5 * discrete.model.travel_time, rel=0.05)
