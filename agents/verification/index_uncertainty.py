"""Manoeuvres of many models drawn from one covariance: how certain are the indices and criteria."""

from collections.abc import Iterable, Sequence
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
    own_indices,
)
from shipgym.manoeuvres.turning import full_rudder_deg
from shipgym.ships import ShipModel
from shipgym.trials.trial import Trial

SAMPLES_PER_LENGTH = 10.0
PATHS_KEPT = 40  # turning circles of draws that a report draws


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
    """What became of some models drawn in the standard manoeuvres."""

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
    """20/20 zigzag and turning circle of a model; raises UnstableModelError if it runs away."""
    travel = float(model.particulars["length"] / model.particulars["speed"])
    dt = travel / SAMPLES_PER_LENGTH
    zigzag_s = 25.0 * SAMPLES_PER_LENGTH * dt
    circle_s = 30.0 * SAMPLES_PER_LENGTH * dt
    run = zigzag(model, 20.0, 20.0, duration=zigzag_s, dt=dt, must_reverse=False)
    circle = turning_circle(model, full_rudder_deg(model), circle_s, dt)
    return NominalRuns(run, circle)


def sail_draws(model: ShipModel, draws: Sequence[ShipModel]) -> SailedDraws:
    """Put models drawn from one through the standard manoeuvres."""
    needed = imo_manoeuvres(model)
    no_indices = {name: test.no_indices for name, test in needed.items()}
    evaluations = {name: test.evaluate for name, test in needed.items()}
    found = intervals_of(no_indices, draws, evaluations)

    values, ran_away = {}, {}
    for name, indices in found.items():
        values[name] = {index: one.values for index, one in indices.items()}
        ran_away[name] = next(iter(indices.values())).ran_away

    headings, paths = list[Floats](), list[Floats]()
    lost = np.zeros(len(draws), dtype=bool)
    for k, draw in enumerate(draws):
        try:
            runs = nominal_runs(draw)
        except UnstableModelError:
            lost[k] = True
        else:
            headings.append(runs.zigzag["psi"])
            paths.append(np.column_stack([runs.circle["x"], runs.circle["y"]]))
    return SailedDraws(values, ran_away, lost, headings, paths)


def joined(parts: Iterable[SailedDraws]) -> SailedDraws:
    """What became of all draws, from parts in their order."""
    first, *others = parts
    values = {
        name: {
            index: np.concatenate([own, *(part.values[name][index] for part in others)])
            for index, own in indices.items()
        }
        for name, indices in first.values.items()
    }
    ran_away = {
        name: np.concatenate([own, *(part.ran_away[name] for part in others)])
        for name, own in first.ran_away.items()
    }
    whole = (first, *others)
    return SailedDraws(
        values,
        ran_away,
        lost=np.concatenate([part.lost for part in whole]),
        headings=[heading for part in whole for heading in part.headings],
        paths=[path for part in whole for path in part.paths],
    )


def uncertainty_of(
    model: ShipModel, nominal: NominalRuns, sailed: SailedDraws
) -> ManoeuvreUncertainty:
    """Intervals and criteria from the runs of the model itself and what became of its draws."""
    found = {}
    for name, indices in own_indices(model, imo_manoeuvres(model)).items():
        found[name] = {
            index: IndexInterval(
                value, sailed.values[name][index], sailed.ran_away[name]
            )
            for index, value in indices.items()
        }
    criteria = {
        name: criterion
        for name, criterion in imo_criteria(model, found).items()
        if criterion.drawn is not None
    }
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
    return ManoeuvreUncertainty(
        criteria,
        unstable,
        zigzag=nominal.zigzag,
        zigzag_headings=np.array(sailed.headings)[stable],
        circle=nominal.circle,
        circle_paths=tuple(np.array(sailed.paths)[stable][:PATHS_KEPT]),
    )
