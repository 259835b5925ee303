"""Manoeuvres of many models drawn from one covariance: how certain are the indices and criteria."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shipgym.errors import UnstableModelError
from shipgym.manoeuvres import Criterion, turning_circle, zigzag
from shipgym.manoeuvres.imo import assess_draws
from shipgym.manoeuvres.standard import TURN_DEG
from shipgym.models import ShipModel
from shipgym.trial import Trial

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
    nominal_zigzag, nominal_circle = _zigzag(model), _circle(model)
    assessed = assess_draws(model, draws, progress)
    criteria = {name: criterion for name, criterion in assessed.items() if criterion.passed is not None}
    unstable = np.any([c.drawn.ran_away for c in criteria.values() if c.drawn is not None], axis=0)
    headings: list[Floats] = []
    paths: list[Floats] = []
    for k, draw in enumerate(draws):
        if unstable[k]:
            continue
        try:
            heading, circle = _zigzag(draw)["psi"], _circle(draw)
        except UnstableModelError:
            unstable[k] = True
            continue
        headings.append(heading)
        paths.append(np.column_stack([circle["x"], circle["y"]]))
    return ManoeuvreSpread(
        criteria=criteria,
        unstable=unstable,
        zigzag=nominal_zigzag,
        zigzag_headings=np.array(headings).reshape(len(headings), len(nominal_zigzag)),
        circle=nominal_circle,
        circle_paths=tuple(paths[:PATHS_KEPT]),
    )


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
