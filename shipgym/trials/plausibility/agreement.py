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
from shipgym.trials.units import DEGREE, QUANTITIES, UNITS, si_factor


class GainFit(NamedTuple):
    """Least squares of a target by one regressor."""

    gain: complex
    misfit: float  # the residual's share of the target's norm


def check_yaw_rate(log: Log, locator: Locator) -> None:
    """Refuse a yaw rate that cannot be the heading's, by its sign or its size.

    The channels are in SI units, the heading without jumps.
    """
    integrated = integral(log.t, log.channels["r"])
    turned = _without_trend(log.t, log.channels["psi"])
    expected = _without_trend(log.t, integrated)
    largest_turn = max(np.ptp(turned), np.ptp(expected))
    if largest_turn < 2.0 * DEGREE:
        return

    fit = _fit_changes(expected, turned)
    gain = fit.gain.real
    is_other_motion = fit.misfit > 0.5
    if is_other_motion or 0.2 < gain < 5.0:
        return

    columns = "columns '{}' (heading) and '{}' (yaw rate)".format(
        *(locator.columns[channel].name for channel in ("psi", "r"))
    )
    if gain > 0.0:
        raise _other_rate(gain, columns, log.t, locator)
    raise InputError(
        f"{locator.path}: expected {columns} to be positive when the bow turns to"
        " starboard (clockwise seen from above), got opposite signs; change the sign of"
        " the column that is positive to port"
    )


def _other_rate(gain: float, columns: str, t: Floats, locator: Locator) -> InputError:
    proposals = _nearest_units(gain, t, locator)
    is_time = all(channel == "t" for channel, _ in proposals)
    wrong = "of time" if is_time else "of one of them"
    alternatives = " or ".join(locator.declaration(*one) for one in proposals)
    return InputError(
        f"{locator.path}: expected {columns} to agree, got a heading that changes"
        f" {gain:.3g} times as fast as the yaw rate says; likely a wrong unit {wrong},"
        f" declare {alternatives}",
        proposals,
    )


def _nearest_units(gain: float, t: Floats, locator: Locator) -> list[tuple[str, str]]:
    """Units of which one would bring heading and yaw rate together, by channel.

    Where none does and the unit of time is in doubt, that comes first: two units are
    wrong.
    """
    time_units = likelier_time_units(t, locator)
    distances = {}  # of the gains that are left with a unit
    for unit, ratio in _other_units("psi", locator).items():
        distances["psi", unit] = abs(math.log(gain * ratio))
    for channel, units in (("r", _other_units("r", locator)), ("t", time_units)):
        for unit, ratio in units.items():
            distances[channel, unit] = abs(math.log(gain / ratio))
    nearest = min(distances.values())
    far = 0.5  # logarithm of the ratio of two rates that are not the same
    if time_units and nearest > far:
        return [("t", next(iter(time_units)))]
    return [one for one, distance in distances.items() if distance < nearest + 0.01]


def _other_units(channel: str, locator: Locator) -> dict[str, float]:
    """Units of a channel that were not declared, by how much larger they are."""
    factors = dict(UNITS[QUANTITIES[channel]])
    own = factors.pop(locator.columns[channel].unit)
    return {unit: factor / own for unit, factor in factors.items()}


def likelier_time_units(t: Floats, locator: Locator) -> dict[str, float]:
    """Units of time that make unusual steps usual, and how much longer they are.

    None where the steps of the times, s, are usual already.
    """
    step = usual_step(t)
    if is_usual(step):
        return {}
    declared = si_factor("t", locator.columns["t"].unit)
    likelier = {
        unit: UNITS["time"][unit] / declared for unit in ("s", "ms", "min", "h")
    }
    return {unit: scale for unit, scale in likelier.items() if is_usual(scale * step)}


def is_usual(step: float) -> bool:
    """Return whether rows are usual in a manoeuvre that are so far apart, s."""
    return 0.01 <= step <= 10.0


def check_steps(t: Floats, locator: Locator) -> list[str]:
    """Remark on rows that are so far apart that the unit of time, s, may be wrong."""
    units = list(likelier_time_units(t, locator))
    if not units:
        return []
    return [
        f"the rows are {usual_step(t):.4g} s apart, which is unusual in a manoeuvre; if"
        f" the unit of time is wrong, declare {locator.declaration('t', units[0])}"
    ]


def check_velocity(log: Log, frame: str, locator: Locator) -> None:
    """Refuse velocities that do not follow the positions, by frame or size.

    The channels are in SI units, the heading without jumps; `frame`, "body" or "earth",
    is the declared one of u and v.
    """
    channels = log.channels
    velocity = channels["u"] + 1j * channels["v"]
    heading = np.exp(1j * channels["psi"])
    fits = {
        "body": _fit_track(log, velocity * heading),
        "earth": _fit_track(log, velocity),
    }
    declared = fits.pop(frame)
    other_frame, other = fits.popitem()

    is_off = declared.misfit > 0.03
    is_better = other.misfit < 0.2 * declared.misfit
    has_right_size = 0.8 < other.gain.real < 1.25
    names = {one: locator.columns[one].name for one in "xyuv"}
    if is_off and is_better and has_right_size:
        raise InputError(
            f"{locator.path}: expected columns '{names['u']}' and '{names['v']}' to"
            f" follow the positions as velocities in the {frame} frame (velocity_frame"
            f' = "{frame}"), got velocities in the {other_frame} frame; declare'
            f' velocity_frame = "{other_frame}"',
            [("velocity_frame", other_frame)],
        )
    gain = abs(declared.gain)
    if declared.misfit >= 0.2 or 0.55 < gain < 1.8:
        return
    time_units = []
    for unit, scale in likelier_time_units(log.t, locator).items():
        if 0.55 < gain / scale < 1.8:
            time_units.append(("t", unit))
    wrong = "'{x}', '{y}' or of '{u}', '{v}' (a knot is 0.514 m/s): declare it"
    wrong = wrong.format(**names)
    if time_units:
        wrong = f"time, declare {locator.declaration(*time_units[0])}"
    raise InputError(
        f"{locator.path}: expected positions and velocities to agree, got a position"
        f" that changes {gain:.3g} times as fast as the velocities say; likely a wrong"
        f" unit of {wrong}",
        time_units,
    )


def _fit_track(log: Log, velocity: npt.NDArray[np.complex128]) -> GainFit:
    """Fit the change of position, north + i east, by that which a velocity gives."""
    north = log.channels["x"]
    east = log.channels["y"]
    position = north + 1j * east
    sailed = integral(log.t, velocity)
    return _fit_changes(
        regressor=_at_windows(sailed),
        target=_at_windows(position),
    )


def _at_windows(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The values at the edges of at most 30 windows."""
    most_windows = 30
    last = values.size - 1
    edges = np.linspace(0, last, most_windows + 1)
    samples = np.rint(edges).astype(int)
    return values.take(np.unique(samples))


def _without_trend(t: Floats, values: Floats) -> Floats:
    """Values at the windows' edges without their line: a rate sensor has a bias."""
    since_start = t - t[0]
    time = _at_windows(since_start)
    at_edges = _at_windows(values)
    line = np.polyfit(time, at_edges, deg=1)
    trend = np.polyval(line, time)
    left: Floats = at_edges - trend
    return left


def _fit_changes(regressor: npt.NDArray[Any], target: npt.NDArray[Any]) -> GainFit:
    """Fit changes between windows of a target by gain times those of the regressor."""
    known = np.diff(regressor)
    sought = np.diff(target)
    power = np.vdot(known, known).real
    size = np.linalg.norm(sought)
    if power == 0.0 or size == 0.0:
        return GainFit(gain=1.0 + 0.0j, misfit=1.0)

    projection = np.vdot(known, sought)
    gain = complex(projection / power)
    residual = sought - gain * known
    unexplained = np.linalg.norm(residual)
    return GainFit(gain, misfit=float(unexplained / size))
