"""Channels that contradict each other: heading and yaw rate, positions and velocities.

They are compared over windows in time, so that noise and offsets do not matter.
"""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Floats, integral
from shipgym.trials.columns import Locator
from shipgym.trials.plausibility.finding import LogFinding, Proposal
from shipgym.trials.plausibility.sampling import likelier_time_units
from shipgym.trials.resampling import Log
from shipgym.trials.units import DEGREE, QUANTITIES, UNITS, si_factor

MOST_WINDOWS = 30
SMALLEST_TURN = 2.0 * DEGREE  # of which heading and yaw rate are compared
#: Logarithm of the ratio of two rates that are the same in the right units.
_SAME_RATE = 0.5


class Fit(NamedTuple):
    """Least squares of a target by one regressor."""

    gain: complex
    misfit: float  # the residual's share of the target's norm


def check_yaw_rate(log: Log, locator: Locator) -> Iterator[LogFinding]:
    """Find a yaw rate that cannot be the heading's, by its sign or its size.

    The channels are in SI units, the heading without jumps.
    """
    turned = _without_trend(log.t, log.channels["psi"])
    expected = _without_trend(log.t, integral(log.t, log.channels["r"]))
    if max(np.ptp(turned), np.ptp(expected)) < SMALLEST_TURN:
        return
    gain, misfit = _fit(np.diff(expected), np.diff(turned))
    if misfit <= 0.5 and gain.real < 0.0:
        yield _opposite_signs(locator)
    elif misfit <= 0.5 and not 0.2 < gain.real < 5.0:
        yield _other_rate(gain.real, log.t, locator)


def _opposite_signs(locator: Locator) -> LogFinding:
    return LogFinding(
        locator.path,
        f"expected {_heading_and_rate(locator)} to be positive when the bow turns to"
        " starboard (clockwise seen from above), got opposite signs",
        "change the sign of the column that is positive to port",
    )


def _other_rate(gain: float, t: Floats, locator: Locator) -> LogFinding:
    proposals = _nearest_units(gain, t, locator)
    only_time = all(one.name == "t" for one in proposals)
    wrong = "of time" if only_time else "of one of them"
    declarations = " or ".join(locator.declaration(*one) for one in proposals)
    return LogFinding(
        locator.path,
        f"expected {_heading_and_rate(locator)} to agree, got a heading that changes"
        f" {gain:.3g} times as fast as the yaw rate says",
        f"likely a wrong unit {wrong}, declare {declarations}",
        tuple(proposals),
    )


def _heading_and_rate(locator: Locator) -> str:
    heading, rate = (locator.columns[channel].name for channel in ("psi", "r"))
    return f"columns '{heading}' (heading) and '{rate}' (yaw rate)"


def _nearest_units(gain: float, t: Floats, locator: Locator) -> list[Proposal]:
    """Units of which one would bring heading and yaw rate together.

    Where none does and the unit of time is in doubt, that comes first: two units are
    wrong.
    """
    distances = {}
    for channel, sign in (("psi", 1.0), ("r", -1.0)):
        declared = locator.columns[channel].unit
        for unit, factor in UNITS[QUANTITIES[channel]].items():
            if unit != declared:
                ratio = factor / si_factor(channel, declared)
                changed = gain * ratio**sign
                distances[Proposal(channel, unit)] = abs(math.log(changed))

    times = {
        Proposal("t", unit): abs(math.log(gain / scale))
        for unit, scale in likelier_time_units(t, locator).items()
    }
    nearest = min([*distances.values(), *times.values()])
    if times and nearest > _SAME_RATE:
        return list(times)[:1]
    distances |= times
    return [one for one, distance in distances.items() if distance < nearest + 0.01]


def check_velocity(log: Log, frame: str, locator: Locator) -> Iterator[LogFinding]:
    """Find velocities u and v that cannot be those of the positions, by their frame or their size.

    The channels are in SI units, the heading without jumps; `frame`, "body" or "earth",
    is the declared one of u and v.
    """
    channels = log.channels
    moved = np.diff(_at_windows(channels["x"] + 1j * channels["y"]))
    velocity = channels["u"] + 1j * channels["v"]
    turned = velocity * np.exp(1j * channels["psi"])
    frames = {"body": turned, "earth": velocity}
    fits = {
        name: _fit(np.diff(_at_windows(integral(log.t, one))), moved)
        for name, one in frames.items()
    }
    declared = fits[frame]
    other_frame = "earth" if frame == "body" else "body"
    other = fits[other_frame]

    is_much_better = declared.misfit > 0.03 and other.misfit < 0.2 * declared.misfit
    if is_much_better and 0.8 < other.gain.real < 1.25:
        yield _other_frame(frame, other_frame, locator)
    elif declared.misfit < 0.2 and not 0.55 < abs(declared.gain) < 1.8:
        yield _other_speed(abs(declared.gain), log.t, locator)


def _other_frame(frame: str, other: str, locator: Locator) -> LogFinding:
    u, v = (locator.columns[channel].name for channel in ("u", "v"))
    return LogFinding(
        locator.path,
        f"expected columns '{u}' and '{v}' to follow the positions as velocities in the"
        f' {frame} frame (velocity_frame = "{frame}"), got velocities in the {other}'
        " frame",
        f'declare velocity_frame = "{other}"',
        (Proposal("velocity_frame", other),),
    )


def _other_speed(gain: float, t: Floats, locator: Locator) -> LogFinding:
    x, y, u, v = (locator.columns[channel].name for channel in ("x", "y", "u", "v"))
    times = [
        Proposal("t", unit)
        for unit, scale in likelier_time_units(t, locator).items()
        if 0.55 < gain / scale < 1.8
    ]
    remedy = (
        f"likely a wrong unit of '{x}', '{y}' or of '{u}', '{v}' (a knot is 0.514 m/s):"
        " declare it"
    )
    if times:
        remedy = (
            f"likely a wrong unit of time, declare {locator.declaration(*times[0])}"
        )
    return LogFinding(
        locator.path,
        "expected positions and velocities to agree, got a position that changes"
        f" {gain:.3g} times as fast as the velocities say",
        remedy,
        tuple(times),
    )


def _at_windows(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The values at the edges of at most `MOST_WINDOWS` windows."""
    edges = np.linspace(0, values.size - 1, MOST_WINDOWS + 1)
    return np.asarray(values[np.unique(edges.round().astype(int))])


def _without_trend(t: Floats, values: Floats) -> Floats:
    """The values at the windows' edges without their straight line: a rate sensor has a bias."""
    time, ends = _at_windows(t - t[0]), _at_windows(values)
    slope, level = np.polyfit(time, ends, 1)
    return np.asarray(ends - slope * time - level)


def _fit(regressor: npt.NDArray[Any], target: npt.NDArray[Any]) -> Fit:
    """Fit target = gain * regressor by least squares."""
    power = float(np.vdot(regressor, regressor).real)
    size = float(np.linalg.norm(target))
    if power == 0.0 or size == 0.0:
        return Fit(1.0 + 0.0j, 1.0)
    gain = complex(np.vdot(regressor, target) / power)
    residual = float(np.linalg.norm(target - gain * regressor))
    return Fit(gain, residual / size)
