"""The rudder between its samples, rebuilt from the equation of the steering gear.

A rudder ramps, and where its gear has a lag it then creeps up to its order; between
samples a polynomial misses both. The orders, the times at which they changed and, where
not known, the rate and the lag of the gear are found from the samples of the rudder
angle alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from identification.regression.gear_response import (
    TOLERANCE,
    GearResponse,
    estimate_gear,
    goes_on,
)
from identification.regression.preprocess import is_noisy
from shipgym import SteeringGear, Trial
from shipgym.arrays import Floats, Integers


@dataclass(frozen=True)
class Rudder:
    """Rudder angle as a function of time, through all samples.

    Attributes
    ----------
    t, delta : array of shape (n_samples,)
        The samples, s and rad.
    rate, time_constant : float
        Of the gear that explains them, rad/s and s; 0 where none does.
    follows_gear : bool
        Whether a steering gear explains the samples; if not, the rudder is taken
        straight between them.
    before, after : array of shape (n_samples - 1,)
        Order in the first and second part of each interval, rad; infinite where only
        its side is known.
    switch : array of shape (n_samples - 1,)
        Time from the interval's start at which the order changes, s.
    corners : array of shape (n_corners,)
        Times at which rate or acceleration of the rudder jump, s.
    smoothness : array of shape (n_corners,)
        Derivatives of the rudder that are continuous there: 0 where the rate jumps, 1
        otherwise.
    """

    t: Floats
    delta: Floats
    rate: float
    time_constant: float
    follows_gear: bool
    before: Floats
    after: Floats
    switch: Floats
    corners: Floats
    smoothness: Integers

    def __call__(self, times: ArrayLike) -> Floats:
        """Rudder angle, rad, at times within the samples."""
        times = np.asarray(times, dtype=float)
        if not self.follows_gear:
            return np.asarray(np.interp(times, self.t, self.delta))
        following = np.searchsorted(self.t, times, side="right")
        interval = np.clip(following - 1, 0, len(self.t) - 2)
        return self.within(interval, times - self.t[interval])

    def within(self, interval: Integers, elapsed: Floats) -> Floats:
        """Angle, rad, some time after the start of intervals."""
        gear = GearResponse(self.rate, self.time_constant)
        first_part = np.minimum(elapsed, self.switch[interval])
        at_switch = gear.angle(self.delta[interval], self.before[interval], first_part)
        return gear.angle(at_switch, self.after[interval], elapsed - first_part)


def rebuild(t: ArrayLike, delta: ArrayLike, gear: SteeringGear | None = None) -> Rudder:
    """Rebuild the rudder between samples, s and rad, of shape (n_samples,).

    A given gear is tried first; one estimated from the samples takes its place where it
    explains them better. A gear has to explain 85 % of the intervals, reproduce all
    samples, and leave eight samples for each change of its order: with fewer it
    explains noise.
    """
    t, delta = np.asarray(t, dtype=float), np.asarray(delta, dtype=float)
    candidates = [estimate_gear(t, delta)]
    if gear is not None:
        candidates.insert(0, GearResponse(gear.rate, gear.time_constant))
    shares = [candidate.explained_share(t, delta) for candidate in candidates]
    best = int(np.argmax(shares))
    if shares[best] < 0.85:
        return straight(t, delta)

    rudder = _with_gear(t, delta, candidates[best])
    ends = rudder.within(np.arange(len(t) - 1), np.diff(t))
    missed = np.abs(ends - delta[1:]).max()
    n_changes = int(np.sum(rudder.smoothness == 0))
    if missed > TOLERANCE * np.ptp(delta) or 8 * n_changes > len(t):
        return straight(t, delta)
    return rudder


def straight(t: Floats, delta: Floats) -> Rudder:
    """The rudder taken straight between its samples, for records with noise."""
    none = np.zeros(0)
    return Rudder(
        t=t,
        delta=delta,
        rate=0.0,
        time_constant=0.0,
        follows_gear=False,
        before=none,
        after=none,
        switch=none,
        corners=none,
        smoothness=none.astype(np.int64),
    )


class _Corner(NamedTuple):
    """A time at which rate (smoothness 0) or acceleration (1) of the rudder jumps."""

    time: float
    smoothness: int


def _with_gear(t: Floats, delta: Floats, gear: GearResponse) -> Rudder:
    """The rudder of a gear, with the changes of its order."""
    orders = gear.orders(t, delta)
    continues = goes_on(orders, delta).tolist()
    follows = [True, *continues, True]  # each interval the one before it
    before, after = orders.copy(), orders.copy()
    switch = np.diff(t)
    corners: list[_Corner] = []
    for k, is_continued in enumerate(follows[:-1]):
        if is_continued:
            continue
        if follows[k + 1] and not np.isinf(orders[k]):
            corners.append(_Corner(float(t[k]), 0))  # the order changed on the sample
            continue
        if k > 1 and not follows[k - 1]:
            continue  # the end of a change inside the interval before

        following = orders[min(k + 1, len(orders) - 1)]
        time = _switch_time(gear, delta[k : k + 2], orders[k - 1], following, switch[k])
        if time is not None:
            before[k], after[k] = orders[k - 1], following
            switch[k] = time
        corners.append(_Corner(float(t[k] + (time or 0.0)), 0))

    corners += _ramp_ends(gear, t, delta, before, after, switch)
    inside = [corner for corner in sorted(corners) if t[0] < corner.time < t[-1]]
    return Rudder(
        t=t,
        delta=delta,
        rate=gear.rate,
        time_constant=gear.lag,
        follows_gear=True,
        before=before,
        after=after,
        switch=switch,
        corners=np.array([corner.time for corner in inside]),
        smoothness=np.array([corner.smoothness for corner in inside], dtype=np.int64),
    )


def _switch_time(
    gear: GearResponse, ends: Floats, first: float, second: float, step: float
) -> float | None:
    """Time at which one order has to follow another to go from end to end; None if never."""
    start, end = ends

    def miss(time: float) -> float:
        at_switch = gear.angle(start, first, time)
        return float(gear.angle(at_switch, second, step - time) - end)

    if miss(0.0) * miss(step) > 0.0:
        return None
    return float(brentq(miss, 0.0, step, xtol=1e-15 * step))


def _ramp_ends(
    gear: GearResponse,
    t: Floats,
    delta: Floats,
    before: Floats,
    after: Floats,
    switch: Floats,
) -> list[_Corner]:
    """Times at which a ramp ends inside an interval."""
    at_switch = gear.angle(delta[:-1], before, switch)
    rest = np.diff(t) - switch
    first = _ends_of_ramps(gear, t[:-1], delta[:-1], before, switch)
    second = _ends_of_ramps(gear, t[:-1] + switch, at_switch, after, rest)
    smoothness = int(gear.lag > 0.0)
    return [_Corner(float(time), smoothness) for time in (*first, *second)]


def _ends_of_ramps(
    gear: GearResponse, begin: Floats, start: Floats, order: Floats, length: Floats
) -> Floats:
    """Times at which ramps end, of those that end within their part of an interval."""
    by_ramp = np.abs(order - start) - gear.rate * gear.lag
    ramp = by_ramp / gear.rate
    inside = (ramp > 1e-9) & (ramp < length)
    return (begin + ramp)[inside]


def estimated_gear(trials: Sequence[Trial]) -> SteeringGear:
    """Limit, rate and lag of a steering gear from the rudder angles of trials.

    The limit is 35 degrees or the largest angle recorded. Rate and lag are those that
    explain records without noise exactly; records with noise give the median rate of
    the fast moves, and no lag.
    """
    largest = max(float(np.abs(trial["delta"]).max()) for trial in trials)
    limit_deg = min(max(35.0, float(np.degrees(largest))), 90.0)

    exact = []
    for trial in trials:
        if not is_noisy(trial.t, [trial[name] for name in ("u", "v", "r")]):
            rudder = rebuild(trial.t, trial["delta"])
            if rudder.follows_gear:
                exact.append((rudder.rate, rudder.time_constant))
    if exact:
        rate, lag = np.median(exact, axis=0).tolist()
    else:
        rate, lag = _usual_rate(trials), 0.0
    return SteeringGear(limit_deg, float(np.degrees(rate)), lag)


def _usual_rate(trials: Sequence[Trial]) -> float:
    """Median of the rates at which rudders of records with noise move fast, rad/s."""
    rates = np.concatenate(
        [np.abs(np.diff(trial["delta"])) / np.diff(trial.t) for trial in trials]
    )
    fastest = float(np.quantile(rates[rates > 0.0], 0.995))
    return float(np.median(rates[rates >= 0.5 * fastest]))
