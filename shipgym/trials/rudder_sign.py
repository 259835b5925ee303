"""Side to which a positive rudder steers, by the turning that follows it.

In windows of the log the heading follows a Nomoto ship from the window's own heading
and yaw rate: a rudder that only answers the heading explains nothing there. The gain of
the rudder is the same in all windows, its error that of independent windows, of which a
rudder that moves once gives too few; with the rudder laid to one side the turn decides.
"""

import math
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.trials.resampling import usual_step
from shipgym.trials.units import DEGREE

#: Share of logs in which the side may be named wrongly: measured by
#: scripts/rudder_sign.py.
ERROR_RATE = 0.01

_LONGEST_WINDOW = 60.0  # s
_FEWEST_WINDOWS = 3
_CERTAIN = 5.0  # standard errors


class RudderSign(NamedTuple):
    """The side to which a positive rudder steers; None where a log does not tell."""

    side: str | None
    certainty: float  # the gain in its standard errors
    turned: float = 0.0  # rad, with the rudder laid to starboard by its sign

    @property
    def reason(self) -> str:
        """The evidence, in words."""
        rate = f"wrong in less than {ERROR_RATE:.0%} of simulated logs"
        if self.turned:
            turned = abs(self.turned) / DEGREE
            return f"a turn of {turned:.0f} deg with the rudder to one side, {rate}"
        return (
            f"the turning that follows the rudder, {abs(self.certainty):.0f} standard"
            f" errors, {rate}"
        )

    def side_by_hint(self, *, is_turned: bool) -> str:
        """The likelier side in words, empty where there is none.

        `is_turned`: the rudder was read as positive to port.
        """
        if abs(self.certainty) < 1.0:
            return ""
        likelier = "port" if (self.certainty > 0.0) == is_turned else "starboard"
        return (
            f" ({likelier} is likelier, by {abs(self.certainty):.1f} standard errors)"
        )


class _Fit(NamedTuple):
    """Least squares of the rudder's gain, with a given damping."""

    gain: float
    error: float
    squares: float  # of the residual
    power: float  # of what the windows' own heading and rate leave
    n_windows: float  # of equal weight, in which the rudder moves


def rudder_sign(t: Floats, psi: Floats, delta: Floats) -> RudderSign:
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
        side = "starboard" if turned > 0.0 else "port"
        return RudderSign(side, 0.0, turned)
    windows = _windows(t, psi, delta)
    if len(windows.t) < _FEWEST_WINDOWS or _span(delta) < 2.0 * DEGREE:
        return RudderSign(None, 0.0)
    # of stable ships, and of one that is not
    relative = np.concatenate([[-1.0], np.geomspace(0.1, 10.0, 7)])
    dampings = relative / windows.t[0, -1]
    fits = [_fit(windows, damping) for damping in dampings]
    best = min(fits, key=lambda fit: fit.squares)
    certainty = best.gain / best.error if best.error > 0.0 else 0.0
    explained = 1.0 - best.squares / best.power if best.power > 0.0 else 0.0
    as_good = [fit for fit in fits if fit.squares < 1.05 * best.squares]
    agree = all(fit.gain * best.gain > 0.0 for fit in as_good)
    side = None
    is_enough = explained > 0.1 and best.n_windows >= _FEWEST_WINDOWS
    if agree and is_enough and abs(certainty) > _CERTAIN:
        side = "starboard" if certainty > 0.0 else "port"
    return RudderSign(side, certainty)


def _turned(psi: Floats, delta: Floats) -> float:
    """Angle turned with the rudder laid to one side, positive if to that side, rad.

    Zero where it is not held there, or the ship does not go round.
    """
    rudder = np.median(delta)
    side = np.sign(rudder)
    is_held = side * delta > 0.5 * abs(rudder)
    is_opposite = side * delta < -3.0 * DEGREE
    is_laid = abs(rudder) > 8.0 * DEGREE and np.mean(is_opposite) < 0.05

    steps = side * np.diff(psi)
    turned = float(np.sum(steps[is_held[1:]]))
    net = abs(float(psi[-1] - psi[0]))
    goes_round = abs(turned) > 90.0 * DEGREE and net > 0.9 * np.ptp(psi)
    return turned if is_laid and goes_round else 0.0


def _span(values: Floats) -> float:
    """Range of values without a few extreme ones."""
    low, high = np.quantile(values, [0.02, 0.98])
    return float(high - low)


class _Windows(NamedTuple):
    """Samples of windows, one row a window."""

    t: Floats  # from the begin of each, s
    psi: Floats
    delta: Floats


def _windows(t: Floats, psi: Floats, delta: Floats) -> _Windows:
    """Windows one after another, without those over a gap of time; not too many."""
    step = usual_step(t)
    span = t[-1] - t[0]
    length = min(_LONGEST_WINDOW, span / 8.0)
    rows = max(6, math.ceil(length / step))
    most = 400
    begins = np.arange(0, t.size - rows + 1, rows)
    stride = max(1, begins.size // most)
    samples = begins[::stride, np.newaxis] + np.arange(rows)
    longest = np.diff(t[samples], axis=1).max(axis=1, initial=0.0)
    samples = samples[longest <= 6.0 * step]
    times = t[samples]
    return _Windows(times - times[:, :1], psi[samples], delta[samples])


def _fit(windows: _Windows, damping: float) -> _Fit:
    """Fit the heading in windows by the response to rudder and a constant moment."""
    time = windows.t
    free = (1.0 - np.exp(-damping * time)) / damping
    own = np.stack([np.ones_like(time), free], axis=2)
    basis, _ = np.linalg.qr(own)

    def beyond(values: Floats) -> Floats:
        """What the windows' own headings and rates leave of values."""
        shares = np.einsum("wsk,ws->wk", basis, values)
        left: Floats = values - np.einsum("wsk,wk->ws", basis, shares)
        return left

    target = beyond(windows.psi)
    rudder = beyond(_response(time, windows.delta, damping))
    constant = beyond(_response(time, np.ones_like(time), damping))
    weight = np.sum(constant**2)
    target = target - constant * (np.sum(constant * target) / weight)
    rudder = rudder - constant * (np.sum(constant * rudder) / weight)

    whole = float(np.sum(target**2))
    power = float(np.sum(rudder**2))
    if power == 0.0:
        return _Fit(0.0, math.inf, squares=whole, power=whole, n_windows=0.0)
    gain = float(np.sum(rudder * target)) / power
    residual = target - gain * rudder
    scores = np.sum(rudder * residual, axis=1)
    powers = np.sum(rudder**2, axis=1)
    n = power**2 / np.sum(powers**2)
    spread = math.sqrt(np.sum(scores**2) * n / max(n - 2.0, 0.1))
    return _Fit(
        gain=gain,
        error=spread / power,
        squares=float(np.sum(residual**2)),
        power=whole,
        n_windows=float(n),
    )


def _response(t: Floats, values: Floats, damping: float) -> Floats:
    """Heading of a ship with r' = -damping r + values from rest, by trapezoids."""
    steps = np.diff(t, axis=1)
    decays = np.exp(-damping * steps)
    means = 0.5 * (values[:, 1:] + values[:, :-1])
    gains = means * (1.0 - decays) / damping
    r = np.zeros_like(t)
    for k in range(steps.shape[1]):
        r[:, k + 1] = decays[:, k] * r[:, k] + gains[:, k]
    turned = 0.5 * steps * (r[:, 1:] + r[:, :-1])
    psi = np.zeros_like(t)
    psi[:, 1:] = np.cumsum(turned, axis=1)
    return psi
