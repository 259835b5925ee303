"""Channels that contradict each other: heading, yaw rate, positions, velocities.

They are compared over windows in time, so that noise and offsets do not matter.
"""

import math

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Floats, integral
from shipgym.errors import InputError
from shipgym.trials.columns import ColumnGuess, Locator
from shipgym.trials.conventions import Conventions
from shipgym.trials.resampling import Log, changes, usual_step
from shipgym.trials.units import DEGREE, fitting_units


def turning_gain(t: Floats, psi: Floats, swept: Floats) -> float:
    """How many times as fast a heading changes as another angle; 1 for no verdict.

    That is a yaw rate's integral, or the course. In SI units, without jumps.
    """
    turned = _without_trend(t, psi)
    expected = _without_trend(t, swept)
    largest = max(np.ptp(turned), np.ptp(expected))
    if largest < 2.0 * DEGREE:
        return 1.0

    known = np.diff(expected)
    sought = np.diff(turned)
    power = max(float(known @ known), 1e-300)
    gain = float(known @ sought) / power
    residual = sought - gain * known
    whole = np.linalg.norm(sought)
    is_clear = np.linalg.norm(residual) < 0.5 * whole
    is_usual = 0.2 < gain < 5.0
    return gain if is_clear and not is_usual else 1.0


def _without_trend(t: Floats, values: Floats) -> Floats:
    """Values at the edges of windows without their line: a rate sensor has a bias."""
    edges = np.linspace(0, t.size - 1, num=31)
    rows = np.unique(np.rint(edges).astype(int))
    at_edges = values[rows]
    passed = t[rows] - t[0]
    time = passed / (t[-1] - t[0])
    line = np.polyfit(time, at_edges, deg=1)
    left: Floats = at_edges - np.polyval(line, time)
    return left


def check_yaw_rate(log: Log, locator: Locator) -> None:
    """Refuse a yaw rate that cannot be the heading's, by its sign or its size."""
    swept = integral(log.t, log.channels["r"])
    gain = turning_gain(log.t, log.channels["psi"], swept)
    heading, rate = (locator.columns[channel].name for channel in ("psi", "r"))
    expected = f"{locator.path}: expected columns '{heading}' (heading) and '{rate}'"
    if gain < 0.0:
        raise InputError(
            f"{expected} (yaw rate) to be positive when the bow turns to starboard"
            " (clockwise seen from above), got opposite signs; change the sign of the"
            " column that is positive to port"
        )
    if gain != 1.0:
        proposals = _nearest_units(locator, psi=1.0 / gain, r=gain)
        declarations = [locator.declaration(*one) for one in proposals]
        alternatives = " or ".join(declarations) or "the unit of each"
        raise InputError(
            f"{expected} (yaw rate) to agree, got a heading that changes {gain:.3g}"
            " times as fast as the yaw rate says; likely a wrong unit, declare"
            f" {alternatives}",
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
    position = channels["x"] + 1j * channels["y"]
    body = integral(log.t, velocity * np.exp(1j * channels["psi"]))
    earth = integral(log.t, velocity)
    _, moved, *sailed = changes(log.t, 10.0, position, body, earth)
    told = dict(zip(("body", "earth"), sailed, strict=True))
    expected = told.pop(frame)
    ((other, in_other),) = told.items()
    declared = np.linalg.norm(moved - expected)
    misfit = np.linalg.norm(moved - in_other)
    usual = 0.2 * np.linalg.norm(moved)
    if declared > max(usual, 5.0 * misfit):
        u = locator.columns["u"].name
        v = locator.columns["v"].name
        raise InputError(
            f"{locator.path}: expected columns '{u}' and '{v}' to follow the positions"
            f" as velocities in the {frame} frame (velocity_frame"
            f' = "{frame}"), got velocities in the {other} frame; declare'
            f' velocity_frame = "{other}"',
            [("velocity_frame", other)],
        )
    _check_size(moved, expected, locator)


def _check_size(
    moved: npt.NDArray[np.complex128],
    expected: npt.NDArray[np.complex128],
    locator: Locator,
) -> None:
    """Refuse positions that follow the velocities, but in another size.

    Both are changes of position in some windows, m: north and, imaginary, east.
    """
    squared = float(np.vdot(expected, expected).real)
    gain = complex(np.vdot(expected, moved)) / max(squared, 1e-300)
    misfit = np.linalg.norm(moved - gain * expected)
    follows = misfit < 0.2 * np.linalg.norm(moved)
    if not follows or 0.55 < abs(gain) < 1.8:
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
    _check_heading_unit(log.t[moving], psi, np.unwrap(course), locator)
    if not is_compass:
        return
    apart = np.exp(1j * (course - psi))
    agreement = abs(apart.mean())
    both = np.exp(1j * (course + psi))
    mirrored = both.mean()
    is_turning = np.ptp(psi) > 20.0 * DEGREE
    limit = max(0.95, agreement + 0.02)
    if is_turning and abs(mirrored) > limit:
        raise _mirrored(mirrored, conventions, locator)
    fault = _heading_fault(psi, course, conventions.installation.heading_offset)
    if fault:
        raise InputError(f"{locator.path}: expected a heading {fault}")


def _check_heading_unit(
    t: Floats, psi: Floats, course: Floats, locator: Locator
) -> None:
    """Refuse a heading that turns as the course over ground, but in another unit."""
    gain = abs(turning_gain(t, psi, course))
    proposals = _nearest_units(locator, psi=1.0 / gain)
    declared = ("psi", locator.columns["psi"].unit)
    if proposals and declared not in proposals:
        raise InputError(
            f"{locator.path}: expected a heading that turns with the course over"
            f" ground, got one that turns {gain:.3g} times as fast; likely a wrong"
            f" unit, declare {locator.declaration(*proposals[0])}",
            proposals,
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
        unit = next(iter(units), "")
        is_usual = not is_guess and 0.6 < ratio < 1.67
        is_own = unit == column.unit
        if is_usual or is_own or not unit:
            continue
        declaration = locator.declaration(channel, unit)
        raise InputError(
            f"{locator.path}: expected column '{column.name}' to agree with the speed"
            f" over ground, got {ratio:.3g} times as much over ground, which no current"
            f" does; likely a wrong unit, declare {declaration}",
            [(channel, unit)],
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
    speeds = np.hypot(north, east) / passed
    return float(np.median(speeds))


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
