"""The rudder between its samples, rebuilt from the equation of the steering gear.

A rudder ramps, and where its gear has a lag it then creeps up to its order; between
samples a polynomial misses both. The orders, the times at which they changed and, where
not known, the rate and the lag of the gear are found from the samples of the rudder
angle alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, minimize_scalar
from scipy.special import lambertw

from identification.regression.preprocess import is_noisy
from shipgym import SteeringGear, Trial
from shipgym.arrays import Flags, Floats, Integers

TOLERANCE = 1e-3  # of the rudder's range: orders closer than this are one order
RAMP = 1e-4  # a rate within this part of the gear's rate is the gear's rate
EXPLAINED = 0.85  # share of the intervals that the gear has to explain
FEWEST_SAMPLES = 8  # per change of order: with fewer the gear explains noise
USUAL_LIMIT_DEG = 35.0
MOVING = 0.5  # of the fastest move: faster ones are taken for the gear's own rate
FAST_QUANTILE = 0.995  # of the rates of records with noise


@dataclass(frozen=True)
class Rudder:
    """Rudder angle as a function of time, through all samples."""

    #: the samples, s and rad, shape (n_samples,)
    t: Floats
    delta: Floats
    #: of the gear that explains them, rad/s and s; 0 where none does
    rate: float
    time_constant: float
    #: whether a steering gear explains the samples; if not, the rudder is taken
    #: straight between them
    follows_gear: bool
    #: order in the first and second part of each interval, rad; infinite where only its
    #: side is known, shape (n_samples - 1,)
    before: Floats
    after: Floats
    # time from the interval's start at which the order changes, s, shape (n_samples -
    # 1,)
    switch: Floats
    # times at which rate or acceleration of the rudder jump, s, shape (n_corners,)
    corners: Floats
    #: derivatives of the rudder that are continuous there: 0 where the rate jumps, 1
    #: otherwise, shape (n_corners,)
    smoothness: Integers

    def __call__(self, times: ArrayLike) -> Floats:
        """Rudder angle, rad, at times within the samples."""
        times = np.asarray(times, dtype=float)
        if not self.follows_gear:
            return np.asarray(np.interp(times, self.t, self.delta))
        k = np.clip(
            np.searchsorted(self.t, times, side="right") - 1, 0, len(self.t) - 2
        )
        return self._within(k, times - self.t[k])

    def _within(self, k: Integers, elapsed: Floats) -> Floats:
        """The angle some time after the start of intervals."""
        gear, first = (
            (self.rate, self.time_constant),
            np.minimum(elapsed, self.switch[k]),
        )
        middle = _flow(self.delta[k], self.before[k], first, *gear)
        return _flow(middle, self.after[k], elapsed - first, *gear)


def rebuild(t: ArrayLike, delta: ArrayLike, gear: SteeringGear | None = None) -> Rudder:
    """Rebuild the rudder between samples, s and rad, of shape (n_samples,).

    A given gear is tried first; one estimated from the samples takes its place where it
    explains them better.
    """
    t, delta = np.asarray(t, dtype=float), np.asarray(delta, dtype=float)
    given = [] if gear is None else [(gear.rate, gear.time_constant)]
    candidates = [*given, estimate_gear(t, delta)]
    shares = [_explained(t, delta, *candidate) for candidate in candidates]
    rate, lag = candidates[int(np.argmax(shares))]
    if max(shares) >= EXPLAINED:
        rudder = _with_gear(t, delta, rate, lag)
        ends = rudder._within(np.arange(len(t) - 1), np.diff(t))
        reproduced = np.all(np.abs(ends - delta[1:]) <= TOLERANCE * np.ptp(delta))
        if reproduced and FEWEST_SAMPLES * np.sum(rudder.smoothness == 0) <= len(t):
            return rudder
    return straight(t, delta)


def straight(t: Floats, delta: Floats) -> Rudder:
    """The rudder taken straight between its samples, for records with noise."""
    none = np.zeros(0)
    return Rudder(
        t, delta, 0.0, 0.0, False, none, none, none, none, none.astype(np.int64)
    )


def estimate_gear(t: Floats, delta: Floats) -> tuple[float, float]:
    """Rate, rad/s, and time constant, s, of a gear from exact samples of its rudder, s and rad.

    The rate is the largest that occurs; the time constant, 0 for a gear of constant
    rate, the one for which the order is steadiest.
    """
    steps = np.diff(t)
    rates = np.abs(np.diff(delta)) / steps
    fastest = float(rates.max())
    if fastest == 0.0:
        return 0.0, 0.0
    rate = float(np.median(rates[rates >= (1.0 - RAMP) * fastest]))
    tolerance = TOLERANCE * np.ptp(delta)

    def unsteadiness(lag: float) -> float:
        with np.errstate(invalid="ignore"):  # between two ramps
            jumps = np.abs(np.diff(_orders(t, delta, rate, lag)))
        return float(
            np.minimum(np.where(np.isfinite(jumps), jumps, 0.0), 10 * tolerance).sum()
        )

    lags = (np.geomspace(0.1, 20.0, 48) * float(np.median(steps))).tolist()
    best = int(np.argmin([unsteadiness(lag) for lag in lags]))
    low, high = lags[max(best - 1, 0)], lags[min(best + 1, len(lags) - 1)]
    refined = minimize_scalar(
        unsteadiness,
        bounds=(low, high),
        method="bounded",
        options={"xatol": 1e-10 * high},
    )
    return rate, 0.0 if unsteadiness(0.0) <= 1.01 * refined.fun else float(refined.x)


def _flow(start: Any, order: Any, elapsed: Any, rate: float, lag: float) -> Floats:
    """Rudder of a gear a time after `start` under one order (infinite: still ramping)."""
    distance = np.abs(order - start)
    side = np.sign(order - start)
    tail = np.minimum(
        distance, rate * lag
    )  # what is left when the lag takes over from the ramp
    ramping = np.minimum(elapsed, (distance - tail) / rate)
    decay = np.exp(-(elapsed - ramping) / lag) if lag > 0.0 else 1.0
    moved = rate * ramping + np.where(ramping < elapsed, tail * (1.0 - decay), 0.0)
    return np.asarray(start + side * moved)


def _orders(t: Floats, delta: Floats, rate: float, lag: float) -> Floats:
    """The single order that explains each interval; infinite where the rudder ramps all the way."""
    steps, move = np.diff(t), np.diff(delta)
    size, side = np.abs(move), np.sign(move)
    distance = size / -np.expm1(-steps / lag) if lag > 0.0 else size
    far = distance > rate * lag
    if lag > 0.0 and np.any(far):
        # the ramp lasts x seconds, of x - lag exp((x - step) / lag) = size / rate - lag
        short = size[far] / rate - lag
        ramping = (
            short
            - lag
            * lambertw(-np.exp(np.minimum((short - steps[far]) / lag, -1.0)), 0).real
        )
        distance[far] = rate * (ramping + lag)
    ramps = size >= (1.0 - RAMP) * rate * steps
    return np.where(ramps, np.copysign(np.inf, move), delta[:-1] + side * distance)


def _continues(orders: Floats, delta: Floats, tolerance: float) -> Flags:
    """Whether each interval but the first can be under the order of the one before it."""
    before, now, at = orders[:-1], orders[1:], delta[1:-1]
    ramped, ramps = np.isinf(before), np.isinf(now)
    same = (
        np.abs(np.where(ramps, 0.0, now) - np.where(ramped, 0.0, before)) <= tolerance
    )
    ahead = np.where(
        ramps, np.sign(now), np.sign(np.where(ramps, 0.0, now) - at)
    ) * np.sign(before)
    return np.where(ramped, np.where(ramps, now == before, ahead >= 0), ~ramps & same)


def _explained(t: Floats, delta: Floats, rate: float, lag: float) -> float:
    """Share of the intervals that go on under the order before them."""
    if rate == 0.0 or len(t) < 4:
        return 0.0
    return float(
        np.mean(
            _continues(_orders(t, delta, rate, lag), delta, TOLERANCE * np.ptp(delta))
        )
    )


def _with_gear(t: Floats, delta: Floats, rate: float, lag: float) -> Rudder:
    steps = np.diff(t)
    orders = _orders(t, delta, rate, lag)
    follows = np.concatenate(
        [[True], _continues(orders, delta, TOLERANCE * np.ptp(delta)), [True]]
    )
    before, after, switch = orders.copy(), orders.copy(), steps.copy()
    corners: list[tuple[float, int]] = []
    for k in np.flatnonzero(~follows[:-1]).tolist():
        if follows[k + 1] and not np.isinf(orders[k]):
            corners.append((float(t[k]), 0))  # the order changed on the sample
            continue
        if not follows[k - 1] and k > 1:
            continue  # the end of a change inside the interval before
        following = orders[min(k + 1, len(orders) - 1)]
        time = _switch_time(
            delta[k], delta[k + 1], orders[k - 1], following, steps[k], rate, lag
        )
        if time is not None:
            before[k], after[k], switch[k] = orders[k - 1], following, time
        corners.append((float(t[k] + (time or 0.0)), 0))
    corners += _ramp_ends(t, delta, before, after, switch, rate, lag)
    corners = [corner for corner in sorted(corners) if t[0] < corner[0] < t[-1]]
    times, smoothness = np.reshape(corners, (-1, 2)).T
    return Rudder(
        t,
        delta,
        rate,
        lag,
        True,
        before,
        after,
        switch,
        times,
        smoothness.astype(np.int64),
    )


def _switch_time(
    start: float,
    end: float,
    first: float,
    second: float,
    step: float,
    rate: float,
    lag: float,
) -> float | None:
    """Time at which one order has to be replaced by another to go from start to end; None if never."""

    def miss(time: float) -> float:
        return (
            float(
                _flow(
                    _flow(start, first, time, rate, lag), second, step - time, rate, lag
                )
            )
            - end
        )

    if miss(0.0) * miss(step) > 0.0:
        return None
    return float(brentq(miss, 0.0, step, xtol=1e-15 * step))


def _ramp_ends(
    t: Floats,
    delta: Floats,
    before: Floats,
    after: Floats,
    switch: Floats,
    rate: float,
    lag: float,
) -> list[tuple[float, int]]:
    """Times at which a ramp ends inside an interval, with the smoothness there."""
    middle = _flow(delta[:-1], before, switch, rate, lag)
    ends: list[tuple[float, int]] = []
    parts = (
        (delta[:-1], before, t[:-1], switch),
        (middle, after, t[:-1] + switch, np.diff(t) - switch),
    )
    for start, order, begin, length in parts:
        ramp = (np.abs(order - start) - rate * lag) / rate
        inside = (ramp > 1e-9) & (ramp < length)
        ends += [(float(time), int(lag > 0.0)) for time in (begin + ramp)[inside]]
    return ends


def estimated_gear(trials: Sequence[Trial]) -> SteeringGear:
    """Limit, rate and lag of a steering gear from the rudder angles of trials.

    The limit is 35 degrees or the largest angle recorded. Rate and lag are those that
    explain records without noise exactly; records with noise give the median rate of
    the fast moves, and no lag.
    """
    limit = max(
        USUAL_LIMIT_DEG,
        *(float(np.degrees(np.abs(trial["delta"]).max())) for trial in trials),
    )
    clean = [t for t in trials if not is_noisy(t.t, (t[channel] for channel in "uvr"))]
    rudders = [rebuild(trial.t, trial["delta"]) for trial in clean]
    exact = [
        (rudder.rate, rudder.time_constant) for rudder in rudders if rudder.follows_gear
    ]
    if exact:
        rate, lag = np.median(exact, axis=0).tolist()
    else:
        rates = np.concatenate(
            [np.abs(np.diff(trial["delta"])) / np.diff(trial.t) for trial in trials]
        )
        fastest = float(np.quantile(rates[rates > 0.0], FAST_QUANTILE))
        rate, lag = float(np.median(rates[rates >= MOVING * fastest])), 0.0
    return SteeringGear(min(limit, 90.0), float(np.degrees(rate)), lag)
