"""Manoeuvres of many models drawn from one covariance: how certain are the indices and criteria."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shipgym.errors import UnstableModelError
from shipgym.manoeuvres import Criterion, imo_assessment, turning_circle, zigzag
from shipgym.models import ShipModel
from shipgym.trial import Trial

Floats = NDArray[np.float64]

ZIGZAG_DEG = (20.0, 20.0)
TURN_DEG = 35.0
ZIGZAG_LENGTHS, TURN_LENGTHS = 25.0, 30.0  # duration of the runs kept, in times to travel one ship length
SAMPLES_PER_LENGTH = 10.0
PATHS_KEPT = 40  # turning circles of draws that a report draws


@dataclass(frozen=True)
class CriterionSpread:
    """One IMO criterion for the identified model and for every draw.

    Attributes
    ----------
    nominal : Criterion
        Of the identified model itself.
    values : array of shape (n_draws,)
        In the criterion's unit; NaN where the manoeuvre never got so far.
    passed : bool array of shape (n_draws,)
        A manoeuvre that runs away has not passed.
    """

    nominal: Criterion
    values: Floats
    passed: NDArray[np.bool_]

    @property
    def probability(self) -> float:
        """Share of the draws that pass; those that run away in the manoeuvre do not."""
        return float(self.passed.mean()) if len(self.passed) else float("nan")

    def quantiles(self, *levels: float) -> tuple[float | None, ...]:
        """Quantiles over the draws that have a value; None where none has."""
        reached = self.values[np.isfinite(self.values)]
        if not len(reached):
            return (None,) * len(levels)
        return tuple(float(value) for value in np.quantile(reached, levels))

    def to_dict(self) -> dict[str, Any]:
        """As it stands in metrics.json."""
        low, median, high = self.quantiles(0.05, 0.5, 0.95)
        return {
            **asdict(self.nominal),
            "probability": self.probability,
            "quantile_05": low,
            "median": median,
            "quantile_95": high,
            "without_value": int(np.sum(~np.isfinite(self.values))),
        }


@dataclass(frozen=True)
class ManoeuvreSpread:
    """Standard manoeuvres of a model and of its draws.

    Attributes
    ----------
    criteria : dict of str to CriterionSpread
        By the names of `imo_assessment`.
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

    criteria: dict[str, CriterionSpread]
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
    nominal = imo_assessment(model)
    assessments: list[dict[str, Criterion]] = []
    headings: list[Floats] = []
    paths: list[Floats] = []
    unstable = np.zeros(len(draws), dtype=np.bool_)
    for k, draw in enumerate(draws):
        assessments.append(imo_assessment(draw))
        try:
            _check_stays(draw, assessments[-1])
            headings.append(_zigzag(draw)["psi"])
            circle = _circle(draw)
            paths.append(np.column_stack([circle["x"], circle["y"]]))
        except UnstableModelError:
            unstable[k] = True
        if progress is not None:
            progress(k + 1)
    return ManoeuvreSpread(
        criteria={
            name: _criterion_spread(criterion, [assessment[name] for assessment in assessments])
            for name, criterion in nominal.items()
        },
        unstable=unstable,
        zigzag=nominal_zigzag,
        zigzag_headings=np.array(headings).reshape(len(headings), len(nominal_zigzag)),
        circle=nominal_circle,
        circle_paths=tuple(paths[:PATHS_KEPT]),
    )


def _criterion_spread(nominal: Criterion, draws: Sequence[Criterion]) -> CriterionSpread:
    values = [np.nan if criterion.value is None else criterion.value for criterion in draws]
    passed = np.array([criterion.passed for criterion in draws], dtype=np.bool_)
    return CriterionSpread(nominal, np.array(values, dtype=np.float64), passed)


def _check_stays(model: ShipModel, criteria: dict[str, Criterion]) -> None:
    """Where an index is missing, tell a ship that ran away from one that is only slow to turn.

    Raises
    ------
    UnstableModelError
        If it ran away.
    """
    if all(criterion.value is not None for criterion in criteria.values()):
        return
    dt = _sampling(model)
    duration = 40.0 * SAMPLES_PER_LENGTH * dt
    for side in (1.0, -1.0):
        turning_circle(model, side * _full_rudder(model), duration, dt)
        for angle in (10.0, 20.0):
            zigzag(model, angle, angle, side < 0.0, duration, dt, must_reverse=False)


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
