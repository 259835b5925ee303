"""Numbers as a page shows them: a true minus, no needless digits, a dash where there is none."""

import numpy as np

NONE = "\N{EN DASH}"
MINUS = "\N{MINUS SIGN}"
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: float | None, digits: int = 3) -> str:
    """A number with so many significant digits and no needless exponent."""
    if value is None or not np.isfinite(value):
        return NONE
    if value == 0.0:
        return "0"
    if not 1e-4 <= abs(value) < 1e7:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return (
            f"{mantissa.replace('-', MINUS)} ·"
            f" 10{str(int(exponent)).translate(SUPERSCRIPTS)}"
        )
    return fixed(value, max(digits - 1 - int(np.floor(np.log10(abs(value)))), 0))


def fixed(value: float | None, decimals: int = 2) -> str:
    """A number with so many decimals."""
    if value is None or not np.isfinite(value):
        return NONE
    return f"{value:.{decimals}f}".replace("-", MINUS)


def percent(share: float) -> str:
    """A share in whole per cent, but never 0 or 100 unless it is exactly that."""
    if not np.isfinite(share):
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
    return None if value is None else float(np.degrees(value))
