"""Channels that contradict each other: heading and yaw rate, positions and velocities.

They are compared over windows in time, so that noise and offsets do not matter.
"""

import numpy as np

from shipgym.arrays import Floats, integral
from shipgym.errors import InputError
from shipgym.trials.columns import Locator
from shipgym.trials.resampling import Log, changes, usual_step
from shipgym.trials.units import DEGREE, QUANTITIES, UNITS, si_factor


def rate_gain(t: Floats, psi: Floats, r: Floats) -> float:
    """How many times as fast a heading changes as the yaw rate says; 1 for no verdict.

    The channels are in SI units, the heading without jumps.
    """
    turned = _without_trend(t, psi)
    swept = integral(t, r)
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
        declarations = [locator.declaration(*one) for one in proposals]
        alternatives = " or ".join(declarations) or "the unit of each"
        raise InputError(
            f"{expected} (yaw rate) to agree, got a heading that changes {gain:.3g}"
            " times as fast as the yaw rate says; likely a wrong unit, declare"
            f" {alternatives}",
            proposals,
        )


def _nearest_units(gain: float, locator: Locator) -> list[tuple[str, str]]:
    """Units of which one would bring heading and yaw rate together, by channel."""
    fitting = []
    for channel, power in (("psi", 1.0), ("r", -1.0)):
        own = si_factor(channel, locator.columns[channel].unit)
        for unit, factor in UNITS[QUANTITIES[channel]].items():
            left = gain * (factor / own) ** power
            if 0.5 < left < 2.0:
                fitting.append((channel, unit))
    return fitting


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
    channels = log.channels
    velocity = channels["u"] + 1j * channels["v"]
    heading = np.exp(1j * channels["psi"])
    position = channels["x"] + 1j * channels["y"]
    over_ground = {"body": velocity * heading, "earth": velocity}
    misfits = {}
    for name, one in over_ground.items():
        sailed = integral(log.t, one)
        _, moved, expected = changes(log.t, 10.0, position, sailed)
        misfits[name] = np.linalg.norm(moved - expected)

    declared = misfits.pop(frame)
    ((other, misfit),) = misfits.items()
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
