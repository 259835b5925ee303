"""Offsets between the clocks of sensors: yaw rate against heading, rudder against yaw acceleration.

Each is the delay at which one channel explains the other best, by least squares over
windows of some seconds, which is a band-pass: slower than that both are bound by the
ship, faster is noise. The rudder's part in the yaw acceleration is instantaneous, all
the rest of it follows from yaw rate, sway and their history.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats, integral
from shipgym.errors import InputError
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.resampling import Log, Series

#: Delays that are looked for, s, and the significance, in standard errors, from which
#: one is corrected.
LONGEST_S, SIGNIFICANT = 10.0, 2.5
#: By how much ships of other dynamics seem late, s, which the standard errors contain.
DYNAMICS_S = {"r": 0.25, "delta": 1.0}
#: Delays of channels on one clock that are refused, s.
REFUSED_S = {"r": 1.0, "delta": 2.0}
_WORDS = {
    "r": ("the yaw rate", "the heading"),
    "delta": ("the rudder", "the yaw acceleration"),
}
_LEAST_RUDDER = math.radians(2.0)
_WINDOW_S, _FEWEST, _MOST = 5.0, 60, 200_000
_MEMORIES_S = (20.0, 80.0)
_LEAST_DIRECTION = 0.02  # of what explains the change beside the channel
_SURE = 5.0  # standard errors by which the channel must tell on the other
_HARD_OVER, _TURNED = math.radians(8.0), math.radians(60.0)
_OTHER_SIGN = (
    "with the opposite sign, expected a positive rudder to turn the bow to starboard;"
    ' write rudder_positive = "port" in [conventions], or take it out if it stands'
    " there"
)
_OTHER_SIDE = (("rudder_positive", "port"),)


class ClockOffset(NamedTuple):
    """How late a channel is, s, with its standard error, and what it tells there."""

    late: float
    error: float
    gain: float
    sure: float  # the gain in standard errors


def clock_offset(
    t: Floats, target: Floats, late: Floats, others: Mapping[str, Floats]
) -> ClockOffset | None:
    """How late a channel is against the change of a target; None where nothing can be said.

    `target` is differentiated over windows of time, s; `others` are what explains it
    beside the channel.
    """
    step = max(float(np.median(np.diff(t))), 0.5)
    first, last = (
        float(t[0]) + LONGEST_S + _WINDOW_S,
        float(t[-1]) - LONGEST_S - _WINDOW_S,
    )
    if not _FEWEST < (last - first) / step < _MOST:
        return None
    grid = np.arange(first, last, step)
    half = 0.5 * max(_WINDOW_S, 2.0 * step)
    change = (np.interp(grid + half, t, target) - np.interp(grid - half, t, target)) / (
        2.0 * half
    )
    sums = {name: integral(t, values) for name, values in (*others.items(), ("", late))}

    def mean(name: str, delay: float = 0.0) -> Floats:
        ends = (
            np.interp(grid + delay + sign * half, t, sums[name]) for sign in (1.0, -1.0)
        )
        return np.asarray(np.subtract(*ends) / (2.0 * half))

    known = np.column_stack([np.ones(grid.size), *(mean(name) for name in others)])
    basis, sizes, _ = np.linalg.svd(
        known / np.linalg.norm(known, axis=0), full_matrices=False
    )
    basis = basis[:, sizes > _LEAST_DIRECTION]
    change = change - basis @ (basis.T @ change)
    power = float(change @ change)

    def fitted(delay: float) -> tuple[float, float, Floats]:
        column = mean("", delay)
        column = column - basis @ (basis.T @ column)
        gain = float(column @ change) / max(float(column @ column), 1e-300)
        left = change - gain * column
        return max(float(left @ left), 1e-300), gain, left

    delays = np.arange(-LONGEST_S, LONGEST_S + 0.1, 0.25)
    errors = np.array([fitted(delay)[0] for delay in delays])
    k = int(np.argmin(errors))
    curve = (
        errors[k - 1] - 2.0 * errors[k] + errors[k + 1]
        if 0 < k < delays.size - 1
        else 0.0
    )
    if curve <= 1e-12 * power:
        return None
    best = float(delays[k] + 0.25 * 0.5 * (errors[k - 1] - errors[k + 1]) / curve)
    least, gain, left = fitted(best)
    memory = max(float(left[1:] @ left[:-1]) / least, 0.0)
    free = max(grid.size * (1.0 - memory) / (1.0 + memory), 2.0)
    error = math.sqrt(2.0 * least / free / (curve / 0.25**2))
    return ClockOffset(
        best, error, gain, math.sqrt(free * max(power / least - 1.0, 0.0))
    )


def rudder_offset(t: Floats, r: Floats, delta: Floats) -> ClockOffset | None:
    """How late the rudder is against the yaw acceleration, beside yaw rate and the history of both."""
    from scipy.signal import lfilter

    grid = np.linspace(t[0], t[-1], t.size)
    others = {"r": r, "r3": r**3}
    for memory in _MEMORIES_S:
        share = 1.0 - math.exp(-(grid[1] - grid[0]) / memory)
        for name, values in (("r", r), ("delta", delta)):
            lagged = lfilter([share], [1.0, share - 1.0], np.interp(grid, t, values))
            others[f"{name}{memory}"] = np.interp(t, grid, lagged)
    return clock_offset(t, r, delta, others)


def _reverses(values: Floats, least: float = 0.0) -> bool:
    """Whether a channel goes there and back as in zigzags, three times or more: one step tells no delay."""
    low, high = np.quantile(values, [0.02, 0.98])
    far = values - 0.5 * (low + high)
    far = far[np.abs(far) > 0.25 * (high - low)]
    return bool(high - low > least and np.count_nonzero(np.diff(np.sign(far))) >= 3)


def _turns_against(psi: Floats, delta: Floats) -> bool:
    """Whether a rudder that stays on one side turns the ship to the other, as in a circle."""
    side = math.copysign(1.0, float(np.median(delta)))
    one_side = (
        float(np.quantile(side * delta, 0.1)) > 0.0
        and side * float(np.median(delta)) > _HARD_OVER
    )
    return one_side and side * float(psi[-1] - psi[0]) < -_TURNED


def corrected_clocks(
    log: Log, series: Series, choice: str | None
) -> tuple[Series, list[str]]:
    """The channels with late yaw rate and rudder put right, none where nothing is, and what was found.

    The series are those that the log was made of; `choice` is that of
    :class:`shipgym.trials.navigation.Instruments`: without one, channels on one clock
    are left, and more than `REFUSED_S` between them is an InputError. So is a rudder of
    the wrong sign, which is judged by a yaw rate only where this does not contradict
    the heading.
    """
    t, values, where = log.t, log.channels, log.where
    found: dict[str, ClockOffset | None] = {}
    if {"psi", "r"} <= values.keys() and _reverses(values["r"]):
        found["r"] = clock_offset(t, values["psi"], values["r"], {})
    rate = found.get("r")
    contradicted = rate is not None and rate.gain < 0.0 and rate.sure > _SURE
    if (
        "delta" in values
        and {"psi", "r"} & values.keys()
        and _reverses(values["delta"], _LEAST_RUDDER)
    ):
        late = rate.late if rate else 0.0
        r = (
            np.interp(t + late, t, values["r"])
            if "r" in values
            else time_derivative(t, values["psi"])
        )
        found["delta"] = rudder_offset(t, r, values["delta"])
        plain = clock_offset(t, r, values["delta"], {"r": r})
        against = [
            one is not None and one.gain < 0.0 and one.sure > _SURE
            for one in (found["delta"], plain)
        ]
        if all(against) and not contradicted:
            raise InputError(
                f"{where}: the yaw acceleration follows the rudder {_OTHER_SIGN}",
                _OTHER_SIDE,
            )
    elif {"psi", "delta"} <= values.keys() and _turns_against(
        values["psi"], values["delta"]
    ):
        raise InputError(
            f"{where}: the ship turns away from the rudder, {_OTHER_SIGN}", _OTHER_SIDE
        )
    own, notes = len({id(clock) for clock, _ in series.values()}) > 1, []
    changed: Series = {}
    for name, offset in found.items():
        error = math.hypot(offset.error, DYNAMICS_S[name]) if offset else 0.0
        if (
            offset is None
            or offset.sure < _SURE
            or abs(offset.late) < SIGNIFICANT * error
        ):
            continue
        told = (
            f"{_WORDS[name][0]} is {abs(offset.late):.2f} s"
            f" {'late' if offset.late > 0.0 else 'early'} against {_WORDS[name][1]}"
            f" (standard error {error:.2f} s)"
        )
        if choice == "keep" or (
            choice is None and not own and abs(offset.late) <= REFUSED_S[name]
        ):
            notes.append(f"{told}; left as logged")
        elif choice is None and not own:
            raise InputError(
                f"{where}: {told}, expected one clock; to have it corrected write"
                ' clock_offsets = "correct" in [sensors] of the ship file, or "keep"'
                " if it is so"
            )
        else:
            changed[name] = series[name][0] - offset.late, series[name][1]
            notes.append(f"{told}; corrected")
    return series | changed if changed else {}, notes
