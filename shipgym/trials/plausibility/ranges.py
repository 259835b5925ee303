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
        if channel not in channels:
            continue
        values = channels[channel]
        too_large = np.abs(values) > rounding * largest
        if too_large.any():
            raise _out_of_range(channel, values, too_large, locator)


def _out_of_range(
    channel: str, values: Floats, too_large: Flags, locator: Locator
) -> InputError:
    first = np.argmax(too_large)
    largest = np.nanmax(np.abs(values))
    declared = locator.columns[channel].unit
    most = _spelled(LARGEST_MAGNITUDES[channel], channel, declared)
    found = _spelled(values[first], channel, declared)

    proposals = _smaller_units(channel, declared, largest)
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
    quantity = QUANTITIES[channel]
    most = LARGEST_MAGNITUDES[channel]
    largest_ratio = most / size
    proposals = []
    for unit, factor in UNITS[quantity].items():
        ratio = factor / own
        if ratio <= largest_ratio:
            proposal = Proposal(channel, unit)
            proposals.append(proposal)
    return proposals


def _spelled(value: float, channel: str, unit: str) -> str:
    """A value in SI units as the file has it; radians in degrees too, in brackets."""
    factor = si_factor(channel, unit)
    number = value / factor
    text = f"{number:g} {unit}"
    if unit not in ("rad", "rad/s"):
        return text
    in_degrees = math.degrees(number)
    degrees = unit.replace("rad", "deg")
    return f"{text} ({in_degrees:g} {degrees})"
