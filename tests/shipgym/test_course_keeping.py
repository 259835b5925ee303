"""The course-keeping environment."""

import warnings
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env as gymnasium_check_env
from hypothesis import given, settings
from hypothesis import strategies as st
from stable_baselines3.common.env_checker import check_env as sb3_check_env

import shipgym
from shipgym import InputError
from shipgym.engine.motion import Motion, Ship
from shipgym.engine.random import DRAW, GOLDEN, mix, uniform
from shipgym.engine.sailing import are_finite
from shipgym.envs.engine import Engine
from shipgym.envs.lanes import envelope_numbers, ship_tiles
from shipgym.envs.randomisation import Randomisation
from shipgym.ships import Envelope
from shipgym.tasks import course_keeping
from shipgym.tasks.contract import Interval, Random, Readings
from shipgym.tasks.scales import OBSERVATION_NAMES, control_interval, observation_scales
from shipgym.tasks.steering import Weights, extras, helm, integrated, steering_reward
from shipgym.tasks.task import course_keeping_task

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


@pytest.mark.parametrize("check", [gymnasium_check_env, sb3_check_env])
def test_conformance_without_a_warning(check):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = make().unwrapped
        check(env)
    assert env.spec.id == ID
    assert (env.waypoints, env.corridor, env.turn_radius) == (
        None,
        None,
        None,
    )  # it has no path


def test_registered_by_import_for_worker_processes():
    assert gymnasium.make(f"shipgym:{ID}", model="mariner").spec.id == ID


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


def test_set_points_change_during_an_episode_and_are_kept_with_zero_change():
    env = make().unwrapped
    headings = set()
    observation, _ = env.reset(seed=3)
    for _ in range(600):
        observation, *_ = env.step(pd(observation))
        headings.add(env.physical_state()["set_point"])
    assert 2 <= len(headings) <= 7
    fixed = make(course_change_deg=0.0).unwrapped
    fixed.reset(seed=3)
    state = fixed.physical_state()
    assert state["set_point"] == state["psi"]


def test_an_episode_is_a_function_of_its_seed():
    first, second, other = (steer(make(), pd, seed=seed)[0] for seed in (5, 5, 6))
    np.testing.assert_array_equal(first, second)
    assert not np.array_equal(first, other)


def test_later_episodes_follow_from_the_first_seed_and_differ():
    def headings(seed):
        env = make()
        env.reset(seed=seed)
        return [env.reset()[1]["heading_error"] for _ in range(3)]

    assert headings(1) == headings(1)
    assert len(set(headings(1))) == 3


def test_the_time_limit_truncates():
    rewards, _, terminated, truncated = steer(make(episode_steps=50), pd)
    assert (len(rewards), terminated, truncated) == (50, False, True)


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


def test_each_lane_of_a_batch_is_the_single_environment(mariner):
    engine = Engine(mariner, 70)
    observations = engine.reset(np.arange(70))
    lane, env = 66, make()
    single, _ = env.reset(seed=66)
    for _ in range(300):
        np.testing.assert_array_equal(observations[lane], single)
        actions = np.stack([pd(observation) for observation in observations])
        observations, rewards, *_ = engine.step(actions)
        single, reward, *_ = env.step(actions[lane])
        assert rewards[lane] == reward


def test_a_model_found_unstable_is_refused_unless_asked_for(mariner):
    marked = replace(mariner, provenance={"stable": False})
    with pytest.raises(
        InputError, match=r"'mariner': expected a stable ship.*allow_unstable=True"
    ):
        make(model=marked)
    with pytest.raises(InputError, match="was found unstable"):
        Engine([mariner, marked], 2)
    with pytest.warns(UserWarning, match="found unstable when it was identified"):
        make(model=marked, allow_unstable=True)


def test_a_finished_lane_stays_and_earns_nothing(mariner):
    engine = Engine(mariner, 3, course_keeping_task(episode_steps=5))
    for _ in range(5):
        *_, truncated = engine.step(np.zeros((3, 1)))
    assert truncated.all()
    before = engine.physical_state()
    _, rewards, terminated, truncated = engine.step(np.ones((3, 1)))
    assert not np.any([rewards, terminated, truncated])
    np.testing.assert_array_equal(engine.physical_state()["psi"], before["psi"])


def test_each_lane_may_have_a_ship_of_its_own(mariner):
    slow = replace(mariner, coefficients={**mariner.coefficients, "N_d": 0.0007})
    engine = Engine([mariner, slow], 2)
    engine.reset([1, 1])
    for _ in range(20):
        engine.step(np.full((2, 1), 0.5))
    assert 0.0 < engine.physical_state()["r"][1] < 0.8 * engine.physical_state()["r"][0]


def test_ships_of_a_fleet_are_seen_in_scales_of_their_own(mariner):
    slow = replace(mariner, particulars=replace(mariner.particulars, speed=4.0))
    engine = Engine([mariner, slow], 2)
    surge = OBSERVATION_NAMES.index("surge")
    assert engine.observations[:, surge].tolist() == [1.0, 1.0]
    assert engine.read("u").tolist() == [7.7175, 4.0]


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


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"sea": "rugh"}, "sea: expected .* got 'rugh'"),
        ({"model": "no-such-ship"}, "model"),
        ({"dt": -1.0}, "dt: expected .*got -1"),
        ({"episode_steps": 0}, "episode_steps: expected .*got 0"),
        ({"max_heading_error_deg": 400.0}, "max_heading_error_deg: expected .*got 400"),
    ],
)
def test_wrong_arguments(options, message):
    with pytest.raises(InputError, match=message):
        make(**options)


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (
            np.array([np.nan], dtype=np.float32),
            r"action: expected finite numbers .* got \[nan\]",
        ),
        (
            np.array([np.inf], dtype=np.float32),
            r"action: expected finite numbers .* got \[inf\]",
        ),
        (np.zeros(2, dtype=np.float32), r"got shape \(2,\)"),
        (0.5, r"got shape \(\)"),
    ],
)
def test_wrong_actions(action, message):
    env = make().unwrapped
    env.reset(seed=0)
    with pytest.raises(InputError, match=message):
        env.step(action)


def test_wrong_batches(mariner):
    engine = Engine(mariner, 2)
    with pytest.raises(InputError, match=r"actions: expected shape .* got \(3, 1\)"):
        engine.step(np.zeros((3, 1)))
    with pytest.raises(InputError, match="got nan in lane 1"):
        engine.step([[0.0], [np.nan]])
    pool = Randomisation(speed_range=(0.8, 1.0))
    with pytest.raises(
        InputError, match="models: expected a ship for each lane or a pool"
    ):
        Engine([mariner, mariner], 2, randomisation=pool)
    with pytest.raises(InputError, match="models: expected one structure"):
        Engine([mariner, shipgym.load_model("kvlcc2")], 2)
    with pytest.raises(InputError, match="num_envs: expected"):
        Engine(mariner, 0)
    with pytest.raises(
        InputError, match="expected 1, or one for each of 2 lanes, got 3"
    ):
        Engine([mariner] * 3, 2)


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


def test_the_helmsman_sees_the_ship_against_her_course():
    readings = Readings(*np.arange(1.0, 1.0 + len(Readings._fields)))
    held = interval(rudder_command=0.5, shaft_command=0.25)
    seen = helm(1.2 + readings.psi, 7.0, readings, held, SHIP)._asdict()
    assert (
        seen.pop("heading_error_sin"),
        seen.pop("heading_error_cos"),
    ) == pytest.approx((np.sin(1.2), np.cos(1.2)))
    assert seen == {
        "yaw_rate": readings.r,
        "sway": readings.v,
        "surge": readings.u,
        "rudder": readings.delta,
        "last_command": 0.5 * 0.6,
        "heading_error_integral": 7.0,
    }
    assert extras(readings, held, SHIP) == (
        readings.phi,
        readings.p,
        readings.n,
        0.25 * 1.5,
    )


@given(st.floats(-30.0, 30.0), st.floats(-1.0, 1.0))
def test_the_integral_gathers_small_errors_up_to_its_bound(integral, error):
    """Up to 10 degrees; its bound is 10 degrees for the time to sail 10 ship lengths,
    200 s."""
    bound = np.radians(10.0) * 200.0
    gathered = integral + (0.5 * error if abs(error) <= np.radians(10.0) else 0.0)
    found = integrated(integral, error, interval(), SHIP, Weights())
    assert found == pytest.approx(np.clip(gathered, -bound, bound))


def test_set_points_are_drawn_within_their_bounds_and_change_in_time():
    """Changes evenly up to 30 degrees to both sides, after 100 to 300 steps; listed
    ones on the step."""
    settings = course_keeping.Settings(change_interval_steps=200)
    state = course_keeping.State(1.0, 0.0, 3.0, 0.25, 0.1)
    with np.errstate(over="ignore"):
        drawn = [
            course_keeping.changed(
                state, 50.0, settings, Random(np.uint64(key), np.uint64(0))
            )
            for key in range(2000)
        ]
    changes = np.degrees([one.heading_setpoint - 1.0 for one in drawn])
    waits = np.array([one.next_change - 50.0 for one in drawn])
    for values, low, high in ((changes, -30.0, 30.0), (waits, 100.0, 300.0)):
        assert low <= values.min() < low + 0.01 * (high - low)
        assert high - 0.01 * (high - low) < values.max() <= high
        assert values.mean() == pytest.approx(
            0.5 * (low + high), abs=4.0 * (high - low) / np.sqrt(12 * 2000)
        )
    assert abs(np.corrcoef(changes, waits)[0, 1]) < 4.0 / np.sqrt(2000)
    assert {(one.changes, one.integral, one.heading_error) for one in drawn} == {
        (4.0, 0.25, 0.1)
    }
    listed = settings._replace(course_changes_deg=np.array([5.0, -7.0]))
    for number, degrees in ((0.0, 5.0), (1.0, -7.0), (2.0, 0.0)):
        with np.errstate(over="ignore"):
            found = course_keeping.changed(
                state._replace(changes=number),
                50.0,
                listed,
                Random(np.uint64(1), np.uint64(0)),
            )
        assert found.heading_setpoint == pytest.approx(1.0 + np.radians(degrees))
        assert found.next_change == 250.0
    assert course_keeping.due(
        None, state._replace(next_change=9.0), interval(steps=9.0), SHIP, settings
    )
    assert not course_keeping.due(
        None, state._replace(next_change=9.0), interval(steps=8.0), SHIP, settings
    )


def test_a_step_is_charged_for_its_error_and_control_is_lost_beyond_the_largest():
    settings = course_keeping.Settings()
    for error, lost in ((0.4, False), (-1.57, False), (1.58, True), (-1.58, True)):
        motion = Motion(0.0, 0.0, 0.3, 8.0, *[0.0] * 7)
        state = course_keeping.State(0.3 + error, 9.0, 1.0, 0.0, 0.0)
        after, reward, failed, arrived = course_keeping.step(
            motion, state, interval(), SHIP, settings
        )
        assert after.heading_error == pytest.approx(error)
        assert reward.heading == pytest.approx(-((error / (np.pi / 6)) ** 2))
        assert (failed, arrived) == (lost, False)
    assert course_keeping.worst_cost(settings) == pytest.approx(9.0)


def test_an_episode_begins_on_a_first_set_point_with_nothing_gathered():
    settings = course_keeping.Settings(
        course_changes_deg=np.array([170.0, 30.0]), change_interval_steps=7
    )
    headings = []
    for key in range(60):
        with np.errstate(over="ignore"):
            motion, state = course_keeping.begin(
                SHIP, settings, Random(np.uint64(key), np.uint64(3)), None
            )
        assert motion == Motion(
            0.0, 0.0, motion.psi, 8.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.5
        )
        assert state.heading_setpoint == pytest.approx(motion.psi + np.radians(170.0))
        assert (state.next_change, state.changes, state.integral) == (7.0, 1.0, 0.0)
        assert state.heading_error == pytest.approx(np.radians(170.0))
        headings.append(motion.psi)
    assert -np.pi <= min(headings) < -0.8 * np.pi
    assert 0.8 * np.pi < max(headings) < np.pi


def test_set_points_change_at_most_every_step_and_begin_with_the_first_listed():
    random = Random(np.uint64(1), np.uint64(0))
    state = course_keeping.State(1.0, 0.0, -5.0, 0.0, 0.0)
    listed = course_keeping.Settings(course_changes_deg=np.array([5.0, -7.0]))
    often = course_keeping.Settings(change_interval_steps=1)
    with np.errstate(over="ignore"):
        found = course_keeping.changed(
            state, 50.0, listed, random
        )  # whatever a checkpoint holds
        waits = {
            course_keeping.changed(
                state._replace(changes=k), 50.0, often, random
            ).next_change
            for k in range(30)
        }
    assert found.heading_setpoint == pytest.approx(1.0 + np.radians(5.0))
    assert waits == {51.0}


def test_random_numbers_are_those_of_splitmix64():
    """The first three of the seed 0, as the authors' program gives them."""
    with np.errstate(over="ignore"):
        found = [int(mix(np.uint64(k) * GOLDEN)) for k in (1, 2, 3)]
        words = [int(DRAW[k]) for k in (0, 1, 3)]
    assert found == [0xE220A8397B1DCDAF, 0x6E789E6AA1B965F4, 0x06C45D188009454F]
    assert words == [0, int(GOLDEN), 3 * int(GOLDEN) % 2**64]


def test_uniform_numbers_fill_their_range_and_differ_by_each_word():
    with np.errstate(over="ignore"):
        numbers = np.array(
            [
                uniform(np.uint64(key), np.uint64(episode), np.uint64(draw), -3.0, 5.0)
                for key in range(10)
                for episode in range(10)
                for draw in range(10)
            ]
        )
    assert len(np.unique(numbers)) == 1000
    assert -3.0 <= numbers.min() < -2.95
    assert 4.95 < numbers.max() < 5.0
    assert numbers.mean() == pytest.approx(1.0, abs=4.0 * 8.0 / np.sqrt(12.0 * 1000))
    assert numbers.std() == pytest.approx(8.0 / np.sqrt(12.0), rel=0.05)


@pytest.mark.parametrize(
    ("actions", "finite"),
    [
        ([[0.0, -1e30]], True),
        ([[0.0, np.nan]], False),
        ([[np.inf, 0.0]], False),
        ([[0.0], [-np.inf]], False),
        ([[np.nan, np.nan], [0.0, 0.0]], False),
    ],
)
def test_orders_of_all_ships_are_looked_at(actions, finite):
    assert are_finite(np.ravel(actions)) is finite


def test_the_envelope_of_a_model_is_given_row_by_row(mariner):
    rng = np.random.default_rng(0)
    envelope = Envelope.from_samples(
        *(rng.normal(m, s, 300) for m, s in ((8, 1), (0, 2), (0, 3), (0, 4)))
    )
    found = envelope_numbers(replace(mariner, envelope=envelope))
    low, high, centre, upper = found[:4], found[4:8], found[8:12], found[12:]
    assert (low < centre).all()
    assert (centre < high).all()
    matrix = np.zeros((4, 4))
    matrix[np.triu_indices(4)] = upper
    np.testing.assert_array_equal(matrix, envelope.shape)
    none = envelope_numbers(mariner)
    assert none.tolist() == [-np.inf] * 4 + [np.inf] * 4 + [0.0] * 14


def test_columns_of_ships_lie_in_tiles_of_64_filled_up_with_the_first():
    columns = np.arange(70.0)[:, None] + np.array([0.0, 1000.0])
    tiles = ship_tiles(columns, 2, True).reshape(2, 2, 64)
    assert tiles[0, 0].tolist() == list(range(64))
    assert tiles[1, 1].tolist() == [1064.0 + k for k in range(6)] + [1000.0] * 58
    assert ship_tiles(columns, 1, True).shape == (1, 128)
    assert ship_tiles(columns[:1], 2, False).tolist() == [[0.0, 1000.0]]
    alone = ship_tiles(columns[:1], 1, True).reshape(2, 64)
    assert (alone == [[0.0], [1000.0]]).all()
