"""Steering commands of boats without a rudder: two propellers, or a pulse width."""

import re
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.column_values import FULL_RUDDER_DEG
from shipgym.trials.readers.log_table import LogTable

_SIDES = {
    "left": "port",
    "port": "port",
    "l": "port",
    "p": "port",
    "bb": "port",
    "backbord": "port",
    "babord": "port",
    "right": "starboard",
    "starboard": "starboard",
    "stbd": "starboard",
    "stb": "starboard",
    "r": "starboard",
    "s": "starboard",
    "sb": "starboard",
    "steuerbord": "starboard",
    "tribord": "starboard",
}
#: Words of a name that is a propeller's or motor's, not another thing with two sides.
_PROPELLER = re.compile(
    r"nps|rps|rpm|prop|thrust|motor|engine|esc|throttle|pwm|cmd|command|speed|shaft|n$"
    r"|rev|power|duty"
)
_SERVO = re.compile(
    r"(rcou|rc_?out|servo|pwm|ch|chan|channel|output|out).*\d(_?raw)?"
    r"|.*(steer|rudder|helm|pwm).*",
    re.IGNORECASE,
)
_NEUTRAL, _SPAN = 1500.0, 400.0  # us, of radio control's servos


class SteeringGuess(NamedTuple):
    """A steering command as a nominal rudder, and why."""

    column: str
    unit: str
    reason: str
    extra: tuple[tuple[str, str | float], ...]


def steering_command(table: LogTable, free: list[str]) -> SteeringGuess | None:
    """Steering command in columns of no other channel, which are then not free."""
    numbers = {}
    for column in free:
        try:
            values = table.numbers(column)
        except InputError:
            continue
        known = values[np.isfinite(values)]
        if known.size and np.ptp(known) > 0.0:
            numbers[column] = known
    guess = _two_propellers(numbers) or _servo(numbers)
    if guess is not None:
        for used in (guess.column, dict(guess.extra).get("minus")):
            if used in free:
                free.remove(str(used))
    return guess


def _two_propellers(numbers: dict[str, Floats]) -> SteeringGuess | None:
    """Difference of the propellers of port and starboard."""
    by_rest: dict[str, dict[str, str]] = {}
    for column in numbers:
        parted = _side(column)
        if parted is not None:
            side, rest = parted
            by_rest.setdefault(rest, {})[side] = column
    for rest, sides in by_rest.items():
        if len(sides) < 2 or not _PROPELLER.search(rest):
            continue
        port = sides["port"]
        starboard = sides["starboard"]
        both = np.concatenate([numbers[port], numbers[starboard]])
        if _is_pulse_width(both):
            full = 2.0 * _SPAN
        else:
            full = _rounded(2.0 * float(np.mean(np.abs(both))))
        reason = (
            f"steering command: '{port}' minus '{starboard}', of which {full:g} counts"
            f" as {FULL_RUDDER_DEG:g} deg of a nominal rudder"
        )
        extra = (("minus", starboard), ("full", full))
        return SteeringGuess(port, "deg", reason, extra)
    return None


def _side(column: str) -> tuple[str, str] | None:
    """Side that a column's name tells, and the rest of the name; None without one."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", column)
    words = re.findall(r"[^\W_]+", apart.lower())
    for number, word in enumerate(words):
        if word in _SIDES:
            rest = words[:number] + words[number + 1 :]
            return _SIDES[word], " ".join(rest) or "n"
    return None


def other_rudder(table: LogTable, column: str, free: list[str]) -> str | None:
    """Column of a second rudder, that of the other side or number; None without one.

    One that stands still is none.
    """
    for other in free:
        here = _side(column)
        there = _side(other)
        if here is not None and there is not None:
            are_sides = here[0] != there[0] and here[1] == there[1]
        else:
            are_sides = column.replace("1", "2", 1) == other != column
        if not are_sides:
            continue
        try:
            values = [table.numbers(name, sided=True) for name in (column, other)]
        except InputError:
            continue
        moved = [np.ptp(one[np.isfinite(one)]) for one in values]
        if min(moved) > 0.1 * max(moved):
            return other
    return None


def _servo(numbers: dict[str, Floats]) -> SteeringGuess | None:
    """The first pulse width that a servo of radio control gets."""
    servos = {}
    for column, values in numbers.items():
        if _SERVO.fullmatch(column) and _is_pulse_width(values):
            servos[column] = values
    mirrored = _mirrored(servos)
    if mirrored is not None:
        left, right = mirrored
        reason = (
            f"steering command: '{left}' minus '{right}', two motors that mirror each"
            f" other, of which {2.0 * _SPAN:g} us counts as {FULL_RUDDER_DEG:g} deg of"
            " a nominal rudder"
        )
        extra = (("minus", right), ("full", 2.0 * _SPAN))
        return SteeringGuess(left, "deg", reason, extra)
    if not servos:
        return None

    column = next(iter(servos))
    reason = (
        f"steering command: a pulse width in us, neutral at {_NEUTRAL:g}, of which"
        f" {_SPAN:g} counts as {FULL_RUDDER_DEG:g} deg of a nominal rudder"
    )
    pulses = (("neutral", _NEUTRAL), ("full", _SPAN))
    return SteeringGuess(column, "deg", reason, pulses)


def _mirrored(servos: dict[str, Floats]) -> tuple[str, str] | None:
    """The first two servos of which one goes up where the other goes down."""
    names = list(servos)
    for number, left in enumerate(names):
        for right in names[number + 1 :]:
            a = servos[left]
            b = servos[right]
            if a.size == b.size and np.corrcoef(a, b)[0, 1] < -0.8:
                return left, right
    return None


def _is_pulse_width(values: Floats) -> bool:
    """Return whether values may be pulse widths in us."""
    least = float(values.min())
    most = float(values.max())
    return least >= 700.0 and 1000.0 < most <= 2300.0


def _rounded(value: float) -> float:
    return float(f"{value:.2g}") or 1.0
