"""Manoeuvres of many models drawn from one covariance: how certain are the indices and criteria."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shipgym.arrays import Floats
from shipgym.errors import UnstableModelError
from shipgym.manoeuvres import Criterion, turning_circle, zigzag
from shipgym.manoeuvres.imo import imo_criteria, imo_manoeuvres
from shipgym.manoeuvres.intervals import IndexInterval, attempt, intervals_of
from shipgym.manoeuvres.turning import TURN_DEG
from shipgym.ships import ShipModel
from shipgym.trials.trial import Trial

ZIGZAG_DEG = (20.0, 20.0)
ZIGZAG_LENGTHS, TURN_LENGTHS = (
    25.0,
    30.0,
)  # duration of the runs kept, in times to travel one ship length
SAMPLES_PER_LENGTH = 10.0
PATHS_KEPT = 40  # turning circles of draws that a report draws


@dataclass(frozen=True)
class ManoeuvreUncertainty:
    """Standard manoeuvres of a model and of its draws."""

    #: by the names of `imo_assessment`, each with its interval over the draws; those
    #: that her equations allow
    criteria: dict[str, Criterion]
    unstable: NDArray[
        np.bool_
    ]  # draws that run away in one of the manoeuvres, shape (n_draws,)
    zigzag: Trial  # 20/20 zigzag of the identified model
    # heading change of each stable draw in it, rad, shape (n_stable, n_samples)
    zigzag_headings: Floats
    circle: Trial  # turning circle of the identified model
    circle_paths: tuple[
        Floats, ...
    ]  # north and east of some stable draws, m, shape (n_samples, 2)


def nominal_runs(model: ShipModel) -> tuple[Trial, Trial]:
    """Zigzag and turning circle of a model, as they are kept; raises UnstableModelError if it runs away."""
    dt = float(
        model.particulars["length"] / model.particulars["speed"] / SAMPLES_PER_LENGTH
    )
    duration, turning = (
        lengths * SAMPLES_PER_LENGTH * dt for lengths in (ZIGZAG_LENGTHS, TURN_LENGTHS)
    )
    run = zigzag(model, *ZIGZAG_DEG, duration=duration, dt=dt, must_reverse=False)
    return run, turning_circle(
        model, min(TURN_DEG, model.steering.rudder_limit_deg), turning, dt
    )


def sail_draws(model: ShipModel, draws: Sequence[ShipModel]) -> dict[str, Any]:
    """Put models drawn from one through the standard manoeuvres.

    Returns `values` by manoeuvre and index, shape (n_draws,), NaN where there is none;
    `ran_away` by manoeuvre, shape (n_draws,); `lost`, draws that run away in the two
    runs that are kept, shape (n_draws,); `headings` in the zigzag, rad, shape
    (n_samples,), and `paths`, north and east in the circle, m, shape (n_samples, 2), of
    each draw that is not lost.
    """
    needed = imo_manoeuvres(model)
    empty = {name: test.no_indices for name, test in needed.items()}
    found = intervals_of(
        empty, draws, {name: test.evaluate for name, test in needed.items()}
    )
    runs = [_kept_runs(draw) for draw in draws]
    kept = [run for run in runs if run is not None]
    return {
        "values": {
            name: {k: one.values for k, one in indices.items()}
            for name, indices in found.items()
        },
        "ran_away": {
            name: next(iter(indices.values())).ran_away
            for name, indices in found.items()
        },
        "lost": np.array([run is None for run in runs]),
        "headings": [heading for heading, _ in kept],
        "paths": [path for _, path in kept],
    }


def uncertainty_of(
    model: ShipModel, nominal: tuple[Trial, Trial], parts: Sequence[dict[str, Any]]
) -> ManoeuvreUncertainty:
    """All of it, from the runs of the model itself and what `sail_draws` found of its draws, in parts."""
    found = {
        name: {
            index: IndexInterval(
                value,
                np.concatenate([part["values"][name][index] for part in parts]),
                np.concatenate([part["ran_away"][name] for part in parts]),
            )
            for index, value in (
                attempt(test.evaluate, model)[0] or test.no_indices
            ).items()
        }
        for name, test in imo_manoeuvres(model).items()
    }
    criteria = {
        name: one
        for name, one in imo_criteria(model, found).items()
        if one.drawn is not None
    }
    lost = np.concatenate([part["lost"] for part in parts])
    unstable = lost | np.any(
        [c.drawn.ran_away for c in criteria.values() if c.drawn is not None], axis=0
    )
    headings, paths = (
        [one for part in parts for one in part[name]] for name in ("headings", "paths")
    )
    stable = ~unstable[~lost]  # of those that were kept
    return ManoeuvreUncertainty(
        criteria,
        unstable,
        zigzag=nominal[0],
        zigzag_headings=np.array(headings)[stable],
        circle=nominal[1],
        circle_paths=tuple(np.array(paths)[stable][:PATHS_KEPT]),
    )


def _kept_runs(model: ShipModel) -> tuple[Floats, Floats] | None:
    """Headings in the zigzag and path in the circle; None where the ship runs away."""
    try:
        run, circle = nominal_runs(model)
    except UnstableModelError:
        return None
    return run["psi"], np.column_stack([circle["x"], circle["y"]])
