"""The rudder between its samples, rebuilt from the equation of the steering gear.

A rudder ramps, and where its gear has a lag it then creeps up to its order; between
samples a polynomial misses both. The orders, the times at which they changed and, where
not known, the rate and the lag of the gear are found from the samples of the rudder
angle alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, minimize_scalar
from scipy.special import lambertw

from identification.samples.preprocess import is_noisy
from shipgym import SteeringGear, Trial
from shipgym.arrays import Flags, Floats, Integers
from shipgym.trials.resampling import usual_step

RAMP = 1e-4  # a rate within this part of the gear's rate is the gear's rate
TOLERANCE = 1e-3  # of the rudder's range: orders closer than this are one order


class GearResponse(NamedTuple):
    """Rate and lag of a steering gear."""

    rate: float  # rad/s; 0 for a rudder that never moved
    lag: float  # time constant, s; 0 for a gear of constant rate

    def angle(self, start: Any, order: Any, elapsed: Any) -> Floats:
        """Rudder some time after `start` under one order, rad.

        Under an infinite order it ramps on.
        """
        move = order - start
        distance = np.abs(move)
        by_lag = np.minimum(distance, self.rate * self.lag)
        by_ramp = distance - by_lag
        ramping = np.minimum(elapsed, by_ramp / self.rate)

        # the last of the way decays
        creeping = elapsed - ramping
        decayed = 1.0
        if self.lag > 0.0:
            decayed = 1.0 - np.exp(-creeping / self.lag)
        crept = np.where(creeping > 0.0, by_lag * decayed, 0.0)

        travelled = self.rate * ramping + crept
        return np.asarray(start + np.sign(move) * travelled)

    def orders(self, t: Floats, delta: Floats) -> Floats:
        """The single order that explains each interval between samples, rad.

        Infinite where the rudder ramps all the way. Shape (n_samples - 1,).
        """
        steps = np.diff(t)
        moves = np.diff(delta)
        sizes = np.abs(moves)
        distances = self._distances(steps, sizes)
        orders = delta[:-1] + np.sign(moves) * distances

        # the end of a ramp is not known
        longest_ramps = (1.0 - RAMP) * self.rate * steps
        ramps_on = sizes >= longest_ramps
        directions = moves[ramps_on]
        orders[ramps_on] = np.copysign(np.inf, directions)
        return orders

    def _distances(self, steps: Floats, sizes: Floats) -> Floats:
        """Distance to the order at the start of intervals, from durations and moves."""
        rate, lag = self
        if lag == 0.0:
            return sizes
        decayed = -np.expm1(-steps / lag)
        distances = sizes / decayed
        far = distances > rate * lag
        if not np.any(far):
            return distances

        # the ramp lasts x s, of x - lag exp((x - step) / lag) = size / rate - lag
        short = sizes[far] / rate - lag
        exponent = np.minimum((short - steps[far]) / lag, -1.0)
        root = lambertw(-np.exp(exponent), 0).real
        ramping = short - lag * root
        distances[far] = rate * (ramping + lag)
        return distances

    def explained_share(self, t: Floats, delta: Floats) -> float:
        """Share of the intervals that continue under the order before them."""
        if self.rate == 0.0 or len(t) < 4:
            return 0.0
        orders = self.orders(t, delta)
        is_explained = goes_on(orders, delta)
        return float(np.mean(is_explained))


def goes_on(orders: Floats, delta: Floats) -> Flags:
    """Flags of intervals that can be under the order of the one before them.

    The first is left out. Shape (n_samples - 2,), of orders of shape (n_samples - 1,).
    """
    before = orders[:-1]
    now = orders[1:]
    was_ramping = np.isinf(before)
    is_ramping = np.isinf(now)
    same_ramp = is_ramping & (now == before)

    # a ramp arrives at an order that lies ahead of where the intervals meet
    to_go = now - delta[1:-1]
    is_ahead = np.sign(to_go) * np.sign(before) >= 0.0
    arrives = was_ramping & ~is_ramping & is_ahead

    with np.errstate(invalid="ignore"):  # between two ramps
        apart = np.abs(now - before)
        is_near = apart <= TOLERANCE * np.ptp(delta)
    same_order = ~was_ramping & ~is_ramping & is_near

    continues: Flags = same_ramp | arrives | same_order
    return continues


def estimate_gear(t: Floats, delta: Floats) -> GearResponse:
    """Rate and lag of a gear from exact samples of its rudder, s and rad.

    The rate is the largest that occurs; the lag, 0 for a gear of constant rate, the one
    for which the order is steadiest.
    """
    steps = np.diff(t)
    rates = np.abs(np.diff(delta)) / steps
    fastest = float(rates.max())
    if fastest == 0.0:
        return GearResponse(0.0, 0.0)

    is_ramp = rates >= (1.0 - RAMP) * fastest
    rate = float(np.median(rates[is_ramp]))
    largest_jump = 10.0 * TOLERANCE * np.ptp(delta)

    def unsteadiness(lag: float) -> float:
        gear = GearResponse(rate, lag)
        orders = gear.orders(t, delta)
        with np.errstate(invalid="ignore"):  # between two ramps
            jumps = np.abs(np.diff(orders))
        jumps[~np.isfinite(jumps)] = 0.0
        bounded = np.minimum(jumps, largest_jump)
        return float(bounded.sum())

    lag = _steadiest_lag(unsteadiness, usual_step=float(np.median(steps)))
    return GearResponse(rate, lag)


def _steadiest_lag(
    unsteadiness: Callable[[float], float],
    usual_step: float,
) -> float:
    """Lag of the least unsteadiness of the order; 0 where that does nearly as well."""
    lags = np.geomspace(0.1, 20.0, 48) * usual_step
    costs = [unsteadiness(lag) for lag in lags]
    best = int(np.argmin(costs))
    low = lags[max(best - 1, 0)]
    high = lags[min(best + 1, len(lags) - 1)]
    refined = minimize_scalar(
        unsteadiness,
        bounds=(low, high),
        method="bounded",
        options={"xatol": 1e-10 * high},
    )
    if unsteadiness(0.0) <= 1.01 * refined.fun:
        return 0.0
    return float(refined.x)


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
    the fast moves, and the lag with which these settle.
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
        rate = _usual_rate(trials)
        lag = _settling_lag(trials, rate)
    return SteeringGear(limit_deg, float(np.degrees(rate)), lag)


def _usual_rate(trials: Sequence[Trial]) -> float:
    """Median of the rates at which rudders of records with noise move fast, rad/s."""
    rates = np.concatenate(
        [np.abs(np.diff(trial["delta"]) / np.diff(trial.t)) for trial in trials]
    )
    fastest = np.quantile(rates[rates > 0.0], 0.995)
    return float(np.median(rates[rates >= 0.5 * fastest]))


def _settling_lag(trials: Sequence[Trial], rate: float) -> float:
    """Lag of a gear of a rate, rad/s, by how its rudder settles in records with noise.

    Where the rudder has slowed down to half the rate, half of rate times lag is left to
    go. 0 where the median of that does not differ from what a gear without lag has to
    go in its last sampling step: an eighth of a step on average, up to a half where all
    moves end at the same part of a step; and 0 beyond 2 s, where the order itself
    changes slowly.
    """
    left = list[float]()
    step = 0.0
    for trial in trials:
        left += _left_to_go(
            trial.t,
            trial["delta"],
            rate,
        )
        step = max(step, usual_step(trial.t))

    fewest_moves = 6
    if len(left) < fewest_moves:
        return 0.0
    low, middle, high = np.quantile(left, [0.25, 0.5, 0.75])
    spread = high - low
    on_average = 0.125 * rate * step + 3.0 * spread / np.sqrt(len(left))
    in_step = 0.5 * rate * step - spread
    longest = 2.0  # s
    if not max(on_average, in_step) < middle < 0.5 * rate * longest:
        return 0.0
    return float(2.0 * middle / rate)


def _left_to_go(
    t: Floats,
    delta: Floats,
    rate: float,
) -> list[float]:
    """What moves of a rudder have left to go, rad, when they fall to half the rate.

    Of moves that are followed by 4 s of rest, in the last half of which it has settled.
    """
    rates = np.diff(delta) / np.diff(t)
    is_fast = np.abs(rates) >= 0.5 * rate
    edges = np.flatnonzero(np.diff(is_fast, append=~is_fast[-1]))
    left = []
    for last, end in pairwise(edges):
        begin = last + 1
        rest = delta[begin : end + 2]
        if is_fast[last] and t[end + 1] - t[begin] >= 4.0:
            settled = np.median(rest[len(rest) // 2 :])
            to_go = settled - rest[0]
            left.append(float(np.sign(rates[last]) * to_go))
    return left
