"""Track keeping: path autopilots along one track with turns to both sides.

A current sets across its first leg. Straight legs joined by arcs, as track control
systems have them (IEC 62065:2014); the track is our own.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agents.controllers.controller import Controller
from agents.controllers.wheel_over import own_lead
from agents.rollouts.metrics import root_mean_square, succeeded
from agents.rollouts.rollout import Rollout, rollout
from shipgym.arrays import Flags, Floats
from shipgym.envs.engine import Engine
from shipgym.errors import InputError
from shipgym.models import ShipModel
from shipgym.sea.conditions import Current, Weather
from shipgym.tasks.task import Task, course_keeping_task

#: Distance from the data of a model that no ship reaches before she is lost.
ANYWHERE = 1e6


@dataclass(frozen=True, eq=False)
class Track:
    """Ships under one path autopilot: the identified model, then the models drawn."""

    key: str  # its kind
    controller: Controller
    waypoints: Floats  # north and east, m, shape (n_waypoints, 2)
    #: north and east of the identified model, m, shape (n_steps + 1, 2)
    positions: Floats
    #: its distance from the track, to starboard positive, m, shape (n_steps + 1,)
    cross_track: Floats
    #: cross-track error once the start is behind, m, shape (1 + n_draws,)
    largest: Floats
    rms: Floats  # m, shape (1 + n_draws,)
    arrived: Flags  # shape (1 + n_draws,)


def track_task(model: ShipModel) -> Task:
    """The track for a ship, in a current of a tenth of her speed.

    It is as much wider as she is slow to turn: by how far ahead she has to see an arc
    (`own_lead`), over what is usual.
    """
    try:
        wider = max(1.0, own_lead(model, None) / 2.5)  # ship lengths
    except InputError:  # no LQ holds her; who leads her says so
        wider = 1.0
    # changes of course, to starboard positive
    turns_deg = (30.0, -60.0, 90.0, -90.0, 45.0)
    courses = np.radians(np.cumsum([0.0, *turns_deg]))
    directions = np.column_stack([np.cos(courses), np.sin(courses)])
    legs = 12.0 * wider * model.particulars["length"] * directions
    current = Current(0.1 * model.particulars["speed"], towards_deg=90.0)
    return Task.of(
        "PathFollowing",
        waypoints=np.vstack([np.zeros(2), np.cumsum(legs, axis=0)]),
        sea=Weather(current=current),
        turn_radius=4.0 * wider,
        episode_steps=int(3000 * wider),  # about twice what it takes
        max_envelope_distance=ANYWHERE,
    )


def judged_task() -> Task:
    """Course keeping that ends when control is lost, not where a model extrapolates."""
    return course_keeping_task(max_envelope_distance=ANYWHERE)


def keep_track(guide: Controller, models: Sequence[ShipModel]) -> Track:
    """Lead ships of one structure along the track, the identified one first."""
    task = track_task(models[0])
    engine = Engine(models, len(models), task, allow_unstable=True)
    seeds = np.zeros(len(models), dtype=np.int64)
    recorded = (
        "x",
        "y",
        "cross_track",
        "distance_made_good",
        "success",
    )
    run = rollout(guide, engine, seeds, record=recorded)

    n_samples = int(run.steps[0]) + 1  # up to the end of the first ship's episode
    own = {name: one[:n_samples, 0] for name, one in run.histories.items()}
    return Track(
        key=guide.kind,
        controller=guide,
        waypoints=np.reshape(task.settings.waypoints, (-1, 2)),
        positions=np.column_stack([own["x"], own["y"]]),
        cross_track=own["cross_track"],
        largest=_largest_error(run),
        rms=root_mean_square(run, "cross_track"),
        arrived=succeeded(run) > 0.0,
    )


def _largest_error(run: Rollout) -> Floats:
    """Largest cross-track error of each ship after the start, m, shape (n,)."""
    # way after the start that does not count
    settled = 6.0 * run.model.particulars["length"]
    made_good = run.histories["distance_made_good"][1:]
    counts = run.sailing & (made_good > settled)

    off_track = np.abs(run.histories["cross_track"][1:])
    return np.asarray(np.where(counts, off_track, 0.0).max(axis=0))
