"""Late channels of a log: yaw rate against heading, rudder against yaw acceleration.

Each delay is that at which one channel explains the other best, by least squares over
windows of some seconds, which is a band-pass: slower than that both are bound by the
ship, faster is noise. The rudder's part in the yaw acceleration is instantaneous, all
the rest of it follows from yaw rate, sway and their history.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats, integral
from shipgym.errors import InputError
from shipgym.trials.resampling import Log, usual_step
from shipgym.trials.units import DEGREE

LONGEST_DELAY_S = 10.0  # that is looked for
_CERTAIN = 6.0  # standard errors by which a channel must explain the other
#: Name of a channel, and what it is compared with.
_COMPARISONS = {
    "r": ("the yaw rate", "the heading"),
    "delta": ("the rudder", "the yaw acceleration"),
}


class LateChannel(NamedTuple):
    """A channel that is believed to be late, or early where the delay is negative."""

    channel: str
    delay: float  # s
    error: float  # standard error, ships of other dynamics included, s
    refused: float  # delay on one clock, less its error, that is refused, s

    @property
    def evidence(self) -> str:
        """Delay found, in words."""
        name, target = _COMPARISONS[self.channel]
        side = "late" if self.delay > 0.0 else "early"
        return (
            f"{name} is {abs(self.delay):.2f} s {side} against {target} (standard error"
            f" {self.error:.2f} s)"
        )


class _Offset(NamedTuple):
    """Delay of a channel, and the certainty of the estimate."""

    late: float  # s
    error: float  # standard error, s
    certainty: float  # the channel's gain in standard errors


def find_late_channels(log: Log) -> list[LateChannel]:
    """Yaw rate and rudder where a log shows that they are late."""
    return [suspect for suspect in _suspects(log) if _holds(log, suspect)]


def is_corrected(
    late: LateChannel, choice: str | None, where: str, *, is_one_clock: bool
) -> bool:
    """Decide whether a late channel is corrected, by `choice`, "correct" or "keep".

    Without one, large delays of channels on one clock are an InputError, which begins
    with `where`, small ones are left, and those of channels with clocks of their own
    are corrected.
    """
    if choice is not None or not is_one_clock:
        return choice != "keep"
    if abs(late.delay) - late.error <= late.refused:
        return False
    raise InputError(
        f"{where}: expected one clock, got one of which {late.evidence}; to have it"
        ' corrected write clock_offsets = "correct" in [sensors] of the ship file, or'
        ' "keep" if it is so'
    )


def _suspects(log: Log) -> list[LateChannel]:
    """Channels that one log, as it stands, shows late by more than its errors."""
    offsets = _offsets(log)
    rate = offsets.get("r")
    rudder = offsets.get("delta")
    late = []
    if rate is not None and rate.certainty >= _CERTAIN:
        dynamics_s = 0.25
        error = math.hypot(rate.error, dynamics_s)
        # some 3 % of the time constant of the ship
        refused = max(1.0, _cycle_time(log.t, log.channels["r"]) / 150.0)
        if abs(rate.late) >= 5.0 * error:
            late.append(LateChannel("r", rate.late, error, refused))

    # where the yaw rate is the derivative of a heading with noise
    certain_derived = 10.0
    needed = _CERTAIN if log.has("r") else certain_derived
    if rudder is not None and rudder.certainty >= needed:
        cycle = _cycle_time(log.t, log.channels["delta"])
        # by which slow ships of other dynamics seem late
        error = math.hypot(rudder.error, max(1.0, cycle / 300.0))
        # an early rudder looks like that of a ship which answers slowly
        cycles = 1.0 / 18.0 if rudder.late > 0.0 else 1.0 / 30.0
        if abs(rudder.late) <= min(cycles * cycle, 0.9 * LONGEST_DELAY_S):
            late.append(LateChannel("delta", rudder.late, error, refused=1.5))

    significant = 2.5  # standard errors
    return [one for one in late if abs(one.delay) >= significant * one.error]


def _holds(log: Log, suspect: LateChannel) -> bool:
    """Return whether the delay is still there with more noise, and none of its making.

    What noise does to a delay it does again when as much is added (simulation
    extrapolation: Cook & Stefanski 1994), so the delay without noise is the first one
    less the change.
    """
    n_copies = 8
    random = np.random.default_rng(0)
    found = []
    for _ in range(n_copies):
        channels = dict(log.channels)
        for name in ("psi", "r", "delta"):
            if log.has(name):
                values = log.channels[name]
                noise = _white_noise(values) * random.standard_normal(values.size)
                channels[name] = values + noise
        noisy = replace(log, channels=channels)
        offset = _offsets(noisy).get(suspect.channel)
        if offset is not None:
            found.append(offset.late)

    if len(found) < 0.75 * n_copies:
        return False
    change = float(np.median(found)) - suspect.delay
    noise_s = math.hypot(change, float(np.std(found)))
    return noise_s < 0.4 * abs(suspect.delay)


def _white_noise(values: Floats) -> float:
    """Standard deviation of white noise on a smooth signal, by fourth differences."""
    differences = np.diff(values, n=4)
    magnitude = np.median(np.abs(differences))
    of_differences = 1.4826 * magnitude  # if they are normally distributed
    gain = math.sqrt(70.0)  # 1 + 16 + 36 + 16 + 1
    return float(of_differences / gain)


def _offsets(log: Log) -> dict[str, _Offset | None]:
    """Delays of the yaw rate against the heading and of the rudder against both.

    None or missing where a log does not show them.
    """
    t = log.t
    channels = log.channels
    found: dict[str, _Offset | None] = {}
    if log.has("psi", "r") and _reverses(channels["r"]):
        r = channels["r"]
        cycle = _cycle_time(t, r)
        # as long as the signal lets them be, in which noise averages out
        windows = _windows(t, max(0.25 * cycle, 5.0)) or _windows(t)
        found["r"] = _offset(windows, channels["psi"], r, [], 0.5 * cycle)
    has_motion = log.has("psi") or log.has("r")
    least_swing = 2.0 * DEGREE
    if not (has_motion and log.has("delta")):
        return found
    delta = channels["delta"]
    if not _reverses(delta, least_swing):
        return found

    if log.has("r"):
        rate = found.get("r")
        late = 0.0 if rate is None else rate.late
        r = np.interp(t + late, t, channels["r"])
    else:
        # the same mean for both, so that one follows the other as before
        r = _window_mean(t, channels["psi"])
        delta = _window_mean(t, integral(t, delta))
    # yaw rate and the history of both explain the rest of the acceleration
    others = [r, r**3]
    for memory in (20.0, 80.0):
        others += [_remembered(t, r, memory), _remembered(t, delta, memory)]
    half_cycle = 0.5 * _cycle_time(t, delta)
    found["delta"] = _offset(_windows(t), r, delta, others, half_cycle)
    return found


def _window_mean(t: Floats, total: Floats) -> Floats:
    """Mean over windows of 5 s of what adds up to a total, about each sample."""
    half = 2.5  # s
    added = np.interp(t + half, t, total) - np.interp(t - half, t, total)
    mean: Floats = added / (2.0 * half)
    return mean


# ---- the delay of one channel against the change of another


class _Windows(NamedTuple):
    """Windows of time in which channels are compared."""

    t: Floats  # of the samples, s
    centres: Floats
    half: float  # of a window, s

    def slope(self, values: Floats, delay: float = 0.0) -> Floats:
        """Mean slope of sampled values over each window, that many seconds later."""
        middle = self.centres + delay
        begin = np.interp(middle - self.half, self.t, values)
        end = np.interp(middle + self.half, self.t, values)
        slope: Floats = (end - begin) / (2.0 * self.half)
        return slope


def _offset(
    windows: _Windows | None,
    target: Floats,
    late: Floats,
    others: Sequence[Floats],
    block: float,
) -> _Offset | None:
    """Delay of a channel against the change of a target; None where it cannot be found.

    The target is differentiated over windows of time; the other channels explain its
    change together with the late one. All have shape (n_samples,). Delays are tried in
    whole sampling steps, at which windows average as much noise as without. The error
    is that of blocks of time, s, drawn anew (Kuensch 1989, Ann. Statist. 17): what the
    windows leave is correlated.
    """
    if windows is None:
        return None
    known = _known_directions(windows, others)
    change = _unexplained(windows.slope(target), known)
    channel = integral(windows.t, late)
    delays = _delays(usual_step(windows.t))
    regressors = [
        _unexplained(windows.slope(channel, delay), known) for delay in delays
    ]
    tiny = 1e-300  # in place of zero, by which is divided
    left = np.array(
        [
            change - (one @ change) / max(float(one @ one), tiny) * one
            for one in regressors
        ]
    )
    squares = left**2
    total = squares.sum(axis=1)
    late_s = _least_at(delays, total)
    if late_s is None:
        return None
    n_blocks = max(int((windows.centres[-1] - windows.centres[0]) / block), 2)
    sums = [part.sum(axis=1) for part in np.array_split(squares, n_blocks, axis=1)]
    power = float(change @ change)
    least = max(float(total.min()), tiny)
    free = _independent_samples(left[int(np.argmin(total))], least)
    return _Offset(
        late=late_s,
        error=_by_blocks(delays, np.array(sums)),
        certainty=math.sqrt(free * max(power / least - 1.0, 0.0)),
    )


def _delays(step: float) -> Floats:
    """Delays that are tried, s, in sampling steps."""
    apart = max(round(0.25 / step), 1) * step
    n = math.ceil(LONGEST_DELAY_S / apart)
    return np.asarray(apart * np.arange(-n, n + 1), dtype=float)


def _least_at(delays: Floats, squares: Floats) -> float | None:
    """Delay of the least sum of squares by a parabola; None at an end."""
    k = int(np.argmin(squares))
    if k in (0, delays.size - 1):
        return None
    before, least, after = squares[k - 1 : k + 2]
    curvature = before - 2.0 * least + after
    if curvature <= 1e-12 * squares.max():
        return None
    part = 0.5 * (before - after) / curvature
    return float(delays[k] + part * (delays[1] - delays[0]))


def _by_blocks(delays: Floats, sums: Floats) -> float:
    """Standard error of the delay by blocks drawn anew, shape (n_blocks, n_delays)."""
    random = np.random.default_rng(0)
    n_blocks = len(sums)
    found = []
    for _ in range(200):
        drawn = sums[random.integers(0, n_blocks, n_blocks)].sum(axis=0)
        k = int(np.argmin(drawn))
        at = _least_at(delays, drawn)
        found.append(float(delays[k]) if at is None else at)
    return float(np.std(found)) * math.sqrt(n_blocks / (n_blocks - 1))


def _windows(t: Floats, length: float = 5.0) -> _Windows | None:
    """Windows of a length, s, one sample apart, inside the record for every delay.

    None where there are too few or too many.
    """
    margin = LONGEST_DELAY_S + length
    first = t[0] + margin
    last = t[-1] - margin
    step = max(usual_step(t), 0.5)
    if not 60.0 < (last - first) / step < 200_000.0:
        return None
    return _Windows(t, np.arange(first, last, step), max(0.5 * length, step))


def _known_directions(windows: _Windows, others: Sequence[Floats]) -> Floats:
    """Orthonormal basis of a constant and other channels, shape (n_windows, n)."""
    smallest = 0.02  # singular value; what is less follows from the others
    columns = [np.ones(windows.centres.size)]
    for values in others:
        columns.append(windows.slope(integral(windows.t, values)))
    directions = np.column_stack(columns)
    directions /= np.linalg.norm(directions, axis=0)
    basis, sizes, _ = np.linalg.svd(directions, full_matrices=False)
    return np.asarray(basis[:, sizes > smallest])


def _unexplained(values: Floats, directions: Floats) -> Floats:
    """Values less what orthonormal directions explain of them."""
    left: Floats = values - directions @ (directions.T @ values)
    return left


def _independent_samples(residual: Floats, squares: float) -> float:
    """Number of independent residuals, by the correlation of each with the next."""
    correlation = max(float(residual[1:] @ residual[:-1]) / squares, 0.0)
    share = (1.0 - correlation) / (1.0 + correlation)
    return max(residual.size * share, 2.0)


def _remembered(t: Floats, values: Floats, memory: float) -> Floats:
    """Values by a first-order low-pass, whose time constant is the memory, s."""
    from scipy.signal import lfilter

    even = np.linspace(t[0], t[-1], t.size)
    decay = math.exp(-(even[1] - even[0]) / memory)
    resampled = np.interp(even, t, values)
    lagged = lfilter(b=[1.0 - decay], a=[1.0, -decay], x=resampled)
    return np.interp(t, even, lagged)


def _reverses(values: Floats, least: float = 0.0) -> bool:
    """Return whether a channel reverses three times or more, as in zigzags.

    A single step shows no delay.
    """
    low, high = np.quantile(values, [0.02, 0.98])
    if high - low <= least:
        return False
    sides = _sides(values)
    return bool(np.count_nonzero(np.diff(sides[sides != 0.0])) >= 3)


def _cycle_time(t: Floats, values: Floats) -> float:
    """Usual time from there and back to there of a channel that reverses, s."""
    sides = _sides(values)
    is_far = sides != 0.0
    changes = np.diff(sides[is_far])
    reversals = t[is_far][1:][changes != 0.0]
    return 2.0 * float(np.median(np.diff(reversals)))


def _sides(values: Floats) -> Floats:
    """Side of the middle on which values are: 1, -1, or 0 near the middle.

    A few values that are out of the usual do not count.
    """
    low, high = np.quantile(values, [0.02, 0.98])
    from_middle = values - 0.5 * (low + high)
    is_far = np.abs(from_middle) > 0.25 * (high - low)
    return np.where(is_far, np.sign(from_middle), 0.0)
