"""Section 7.3: the Mariner's linear steering by recursive least squares.

Started from zero or from LS-SVR.

A 20/20 zigzag at 7.7 m/s, sampled at 0.5 s; from 200 to 220 s the record of the rudder
has noise of 1.5 per cent of its order. The thesis regresses v(k+1) on v, v U, r U and
delta U^2 at k. Its U barely differs from 7.7 m/s, so that v and v U are nearly the same
column: that, and Euler's rule, is where its errors come from. A ship that is herself
integrated by Euler's rule at the step of the samples obeys the regression exactly; the
thesis' order of the two methods is that of such a ship.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np
from numpy.typing import NDArray

from identification.estimators.recursive import RecursiveLeastSquares
from identification.pipeline import identify
from papers.row import Row, sampled, within
from shipgym.manoeuvres import zigzag
from shipgym.models import ShipModel
from shipgym.ships import get_structure
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]

STRUCTURE = "linear-steering"
NAMES = ("a11", "a12", "b11", "a21", "a22", "b21")
TRUTH = np.array(
    [-0.693, -0.304, 0.207, -3.41, -2.17, -1.63]
)  # Table 7.3.1, rudder positive to port
TO_STARBOARD = np.array([1.0, 1.0, -1.0, 1.0, 1.0, -1.0])
LENGTH, SPEED = 161.0, 7.7
DURATION, STEP, INTERVAL = 1000.0, 0.1, 0.5  # s
NOISY = (200.0, 220.0)  # s
NOISE = 0.015 * np.radians(20.0)  # rad
SEED = 2018
START_SAMPLES, START_INTERVAL = 200, 3  # of LS-SVR
#: Not printed: variance of coefficients that start from zero, weight of errors.
C_ZERO, C_START = 1e6, 1e10
WITHIN = 5.0  # aim, %
PRINTED = {
    "RLS": (0.4273, -0.0042, -0.0162, 0.0140, -0.8033, 0.0),
    "LSSVR-RLS": (0.4278, -0.0042, -0.0162, 0.0129, -0.1850, 0.0),
}
SETTLED = 310.0  # s: after the samples of LS-SVR's start
EULER_CASE = "Table 7.3.2, ship integrated by Euler's rule"
MOVES = f"sum of the changes of a22 from {SETTLED:g} s on, relative"


def ship(coefficients: Floats = TRUTH) -> ShipModel:
    """The Mariner with the thesis' six parameters."""
    names = get_structure(STRUCTURE).coefficient_names
    return ShipModel(
        "Mariner, linear",
        STRUCTURE,
        Particulars(name="Mariner", length=LENGTH, speed=SPEED),
        SteeringGear(rudder_limit_deg=40.0, rudder_rate_deg_s=5.0, time_constant=1.0),
        dict(zip(names, (coefficients * TO_STARBOARD).tolist(), strict=True)),
    )


@cache
def zigzag_trial(noisy: bool = True) -> Trial:
    """The 20/20 zigzag as recorded."""
    whole = zigzag(ship(), 20, 20, duration=DURATION, dt=STEP, switch="step")
    trial = sampled(whole, round(INTERVAL / STEP), "zigzag 20/20")
    if not noisy:
        return trial
    rows = (trial.t >= NOISY[0]) & (trial.t < NOISY[1])
    delta = trial["delta"].copy()
    delta[rows] += NOISE * np.random.default_rng(SEED).standard_normal(int(rows.sum()))
    return Trial(
        trial.t,
        dict(trial.channels) | {"delta": delta},
        name=trial.name,
        kind="zigzag",
        length=LENGTH,
    )


def regressions(trial: Trial) -> dict[str, tuple[Floats, Floats]]:
    """Inputs and output of sway and yaw as printed (appendix A.3)."""
    v, r, delta = trial["v"], trial["r"], -trial["delta"]
    U = np.hypot(trial["u"], v)
    return {
        q: (np.column_stack([trial[q], v * U, r * U, delta * U**2])[:-1], trial[q][1:])
        for q in ("v", "r")
    }


def parameters(sway: Floats, yaw: Floats) -> Floats:
    """The six parameters from the coefficients per sample."""
    units = np.array([LENGTH, 1.0, LENGTH, LENGTH**2, LENGTH, LENGTH**2])
    return np.asarray((np.concatenate([sway[1:], yaw[1:]]).T * units / INTERVAL).T)


@cache
def euler_trial() -> Trial:
    """The ship by Euler's rule at the samples' interval, under the same rudder."""
    trial = zigzag_trial(noisy=False)
    record = zigzag_trial()
    units = np.array([LENGTH, 1.0, LENGTH, LENGTH**2, LENGTH, LENGTH**2])
    per_step = TRUTH * INTERVAL / units
    sway, yaw = per_step.reshape(2, 3)
    v = np.zeros(len(trial))
    r = np.zeros(len(trial))
    for k, delta in enumerate(-trial["delta"][:-1]):
        U = np.hypot(SPEED, v[k])
        terms = np.array([v[k] * U, r[k] * U, delta * U**2])
        v[k + 1] = v[k] + sway @ terms
        r[k + 1] = r[k] + yaw @ terms
    channels = {
        "u": np.full(len(trial), SPEED),
        "v": v,
        "r": r,
        "delta": record["delta"],
    }
    return Trial(trial.t, channels, name=trial.name, kind="zigzag", length=LENGTH)


@cache
def history(method: str, euler: bool = False) -> Floats:
    """The six parameters after each sample by `RLS` or `LSSVR-RLS`, unscaled."""
    estimator = RecursiveLeastSquares(
        C=C_ZERO,
        scale=False,
        start_samples=START_SAMPLES if method == "LSSVR-RLS" else 0,
        start_interval=START_INTERVAL,
        start_C=C_START,
    )
    trial = euler_trial() if euler else zigzag_trial()
    found = [estimator.fit_history(X, y) for X, y in regressions(trial).values()]
    return parameters(*(path.T for path in found)).T


def fluctuation(method: str, euler: bool) -> float:
    """How far a22 moves to and fro from `SETTLED` on, in parts of its value."""
    a22 = history(method, euler)[round(SETTLED / INTERVAL) :, NAMES.index("a22")]
    return float(np.sum(np.abs(np.diff(a22))) / abs(TRUTH[NAMES.index("a22")]))


@cache
def at_best() -> Floats:
    """The six parameters by the same recursion on splines, the state's factor 1."""
    model = identify(
        [zigzag_trial()],
        STRUCTURE,
        RecursiveLeastSquares(
            start_samples=START_SAMPLES, start_interval=START_INTERVAL
        ),
        particulars=ship().particulars,
        steering=ship().steering,
        guarded=False,
        rudder_bias="none",
    ).model
    return np.asarray(np.array(list(model.coefficients.values())) * TO_STARBOARD)


def errors(found: Floats) -> Floats:
    """Relative errors of the six parameters, with their sign, %."""
    return np.asarray(100.0 * (found / TRUTH - 1.0))


def rows() -> Iterator[Row]:
    """Table 7.3.2 on both ships; a22 moves to and fro less where the start helps."""
    best = errors(at_best())
    for euler, case in ((False, "Table 7.3.2"), (True, EULER_CASE)):
        for method, printed in PRINTED.items():
            ours = errors(history(method, euler)[-1])
            for k, name in enumerate(NAMES):
                words = f"{method}: {name}, error, %"
                if euler:
                    yield Row(case, words, None, float(ours[k]))
                else:
                    yield Row(
                        case,
                        words,
                        100.0 * printed[k],
                        float(ours[k]),
                        float(best[k]),
                        *within(WITHIN, best[k]),
                    )
            yield Row(case, f"{method}: {MOVES}", None, fluctuation(method, euler))
