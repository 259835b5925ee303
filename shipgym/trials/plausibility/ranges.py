"""Values beyond what any ship does."""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from shipgym.arrays import Floats
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
        values = channels[channel]
        too_large = np.abs(values) > largest * (1.0 + _ROUNDING)
        if too_large.any():
            first = int(np.argmax(too_large))
            yield _out_of_range(channel, values, first, locator)


def _out_of_range(
    channel: str, values: Floats, first: int, locator: Locator
) -> LogFinding:
    largest = LARGEST_MAGNITUDES[channel]
    unit = locator.columns[channel].unit
    factor = si_factor(channel, unit)
    size = float(np.nanmax(np.abs(values))) / factor
    proposals = [
        Proposal(channel, other)
        for other, in_si in UNITS[QUANTITIES[channel]].items()
        if in_si < factor and size * in_si <= largest
    ]
    remedy = "check the column and its unit, or correct the value"
    if proposals:
        remedy = f"likely a wrong unit: declare {locator.declaration(*proposals[0])}"
    return LogFinding(
        locator.place(first, channel),
        f"expected {channel} of at most {_spelled(largest, channel, unit)}, got"
        f" {_spelled(float(values[first]), channel, unit)}",
        remedy,
        tuple(proposals),
    )


def _spelled(value: float, channel: str, unit: str) -> str:
    """A value in SI units as the file has it, with degrees in brackets where that is in radians."""
    in_unit = value / si_factor(channel, unit)
    text = f"{in_unit:g} {unit}"
    is_angle = QUANTITIES[channel] in ("angle", "angular rate")
    if is_angle and unit.startswith("rad"):
        return f"{text} ({math.degrees(in_unit):g} {unit.replace('rad', 'deg')})"
    return text
