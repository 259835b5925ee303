"""Manoeuvres of many models drawn from one covariance: how certain are the indices and criteria."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shipgym.errors import UnstableModelError
from shipgym.manoeuvres import Criterion, turning_circle, zigzag
from shipgym.manoeuvres.imo import imo_criteria, imo_manoeuvres
from shipgym.manoeuvres.intervals import IndexInterval, attempt, intervals_of
from shipgym.manoeuvres.turning import TURN_DEG
from shipgym.ships import ShipModel
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]

ZIGZAG_DEG = (20.0, 20.0)
ZIGZAG_LENGTHS, TURN_LENGTHS = 25.0, 30.0  # duration of the runs kept, in times to travel one ship length
SAMPLES_PER_LENGTH = 10.0
PATHS_KEPT = 40  # turning circles of draws that a report draws


@dataclass(frozen=True)
class ManoeuvreSpread:
    """Standard manoeuvres of a model and of its draws.

    Attributes
    ----------
    criteria : dict of str to Criterion
        By the names of `imo_assessment`, each with its spread over the draws; those that can be assessed.
    unstable : bool array of shape (n_draws,)
        Draws that run away in one of the manoeuvres.
    zigzag : Trial
        20/20 zigzag of the identified model.
    zigzag_headings : array of shape (n_stable, n_samples)
        Heading change of each stable draw in it, rad.
    circle : Trial
        Turning circle of the identified model.
    circle_paths : tuple of array of shape (n_samples, 2)
        North and east of some stable draws, m.
    """

    criteria: dict[str, Criterion]
    unstable: NDArray[np.bool_]
    zigzag: Trial
    zigzag_headings: Floats
    circle: Trial
    circle_paths: tuple[Floats, ...]


@dataclass(frozen=True, eq=False)
class SailedDraws:
    """Some models drawn in the standard manoeuvres, in numbers and arrays that can be written down.

    Attributes
    ----------
    indices : dict of str to dict of str to array of shape (n_draws,)
        By manoeuvre and index; NaN where there is none.
    ran_away : dict of str to bool array of shape (n_draws,)
        By manoeuvre.
    lost : bool array of shape (n_draws,)
        Draws that run away in the 20/20 zigzag or the turning circle that are kept.
    headings : array of shape (n_draws, n_samples)
        In that zigzag, rad; of lost draws meaningless, as paths are.
    paths : array of shape (n_draws, n_samples, 2)
        North and east in that circle, m.
    """

    indices: dict[str, dict[str, Floats]]
    ran_away: dict[str, NDArray[np.bool_]]
    lost: NDArray[np.bool_]
    headings: Floats
    paths: Floats


def manoeuvre_spread(
    model: ShipModel, draws: Sequence[ShipModel], progress: Callable[[int], None] | None = None
) -> ManoeuvreSpread:
    """Judge a model and its draws by the IMO criteria and keep their zigzags and turning circles.

    Parameters
    ----------
    model : ShipModel
        The identified model; it must not run away.
    draws : sequence of ShipModel
        Drawn from its covariance (`ShipModel.sample`).
    progress : callable, optional
        Told the number of draws done.

    Returns
    -------
    ManoeuvreSpread

    Raises
    ------
    UnstableModelError
        If the model itself runs away.
    """
    nominal = nominal_runs(model)
    return spread_of(model, nominal, [sail_draws(model, draws, progress)])


def nominal_runs(model: ShipModel) -> tuple[Trial, Trial]:
    """Zigzag and turning circle of the model itself.

    Raises
    ------
    UnstableModelError
        If it runs away.
    """
    return _zigzag(model), _circle(model)


def sail_draws(
    model: ShipModel, draws: Sequence[ShipModel], progress: Callable[[int], None] | None = None
) -> SailedDraws:
    """Put models drawn from one through the standard manoeuvres."""
    needed = imo_manoeuvres(model)
    empty = {name: test.no_indices for name, test in needed.items()}
    found = intervals_of(empty, draws, {name: test.evaluate for name, test in needed.items()}, progress)
    runs = [_kept_runs(draw) for draw in draws]
    headings, paths = zip(*(run or _nothing(model) for run in runs), strict=True)
    return SailedDraws(
        indices={name: {k: one.values for k, one in indices.items()} for name, indices in found.items()},
        ran_away={name: next(iter(indices.values())).ran_away for name, indices in found.items()},
        lost=np.array([run is None for run in runs]),
        headings=np.array(headings),
        paths=np.array(paths),
    )


def spread_of(
    model: ShipModel, nominal: tuple[Trial, Trial], parts: Sequence[SailedDraws]
) -> ManoeuvreSpread:
    """The spread over draws that were sailed in parts."""
    criteria = {
        name: criterion
        for name, criterion in imo_criteria(model, _intervals(model, parts)).items()
        if criterion.passed is not None
    }
    unstable = np.any([c.drawn.ran_away for c in criteria.values() if c.drawn is not None], axis=0)
    unstable |= np.concatenate([part.lost for part in parts])
    headings = np.concatenate([part.headings for part in parts])
    paths = np.concatenate([part.paths for part in parts])
    return ManoeuvreSpread(
        criteria=criteria,
        unstable=unstable,
        zigzag=nominal[0],
        zigzag_headings=headings[~unstable],
        circle=nominal[1],
        circle_paths=tuple(paths[~unstable][:PATHS_KEPT]),
    )


def _intervals(model: ShipModel, parts: Sequence[SailedDraws]) -> dict[str, dict[str, IndexInterval]]:
    """Indices of the model itself with those of all draws."""
    return {
        name: {
            index: IndexInterval(
                value,
                np.concatenate([part.indices[name][index] for part in parts]),
                np.concatenate([part.ran_away[name] for part in parts]),
            )
            for index, value in (attempt(test.evaluate, model)[0] or test.no_indices).items()
        }
        for name, test in imo_manoeuvres(model).items()
    }


def _kept_runs(model: ShipModel) -> tuple[Floats, Floats] | None:
    """Headings in the zigzag and path in the circle; None where the ship runs away."""
    try:
        heading, circle = _zigzag(model)["psi"], _circle(model)
    except UnstableModelError:
        return None
    return heading, np.column_stack([circle["x"], circle["y"]])


def _nothing(model: ShipModel) -> tuple[Floats, Floats]:
    """In the place of the runs of a draw that runs away."""
    samples = round(ZIGZAG_LENGTHS * SAMPLES_PER_LENGTH) + 1, round(TURN_LENGTHS * SAMPLES_PER_LENGTH) + 1
    return np.zeros(samples[0]), np.zeros((samples[1], 2))


def _full_rudder(model: ShipModel) -> float:
    return min(TURN_DEG, model.steering.rudder_limit_deg)


def _sampling(model: ShipModel) -> float:
    return float(model.particulars["length"] / model.particulars["speed"] / SAMPLES_PER_LENGTH)


def _zigzag(model: ShipModel) -> Trial:
    dt = _sampling(model)
    return zigzag(
        model, *ZIGZAG_DEG, duration=ZIGZAG_LENGTHS * SAMPLES_PER_LENGTH * dt, dt=dt, must_reverse=False
    )


def _circle(model: ShipModel) -> Trial:
    dt = _sampling(model)
    return turning_circle(model, _full_rudder(model), TURN_LENGTHS * SAMPLES_PER_LENGTH * dt, dt)
