"""Channels that contradict each other: heading, yaw rate, positions, velocities.

They are compared over windows in time, so that noise and offsets do not matter.
"""

import math
from typing import Any

import numpy as np

from shipgym.arrays import Floats, integral
from shipgym.errors import InputError
from shipgym.trials.columns import ColumnGuess, Locator
from shipgym.trials.conventions import Conventions
from shipgym.trials.resampling import Log, changes, usual_step
from shipgym.trials.units import DEGREE, fitting_units

_WINDOW = 10.0  # s, over which positions and headings change by more than noise


@np.errstate(over="ignore", invalid="ignore")  # of clocks that hardly move
def turning_gain(
    t: Floats, psi: Floats, swept: Floats, *, has_bias: bool = True
) -> float:
    """How many times as fast a heading changes as another angle; 1 for no verdict.

    That is a yaw rate's integral, whose sensor may have a bias, or the course. In SI
    units, without jumps.
    """
    largest = max(np.ptp(psi), np.ptp(swept))
    if largest < 2.0 * DEGREE:
        return 1.0

    known = _rates(t, swept)
    sought = _rates(t, psi)
    if has_bias:
        known -= known.mean()
        sought -= sought.mean()
    power = max(float(known @ known), 1e-300)
    gain = float(known @ sought) / power

    residual = sought - gain * known
    whole = np.linalg.norm(sought)
    is_clear = np.linalg.norm(residual) < 0.5 * whole
    is_usual = 0.2 < gain < 5.0
    return gain if is_clear and not is_usual else 1.0


def _rates(t: Floats, values: Floats) -> Floats:
    """Rates in windows."""
    edges = np.linspace(0, t.size - 1, num=31)
    rows = np.unique(np.rint(edges).astype(int))
    rates: Floats = np.diff(values[rows]) / np.diff(t[rows])
    return rates


def check_yaw_rate(log: Log, locator: Locator) -> None:
    """Refuse a yaw rate that cannot be the heading's, by its sign or its size."""
    swept = integral(log.t, log.channels["r"])
    gain = turning_gain(log.t, log.channels["psi"], swept)
    heading, rate = (locator.columns[channel].name for channel in ("psi", "r"))
    if gain < 0.0:
        raise InputError(
            f"{locator.path}: expected columns '{heading}' (heading) and '{rate}' (yaw"
            " rate) to be positive when the bow turns to starboard (clockwise seen from"
            " above), got opposite signs; change the sign of the column that is"
            " positive to port"
        )
    if gain != 1.0:
        proposals = _nearest_units(locator, psi=1.0 / gain, r=gain)
        raise _other_unit("yaw rate", gain, proposals, locator)


def _other_unit(
    other: str, gain: float, proposals: list[tuple[str, str]], locator: Locator
) -> InputError:
    """Fault of a heading that changes as another angle does, in another unit."""
    declarations = [locator.declaration(*one) for one in proposals]
    alternatives = " or ".join(declarations) or "the unit of each"
    heading = locator.columns["psi"].name
    return InputError(
        f"{locator.path}: expected column '{heading}' (heading) and the {other} to"
        f" agree, got a heading that changes {abs(gain):.3g} times as fast as the"
        f" {other} says; likely a wrong unit, declare {alternatives}",
        proposals,
    )


def _nearest_units(locator: Locator, **ratios: float) -> list[tuple[str, str]]:
    """Units of channels that are so many times the declared ones, by channel."""
    fitting = []
    for channel, ratio in ratios.items():
        declared = locator.columns[channel].unit
        for unit in fitting_units(channel, declared, ratio, apart=math.log(2.0)):
            fitting.append((channel, unit))
    return fitting


def check_steps(t: Floats, locator: Locator) -> list[str]:
    """Remark on a hole, and on rows so far apart that the unit of time may be wrong.

    `t` is in s.
    """
    step = usual_step(t)
    if 0.005 <= step <= 10.0:
        steps = np.diff(t)
        widest = int(np.argmax(steps))
        hole = steps[widest]
        if hole <= max(10.0 * step, 5.0):
            return []
        start = t[widest] - t[0]
        return [
            f"no rows for {hole:.3g} s from {start:.4g} s on; leave a manoeuvre that is"
            " interrupted out with cut"
        ]
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
    channels = log.channels
    velocity = channels["u"] + 1j * channels["v"]
    turned = velocity * np.exp(1j * channels["psi"])
    moved, *sailed = _moved(log, turned, velocity)
    other = "earth"
    if frame == "earth":
        other = "body"
        sailed.reverse()
    misfit, of_other = (np.linalg.norm(moved - one) for one in sailed)
    usual = 0.2 * np.linalg.norm(moved)
    if misfit > max(usual, 5.0 * of_other):
        u = locator.columns["u"].name
        v = locator.columns["v"].name
        raise InputError(
            f"{locator.path}: expected columns '{u}' and '{v}' to follow the positions"
            f" as velocities in the {frame} frame (velocity_frame"
            f' = "{frame}"), got velocities in the {other} frame; declare'
            f' velocity_frame = "{other}"',
            [("velocity_frame", other)],
        )
    _check_size(moved, sailed[0], locator)


def _moved(log: Log, *velocities: Any) -> list[Any]:
    """Changes of position in windows, m, as logged and by each of some velocities.

    All are north and, imaginary, east.
    """
    position = log.channels["x"] + 1j * log.channels["y"]
    sailed = [integral(log.t, one) for one in velocities]
    _, *moved = changes(log.t, _WINDOW, position, *sailed)
    return moved


def _check_size(moved: Any, expected: Any, locator: Locator) -> None:
    """Refuse positions that follow the velocities, but in another size.

    Both are as of :func:`_moved`.
    """
    squared = float(np.vdot(expected, expected).real)
    gain = complex(np.vdot(expected, moved)) / max(squared, 1e-300)
    misfit = np.linalg.norm(moved - gain * expected)
    follows = misfit < 0.2 * np.linalg.norm(moved)
    if not follows:
        return

    if 0.55 < abs(gain) < 1.8:
        return
    x, u = (locator.columns[channel].name for channel in "xu")
    raise InputError(
        f"{locator.path}: expected positions ('{x}') and velocities ('{u}') to agree,"
        f" got positions that change {abs(gain):.3g} times as fast as the velocities"
        " say; likely a wrong unit of one of them or of time, declare it"
    )


_SLOWEST = 0.3  # m/s over ground, of any manoeuvre


def check_over_ground(log: Log, conventions: Conventions, locator: Locator) -> None:
    """Refuse a ship at berth, and a heading that contradicts the course over ground.

    The channels are as logged, in SI units, the heading without jumps. Positions in
    metres may count from another axis than north: of them only the unit is judged.
    """
    north, east = log.ground_velocity
    speed = np.hypot(north, east)
    fastest = np.quantile(speed, 0.95)
    is_compass = "lat" in locator.columns or log.has("ground_north")
    if is_compass and fastest < _SLOWEST:
        raise InputError(
            f"{locator.path}: expected a manoeuvre, got a ship that makes at most"
            f" {fastest:.2g} m/s over ground: she is at berth or at anchor; read"
            " another log"
        )
    moving = speed > 0.3 * fastest  # a slow ship has no course
    if "psi" not in log.channels or np.count_nonzero(moving) < 3:
        return
    psi = log.channels["psi"][moving]
    course = np.arctan2(east, north)[moving]
    t, turned = log.t[moving], np.unwrap(course)
    gain = turning_gain(t, psi, turned, has_bias=False)
    proposals = _nearest_units(locator, psi=1.0 / abs(gain))
    declared = ("psi", locator.columns["psi"].unit)
    if proposals and declared not in proposals:
        raise _other_unit("course over ground", gain, proposals, locator)
    if not is_compass:
        return
    if gain < 0.0 and np.ptp(psi) > 20.0 * DEGREE:
        both = np.exp(1j * (course + psi))
        raise _mirrored(both.mean(), conventions, locator)
    fault = _heading_fault(psi, course, conventions.installation.heading_offset)
    if _is_unrelated(t, psi, turned):
        fault = "that turns with the course over ground, got another; name its column"
    if fault:
        raise InputError(f"{locator.path}: expected a heading {fault}")


def _is_unrelated(t: Floats, psi: Floats, course: Floats) -> bool:
    """Return whether a course goes round without the heading, which moves otherwise.

    Without jumps, rad. A heading that stands still, as that of a ferry, does not make
    it worse.
    """
    goes_round = np.ptp(course) > np.ptp(psi) + math.pi
    _, turned, expected = changes(t, _WINDOW, psi, course)
    left = np.linalg.norm(expected - turned)
    return bool(goes_round and left > 1.05 * np.linalg.norm(expected))


def check_track(log: Log, locator: Locator) -> None:
    """Refuse positions that do not go where the course over ground points to.

    Where that column is the heading, it leads the track in turns, and the column of the
    heading shows the track. Speeds have the right unit.
    """
    channels = log.channels
    velocity = channels["ground_north"] + 1j * channels["ground_east"]
    ahead = np.abs(velocity) * np.exp(1j * channels["psi"])
    moved, sailed, headed = _moved(log, velocity, ahead)
    misfit = np.linalg.norm(moved - sailed)
    by_heading = np.linalg.norm(moved - headed)
    _, turned = changes(log.t, _WINDOW, channels["psi"])
    lead = np.conj(moved) * sailed
    leads = turned @ lead.imag > 0.0
    is_exchanged = leads and by_heading < 0.3 * misfit
    if is_exchanged or misfit > 0.7 * np.linalg.norm(moved):
        follows = "follows the heading" if is_exchanged else "goes elsewhere"
        raise InputError(
            f"{locator.path}: expected positions that follow the course over ground,"
            f" got a track that {follows}; name the right columns of lat, lon, cog and"
            " psi"
        )


def check_speed_units(log: Log, locator: Locator) -> None:
    """Refuse a speed that is to the one over ground as one unit is to another.

    No current changes the speed of a ship by so much; of a unit that was guessed the
    nearest one is right. The channels are in SI units.
    """
    over_ground = _usual_speed(log)
    if over_ground < _SLOWEST:
        return
    for channel, speed in _speeds(log).items():
        if channel not in locator.columns:
            continue
        ratio = over_ground / max(speed, 1e-9)
        column = locator.columns[channel]
        is_guess = isinstance(column, ColumnGuess) and not column.is_named
        largest = 0.3 if is_guess else 0.16
        units = fitting_units(channel, column.unit, ratio, largest)
        is_usual = not is_guess and 0.6 < ratio < 1.67
        if is_usual or not units or units[0] == column.unit:
            continue
        declaration = locator.declaration(channel, units[0])
        raise InputError(
            f"{locator.path}: expected column '{column.name}' to agree with the speed"
            f" over ground, got {ratio:.3g} times as much over ground, which no current"
            f" does; likely a wrong unit, declare {declaration}",
            [(channel, units[0])],
        )


def _speeds(log: Log) -> dict[str, float]:
    """Median size of the speeds to compare with that over ground, m/s."""
    channels = log.channels
    speeds = {"stw": channels["stw"]} if log.has("stw") else {}
    if log.has("x", "ground_north"):
        speeds["sog"] = np.hypot(channels["ground_north"], channels["ground_east"])
    if log.has("u"):
        speeds["u"] = np.hypot(channels["u"], channels.get("v", 0.0))
    return {name: float(np.median(np.abs(one))) for name, one in speeds.items()}


def _usual_speed(log: Log) -> float:
    """Median speed over ground, m/s, by positions some seconds apart if there are."""
    if not log.has("x"):
        return float(np.median(np.hypot(*log.ground_velocity)))
    passed, north, east = changes(log.t, 5.0, log.channels["x"], log.channels["y"])
    return float(np.median(np.hypot(north, east) / passed))


def _mirrored(
    mirrored: complex, conventions: Conventions, locator: Locator
) -> InputError:
    """Fault of a heading that turns against the course, about north-east or else."""
    largest_drift = 0.4  # rad
    remedy = "change the sign of its column"
    proposals = []
    if abs(np.angle(mirrored * -1j)) <= largest_drift:
        frame = "ned" if conventions.frame == "enu" else "enu"
        proposals = [("frame", frame)]
        remedy = f'write frame = "{frame}" in [conventions], the frame of its angles'
    return InputError(
        f"{locator.path}: expected a heading clockwise from north, got one that"
        f" contradicts the course over ground: it turns the other way; {remedy}",
        proposals,
    )


def _heading_fault(psi: Floats, course: Floats, declared_offset: float) -> str:
    """Words for a heading that copies or is far from the course over ground.

    In rad, of shape (n_samples,). Empty for a sound one.
    """
    apart = np.exp(1j * (course - psi))
    mean = apart.mean()
    turned_deg = math.degrees(np.ptp(psi))
    if turned_deg > 20.0 and np.sqrt(np.mean(np.degrees(np.angle(apart)) ** 2)) < 0.3:
        return (
            "that differs from the course over ground where a ship drifts, got less"
            f" than 0.3 deg of difference in a turn of {turned_deg:.0f} deg; name the"
            ' gyro\'s column: psi = { column = "..." }'
        )
    if declared_offset:
        return ""
    offset = _constant_offset(psi, np.angle(mean) + np.angle(apart / mean))
    largest_deg = 25.0
    if offset is None:
        offset = -float(np.angle(mean))
        largest_deg = 60.0  # to which ships may drift in a turn
    offset_deg = math.degrees(offset)
    if abs(offset_deg) <= largest_deg or abs(mean) <= 0.7:
        return ""
    return (
        "clockwise from north, got one that contradicts the course over ground by"
        f" {offset_deg:.0f} deg; name the right column, or write heading_offset_deg ="
        f" {offset_deg:.0f} in [sensors]"
    )


def _constant_offset(psi: Floats, drift: Floats) -> float | None:
    """Part of the heading's difference from the course that does not turn, rad.

    A ship drifts outwards in a turn, and an antenna aft of midship more so: what she
    shows on straight parts is the heading's. None where she turns all the time. `drift`
    is the course over ground less the heading, without jumps.
    """
    turning = np.abs(np.gradient(psi))
    fastest = np.quantile(turning, 0.95)
    is_straight = turning <= 0.2 * fastest
    if is_straight.mean() <= 0.1:
        return None
    return -float(np.median(drift[is_straight]))
