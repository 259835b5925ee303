"""Track keeping: path autopilots along one track with turns to both sides, in a current across it.

Straight legs joined by arcs, as track control systems have them (IEC 62065:2014); the
track is our own.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import Controller
from agents.rollouts.metrics import path_following
from agents.rollouts.rollout import rollout
from shipgym.arrays import Floats
from shipgym.envs.engine import Engine
from shipgym.sea.conditions import Current, Weather
from shipgym.ships import ShipModel
from shipgym.tasks.task import Task

TURNS_DEG = (30.0, -60.0, 90.0, -90.0, 45.0)  # changes of course, to starboard positive
LEG_LENGTHS, SETTLED_LENGTHS = (
    12.0,
    6.0,
)  # of each leg; way after the start that does not count
CURRENT = 0.1  # speed over service speed, to the east: across the first leg
STEPS = 3000  # control intervals, about twice what it takes


@dataclass(frozen=True, eq=False)
class Track:
    """How one path autopilot kept to the track: the identified model first, then the models drawn."""

    key: str  # its kind
    controller: Controller
    waypoints: Floats  # north and east, m, shape (n_waypoints, 2)
    positions: (
        Floats  # north and east of the identified model, m, shape (n_steps + 1, 2)
    )
    # its distance from the track, to starboard positive, m, shape (n_steps + 1,)
    cross_track: Floats
    largest: (
        Floats  # cross-track error once the start is behind, m, shape (1 + n_draws,)
    )
    rms: Floats  # m, shape (1 + n_draws,)
    arrived: NDArray[np.bool_]  # shape (1 + n_draws,)


def track_task(model: ShipModel) -> Task:
    """The track for a ship, with the current."""
    courses = np.radians(np.cumsum([0.0, *TURNS_DEG]))
    legs = (
        LEG_LENGTHS
        * model.particulars["length"]
        * np.column_stack([np.cos(courses), np.sin(courses)])
    )
    waypoints = np.vstack([np.zeros(2), np.cumsum(legs, axis=0)])
    current = Current(CURRENT * model.particulars["speed"], towards_deg=90.0)
    return Task.of(
        "PathFollowing",
        waypoints=waypoints,
        sea=Weather(current=current),
        episode_steps=STEPS,
    )


def keep_track(guide: Controller, models: Sequence[ShipModel]) -> Track:
    """Lead ships of one structure along the track, the identified one first."""
    task = track_task(models[0])
    engine = Engine(models, len(models), task, allow_unstable=True)
    names = (
        "x",
        "y",
        "cross_track",
        "distance_made_good",
        "success",
        "in_corridor",
        "grounded",
    )
    run = rollout(guide, engine, np.zeros(len(models), dtype=np.int64), record=names)
    figures, last = path_following(run), int(run.steps[0]) + 1
    way = (
        run.infos["distance_made_good"][1:]
        > SETTLED_LENGTHS * models[0].particulars["length"]
    )
    off = np.where(run.sailing & way, np.abs(run.infos["cross_track"][1:]), 0.0)
    return Track(
        key=guide.kind,
        controller=guide,
        waypoints=np.reshape(task.settings.waypoints[1:], (-1, 2)),
        positions=np.column_stack(
            [run.states["x"][:last, 0], run.states["y"][:last, 0]]
        ),
        cross_track=run.infos["cross_track"][:last, 0],
        largest=off.max(axis=0),
        rms=figures["cross_track_rmse_m"],
        arrived=figures["success"] > 0.0,
    )
