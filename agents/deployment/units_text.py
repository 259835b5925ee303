"""Units of numbers in C and FMU: their texts, and their powers of base units."""

import re
from collections import Counter
from collections.abc import Mapping

Powers = Mapping[str, int]


def unit_text(powers: Powers) -> str:
    """Write a unit by its powers of base units: `m/s^2`, `1/m`, `1`."""
    above: list[str] = []
    below: list[str] = []
    for base, power in powers.items():
        exponent = "" if abs(power) == 1 else f"^{abs(power)}"
        if power:
            side = above if power > 0 else below
            side.append(f"{base}{exponent}")
    numerator = " ".join(above) or "1"
    return "/".join([numerator, *below])


def unit_powers(text: str) -> dict[str, int] | None:
    """Powers of base units that are not 0; None for a text that is no unit.

    Units are products, quotients and `per`: `rad s/m`, `rad per rad/s`, `1/s`.
    """
    above, _, below = text.partition(" per ")
    if not above:
        return None
    powers: Counter[str] = Counter()
    for part, sign in ((above, 1), (below, -1)):
        numerator, *denominators = part.split("/")
        factors = [(factor, sign) for factor in numerator.split()]
        for denominator in denominators:
            factors += [(factor, -sign) for factor in denominator.split()]

        for factor, side in factors:
            match = re.fullmatch(r"(kg|m|s|rad|1)\^?(-?\d)?", factor)
            if match is None:
                return None
            base = match[1]
            powers[base] += side * int(match[2] or 1)
    return {base: power for base, power in powers.items() if power and base != "1"}


def unit_of(note: str) -> str:
    """Unit with which a note begins; an empty text if it begins with none."""
    for part in note.split(", "):
        unit = part.strip()
        if unit and unit_powers(unit) is not None:
            return unit
    return ""
