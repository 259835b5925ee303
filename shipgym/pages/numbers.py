"""Numbers as a page shows them: a true minus, no needless digits, a dash for none."""

import math

NONE = "\N{EN DASH}"
MINUS = "\N{MINUS SIGN}"


def number(value: float | None, digits: int = 3) -> str:
    """A number with so many significant digits and no needless exponent."""
    if value is None or not math.isfinite(value):
        return NONE
    if value == 0.0:
        return "0"
    after_first = digits - 1
    size = abs(value)
    if 1e-4 <= size < 1e7:
        magnitude = math.floor(math.log10(size))
        decimals = max(after_first - magnitude, 0)
        return fixed(value, decimals)

    return f"{value:.{after_first}e}".replace("-", MINUS)


def fixed(value: float | None, decimals: int = 2) -> str:
    """A number with so many decimals."""
    if value is None or not math.isfinite(value):
        return NONE
    return f"{value:.{decimals}f}".replace("-", MINUS)


def percent(share: float) -> str:
    """A share in whole per cent, but never 0 or 100 unless it is exactly that."""
    if not math.isfinite(share):
        return NONE
    if 0.0 < share < 0.01:
        return "< 1 %"
    if 0.99 < share < 1.0:
        return "> 99 %"
    return f"{100.0 * share:.0f} %"


def counted(count: int, noun: str) -> str:
    """So many of something, with the plural in s."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def degrees(value: float | None) -> float | None:
    """An angle in degrees of one in radians."""
    return None if value is None else math.degrees(value)
