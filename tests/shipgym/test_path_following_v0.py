"""The path-following environment, first version: its guidance, its reward and attempts at gaming it."""

from dataclasses import replace
from itertools import pairwise

import gymnasium
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import shipgym
from shipgym import InputError
from shipgym.engine.motion import Motion, Ship, ground_velocity
from shipgym.envs.engine import Engine
from shipgym.sea import Current, Waves, Weather, Wind
from shipgym.tasks import path_following_v0 as path_following
from shipgym.tasks.contract import Interval, Readings
from shipgym.tasks.guidance import Path, line_of_sight, wrapped
from shipgym.tasks.path_following_v0 import TURN_HORIZON, Settings, leg_from, observe
from shipgym.tasks.task import path_following_task, ship_of

pytestmark = pytest.mark.interpreted

ID = "shipgym/PathFollowing-v0"
LENGTH, SPEED = 160.93, 7.7175  # of the Mariner
HOOK = [
    [0.0, 0.0],
    [1500.0, 0.0],
    [2600.0, 1100.0],
    [2600.0, 2800.0],
]  # turns of 45 degrees
TROUBLED = Weather(
    current=Current(1.0, towards_deg=90.0),
    wind=Wind(10.0, from_deg=0.0),
    waves=Waves(2.0, 8.0),
)


SIZES = {
    "corridor": 1.0,
    "ground": 4.0,
    "episode_steps": 1500,
}  # whatever the defaults are


def make(**options):
    return gymnasium.make(ID, **{"model": "mariner", **SIZES, **options}).unwrapped


def pd(observation):
    """A plain proportional and differential autopilot."""
    error = np.arctan2(observation[0], observation[1])
    return float(np.clip(1.5 * error - 0.7 * observation[2], -1.0, 1.0))


def honest(observation, step):
    return [pd(observation)]


def fly(env, policy=honest, seed=0):
    """One episode: rewards and infos."""
    observation, _ = env.reset(seed=seed)
    rewards, infos, over = [], [], False
    while not over:
        action = np.array(policy(observation, len(rewards)), dtype=np.float32)
        observation, reward, terminated, truncated, info = env.step(action)
        rewards.append(reward)
        infos.append(info)
        over = terminated or truncated
    return np.array(rewards), infos


@pytest.mark.parametrize("waypoints", [None, HOOK])
def test_guidance_is_that_of_the_library(waypoints):
    env = make(waypoints=waypoints)
    observation, _ = env.reset(seed=3)
    task, path, leg, over = env.task, Path(env.waypoints), 0, False
    names = {name: k for k, name in enumerate(env.observation_names)}
    while not over:
        observation, _, terminated, truncated, info = env.step(
            np.array([pd(observation)], np.float32)
        )
        over = terminated or truncated
        state = env.physical_state()
        where = path.position(state["x"], state["y"], leg)
        sailed = path.lengths[:leg].sum() + np.clip(where.along, 0.0, path.lengths[leg])
        assert info["distance_made_good"] == pytest.approx(float(sailed), abs=1e-6)
        if leg < path.n_legs - 1 and not over:
            leg += bool(where.to_go <= task.acceptance * LENGTH)
        where = path.position(state["x"], state["y"], leg)
        course = line_of_sight(where, task.lookahead * LENGTH)
        error = wrapped(course - state["psi"])
        seen = observation * env.observation_scales
        assert wrapped(state["set_point"] - course) == pytest.approx(0.0, abs=1e-9)
        assert seen[names["heading_error_sin"]] == pytest.approx(
            np.sin(error), abs=1e-6
        )
        assert seen[names["cross_track"]] == pytest.approx(
            float(where.cross_track), abs=1e-3
        )
        assert info["cross_track"] == pytest.approx(float(where.cross_track), abs=1e-6)
        horizon = TURN_HORIZON * LENGTH
        distance = np.clip(where.to_go, 0.0, horizon)
        assert seen[names["turn_distance"]] == pytest.approx(float(distance), abs=1e-3)
        assert wrapped(seen[names["turn_angle"]] - path.turns[leg]) == pytest.approx(
            0.0, abs=1e-6
        )
    assert leg == path.n_legs - 1
    assert info["success"]


def test_given_waypoints_are_sailed_in_every_episode():
    env = make(waypoints=HOOK)
    for seed in (0, 1):
        env.reset(seed=seed)
        np.testing.assert_array_equal(env.waypoints, HOOK)
        state = env.physical_state()
        assert state["x"] == pytest.approx(0.0, abs=1e-9)
        assert abs(state["y"]) <= 0.5 * env.corridor
        assert abs(state["psi"]) <= np.pi / 12


def test_drawn_paths_follow_from_the_seed_and_keep_to_their_bounds():
    options = {"n_legs": 6, "leg_lengths": (5.0, 9.0), "max_turn_deg": 40.0}
    engine = Engine(shipgym.load_model("mariner"), 200, path_following_task(**options))
    engine.reset(np.arange(200))
    paths = [Path(engine.waypoints(lane)) for lane in range(200)]
    lengths = np.concatenate([path.lengths for path in paths]) / LENGTH
    turns = np.degrees(np.concatenate([path.turns[:-1] for path in paths]))
    assert 5.0 <= lengths.min() < 5.1
    assert 8.9 < lengths.max() <= 9.0
    assert -40.0 <= turns.min() < -39.0
    assert 39.0 < turns.max() <= 40.0
    assert abs(turns.mean()) < 4.0 * 40.0 / np.sqrt(3.0 * turns.size)
    single = make(**options)
    for seed in (5, 6):
        single.reset(seed=seed)
        np.testing.assert_array_equal(single.waypoints, paths[seed].waypoints)
    single.reset()
    assert not np.array_equal(single.waypoints, paths[6].waypoints)


@pytest.mark.parametrize("model", ["mariner", "kvlcc2"])
def test_a_course_autopilot_follows_the_path_as_it_is(model):
    rewards, infos = fly(make(model=model), seed=1)
    assert infos[-1]["success"]
    assert infos[-1]["in_corridor"]
    assert not any(info["success"] for info in infos[:-1])
    assert not any(info["grounded"] for info in infos)
    assert infos[-1]["reward_end"] == 0.0
    assert np.mean([info["in_corridor"] for info in infos]) > 0.9
    assert -1.0 < rewards.mean() < 0.0


def test_the_reward_is_the_sum_of_its_named_parts():
    env = make(waypoints=HOOK, sea=TROUBLED)
    rewards, infos = fly(env, seed=2)
    parts = env.task.reward_parts
    np.testing.assert_allclose(
        rewards, [sum(info[name] for name in parts) for info in infos], rtol=1e-12
    )
    assert set(parts) == {name for name in infos[0] if name.startswith("reward_")}
    furthest, checked = 2.0 * SPEED * env.dt, 0
    for last, info in pairwise(infos):
        way = info["distance_made_good"] - last["distance_made_good"]
        aside = info["cross_track"] - last["cross_track"]
        if (
            0.0 < way < furthest and abs(aside) < furthest
        ):  # not where the next leg begins
            checked += 1
            assert info["reward_cross_track"] == pytest.approx(
                -((info["cross_track"] / env.corridor) ** 2)
            )
            pace = way / (SPEED * env.dt)
            assert info["reward_progress"] == pytest.approx(
                -np.clip(1.0 - pace, 0.0, 2.0), abs=1e-9
            )
            assert info["in_corridor"] == (abs(info["cross_track"]) <= env.corridor)
    assert checked > 0.9 * len(infos)


def test_running_aground_ends_the_episode_and_says_so():
    rewards, infos = fly(
        make(waypoints=HOOK), lambda observation, step: [0.0 if step < 50 else 1.0]
    )
    last = infos[-1]
    assert last["grounded"]
    assert not last["success"]
    assert not last["in_corridor"]
    assert abs(last["cross_track"]) > 4.0 * LENGTH
    left = 1500 - len(rewards)
    assert last["reward_end"] == pytest.approx(-left * (4.0**2 + 2.0))


WIDE = {"ground": 40.0}  # a sea in which nobody runs aground


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("name", "policy", "options"),
    [
        ("circles", lambda seen, step: [1.0], {}),
        ("circles where it is wide", lambda seen, step: [1.0], WIDE),
        (
            "circles after a while",
            lambda seen, step: [pd(seen) if step < 400 else -1.0],
            WIDE,
        ),
        (
            "circles before the end",
            lambda seen, step: [pd(seen) if step < 450 else 1.0],
            WIDE,
        ),
        ("does nothing", lambda seen, step: [0.0], WIDE),
        ("turns back", lambda seen, step: [-pd(seen)], WIDE),
        ("runs aground early", lambda seen, step: [-pd(seen)], {}),
        ("chatters", lambda seen, step: [pd(seen) + (0.3 if step % 2 else -0.3)], {}),
        ("bangs", lambda seen, step: [np.sign(pd(seen))], {}),
        ("weaves", lambda seen, step: [pd(seen) + 0.5 * np.sin(step / 8.0)], {}),
    ],
)
def test_gaming_the_reward_does_not_pay(name, policy, options):
    for seed in (0, 1):
        env = make(waypoints=HOOK, **options)
        played, infos = fly(env, policy, seed)
        best, kept = fly(env, honest, seed)
        assert kept[-1]["success"]
        assert played.sum() < 1.15 * best.sum()
        assert all(-2.0 <= info["reward_progress"] <= 0.0 for info in infos)
    if name.startswith(("circles", "turns", "runs")):
        assert played.sum() < 4.0 * best.sum()
        assert not infos[-1]["success"]


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("name", "policy"),
    [
        ("stops", lambda seen, step: [0.0, 0.0]),
        (
            "stops after a while",
            lambda seen, step: [pd(seen), 1.0 if step < 100 else 0.0],
        ),
        ("goes astern", lambda seen, step: [0.0, -1.0]),
        (
            "goes to and fro",
            lambda seen, step: [pd(seen), 1.0 if step // 60 % 2 else -1.0],
        ),
        ("creeps", lambda seen, step: [pd(seen), 0.4]),
    ],
)
def test_stopping_does_not_pay(name, policy):
    env = make(model="kvlcc2", action="rudder-shaft", episode_steps=700, n_legs=2)
    played, infos = fly(env, policy)
    best, kept = fly(env, lambda seen, step: [pd(seen), 1.0])
    assert kept[-1]["success"]
    assert played.sum() < 2.0 * best.sum()
    assert len(infos) > len(kept)


def test_a_propeller_that_holds_ahead_only_is_stopped_by_an_order_astern():
    """The thrust polynomial of KVLCC2 would push a ship ahead that reverses her shaft."""
    runs = []
    for order in (-1.0, 0.0):
        env = make(model="kvlcc2", action="rudder-shaft")
        env.reset(seed=0)
        for _ in range(50):
            seen, *_ = env.step(np.array([0.0, order], dtype=np.float32))
        runs.append(seen)
    np.testing.assert_array_equal(*runs)
    assert env.physical_state()["n_command"] == 0.0
    assert env.physical_state()["u"] < 0.9 * env.model.particulars["speed"]


def test_a_current_sets_the_ship_off_and_course_error_shows_it():
    north = [[0.0, 0.0], [9000.0, 0.0]]
    env = make(waypoints=north, sea=Weather(current=Current(1.0, towards_deg=90.0)))
    seen, _ = env.reset(seed=1)
    names = {name: k for k, name in enumerate(env.observation_names)}
    for _ in range(400):
        before = env.physical_state()
        seen, *_ = env.step(np.array([pd(seen)], dtype=np.float32))
    state = env.physical_state()
    made_good = np.arctan2(state["y"] - before["y"], state["x"] - before["x"])
    off = state["set_point"] - made_good
    assert seen[names["course_error_sin"]] == pytest.approx(np.sin(off), abs=1e-3)
    assert seen[names["course_error_cos"]] == pytest.approx(np.cos(off), abs=1e-3)
    drift = made_good - state["psi"]
    assert drift == pytest.approx(np.cos(state["psi"]) / state["u"], abs=0.01)
    calm = make(waypoints=north)
    for one in (env, calm):
        one.reset(seed=1)
        for _ in range(30):
            one.step(np.zeros(1, dtype=np.float32))
    assert env.physical_state()["y"] - calm.physical_state()["y"] == pytest.approx(
        30.0, abs=0.1
    )


SHIP = Ship(LENGTH, SPEED, 0.6, 0.05, 0.0, 1.5, np.inf, SPEED)
angles, speeds = st.floats(-3.1, 3.1), st.floats(-3.0, 3.0)


@given(angles, angles, st.floats(0.5, 8.0), speeds, speeds, speeds)
def test_course_over_ground_is_the_way_that_the_ship_moves_on_every_leg(
    leg, psi, u, v, north, east
):
    """Worked with vectors north and east: way through the water, turned by the heading, and the current."""
    motion = Motion(30.0, -40.0, psi, u, v, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    ahead, aside = ground_velocity(motion, north, east)
    over_ground = (u + 1j * v) * np.exp(1j * psi) + north + 1j * east
    assert (ahead + 1j * aside) * np.exp(1j * psi) == pytest.approx(
        over_ground, abs=1e-9
    )
    state = leg_from(
        0, 0.0, np.array([0.0, 0.0, 2000.0 * np.cos(leg), 2000.0 * np.sin(leg)])
    )
    assert (state.length, state.cosine, state.sine) == pytest.approx(
        (2000.0, np.cos(leg), np.sin(leg))
    )
    assert state.leg_course == pytest.approx(leg)
    assume(abs(over_ground) > 0.01)
    readings = Readings(
        30.0, -40.0, psi, u, v, 0.0, 0.0, 0.0, 0.0, 0.0, psi, ahead, aside
    )
    seen = observe(
        readings, state, Interval(1.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0), SHIP, Settings()
    )
    across = np.imag((30.0 - 40.0j) * np.exp(-1j * leg))
    assert seen.cross_track == pytest.approx(across, abs=1e-9)
    course = leg - np.arctan2(across, 2.5 * LENGTH)
    off = np.exp(1j * course) / over_ground
    error = seen.course_error_cos + 1j * seen.course_error_sin
    assert error == pytest.approx(off / abs(off), abs=1e-6)


def test_a_ship_without_way_has_no_course_over_ground():
    readings = Readings(0.0, 0.0, 0.3, *[0.0] * 7, 0.3, 0.0, 0.0)
    state = leg_from(0, 0.0, np.array([0.0, 0.0, 900.0, 900.0]))
    seen = observe(readings, state, Interval(1.0, 0.0, *[0.0] * 5), SHIP, Settings())
    assert (seen.course_error_sin, seen.course_error_cos) == (0.0, 0.0)


MIRRORED = (
    *(
        "y",
        "psi",
        "v",
        "r",
        "delta",
        "rudder_before",
        "rudder_command",
        "course",
        "integral",
        "heading_error",
    ),
    *("east", "sine", "leg_course", "turn", "cross_track"),
)
SEEN_MIRRORED = (
    "heading_error_sin",
    "yaw_rate",
    "sway",
    "rudder",
    "last_command",
    "heading_error_integral",
    "cross_track",
    "course_error_sin",
    "turn_angle",
)


def test_the_mirrored_voyage_earns_the_same():
    """A ship without a preferred side, on the path that is reflected in the north axis."""
    mariner = shipgym.load_model("mariner")
    even = {
        name: value for name, value in mariner.coefficients.items() if name[1:3] == "_0"
    }
    symmetric = replace(
        mariner, coefficients={**mariner.coefficients, **dict.fromkeys(even, 0.0)}
    )
    drawn = Engine(symmetric, 1, path_following_task(n_legs=3, leg_lengths=(3.0, 5.0)))
    drawn.reset([4])
    task = path_following_task(waypoints=drawn.waypoints())
    engine = Engine(symmetric, 1, task)
    mirror = Engine(
        symmetric, 1, task.changed(waypoints=drawn.waypoints() * [1.0, -1.0])
    )
    for one in (engine, mirror):
        one.reset([4])
    for name in (*Motion._fields[:6], "delta", *task.definition.State._fields):
        mirror.write(name, (-1.0 if name in MIRRORED else 1.0) * engine.read(name))
    signs = np.array(
        [-1.0 if q.name in SEEN_MIRRORED else 1.0 for q in task.observed(symmetric)]
    )
    random = np.random.default_rng(0)
    seen = engine.observations
    for _ in range(250):
        order = pd(seen[0]) + 0.3 * random.normal()
        seen, rewards, *_ = engine.step([[order]])
        reflected, earned, *_ = mirror.step([[-order]])
        assert rewards[0] == pytest.approx(earned[0], rel=1e-6, abs=1e-9)
        np.testing.assert_allclose(seen[0], signs * reflected[0], atol=1e-5)
    assert engine.info("distance_made_good")[0] > 5.0 * LENGTH


@settings(max_examples=20, deadline=None)
@given(
    st.integers(0, 2**31 - 1),
    st.lists(st.floats(-1.0, 1.0, width=32), min_size=1, max_size=30),
    st.booleans(),
)
def test_observations_stay_in_their_space_and_are_never_nan(seed, actions, troubled):
    options = {"sea": ["calm", TROUBLED], "noise": 3.0} if troubled else {}
    env = make(
        ground=40.0,
        acceptance=0.0,
        max_turn_deg=150.0,
        leg_lengths=(0.5, 3.0),
        **options,
    )
    env.reset(seed=seed)
    for action in actions * 10:
        observation, reward, terminated, *_ = env.step(
            np.array([action], dtype=np.float32)
        )
        assert observation in env.observation_space
        assert np.isfinite(reward)
        assert reward <= 0.0
        if terminated:
            break


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"waypoints": [[0.0, 0.0]]},
            r"waypoints: shape \(1, 2\) found, expected at least 2",
        ),
        ({"waypoints": [[0.0, 0.0], [0.0, 0.0]]}, "waypoints: row 1 repeats"),
        ({"waypoints": [[0.0, 0.0], [np.nan, 1.0]]}, "waypoints: row 1 is"),
        ({"waypoints": "north"}, "waypoints: shape"),
        (
            {"corridor": 0.05, "ground": 1.0},
            "corridor: 0.05 ship lengths to each side is 16.1 m wide",
        ),
        ({"corridor": 5.0}, "ground: expected a number > 5"),
        ({"leg_lengths": (5.0, 4.0)}, "leg_lengths: the largest: expected"),
        ({"leg_lengths": (5.0,)}, "leg_lengths: .* expected the least and the largest"),
        ({"max_turn_deg": 170.0}, "max_turn_deg: expected"),
        ({"n_legs": 0}, "n_legs: expected"),
        ({"lookahead": 0.0}, "lookahead: expected"),
        ({"acceptence": 1.0}, "Did you mean 'acceptance'"),
    ],
)
def test_wrong_arguments_are_named(options, message):
    with pytest.raises(InputError, match=message):
        make(**options)


@pytest.mark.parametrize("leg", [-1e9, -1.0, 0.0])
def test_the_next_leg_is_one_of_the_plan_whatever_a_checkpoint_holds(leg):
    plan = np.array([0.0, 0.0, 500.0, 0.0, 500.0, 500.0])
    state = path_following.leg_from(0, 0.0, plan)._replace(leg=leg)
    ship = ship_of(shipgym.load_model("mariner"))
    motion = Motion(490.0, 0.0, *[0.0] * 9)
    found = path_following.on_event(
        motion, state, None, ship, path_following.Settings(), None, plan
    )
    assert (found.leg, found.north, found.east) == (1.0, 500.0, 0.0)


PLAN = np.array([0.0, 0.0, 3000.0, 0.0, 3000.0, 4000.0, 0.0, 0.0])


def test_a_leg_knows_its_length_its_course_and_the_turn_at_its_end():
    legs = [leg_from(number, 100.0, PLAN) for number in range(3)]
    assert [leg.leg for leg in legs] == [0.0, 1.0, 2.0]
    assert (
        [leg.length for leg in legs]
        == [leg.to_go for leg in legs]
        == [3000.0, 4000.0, 5000.0]
    )
    back = np.arctan2(-4000.0, -3000.0)
    assert [leg.leg_course for leg in legs] == pytest.approx([0.0, np.pi / 2, back])
    assert [leg.turn for leg in legs] == pytest.approx(
        [np.pi / 2, wrapped(back - np.pi / 2), 0.0]
    )
    assert {
        (leg.before, leg.sailed, leg.distance_made_good, leg.in_corridor)
        for leg in legs
    } == {(100.0, 0.0, 0.0, 1.0)}
    assert (legs[2].cosine, legs[2].sine) == pytest.approx((-0.6, -0.8))


def test_the_next_leg_is_due_near_the_end_of_each_but_the_last():
    asked = Settings(n_legs=3, acceptance=1.5)
    near, far = 1.49 * LENGTH, 1.51 * LENGTH
    for number, to_go, due in (
        (0, near, True),
        (0, far, False),
        (1, near, True),
        (2, near, False),
        (2, -9.0, False),
    ):
        state = leg_from(number, 0.0, PLAN)._replace(to_go=to_go)
        assert bool(path_following.due(None, state, None, SHIP, asked)) is due
    assert leg_from(0, 0.0, PLAN).last == 2.0


def test_a_leg_beyond_the_plan_that_a_state_may_claim_is_the_last():
    state = leg_from(0, 0.0, PLAN)._replace(leg=1e5, last=1e6)
    motion = Motion(2900.0, 150.0, 0.2, *[0.0] * 8)
    assert (
        path_following.on_event(motion, state, None, SHIP, Settings(), None, PLAN).leg
        == 2.0
    )


def test_the_way_round_a_corner_that_is_cut_counts_as_sailed():
    state = leg_from(0, 0.0, PLAN)._replace(
        heading_error=0.7, distance_made_good=2500.0, integral=0.3
    )
    motion = Motion(2900.0, 150.0, 0.2, *[0.0] * 8)
    found = path_following.on_event(motion, state, None, SHIP, Settings(), None, PLAN)
    assert (found.leg, found.before, found.sailed, found.to_go) == (
        1.0,
        3000.0,
        3150.0,
        3850.0,
    )
    assert found.cross_track == pytest.approx(100.0)  # south of a leg due east
    assert found.course == pytest.approx(np.pi / 2 - np.arctan(100.0 / (2.5 * LENGTH)))
    assert (found.heading_error, found.distance_made_good, found.integral) == (
        0.7,
        2500.0,
        0.3,
    )  # as reported
    behind = path_following.on_event(
        motion._replace(y=-80.0), state, None, SHIP, Settings(), None, PLAN
    )
    assert (behind.sailed, behind.to_go) == (3000.0, 4080.0)


def test_a_step_on_a_leg_is_charged_for_its_distance_and_for_way_not_made():
    asked = Settings(n_legs=3, corridor=0.5, ground=2.0)
    state = leg_from(2, 7000.0, PLAN)._replace(sailed=11_000.0)
    interval = Interval(100.0, 7.0, 0.02, 0.0, 1.0, 0.0, 0.0)
    along, aside = np.array([-0.6, -0.8]), np.array([0.8, -0.6])

    def step(way, off):
        x, y = PLAN[4:6] + way * along + off * LENGTH * aside
        return path_following.step(
            Motion(x, y, *[0.0] * 9), state, interval, SHIP, asked
        )

    after, reward, aground, arrived = step(4000.0 + 50.0 * SPEED, 0.25)
    assert (
        after.sailed
        == after.distance_made_good
        == pytest.approx(11_000.0 + 50.0 * SPEED)
    )
    assert after.to_go == pytest.approx(1000.0 - 50.0 * SPEED)
    assert (reward.progress, reward.cross_track) == pytest.approx((-0.5, -0.25))
    assert (bool(aground), bool(arrived), after.in_corridor, after.grounded) == (
        False,
        False,
        1.0,
        0.0,
    )
    assert step(4000.0 - 300.0 * SPEED, 0.0)[1].progress == -2.0
    assert step(4000.0 + 300.0 * SPEED, 0.0)[1].progress == 0.0
    for way, off, end in (
        (5001.0, 0.49, True),
        (5001.0, 0.51, False),
        (4999.0, 0.0, False),
    ):
        after, *_, arrived = step(way, off)
        assert bool(arrived) is bool(after.success) is end
    assert step(5001.0, 0.0)[0].sailed == pytest.approx(12_000.0)  # the path's end
    assert [bool(step(4500.0, off)[2]) for off in (1.99, -2.01)] == [False, True]
    first = path_following.step(
        Motion(0.0, 0.0, *[0.0] * 9), state._replace(leg=1.0), interval, SHIP, asked
    )
    assert not first[3]
