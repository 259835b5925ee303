import gymnasium
import numpy as np
import pytest

from shipgym import (
    Current,
    Episode,
    InputError,
    RecordEpisode,
    Weather,
    Wind,
    load_model,
)

COURSE_KEEPING = "shipgym/CourseKeeping-v0"
PATH = np.array([[0.0, 0.0], [2000.0, 500.0]])


def course_keeping(**arguments):
    return gymnasium.make(
        COURSE_KEEPING, **{"model": "mariner", "episode_steps": 5, **arguments}
    )


def sail(env, seed=None, steps=None):
    """Random rudders until the episode ends, or so many steps; the rewards earned."""
    env.action_space.seed(1 if seed is None else seed)
    env.reset(seed=seed)
    rewards, over = [], False
    while not over and len(rewards) != steps:
        _, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        rewards.append(reward)
        over = terminated or truncated
    return rewards


def files(folder):
    return sorted(path.name for path in folder.iterdir())


def test_what_an_agent_did_is_identified_again(tmp_path):
    """Random rudders held for 40 s: the identified ship answers as the one sailed."""
    from identification import identify

    ship = load_model("mariner")
    arguments = {"episode_steps": 400, "max_heading_error_deg": 180.0}
    env = RecordEpisode(course_keeping(**arguments), tmp_path)
    random = np.random.default_rng(5)
    for seed in range(3):
        env.reset(seed=seed)
        for rudder in np.repeat(random.uniform(-0.6, 0.6, 10), 40):
            env.step(np.array([rudder], dtype=np.float32))
    trials = [Episode.load(tmp_path / name).to_trial() for name in files(tmp_path)]
    result = identify(
        [*trials[:2], trials[2].with_(use="validate")], particulars=ship.particulars
    )
    unseen = result.metrics["trials"][trials[2].name]["rmse"]
    assert unseen["psi"] < np.radians(0.5)
    assert unseen["u"] < 0.001 * ship.particulars["speed"]
    for name in ("N_d", "Y_d", "N_v", "N_r"):
        assert result.coefficients[name] == pytest.approx(
            ship.coefficients[name], rel=0.05
        )


def test_a_recorded_episode_is_begun_again_from_its_seed_and_number(tmp_path):
    env = RecordEpisode(course_keeping(sea="rough"), tmp_path)
    sail(env, seed=7)
    sail(env)
    recorded = Episode.load(tmp_path / "episode-00001.json")
    assert (recorded.seed, recorded.number) == (7, 1)
    again = gymnasium.make(recorded.environment, **recorded.arguments)
    again.reset(seed=recorded.seed)
    for _ in range(recorded.number):
        again.reset()
    for k, action in enumerate(recorded.actions):
        again.step(action.astype(np.float32))
        now = again.unwrapped.physical_state()
        assert {name: recorded.states[name][k + 1] for name in now} == now


def test_rewards_parts_and_orders_are_those_of_the_environment(tmp_path):
    env = RecordEpisode(course_keeping(), tmp_path)
    rewards = sail(env, seed=3)
    episode = Episode.load(tmp_path / "episode-00000.json")
    assert episode.rewards.tolist() == rewards
    costs = episode.info["cost"][1:]
    parts = [episode.info[name][1:] for name in env.unwrapped.task.reward_parts]
    assert sum(parts) == pytest.approx(-costs, abs=1e-12)
    assert episode.states["delta_command"][1:] == pytest.approx(
        episode.actions[:, 0] * np.radians(40.0)
    )
    assert episode.info.keys() >= {"heading_error", "extrapolating"}
    error = episode.states["set_point"] - episode.states["psi"]
    assert np.cos(episode.info["heading_error"]) == pytest.approx(
        np.cos(error), abs=1e-6
    )
    assert (episode.truncated, episode.terminated, episode.success) == (
        True,
        False,
        None,
    )
    assert (episode.length, episode.beam, episode.dt) == (
        160.93,
        23.17,
        env.unwrapped.dt,
    )
    assert episode.waypoints is None


def test_an_episode_that_is_cut_off_is_written_and_says_so(tmp_path):
    env = RecordEpisode(course_keeping(), tmp_path)
    sail(env, steps=1)
    sail(env, steps=3)
    env.reset()
    env.close()
    assert files(tmp_path) == [
        "episode-00000.json",
        "episode-00001.json",
    ]
    episode = Episode.load(tmp_path / "episode-00001.json")
    assert episode.n_steps == 3
    assert not episode.truncated
    assert not episode.terminated


def test_path_and_success_are_recorded_where_there_are_any(tmp_path):
    env = gymnasium.make(
        "shipgym/PathFollowing-v0",
        model="mariner",
        waypoints=PATH,
        corridor=2.0,
        episode_steps=5,
    )
    sail(RecordEpisode(env, tmp_path))
    episode = Episode.load(tmp_path / "episode-00000.json")
    assert np.array_equal(episode.waypoints, PATH)
    assert episode.corridor == pytest.approx(2.0 * 160.93)
    assert episode.success is False


@pytest.mark.parametrize("model", ["container", "kvlcc2"])
def test_ships_with_a_shaft_have_its_speed_in_their_trials(tmp_path, model):
    sail(RecordEpisode(course_keeping(model=model), tmp_path))
    trial = Episode.load(tmp_path / "episode-00000.json").to_trial()
    assert trial["n_command"] == pytest.approx(load_model(model).service_shaft_speed)
    assert trial["n"] == pytest.approx(trial["n_command"], rel=1e-6)


def test_weather_and_models_given_as_objects_are_told_in_words(tmp_path):
    weather = Weather(wind=Wind(12.0), current=Current(0.5, towards_deg=90.0))
    env = course_keeping(model=load_model("mariner"), sea=weather)
    sail(RecordEpisode(env, tmp_path))
    episode = Episode.load(tmp_path / "episode-00000.json")
    assert episode.arguments["model"] == "mariner"
    assert Weather.from_dict(episode.arguments["sea"]) == weather
    assert episode.states["current_east"] == pytest.approx(0.5)


def test_recordings_are_not_mixed_with_earlier_ones(tmp_path):
    sail(RecordEpisode(course_keeping(), tmp_path))
    with pytest.raises(
        InputError, match=r"holds 'episode-00000\.json' of an earlier recording"
    ):
        RecordEpisode(course_keeping(), tmp_path)
    sail(RecordEpisode(course_keeping(), tmp_path, overwrite=True))
    assert files(tmp_path) == ["episode-00000.json"]


def test_what_cannot_be_recorded_is_refused_at_once(tmp_path):
    with pytest.raises(
        InputError,
        match="expected a single environment of shipgym",
    ):
        RecordEpisode(gymnasium.make("CartPole-v1"), tmp_path)
    several = gymnasium.make_vec(COURSE_KEEPING, num_envs=2, vectorization_mode="sync")
    with pytest.raises(InputError, match="expected a single environment"):
        RecordEpisode(several, tmp_path)
    several.close()
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="no folder can be made there"):
        RecordEpisode(course_keeping(), tmp_path / "file")


def test_an_environment_that_records_is_made_again_from_its_spec(tmp_path):
    env = RecordEpisode(course_keeping(), tmp_path)
    spec = gymnasium.envs.registration.EnvSpec.from_json(env.spec.to_json())
    sail(gymnasium.make(spec))
    assert files(tmp_path) == ["episode-00000.json"]


@pytest.mark.filterwarnings("ignore:.*different from the unwrapped version")
def test_a_recorded_environment_is_still_gymnasiums(tmp_path):
    from gymnasium.utils.env_checker import check_env

    check_env(
        RecordEpisode(course_keeping(), tmp_path, overwrite=True),
        skip_render_check=True,
    )


def test_episodes_are_counted_from_the_last_seed(tmp_path):
    env = RecordEpisode(course_keeping(episode_steps=1), tmp_path)
    for seed in (None, 4, None, None, 5):
        sail(env, seed)
    recorded = [Episode.load(tmp_path / name) for name in files(tmp_path)]
    assert [one.number for one in recorded] == [0, 0, 1, 2, 0]
    assert [one.seed for one in recorded][1:] == [4, 4, 4, 5]
    env.unwrapped.np_random = np.random.default_rng(
        0
    )  # a generator put in by hand has no seed
    sail(env)
    assert Episode.load(tmp_path / "episode-00005.json").seed is None
