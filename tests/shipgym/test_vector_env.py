"""The native vector environments: Gymnasium's promises, and the single environments row
by row."""

import warnings
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import NormalizeObservation, RecordEpisodeStatistics

import shipgym
from shipgym import InputError
from shipgym.envs.checker import check_vector_env

COURSE, PATH = "shipgym/CourseKeeping-v0", "shipgym/PathFollowing-v0"
SHORT = {"episode_steps": 23}
MODES = tuple(AutoresetMode)


@pytest.fixture(scope="module")
def mariner():
    return shipgym.load_model("mariner")


def vector(name, num_envs=3, **options):
    return gymnasium.make_vec(
        name, num_envs=num_envs, **{"model": "mariner", **options}
    )


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("name", [COURSE, PATH])
def test_conformance_and_rows_that_are_single_environments(name, mode):
    check_vector_env(
        lambda: vector(name, 3, autoreset_mode=mode, **SHORT),
        lambda: gymnasium.make(name, model="mariner", **SHORT),
        n_steps=60,
    )


@pytest.mark.parametrize(
    ("name", "options"),
    [
        (COURSE, {"sea": "rough", "noise": 1.0, "measurement": "filtered"}),
        (PATH, {"sea": ["calm", "moderate"], "noise": 2.0}),
        (
            PATH,
            {
                "model": "mariner-tls-svm",
                "model_uncertainty": "posterior",
                "speed_range": (0.7, 1.0),
            },
        ),
        (COURSE, {"action": "rudder-discrete"}),
        (PATH, {"model": "kvlcc2", "action": "rudder-shaft"}),
        (
            COURSE,
            {"model": "container", "roll": True, "roll_weight": 1.0, "sea": "moderate"},
        ),
    ],
)
def test_rows_are_single_environments_with_every_option(name, options):
    options = {"model": "mariner", **SHORT, **options}
    check_vector_env(
        lambda: gymnasium.make_vec(
            name, num_envs=66 if "sea" in options else 3, **options
        ),
        lambda: gymnasium.make(name, **options),
        n_steps=30,
    )


@pytest.mark.parametrize("threads", [2, 5])
def test_threads_change_nothing(threads):
    runs = []
    for count in (1, threads):
        env = vector(PATH, 200, threads=count, sea="moderate", **SHORT)
        env.reset(seed=3)
        env.action_space.seed(1)
        runs.append([env.step(env.action_space.sample())[:4] for _ in range(50)])
    for one, other in zip(*runs, strict=True):
        for a, b in zip(one, other, strict=True):
            np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_infos_are_those_of_gymnasiums_own_vector_environment(mode):
    ours = vector(PATH, 4, autoreset_mode=mode, **SHORT)
    theirs = gymnasium.make_vec(
        PATH,
        4,
        "sync",
        vector_kwargs={"autoreset_mode": mode},
        model="mariner",
        **SHORT,
    )
    ours.action_space.seed(0)
    first = [env.reset(seed=8)[1] for env in (ours, theirs)]
    seen = {key for key in first[0] if not key.startswith("_")}
    for infos, expected in [first, *(_infos(ours, theirs) for _ in range(50))]:
        assert infos.keys() == expected.keys()
        for key in seen:
            assert infos[key].dtype == expected[key].dtype
            np.testing.assert_array_equal(infos[key], expected[key])
            np.testing.assert_array_equal(infos[f"_{key}"], expected[f"_{key}"])
        for key in infos.keys() & {"final_obs"}:
            for row in np.flatnonzero(infos["_final_obs"]):
                np.testing.assert_array_equal(infos[key][row], expected[key][row])
        for key in seen if "final_info" in infos else ():
            np.testing.assert_array_equal(
                infos["final_info"][key], expected["final_info"][key]
            )


def _infos(ours, theirs):
    actions = ours.action_space.sample()
    return [env.step(actions)[-1] for env in (ours, theirs)]


def test_gymnasiums_vector_wrappers_work_on_it():
    env = NormalizeObservation(RecordEpisodeStatistics(vector(COURSE, 5, **SHORT)))
    env.reset(seed=0)
    lengths = []
    for _ in range(60):
        *_, infos = env.step(env.action_space.sample())
        lengths += (
            infos["episode"]["l"][infos["_episode"]].tolist()
            if "episode" in infos
            else []
        )
    assert len(lengths) >= 10
    assert set(lengths) <= set(range(1, 24))


def test_a_vector_environment_says_what_is_wrong(mariner):
    for options, message in (
        ({"num_envs": 0}, "num_envs: expected"),
        ({"sae": "calm"}, "Did you mean 'sea'"),
        ({"autoreset_mode": "later"}, "autoreset_mode: expected one of .* got 'later'"),
        ({"threads": 0}, "threads: expected"),
        (
            {"render_mode": "human"},
            "render_mode: expected one of 'rgb_array', or None, got 'human'",
        ),
        (
            {"ensemble": ["container"]},
            "ensemble: expected models of one structure, got 'container'",
        ),
        ({"model_uncertainty": "posterior"}, "model 'mariner': expected a covariance"),
        ({"speed_range": 0.5}, "speed_range: expected .* got 0.5"),
        ({"speed_range": (0.9, 0.5)}, "speed_range: the largest: expected"),
    ):
        with pytest.raises(InputError, match=message):
            vector(COURSE, **{"num_envs": 2, **options})
    env = vector(COURSE, 2)
    with pytest.raises(InputError, match="reset_mask"):
        env.reset(options={"reset_mask": np.zeros(3, dtype=np.bool_)})
    with pytest.raises(InputError, match=r"seed: expected .* got 3"):
        env.reset(seed=[1, 2, 3])
    discrete = vector(COURSE, 2, action="rudder-discrete")
    discrete.reset(seed=0)
    with pytest.raises(InputError, match="rudder orders"):
        discrete.step(np.array([0, 9]))


def test_ships_differ_from_episode_to_episode_and_return_with_the_seed():
    heavy = replace(shipgym.load_model("mariner"), name="heavy")
    options = {
        "ensemble": [heavy],
        "loading_range": (0.5, 2.0),
        "speed_range": (0.5, 1.0),
    }
    env = vector(COURSE, 300, **options)
    env.reset(seed=0)
    speeds = env.physical_state()["u"]
    assert 0.5 <= speeds.min() / 7.7175 < 0.55
    assert 0.95 < speeds.max() / 7.7175 <= 1.0
    for _ in range(20):
        env.step(np.ones((300, 1), dtype=np.float32))
    rates = env.physical_state()["r"] / speeds
    assert rates.max() > 2.0 * rates.min() > 0.0
    env.reset(seed=0)
    np.testing.assert_array_equal(env.physical_state()["u"], speeds)
    env.reset()
    assert not np.array_equal(env.physical_state()["u"], speeds)


def test_a_task_is_the_same_whatever_ship_is_drawn():
    plain, drawn = vector(PATH, 5), vector(PATH, 5, speed_range=(0.5, 1.0))
    for env in (plain, drawn):
        env.reset(seed=1)
    np.testing.assert_array_equal(
        plain.physical_state()["psi"], drawn.physical_state()["psi"]
    )
    np.testing.assert_array_equal(
        plain.unwrapped.waypoints(4), drawn.unwrapped.waypoints(4)
    )
    np.testing.assert_array_equal(
        plain.unwrapped.waypoints(), plain.unwrapped.waypoints(0)
    )
    assert not np.array_equal(
        plain.unwrapped.waypoints(0), plain.unwrapped.waypoints(1)
    )


def test_workers_of_other_processes():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make_vec(
            f"shipgym:{COURSE}",
            2,
            "async",
            vector_kwargs={"context": "spawn"},
            model="mariner",
        )
    seen, _ = env.reset(seed=4)
    ours, _ = vector(COURSE, 2).reset(seed=4)
    np.testing.assert_array_equal(seen, ours)
    env.close()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"reset_mask": np.zeros(3, dtype=np.bool_)},
            "reset_mask: expected True in one row at least",
        ),
        ({"reset_mask": np.ones(2, dtype=np.bool_)}, "expected a bool array of 3"),
        ({"reset_mask": np.ones(3, dtype=np.int64)}, "expected a bool array of 3"),
        ({"reset_mask": [True] * 3}, "expected a bool array of 3"),
        ({"mask": np.ones(3, dtype=np.bool_)}, "Did you mean 'reset_mask'"),
    ],
)
def test_a_mask_that_says_nothing_is_refused(options, message):
    envs = gymnasium.make_vec("shipgym/CourseKeeping-v0", num_envs=3, model="mariner")
    envs.reset(seed=0)
    with pytest.raises(InputError, match=message):
        envs.reset(options=options)


def test_an_unknown_mode_is_refused():
    for name, value in (("autoreset_mode", "Never"), ("render_mode", "human")):
        with pytest.raises(InputError, match=f"{name}: .*expected"):
            gymnasium.make_vec(
                "shipgym/CourseKeeping-v0", num_envs=2, model="mariner", **{name: value}
            )


@pytest.mark.parametrize("given", ["SameStep", "SAME_STEP", AutoresetMode.SAME_STEP])
def test_a_mode_is_named_as_gymnasium_has_it(given):
    assert (
        vector(COURSE, 2, autoreset_mode=given).metadata["autoreset_mode"]
        is AutoresetMode.SAME_STEP
    )


def test_without_a_mode_the_next_step_begins_the_next_episode():
    env = vector(COURSE, 2, episode_steps=3)
    assert (
        env.metadata["autoreset_mode"]
        is env.unwrapped.autoreset_mode
        is AutoresetMode.NEXT_STEP
    )
    assert env.metadata["render_modes"] == ["rgb_array"]
    env.reset(seed=0)
    steps = [env.step(np.zeros((2, 1), np.float32)) for _ in range(5)]
    assert [truncated.tolist() for *_, truncated, _ in steps] == [
        [k == 2] * 2 for k in range(5)
    ]
    assert [rewards.tolist() == [0.0, 0.0] for _, rewards, *_ in steps] == [
        k == 3 for k in range(5)
    ]


def test_rows_may_have_seeds_of_their_own_or_go_on_without():
    env = vector(COURSE, 3)
    first, _ = env.reset(seed=5)
    np.testing.assert_array_equal(env.reset(seed=[5, 6, 7])[0], first)
    np.testing.assert_array_equal(env.reset(seed=np.int64(5))[0], first)
    second, _ = env.reset()
    assert not np.any(np.all(second == first, axis=1))
    mixed, _ = env.reset(seed=[None, 6, None])
    np.testing.assert_array_equal(mixed[1], first[1])
    env.reset(seed=5)
    np.testing.assert_array_equal(env.reset()[0], second)
    again, _ = env.reset(
        options={"reset_mask": np.array([False, True, False])}, seed=[1, 6, 1]
    )
    np.testing.assert_array_equal(again, [second[0], first[1], second[2]])


def test_rows_outside_of_a_mask_keep_all_that_they_show():
    env = vector(COURSE, 3)
    env.reset(seed=5)
    *_, infos = env.step(np.full((3, 1), 0.5, np.float32))
    before = {name: infos[name].copy() for name in infos if not name.startswith("_")}
    mask = np.array([True, False, False])
    _, infos = env.reset(options={"reset_mask": mask})
    for name, values in before.items():
        np.testing.assert_array_equal(infos[name][1:], values[1:])
        np.testing.assert_array_equal(infos[f"_{name}"], mask)
    assert infos["reward_heading"][0] == 0.0
    infos["_reward_heading"][:] = True
    assert mask.tolist() == [True, False, False]
    with pytest.raises(
        InputError,
        match="options with a reset_mask of some rows: unknown key 'course_chan",
    ):
        env.reset(options={"reset_mask": mask, "course_change_deg": 5.0})


def test_the_last_infos_of_rows_that_go_on_are_zeros():
    env = vector(COURSE, 3, autoreset_mode="SameStep", episode_steps=9)
    env.reset(seed=5)
    for step in range(12):
        if step == 3:
            env.reset(options={"reset_mask": np.array([False, True, False])})
        seen, *_, infos = env.step(np.full((3, 1), 0.5, np.float32))
        if "final_info" in infos:
            ended = [step != 11, step == 11, step != 11]
            assert (
                infos["_final_obs"].tolist() == infos["_final_info"].tolist() == ended
            )
            final = infos["final_info"]
            assert (final["heading_error"] != 0.0).tolist() == ended
            assert final["_heading_error"].tolist() == ended
            assert final["extrapolating"].dtype == np.bool_
            assert [one is not None for one in infos["final_obs"]] == ended
            row = ended.index(True)
            assert not np.array_equal(infos["final_obs"][row], seen[row])
        else:
            assert step not in (8, 11)


def test_rows_answer_as_the_environments_of_gymnasium_s_sync_vector_env():
    ours = gymnasium.make_vec("shipgym/PathFollowing-v0", num_envs=2)
    theirs = gymnasium.make_vec(
        "shipgym/PathFollowing-v0", num_envs=2, vectorization_mode="sync"
    )
    for envs in (ours, theirs):
        envs.reset(seed=3)
    native, sync = ours.unwrapped, theirs.unwrapped
    assert native.get_attr("observation_names") == sync.get_attr("observation_names")
    for mine, other in zip(
        native.call("physical_state"), sync.call("physical_state"), strict=True
    ):
        assert mine == pytest.approx(other)
    native.set_attr("skill", [1, 2])
    assert native.get_attr("skill") == (1, 2)
    native.set_attr("skill", 3)
    assert native.call("skill") == (3, 3)
    for name, values, said in (
        ("model", 1, "set_attr: expected a name of your own, got 'model'"),
        ("skill", [1], "set_attr: expected a value for each of 2 rows, got 1"),
    ):
        with pytest.raises(InputError, match=said):
            native.set_attr(name, values)
    with pytest.raises(AttributeError, match="a row has no attribute 'nothing'"):
        native.call("nothing")
