"""Units of numbers in C and FMU: their texts, and their powers of base units."""

import re
from collections.abc import Mapping

#: Base units of FMI that ships have.
BASE = ("kg", "m", "s", "rad")
FACTOR = re.compile(rf"({'|'.join(BASE)})\^?(-?\d)?")

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
    numerator, _, denominator = text.partition(" per ")
    powers = dict.fromkeys(BASE, 0)
    for part, sign in ((numerator, 1), (denominator, -1)):
        for number, product in enumerate(part.split("/")):
            side = sign if number == 0 else -sign
            for factor in product.split():
                if factor == "1":
                    continue
                match = FACTOR.fullmatch(factor)
                if match is None:
                    return None
                powers[match[1]] += side * int(match[2] or 1)
    if not numerator:
        return None
    return {base: power for base, power in powers.items() if power}


def unit_of(note: str) -> str:
    """Unit with which a note begins; an empty text if it begins with none."""
    for part in note.split(", "):
        unit = part.strip()
        if unit and unit_powers(unit) is not None:
            return unit
    return ""
