"""Section 7.2: Nomoto's forms by least squares and by LS-SVR.

The zigzags of the small ship are not published. In their place stands a Nomoto ship
with the printed K and T of LS-SVR, whose yaw rate is logged once a second with white
noise, coloured noise and outliers. Where the thesis has one log, here are twenty, and
the rows hold means over them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from sensors import Sensor, Sensors

from identification import Preprocessing, Sampling
from identification.estimators.lssvm import LSSVM
from identification.estimators.tuned import TunedLSSVM
from identification.models.refinement import whole_trials
from identification.pipeline import identify
from papers.row import Row, within
from shipgym.manoeuvres import zigzag
from shipgym.models import ShipModel
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]

K, T = 0.1921, 1.0524  # 1/s, s: of LS-SVR in Table 7.2.1, the truth of the stand-in
WITHIN = {"K": 2.0, "T": 5.0}  # aims, %
SEEDS = range(20)
DEGREE = np.pi / 180.0
ANGLE, DURATION, SPEED = 20.0, 82.0, 1.5  # of the zigzag: deg, s, m/s
STEP = 0.02  # of the simulation, s
NOISE = {
    "noise": 0.05 * DEGREE,
    "drift": 0.15 * DEGREE,
    "drift_time_s": 2.0,
}  # of the yaw rate, rad/s
OUTLIERS = {
    "outlier_probability": 0.05,
    "outlier_size": 4.0 * DEGREE,
}  # in what is learned from
# samples over which the form is integrated: two, to average the noise, in a lag of
# about one
WINDOW = 2
PRINTED = {
    ("LS", "linear"): (0.1960, 1.1657, 0.0),
    ("LS-SVR", "linear"): (0.1921, 1.0524, 0.0),
    ("LS", "nonlinear"): (0.1933, 1.1275, -0.0006),
    ("LS-SVR", "nonlinear"): (0.1919, 1.0503, -0.0005),
}


@dataclass(frozen=True)
class Form:
    """Nomoto's T rdot + r + a r^3 = K delta, r in rad/s, and the thesis' constant."""

    K: float
    T: float
    a: float = 0.0
    constant: float = 0.0


TRUTH = Form(K, T)


def ship() -> ShipModel:
    """The stand-in."""
    gear = SteeringGear(
        rudder_limit_deg=35.0, rudder_rate_deg_s=20.0, time_constant=0.0
    )
    particulars = Particulars(name="small ship", length=5.0, speed=SPEED)
    coefficients = {"c_r": -1.0 / T, "c_d": K / T}
    return ShipModel("nomoto", "nomoto", particulars, gear, coefficients)


def log(seed: int) -> Trial:
    """A zigzag of the stand-in as logged."""
    sensors = {
        "r": Sensor(**NOISE, **OUTLIERS),
        "delta": Sensor(resolution=0.1 * DEGREE),
    }
    run = zigzag(ship(), ANGLE, ANGLE, duration=DURATION, dt=STEP)
    return Sensors(sensors, sampling_s=1.0).measure(run, seed)


def as_printed(trial: Trial, method: str, form: str) -> Form:
    """A form from the change of the yaw rate over a sample, by Euler's rule.

    Parameters
    ----------
    trial : Trial
        Evenly sampled.
    method : {"LS", "LS-SVR"}
    form : {"linear", "nonlinear"}
    """
    r = trial["r"]
    step = float(trial.t[1] - trial.t[0])
    terms = [r, trial["delta"]]
    if form == "nonlinear":
        terms.append(r**3)
    X = np.column_stack(terms)[:-1]
    y = np.diff(r) / step
    estimator = LSSVM(C=np.inf, fit_intercept=False) if method == "LS" else TunedLSSVM()
    estimator.fit(X, y)
    damping, gain, *bend = estimator.coef_.tolist()
    return Form(
        -gain / damping,
        -1.0 / damping,
        bend[0] / damping if bend else 0.0,
        estimator.intercept_,
    )


def at_best(trial: Trial, form: str) -> Form:
    """A form by output error after repair, with the rudder between samples."""
    model = identify(
        [trial],
        "nomoto" if form == "linear" else "norrbin",
        whole_trials(),
        Sampling(window=WINDOW),
        particulars=ship().particulars,
        steering=ship().steering,
        preprocessing=Preprocessing("none", repair=True),
        guarded=False,
        rudder_bias="none",
    ).model
    c = model.coefficients
    return Form(-c["c_d"] / c["c_r"], -1.0 / c["c_r"], c.get("c_r3", 0.0) / c["c_r"])


@cache
def fitted(method: str, form: str) -> tuple[Form, ...]:
    """The forms from all logs by `LS`, `LS-SVR`, or the `best` method here."""
    logs = [log(seed) for seed in SEEDS]
    return tuple(
        at_best(trial, form) if method == "best" else as_printed(trial, method, form)
        for trial in logs
    )


def mean(forms: tuple[Form, ...], name: str) -> float:
    """Mean of a coefficient over the logs."""
    return float(np.mean([getattr(form, name) for form in forms]))


def mean_error(forms: tuple[Form, ...], name: str) -> float:
    """Mean error over the logs, without sign, %."""
    truth = getattr(TRUTH, name)
    return float(
        100.0 * np.mean([abs(getattr(form, name) / truth - 1.0) for form in forms])
    )


def rows() -> Iterator[Row]:
    """Table 7.2.1, and what outliers do to each method.

    One zigzag has one steady yaw rate, which gives K and a together but not separately:
    only the linear form has an aim.
    """
    for (method, form), (*values, bend) in PRINTED.items():
        ours, best = fitted(method, form), fitted("best", form)
        for name, value in zip(("K, 1/s", "T, s"), values, strict=True):
            symbol = name[0]
            error = 100.0 * (mean(best, symbol) / getattr(TRUTH, symbol) - 1.0)
            yield Row(
                "Table 7.2.1",
                f"{method}, {form}: {name}",
                value,
                mean(ours, symbol),
                mean(best, symbol),
                *(within(WITHIN[symbol], error) if form == "linear" else ()),
            )
        if form == "nonlinear":
            yield Row(
                "Table 7.2.1",
                f"{method}, {form}: a, s2/deg2",
                bend,
                mean(ours, "a") * DEGREE**2,
                mean(best, "a") * DEGREE**2,
            )
    for name in ("K", "T"):
        plain, theirs, best_error = (
            mean_error(fitted(method, "linear"), name)
            for method in ("LS", "LS-SVR", "best")
        )
        what = f"linear: mean error of {name}"
        yield Row("Section 7.2.2", f"{what} by LS, %", None, plain, best_error)
        yield Row(
            "Section 7.2.2",
            f"{what} by LS-SVR, %",
            None,
            theirs,
            best_error,
            "at most half of LS-SVR's",
            best_error <= 0.5 * theirs,
        )
