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

from identification.samples.gear_response import (
    TOLERANCE,
    GearResponse,
    estimate_gear,
    goes_on,
)
from identification.samples.preprocess import is_noisy
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
        last = len(self.t) - 2
        interval = np.clip(following - 1, 0, last)
        elapsed = times - self.t[interval]
        return self.within(interval, elapsed)

    def within(self, interval: Integers, elapsed: Floats) -> Floats:
        """Angle, rad, some time after the start of intervals."""
        gear = GearResponse(self.rate, self.time_constant)
        first_part = np.minimum(elapsed, self.switch[interval])
        at_switch = gear.angle(
            start=self.delta[interval],
            order=self.before[interval],
            elapsed=first_part,
        )
        return gear.angle(
            start=at_switch,
            order=self.after[interval],
            elapsed=elapsed - first_part,
        )


def rebuild(t: ArrayLike, delta: ArrayLike, gear: SteeringGear | None = None) -> Rudder:
    """Rebuild the rudder between samples, s and rad, of shape (n_samples,).

    A given gear is tried first; one estimated from the samples takes its place where it
    explains them better. A gear has to explain 85 % of the intervals, reproduce all
    samples, and leave eight samples for each change of its order: with fewer it
    explains noise.
    """
    t = np.asarray(t, dtype=float)
    delta = np.asarray(delta, dtype=float)
    response = estimate_gear(t, delta)
    share = response.explained_share(t, delta)
    if gear is not None:
        given = GearResponse(gear.rate, gear.time_constant)
        given_share = given.explained_share(t, delta)
        if given_share >= share:
            response = given
            share = given_share
    if share < 0.85:
        return straight(t, delta)

    rudder = _with_gear(t, delta, response)
    n_changes = int(np.sum(rudder.smoothness == 0))
    if not _reproduces_samples(rudder) or 8 * n_changes > len(t):
        return straight(t, delta)
    return rudder


def _reproduces_samples(rudder: Rudder) -> bool:
    """Whether each interval ends where the next one starts."""
    steps = np.diff(rudder.t)
    intervals = np.arange(len(steps))
    ends = rudder.within(intervals, steps)
    misses = np.abs(ends - rudder.delta[1:])
    allowed = TOLERANCE * np.ptp(rudder.delta)
    return bool(misses.max() <= allowed)


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


class _Orders(NamedTuple):
    """Orders of the intervals, as of `Rudder`."""

    before: Floats
    after: Floats
    switch: Floats


def _with_gear(t: Floats, delta: Floats, gear: GearResponse) -> Rudder:
    """The rudder of a gear, with the changes of its order."""
    orders, corners = _changing_orders(t, delta, gear)
    corners += _ramp_ends(gear, t, delta, orders)
    inside = [corner for corner in sorted(corners) if t[0] < corner.time < t[-1]]
    times = [corner.time for corner in inside]
    smoothness = [corner.smoothness for corner in inside]
    return Rudder(
        t=t,
        delta=delta,
        rate=gear.rate,
        time_constant=gear.lag,
        follows_gear=True,
        before=orders.before,
        after=orders.after,
        switch=orders.switch,
        corners=np.array(times),
        smoothness=np.array(smoothness, dtype=np.int64),
    )


def _changing_orders(
    t: Floats, delta: Floats, gear: GearResponse
) -> tuple[_Orders, list[_Corner]]:
    """Orders of the intervals, and the corners where they change."""
    orders = gear.orders(t, delta)
    continues = goes_on(orders, delta).tolist()
    follows = [True, *continues, True]  # each interval the one before it
    found = _Orders(
        before=orders.copy(),
        after=orders.copy(),
        switch=np.diff(t),
    )
    corners: list[_Corner] = []
    for k, is_continued in enumerate(follows[:-1]):
        if is_continued:
            continue
        time = float(t[k])
        follows_on = follows[k + 1]
        if follows_on and not np.isinf(orders[k]):
            corners.append(_Corner(time, 0))  # the order changed on the sample
            continue
        if k > 1 and not follows[k - 1]:
            continue  # the end of a change inside the interval before

        first = orders[k - 1]
        second = orders[min(k + 1, len(orders) - 1)]
        elapsed = _switch_time(
            gear,
            start=delta[k],
            end=delta[k + 1],
            first=first,
            second=second,
            step=found.switch[k],
        )
        if elapsed is not None:
            found.before[k] = first
            found.after[k] = second
            found.switch[k] = elapsed
            time = float(t[k] + elapsed)
        corners.append(_Corner(time, 0))
    return found, corners


def _switch_time(
    gear: GearResponse,
    start: float,
    end: float,
    first: float,
    second: float,
    step: float,
) -> float | None:
    """Time at which a second order has to follow the first to reach the end in a step.

    None if it never does.
    """

    def miss(elapsed: float) -> float:
        at_switch = gear.angle(start, first, elapsed)
        reached = gear.angle(at_switch, second, step - elapsed)
        return float(reached - end)

    if miss(0.0) * miss(step) > 0.0:
        return None
    return float(brentq(miss, 0.0, step, xtol=1e-15 * step))


def _ramp_ends(
    gear: GearResponse,
    t: Floats,
    delta: Floats,
    orders: _Orders,
) -> list[_Corner]:
    """Times at which a ramp ends inside an interval."""
    begins = t[:-1]
    starts = delta[:-1]
    switch = orders.switch
    first = _ends_of_ramps(
        gear,
        begin=begins,
        start=starts,
        order=orders.before,
        length=switch,
    )
    second = _ends_of_ramps(
        gear,
        begin=begins + switch,
        start=gear.angle(starts, orders.before, switch),
        order=orders.after,
        length=np.diff(t) - switch,
    )
    smoothness = int(gear.lag > 0.0)
    return [_Corner(float(time), smoothness) for time in (*first, *second)]


def _ends_of_ramps(
    gear: GearResponse,
    begin: Floats,
    start: Floats,
    order: Floats,
    length: Floats,
) -> Floats:
    """Times at which ramps end, of those that end within their part of an interval."""
    distance = np.abs(order - start)
    by_ramp = distance - gear.rate * gear.lag
    ramp = by_ramp / gear.rate
    inside = (ramp > 1e-9) & (ramp < length)
    ends = begin + ramp
    return ends[inside]


def estimated_gear(trials: Sequence[Trial]) -> SteeringGear:
    """Limit, rate and lag of a steering gear from the rudder angles of trials.

    The limit is 35 degrees or the largest angle recorded. Rate and lag are those that
    explain records without noise exactly; records with noise give the median rate of
    the fast moves, and no lag.
    """
    largest = max(np.abs(trial["delta"]).max() for trial in trials)
    largest_deg = float(np.degrees(largest))
    limit_deg = min(max(35.0, largest_deg), 90.0)

    exact = _exact_gears(trials)
    if exact:
        rate, lag = np.median(exact, axis=0).tolist()
    else:
        rate = _usual_rate(trials)
        lag = 0.0
    rate_deg = float(np.degrees(rate))
    return SteeringGear(limit_deg, rate_deg, lag)


def _exact_gears(trials: Sequence[Trial]) -> list[GearResponse]:
    """Gears that explain the rudders of records without noise."""
    found = []
    for trial in trials:
        velocities = [trial[name] for name in ("u", "v", "r")]
        if is_noisy(trial.t, velocities):
            continue
        rudder = rebuild(trial.t, trial["delta"])
        if rudder.follows_gear:
            gear = GearResponse(rudder.rate, rudder.time_constant)
            found.append(gear)
    return found


def _usual_rate(trials: Sequence[Trial]) -> float:
    """Median of the rates at which rudders of records with noise move fast, rad/s."""
    by_trial = []
    for trial in trials:
        moves = np.diff(trial["delta"])
        steps = np.diff(trial.t)
        by_trial.append(np.abs(moves) / steps)
    rates = np.concatenate(by_trial)

    moving = rates[rates > 0.0]
    fastest = float(np.quantile(moving, 0.995))
    is_fast = rates >= 0.5 * fastest
    return float(np.median(rates[is_fast]))
