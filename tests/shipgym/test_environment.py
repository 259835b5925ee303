"""Copies, pickles and states of environments, and the options of a reset."""

import copy
import pickle
from functools import partial

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import TimeAwareObservation

from shipgym import InputError, load_model
from shipgym.envs.engine import Engine, episode_keys
from shipgym.tasks import course_keeping_task

PATH, COURSE = "shipgym/PathFollowing-v0", "shipgym/CourseKeeping-v0"
HOOK = [[0.0, 0.0], [1500.0, 0.0], [2900.0, 1400.0]]
SEA = {
    "model": "mariner",
    "sea": ["calm", "moderate"],
    "noise": 1.0,
}  # shared with other tests


def one(name=PATH, **options):
    return gymnasium.make(name, **{"model": "mariner", **options})


def many(name=PATH, n=3, **options):
    return gymnasium.make_vec(name, n, **{"model": "mariner", **options})


def sailed(env, steps=30, swing=0.5):
    """All that some steps show."""
    shown = []
    for step in range(steps):
        action = np.full(
            env.action_space.shape, swing * np.sin(step / 5.0), dtype=np.float32
        )
        seen, rewards, terminated, truncated, infos = env.step(action)
        shown.append(
            [seen.copy(), np.copy(rewards), np.copy(terminated), np.copy(truncated)]
        )
        shown[-1] += [
            np.copy(infos[name])
            for name in sorted(infos)
            if not name.startswith(("_", "final"))
        ]
        if np.ndim(terminated) == 0 and (terminated or truncated):
            env.reset()
    return shown


def same(first, second):
    for a, b in zip(first, second, strict=True):
        for left, right in zip(a, b, strict=True):
            np.testing.assert_array_equal(left, right)


@pytest.mark.parametrize(
    "again",
    [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))],
    ids=["copy", "pickle"],
)
@pytest.mark.parametrize(
    ("make", "options"),
    [
        (one, {"episode_steps": 20}),
        (many, {"episode_steps": 20}),
        (one, {"episode_steps": 20, "frame_stack": 3, "rate_limit": 0.1}),
        (many, {"episode_steps": 50, "frame_stack": 2, "action_repeat": 3}),
        (partial(many, COURSE), {**SEA, "autoreset_mode": "SameStep"}),
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
    with pytest.raises(
        InputError, match="waypoints: rows 0 and 1: expected a distance of at least"
    ):
        env.reset(options={"waypoints": [[0, 0], [1, 0], [1, 1]]})
    np.testing.assert_array_equal(path(), drawn)


def test_libraries_read_the_steps_of_an_episode():
    assert one().spec.max_episode_steps == 1500
    assert one(episode_steps=50).spec.max_episode_steps == 50
    assert TimeAwareObservation(one(COURSE)).reset(seed=0)[0][-1] == 0.0


def test_an_unknown_keyword_is_a_type_error_too():
    for make in (one, many):
        with pytest.raises(TypeError, match="unexpected keyword argument 'frameskip'"):
            make(frameskip=1)


def three_ships():
    engine = Engine(load_model("mariner"), 3, course_keeping_task())
    engine.reset([1, 2, 3])
    return engine


def shown_by(engine):
    return [
        engine.observations,
        engine.info("heading_error").copy(),
        engine.outputs.outcomes[0].copy(),
    ]


def test_a_refused_action_leaves_what_was_shown():
    engine = three_ships()
    for _ in range(4):
        engine.step(np.full((3, 1), 0.3))
    before = shown_by(engine)
    message = r"^actions: expected numbers in \[-1, 1\], got inf in lane 1$"
    with pytest.raises(InputError, match=message):
        engine.step(np.array([[0.0], [np.inf], [np.nan]]))
    assert before[2].all()  # costs
    for array, now in zip(before, shown_by(engine), strict=True):
        np.testing.assert_array_equal(now, array)


def test_seeds_are_those_of_gymnasiums_generators():
    keys = episode_keys([[0, 1], [2, 0]])
    assert keys.dtype == np.uint64
    assert keys.shape == (2, 2)
    assert keys[0, 0] == keys[1, 1]
    first = int(np.random.Generator(np.random.PCG64(1)).integers(2**63))
    assert keys[0, 1] == first
    assert len(np.unique(keys)) == 3
