"""Sail for a long time with random, extreme and adversarial actions and look for anything that breaks.

    python scripts/soak.py                      10^8 steps
    python scripts/soak.py --steps 1000000      fewer

Fails if an observation leaves its space, a reward or a state is not a number, or memory grows.
"""

from __future__ import annotations

import resource
import sys
from collections.abc import Callable

import numpy as np
import typer
from numpy.typing import NDArray
from rich.progress import Progress

import shipgym
from shipgym.envs.course_keeping import CourseKeepingEngine, episode_keys
from shipgym.envs.course_keeping_task import OBSERVATION_HIGH, OBSERVATION_LOW, CourseKeepingTask

LANES = 1024
CHECK_EVERY = 500


def adversary(observations: NDArray[np.float32]) -> NDArray[np.float32]:
    """Steer away from the set-point as hard as the ship can."""
    return np.where(observations[:, :1] >= 0.0, -1.0, 1.0).astype(np.float32)


def actions(kind: str, observations: NDArray[np.float32], random: np.random.Generator) -> NDArray[np.float32]:
    """Actions of one kind for all lanes."""
    if kind == "random":
        return random.uniform(-1.0, 1.0, (LANES, 1)).astype(np.float32)
    if kind == "extreme":
        return random.choice(np.array([-1e30, -1.0, 0.0, 1.0, 1e30], dtype=np.float32), (LANES, 1))
    return adversary(observations)


def sail(model: str, kind: str, steps: int, advance: Callable[[int], None]) -> None:
    """Fly one kind of actions on one model, with episodes that begin anew where they end."""
    task = CourseKeepingTask(max_heading_error_deg=180.0, max_envelope_distance=1e3)
    engine = CourseKeepingEngine(shipgym.load_model(model), LANES, task)
    random = np.random.default_rng(0)
    keys, episodes = episode_keys(np.arange(LANES)), np.zeros(LANES, dtype=np.int64)
    observations = engine.begin(keys)
    for step in range(max(steps // LANES, 1)):
        observations, rewards, terminated, truncated = engine.step(actions(kind, observations, random))
        if not np.all(np.isfinite(rewards)):
            sys.exit(f"{model}, {kind}: a reward is not a number at step {step}")
        if np.any(observations < OBSERVATION_LOW) or np.any(observations > OBSERVATION_HIGH):
            sys.exit(f"{model}, {kind}: an observation left its space at step {step}")
        over = terminated | truncated
        if over.any():
            episodes += over
            observations = engine.begin(keys, episodes, over)
        if step % CHECK_EVERY == 0:
            advance(LANES * CHECK_EVERY)
    if not all(np.all(np.isfinite(values)) for values in engine.physical_state().values()):
        sys.exit(f"{model}, {kind}: a state is not a number")


def main(steps: int = typer.Option(10**8, help="Environment steps over all models and kinds.")) -> None:
    """Sail every shipped model with every kind of actions."""
    runs = [(model, kind) for model in shipgym.list_models() for kind in ("random", "extreme", "adversarial")]
    with Progress() as progress:
        bar = progress.add_task("sailing", total=steps)
        sail(*runs[0], LANES * 1000, lambda _: None)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        for model, kind in runs:
            sail(model, kind, steps // len(runs), lambda done: progress.advance(bar, done))
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    if grown > 50.0:
        sys.exit(f"memory grew by {grown:.0f} MiB")
    print(f"{steps:.3g} steps: nothing left its space, every number is one, memory grew by {grown:.1f} MiB")


if __name__ == "__main__":
    typer.run(main)
