"""Steering commands of boats without a rudder: two propellers, or a pulse width."""

import re
from itertools import combinations
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.trials.column_values import FULL_RUDDER_DEG
from shipgym.trials.readers.log_table import LogTable

_PORT = {"left", "port", "l", "p", "bb", "backbord", "babord"}
_STARBOARD = {
    *("right", "starboard", "stbd", "stb", "r", "s", "sb", "steuerbord", "tribord")
}
#: Words of a name that is a propeller's or motor's, not another thing with two sides.
_PROPELLER = re.compile(
    r"nps|rps|rpm|prop|thrust|motor|engine|esc|throttle|pwm|cmd|command|speed|shaft|n$"
    r"|rev|power|duty"
)
_SERVO = re.compile(
    r"(C\d+)|(rcou|rc_?out|servo|pwm|ch|chan|channel|output|out).*\d(_?raw)?"
    r"|.*(steer|rudder|helm|pwm).*",
    re.IGNORECASE,
)
_NEUTRAL, _SPAN = 1500.0, 400.0  # us, of radio control's servos


class Command(NamedTuple):
    """Column of a steering command, as the declaration of a rudder has it."""

    column: str
    unit: str
    reason: str
    extra: tuple[tuple[str, str | float], ...]  # other keys of the declaration


def steering_command(table: LogTable, free: list[str]) -> Command | None:
    """Steering command in columns of no other channel, which are then not free."""
    numbers = {}
    for column in free:
        values = table.likely_numbers(column)
        if values is None:
            continue
        known = values[np.isfinite(values)]
        if known.size and np.ptp(known) > 0.0:
            numbers[column] = known
    command = _two_propellers(numbers) or _servo(numbers)
    if command is not None:
        used = {command.column, dict(command.extra).get("minus")}
        free[:] = [column for column in free if column not in used]
    return command


def _two_propellers(numbers: dict[str, Floats]) -> Command | None:
    """Difference of the propellers of port and starboard."""
    by_rest: dict[str, dict[str, str]] = {}
    for column in numbers:
        side, rest = _side(column)
        if side:
            by_rest.setdefault(rest, {})[side] = column
    for rest, sides in by_rest.items():
        if len(sides) == 2 and _PROPELLER.search(rest):
            port, starboard = sides["port"], sides["starboard"]
            both = np.concatenate([numbers[port], numbers[starboard]])
            if _turn_alike(numbers[port], numbers[starboard]):
                continue
            full = 2.0 * _SPAN
            if not _is_pulse_width(both):
                full = float(f"{2.0 * float(np.mean(np.abs(both))):.2g}") or 1.0
            return _difference(port, starboard, f"of which {full:g}", full)
    return None


def _difference(first: str, second: str, words: str, full: float) -> Command:
    reason = (
        f"steering command: '{first}' minus '{second}', {words} counts as"
        f" {FULL_RUDDER_DEG:g} deg of a nominal rudder"
    )
    return Command(first, "deg", reason, (("minus", second), ("full", full)))


def _turn_alike(port: Floats, starboard: Floats) -> bool:
    """Return whether two propellers never differ by more than a hundredth."""
    if port.size != starboard.size:
        return True
    largest = np.abs(np.concatenate([port, starboard])).max()
    return bool(np.ptp(port - starboard) < 0.01 * largest)


def _side(column: str) -> tuple[str, str]:
    """Side that a column's name tells, empty without one, and the rest of the name."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", column)
    words = re.findall(r"[^\W_]+", apart.lower())
    for number, word in enumerate(words):
        if word in _PORT or word in _STARBOARD:
            rest = " ".join(words[:number] + words[number + 1 :])
            return "port" if word in _PORT else "starboard", rest or "n"
    return "", ""


def other_rudder(table: LogTable, column: str, free: list[str]) -> str | None:
    """Column of a second rudder, that of the other side or number; None without one.

    One that stands still is none.
    """
    side, rest = _side(column)
    for other in free:
        other_side, other_rest = _side(other)
        are_sides = column.replace("1", "2", 1) == other != column
        if side and other_side:
            are_sides = side != other_side and rest == other_rest
        if not are_sides:
            continue
        both = [table.likely_numbers(name, sided=True) for name in (column, other)]
        moved = [np.ptp(one[np.isfinite(one)]) for one in both if one is not None]
        if len(moved) == 2 and min(moved) > 0.1 * max(moved):
            return other
    return None


def _servo(numbers: dict[str, Floats]) -> Command | None:
    """The first pulse width that a servo of radio control gets.

    ArduPilot's ``SteerOut`` is a command up to 4500. Of two motors of which one goes up
    where the other goes down it is the difference.
    """
    servos = {}
    for column, values in numbers.items():
        if re.fullmatch(r"(.*\.)?SteerOut", column):
            reason = "steering command of ArduPilot, of which 4500 is the full one"
            return Command(column, "deg", reason, (("full", 4500.0),))
        if _SERVO.fullmatch(column) and _is_pulse_width(values):
            servos[column] = values
    for (left, a), (right, b) in combinations(servos.items(), 2):
        if a.size == b.size and np.corrcoef(a, b)[0, 1] < -0.8:
            words = f"two motors that mirror each other, of which {2.0 * _SPAN:g} us"
            return _difference(left, right, words, 2.0 * _SPAN)
    if not servos:
        return None
    reason = (
        f"steering command: a pulse width in us, neutral at {_NEUTRAL:g}, of which"
        f" {_SPAN:g} counts as {FULL_RUDDER_DEG:g} deg of a nominal rudder"
    )
    extra = (("neutral", _NEUTRAL), ("full", _SPAN))
    return Command(next(iter(servos)), "deg", reason, extra)


def _is_pulse_width(values: Floats) -> bool:
    """Return whether values may be pulse widths in us."""
    return bool(values.min() >= 700.0 and 1000.0 < values.max() <= 2300.0)
