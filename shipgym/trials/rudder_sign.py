"""Side to which a positive rudder steers, by the turning that follows it.

In windows of the log the heading follows a Nomoto ship from the window's own heading
and yaw rate: a rudder that only answers the heading explains nothing there. The gain of
the rudder is the same in all windows, its error that of independent windows, of which a
rudder that moves once gives too few, and a boat that goes round none of equal weight:
a turn with the rudder laid to one side decides first.
"""

import math
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.resampling import Log, usual_step
from shipgym.trials.units import DEGREE

_FEWEST_WINDOWS = 3


class RudderSide(NamedTuple):
    """The side to which a positive rudder steers; None where a log does not tell."""

    side: str | None
    reason: str = "the log does not tell"
    is_sure: bool = False  # so that another side is refused

    @property
    def choices(self) -> str:
        """What there is to decide."""
        return (
            '"starboard" or "port", the side to which the ship turns with a positive'
            f" rudder: {self.reason}"
        )


class _Fit(NamedTuple):
    """Least squares of the rudder's gain, with a given damping."""

    certainty: float  # the gain in its standard errors
    squares: float  # of the residual
    is_clear: bool  # explains a tenth of the turning, in several windows


def rudder_side(t: Floats, psi: Floats, delta: Floats) -> RudderSide:
    """Find the side to which a positive rudder steers.

    Parameters
    ----------
    t : ndarray of shape (n_samples,)
        Time, s.
    psi, delta : ndarray of shape (n_samples,)
        Heading without jumps, and rudder, rad.
    """
    turned = _turned(psi, delta)
    if turned:
        degrees = abs(turned) / DEGREE
        evidence = f"a turn of {degrees:.0f} deg with the rudder to one side"
        return _side(turned, evidence, is_sure=True)
    windows = _windows(t, psi, delta)
    low, high = np.quantile(delta, [0.02, 0.98])
    swing = high - low
    if swing <= 2.0 * DEGREE or windows.shape[1] < _FEWEST_WINDOWS:
        return RudderSide(None)

    # of stable ships, and of one that is not
    relative = np.concatenate([[-1.0], np.geomspace(0.1, 10.0, 7)])
    times, headings, rudders = windows
    dampings = relative / times[0, -1]
    fits = [_fit(times, headings, rudders, damping) for damping in dampings]
    best = min(fits, key=lambda fit: fit.squares)
    errors = abs(best.certainty)
    if not best.is_clear or errors <= 5.0:
        return RudderSide(None)
    evidence = f"the turning that follows the rudder, {errors:.0f} standard errors"
    # twice the errors of a guess: a refusal has to be right
    return _side(best.certainty, evidence, is_sure=errors > 10.0)


def _side(value: float, evidence: str, *, is_sure: bool) -> RudderSide:
    reason = f"{evidence}, wrong in less than 1% of simulated logs"
    return RudderSide("starboard" if value > 0.0 else "port", reason, is_sure)


def check_rudder_side(log: Log) -> None:
    """Refuse a rudder that is positive to port, by the turning that follows it."""
    found = rudder_side(log.t, log.heading, log.channels["delta"])
    if found.side == "port" and found.is_sure:
        raise InputError(
            f"{log.locator.path}: expected a positive rudder to turn the bow to"
            f" starboard, got the opposite sign ({found.reason}); write rudder_positive"
            ' = "port" in [conventions], or take it out if it stands there',
            [("rudder_positive", "port")],
        )


def _turned(psi: Floats, delta: Floats) -> float:
    """Widest turn with the rudder laid to one side, positive if to that side, rad.

    Zero where none goes round, or where other turns with the rudder over contradict it.
    """
    widest_loop = 10.0 * DEGREE  # of a ship that is unstable on her course
    is_over = np.abs(delta) > widest_loop
    side = np.sign(delta) * is_over
    ends = np.flatnonzero(np.diff(side))
    stretches = np.split(side * psi, ends + 1)
    turns = np.array([one[-1] - one[0] for one in stretches])
    sizes = np.abs(turns)
    together = float(turns.sum())
    agree = abs(together) > 0.95 * sizes.sum()
    widest = float(sizes.max())
    goes_round = widest > 90.0 * DEGREE
    return math.copysign(widest, together) if agree and goes_round else 0.0


def _windows(t: Floats, psi: Floats, delta: Floats) -> Floats:
    """Time, heading and rudder in windows, shape (3, n_windows, n_rows).

    The windows follow one another, without those over a gap of time. Time counts from
    the begin of each.
    """
    step = usual_step(t)
    longest_window = 60.0  # s
    length = min(longest_window, float(t[-1] - t[0]) / 8.0)
    rows = max(6, math.ceil(length / step))
    number = t.size // rows
    channels = np.array([t, psi, delta])[:, : number * rows]
    windows = channels.reshape(3, number, rows)
    longest = np.diff(windows[0], axis=1).max(axis=1, initial=0.0)
    windows = windows[:, longest <= 6.0 * step]
    windows[0] -= windows[0, :, :1]
    return windows


def _fit(t: Floats, psi: Floats, delta: Floats, damping: float) -> _Fit:
    """Fit the heading in windows by the response to rudder and a constant moment."""
    free_rate = (1.0 - np.exp(-damping * t)) / damping
    own = np.stack([np.ones_like(t), free_rate], axis=2)
    basis, _ = np.linalg.qr(own)

    def beyond(values: Floats) -> Floats:
        """What the windows' own headings and rates leave of values."""
        shares = np.einsum("wsk,ws->wk", basis, values)
        left: Floats = values - np.einsum("wsk,wk->ws", basis, shares)
        return left

    constant = beyond(_response(t, np.ones_like(t), damping))
    constant /= np.linalg.norm(constant)
    target = beyond(psi)
    rudder = beyond(_response(t, delta, damping))
    target -= constant * np.sum(constant * target)
    rudder -= constant * np.sum(constant * rudder)

    whole = float(np.sum(target**2))
    powers = np.sum(rudder**2, axis=1)
    power = float(np.sum(powers))
    if power == 0.0:
        return _Fit(0.0, whole, is_clear=False)
    gain = float(np.sum(rudder * target)) / power
    residual = target - gain * rudder
    scores = np.sum(rudder * residual, axis=1)
    n = power**2 / np.sum(powers**2)  # windows of equal weight, in which it moves
    free = max(n - 2.0, 0.1)
    spread = math.sqrt(np.sum(scores**2) * n / free)
    squares = float(np.sum(residual**2))
    return _Fit(
        certainty=gain * power / spread if spread > 0.0 else 0.0,
        squares=squares,
        is_clear=bool(squares < 0.9 * whole and n >= _FEWEST_WINDOWS),
    )


def _response(t: Floats, values: Floats, damping: float) -> Floats:
    """Heading of a ship with r' = -damping r + values from rest, by trapezoids."""
    from scipy.integrate import cumulative_trapezoid

    grown = np.exp(damping * t)
    impulse = cumulative_trapezoid(values * grown, t, initial=0)
    r = impulse / grown
    psi: Floats = cumulative_trapezoid(r, t, initial=0)
    return psi
