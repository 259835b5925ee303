"""Channels that were logged at different rates, each on a clock of its own, and one clock for all of them."""

from dataclasses import dataclass, field

import numpy as np

from shipgym.arrays import Flags, Floats
from shipgym.errors import InputError
from shipgym.trials.columns import Source

#: Time and values of each channel.
Series = dict[str, tuple[Floats, Floats]]
#: The slowest of these gives the common clock, so that nothing of the motion is
#: invented between samples.
MOTION = ("x", "ground_north", "u", "psi", "r", "delta")
#: A step this many times the usual one of a channel is a hole, not a slow clock.
HOLE_STEPS = 6.0
_FEWEST = 3


@dataclass
class Log:
    """The channels of one log on one clock, in SI units; corrections change it in place."""

    t: Floats
    channels: dict[str, Floats]  # by name, shape (n_samples,)
    where: str  # start of messages: the file
    notes: list[str]  # remarks of the readers and corrections
    derived: set[str] = field(default_factory=set)
    repaired: dict[str, int] = field(
        default_factory=dict
    )  # how many values of a channel were filled in
    over_ground: bool | None = (
        None  # whether surge and sway are; None: where they are derived
    )
    start: float | None = (
        None  # clock at t = 0 as the file has it, s since 1970 or of the day
    )

    def derive(self, channel: str, values: Floats) -> None:
        """Add a channel that follows from others."""
        self.channels[channel] = values
        self.derived.add(channel)


def have_own_clocks(present: Flags) -> bool:
    """Whether blanks, shape (n_rows, n_columns), are those of channels at different rates.

    Then every row has some value, and the values of some channel stand two rows or more
    apart as a rule.
    """
    rows = [np.flatnonzero(column) for column in present.T]
    return bool(present.any(axis=1).all()) and any(
        one.size >= _FEWEST and np.median(np.diff(one)) >= 2.0 for one in rows
    )


def own_clock(
    channel: str, t: Floats, values: Floats, source: Source
) -> tuple[Floats, Floats]:
    """Time and values of a channel where it has some; InputError for too few or time that goes back."""
    rows = np.flatnonzero(np.isfinite(values))
    clock, name = t[rows], source.columns[channel].name
    if rows.size < _FEWEST:
        raise InputError(
            f"{source.table.path}: column '{name}' has {rows.size} values, expected"
            f" {_FEWEST} or more; leave it out"
        )
    back = np.diff(clock) <= 0.0
    if back.any():
        k = int(np.argmax(back))
        raise InputError(
            f"{source.at(int(rows[k + 1]), 't')}: time goes from {clock[k]:.10g} to"
            f" {clock[k + 1]:.10g} s between values of '{name}', expected it to"
            " increase; sort the rows, or, where two ships or receivers are in the"
            " file, keep those of one"
        )
    return clock, values[rows]


def on_one_clock(series: Series, where: str) -> Log:
    """Channels on clocks of their own on one.

    The clock is that of the slowest channel of the motion, where all of these have
    values; the others are interpolated linearly onto it. A hole in one of the motion's
    channels stays a hole.
    """
    clocks = [clock for clock, _ in series.values()]
    if all(clock is clocks[0] for clock in clocks):
        return Log(
            clocks[0], {name: values for name, (_, values) in series.items()}, where, []
        )
    names = [name for name in series if name in MOTION] or list(series)
    motion = {name: series[name][0] for name in names}
    t = max(motion.values(), key=lambda clock: float(np.median(np.diff(clock))))
    inside, notes = np.ones(t.size, dtype=bool), []
    for name, clock in motion.items():
        step = np.diff(clock)
        holes = step > HOLE_STEPS * max(
            float(np.median(step)), float(np.median(np.diff(t)))
        )
        after = np.clip(np.searchsorted(clock, t), 1, clock.size - 1)
        in_hole = holes[after - 1] & (t > clock[after - 1]) & (t < clock[after])
        inside &= (t >= clock[0]) & (t <= clock[-1]) & ~in_hole
        if holes.any():
            notes.append(
                f"{name} has {holes.sum()} holes, of up to {step.max():.4g} s; nothing"
                " is put there"
            )
    t = t[inside]
    if t.size < _FEWEST:
        raise InputError(
            f"{where}: {', '.join(motion)} have {t.size} moments in common, expected"
            " channels of one time; check their clocks"
        )
    return Log(
        t, {name: np.interp(t, *pair) for name, pair in series.items()}, where, notes
    )
