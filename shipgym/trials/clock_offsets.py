"""Offsets between clocks: yaw rate against heading, rudder against yaw acceleration.

Each is the delay at which one channel explains the other best, by least squares over
windows of some seconds, which is a band-pass: slower than that both are bound by the
ship, faster is noise. The rudder's part in the yaw acceleration is instantaneous, all
the rest of it follows from yaw rate, sway and their history.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats, integral
from shipgym.trials.resampling import usual_step

LONGEST_DELAY_S = 10.0  # that is looked for


class ClockOffset(NamedTuple):
    """Delay of a channel, and the gain and certainty of the estimate."""

    late: float  # s
    error: float  # standard error, s
    gain: float
    certainty: float  # the gain in standard errors


@dataclass(frozen=True)
class _Windows:
    """Windows of time in which channels are compared."""

    t: Floats  # of the samples, s
    centres: Floats
    half: float  # of a window, s

    def slope(self, values: Floats, delay: float = 0.0) -> Floats:
        """Mean slope of sampled values over each window, that many seconds later."""
        middle = self.centres + delay
        begin = np.interp(middle - self.half, self.t, values)
        end = np.interp(middle + self.half, self.t, values)
        length = 2.0 * self.half
        slope: Floats = (end - begin) / length
        return slope


class _DelayFit(NamedTuple):
    """Least squares of a change by one regressor."""

    gain: float
    residual: Floats
    squares: float  # of the residual, never zero


class _Minimum(NamedTuple):
    """Minimum of a parabola through three values."""

    at: float
    curvature: float


def clock_offset(
    t: Floats, target: Floats, late: Floats, others: Mapping[str, Floats]
) -> ClockOffset | None:
    """Delay of a channel against the change of a target; None where it cannot be found.

    Parameters
    ----------
    t : ndarray of shape (n_samples,)
        Time, s.
    target : ndarray of shape (n_samples,)
        Differentiated over windows of time.
    late : ndarray of shape (n_samples,)
        The channel.
    others : mapping of str to ndarray of shape (n_samples,)
        What explains the change of the target together with the channel.
    """
    windows = _windows(t)
    if windows is None:
        return None
    known = _known_directions(windows, others)
    slope = windows.slope(target)
    change = _unexplained(slope, known)
    channel = integral(t, late)

    def fit(delay: float) -> _DelayFit:
        regressor = _unexplained(windows.slope(channel, delay), known)
        return _fit(change, regressor)

    delays = np.arange(-LONGEST_DELAY_S, LONGEST_DELAY_S + 0.1, 0.25)
    squares = np.array([fit(delay).squares for delay in delays])
    power = float(change @ change)
    least = _minimum(delays, squares, rounding=1e-12 * power)
    if least is None:
        return None

    best = fit(least.at)
    free = _independent_samples(best)
    variance = 2.0 * best.squares / free / least.curvature
    explained = max(power / best.squares - 1.0, 0.0)
    return ClockOffset(
        late=least.at,
        error=math.sqrt(variance),
        gain=best.gain,
        certainty=math.sqrt(free * explained),
    )


def _minimum(x: Floats, y: Floats, rounding: float) -> _Minimum | None:
    """Minimum of values at evenly spaced x; None at either end, or of a flat curve."""
    k = int(np.argmin(y))
    is_at_end = k in (0, x.size - 1)
    if is_at_end:
        return None
    around = slice(k - 1, k + 2)
    from_least = x[around] - x[k]
    half_curvature, slope, _ = np.polyfit(from_least, y[around], deg=2)
    curvature = 2.0 * float(half_curvature)
    step = float(x[1] - x[0])
    if curvature * step**2 <= rounding:
        return None
    return _Minimum(
        at=float(x[k] - slope / curvature),
        curvature=curvature,
    )


def _windows(t: Floats) -> _Windows | None:
    """Windows one sample apart, inside the record for every delay.

    None where there are too few or too many.
    """
    length = 5.0
    margin = LONGEST_DELAY_S + length
    first = t[0] + margin
    last = t[-1] - margin
    step = max(usual_step(t), 0.5)
    count = (last - first) / step
    if not 60.0 < count < 200_000.0:
        return None
    return _Windows(
        t=t,
        centres=np.arange(first, last, step),
        half=max(0.5 * length, step),
    )


def _known_directions(windows: _Windows, others: Mapping[str, Floats]) -> Floats:
    """Orthonormal basis of a constant and other channels, shape (n_windows, n)."""
    smallest = 0.02  # singular value; what is less follows from the others
    columns = [np.ones(windows.centres.size)]
    for values in others.values():
        total = integral(windows.t, values)
        slope = windows.slope(total)
        columns.append(slope)
    directions = np.column_stack(columns)
    directions /= np.linalg.norm(directions, axis=0)
    basis, sizes, _ = np.linalg.svd(directions, full_matrices=False)
    is_independent = sizes > smallest
    return np.asarray(basis[:, is_independent])


def _unexplained(values: Floats, directions: Floats) -> Floats:
    """Values less what orthonormal directions explain of them."""
    shares = directions.T @ values
    left: Floats = values - directions @ shares
    return left


def _fit(change: Floats, regressor: Floats) -> _DelayFit:
    tiny = 1e-300  # in place of zero, by which is divided
    power = float(regressor @ regressor)
    gain = float(regressor @ change) / max(power, tiny)
    residual = change - gain * regressor
    squares = float(residual @ residual)
    return _DelayFit(
        gain=gain,
        residual=residual,
        squares=max(squares, tiny),
    )


def _independent_samples(fit: _DelayFit) -> float:
    """Number of independent residuals, by the correlation of each with the next."""
    residual = fit.residual
    before = residual[:-1]
    after = residual[1:]
    covariance = float(after @ before)
    correlation = max(covariance / fit.squares, 0.0)
    share = (1.0 - correlation) / (1.0 + correlation)
    return max(residual.size * share, 2.0)


def rudder_clock_offset(t: Floats, r: Floats, delta: Floats) -> ClockOffset | None:
    """Delay of the rudder against the yaw acceleration.

    Yaw rate and the history of both explain the rest of the acceleration.
    """
    explained = {
        "r": r,
        "r^3": r**3,
        "r, 20 s": _remembered(t, r, memory=20.0),
        "delta, 20 s": _remembered(t, delta, memory=20.0),
        "r, 80 s": _remembered(t, r, memory=80.0),
        "delta, 80 s": _remembered(t, delta, memory=80.0),
    }
    return clock_offset(t, target=r, late=delta, others=explained)


def _remembered(t: Floats, values: Floats, memory: float) -> Floats:
    """Values by a first-order low-pass, whose time constant is the memory, s."""
    from scipy.signal import lfilter

    even = np.linspace(t[0], t[-1], t.size)
    step = even[1] - even[0]
    decay = math.exp(-step / memory)
    resampled = np.interp(even, t, values)
    lagged = lfilter(
        b=[1.0 - decay],
        a=[1.0, -decay],
        x=resampled,
    )
    return np.interp(t, even, lagged)


def reverses(values: Floats, least: float = 0.0) -> bool:
    """Return whether a channel reverses three times or more, as in zigzags.

    A single step shows no delay.
    """
    low, high = _usual_range(values)
    span = high - low
    if span <= least:
        return False
    sides = _sides(values)
    far = sides[sides != 0.0]
    changes = np.diff(far)
    count = np.count_nonzero(changes)
    return bool(count >= 3)


def cycle_time(t: Floats, values: Floats) -> float:
    """Usual time from there and back to there of a channel that reverses, s."""
    sides = _sides(values)
    is_far = sides != 0.0
    times = t[is_far]
    changes = np.diff(sides[is_far])
    reversals = times[1:][changes != 0.0]
    between = np.diff(reversals)
    half_cycle = float(np.median(between))
    return 2.0 * half_cycle


def _usual_range(values: Floats) -> tuple[float, float]:
    """Least and largest value, without a few that are out of the usual."""
    low, high = np.quantile(values, [0.02, 0.98])
    return float(low), float(high)


def _sides(values: Floats) -> Floats:
    """Side of the middle on which values are: 1, -1, or 0 near the middle."""
    low, high = _usual_range(values)
    middle = 0.5 * (low + high)
    near = 0.25 * (high - low)
    from_middle = values - middle
    is_far = np.abs(from_middle) > near
    sides = np.sign(from_middle)
    return np.where(is_far, sides, 0.0)
