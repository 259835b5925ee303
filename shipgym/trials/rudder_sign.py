"""Side to which a positive rudder steers, by the turning that follows it.

In windows of the log the heading follows a Nomoto ship from the window's own heading
and yaw rate: a rudder that only answers the heading explains nothing there. The gain of
the rudder is the same in all windows, its error that of independent windows, of which a
rudder that moves once gives too few; with the rudder laid to one side the turn decides.
"""

import math
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats, integral
from shipgym.errors import InputError
from shipgym.trials.resampling import Log, usual_step
from shipgym.trials.units import DEGREE

#: Share of simulated logs in which the side was named wrongly, at most.
_ERROR_RATE = 0.01

_FEWEST_WINDOWS = 3


class RudderSign(NamedTuple):
    """The side to which a positive rudder steers; None where a log does not tell."""

    side: str | None
    certainty: float  # the gain in its standard errors
    turned: float = 0.0  # rad, with the rudder laid to starboard by its sign

    @property
    def reason(self) -> str:
        """The evidence, in words."""
        rate = f"wrong in less than {_ERROR_RATE:.0%} of simulated logs"
        if self.turned:
            turned = abs(self.turned) / DEGREE
            return f"a turn of {turned:.0f} deg with the rudder to one side, {rate}"
        certainty = abs(self.certainty)
        return (
            f"the turning that follows the rudder, {certainty:.0f} standard errors,"
            f" {rate}"
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

    @property
    def certainty(self) -> float:
        """The gain in its standard errors."""
        return self.gain / self.error if self.error > 0.0 else 0.0

    @property
    def is_clear(self) -> bool:
        """True if the rudder explains a tenth of the turning, in several windows."""
        return self.squares < 0.9 * self.power and self.n_windows >= _FEWEST_WINDOWS


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
        return RudderSign(_side(turned), certainty=0.0, turned=turned)
    windows = _windows(t, psi, delta)
    low, high = np.quantile(delta, [0.02, 0.98])
    moves = high - low > 2.0 * DEGREE
    if not moves or len(windows.t) < _FEWEST_WINDOWS:
        return RudderSign(None, certainty=0.0)

    # of stable ships, and of one that is not
    relative = np.concatenate([[-1.0], np.geomspace(0.1, 10.0, 7)])
    dampings = relative / windows.t[0, -1]
    fits = [_fit(windows, damping) for damping in dampings]
    best = min(fits, key=lambda fit: fit.squares)
    as_good = [fit for fit in fits if fit.squares < 1.05 * best.squares]
    agree = all(fit.gain * best.gain > 0.0 for fit in as_good)
    fewest_errors = 5.0
    is_certain = abs(best.certainty) > fewest_errors
    is_known = agree and best.is_clear and is_certain
    side = _side(best.gain) if is_known else None
    return RudderSign(side, best.certainty)


def check_rudder_sign(log: Log) -> None:
    """Refuse a rudder that is positive to port, by the turning that follows it."""
    if not log.has("delta") or not (log.has("psi") or log.has("r")):
        return
    psi = log.channels.get("psi")
    if psi is None:
        psi = integral(log.t, log.channels["r"])
    found = rudder_sign(log.t, psi, log.channels["delta"])
    surely = 10.0  # standard errors, twice those of a guess: a refusal has to be right
    if found.side == "port" and (found.turned or abs(found.certainty) > surely):
        raise InputError(
            f"{log.where}: expected a positive rudder to turn the bow to starboard, got"
            f" the opposite sign ({found.reason}); write rudder_positive ="
            ' "port" in [conventions], or take it out if it stands there',
            [("rudder_positive", "port")],
        )


def _side(value: float) -> str:
    return "starboard" if value > 0.0 else "port"


def _turned(psi: Floats, delta: Floats) -> float:
    """Angle turned with the rudder laid to one side, positive if to that side, rad.

    Zero where it is not held there, or the ship does not go round.
    """
    rudder = float(np.median(delta))
    side = math.copysign(1.0, rudder)
    to_side = side * delta
    is_held = to_side > 0.5 * abs(rudder)
    is_opposite = to_side < -3.0 * DEGREE
    is_laid = abs(rudder) > 8.0 * DEGREE
    if not is_laid or np.mean(is_opposite) > 0.05:
        return 0.0

    steps = side * np.diff(psi)
    turned = float(steps[is_held[1:]].sum())
    net = abs(float(steps.sum()))
    goes_round = abs(turned) > 90.0 * DEGREE
    turns_back = net < 0.9 * np.ptp(psi)
    return turned if goes_round and not turns_back else 0.0


class _Windows(NamedTuple):
    """Samples of windows, one row a window."""

    t: Floats  # from the begin of each, s
    psi: Floats
    delta: Floats


def _windows(t: Floats, psi: Floats, delta: Floats) -> _Windows:
    """Windows one after another, without those over a gap of time; not too many."""
    step = usual_step(t)
    span = float(t[-1] - t[0])
    longest_window = 60.0  # s
    length = min(longest_window, span / 8.0)
    rows = max(6, math.ceil(length / step))
    most_windows = 400
    begins = np.arange(0, t.size - rows + 1, rows)
    stride = max(1, begins.size // most_windows)
    first = begins[::stride, np.newaxis]
    samples = first + np.arange(rows)

    times = t[samples]
    longest = np.diff(times, axis=1).max(axis=1, initial=0.0)
    is_whole = longest <= 6.0 * step
    samples = samples[is_whole]
    times = times[is_whole]
    return _Windows(
        t=times - times[:, :1],
        psi=psi[samples],
        delta=delta[samples],
    )


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
    grown = np.exp(damping * t[:, 1:])
    gains = _means(values) * -np.expm1(-damping * steps) / damping
    r = np.zeros_like(t)
    r[:, 1:] = np.cumsum(gains * grown, axis=1) / grown

    turned = steps * _means(r)
    psi = np.zeros_like(t)
    psi[:, 1:] = np.cumsum(turned, axis=1)
    return psi


def _means(values: Floats) -> Floats:
    """Means of each value and the next one in its row."""
    before = values[:, :-1]
    after = values[:, 1:]
    means: Floats = 0.5 * (before + after)
    return means
