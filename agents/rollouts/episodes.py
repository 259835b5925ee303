"""Histories of single episodes of a task, as they are replayed."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from agents.controllers.interface import Policy
from agents.rollouts.rollout import Rollout, rollout
from agents.suites.suite import BenchmarkTask
from shipgym import Episode
from shipgym.arrays import Floats
from shipgym.envs.engine import Engine
from shipgym.envs.recording import SUCCESS, plain


class Recorded(NamedTuple):
    """Episodes of one policy."""

    episodes: list[Episode | None]  # None for one without a sample
    costs: Floats  # NaN where the policy failed


def recorded(
    policy: Policy, task: BenchmarkTask, seeds: Sequence[int], samples: int = 300
) -> Recorded:
    """Sail episodes of a task side by side and keep their histories.

    `samples`: of an episode of full length at most: the histories have one sample for
    several control intervals, in which rewards are summed. The last one is filled up:
    the ship stays where her episode ended.
    """
    engine = task.engine(len(seeds))
    run = rollout(
        policy,
        engine,
        seeds,
        record=True,
        tolerant=True,
    )
    stride = math.ceil(task.task.episode_steps / samples)
    episodes = []
    for lane in range(len(seeds)):
        episode = episode_of(run, task, lane, engine, stride)
        episodes.append(episode)

    costs = np.where(run.failed, np.nan, run.costs)
    return Recorded(episodes, costs)


class _Lane:
    """One ship of a rollout that recorded everything, at the samples of its history."""

    def __init__(self, run: Rollout, lane: int, stride: int) -> None:
        self.run = run
        self.lane = lane
        self.steps = int(run.steps[lane])
        self.failed = bool(run.failed[lane])
        n_intervals = math.ceil(self.steps / stride)
        if self.failed:  # she drifts on after that
            n_intervals = self.steps // stride
        samples = stride * np.arange(n_intervals + 1)
        self.samples = np.minimum(samples, self.steps)

    def at_samples(self, histories: Mapping[str, Floats]) -> dict[str, Floats]:
        """Histories that are finite throughout, each of shape (n_samples,)."""
        finite = {}
        for name, values in histories.items():
            sampled = values[self.samples, self.lane]
            if np.isfinite(sampled).all():
                finite[name] = sampled
        return finite

    def summed(self, per_step: Floats) -> Floats:
        """Sums between the samples of what each step of a rollout has."""
        own = per_step[: self.steps, self.lane]
        running = np.append(0.0, np.cumsum(own))
        return np.diff(running[self.samples])

    def commands(self, states: Mapping[str, Floats]) -> dict[str, Floats]:
        """Orders of the ship over the steps, from the states at the samples."""
        commands = {}
        for name in self.run.model.command_names:
            order = f"{name}_command"
            if order in states:
                commands[name] = states[order][1:]
        return commands

    def reward_parts(self, names: Iterable[str]) -> dict[str, Floats]:
        """Parts of the reward, summed between the samples."""
        parts = {}
        for name in names:
            per_step = self.run.infos[name][1:]
            parts[name] = self.summed(per_step)
        return parts

    def success(self) -> bool | None:
        """Return True if the episode was a success; None if its task knows none."""
        infos = self.run.infos
        for name in SUCCESS:
            if name in infos:
                flags = infos[name][1 : self.steps + 1, self.lane]
                return bool(np.any(flags > 0.0))
        return None


def episode_of(
    run: Rollout, task: BenchmarkTask, lane: int, engine: Engine, stride: int
) -> Episode | None:
    """Episode of a lane of a rollout that recorded everything; None without a sample.

    `stride`: control intervals between two samples.
    """
    ship = run.model
    history = _Lane(run, lane, stride)
    if len(history.samples) < 2:
        return None

    parts = history.reward_parts(task.task.reward_parts)
    infos = {}
    for name, values in run.infos.items():
        if name not in parts and name not in SUCCESS:
            infos[name] = values

    states = history.at_samples(run.states)
    arguments = plain({"model": task.model, **task.arguments, "bounded": False})
    return Episode(
        environment=task.env_id,
        model=ship.name,
        dt=run.dt * stride,
        length=ship.particulars["length"],
        beam=ship.particulars.get("beam"),
        rudder_limit=ship.steering.limit,
        states=states,
        actions=run.actions[history.samples[:-1], lane],
        rewards=history.summed(run.rewards),
        commands=history.commands(states),
        reward_parts=parts,
        info=history.at_samples(infos),
        waypoints=engine.waypoints(lane),
        corridor=engine.path_metres("corridor"),
        turn_radius=engine.path_metres("turn_radius"),
        arguments=arguments,
        seed=int(run.seeds[lane]),
        terminated=bool(run.terminated[lane]) and not history.failed,
        truncated=bool(run.truncated[lane]) and not history.failed,
        success=history.success(),
    )
