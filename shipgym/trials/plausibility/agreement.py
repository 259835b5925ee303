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
from shipgym.trials.plausibility.refusal import Proposal, implausible
from shipgym.trials.plausibility.sampling import likelier_time_units
from shipgym.trials.resampling import Log
from shipgym.trials.units import DEGREE, QUANTITIES, UNITS


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

    heading = locator.columns["psi"].name
    rate = locator.columns["r"].name
    columns = f"columns '{heading}' (heading) and '{rate}' (yaw rate)"
    if gain > 0.0:
        raise _other_rate(gain, columns, log.t, locator)
    raise implausible(
        locator.path,
        f"expected {columns} to be positive when the bow turns to starboard (clockwise"
        " seen from above), got opposite signs",
        "change the sign of the column that is positive to port",
    )


def _other_rate(gain: float, columns: str, t: Floats, locator: Locator) -> InputError:
    proposals = _nearest_units(gain, t, locator)
    wrong = "of time"
    declarations = []
    for proposal in proposals:
        declaration = locator.declaration(*proposal)
        declarations.append(declaration)
        if proposal.name != "t":
            wrong = "of one of them"
    alternatives = " or ".join(declarations)
    return implausible(
        locator.path,
        f"expected {columns} to agree, got a heading that changes {gain:.3g} times as"
        " fast as the yaw rate says",
        f"likely a wrong unit {wrong}, declare {alternatives}",
        *proposals,
    )


def _nearest_units(gain: float, t: Floats, locator: Locator) -> list[Proposal]:
    """Units of which one would bring heading and yaw rate together.

    Where none does and the unit of time is in doubt, that comes first: two units are
    wrong.
    """
    gains = {}  # that are left with a unit
    for unit, ratio in _other_units("psi", locator).items():
        proposal = Proposal("psi", unit)
        gains[proposal] = gain * ratio
    for unit, ratio in _other_units("r", locator).items():
        proposal = Proposal("r", unit)
        gains[proposal] = gain / ratio
    time_units = []
    for unit, ratio in likelier_time_units(t, locator).items():
        proposal = Proposal("t", unit)
        gains[proposal] = gain / ratio
        time_units.append(proposal)

    distances = {}
    for proposal, left in gains.items():
        distances[proposal] = abs(math.log(left))
    nearest = min(distances.values())
    far = 0.5  # logarithm of the ratio of two rates that are not the same
    if time_units and nearest > far:
        return time_units[:1]

    proposals = []
    for proposal, distance in distances.items():
        if distance < nearest + 0.01:
            proposals.append(proposal)
    return proposals


def _other_units(channel: str, locator: Locator) -> dict[str, float]:
    """Units of a channel that were not declared, by how much larger they are."""
    declared = locator.columns[channel].unit
    quantity = QUANTITIES[channel]
    factors = dict(UNITS[quantity])
    own = factors.pop(declared)
    ratios = {}
    for unit, factor in factors.items():
        ratios[unit] = factor / own
    return ratios


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
    if is_off and is_better and has_right_size:
        raise _other_frame(frame, other_frame, locator)

    gain = abs(declared.gain)
    has_wrong_size = not 0.55 < gain < 1.8
    if declared.misfit < 0.2 and has_wrong_size:
        raise _other_speed(gain, log.t, locator)


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


def _other_frame(frame: str, other: str, locator: Locator) -> InputError:
    u = locator.columns["u"].name
    v = locator.columns["v"].name
    return implausible(
        locator.path,
        f"expected columns '{u}' and '{v}' to follow the positions as velocities in the"
        f' {frame} frame (velocity_frame = "{frame}"), got velocities in the {other}'
        " frame",
        f'declare velocity_frame = "{other}"',
        Proposal("velocity_frame", other),
    )


def _other_speed(gain: float, t: Floats, locator: Locator) -> InputError:
    times = []
    for unit, scale in likelier_time_units(t, locator).items():
        if 0.55 < gain / scale < 1.8:
            times.append(Proposal("t", unit))
    if times:
        declaration = locator.declaration(*times[0])
        wrong = f"time, declare {declaration}"
    else:
        x, y, u, v = (locator.columns[channel].name for channel in "xyuv")
        wrong = f"'{x}', '{y}' or of '{u}', '{v}' (a knot is 0.514 m/s): declare it"
    return implausible(
        locator.path,
        "expected positions and velocities to agree, got a position that changes"
        f" {gain:.3g} times as fast as the velocities say",
        f"likely a wrong unit of {wrong}",
        *times,
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
    time = _at_windows(t - t[0])
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
