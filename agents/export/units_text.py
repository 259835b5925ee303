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
    dividend = _quotient_powers(above)
    divisor = _quotient_powers(below)
    if dividend is None or divisor is None:
        return None
    dividend.subtract(divisor)

    powers = {}
    for base, power in dividend.items():
        if power and base != "1":
            powers[base] = power
    return powers


def _quotient_powers(text: str) -> Counter[str] | None:
    """Powers in a quotient such as `rad s/m`, with those of 1."""
    powers: Counter[str] = Counter()
    for number, product in enumerate(text.split("/")):
        sign = -1 if number else 1
        for factor in product.split():
            match = re.fullmatch(r"(kg|m|s|rad|1)\^?(-?\d)?", factor)
            if match is None:
                return None
            base = match[1]
            power = int(match[2] or 1)
            powers[base] += sign * power
    return powers


def unit_of(note: str) -> str:
    """Unit with which a note begins; an empty text if it begins with none."""
    for part in note.split(", "):
        unit = part.strip()
        if unit and unit_powers(unit) is not None:
            return unit
    return ""
