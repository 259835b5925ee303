"""Steering commands of boats without a rudder: two propellers, or a pulse width."""

import re
from typing import Any

import numpy as np

from shipgym.arrays import Floats
from shipgym.trials.columns import ColumnGuess
from shipgym.trials.readers.log_table import LogTable

_PORT = "left|port|l|p|bb|backbord|babord"
_STARBOARD = "right|starboard|stbd|stb|r|s|sb|steuerbord|tribord"
_SIDE = re.compile(rf"\b(?:({_PORT})|(?:{_STARBOARD}))\b")
#: Words of a name that is a propeller's or motor's, not another thing with two sides.
_PROPELLER = re.compile(
    r"nps|rps|rpm|prop|thrust|motor|engine|esc|throttle|pwm|cmd|command|speed|shaft|\bn$"
    r"|rev|power|duty|^\W*$"
)
_SERVO = re.compile(
    r"(C\d+)|(rcou|rc_?out|servo|pwm|ch|chan|channel|output|out).*\d(_?raw)?"
    r"|.*(steer|rudder|helm|pwm).*",
    re.IGNORECASE,
)
_STEER_OUT = re.compile(r"(.*\.)?SteerOut")  # of ArduPilot
_SPAN = 400.0  # us, of radio control's servos


def steering_command(table: LogTable, free: list[str]) -> ColumnGuess | None:
    """Steering command in columns of no other channel, which are then not free."""
    numbers = {}
    for column in free:
        values = table.likely_numbers(column)
        known = values[np.isfinite(values)] if values is not None else np.array([])
        if known.size and np.ptp(known) > 0.0:
            numbers[column] = known
    command = _two_propellers(numbers) or _servo(numbers)
    if command is not None:
        free[:] = [column for column in free if column not in command.names]
    return command


def _two_propellers(numbers: dict[str, Floats]) -> ColumnGuess | None:
    """Difference of the propellers of port and starboard."""
    by_rest: dict[str, dict[bool, str]] = {}
    for column in numbers:
        apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", column).replace("_", " ").lower()
        side = _SIDE.search(apart)
        rest = _SIDE.sub("", apart).strip()
        if side and _PROPELLER.search(rest):
            by_rest.setdefault(rest, {})[side[1] is not None] = column
    for sides in by_rest.values():
        if len(sides) < 2:
            continue
        first, second = sides[True], sides[False]
        port, starboard = numbers[first], numbers[second]
        both = np.concatenate([port, starboard])
        largest = np.abs(both).max()
        if port.size != starboard.size or np.ptp(port - starboard) <= 0.01 * largest:
            continue
        full = 2.0 * _SPAN
        if not _is_pulse_width(both):
            full = float(f"{2.0 * np.mean(np.abs(both)):.2g}") or 1.0
        return _command(f"'{first}' minus '{second}'", first, minus=second, full=full)
    return None


def _servo(numbers: dict[str, Floats]) -> ColumnGuess | None:
    """The first command of ArduPilot, or pulse width that a servo gets."""
    for column, values in numbers.items():
        if _SERVO.fullmatch(column) and _is_pulse_width(values):
            return _command("neutral at 1500", column, neutral=1500.0, full=_SPAN)
        if _STEER_OUT.fullmatch(column):
            return _command("neutral at 0", column, full=4500.0)
    return None


def _command(words: str, name: str, **keys: Any) -> ColumnGuess:
    reason = (
        f"steering command: {words}, of which {keys['full']:g} counts as 35 deg of a"
        " nominal rudder"
    )
    return ColumnGuess(name, "deg", channel="delta", reason=reason, **keys)


def _is_pulse_width(values: Floats) -> bool:
    """Return whether values may be pulse widths in us."""
    return bool(values.min() >= 700.0 and 1000.0 < values.max() <= 2300.0)
