"""Channels that contradict each other: heading and yaw rate, positions and velocities.

They are compared over windows in time, so that noise and offsets do not matter.
"""

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Floats, integral
from shipgym.errors import InputError
from shipgym.trials.columns import Locator
from shipgym.trials.resampling import Log, usual_step
from shipgym.trials.units import DEGREE, QUANTITIES, UNITS


class GainFit(NamedTuple):
    """Least squares of a target by one regressor."""

    gain: complex
    misfit: float  # the residual's share of the target's norm


def rate_gain(t: Floats, psi: Floats, r: Floats) -> float:
    """How many times as fast a heading changes as the yaw rate says; 1 for no verdict.

    The channels are in SI units, the heading without jumps.
    """
    turned = _without_trend(t, psi)
    expected = _without_trend(t, integral(t, r))
    fit = _fit_changes(expected, turned)
    gain = fit.gain.real
    is_small = max(np.ptp(turned), np.ptp(expected)) < 2.0 * DEGREE
    is_usual_gain = 0.2 < gain < 5.0
    return 1.0 if is_small or fit.misfit > 0.5 or is_usual_gain else gain


def check_yaw_rate(log: Log, locator: Locator) -> None:
    """Refuse a yaw rate that cannot be the heading's, by its sign or its size."""
    gain = rate_gain(log.t, log.channels["psi"], log.channels["r"])
    heading, rate = (locator.columns[channel].name for channel in ("psi", "r"))
    expected = f"{locator.path}: expected columns '{heading}' (heading) and '{rate}'"
    if gain < 0.0:
        raise InputError(
            f"{expected} (yaw rate) to be positive when the bow turns to starboard"
            " (clockwise seen from above), got opposite signs; change the sign of the"
            " column that is positive to port"
        )
    if gain != 1.0:
        proposals = _nearest_units(gain, locator)
        alternatives = " or ".join(locator.declaration(*one) for one in proposals)
        raise InputError(
            f"{expected} (yaw rate) to agree, got a heading that changes {gain:.3g}"
            " times as fast as the yaw rate says; likely a wrong unit, declare"
            f" {alternatives}",
            proposals,
        )


def _nearest_units(gain: float, locator: Locator) -> list[tuple[str, str]]:
    """Units of which one would bring heading and yaw rate together, by channel."""
    distances = {}  # of the gains that are left with a unit
    for channel, power in (("psi", 1.0), ("r", -1.0)):
        factors = UNITS[QUANTITIES[channel]]
        own = factors[locator.columns[channel].unit]
        for unit, factor in factors.items():
            distances[channel, unit] = abs(math.log(gain * (factor / own) ** power))
    nearest = min(distances.values())
    return [one for one, distance in distances.items() if distance < nearest + 0.01]


def check_steps(t: Floats, locator: Locator) -> list[str]:
    """Remark on rows that are so far apart that the unit of time, s, may be wrong."""
    step = usual_step(t)
    if 0.005 <= step <= 10.0:
        return []
    unit = "ms" if step > 10.0 else "min"
    return [
        f"the rows are {step:.4g} s apart, which is unusual in a manoeuvre; if the unit"
        f" of time is wrong, declare {locator.declaration('t', unit)}"
    ]


def check_velocity(log: Log, frame: str, locator: Locator) -> None:
    """Refuse velocities that do not follow the positions in their frame.

    The channels are in SI units, the heading without jumps; `frame`, "body" or "earth",
    is the declared one of u and v.
    """
    velocity = log.channels["u"] + 1j * log.channels["v"]
    heading = np.exp(1j * log.channels["psi"])
    position = log.channels["x"] + 1j * log.channels["y"]
    fits = {
        name: _fit_changes(
            _at_windows(integral(log.t, over_ground)), _at_windows(position)
        )
        for name, over_ground in (("body", velocity * heading), ("earth", velocity))
    }
    declared = fits.pop(frame)
    other_frame, other = fits.popitem()

    is_off = declared.misfit > max(0.03, 5.0 * other.misfit)
    u, v = (locator.columns[one].name for one in "uv")
    if is_off and 0.8 < other.gain.real < 1.25:
        raise InputError(
            f"{locator.path}: expected columns '{u}' and '{v}' to follow the positions"
            f" as velocities in the {frame} frame (velocity_frame"
            f' = "{frame}"), got velocities in the {other_frame} frame; declare'
            f' velocity_frame = "{other_frame}"',
            [("velocity_frame", other_frame)],
        )


def _at_windows(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The values at the edges of at most 30 windows."""
    edges = np.linspace(0, values.size - 1, num=31)
    return values.take(np.unique(np.rint(edges).astype(int)))


def _without_trend(t: Floats, values: Floats) -> Floats:
    """Values at the windows' edges without their line: a rate sensor has a bias."""
    time = _at_windows((t - t[0]) / (t[-1] - t[0]))
    at_edges = _at_windows(values)
    left: Floats = at_edges - np.polyval(np.polyfit(time, at_edges, deg=1), time)
    return left


def _fit_changes(regressor: npt.NDArray[Any], target: npt.NDArray[Any]) -> GainFit:
    """Fit changes between windows of a target by gain times those of the regressor."""
    known = np.diff(regressor)
    sought = np.diff(target)
    projection = np.vdot(known, sought)
    power = np.vdot(known, known).real
    size = np.linalg.norm(sought)
    if power == 0.0 or size == 0.0:
        return GainFit(gain=1.0 + 0.0j, misfit=1.0)
    gain = complex(projection / power)
    residual = sought - gain * known
    unexplained = np.linalg.norm(residual)
    return GainFit(gain, misfit=float(unexplained / size))
