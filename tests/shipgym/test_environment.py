"""Copies, pickles and states of environments, and the options of a reset."""

import copy
import pickle
from functools import partial

import cloudpickle
import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import RecordEpisodeStatistics, TimeAwareObservation
from gymnasium.wrappers.vector import RecordEpisodeStatistics as VectorStatistics
from stable_baselines3.common.monitor import Monitor

from shipgym import InputError, ShipVecEnv, Weather, Wind, load_model
from shipgym.envs.engine import Engine
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
            if not name.startswith(("_", "final", "constraints"))
        ]
        if np.ndim(terminated) == 0 and (terminated or truncated):
            env.reset()
    return shown


def same(first, second):
    for a, b in zip(first, second, strict=True):
        for left, right in zip(a, b, strict=True):
            np.testing.assert_array_equal(left, right)


@pytest.mark.parametrize(
    "options",
    [
        {"episode_steps": np.int64(20)},
        {"action_repeat": np.int64(2)},
        {
            "ensemble": load_model("mariner-tls-svm").sample(2, 0),
            "model": "mariner-tls-svm",
        },
        {"autoreset_mode": AutoresetMode.SAME_STEP},
    ],
)
def test_a_spec_travels_as_json(options):
    env = many(COURSE, **options)
    again = gymnasium.make_vec(EnvSpec.from_json(env.spec.to_json()))
    np.testing.assert_array_equal(again.reset(seed=3)[0], env.reset(seed=3)[0])


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
def test_waypoints_may_be_given(make):
    env = make(waypoints=HOOK).unwrapped
    env.reset(seed=1)
    path = env.waypoints() if make is many else env.waypoints
    np.testing.assert_array_equal(path, HOOK)
    with pytest.raises(
        InputError, match="waypoints: rows 0 and 1: expected a distance of at least"
    ):
        make(waypoints=[[0, 0], [1, 0], [1, 1]])


def test_libraries_read_the_steps_of_an_episode():
    assert one().spec.max_episode_steps == 1500
    assert one(episode_steps=50).spec.max_episode_steps == 50
    assert TimeAwareObservation(one(COURSE)).reset(seed=0)[0][-1] == 0.0


@pytest.mark.parametrize("limit", ["episode_steps", "max_episode_steps"])
@pytest.mark.parametrize("record", [lambda env: env, RecordEpisodeStatistics, Monitor])
def test_the_end_of_an_episode_tells_its_cost_and_success(record, limit):
    env = record(one(**{limit: 20}))
    env.reset(seed=3)
    costs, over = [], False
    while not over:
        *_, terminated, truncated, info = env.step(np.zeros(1, dtype=np.float32))
        over = terminated or truncated
        costs.append(info["cost"])
    assert info["episode"]["cost"] == info["episode_cost"] == pytest.approx(sum(costs))
    assert info["is_success"] is False
    assert info["episode"].get("l", 20) == 20


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_rows_tell_their_cost_at_the_end(mode):
    env = VectorStatistics(many(COURSE, episode_steps=20, autoreset_mode=mode))
    env.reset(seed=3)
    for _ in range(20):
        *_, infos = env.step(np.zeros((3, 1), dtype=np.float32))
    last = infos.get("final_info", infos)
    single = one(COURSE, episode_steps=20)
    single.reset(seed=4)
    for _ in range(20):
        *_, info = single.step(np.zeros(1, dtype=np.float32))
    assert infos["episode"]["cost"][1] == info["episode"]["cost"]
    assert last["is_success"].tolist() == [True, True, True]
    assert infos["episode"]["l"].tolist() == [20, 20, 20]


def test_constraints_stand_apart_from_the_cost():
    narrow = {"corridor": 0.3, "ground": 50.0, "heel_limit_deg": 1.0, "roll": True}
    env = one(model="container", **narrow)
    safe = one(model="container", constraint_cost=True, action_repeat=2, **narrow)
    for each in (env, safe):
        each.reset(seed=1)
    hard = np.ones(1, dtype=np.float32)
    sums = {"corridor": 0.0, "heel": 0.0}
    for _ in range(60):
        for _ in range(2):
            *_, info = env.step(hard)
            for name, excess in info["constraints"].items():
                sums[name] += excess
        *_, other = safe.step(hard)
    state, length = (
        env.unwrapped.physical_state(),
        env.unwrapped.model.particulars["length"],
    )
    heel = np.degrees(abs(state["phi"]))
    off = abs(info["cross_track"]) / (0.3 * length)
    assert info["constraints"]["heel"] == pytest.approx(max(heel - 1.0, 0.0))
    assert info["constraints"]["corridor"] == pytest.approx(max(off - 1.0, 0.0))
    assert min(sums.values()) > 0.0
    assert other["cost"] == pytest.approx(sum(other["constraints"].values()))
    assert other["objective"] > info["cost"]
    with pytest.raises(InputError, match="constraint_cost: expected a task with const"):
        one(COURSE, constraint_cost=True)


def test_an_episode_starts_as_asked():
    start = {"heading_error": 0.2, "cross_track": 30.0, "speed": 6.0, "rudder": 0.1}
    env, rows = one(), many()
    seen, info = env.reset(seed=1, options={"start": start})
    state = env.unwrapped.physical_state()
    assert (state["u"], state["delta"]) == (6.0, 0.1)
    found = [info["heading_error"], info["cross_track"], np.arctan2(seen[0], seen[1])]
    assert found == pytest.approx([0.2, 30.0, 0.2], abs=1e-6)
    by_row = {**start, "cross_track": [0.0, 30.0, -20.0]}
    shown, infos = rows.reset(seed=0, options={"start": by_row})
    np.testing.assert_array_equal(shown[1], seen)
    np.testing.assert_allclose(infos["cross_track"], by_row["cross_track"], atol=1e-9)
    action = np.full((3, 1), 0.3, dtype=np.float32)
    np.testing.assert_array_equal(rows.step(action)[0][1], env.step(action[0])[0])
    for asked, message in (
        ({"cross_track": 1e5}, "start: expected a ship .* lost or arrived in lane 0"),
        ({"speed": 1e3}, "start: expected a ship .* beyond the physical range"),
        ({"rudder": 3.0}, "start: rudder: expected -0.69.* to 0.69"),
        ({"speed": -1.0}, "start: speed: expected 0 to inf"),
        ({"sped": 3.0}, "Did you mean 'speed'"),
        (
            {"speed": [1.0, 2.0]},
            "start: speed: expected a number, or one for each",
        ),
    ):
        with pytest.raises(InputError, match=message):
            env.reset(options={"start": asked})
        with pytest.raises(InputError, match="no episode has begun"):
            env.step(action[0])
    for no_number in ("0.1", True):
        with pytest.raises(InputError, match="rudder: expected an array of numbers"):
            rows.reset(options={"start": {"rudder": no_number}})


def test_the_largest_number_of_steps_means_the_same_for_one_and_many():
    env = one(COURSE, max_episode_steps=7)
    rows = many(COURSE, max_episode_steps=7)
    assert rows.spec.max_episode_steps == env.spec.max_episode_steps == 7
    env.reset(seed=0)
    rows.reset(seed=0)
    for step in range(7):
        action = np.full((3, 1), 0.1, dtype=np.float32)
        *_, truncated, _ = env.step(action[0])
        assert truncated == rows.step(action)[3][0] == (step == 6)
    assert gymnasium.make_vec(rows.spec).num_envs == 3
    with pytest.raises(InputError, match="max_episode_steps: expected an integer"):
        many(COURSE, max_episode_steps=0)


def test_a_spec_with_a_model_and_weather_at_hand_travels_as_json():
    wind = Weather(wind=Wind(12.0, from_deg=20.0))
    env = one(COURSE, model=load_model("mariner"), sea=[wind], noise=np.float64(1.0))
    again = gymnasium.make(EnvSpec.from_json(env.spec.to_json())).unwrapped
    assert again.model.coefficients == env.unwrapped.model.coefficients
    assert again.task.seas == env.unwrapped.task.seas
    np.testing.assert_array_equal(again.reset(seed=3)[0], env.reset(seed=3)[0])


@pytest.mark.parametrize(
    "again",
    [copy.deepcopy, lambda env: cloudpickle.loads(cloudpickle.dumps(env))],
    ids=["copy", "cloudpickle"],
)
def test_a_copy_of_ships_for_stable_baselines3_goes_on_as_they_do(again):
    env = ShipVecEnv(COURSE, 2, seed=3, model="mariner", episode_steps=9)
    env.reset()
    action = np.full((2, 1), 0.3, dtype=np.float32)
    for _ in range(4):
        env.step(action)
    other = again(env)
    for _ in range(12):
        first, second = env.step(action), other.step(action)
        np.testing.assert_array_equal(first[0], second[0])
        np.testing.assert_array_equal(first[1], second[1])


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
