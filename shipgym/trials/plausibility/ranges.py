"""Values beyond what any ship does."""

import math
from collections.abc import Mapping

import numpy as np

from shipgym.arrays import Flags, Floats
from shipgym.errors import InputError
from shipgym.trials.columns import Locator
from shipgym.trials.plausibility.refusal import Proposal, implausible
from shipgym.trials.units import LARGEST_MAGNITUDES, QUANTITIES, UNITS, si_factor


def check_ranges(channels: Mapping[str, Floats], locator: Locator) -> None:
    """Refuse values beyond `LARGEST_MAGNITUDES`; propose units that fit.

    The channels are in SI units, of shape (n_samples,), nan where there is none.
    """
    rounding = 1.0 + 1e-9
    for channel, largest in LARGEST_MAGNITUDES.items():
        if channel in channels:
            values = channels[channel]
            too_large = np.abs(values) > rounding * largest
            if too_large.any():
                raise _out_of_range(channel, values, too_large, locator)


def _out_of_range(
    channel: str, values: Floats, too_large: Flags, locator: Locator
) -> InputError:
    first = np.argmax(too_large)
    declared = locator.columns[channel].unit
    most = _spelled(LARGEST_MAGNITUDES[channel], channel, declared)
    found = _spelled(values[first], channel, declared)

    proposals = _smaller_units(channel, declared, np.nanmax(np.abs(values)))
    remedy = "check the column and its unit, or correct the value"
    if proposals:
        declaration = locator.declaration(*proposals[0])
        remedy = f"likely a wrong unit: declare {declaration}"
    return implausible(
        locator.place(first, channel),
        f"expected {channel} of at most {most}, got {found}",
        remedy,
        *proposals,
    )


def _smaller_units(channel: str, declared: str, size: float) -> list[Proposal]:
    """Units in which the largest value of a channel can be a ship's."""
    own = si_factor(channel, declared)
    largest_ratio = LARGEST_MAGNITUDES[channel] / size
    proposals = []
    for unit, factor in UNITS[QUANTITIES[channel]].items():
        ratio = factor / own
        if ratio < 1.0 and ratio <= largest_ratio:
            proposals.append(Proposal(channel, unit))
    return proposals


def _spelled(value: float, channel: str, unit: str) -> str:
    """A value in SI units as the file has it; radians in degrees too, in brackets."""
    number = value / si_factor(channel, unit)
    text = f"{number:g} {unit}"
    if unit not in ("rad", "rad/s"):
        return text
    degrees = unit.replace("rad", "deg")
    return f"{text} ({math.degrees(number):g} {degrees})"
