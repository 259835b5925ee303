"""Draw docs/images/tracks.png: one episode of each task of the suite, on the ship.

    python scripts/draw_tracks.py [--suite shipgym-v1]

Cross-track error and rudder of three controllers; grey: the corridor.
"""

import argparse
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from agents.agent_file import load_agent
from agents.benchmarking.sources import pretrained
from agents.controllers.designs import design, tuned
from agents.controllers.interface import Policy
from agents.rollouts.episodes import recorded
from agents.suites.suite import DEFAULT_SUITE, BenchmarkTask, load_suite

OUT = Path(__file__).parents[1] / "docs" / "images" / "tracks.png"
#: Styles of the controllers' lines.
STYLES = {"wheel-over": "C0:", "tuned-preview-lq": "C1-", "ppo": "C2--"}


def main() -> None:
    """Sail an episode of each task and draw it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--suite", default=DEFAULT_SUITE)
    tasks = [
        task
        for task in load_suite(parser.parse_args().suite).tasks
        if task.on == "ship"
    ]
    figure = plt.figure(figsize=(16.0, 12.0), layout="constrained")
    parts: Any = figure.subfigures(3, 4)
    for task, part in zip(tasks, parts.flat, strict=True):
        draw(task, part)
    figure.savefig(OUT, dpi=75)


def controllers(task: BenchmarkTask) -> dict[str, Policy]:
    """Controllers made for the model of a task."""
    model = task.design_task
    agent, *_ = pretrained(task.name, "ppo")
    return {
        "wheel-over": design("wheel-over", model),
        "tuned-preview-lq": tuned("preview-lq", model, task.suite),
        "ppo": load_agent(agent),
    }


def draw(task: BenchmarkTask, part: Any) -> None:
    """Draw what the controllers do in the first scored episode."""
    aside, rudder = part.subplots(2, 1, sharex=True)
    for name, policy in controllers(task).items():
        (episode,), _ = recorded(policy, task, task.seeds[:1].tolist())
        if episode is not None:
            minutes = np.arange(episode.n_steps + 1) * episode.dt / 60.0
            style = STYLES[name]
            aside.plot(minutes, episode.info["cross_track"], style, lw=1.1, label=name)
            rudder.plot(minutes, np.degrees(episode.states["delta"]), style, lw=0.9)

    corridor = task.task.corridor * task.ship.particulars["length"]
    aside.axhspan(-corridor, corridor, color="0.93", zorder=0)
    aside.set_title(task.name, fontsize=10)
    aside.set_ylabel("aside, m")
    rudder.set_ylabel("rudder, deg")
    rudder.set_xlabel("minutes")
    if task.name == "roll-limit":
        aside.legend(fontsize=7)


if __name__ == "__main__":
    main()
