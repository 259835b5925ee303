"""Channels that were logged on clocks of their own, and one clock for all."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Flags, Floats
from shipgym.errors import InputError

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
    where : str
        What messages begin with: the file.
    notes : list of str
        Remarks of readers, checks and corrections.
    derived : set of str
        Channels that were computed from others.
    repaired : dict of str to int
        How many values of a channel were filled in.
    over_ground : bool or None
        Whether surge and sway are velocities over ground; None: where they are derived.
    start : float or None
        Clock at t = 0 as the file has it, s since 1970 or of the day.
    magnetic : bool
        Whether the heading counts from magnetic north.
    """

    t: Floats
    channels: dict[str, Floats]
    where: str
    notes: list[str]
    derived: set[str] = field(default_factory=set)
    repaired: dict[str, int] = field(default_factory=dict)
    over_ground: bool | None = None
    start: float | None = None
    magnetic: bool = False

    def has(self, *channels: str) -> bool:
        """Return whether the log has all of these channels."""
        return all(channel in self.channels for channel in channels)

    def derive(self, channel: str, values: Floats) -> None:
        """Add a channel that follows from others."""
        self.channels[channel] = values
        self.derived.add(channel)


def usual_step(t: npt.NDArray[Any]) -> float:
    """Median step between samples, such as times in s."""
    return float(np.median(np.diff(t)))


def have_own_clocks(t: Floats, channels: Mapping[str, Floats]) -> bool:
    """Return whether missing values are those of channels at different rates.

    Then every row has a time and some value, and the values of some channel stand two
    rows or more apart as a rule.
    """
    # flags of shape (n_channels, n_rows)
    is_present = np.isfinite(list(channels.values()))
    has_value = is_present.any(axis=0)
    has_time = np.isfinite(t)
    is_whole = has_time & has_value
    if not is_whole.all():
        return False
    for of_channel in is_present:
        rows = np.flatnonzero(of_channel)
        if rows.size >= FEWEST_SAMPLES and usual_step(rows) >= 2.0:
            return True
    return False


def share_clock(signals: Mapping[str, Signal]) -> bool:
    """Return whether all channels were logged by one and the same clock."""
    clocks = {id(signal.t) for signal in signals.values()}
    return len(clocks) == 1


def on_one_clock(signals: Mapping[str, Signal], where: str) -> Log:
    """Put channels onto one clock.

    Where they do not share one already, it is that of the slowest channel of the
    motion, where all of these have values; the others are interpolated linearly. A hole
    in one of the motion's channels stays a hole. Raises InputError where too few
    moments are left.
    """
    if not share_clock(signals):
        return _resampled(signals, where)
    channels = {}
    for name, signal in signals.items():
        t = signal.t
        channels[name] = signal.values
    return Log(
        t=t,
        channels=channels,
        where=where,
        notes=[],
    )


def _resampled(signals: Mapping[str, Signal], where: str) -> Log:
    clocks = _motion_clocks(signals)
    t = max(clocks.values(), key=_slowness)
    # a longer one is a hole
    longest_step = 6.0 * usual_step(t)

    is_known = np.ones(t.size, dtype=bool)
    notes = []
    for name, clock in clocks.items():
        steps = np.diff(clock)
        is_hole = steps > longest_step
        is_known &= _inside(t, clock, is_hole)
        count = np.count_nonzero(is_hole)
        if count:
            longest = steps.max()
            notes.append(
                f"{name} has {count} holes, of up to {longest:.4g} s;"
                " nothing is put there"
            )

    t = t[is_known]
    if t.size < FEWEST_SAMPLES:
        names = ", ".join(clocks)
        raise InputError(
            f"{where}: expected channels of one time, got {t.size} moments that"
            f" {names} have in common; check their clocks"
        )
    channels = {}
    for name, signal in signals.items():
        channels[name] = np.interp(t, signal.t, signal.values)
    return Log(
        t=t,
        channels=channels,
        where=where,
        notes=notes,
    )


def _slowness(t: Floats) -> tuple[float, int]:
    """Usual step to a millisecond, s; of equal ones the clock with fewer holes."""
    return round(usual_step(t), 3), t.size


def _motion_clocks(signals: Mapping[str, Signal]) -> dict[str, Floats]:
    """Clocks of the motion's channels, between whose samples nothing is invented.

    Those of all channels where there is none of the motion.
    """
    motion = {"x", "ground_north", "u", "psi", "r", "delta"}
    all_clocks = {}
    of_motion = {}
    for name, signal in signals.items():
        all_clocks[name] = signal.t
        if name in motion:
            of_motion[name] = signal.t
    return of_motion or all_clocks


def _inside(t: Floats, clock: Floats, is_hole: Flags) -> Flags:
    """Flags of times within a clock's span and in none of its holes."""
    after = np.searchsorted(clock, t)
    after = np.clip(after, 1, clock.size - 1)
    before = after - 1
    is_after = t > clock[before]
    is_before = t < clock[after]
    in_hole = is_hole[before] & is_after & is_before

    # sentences of one moment are logged one after the other
    tolerance = 0.1 * usual_step(t) if t.size > 1 else 0.0
    has_begun = t >= clock[0] - tolerance
    has_ended = t > clock[-1] + tolerance
    inside: Flags = has_begun & ~has_ended & ~in_hole
    return inside
