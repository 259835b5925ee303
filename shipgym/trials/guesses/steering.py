"""Steering commands of boats without a rudder: two propellers, or a pulse width."""

import re
from typing import Any

import numpy as np

from shipgym.arrays import Floats
from shipgym.trials.columns import ColumnGuess
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
    by_rest: dict[str, dict[str, str]] = {}
    for column in numbers:
        side, rest = _side(column)
        if side and _PROPELLER.search(rest):
            by_rest.setdefault(rest, {})[side] = column
    for sides in by_rest.values():
        if len(sides) < 2:
            continue
        first, second = sides["port"], sides["starboard"]
        port, starboard = numbers[first], numbers[second]
        largest = max(np.abs(port).max(), np.abs(starboard).max())
        if port.size != starboard.size or np.ptp(port - starboard) <= 0.01 * largest:
            continue
        both = np.concatenate([port, starboard])
        full = 2.0 * _SPAN
        if not _is_pulse_width(both):
            full = float(f"{2.0 * np.mean(np.abs(both)):.2g}") or 1.0
        reason = (
            f"steering command: '{first}' minus '{second}', of which {full:g} counts as"
            " 35 deg of a nominal rudder"
        )
        return _command(first, reason, minus=second, full=full)
    return None


def _side(column: str) -> tuple[str, str]:
    """Side that a column's name tells, empty without one, and the rest of the name."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", column)
    words = re.findall(r"[^\W_]+", apart.lower())
    for side, known in (("port", _PORT), ("starboard", _STARBOARD)):
        rest = [word for word in words if word not in known]
        if len(rest) < len(words):
            return side, " ".join(rest) or "n"
    return "", ""


def _servo(numbers: dict[str, Floats]) -> ColumnGuess | None:
    """The first command of ArduPilot, or pulse width that a servo gets."""
    for column, values in numbers.items():
        neutral, full = 0.0, 4500.0
        is_command = re.fullmatch(r"(.*\.)?SteerOut", column) is not None
        if _SERVO.fullmatch(column) and _is_pulse_width(values):
            is_command = True
            neutral, full = _NEUTRAL, _SPAN
        if is_command:
            reason = (
                f"steering command: neutral at {neutral:g}, of which {full:g} counts as"
                " 35 deg of a nominal rudder"
            )
            return _command(column, reason, neutral=neutral, full=full)
    return None


def _command(name: str, reason: str, **keys: Any) -> ColumnGuess:
    return ColumnGuess(name, "deg", channel="delta", reason=reason, **keys)


def _is_pulse_width(values: Floats) -> bool:
    """Return whether values may be pulse widths in us."""
    return bool(values.min() >= 700.0 and 1000.0 < values.max() <= 2300.0)
