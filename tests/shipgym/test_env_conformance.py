"""What Gymnasium, stable-baselines3 and workers ask of an environment; wrong arguments
and actions."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env as gymnasium_check_env
from stable_baselines3.common.env_checker import check_env as sb3_check_env
from stable_baselines3.common.vec_env import SubprocVecEnv

import shipgym
from shipgym import InputError
from shipgym.envs.registration import ENVIRONMENTS
from shipgym.models import ShipModel
from shipgym.sea import Current, Weather, Wind
from tests.shipgym.vector_checker import check_vector_env

pytestmark = pytest.mark.interpreted

COURSE, PATH = "shipgym/CourseKeeping-v0", "shipgym/PathFollowing-v0"
IDS = list(ENVIRONMENTS)
SEA = Weather(current=Current(0.5), wind=Wind(9.0))
BY_KEYWORD = [
    (
        COURSE,
        {"model": "mariner", "sea": "rough", "noise": 1.0, "measurement": "filtered"},
    ),
    (
        COURSE,
        {"model": "mariner", "speed_range": (0.5, 1.0), "loading_range": (0.8, 1.2)},
    ),
    (
        PATH,
        {
            "model": "mariner",
            "waypoints": [[0.0, 0.0], [2000.0, 500.0]],
            "sea": ["calm", SEA],
            "noise": 1.0,
        },
    ),
    (PATH, {"model": "kvlcc2", "action": "rudder-shaft", "noise": 0.5}),
]
EVERY = [*((name, {}) for name in IDS), *BY_KEYWORD]
NAMES = [
    f"{name.removeprefix('shipgym/')} {' '.join(options)}" for name, options in EVERY
]


@pytest.mark.parametrize(("name", "options"), EVERY, ids=NAMES)
@pytest.mark.parametrize(
    "check", [gymnasium_check_env, sb3_check_env], ids=["gymnasium", "sb3"]
)
def test_every_id_and_variant_conforms_without_a_warning(check, name, options):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(name, **options)
        check(env.unwrapped)
    assert env.spec.id == name


@pytest.mark.parametrize("name", IDS)
def test_a_spec_travels_as_json(name):
    env = gymnasium.make(name, episode_steps=50)
    again = gymnasium.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.task == env.unwrapped.task
    np.testing.assert_array_equal(again.reset(seed=3)[0], env.reset(seed=3)[0])


def sailed(name, options):
    """Three episodes by one seed: all that is shown."""
    env = gymnasium.make(name, episode_steps=25, **options)
    env.action_space.seed(7)
    shown = []
    for seed in (11, None, None):
        observation, info = env.reset(seed=seed)
        shown.append((observation.tolist(), 0.0, False, False, info))
        while not (shown[-1][2] or shown[-1][3]):
            observation, *rest = env.step(env.action_space.sample())
            shown.append((observation.tolist(), *rest))
    return shown


@pytest.mark.parametrize(("name", "options"), BY_KEYWORD)
def test_episodes_are_replayed_exactly_from_their_seed(name, options):
    first = sailed(name, options)
    assert first == sailed(name, options)
    lengths = [k for k, shown in enumerate(first) if shown[2] or shown[3]]
    assert len(lengths) == 3
    assert len({str(first[k][:2]) for k in lengths}) == 3  # no episode is another again


def test_workers_of_gymnasium():
    options = {"model": "mariner", "sea": ["calm", "moderate"], "noise": 1.0}
    env = gymnasium.make_vec(
        f"shipgym:{PATH}", 1, "async", vector_kwargs={"context": "spawn"}, **options
    )
    ours = gymnasium.make(PATH, **options)
    np.testing.assert_array_equal(env.reset(seed=4)[0][0], ours.reset(seed=4)[0])
    action = np.array([0.3], dtype=np.float32)
    np.testing.assert_array_equal(env.step(action[None])[0][0], ours.step(action)[0])
    env.close()


def build():
    return gymnasium.make(f"shipgym:{COURSE}", model="mariner")


def test_workers_of_stable_baselines3():
    env = SubprocVecEnv([build], start_method="forkserver")
    env.seed(4)
    ours = build()
    np.testing.assert_array_equal(env.reset()[0], ours.reset(seed=4)[0])
    action = np.array([0.3], dtype=np.float32)
    np.testing.assert_array_equal(env.step(action[None])[0][0], ours.step(action)[0])
    env.close()


@pytest.mark.parametrize("name", [COURSE, PATH])
@pytest.mark.parametrize(
    ("action", "message"),
    [
        ([np.nan], r"action: expected finite numbers in .* got \[nan\]"),
        ([-np.inf], r"action: expected finite numbers in .* got \[-inf\]"),
        (
            [0.0, 0.0],
            r"action: expected shape \(1,\), a number for each command, got",
        ),
        (0.0, r"action: expected shape .* got shape \(\)"),
        ([[0.0]], r"action: expected shape .* got shape \(1, 1\)"),
    ],
)
def test_wrong_actions_are_refused_and_change_nothing(name, action, message):
    env = gymnasium.make(name, model="mariner").unwrapped
    env.reset(seed=0)
    before = env.physical_state()
    with pytest.raises(InputError, match=message):
        env.step(np.array(action, dtype=np.float32))
    assert env.physical_state() == before
    rows = gymnasium.make_vec(name, 2, model="mariner")
    rows.reset(seed=0)
    with pytest.raises(InputError, match="actions: "):
        rows.step(np.array([action, action], dtype=np.float32))


@pytest.mark.parametrize("name", [COURSE, "shipgym/CourseKeepingDiscrete-v0"])
def test_a_step_before_the_reset_or_after_the_end_is_refused(name):
    for env in (gymnasium.make(name).unwrapped, gymnasium.make_vec(name, 2)):
        action = env.action_space.sample()
        with pytest.raises(InputError, match="no episode has begun"):
            env.step(action)
        env.reset(seed=0)
        env.step(action)
        env.close()
        with pytest.raises(InputError, match="was closed; call reset first"):
            env.step(action)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"sae": "calm"}, "unknown key 'sae'. Did you mean 'sea'"),
        ({"sea": 3}, "sea: expected .* got 3"),
        (
            {"sea": ["calm", "rugh"]},
            "sea state: expected .* got 'rugh'.*Did you mean 'rough'",
        ),
        ({"action": "ruder"}, "action: expected.*Did you mean 'rudder'"),
        (
            {"action": "rudder-shaft"},
            "action: .*'mariner', got 'rudder-shaft'",
        ),
        ({"noise": -0.1}, "noise: expected"),
        ({"action_repeat": 0}, "action_repeat: expected an integer .* got 0"),
        ({"frame_stack": 1.5}, "frame_stack: expected an integer .* got 1.5"),
        ({"rate_limit": 0.0}, "rate_limit: expected a number > 0"),
        (
            {"rate_limit": 0.1, "action_repeat": 2, "action": "rudder-discrete"},
            "rate_limit: expected at least 0.25 with discrete orders .* reaches 0.2",
        ),
        ({"roll": True}, "roll: .*'mariner', which does not roll"),
        (
            {"envelope_weight": "much"},
            "envelope_weight: expected a number >= 0, got 'much'",
        ),
        (
            {"water_depth": 30.0},
            "water_depth: expected none, because 'mariner' is a deep-water",
        ),
        (
            {"model": "tanker", "water_depth": 18.0},
            "water_depth: expected more than the draught",
        ),
        ({"change_interval_steps": 0}, "change_interval_steps: expected"),
        ({"max_envelope_distance": 0.5}, "max_envelope_distance: expected"),
        ({"course_change_deg": 120.0}, "course_change_deg: expected"),
        (
            {"course_changes_deg": 20.0},
            "course_changes_deg: expected a list, got 20.0",
        ),
        (
            {"course_changes_deg": []},
            "course_changes_deg: expected one number at least",
        ),
        ({"model": None}, "model: expected a name, .* got None"),
        ({"model": "marinr"}, "Did you mean 'mariner'"),
        ({"model_uncertainty": "prior"}, "model_uncertainty: expected"),
        ({"model_uncertainty": "covariance"}, "model 'mariner': expected a covariance"),
        ({"ensemble": "tanker"}, "ensemble: expected a list of models, got 'tanker'"),
        (
            {"ensemble": ["tanker"]},
            "ensemble: expected models of one structure, got 'tanker'",
        ),
        ({"speed_range": (0.9, 0.5)}, "speed_range: the largest: expected"),
        (
            {"model": "kvlcc2", "loading_range": (0.8, 1.0)},
            "loading_range: expected .* coefficients, got 'kvlcc2",
        ),
        (
            {"render_mode": "ansi"},
            r"render_mode: expected one of .*'rgb_array', or None, got 'ansi'\.",
        ),
    ],
)
@pytest.mark.filterwarnings("ignore:.*render_mode='ansi'")
def test_wrong_options_are_named_when_an_environment_is_made(options, message):
    with pytest.raises(InputError, match=message):
        gymnasium.make(COURSE, **{"model": "mariner", **options})
    with pytest.raises(InputError, match=message):
        gymnasium.make_vec(COURSE, 2, **{"model": "mariner", **options})


def test_a_ship_without_a_rudder_is_refused(monkeypatch):
    monkeypatch.setattr("shipgym.ships.structures.REGISTERED_STRUCTURES", {})
    shipgym.register_structure("drifting", {"v": "v, |v| v", "r": "v, r"})
    mariner = shipgym.load_model("mariner")
    drifting = ShipModel(
        "drifting",
        "drifting",
        mariner.particulars,
        mariner.steering,
        {"b_v": -0.05, "b_|v|v": 0.0, "c_v": 0.0, "c_r": -0.1},
    )
    for name in (COURSE, PATH):
        with pytest.raises(
            InputError, match=r"model: expected .* rudder, got 'drifting'"
        ):
            gymnasium.make(name, model=drifting)


def test_reset_says_what_is_wrong():
    env = gymnasium.make(PATH, model="mariner").unwrapped
    with pytest.raises(InputError, match=r"options: .*'wind'"):
        env.reset(options={"wind": 3.0})


@pytest.mark.parametrize("name", IDS)
def test_every_id_conforms_as_a_vector(name):
    options = {"episode_steps": 6, "disable_env_checker": True}
    check_vector_env(
        lambda: gymnasium.make_vec(name, 3, episode_steps=6),
        lambda: gymnasium.make(name, **options),
        20,
    )


def test_every_id_makes_both():
    for name in ENVIRONMENTS:
        many, one = gymnasium.make_vec(name, num_envs=2), gymnasium.make(name)
        assert many.single_observation_space == one.observation_space
        assert many.single_action_space == one.action_space
        assert many.observation_names == one.unwrapped.observation_names
        seen, _ = many.reset(seed=5)
        np.testing.assert_array_equal(seen[1], one.reset(seed=6)[0])
