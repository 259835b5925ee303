"""The rudder between its samples, rebuilt from the equation of the steering gear.

A rudder ramps, and where its gear has a lag it then creeps up to its order; between
samples a polynomial misses both. The orders, the times at which they changed and, where
not known, the rate and the lag of the gear are found from the samples of the rudder
angle alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass

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
    t, delta : array of shape (n_pieces,)
        Times at which pieces begin, s, and the angle there, rad: those of the samples,
        and of changes of the order between them; last the last sample.
    orders : array of shape (n_pieces,)
        Order of each piece, rad; infinite where only its side is known.
    gear : GearResponse or None
        The gear that explains the samples; None where none does: the rudder is then
        taken straight between its samples.
    corners : array of shape (n_corners,)
        Times at which rate or acceleration of the rudder jump, s.
    smoothness : array of shape (n_corners,)
        Derivatives of the rudder that are continuous there: 0 where the rate jumps, 1
        otherwise.
    """

    t: Floats
    delta: Floats
    orders: Floats
    gear: GearResponse | None
    corners: Floats
    smoothness: Integers

    def __call__(self, times: ArrayLike) -> Floats:
        """Rudder angle, rad, at times within the samples."""
        times = np.asarray(times, dtype=float)
        if self.gear is None:
            return np.asarray(np.interp(times, self.t, self.delta))
        piece = np.maximum(np.searchsorted(self.t, times, side="right") - 1, 0)
        return self.gear.angle(
            self.delta[piece], self.orders[piece], times - self.t[piece]
        )


def rebuild(t: ArrayLike, delta: ArrayLike, gear: SteeringGear | None = None) -> Rudder:
    """Rebuild the rudder between samples, s and rad, of shape (n_samples,).

    A given gear is tried first; one estimated from the samples takes its place where it
    explains them better. A gear has to explain 85 % of the intervals, reproduce all
    samples, and leave eight samples for each change of its order: with fewer it
    explains noise.
    """
    t = np.asarray(
        t,
        dtype=float,
    )
    delta = np.asarray(delta, dtype=float)
    candidates = [estimate_gear(t, delta)]
    if gear is not None:
        candidates.insert(0, GearResponse(gear.rate, gear.time_constant))
    shares = [response.explained_share(t, delta) for response in candidates]
    if max(shares) < 0.85:
        return straight(t, delta)

    rudder = _with_gear(t, delta, candidates[int(np.argmax(shares))])
    n_changes = int(np.sum(rudder.smoothness == 0))
    if not _reproduces_samples(rudder) or 8 * n_changes > len(t):
        return straight(t, delta)
    return rudder


def _reproduces_samples(rudder: Rudder) -> bool:
    """Whether each piece ends where the next one starts."""
    assert rudder.gear is not None
    ends = rudder.gear.angle(
        rudder.delta,
        rudder.orders,
        np.diff(rudder.t, append=0.0),
    )
    misses = np.abs(ends[:-1] - rudder.delta[1:])
    return bool(misses.max() <= TOLERANCE * np.ptp(rudder.delta))


def straight(t: Floats, delta: Floats) -> Rudder:
    """The rudder taken straight between its samples, for records with noise."""
    none = np.zeros(0)
    return Rudder(t, delta, none, None, none, none.astype(int))


def _with_gear(t: Floats, delta: Floats, gear: GearResponse) -> Rudder:
    """The rudder of a gear, with the changes of its order."""
    orders = gear.orders(t, delta)
    continues = goes_on(orders, delta).tolist()
    follows = [True, *continues, True]  # each interval the one before it
    pieces: list[tuple[float, float, float]] = []
    corners: list[tuple[float, int]] = []
    for k, order in enumerate(orders.tolist()):
        begin, start = float(t[k]), float(delta[k])
        pieces.append((begin, start, order))
        # an order that changed on the sample goes on; a change in the interval before
        # ends in this one
        on_sample = follows[k + 1] and not np.isinf(order)
        if follows[k] or (k > 1 and not follows[k - 1] and not on_sample):
            continue
        first, second = orders[k - 1], orders[min(k + 1, len(orders) - 1)]
        elapsed = None
        if not on_sample:
            ends = float(t[k + 1] - t[k]), float(delta[k + 1])
            elapsed = _switch_time(
                gear,
                start,
                (first, second),
                *ends,
            )
        if elapsed is not None:
            pieces[-1] = (begin, start, first)
            at_switch = float(
                gear.angle(
                    start,
                    first,
                    elapsed,
                )
            )
            begin += elapsed
            pieces.append((begin, at_switch, second))
        corners.append((begin, 0))

    pieces.append((float(t[-1]), float(delta[-1]), float(orders[-1])))
    begins, starts, ordered = np.array(pieces).T
    with np.errstate(invalid="ignore"):
        ramps = (np.abs(ordered - starts) - gear.rate * gear.lag) / gear.rate
    ending = (ramps > 1e-9) & (
        ramps
        < np.diff(
            begins,
            append=begins[-1],
        )
    )
    ends = begins[ending] + ramps[ending]
    corners += [(time, int(gear.lag > 0.0)) for time in ends.tolist()]
    inside = [corner for corner in sorted(corners) if t[0] < corner[0] < t[-1]]
    times, smoothness = zip(*inside, strict=True) if inside else ((), ())
    return Rudder(
        begins, starts, ordered, gear, np.array(times), np.array(smoothness, dtype=int)
    )


def _switch_time(
    gear: GearResponse,
    start: float,
    orders: tuple[float, float],
    step: float,
    end: float,
) -> float | None:
    """Time at which a second order has to follow the first to reach the end in a step.

    None if it never does.
    """
    first, second = orders

    def miss(elapsed: float) -> float:
        at_switch = gear.angle(start, first, elapsed)
        return float(gear.angle(at_switch, second, step - elapsed) - end)

    if miss(0.0) * miss(step) > 0.0:
        return None
    return float(brentq(miss, 0.0, step, xtol=1e-15 * step))


def estimated_gear(trials: Sequence[Trial]) -> SteeringGear:
    """Limit, rate and lag of a steering gear from the rudder angles of trials.

    The limit is 35 degrees or the largest angle recorded. Rate and lag are those that
    explain records without noise exactly; records with noise give the median rate of
    the fast moves, and no lag.
    """
    largest = max(np.abs(trial["delta"]).max() for trial in trials)
    largest_deg = float(np.degrees(largest))
    limit_deg = min(max(35.0, largest_deg), 90.0)

    exact = []
    for trial in trials:
        if not is_noisy(trial.t, [trial[name] for name in ("u", "v", "r")]):
            exact.append(rebuild(trial.t, trial["delta"]).gear)
    known = [gear for gear in exact if gear is not None]
    if known:
        rate, lag = np.median(
            known,
            axis=0,
        ).tolist()
    else:
        rate, lag = _usual_rate(trials), 0.0
    return SteeringGear(limit_deg, float(np.degrees(rate)), lag)


def _usual_rate(trials: Sequence[Trial]) -> float:
    """Median of the rates at which rudders of records with noise move fast, rad/s."""
    rates = np.concatenate(
        [np.abs(np.diff(trial["delta"]) / np.diff(trial.t)) for trial in trials]
    )
    fastest = np.quantile(rates[rates > 0.0], 0.995)
    return float(np.median(rates[rates >= 0.5 * fastest]))
