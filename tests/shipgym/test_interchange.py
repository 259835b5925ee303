"""To pandas and Minari and back: nothing is lost, and what is not ours is refused."""

import json
from dataclasses import replace

import gymnasium
import numpy as np
import pandas
import pytest

import shipgym
from shipgym import Episode, InputError, Trial, interchange
from shipgym.envs.episode_file import to_file

TRIAL = Trial(
    [0.0, 0.1, 0.3],
    {"psi": [0.0, 0.1, 0.3], "delta": [0.1, 1 / 3, 0.0]},
    name="a",
    kind="zigzag",
    use="validate",
    derived=["psi"],
    length=7.0,
    repaired={"psi": 1},
    notes=["one", "two"],
)
CARD = {
    "author": "a",
    "author_email": "b",
    "code_permalink": "c",
    "description": "d",
    "algorithm_name": "e",
}


@pytest.fixture(scope="module")
def episodes(tmp_path_factory):
    """Two of one environment.

    The second is cut off and begins without a seed of its own.
    """
    folder = tmp_path_factory.mktemp("recorded")
    env = shipgym.RecordEpisode(
        gymnasium.make("shipgym/CourseKeeping-v0", max_episode_steps=5), folder
    )
    for seed, steps in ((3, 5), (None, 2)):
        env.reset(seed=seed)
        for k in range(steps):
            env.step(np.array([0.1 * k], dtype=np.float32))
    env.close()
    return [Episode.load(path) for path in sorted(folder.glob("*.json"))]


@pytest.fixture
def store(tmp_path, monkeypatch):
    """A folder of Minari datasets."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))


def content(episode):
    return json.dumps(to_file(vars(episode)))


@pytest.mark.parametrize(
    "name",
    [
        "name",
        "kind",
        "use",
        "derived",
        "length",
        "repaired",
        "over_ground",
        "notes",
        "sha256",
    ],
)
def test_a_trial_comes_back_from_a_frame(name):
    back = interchange.from_frame(interchange.to_frame(TRIAL))
    assert getattr(back, name) == getattr(TRIAL, name)


def test_episodes_come_back_from_frames_by_way_of_parquet(tmp_path, episodes):
    for episode in episodes:
        interchange.to_frame(episode).to_parquet(tmp_path / "episode.parquet")
        frame = pandas.read_parquet(tmp_path / "episode.parquet")
        assert content(interchange.from_frame(frame)) == content(episode)
        assert frame.index.tolist() == episode.t.tolist()
        assert np.isnan(frame["rewards"].iloc[-1])
        assert frame["rewards"].sum() == pytest.approx(episode.rewards.sum())


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        ({}, "use Trial.from_frame"),
        ({"shipgym": "[]"}, "what shipgym wrote"),
        ({"shipgym": "{}"}, "episode: "),
    ],
)
def test_a_frame_of_something_else_is_refused(attributes, message):
    frame = pandas.DataFrame({"psi": [0.0, 1.0]})
    frame.attrs.update(attributes)
    with pytest.raises(InputError, match=message):
        interchange.from_frame(frame)


def test_minari_has_the_observations_and_gives_the_episodes_back(store, episodes):
    dataset = interchange.to_minari(episodes, "shipgym/mariner/test-v0", **CARD)
    first, second = dataset[0], dataset[1]
    assert len(first.rewards) == 5
    assert len(second.rewards) == 2
    assert first.observations.shape == (6, *dataset.observation_space.shape)
    assert first.truncations.tolist() == [False] * 4 + [True]
    assert not second.terminations.any()
    env = dataset.recover_environment()
    assert first.observations[0] == pytest.approx(env.reset(seed=3)[0])
    env.close()
    back = interchange.from_minari(dataset)
    assert list(map(content, back)) == list(map(content, episodes))


def test_rewards_that_are_run_again_may_differ_by_rounding_alone(store, episodes):
    episode = episodes[0]
    rounded = replace(episode, rewards=episode.rewards * (1.0 + 5e-7))
    interchange.to_minari([rounded], "shipgym/mariner/rounded-v0", **CARD)
    other = replace(episode, rewards=episode.rewards - 3e-6)
    with pytest.raises(
        InputError, match=r"episodes\[0\]: expected the recorded return"
    ):
        interchange.to_minari([other], "shipgym/mariner/other-v0", **CARD)


def test_episodes_without_a_seed_or_of_several_environments_are_refused(
    store, episodes
):
    unknown = replace(episodes[0], seed=None)
    with pytest.raises(InputError, match=r"episodes\[1\]: expected a seed"):
        interchange.to_minari([episodes[0], unknown], "shipgym/a/b-v0", **CARD)
    longer = replace(episodes[0], arguments={"max_episode_steps": 9})
    for several in ([], [episodes[0], longer]):
        with pytest.raises(InputError, match=f"got episodes of {len(several)}"):
            interchange.to_minari(several, "shipgym/a/b-v0", **CARD)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"environment": "evil:CourseKeeping-v0"}, r"episodes\[0\]: environment"),
        ({"environment": "CartPole-v1"}, r"episodes\[0\]: environment"),
        ({"arguments": {"reward": "evil.py"}}, r"arguments\.reward: expected data"),
        ({"arguments": {"sensors": "evil"}}, r"arguments\.sensors: expected data"),
        ({"arguments": {"task": "evil:Task"}}, r"arguments\.task: expected data"),
        ({"arguments": {"model": "./evil.py"}}, r"arguments\.model: expected data"),
    ],
)
def test_a_recording_names_no_code(changes, message, episodes, tmp_path, monkeypatch):
    (tmp_path / "evil.py").write_text('open("RAN", "w").close()\n')
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(InputError, match=message):
        interchange.to_minari([replace(episodes[0], **changes)], "shipgym/a/b-v0")
    assert not (tmp_path / "RAN").exists()
