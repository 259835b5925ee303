"""Uncertainty of manoeuvre indices and criteria, by models drawn from a covariance."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Flags, Floats
from shipgym.errors import UnstableModelError
from shipgym.manoeuvres import Criterion, turning_circle, zigzag
from shipgym.manoeuvres.imo import imo_criteria
from shipgym.manoeuvres.imo_rules import imo_manoeuvres
from shipgym.manoeuvres.intervals import (
    IndexInterval,
    intervals_of,
    is_size,
    own_indices,
)
from shipgym.manoeuvres.turning import full_rudder_deg
from shipgym.models import ShipModel
from shipgym.trials.trial import Trial


@dataclass(frozen=True)
class ManoeuvreUncertainty:
    """Standard manoeuvres of a model and of its draws."""

    #: by the names of `imo_assessment`, each with its interval over the draws; those
    #: that her equations allow
    criteria: dict[str, Criterion]
    #: draws that run away in one of the manoeuvres, shape (n_draws,)
    unstable: Flags
    zigzag: Trial  # 20/20 zigzag of the identified model
    #: heading change of each stable draw in it, rad, shape (n_stable, n_samples)
    zigzag_headings: Floats
    circle: Trial  # turning circle of the identified model
    #: north and east of some stable draws, m, shape (n_samples, 2)
    circle_paths: tuple[Floats, ...]


class NominalRuns(NamedTuple):
    """Zigzag and turning circle of a model, as they are kept."""

    zigzag: Trial
    circle: Trial


class SailedDraws(NamedTuple):
    """Results of some models drawn in the standard manoeuvres."""

    #: by manoeuvre and index, shape (n_draws,), NaN where there is none
    values: dict[str, dict[str, Floats]]
    ran_away: dict[str, Flags]  # by manoeuvre, shape (n_draws,)
    #: draws that run away in the two runs that are kept, shape (n_draws,)
    lost: Flags
    #: in the zigzag, of each draw that is not lost, rad, shape (n_samples,)
    headings: list[Floats]
    #: north and east in the circle, of each of these, m, shape (n_samples, 2)
    paths: list[Floats]


def nominal_runs(model: ShipModel) -> NominalRuns:
    """20/20 zigzag and turning circle of a model.

    Raises UnstableModelError if it runs away.
    """
    travel = float(model.particulars["length"] / model.particulars["speed"])
    samples_per_length = 10.0
    dt = travel / samples_per_length
    run = zigzag(
        model,
        20.0,
        20.0,
        duration=25.0 * samples_per_length * dt,
        dt=dt,
        must_reverse=False,
    )
    duration = 30.0 * samples_per_length * dt
    circle = turning_circle(model, full_rudder_deg(model), duration, dt)
    return NominalRuns(run, circle)


def sail_draws(model: ShipModel, draws: Sequence[ShipModel]) -> SailedDraws:
    """Put models drawn from one through the standard manoeuvres."""
    values = {}
    ran_away = {}
    for name, indices in _index_intervals(model, draws).items():
        values[name] = {index: one.values for index, one in indices.items()}
        first = next(iter(indices.values()))
        ran_away[name] = first.ran_away

    headings: list[Floats] = []
    paths: list[Floats] = []
    lost = np.zeros(len(draws), dtype=np.bool_)
    for i, draw in enumerate(draws):
        try:
            runs = nominal_runs(draw)
        except UnstableModelError:
            lost[i] = True
            continue
        circle = runs.circle
        headings.append(runs.zigzag["psi"])
        paths.append(np.column_stack([circle["x"], circle["y"]]))
    return SailedDraws(
        values=values,
        ran_away=ran_away,
        lost=lost,
        headings=headings,
        paths=paths,
    )


def _index_intervals(
    model: ShipModel, draws: Sequence[ShipModel]
) -> dict[str, dict[str, IndexInterval]]:
    """Intervals of the indices of the IMO criteria over draws, by manoeuvre."""
    no_indices = {}
    evaluations = {}
    for name, test in imo_manoeuvres(model).items():
        no_indices[name] = test.no_indices
        evaluations[name] = test.evaluate
    return intervals_of(no_indices, draws, evaluations)


def uncertainty_of(
    model: ShipModel, nominal: NominalRuns, sailed: SailedDraws
) -> ManoeuvreUncertainty:
    """Intervals and criteria from the runs of a model and of its draws."""
    intervals: dict[str, dict[str, IndexInterval]] = {}
    for name, indices in own_indices(model, imo_manoeuvres(model)).items():
        values = sailed.values[name]
        ran_away = sailed.ran_away[name]
        intervals[name] = {}
        for index, value in indices.items():
            interval = IndexInterval(
                value=value,
                values=values[index],
                ran_away=ran_away,
                is_size=is_size(index),
            )
            intervals[name][index] = interval

    criteria = {}
    for name, criterion in imo_criteria(model, intervals).items():
        if criterion.drawn is not None:
            criteria[name] = criterion
    return with_paths(criteria, nominal, sailed)


def with_paths(
    criteria: dict[str, Criterion], nominal: NominalRuns, sailed: SailedDraws
) -> ManoeuvreUncertainty:
    """Criteria with the runs of the draws that run away in none of their manoeuvres."""
    unstable = sailed.lost.copy()
    for criterion in criteria.values():
        if criterion.drawn is not None:
            unstable |= criterion.drawn.ran_away
    stable = ~unstable[~sailed.lost]  # of those that were kept
    headings = np.array(sailed.headings)
    paths = np.array(sailed.paths)[stable]
    paths_kept = 40  # turning circles of draws that a report draws
    return ManoeuvreUncertainty(
        criteria=criteria,
        unstable=unstable,
        zigzag=nominal.zigzag,
        zigzag_headings=headings[stable],
        circle=nominal.circle,
        circle_paths=tuple(paths[:paths_kept]),
    )
