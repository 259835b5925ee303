"""Episodes as a Minari dataset, for offline reinforcement learning and imitation, and back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np

from shipgym.arrays import Floats
from shipgym.envs.episode import Episode
from shipgym.errors import InputError
from shipgym.extras import library
from shipgym.interchange.frames import KEY, padded, put_together, taken_apart

if TYPE_CHECKING:
    from minari import MinariDataset

# of rewards that are run again, relative: another processor rounds differently
DEVIATION = 1e-6


def to_minari(
    episodes: Sequence[Episode], dataset_id: str, **metadata: Any
) -> MinariDataset:
    """Write episodes of one environment as a Minari dataset, such as "shipgym/mariner/lq-v0".

    Its infos hold all that `RecordEpisode` recorded. Observations are not recorded:
    each episode is run again from its seed with its actions. `metadata` is for
    `minari.create_dataset_from_buffers`: author, and so on. Raises InputError if there
    is no episode, they are of several environments, one has no seed or costs something
    else when it is run again, or Minari is not installed.
    """
    minari = library("minari", "minari")
    kinds = {(one.environment, repr(one.arguments)) for one in episodes}
    if len(kinds) != 1:
        raise InputError(
            f"episodes: of {len(kinds)} environments found, expected all of one"
        )
    env = gymnasium.make(episodes[0].environment, **episodes[0].arguments)
    buffers, facts = [], []
    for k, episode in enumerate(episodes):
        t, series, fact = taken_apart(episode)
        infos = {
            name: values.tolist() for name, values in padded(series, len(t)).items()
        }
        facts.append({KEY: fact})
        last = np.arange(episode.n_steps) == episode.n_steps - 1
        buffer = minari.data_collector.EpisodeBuffer(
            k,
            episode.seed,
            None,
            _observations(env, episode, f"episodes[{k}]"),
            episode.actions.astype(np.float32),
            episode.rewards,
            last & episode.terminated,
            last & (not episode.terminated),
            infos,
        )
        buffers.append(buffer)
    options = {"data_format": "arrow", "eval_env": env, **metadata}
    dataset = minari.create_dataset_from_buffers(
        dataset_id, buffers, env=env, **options
    )
    dataset.storage.update_episode_metadata(facts, range(len(facts)))
    env.close()
    return dataset


def from_minari(dataset: MinariDataset) -> list[Episode]:
    """The episodes that `to_minari` wrote. Raises InputError for those of another dataset."""
    found: list[Any] = []
    facts = dataset.storage.get_episode_metadata(dataset.episode_indices)
    for one, about in zip(dataset, facts, strict=True):
        series = {name: np.asarray(values) for name, values in one.infos.items()}
        t = np.arange(len(one.rewards) + 1.0)  # an episode knows its times
        found.append(put_together(t, series, about, "expected a dataset of to_minari"))
    return found


def _observations(env: gymnasium.Env[Any, Any], episode: Episode, where: str) -> Floats:
    """What the agent was shown, shape (n_steps + 1, n_observations)."""
    if episode.seed is None:
        raise InputError(
            f"{where}: no seed found, expected one: without it an episode cannot be run"
            " again"
        )
    observation, _ = env.reset(seed=episode.seed)
    for _ in range(episode.number):
        observation, _ = env.reset()
    shown, rewards = [observation], []
    for action in episode.actions:
        observation, reward, *_ = env.step(action.astype(np.float32))
        shown.append(observation)
        rewards.append(float(reward))
    if not np.allclose(rewards, episode.rewards, rtol=DEVIATION, atol=DEVIATION):
        raise InputError(
            f"{where}: cost {-sum(rewards):.6g} when run again and"
            f" {-episode.rewards.sum():.6g} as recorded; expected the same: record"
            " without wrappers that change actions or rewards"
        )
    return np.array(shown)
