"""Values beyond what any ship does."""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from shipgym.arrays import Flags, Floats
from shipgym.trials.columns import Locator
from shipgym.trials.plausibility.finding import LogFinding, Proposal
from shipgym.trials.units import LARGEST_MAGNITUDES, QUANTITIES, UNITS, si_factor

_ROUNDING = 1e-9


def check_ranges(
    channels: Mapping[str, Floats], locator: Locator
) -> Iterator[LogFinding]:
    """Find values beyond `LARGEST_MAGNITUDES`, with the units that would make them plausible.

    The channels are in SI units, of shape (n_samples,), nan where there is none.
    """
    for channel, largest in LARGEST_MAGNITUDES.items():
        if channel not in channels:
            continue
        size = np.abs(channels[channel])
        too_large = size > largest * (1.0 + _ROUNDING)
        if too_large.any():
            yield _out_of_range(channel, channels[channel], too_large, locator)


def _out_of_range(
    channel: str, values: Floats, too_large: Flags, locator: Locator
) -> LogFinding:
    first = np.argmax(too_large)
    unit = locator.columns[channel].unit
    largest = LARGEST_MAGNITUDES[channel]
    proposals = _smaller_units(channel, unit, np.nanmax(np.abs(values)))
    remedy = "check the column and its unit, or correct the value"
    if proposals:
        remedy = f"likely a wrong unit: declare {locator.declaration(*proposals[0])}"
    return LogFinding(
        where=locator.place(first, channel),
        evidence=(
            f"expected {channel} of at most {_spelled(largest, channel, unit)}, got"
            f" {_spelled(values[first], channel, unit)}"
        ),
        remedy=remedy,
        proposals=tuple(proposals),
    )


def _smaller_units(channel: str, declared: str, size: float) -> list[Proposal]:
    """Units in which the largest value of a channel is no larger than that of a ship."""
    largest = LARGEST_MAGNITUDES[channel]
    own = si_factor(channel, declared)
    proposals = []
    for unit, factor in UNITS[QUANTITIES[channel]].items():
        ratio = factor / own
        if ratio < 1.0 and size * ratio <= largest:
            proposals.append(Proposal(channel, unit))
    return proposals


def _spelled(value: float, channel: str, unit: str) -> str:
    """A value in SI units as the file has it, with degrees in brackets where that is in radians."""
    number = value / si_factor(channel, unit)
    text = f"{number:g} {unit}"
    if unit not in ("rad", "rad/s"):
        return text
    degrees = unit.replace("rad", "deg")
    return f"{text} ({math.degrees(number):g} {degrees})"
