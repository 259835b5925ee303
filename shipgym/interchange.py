"""Trials and episodes as pandas frames and Minari datasets, and back unchanged.

Time series are columns: the channels of a trial by their names, the series of an
episode by group and name, such as `states.x`, `commands.delta`,
`reward_parts.reward_heading`, `info.cross_track_error`, `rewards` and `actions.0`.
All else is JSON in one attribute, `shipgym`, which Parquet files keep too.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_table, shown
from shipgym.envs.episode import Episode
from shipgym.envs.episode_file import SERIES, from_file, to_file
from shipgym.envs.registration import check_named
from shipgym.errors import InputError
from shipgym.extras import library
from shipgym.trials.trial import Trial

if TYPE_CHECKING:
    from minari import MinariDataset
    from pandas import DataFrame

__all__ = ["from_frame", "from_minari", "to_frame", "to_minari"]

ATTRIBUTE = "shipgym"
#: Groups of an episode with a value for each step, one less than there are states.
OF_STEPS = ("commands", "reward_parts", "rewards", "actions")


def to_frame(recorded: Trial | Episode) -> DataFrame:
    """Convert a trial or an episode to a pandas frame, with time in s as its index.

    The last row of an episode has NaN for commands, actions and rewards, because no
    step follows its end.
    """
    import pandas as pd

    columns = _padded(_series(recorded), len(recorded.t))
    frame = pd.DataFrame(columns, index=pd.Index(recorded.t, name="t"))
    frame.attrs[ATTRIBUTE] = _facts(recorded)
    return frame


def from_frame(frame: DataFrame) -> Trial | Episode:
    """Convert a frame of `to_frame` back; the `raw` channels of a trial are lost.

    Raises InputError for any other frame.
    """
    if not hasattr(frame, "attrs"):
        raise InputError(f"frame: expected a pandas DataFrame, got {shown(frame)}")
    series = {str(name): column.to_numpy() for name, column in frame.items()}
    remedy = "for the frame of a log use Trial.from_frame"
    return _rebuild(frame.index.to_numpy(), series, frame.attrs, remedy)


def to_minari(
    episodes: Sequence[Episode],
    dataset_id: str,
    **metadata: Any,
) -> MinariDataset:
    """Write episodes of one environment as a Minari dataset.

    A recording has no observations: each episode is run again from its seed with its
    actions. The infos of the dataset hold all that `RecordEpisode` recorded.

    Raises InputError for no episodes or episodes of several environments, for an
    environment that is not registered or code that a recording names, for an
    episode without a seed or whose rewards differ by more than rounding when it is run
    again, and if Minari is not installed.

    Parameters
    ----------
    episodes : sequence of Episode
        Recordings of one environment with the same arguments.
    dataset_id : str
        Name of the dataset, such as ``"shipgym/mariner/lq-v0"``.
    **metadata
        Author, description and so on, for `minari.create_dataset_from_buffers`.
    """
    minari = library("minari", "minari")
    environments = {(one.environment, repr(one.arguments)) for one in episodes}
    if len(environments) != 1:
        raise InputError(
            "episodes: expected all of one environment, got episodes of"
            f" {len(environments)}"
        )

    first = episodes[0]
    check_named(first.environment, first.arguments, "episodes[0]")
    env = gymnasium.make(first.environment, **first.arguments)
    buffers = []
    for index, episode in enumerate(episodes):
        observations = _observations(env, episode, f"episodes[{index}]")
        is_last = np.arange(episode.n_steps) == episode.n_steps - 1
        infos = _padded(_series(episode), len(episode.t))
        buffer = minari.data_collector.EpisodeBuffer(
            id=index,
            seed=episode.seed,
            observations=observations,
            actions=episode.actions.astype(np.float32),
            rewards=episode.rewards,
            terminations=is_last & episode.terminated,
            truncations=is_last & (not episode.terminated),
            infos={name: values.tolist() for name, values in infos.items()},
        )
        buffers.append(buffer)

    options = {"data_format": "arrow", "eval_env": env, **metadata}
    dataset = minari.create_dataset_from_buffers(
        dataset_id,
        buffers,
        env=env,
        **options,
    )
    facts = [{ATTRIBUTE: _facts(episode)} for episode in episodes]
    dataset.storage.update_episode_metadata(facts, range(len(facts)))
    env.close()
    return dataset


def from_minari(dataset: MinariDataset) -> list[Episode]:
    """Episodes of a dataset that `to_minari` wrote; InputError for any other."""
    attributes = dataset.storage.get_episode_metadata(dataset.episode_indices)
    episodes: list[Any] = []
    for stored, attribute in zip(dataset, attributes, strict=True):
        series = {name: np.asarray(values) for name, values in stored.infos.items()}
        t = np.arange(len(stored.rewards) + 1.0)  # an Episode computes its times itself
        remedy = "expected a dataset of to_minari"
        episodes.append(_rebuild(t, series, attribute, remedy))
    return episodes


def _series(recorded: Trial | Episode) -> dict[str, Floats]:
    """Time series of a trial or an episode by column; those of steps are shorter."""
    if isinstance(recorded, Trial):
        return dict(recorded.channels)

    series = {}
    for group in SERIES:
        for name, values in getattr(recorded, group).items():
            series[f"{group}.{name}"] = values
    series["rewards"] = recorded.rewards
    for number, values in enumerate(recorded.actions.T):
        series[f"actions.{number}"] = values
    return series


def _facts(recorded: Trial | Episode) -> str:
    """All of a trial or an episode except its time series, as JSON."""
    trial_fields = ("name", "kind", "use", "length", "over_ground", "notes")
    if isinstance(recorded, Trial):
        fields: dict[str, Any] = {
            name: getattr(recorded, name) for name in trial_fields
        }
        fields["derived"] = sorted(recorded.derived)
        fields["repaired"] = dict(recorded.repaired)
        return json.dumps({"trial": fields})

    content = to_file(vars(recorded))
    for group in {*SERIES, *OF_STEPS}:
        del content[group]
    return json.dumps({"episode": content})


def _padded(series: Mapping[str, Floats], length: int) -> dict[str, Floats]:
    """Series of one length, with NaN after the end of shorter ones."""
    padded = {}
    for name, values in series.items():
        column = np.full(length, np.nan)
        column[: len(values)] = values
        padded[name] = column
    return padded


def _rebuild(
    t: Floats,
    series: Mapping[str, Floats],
    attributes: Mapping[Any, Any],
    remedy: str,
) -> Trial | Episode:
    """Trial or episode of `_series` and `_facts`; padding is cut off."""
    try:
        written = json.loads(attributes[ATTRIBUTE])
        facts = check_table(written, ATTRIBUTE)
    except (KeyError, TypeError, ValueError):
        raise InputError(
            f"attribute '{ATTRIBUTE}': expected what shipgym wrote, got none; {remedy}"
        ) from None
    if "trial" in facts:
        return Trial(t, series, **check_table(facts["trial"], "trial"))

    content = dict(check_table(facts.get("episode"), "episode"))
    for group in SERIES:
        content[group] = {}
    content["rewards"] = []
    actions = []
    for column, padded in series.items():
        group, _, name = column.partition(".")
        length = len(t) - 1 if group in OF_STEPS else len(t)
        values = padded[:length].tolist()
        if group == "actions":
            actions.append(values)
        elif name:
            content.setdefault(group, {})[name] = values
        else:
            content[group] = values
    content["actions"] = np.transpose(actions).tolist()
    return Episode(**from_file(content))


def _observations(env: gymnasium.Env[Any, Any], episode: Episode, where: str) -> Floats:
    """Observations of an episode run again, shape (n_steps + 1, n_observations)."""
    if episode.seed is None:
        raise InputError(
            f"{where}: expected a seed, got none; without it an episode cannot be run"
            " again"
        )
    observation, _ = env.reset(seed=episode.seed)
    for _ in range(episode.number):
        observation, _ = env.reset()

    observations = [observation]
    rewards = []
    for action in episode.actions:
        observation, reward, *_ = env.step(action.astype(np.float32))
        observations.append(observation)
        rewards.append(float(reward))

    rounding = 1e-6  # relative: another processor rounds differently
    if not np.allclose(rewards, episode.rewards, rtol=rounding, atol=rounding):
        raise InputError(
            f"{where}: expected the recorded return, {episode.rewards.sum():.6g}, got"
            f" {sum(rewards):.6g} when run again; record without wrappers that change"
            " actions or rewards"
        )
    return np.array(observations)
