"""Sail for a long time with random, extreme and adversarial actions.

    python scripts/soak.py                      10^8 steps
    python scripts/soak.py --steps 10000000     fewer

Every id, with every shipped model that fits it, in calm water and in seas, with both
ways of autoreset. Fails if an observation leaves its space, a reward, an info or a
state is not a number, or memory grows.
"""

from __future__ import annotations

import resource
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
import typer
from numpy.typing import NDArray
from rich.progress import Progress

import shipgym
from shipgym.tasks.definition import TASKS

ROWS = 256
CHECK_EVERY = 50  # steps between checks of infos and states
WARM = 20  # steps after which memory must not grow
MOST_GROWTH = 50.0  # MiB
KINDS = ("random", "extreme", "adversarial")
WILD = {
    "CourseKeeping": {"max_heading_error_deg": 180.0},
    "PathFollowing": {"ground": 40.0},
}
SEAS: dict[str, Any] = {
    "sea": ["calm", "moderate", "rough"],
    "noise": 2.0,
    "measurement": "filtered",
}


@dataclass(frozen=True)
class Run:
    """One environment under one kind of actions."""

    task: str
    variant: str
    model: str
    kind: str

    @property
    def id(self) -> str:
        """Of the environment."""
        return f"shipgym/{self.task}{self.variant}-v0"

    @property
    def name(self) -> str:
        """Its id, model and actions."""
        return f"{self.id}, {self.model}, {self.kind}"

    def make(self) -> Any:
        """Its vector environment; wild ones are in seas and never stop."""
        wild = self.kind != "extreme"
        steps = {"episode_steps": 150} if self.kind == "random" else {}
        options: dict[str, Any] = (
            {"max_envelope_distance": 1e3, **WILD[self.task], **SEAS} if wild else {}
        )
        return gymnasium.make_vec(
            self.id,
            ROWS,
            model=self.model,
            autoreset_mode="SameStep" if wild else "NextStep",
            **steps,
            **options,
        )


def runs() -> Iterator[Run]:
    """All of them: ids, the models that fit, kinds of actions."""
    models = [shipgym.load_model(name) for name in shipgym.list_models()]
    fit = {
        "": [ship.name for ship in models],
        "Discrete": [models[0].name],
        "Shaft": [ship.name for ship in models if ship.service_shaft_speed > 0.0],
        "Roll": [ship.name for ship in models if "phi" in ship.state_names],
    }
    for task in TASKS:
        for variant, names in fit.items():
            for model in names:
                for kind in KINDS:
                    yield Run(task, variant, model, kind)


def adversary(
    observations: NDArray[np.float32], space: gymnasium.Space[Any], step: int
) -> Any:
    """Steer away from the course hard, the shaft full ahead and astern by turns."""
    starboard = observations[:, 0] < 0.0
    if isinstance(space, gymnasium.spaces.MultiDiscrete):
        return np.where(starboard, int(space.nvec[0]) - 1, 0)
    actions = np.empty(space.shape or (), dtype=np.float32)
    actions[:, 0] = np.where(starboard, 1.0, -1.0)
    actions[:, 1:] = 1.0 if step // 100 % 2 else -1.0
    return actions


def extreme(space: gymnasium.Space[Any], random: np.random.Generator) -> Any:
    """The largest actions that there are, and beyond."""
    if isinstance(space, gymnasium.spaces.MultiDiscrete):
        return random.choice([0, int(space.nvec[0]) - 1], space.shape)
    return random.choice(
        np.array([-1e30, -1.0, 0.0, 1.0, 1e30], dtype=np.float32), space.shape
    )


def check_shown(
    run: Run, env: Any, observations: Any, rewards: Any, infos: dict[str, Any]
) -> None:
    """Leave if an observation is not in its space or a reward is not a number."""
    space = env.single_observation_space
    shown = [
        observations,
        *infos.get("final_obs", np.empty(0))[infos.get("_final_obs", [])],
    ]
    if not all(np.all((space.low <= one) & (one <= space.high)) for one in shown):
        sys.exit(f"{run.name}: an observation left its space")
    if not np.all(np.isfinite(rewards)):
        sys.exit(f"{run.name}: a reward is not a number")


def check_inside(run: Run, env: Any, infos: dict[str, Any]) -> None:
    """Leave if an info or a state is not a number."""
    numbers = [
        value for key, value in infos.items() if not key.startswith(("_", "final"))
    ]
    if not all(
        np.all(np.isfinite(one)) for one in (*numbers, *env.physical_state().values())
    ):
        sys.exit(f"{run.name}: an info or a state is not a number")


def sail(run: Run, steps: int, advance: Callable[[int], None]) -> tuple[int, float]:
    """Take steps in all rows; count of ended episodes, and growth of memory, MiB."""
    env = run.make()
    random = np.random.default_rng(0)
    env.action_space.seed(0)
    observations, _ = env.reset(seed=0)
    ended, before = 0, 0
    for step in range(max(steps // ROWS, WARM + 1)):
        if run.kind == "random":
            actions = env.action_space.sample()
        elif run.kind == "extreme":
            actions = extreme(env.action_space, random)
        else:
            actions = adversary(observations, env.action_space, step)
        observations, rewards, terminated, truncated, infos = env.step(actions)
        ended += int(np.sum(terminated | truncated))
        check_shown(run, env, observations, rewards, infos)
        if step % CHECK_EVERY == 0:
            check_inside(run, env, infos)
            advance(ROWS * CHECK_EVERY)
        if step == WARM:
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    env.close()
    return ended, (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024


def main(
    steps: int = typer.Option(
        10**8, help="Environment steps over all ids, models and actions."
    ),
) -> None:
    """Sail every id with every shipped model that fits it and every kind of actions."""
    every, ended, grown = list(runs()), 0, 0.0
    with Progress() as progress:
        bar = progress.add_task("sailing", total=steps)
        for run in every:
            progress.update(bar, description=run.name)
            episodes, growth = sail(
                run, steps // len(every), lambda done: progress.advance(bar, done)
            )
            ended, grown = ended + episodes, grown + growth
    if grown > MOST_GROWTH:
        sys.exit(f"memory grew by {grown:.0f} MiB")
    print(
        f"{steps:.3g} steps, {len(every)} runs, {ended} episodes: nothing left its"
        f" space, every number is one, memory grew by {grown:.1f} MiB"
    )


if __name__ == "__main__":
    typer.run(main)
