"""Channels that were logged on clocks of their own, and one clock for all."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Flags, Floats, integral
from shipgym.errors import InputError
from shipgym.trials.columns import Locator
from shipgym.trials.derivatives import time_derivative

#: Fewest samples of a trial, and of a channel.
FEWEST_SAMPLES = 3


class Signal(NamedTuple):
    """A channel on its own clock, SI units."""

    t: Floats
    values: Floats


Signals = dict[str, Signal]  # by channel


@dataclass
class Log:
    """Channels of one log on one clock, in SI units; corrections change it in place.

    Attributes
    ----------
    t : ndarray of shape (n_samples,)
        Time, s.
    channels : dict of str to ndarray of shape (n_samples,)
        Values by channel.
    locator : Locator
        Places of the values in the file.
    notes : list of str
        Remarks of readers, checks and corrections.
    derived : set of str
        Channels that were computed from others.
    repaired : dict of str to int
        How many values of a channel were filled in.
    over_ground : bool or None
        Whether surge and sway are velocities over ground; None: where they are derived.
    magnetic : bool
        Whether the heading counts from magnetic north.
    """

    t: Floats
    channels: dict[str, Floats]
    locator: Locator
    notes: list[str]
    derived: set[str] = field(default_factory=set)
    repaired: dict[str, int] = field(default_factory=dict)
    over_ground: bool | None = None
    magnetic: bool = False

    def needed(self, channel: str, what: str) -> Floats:
        """A channel with which another is converted; InputError where it is absent."""
        if channel not in self.channels or channel in self.derived:
            raise InputError(
                f"{self.locator.path}: expected {channel} to convert {what}, got"
                " none; name its column"
            )
        return self.channels[channel]

    def has(self, *channels: str) -> bool:
        """Return whether the log has all of these channels."""
        return all(channel in self.channels for channel in channels)

    @property
    def heading(self) -> Floats:
        """Heading, or that which follows from the yaw rate; without jumps, rad."""
        psi = self.channels.get("psi")
        return integral(self.t, self.channels["r"]) if psi is None else psi

    @property
    def ground_velocity(self) -> tuple[Floats, Floats]:
        """Velocity north and east over ground, m/s, as logged or by positions."""
        channels = self.channels
        if "ground_north" in channels:
            return channels["ground_north"], channels["ground_east"]
        north, east = (time_derivative(self.t, channels[name]) for name in "xy")
        return north, east

    def derive(self, channel: str, values: Floats) -> None:
        """Add a channel that follows from others."""
        self.channels[channel] = values
        self.derived.add(channel)


def usual_step(t: npt.NDArray[Any]) -> float:
    """Median step between samples, such as times in s."""
    return float(np.median(np.diff(t)))


def changes(t: Floats, seconds: float, *signals: Any) -> list[Any]:
    """Changes of the time and of signals over some seconds, at least one step."""
    rows = min(math.ceil(seconds / usual_step(t)), t.size - 1)
    return [one[rows:] - one[:-rows] for one in (t, *signals)]


def have_own_clocks(t: Floats, channels: Mapping[str, Floats]) -> bool:
    """Return whether missing values are those of channels at different rates.

    Then every row has a time and some value, and the values of some channel stand two
    rows or more apart as a rule.
    """
    # flags of shape (n_channels, n_rows)
    is_present = np.isfinite([*channels.values()])
    if not (np.isfinite(t) & is_present.any(axis=0)).all():
        return False
    rows = [np.flatnonzero(of_channel) for of_channel in is_present]
    return any(one.size >= FEWEST_SAMPLES and usual_step(one) >= 2.0 for one in rows)


def on_one_clock(
    signals: Mapping[str, Signal], locator: Locator, rows: Floats | None
) -> Log:
    """Put channels onto one clock.

    Where they do not share one already, it is that of the slowest channel of the
    motion, or that of the rows, s, in which some lack a value; the others are
    interpolated linearly. A hole in one of the motion's channels stays a hole. Raises
    InputError where too few moments are left.
    """
    first, *others = signals.values()
    if rows is None and all(one.t is first.t for one in others):
        channels = {name: signal.values for name, signal in signals.items()}
        return Log(first.t, channels, locator, notes=[])

    # between samples of the motion nothing is invented
    motion = {"x", "ground_north", "u", "psi", "r", "delta"} & signals.keys()
    clocks = {name: signals[name].t for name in signals if name in motion or not motion}
    t = rows
    if t is None:
        # to a millisecond; of equal ones the clock with fewer holes
        t = max(clocks.values(), key=lambda t: (round(usual_step(t), 3), t.size))
    # a longer one is a hole
    longest_step = 6.0 * usual_step(t)
    is_known = np.ones(t.size, dtype=bool)
    notes = []
    for name, clock in clocks.items():
        steps = np.diff(clock)
        is_hole = steps > longest_step
        is_known &= _inside(t, clock, is_hole)
        if is_hole.any():
            notes.append(
                f"{name} has {is_hole.sum()} holes, of up to {steps.max():.4g} s;"
                " nothing is put there"
            )

    t = t[is_known]
    if t.size < FEWEST_SAMPLES:
        raise InputError(
            f"{locator.path}: expected channels of one time, got {t.size} moments that"
            f" {', '.join(clocks)} have in common; check their clocks"
        )
    channels = {
        name: np.interp(t, signal.t, signal.values) for name, signal in signals.items()
    }
    log = Log(t, channels, locator, notes)
    if rows is not None:
        for name, signal in signals.items():
            is_filled = np.isin(t, signal.t, invert=True)
            log.repaired[name] = int(is_filled.sum())
    return log


def _inside(t: Floats, clock: Floats, is_hole: Flags) -> Flags:
    """Flags of times within a clock's span and in none of its holes."""
    after = np.clip(np.searchsorted(clock, t), 1, clock.size - 1)
    before = after - 1
    in_hole = is_hole[before] & (t > clock[before]) & (t < clock[after])
    # sentences of one moment are logged one after the other
    tolerance = 0.1 * usual_step(t) if t.size > 1 else 0.0
    has_begun = t >= clock[0] - tolerance
    inside: Flags = has_begun & (t <= clock[-1] + tolerance) & ~in_hole
    return inside
