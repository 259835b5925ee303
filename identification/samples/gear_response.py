"""Response of a rudder to its orders: the ramp of its gear, then the lag.

A rudder far from its order moves at the gear's rate; where its gear has a lag, the last
of the way, rate times lag, decays exponentially.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import lambertw

from shipgym.arrays import Flags, Floats

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
