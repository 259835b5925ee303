"""The path-following environment: its planned path, its reward and attempts at gaming
it."""

from itertools import pairwise

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import shipgym
from shipgym import InputError
from shipgym.engine.motion import Motion, Ship
from shipgym.envs.engine import Engine
from shipgym.sea import Current, Waves, Weather, Wind
from shipgym.tasks import Task, path_following
from shipgym.tasks.guidance import Path
from shipgym.tasks.path_following import Settings, State
from shipgym.tasks.planned_legs import fix, leg_from
from shipgym.tasks.steering import RudderActivity

ID = "shipgym/PathFollowing-v0"
LENGTH, SPEED = 160.93, 7.7175  # of the Mariner
SHIP = Ship(LENGTH, SPEED, 0.6, 0.05, 0.0, 1.5, np.inf, SPEED)
HOOK = np.array(
    [[0.0, 0.0], [1500.0, 0.0], [2900.0, 1400.0], [2900.0, 3400.0]]
)  # turns of 45 degrees
LINE = np.array([[0.0, 0.0], [40.0 * LENGTH, 0.0]])
WIDE = {"ground": 40.0}  # a sea in which nobody runs aground
TROUBLED = Weather(
    current=Current(1.0, towards_deg=90.0),
    wind=Wind(10.0, from_deg=0.0),
    waves=Waves(2.0, 8.0),
)


def pd(seen):
    """A plain proportional and differential autopilot."""
    return float(np.clip(1.5 * np.arctan2(seen[0], seen[1]) - 0.7 * seen[2], -1.0, 1.0))


def sail(policy=lambda seen, step, env: [pd(seen)], seed=0, **options):
    """One episode: rewards, minus the costs by default, infos, and the environment."""
    made = {"model": "mariner", "bounded": False, **options}
    env = gymnasium.make(ID, **made).unwrapped
    (seen, _), over = env.reset(seed=seed), False
    rewards, infos = [], []
    while not over:
        action = np.array(policy(seen, len(rewards), env), dtype=np.float32)
        seen, reward, terminated, truncated, info = env.step(action)
        rewards.append(reward)
        infos.append(info)
        over = terminated or truncated
    return np.array(rewards), infos, env


def divided(path, parts):
    """The same path with each leg divided into so many."""
    shares = np.arange(parts)[:, None] / parts
    legs = [a + shares * (b - a) for a, b in pairwise(path)]
    return np.concatenate([*legs, path[-1:]])


@pytest.mark.parametrize(
    ("path", "cost"), [(LINE, 16.11), (HOOK, 50.99)], ids=["line", "hook"]
)
def test_dividing_a_leg_changes_nothing(path, cost):
    costs = [-sail(waypoints=divided(path, parts))[0].sum() for parts in (1, 2, 4, 8)]
    assert costs[0] == pytest.approx(cost, abs=0.01)
    np.testing.assert_allclose(costs, costs[0], rtol=1e-6)


def rounded(path, radius):
    """The path with its turns as arcs: points 3 degrees apart on them."""
    points = [path.waypoints[:1]]
    for number, turn in enumerate(path.turns[:-1]):
        cut = radius * np.tan(0.5 * abs(turn))
        course, corner = path.courses[number], path.waypoints[number + 1]
        begin = corner - cut * np.array([np.cos(course), np.sin(course)])
        angles = np.linspace(0.0, abs(turn), int(abs(turn) / np.radians(3.0)) + 2)
        ahead, side = (
            radius * np.sin(angles),
            np.sign(turn) * radius * (1.0 - np.cos(angles)),
        )
        turned = np.array(
            [[np.cos(course), np.sin(course)], [-np.sin(course), np.cos(course)]]
        )
        points.append(begin + np.stack([ahead, side], axis=-1) @ turned)
    return np.concatenate([*points, path.waypoints[-1:]])


def on_path(radius, plan):
    """The state at the first waypoint."""
    return State(
        leg_from(0, 0.0, radius, plan),
        *[0.0] * 8,
        RudderActivity(0.0, 0.0, 0.0),
        *[0.0] * 4,
    )


def followed(path, radius, places):
    """States of a ship that goes along a path, at some ways along it, and
    these ways."""
    line, plan = rounded(path, radius), path.waypoints.ravel()
    way = np.append(0.0, np.cumsum(np.hypot(*np.diff(line, axis=0).T)))
    ways, asked = places * way[-1], Settings(turn_radius=radius / LENGTH)
    states, state = [], on_path(radius, plan)
    for one in ways:
        x, y = (np.interp(one, way, column) for column in line.T)
        motion, at = Motion(x, y, *[0.0] * 9), fix(x, y, state.leg, SHIP, asked)
        state = state._replace(distance_made_good=at.along_track)
        state = path_following.on_event(motion, state, None, SHIP, asked, None, plan)
        states.append((state, motion))
    return states, ways, asked


@settings(max_examples=20, deadline=None)
@given(
    st.lists(st.floats(-2.5, 2.5), min_size=1, max_size=4),
    st.floats(-3.1, 3.1),
    st.floats(-0.6, 0.6),
)
def test_a_position_lies_where_the_rounded_path_is_nearest(turns, course, off):
    """Against a polyline of the path, chords of 3 degrees in its turns."""
    points, radius = [np.zeros(2)], 300.0
    for turn in [*turns, 0.0]:
        points.append(points[-1] + 2400.0 * np.array([np.cos(course), np.sin(course)]))
        course += turn
    path = Path(np.array(points))
    path.check_turns(radius)
    states, ways, asked = followed(path, radius, np.linspace(0.0, 1.0, 200))
    tangents = np.gradient([(motion.x, motion.y) for _, motion in states], axis=0)
    for (state, motion), way, (north, east) in zip(states, ways, tangents, strict=True):
        aside = off * radius * np.array([-east, north]) / np.hypot(north, east)
        found = fix(motion.x + aside[0], motion.y + aside[1], state.leg, SHIP, asked)
        assert found.cross_track == pytest.approx(off * radius, abs=0.02 * radius)
        assert found.along_track == pytest.approx(way, rel=1e-3, abs=0.12 * radius)
        assert state.cross_track == pytest.approx(0.0, abs=0.001 * radius)
        assert state.distance_made_good == pytest.approx(way, rel=1e-3, abs=1e-6)


def test_given_waypoints_are_sailed_in_every_episode():
    env = gymnasium.make(ID, model="mariner", waypoints=HOOK).unwrapped
    for seed in (0, 1):
        env.reset(seed=seed)
        np.testing.assert_array_equal(env.waypoints, HOOK)
        state = env.physical_state()
        assert state["x"] == pytest.approx(0.0, abs=1e-9)
        assert abs(state["y"]) <= 0.5 * env.corridor
        assert abs(state["psi"]) <= np.pi / 12


def test_drawn_paths_follow_from_the_seed_and_keep_to_their_bounds():
    options = {"n_legs": 6, "leg_lengths": (5.0, 9.0), "max_turn_deg": 40.0}
    task = Task.of("PathFollowing", **options)
    engine = Engine(shipgym.load_model("mariner"), 200, task)
    engine.reset(np.arange(200))
    paths = [Path(engine.waypoints(lane)) for lane in range(200)]
    lengths = np.concatenate([path.lengths for path in paths]) / LENGTH
    turns = np.degrees(np.concatenate([path.turns[:-1] for path in paths]))
    assert 5.0 <= lengths.min() < 5.1
    assert 8.9 < lengths.max() <= 9.0
    assert -40.0 <= turns.min() < -39.0
    assert 39.0 < turns.max() <= 40.0
    assert abs(turns.mean()) < 4.0 * 40.0 / np.sqrt(3.0 * turns.size)
    single = gymnasium.make(ID, model="mariner", **options).unwrapped
    for seed in (5, 6):
        single.reset(seed=seed)
        np.testing.assert_array_equal(single.waypoints, paths[seed].waypoints)
    single.reset()
    assert not np.array_equal(single.waypoints, paths[6].waypoints)


@pytest.mark.parametrize("model", ["mariner", "kvlcc2"])
def test_a_course_autopilot_follows_the_path_as_it_is(model):
    rewards, infos, _ = sail(model=model, seed=1)
    assert infos[-1]["success"]
    assert not any(info["success"] for info in infos[:-1])
    assert not any(info["grounded"] for info in infos)
    assert infos[-1]["reward_end"] == 0.0
    assert np.mean([info["in_corridor"] for info in infos]) > 0.9
    assert -1.0 < rewards.mean() < 0.0


def test_the_reward_is_the_sum_of_its_named_parts():
    rewards, infos, env = sail(waypoints=HOOK, sea=TROUBLED, seed=2)
    parts = env.task.reward_parts
    sums = [sum(info[name] for name in parts) for info in infos]
    np.testing.assert_allclose(rewards, sums, rtol=1e-12)
    assert set(parts) == {name for name in infos[0] if name.startswith("reward_")}
    shown = {name: np.array([info[name] for info in infos]) for name in infos[0]}
    off = shown["cross_track"] / env.corridor
    pace = np.diff(shown["distance_made_good"]) / env.dt / SPEED
    missing = np.clip(1.0 - pace, 0.0, 2.0)
    off_path = np.isclose(shown["reward_cross_track"], -(off**2), rtol=1e-9)
    slow = np.isclose(shown["reward_progress"][1:], -missing, atol=1e-9)
    switches = 2  # to the next leg, on which both are measured again
    assert (~off_path).sum() <= switches
    assert (~slow).sum() <= 2 * switches
    np.testing.assert_array_equal(shown["in_corridor"], np.abs(off) <= 1.0)


def test_running_aground_ends_the_episode_and_says_so():
    rewards, infos, _ = sail(
        lambda seen, step, env: [0.0 if step < 50 else 1.0], waypoints=HOOK
    )
    last = infos[-1]
    assert (last["grounded"], last["success"], last["in_corridor"]) == (1, 0, 0)
    assert abs(last["cross_track"]) > 4.0 * LENGTH
    left = 1500 - len(rewards)
    assert last["reward_end"] == pytest.approx(-left * (4.0**2 + 2.0))


def test_a_current_sets_the_ship_off_and_course_error_shows_it():
    north = [[0.0, 0.0], [9000.0, 0.0]]
    across = Weather(current=Current(1.0, towards_deg=90.0))
    env = gymnasium.make(ID, model="mariner", waypoints=north, sea=across).unwrapped
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
    calm = gymnasium.make(ID, model="mariner", waypoints=north).unwrapped
    for one in (env, calm):
        one.reset(seed=1)
        for _ in range(30):
            one.step(np.zeros(1, dtype=np.float32))
    set_off = env.physical_state()["y"] - calm.physical_state()["y"]
    assert set_off == pytest.approx(30.0, abs=0.1)


angles, speeds = st.floats(-3.1, 3.1), st.floats(-3.0, 3.0)


def cutter(seen, step, env):
    """Steer straight for the waypoint behind the next, across the inside of
    the turn."""
    state = env.physical_state()
    goal = (
        HOOK[2]
        if np.hypot(*(HOOK[2] - (state["x"], state["y"]))) > 3.0 * LENGTH
        else HOOK[3]
    )
    goal = HOOK[3] if state["y"] > 1300.0 else goal
    north, east = goal[0] - state["x"], goal[1] - state["y"]
    error = np.angle((north + 1j * east) * np.exp(-1j * state["psi"]))
    return [float(np.clip(1.5 * error - 0.7 * seen[2], -1.0, 1.0))]


@pytest.mark.parametrize(
    ("policy", "options", "times"),
    [
        (lambda seen, step, env: [1.0], {}, 10.0),
        (lambda seen, step, env: [1.0], WIDE, 10.0),
        (lambda seen, step, env: [pd(seen) if step < 400 else -1.0], WIDE, 10.0),
        (lambda seen, step, env: [pd(seen) if step < 600 else 1.0], WIDE, 10.0),
        (lambda seen, step, env: [0.0], WIDE, 10.0),
        (lambda seen, step, env: [-pd(seen)], {}, 10.0),
        (cutter, WIDE, 2.0),
        (lambda seen, step, env: [pd(seen) + (0.3 if step % 2 else -0.3)], {}, 1.5),
        (lambda seen, step, env: [np.sign(pd(seen))], {}, 1.5),
        (lambda seen, step, env: [pd(seen) + 0.5 * np.sin(step / 8.0)], {}, 1.5),
    ],
    ids=[
        "circles",
        "circles where it is wide",
        "circles after a while",
        "circles before the end",
        "does nothing",
        "runs aground",
        "cuts",
        "chatters",
        "bangs",
        "weaves",
    ],
)
def test_gaming_the_reward_does_not_pay(policy, options, times):
    for seed in (0, 1):
        honest, kept, _ = sail(seed=seed, waypoints=HOOK, **options)
        played, infos, _ = sail(policy, seed, waypoints=HOOK, **options)
        assert kept[-1]["success"]
        assert played.sum() < times * honest.sum()
        assert all(-2.0 <= info["reward_progress"] <= 0.0 for info in infos)
        assert played.max() <= 0.0  # so that arriving pays, and the sooner the better


@pytest.mark.parametrize(
    "policy",
    [
        lambda seen, step, env: [0.0, 0.0],
        lambda seen, step, env: [pd(seen), 1.0 if step < 100 else 0.0],
        lambda seen, step, env: [pd(seen), 1.0 if step < 300 else -1.0],
        lambda seen, step, env: [pd(seen), 0.4],
    ],
    ids=["stops", "stops after a while", "stops before the end", "creeps"],
)
def test_stopping_does_not_pay(policy):
    asked = {
        "model": "kvlcc2",
        "action": "rudder-shaft",
        "episode_steps": 900,
        "n_legs": 2,
    }
    played, infos, _ = sail(policy, **asked)
    honest, kept, _ = sail(lambda seen, step, env: [pd(seen), 1.0], **asked)
    assert kept[-1]["success"]
    assert played.sum() < 2.0 * honest.sum()
    assert len(infos) > len(kept)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"waypoints": [[0, 0], [2000, 0], [0, 10]]},
            "row 1: .*got 180 deg: the path doubles back",
        ),
        (
            {"waypoints": [[0, 0], [900, 0], [1800, 900], [1900, 900]]},
            "rows 2 and 3: .*at least 266.6.*got 100 m",
        ),
        (
            {"waypoints": [[0, 0], [1, 0], [1, 1]]},
            "rows 0 and 1: .*got 1 m; .* smaller turn_radius",
        ),
        (
            {"waypoints": [[0, 0], [900, 0], [900, 0]]},
            "waypoints: row 2: expected finite",
        ),
        (
            {"max_turn_deg": 120.0},
            "leg_lengths: the least: expected a number >= 13.8.*turns.*got 8",
        ),
        ({"waypoints": [[0.0, 0.0]]}, r"at least 2 rows .*got shape \(1, 2\)"),
        (
            {"waypoints": [[0.0, 0.0], [np.nan, 1.0]]},
            "waypoints: row 1: expected finite",
        ),
        ({"waypoints": "north"}, "waypoints: .*got shape"),
        ({"corridor": 5.0}, "ground: expected a number > 5 .*got 4"),
        ({"leg_lengths": (9.0, 8.0)}, "leg_lengths: the largest: .*got 8"),
        ({"leg_lengths": (5.0,)}, "leg_lengths: expected 2 numbers in a list"),
        ({"max_turn_deg": 170.0}, "max_turn_deg: .*got 170"),
        ({"n_legs": 0}, "n_legs: .*got 0"),
        ({"lookahead": 0.0}, "lookahead: .*got 0"),
        ({"turn_radius": 0.0}, "turn_radius: .*got 0"),
        ({"turn_radios": 1.0}, "Did you mean 'turn_radius'"),
    ],
)
def test_a_path_that_cannot_be_planned_is_refused(options, message):
    with pytest.raises(InputError, match=message):
        gymnasium.make(ID, model="mariner", **options)
