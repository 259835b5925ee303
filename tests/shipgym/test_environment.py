"""Copies, pickles and states of environments, and the options of a reset."""

import copy
import pickle
from dataclasses import replace
from functools import partial

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import TimeAwareObservation

from shipgym import InputError, load_model
from shipgym.envs.engine import Engine, episode_keys
from shipgym.envs.environment import given_orders
from shipgym.tasks import course_keeping_task, path_following_task
from shipgym.tasks.task import RUDDER_ORDERS

PATH, COURSE = "shipgym/PathFollowing-v0", "shipgym/CourseKeeping-v0"
NINE = [np.array(RUDDER_ORDERS, dtype=np.float32)]
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
    np.testing.assert_array_equal(
        seen, state["engine"]["observations"].reshape(seen.shape)
    )
    np.testing.assert_array_equal(
        info["cross_track"], np.squeeze(state["engine"]["outcomes"][4])
    )
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
        "engine": {
            **state["engine"],
            "observations": np.full_like(env.reset(seed=0)[0], np.nan)[None],
        },
    }
    before = env.physical_state()
    course, tanker, short, vector = (
        one(COURSE),
        one(model="mariner-tls-svm"),
        one(waypoints=HOOK),
        many(),
    )
    for other in (course, tanker, short, vector):
        other.reset(seed=0)
    states = [other.unwrapped.get_state() for other in (course, tanker, short, vector)]
    for given, message in [
        (
            states[0],
            (
                "state: task: expected 'PathFollowing', got 'CourseKeeping': .*"
                " same version"
            ),
        ),
        (states[1], "state: model: expected 'mariner', got 'mariner-tls-svm'"),
        (states[2], "state: states: expected shape"),
        (states[3], "state: unknown key 'some_over'"),
        (broken, "state: motion.x: expected finite numbers, got none in row 0"),
        (blind, "state: observations: expected finite"),
        (
            {**state, "engine": {**state["engine"], "made_for": 3}},
            "state: made_for: expected a table",
        ),
        ({**state, "asked": "x"}, "state: asked: expected a table"),
        ({**state, "row_keys": "x"}, "state: row_keys: expected integers"),
        ({}, "state: field 'asked' is missing"),
        (3, "state: expected a table"),
    ]:
        with pytest.raises(InputError, match=message):
            env.set_state(given)
        with pytest.raises(InputError, match=message):
            env.reset(options={"state": given})
    with pytest.raises(
        InputError,
        match=r"expected 'state' alone, got it together with \['waypoints'\]",
    ):
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
    with pytest.raises(
        InputError, match="waypoints: rows 0 and 1: expected a distance of at least"
    ):
        env.reset(options={"waypoints": [[0, 0], [1, 0], [1, 1]]})
    np.testing.assert_array_equal(path(), drawn)


def test_libraries_read_the_steps_of_an_episode():
    assert one().spec.max_episode_steps == 1500
    assert one(episode_steps=50).spec.max_episode_steps == 50
    assert TimeAwareObservation(one(COURSE)).reset(seed=0)[0][-1] == 0.0
    env = many(max_episode_steps=4)
    env.reset(seed=0)
    assert [env.step(np.zeros((3, 1), np.float32))[3].all() for _ in range(4)] == [
        False,
        False,
        False,
        True,
    ]
    with pytest.raises(
        InputError, match=r"max_episode_steps: expected episode_steps, 5, .* got 4"
    ):
        many(max_episode_steps=4, episode_steps=5)


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


def test_the_first_reward_that_is_no_number_is_named():
    engine = three_ships()
    engine.step(np.zeros((3, 1)))
    own = engine.task.definition.reward_source
    engine.outputs.outcomes[0, 1] = (
        np.inf
    )  # a sum beyond all numbers, of parts that are within
    with pytest.raises(InputError) as caught:
        engine.refuse_rewards()
    value = engine.info("reward_heading")[1]
    assert str(caught.value).startswith(
        f"{own}: reward_heading: expected a finite number, got {value} in lane 1"
        " at step 1; look for"
    )
    engine.info("reward_rudder_rate")[2] = np.nan
    with pytest.raises(
        InputError,
        match=r"reward_rudder_rate: expected a finite number, got nan in lane 2",
    ):
        engine.refuse_rewards()


def test_a_state_tells_which_number_of_which_ship_is_none():
    env = many().unwrapped
    env.reset(seed=0)
    state = env.get_state()
    first = state["engine"]["states"].reshape(-1, 64)
    rows = len(state["engine"]["made_for"]["rows"])
    for row, name in ((3, "motion.u"), (rows, "plan"), (rows + 9, "plan")):
        wrong = copy.deepcopy(state)
        wrong["engine"]["states"].reshape(-1, 64)[row, 2] = np.inf
        with pytest.raises(
            InputError,
            match=f"^state: {name}: expected finite numbers, got none in row 2$",
        ):
            env.set_state(wrong)
    first[:, 3:] = np.nan  # lanes without a ship
    env.set_state(state)


def test_a_state_of_another_ship_by_the_same_name_is_refused():
    mariner = load_model("mariner")
    other = replace(mariner, coefficients={**mariner.coefficients, "N_d": 0.0011})
    env, another = (one(COURSE, model=ship).unwrapped for ship in (mariner, other))
    for each in (env, another):
        each.reset(seed=0)
    with pytest.raises(
        InputError,
        match=r"^state: expected that of this 'mariner', got another ship's$",
    ):
        env.set_state(another.get_state())
    short = env.get_state()
    short["engine"]["keys"] = short["engine"]["keys"][:, :2]
    with pytest.raises(
        InputError,
        match=r"^state: keys: expected shape \(1, 3, 64\), got \(1, 2, 64\)$",
    ):
        env.set_state(short)


def test_numbers_of_the_state_are_read_and_written_by_name():
    engine = three_ships()
    assert engine.read("u").tolist() == [engine.model.particulars["speed"]] * 3
    assert not np.any(
        [
            engine.read(name)
            for name in ("v", "r", "delta", "rudder_command", "steps", "ended")
        ]
    )
    assert engine.read("shaft_command").tolist() == [1.0] * 3
    engine.write("r", [1e-3, 2e-3, 3e-3])
    assert engine.read("r").tolist() == [1e-3, 2e-3, 3e-3]
    assert engine.read("u").tolist() == [engine.model.particulars["speed"]] * 3
    with pytest.raises(KeyError, match="depth"):
        engine.read("depth")


def test_lengths_of_a_path_are_in_metres_where_there_is_one():
    mariner = load_model("mariner")
    course = Engine(mariner, 1, course_keeping_task())
    path = Engine(mariner, 1, path_following_task())
    assert path.path_metres("corridor") == pytest.approx(160.93)
    assert path.path_metres("turn_radius") == pytest.approx(4.0 * 160.93)
    assert course.path_metres("corridor") is None
    assert course.waypoints() is None


def test_masks_and_orders_of_all_ships_cannot_be_written_by_accident():
    env = many(COURSE, model="mariner").unwrapped
    env.reset(seed=0)
    *_, infos = env.step(np.zeros((3, 1), np.float32))
    with pytest.raises(ValueError, match="read-only"):
        infos["_heading_error"][0] = False


def test_episodes_of_a_checkpoint_go_on_for_every_row():
    env, other = (
        many(COURSE, model="mariner").unwrapped,
        many(COURSE, model="mariner").unwrapped,
    )
    env.reset(seed=4)
    sailed(env, 10)
    memory = env.memory()
    ours = sailed(env, 10, swing=0.8)
    other.remember(memory)
    same(ours, sailed(other, 10, swing=0.8))
    np.testing.assert_array_equal(env.reset()[0], other.reset()[0])


@pytest.mark.parametrize(
    ("given", "expected"),
    [(4, [[0.0]]), (np.int64(0), [[-1.0]]), (8, [[1.0]]), (np.uint8(5), [[0.1]])],
)
def test_an_order_is_one_of_nine(given, expected):
    np.testing.assert_allclose(given_orders(NINE, given, (), "action"), expected)


@pytest.mark.parametrize("wrong", [-1, 9, 4.0, [4], True])
def test_what_is_no_order_is_refused(wrong):
    with pytest.raises(InputError) as caught:
        given_orders(NINE, wrong, (), "action")
    assert (
        str(caught.value)
        == f"action: expected an integer from 0 to 8: a rudder order, got {wrong!r}"
    )


def test_orders_of_several_ships_are_a_column():
    found = given_orders(NINE, [0, 8, 2], (3,), "actions")
    np.testing.assert_allclose(found, [[-1.0], [1.0], [-0.25]])
    assert found.dtype == np.float32
    for wrong in ([0, 8], [0, 8, 9], [-1, 0, 0], [0.0, 1.0, 2.0], 3):
        with pytest.raises(
            InputError,
            match=r"expected integers of shape \(3,\) from 0 to 8: rudder orders",
        ):
            given_orders(NINE, wrong, (3,), "actions")


def test_seeds_are_those_of_gymnasiums_generators():
    keys = episode_keys([[0, 1], [2, 0]])
    assert keys.dtype == np.uint64
    assert keys.shape == (2, 2)
    assert keys[0, 0] == keys[1, 1]
    first = int(np.random.Generator(np.random.PCG64(1)).integers(2**63))
    assert keys[0, 1] == first
    assert len(np.unique(keys)) == 3
