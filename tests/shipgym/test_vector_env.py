"""The native vector environments: Gymnasium's promises, and the single environments row
by row."""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import NormalizeObservation, RecordEpisodeStatistics

import shipgym
from shipgym import InputError
from tests.shipgym.vector_checker import check_vector_env

COURSE, PATH = "shipgym/CourseKeeping-v0", "shipgym/PathFollowing-v0"
SHORT = {"episode_steps": 23}
PACED = {"action_repeat": 3, "rate_limit": 0.1, "frame_stack": 2}
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
        (
            PATH,
            {
                "model": "mariner-tls-svm",
                "model_uncertainty": "covariance",
                "speed_range": (0.7, 1.0),
            },
        ),
        (PATH, {"model": "kvlcc2", "action": "rudder-shaft"}),
        *((COURSE, {**PACED, "autoreset_mode": mode}) for mode in MODES),
        (
            COURSE,
            {"model": "container", "roll": True, "roll_weight": 1.0, "sea": "moderate"},
        ),
    ],
)
def test_rows_are_single_environments_with_every_option(name, options):
    options = {"model": "mariner", **SHORT, **options}
    single = {key: one for key, one in options.items() if key != "autoreset_mode"}
    check_vector_env(
        lambda: gymnasium.make_vec(
            name, num_envs=66 if "sea" in options else 3, **options
        ),
        lambda: gymnasium.make(name, **single),
        n_steps=30,
    )


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
    for infos, expected in [first, *(_infos(ours, theirs) for _ in range(50))]:
        seen, right = (each.pop("final_obs", []) for each in (infos, expected))
        for name in ("episode_cost", "is_success"):  # of single ones in every step
            for each in (infos, expected):
                each.pop(name, None)
                each.pop(f"_{name}", None)
        for row in np.flatnonzero(expected.get("_final_obs", [])):
            np.testing.assert_array_equal(seen[row], right[row])
        np.testing.assert_equal(infos, expected)
        for key, values in expected.items():
            if not isinstance(values, dict):
                assert infos[key].dtype == values.dtype


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
        (
            {"render_mode": "human"},
            "render_mode: expected one of 'rgb_array', or None, got 'human'",
        ),
        (
            {"ensemble": ["container"]},
            "ensemble: expected models of one structure, got 'container'",
        ),
        ({"model_uncertainty": "covariance"}, "model 'mariner': expected a covariance"),
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
    with pytest.raises(InputError, match="options: unknown key 'course_chan"):
        env.reset(options={"reset_mask": mask, "course_change_deg": 5.0})
