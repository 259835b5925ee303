"""Picture of what each number of LQ path tracking with preview does.

    python scripts/preview_numbers.py          # writes docs/images/preview_lq.png

One panel for each number: cross-track error, or rudder, of the Mariner class along the
same path with the number small, as designed, and large.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib.pyplot as plt
import numpy as np

from agents import PreviewLQ
from agents.controllers.quiet_lq import QuietLQ
from agents.rollouts.rollout import rollout
from shipgym import load_model
from shipgym.arrays import Floats
from shipgym.envs.engine import Engine
from shipgym.sea import Current, Weather
from shipgym.tasks.task import path_following_task

OUT = Path(__file__).parents[1] / "docs" / "images" / "preview_lq.png"
SHIP = load_model("mariner")
CALM: dict[str, Any] = {"max_turn_deg": 90.0, "leg_lengths": [12.0, 12.0], "n_legs": 3}
SEED = 4


class Panel(NamedTuple):
    """A number, three values of it, and what is shown."""

    name: str
    values: tuple[float, float, float]
    shows: str = "cross_track"
    sea: str = "calm"


PANELS = (
    Panel("lookahead_lengths", (1.2, 2.5, 5.0)),
    Panel("reach_lengths", (4.0, 8.75, 13.0)),
    Panel("weight_0", (0.7, 1.0, 1.3)),
    Panel("weight_2", (0.2, 0.5, 0.8)),
    Panel("weight_3", (-0.1, 0.0, 0.1)),
    Panel("crab_share", (0.0, 1.0, 1.5), sea="current"),
    Panel("current_time", (0.0, 0.3, 6.0), sea="changing current"),
    Panel("sway_gain", (-1.0, 0.0, 1.0)),
    Panel("course_share", (0.0, 0.5, 1.0), shows="delta", sea="rough"),
    Panel("yaw_time", (0.0, 0.1, 0.3), shows="delta", sea="rough"),
    Panel("dead_band_deg", (0.0, 1.0, 3.0), shows="delta", sea="rough"),
    Panel("speed_power", (-1.0, 0.0, 2.0)),
    Panel("lq_rudder_weight", (0.02, 0.1, 1.0), shows="delta"),
    Panel("lq_rate_weight_s2", (1.0, 10.0, 200.0), shows="delta"),
    Panel("lq_rudder_time", (0.0, 0.1, 0.2), shows="delta", sea="rough"),
    Panel("lq_rudder_band_deg", (0.0, 1.0, 2.0), shows="delta", sea="rough"),
)
UNITS = {
    "cross_track": (1.0, "cross-track error, m"),
    "delta": (180.0 / np.pi, "rudder, deg"),
}


def main() -> None:
    """Sail and draw."""
    figure, axes = plt.subplots(4, 4, figsize=(15.0, 11.0), layout="constrained")
    for panel, axis in zip(PANELS, axes.flat, strict=True):
        factor, label = UNITS[panel.shows]
        for value, style in zip(panel.values, (":", "-", "--"), strict=True):
            history = sailed({panel.name: value}, panel)
            minutes = np.arange(len(history)) * dt_of() / 60.0
            axis.plot(minutes, factor * history, style, label=f"{value:g}", lw=1.1)
        axis.set_title(
            f"{panel.name}" + ("" if panel.sea == "calm" else f", {panel.sea}")
        )
        axis.set_ylabel(label)
        axis.legend(fontsize=8)
        axis.grid(alpha=0.3)
    for axis in axes[-1]:
        axis.set_xlabel("time, min")
    figure.savefig(OUT, dpi=80)


def dt_of() -> float:
    """Control interval, s."""
    return path_following_task(**CALM).interval(SHIP)


def sailed(settings: Mapping[str, float], panel: Panel) -> Floats:
    """History of what a panel shows."""
    options = dict(CALM)
    if panel.sea == "rough":
        options["sea"] = "rough"
    if panel.sea == "current":
        options["sea"] = Weather(current=Current(1.5, towards_deg=90.0))
    if panel.sea == "changing current":
        current = Current(1.5, towards_deg=90.0, variation=1.0, time_constant=120.0)
        options["sea"] = Weather(current=current)
    task = path_following_task(**options)
    own, inner = {"course_share": 0.0}, {}
    for name, value in settings.items():
        if name.startswith("lq_"):
            inner[name.removeprefix("lq_")] = value
        else:
            own[name] = value
    autopilot = QuietLQ.from_model(SHIP, dt=task.interval(SHIP), **inner)
    guide = PreviewLQ.from_model(SHIP, task=task, autopilot=autopilot, **own)
    names = ("delta", "cross_track")
    run = rollout(guide, Engine(SHIP, 1, task), [SEED], record=names)
    n_steps = int(run.steps[0])
    histories = run.infos if panel.shows in run.infos else run.states
    return histories[panel.shows][1 : n_steps + 1, 0]


if __name__ == "__main__":
    main()
