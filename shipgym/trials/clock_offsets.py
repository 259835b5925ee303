"""Offsets between the clocks of sensors: yaw rate against heading, rudder against yaw acceleration.

Each is the delay at which one channel explains the other best, by least squares over windows of some seconds,
which is a band-pass: slower than that both are bound by the ship, faster is noise. The rudder's part in the yaw
acceleration is instantaneous, all the rest of it follows from yaw rate, sway and their history.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats, integral
from shipgym.errors import InputError
from shipgym.trials.derivatives import time_derivative

#: Delays that are looked for, s, and the significance, in standard errors, from which one is corrected.
LONGEST_S, SIGNIFICANT = 10.0, 2.5
#: By how much ships of other dynamics seem late, s, which the standard errors contain.
DYNAMICS_S = {"r": 0.1, "delta": 1.0}
#: Delays of channels on one clock that are refused, s.
REFUSED_S = {"r": 1.0, "delta": 2.0}
_WORDS = {"r": ("the yaw rate", "the heading"), "delta": ("the rudder", "the yaw acceleration")}
_LEAST_RUDDER = math.radians(2.0)
_WINDOW_S, _FEWEST = 5.0, 60
_MEMORIES_S = (20.0, 80.0)
_LEAST_DIRECTION = 0.02  # of what explains the change beside the channel
_SURE = 5.0  # standard errors by which the channel must tell on the other


class ClockOffset(NamedTuple):
    """How late a channel is, s, with its standard error, and what it tells there."""

    late: float
    error: float
    gain: float
    sure: float  # the gain in standard errors


def clock_offset(t: Floats, target: Floats, late: Floats, others: Mapping[str, Floats]) -> ClockOffset | None:
    """How late a channel is against the change of a target; None where nothing can be said.

    `target` is differentiated over windows of time, s; `others` are what explains it beside the channel.
    """
    step = max(float(np.median(np.diff(t))), 0.05)
    grid = np.arange(t[0] + LONGEST_S + _WINDOW_S, t[-1] - LONGEST_S - _WINDOW_S, step)
    if grid.size < _FEWEST:
        return None
    half = 0.5 * max(_WINDOW_S, 2.0 * step)
    change = (np.interp(grid + half, t, target) - np.interp(grid - half, t, target)) / (2.0 * half)
    sums = {name: integral(t, values) for name, values in (*others.items(), ("", late))}

    def mean(name: str, delay: float = 0.0) -> Floats:
        ends = (np.interp(grid + delay + sign * half, t, sums[name]) for sign in (1.0, -1.0))
        return np.asarray(np.subtract(*ends) / (2.0 * half))

    known = np.column_stack([np.ones(grid.size), *(mean(name) for name in others)])
    basis, sizes, _ = np.linalg.svd(known / np.linalg.norm(known, axis=0), full_matrices=False)
    basis = basis[:, sizes > _LEAST_DIRECTION]
    change = change - basis @ (basis.T @ change)
    power = float(change @ change)

    def unexplained(delay: float) -> tuple[float, float, Floats]:
        column = mean("", delay)
        column = column - basis @ (basis.T @ column)
        gain = float(column @ change) / max(float(column @ column), 1e-300)
        left = change - gain * column
        return float(left @ left), gain, left

    delays = np.arange(-LONGEST_S, LONGEST_S + 0.1, 0.25)
    errors = np.array([unexplained(delay)[0] for delay in delays])
    k = int(np.clip(np.argmin(errors), 1, delays.size - 2))
    curve = errors[k - 1] - 2.0 * errors[k] + errors[k + 1]
    if curve <= 1e-12 * power or not 0 < int(np.argmin(errors)) < delays.size - 1:
        return None
    best = float(delays[k] + 0.25 * 0.5 * (errors[k - 1] - errors[k + 1]) / curve)
    least, gain, left = unexplained(best)
    memory = max(float(left[1:] @ left[:-1]) / max(least, 1e-300), 0.0)
    free = max(grid.size * (1.0 - memory) / (1.0 + memory), 2.0)
    error = math.sqrt(2.0 * least / free / (curve / 0.25**2))
    return ClockOffset(best, error, gain, math.sqrt(free * max(power / max(least, 1e-300) - 1.0, 0.0)))


def remembered(t: Floats, values: Floats, memory: float) -> Floats:
    """A signal behind a first-order lag of some seconds."""
    from scipy.signal import lfilter

    grid = np.linspace(t[0], t[-1], t.size)
    share = 1.0 - math.exp(-(grid[1] - grid[0]) / memory)
    filtered = lfilter([share], [1.0, share - 1.0], np.interp(grid, t, values))
    return np.asarray(np.interp(t, grid, filtered))


def rudder_offset(t: Floats, r: Floats, delta: Floats) -> ClockOffset | None:
    """How late the rudder is against the yaw acceleration."""
    others = {"r": r, "r3": r**3}
    others |= {
        f"{name}{m}": remembered(t, one, m) for name, one in (("r", r), ("d", delta)) for m in _MEMORIES_S
    }
    return clock_offset(t, r, delta, others)


def _opposes(t: Floats, r: Floats, delta: Floats) -> bool:
    """Whether the rudder opposes the yaw acceleration by the yaw rate alone too."""
    plain = clock_offset(t, r, delta, {"r": r})
    return plain is not None and plain.gain < 0.0 and plain.sure > _SURE


def corrected_clocks(
    t: Floats, values: Mapping[str, Floats], series: Mapping[str, tuple[Floats, Floats]], choice: str | None, where: str
) -> tuple[dict[str, tuple[Floats, Floats]], list[str]]:
    """The channels with late yaw rate and rudder put right, none where nothing is, and what was found in words.

    `choice` is that of :class:`shipgym.trials.navigation.Instruments`: without one, channels on one clock are
    not touched, and more than `REFUSED_S` between them is an InputError, as is a rudder of the wrong sign.
    """
    found: dict[str, ClockOffset | None] = {}
    if "psi" in values and "r" in values:
        found["r"] = clock_offset(t, values["psi"], values["r"], {})
    if "delta" in values and ({"psi", "r"} & values.keys()) and np.ptp(values["delta"]) > _LEAST_RUDDER:
        late = found["r"].late if found.get("r") else 0.0
        r = np.interp(t + late, t, values["r"]) if "r" in values else time_derivative(t, values["psi"])
        found["delta"] = rudder_offset(t, r, values["delta"])
    own = len({id(clock) for clock, _ in series.values()}) > 1
    changed: dict[str, tuple[Floats, Floats]] = {}
    notes = []
    for name, offset in found.items():
        if offset is None or offset.sure < _SURE:
            continue
        told, other = _WORDS[name]
        if name == "delta" and offset.gain < 0.0 and _opposes(t, r, values["delta"]):
            raise InputError(
                f"{where}: the yaw acceleration follows the rudder with the opposite sign, expected a positive "
                'rudder to turn the bow to starboard; write rudder_positive = "port" in [conventions], or take it '
                "out if it stands there"
            )
        error = math.hypot(offset.error, DYNAMICS_S[name])
        if abs(offset.late) < SIGNIFICANT * error:
            continue
        way = "late" if offset.late > 0.0 else "early"
        found_words = (
            f"{told} is {abs(offset.late):.2f} s {way} against {other} (standard error {error:.2f} s)"
        )
        if choice == "keep" or (choice is None and not own and abs(offset.late) <= REFUSED_S[name]):
            notes.append(f"{found_words}; left as logged")
        elif choice == "correct" or own:
            clock, logged = series[name]
            changed[name] = clock - offset.late, logged
            notes.append(f"{found_words}; corrected")
        else:
            raise InputError(
                f"{where}: {found_words}, expected one clock; to have it corrected write clock_offsets = "
                '"correct" in [sensors] of the ship file, or "keep" if it is the ship\'s own'
            )
    return {**series, **changed} if changed else {}, notes
