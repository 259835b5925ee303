"""LS-SVR as the thesis uses it, what it predicts, and the fit at best to put beside it.

The thesis regresses x(k+1) on terms at k that hold x(k) itself, on columns as they are,
and predicts by stepping that difference equation.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.estimators.linear import Estimator
from identification.estimators.lssvm import LSSVM
from identification.estimators.tuned import TunedLSSVM
from identification.samples.samples import build_samples
from shipgym.models import ShipModel
from shipgym.ships import Structure, get_structure
from shipgym.ships.structures import own_structure
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]

PREFIX = {"v": "b", "r": "c"}
LEAST_C = 1e-2  # of the searches, as printed
RAN_AWAY = 1e3  # m/s or rad/s: beyond every physical range
#: Optimiser and objective of the thesis' three methods.
SEARCHES = {
    "CV": ("grid", "k-fold"),
    "PSO": ("pso", "training"),
    "ABC": ("abc", "training"),
}

SEVEN = get_structure("steering7")

#: The seven terms with the speed of the moment in them, so that they follow the loss of
#: speed in a turn, two cubic ones, and surge to know that speed: resistance, and a
#: thrust that falls with the advance ratio.
STEERING_WITH_SPEED = "U v, |v| v, |r| v, U r, |v| r, |r| r, U^2 delta, v^2 r/U, v^3/U"
WITH_SPEED = own_structure(
    {
        "name": "zhu-with-speed",
        "source": (f"{SEVEN.source}, with the instantaneous speed, and surge"),
        "equations": {
            "u": "u^2, v r, n^2, n u",
            "v": STEERING_WITH_SPEED,
            "r": STEERING_WITH_SPEED,
        },
    },
    "zhu2018",
)


def search(method: str, most: float) -> TunedLSSVM:
    """LS-SVR on columns as they are, with C found by a method of the thesis."""
    optimiser, objective = SEARCHES[method]
    return TunedLSSVM(
        optimiser=optimiser, objective=objective, bounds=(LEAST_C, most), scale=False
    )


def steering_terms(trial: Trial) -> Floats:
    """The seven terms of equation 7.1, SI units, shape (n_samples, 7)."""
    v = trial["v"]
    r = trial["r"]
    terms = [v, abs(v) * v, abs(r) * v, r, abs(v) * r, abs(r) * r, trial["delta"]]
    return np.column_stack(terms)


def term_columns(structure: Structure, equation: str) -> list[int]:
    """Which of the seven terms a reduced structure has."""
    seven = SEVEN.names(equation)
    return [seven.index(name) for name in structure.names(equation)]


@dataclass(frozen=True, eq=False)
class Difference:
    """A difference equation x(k+1) = kept x(k) + gains . terms(k) + constant.

    Attributes
    ----------
    gains : list of float
        Of each term, per step.
    constant : float
        The intercept b of LS-SVR.
    kept : float
        0 where x(k) is among the terms, as printed; 1 where the change of x was
        regressed.
    estimator : LSSVM or TunedLSSVM
        What was fitted.
    """

    gains: list[float]
    constant: float
    kept: float
    estimator: Estimator

    def step(self, x: float, terms: Sequence[float]) -> float:
        """The next value."""
        change = sum(
            [gain * term for gain, term in zip(self.gains, terms, strict=True)],
            self.constant,
        )
        return self.kept * x + change


def steering_fit(
    trial: Trial,
    equation: str,
    estimator: LSSVM | TunedLSSVM,
    structure: Structure = SEVEN,
    change: bool = False,
) -> Difference:
    """Fit the difference equation of sway or yaw.

    Parameters
    ----------
    trial : Trial
        Evenly sampled.
    equation : {"v", "r"}
    estimator : LSSVM or TunedLSSVM
        Not fitted.
    structure : Structure
        `steering7`, or one with some of its terms.
    change : bool
        Whether x(k+1) - x(k) is the target, and not x(k+1), as for the reduced models,
        some of which have no linear term that could carry the state on.

    Returns
    -------
    Difference
    """
    columns = term_columns(structure, equation)
    terms = steering_terms(trial)[:-1, columns]
    x = trial[equation]
    fitted = estimator.fit(terms, np.diff(x) if change else x[1:])
    gains = np.zeros(len(SEVEN.names(equation)))
    gains[columns] = fitted.coef_
    return Difference(gains.tolist(), fitted.intercept_, float(change), fitted)


def steer(sway: Difference, yaw: Difference, trial: Trial) -> dict[str, Floats]:
    """Predict a trial from its first sample and rudder; infinite after running away."""
    sways = np.full(len(trial), np.inf)
    rates = np.full(len(trial), np.inf)
    v = float(trial["v"][0])
    r = float(trial["r"][0])
    for k, delta in enumerate(trial["delta"].tolist()):
        sways[k] = v
        rates[k] = r
        terms = (v, abs(v) * v, abs(r) * v, r, abs(v) * r, abs(r) * r, delta)
        v = sway.step(v, terms)
        r = yaw.step(r, terms)
        if not (abs(v) < RAN_AWAY and abs(r) < RAN_AWAY):
            break
    return {"v": sways, "r": rates}


def mean_square(
    predicted: Mapping[str, Floats] | Trial | None, trial: Trial, channel: str
) -> float:
    """Mean squared error of a channel; infinite after running away.

    Of yaw rate in deg^2/s^2, as printed.
    """
    if predicted is None:
        return math.inf
    error = predicted[channel] - trial[channel]
    if not np.isfinite(error).all():
        return math.inf
    unit = np.degrees(1.0) if channel == "r" else 1.0
    return float(unit**2 * np.mean(error**2))


def spline_fit(
    trial: Trial, ship: ShipModel, columns: Mapping[str, Sequence[int]]
) -> ShipModel:
    """A model with instantaneous speed in its terms, by least squares on splines.

    Parameters
    ----------
    trial : Trial
        With the channels u, v, r, delta and n.
    ship : ShipModel
        Gives particulars, gear and shaft speed.
    columns : mapping of str to sequence of int
        Which terms of `WITH_SPEED` surge, sway and yaw have; the others are 0.

    Returns
    -------
    ShipModel
    """
    blank = ShipModel(
        "with speed",
        WITH_SPEED.name,
        ship.particulars,
        ship.steering,
        dict.fromkeys(WITH_SPEED.coefficient_names, 0.0),
        dynamics=WITH_SPEED,
        service_shaft_speed=ship.service_shaft_speed,
    )
    samples = build_samples([trial], WITH_SPEED, ship.particulars, gear=ship.steering)
    accelerations = {
        q: np.zeros(len(WITH_SPEED.equations[q])) for q in WITH_SPEED.regressed
    }
    for q, chosen in columns.items():
        estimator = LSSVM(C=np.inf, fit_intercept=False)
        accelerations[q][list(chosen)] = estimator.fit(
            samples.features[q][:, list(chosen)], samples.targets[q]
        ).coef_
    return blank.with_accelerations(accelerations)
