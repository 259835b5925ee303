"""Units of speeds by comparison with the positions of the same log."""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.guesses.columns import ColumnGuess
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.recording import read_recording
from shipgym.trials.resampling import usual_step

_UNITS = {"m/s": 1.0, "knots": 1852.0 / 3600.0, "km/h": 1.0 / 3.6}
_SPEEDS = ("sog", "stw")


class _Known(NamedTuple):
    """Speeds in m/s, and where they are from."""

    speed: Floats
    words: str


def settle_speeds(
    table: LogTable, guesses: Mapping[str, ColumnGuess]
) -> dict[str, ColumnGuess]:
    """Guesses with the units of speeds by the positions, or as a guess without these.

    A speed over ground without its course is left out where there are positions, and
    else taken through the water.
    """
    settled = dict(guesses)
    speeds = [channel for channel in _SPEEDS if channel in settled]
    if not speeds:
        settled.pop("cog", None)
        return settled
    by_positions = _speed_by_positions(table, settled)
    is_si = any(guess.unit in ("rad", "rad/s") for guess in guesses.values())
    known = None
    if by_positions is not None:
        known = _Known(by_positions, "the positions, which change by")
    for channel in sorted(speeds, key=lambda name: not _is_known(settled[name])):
        guess = settled[channel] = _settled(table, settled[channel], known, is_si=is_si)
        if known is None and _is_known(guess):
            speed = _magnitudes(table, guess) * _UNITS.get(guess.unit, 1.0)
            known = _Known(speed, f"the column '{guess.column}', which shows")
    _settle_alone(settled, has_positions=by_positions is not None)
    return settled


def _settle_alone(settled: dict[str, ColumnGuess], *, has_positions: bool) -> None:
    """Leave out a speed or course over ground without the other."""
    if "sog" not in settled:
        settled.pop("cog", None)
        return
    if "cog" in settled:
        return
    alone = settled.pop("sog")
    if not has_positions and "stw" not in settled and "u" not in settled:
        reason = (
            f"{alone.reason}; over ground by its name, taken as through the water,"
            " as there is no course over ground"
        )
        settled["stw"] = alone._replace(channel="stw", reason=reason)


def _is_known(guess: ColumnGuess) -> bool:
    """Return whether the log itself names the unit of a speed."""
    elsewhere = ("from the row", "from its cells", "paths")
    return guess.is_named or guess.reason.startswith(elsewhere)


def _magnitudes(table: LogTable, guess: ColumnGuess) -> Floats:
    """Magnitudes of a speed as the log has it, without missing and impossible ones."""
    values = np.abs(table.numbers(guess.column))
    known: Floats = values[np.isfinite(values) & (values < 100.0)]
    return known


def _speed_by_positions(
    table: LogTable, guesses: Mapping[str, ColumnGuess]
) -> Floats | None:
    """Speed at which positions change, m/s; None where there are none."""
    for pair in (("lat", "lon"), ("x", "y")):
        if not {"t", *pair} <= guesses.keys():
            continue
        columns = {name: guesses[name].as_column for name in ("t", *pair)}
        try:
            signals = read_recording(table, columns, "interpolate").signals
        except InputError:
            return None
        t, x = signals["x"]
        _, y = signals["y"]
        if x.size != y.size:
            return None
        return _chord_speeds(t, x, y)
    return None


def _chord_speeds(t: Floats, x: Floats, y: Floats) -> Floats:
    """Speed over stretches of some 10 s."""
    step = usual_step(t)
    rows = max(1, round(10.0 / step))
    if t.size < 3 * rows:
        rows = max(1, t.size // 3)

    def change(values: Floats) -> Floats:
        later = values[rows:]
        return later - values[:-rows]

    sailed = np.hypot(change(x), change(y))
    speeds: Floats = sailed / change(t)
    return speeds


def _settled(
    table: LogTable, guess: ColumnGuess, known: _Known | None, *, is_si: bool
) -> ColumnGuess:
    """The guess with the unit in which a speed agrees best with a known one."""
    try:
        values = _magnitudes(table, guess)
    except InputError:
        return guess
    is_named = _is_known(guess)
    if known is None:
        return guess if is_named else _guessed(guess, values, is_si=is_si)
    speed = _middle(known.speed)
    number = _middle(values)
    if not speed > 0.0 or not number > 0.0:
        return guess

    apart = {unit: abs(math.log(speed / number / one)) for unit, one in _UNITS.items()}
    nearest = min(apart, key=lambda unit: apart[unit])
    # a name is contradicted by what fits exactly alone
    doubt = 0.05 if is_named else 0.3
    if apart[nearest] > doubt or (is_named and nearest == guess.unit):
        return guess
    reason = f"by {known.words} {speed:.3g} m/s where it shows {number:.4g}"
    if is_named:
        reason += f", not {guess.unit} as its name or row of units says"
    return guess._replace(unit=nearest, reason=reason)


def _middle(speeds: Floats) -> float:
    """Median of speeds; 0 where there are none."""
    return float(np.median(speeds)) if speeds.size else 0.0


def _guessed(guess: ColumnGuess, values: Floats, *, is_si: bool) -> ColumnGuess:
    """The usual unit of a speed, said to be a guess."""
    largest = float(values.max(initial=0.0))
    fastest = 15.0 if is_si else 3.0  # that is likelier in m/s
    unit = "m/s" if largest <= fastest else "knots"
    beside = ", with angles in rad" if is_si else ""
    reason = (
        f"is a guess: there are no positions that tell, up to {largest:.4g}{beside};"
        " knots, m/s or km/h"
    )
    return guess._replace(unit=unit, reason=reason)
