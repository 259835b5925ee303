"""Copies, pickles and states of environments, and the options of a reset."""

import copy
import pickle
from functools import partial

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import TimeAwareObservation

from shipgym import InputError

PATH, FIRST, COURSE = "shipgym/PathFollowing-v1", "shipgym/PathFollowing-v0", "shipgym/CourseKeeping-v0"
HOOK = [[0.0, 0.0], [1500.0, 0.0], [2900.0, 1400.0]]
SEA = {"model": "mariner", "sea": ["calm", "moderate"], "noise": 1.0}  # shared with other tests


def one(name=PATH, **options):
    return gymnasium.make(name, **{"model": "mariner", **options})


def many(name=PATH, n=3, **options):
    return gymnasium.make_vec(name, n, **{"model": "mariner", **options})


def sailed(env, steps=30, swing=0.5):
    """All that some steps show."""
    shown = []
    for step in range(steps):
        action = np.full(env.action_space.shape, swing * np.sin(step / 5.0), dtype=np.float32)
        seen, rewards, terminated, truncated, infos = env.step(action)
        shown.append([seen.copy(), np.copy(rewards), np.copy(terminated), np.copy(truncated)])
        shown[-1] += [np.copy(infos[name]) for name in sorted(infos) if not name.startswith(("_", "final"))]
        if np.ndim(terminated) == 0 and (terminated or truncated):
            env.reset()
    return shown


def same(first, second):
    for a, b in zip(first, second, strict=True):
        for left, right in zip(a, b, strict=True):
            np.testing.assert_array_equal(left, right)


@pytest.mark.parametrize(
    "again", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))], ids=["copy", "pickle"]
)
@pytest.mark.parametrize(
    ("make", "options"),
    [
        (one, {"episode_steps": 20}),
        (many, {"episode_steps": 20}),
        (partial(many, FIRST), {**SEA, "autoreset_mode": "SameStep"}),
    ],
)
def test_copies_step_identically_and_on_their_own(make, options, again):
    env = make(**options)
    fresh = again(env)
    seen, _ = env.reset(seed=5)
    np.testing.assert_array_equal(fresh.reset(seed=5)[0], seen)
    sailed(env, 12)
    env.unwrapped.remark = "mine"
    other = again(env)
    assert other.unwrapped.remark == "mine"
    assert other.spec == env.spec
    ours = sailed(env)
    same(ours, sailed(other))
    np.testing.assert_array_equal(env.reset()[0], other.reset()[0])


@pytest.mark.parametrize("make", [one, many])
def test_a_state_is_gone_back_to(make):
    env = make(episode_steps=40).unwrapped
    env.reset(seed=2)
    sailed(env, 15)
    state = env.get_state()
    ours = sailed(env, swing=0.9)
    env.set_state(state)
    same(ours, sailed(env, swing=0.9))
    other = make(episode_steps=40).unwrapped
    seen, info = other.reset(options={"state": state})
    np.testing.assert_array_equal(seen, state["engine"]["observations"].reshape(seen.shape))
    np.testing.assert_array_equal(info["cross_track"], np.squeeze(state["engine"]["outcomes"][4]))
    same(ours, sailed(other, swing=0.9))


def test_states_that_do_not_fit_are_refused_and_change_nothing():
    env = one().unwrapped
    with pytest.raises(InputError, match="no episode has begun"):
        env.get_state()
    env.reset(seed=0)
    state, before = env.get_state(), env.physical_state()
    broken = copy.deepcopy(state)
    broken["engine"]["states"][0, 0] = np.nan
    blind = {
        **state,
        "engine": {**state["engine"], "observations": np.full_like(env.reset(seed=0)[0], np.nan)[None]},
    }
    before = env.physical_state()
    first, tanker, short, vector = one(FIRST), one(model="mariner-tls-svm"), one(waypoints=HOOK), many()
    for other in (first, tanker, short, vector):
        other.reset(seed=0)
    states = [other.unwrapped.get_state() for other in (first, tanker, short, vector)]
    for given, message in [
        (states[0], "state: task 'PathFollowing' found, expected 'PathFollowing-v1': .* same version"),
        (states[1], "state: model 'mariner-tls-svm' found, expected 'mariner'"),
        (states[2], "state: states of shape"),
        (states[3], "state: unknown key 'some_over'"),
        (broken, "state: motion.x in row 0 is not finite"),
        (blind, "state: observations are not finite"),
        (
            {**state, "engine": {**state["engine"], "made_for": 3}},
            "state: made_for: 3 found, expected a table",
        ),
        ({**state, "asked": "x"}, "state: asked: 'x' found, expected a table"),
        ({**state, "row_keys": "x"}, "state: row_keys 'x' found"),
        ({}, "state: field 'asked' is missing"),
        (3, "state: 3 found, expected a table"),
    ]:
        with pytest.raises(InputError, match=message):
            env.set_state(given)
        with pytest.raises(InputError, match=message):
            env.reset(options={"state": given})
    with pytest.raises(InputError, match=r"'state' found together with \['waypoints'\], expected it alone"):
        env.reset(options={"state": state, "waypoints": HOOK})
    assert env.physical_state() == before


@pytest.mark.parametrize("make", [one, many])
def test_waypoints_of_a_reset_hold_until_the_next(make):
    env = make().unwrapped
    path = env.waypoints if make is many else lambda: env.waypoints
    env.reset(seed=1)
    drawn = path()
    env.reset(seed=1, options={"waypoints": HOOK})
    np.testing.assert_array_equal(path(), HOOK)
    other = copy.deepcopy(env)
    same(sailed(env), sailed(other))
    env.reset(seed=1)
    np.testing.assert_array_equal(path(), drawn)
    with pytest.raises(InputError, match="waypoints: rows 0 and 1 are 1 m apart"):
        env.reset(options={"waypoints": [[0, 0], [1, 0], [1, 1]]})
    np.testing.assert_array_equal(path(), drawn)


def test_a_model_index_chooses_among_the_ships_that_are_drawn_from():
    options = {"model": "mariner-tls-svm", "ensemble": ["mariner"], "speed_range": (0.5, 1.0)}
    env = many(COURSE, 2, **options)
    env.reset(seed=0, options={"model_index": 7})
    speeds = env.unwrapped.physical_state()["u"]
    assert speeds[0] == speeds[1] == env.unwrapped._own_engine.pool[7][0].particulars["speed"]
    for wrong in (-1, 256, 1.0, "first"):
        with pytest.raises(InputError, match=r"model_index: .* found, expected a whole number of at least 0"):
            env.reset(options={"model_index": wrong})
    with pytest.raises(InputError, match=r"model_index: 1 found.* at most 0"):
        one().reset(options={"model_index": 1})
    with pytest.raises(InputError, match="options: unknown key 'waypoints'"):
        env.reset(options={"waypoints": HOOK})


def test_libraries_read_the_steps_of_an_episode():
    assert one().spec.max_episode_steps == 1500
    assert one(episode_steps=50).spec.max_episode_steps == 50
    assert TimeAwareObservation(one(COURSE)).reset(seed=0)[0][-1] == 0.0
    env = many(max_episode_steps=4)
    env.reset(seed=0)
    assert [env.step(np.zeros((3, 1), np.float32))[3].all() for _ in range(4)] == [False, False, False, True]
    with pytest.raises(InputError, match="max_episode_steps: 4 found together with episode_steps 5"):
        many(max_episode_steps=4, episode_steps=5)


def test_an_unknown_keyword_is_a_type_error_too():
    for make in (one, many):
        with pytest.raises(TypeError, match="unexpected keyword argument 'frameskip'"):
            make(frameskip=1)
