"""Histories of single episodes of a task, as they are replayed."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from agents.controllers.controller import Policy
from agents.rollouts.rollout import Rollout, rollout
from agents.suites.suite import BenchmarkTask
from shipgym import Episode
from shipgym.arrays import Floats
from shipgym.envs.engine import Engine
from shipgym.envs.recording import SUCCESS, plain

SAMPLES = 300  # of a history at most


class Recorded(NamedTuple):
    """Episodes of one policy: what happened, None where not even one sample, and what each cost.

    What an episode cost in which the policy failed is not known here: NaN.
    """

    episodes: list[Episode | None]
    costs: Floats


def recorded(
    policy: Policy, task: BenchmarkTask, seeds: Sequence[int], samples: int = SAMPLES
) -> Recorded:
    """Sail episodes of a task side by side and keep their histories.

    `samples`: of an episode of full length at most: the histories have one sample for
    several control intervals, in which rewards are summed. The last one is filled up:
    the ship stays where her episode ended.
    """
    engine = task.engine(len(seeds))
    run = rollout(policy, engine, np.asarray(seeds), record=True, tolerant=True)
    stride = -(-task.task.episode_steps // samples)
    episodes = [_episode(run, task, lane, engine, stride) for lane in range(len(seeds))]
    return Recorded(episodes, np.where(run.failed, np.nan, run.costs))


def _episode(
    run: Rollout, task: BenchmarkTask, lane: int, engine: Engine, stride: int
) -> Episode | None:
    """One lane of a rollout that recorded everything."""
    ship, failed, steps = run.model, bool(run.failed[lane]), int(run.steps[lane])
    count = (
        steps // stride if failed else -(-steps // stride)
    )  # where the policy failed she drifts on
    if not count:
        return None
    at = np.minimum(stride * np.arange(count + 1), steps)
    states = {name: values[at, lane] for name, values in run.states.items()}
    infos = {name: values[: steps + 1, lane] for name, values in run.infos.items()}
    success = [bool(np.any(infos[name][1:] > 0.0)) for name in SUCCESS if name in infos]

    def summed(values: Floats) -> Floats:
        return np.diff(np.append(0.0, np.cumsum(values))[at])

    parts = task.task.reward_parts
    commands = {name: states.get(f"{name}_command") for name in ship.command_names}
    return Episode(
        environment=task.env_id,
        model=ship.name,
        dt=run.dt * stride,
        length=ship.particulars["length"],
        beam=ship.particulars.get("beam"),
        rudder_limit=ship.steering.limit,
        states=_finite(states),
        actions=run.actions[at[:-1], lane],
        rewards=summed(run.rewards[:steps, lane]),
        commands={
            name: values[1:] for name, values in commands.items() if values is not None
        },
        reward_parts={name: summed(infos[name][1:]) for name in parts},
        info=_finite(
            {name: infos[name][at] for name in infos if name not in {*parts, *SUCCESS}}
        ),
        waypoints=engine.waypoints(lane),
        corridor=engine.path_metres("corridor"),
        turn_radius=engine.path_metres("turn_radius"),
        arguments=plain({"model": task.model, **task.arguments}),
        seed=int(run.seeds[lane]),
        terminated=not failed and bool(run.terminated[lane]),
        truncated=not failed and bool(run.truncated[lane]),
        success=success[0] if success else None,
    )


def _finite(histories: Mapping[str, Floats]) -> dict[str, Floats]:
    """Those that are finite throughout."""
    return {
        name: values for name, values in histories.items() if np.isfinite(values).all()
    }
