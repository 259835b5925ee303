"""Units of speeds by comparison with the positions of the same log."""

import math
from collections.abc import Mapping

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.guesses.columns import ColumnGuess
from shipgym.trials.guesses.units import BY_NAME
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.recording import read_recording
from shipgym.trials.resampling import Signal, usual_step

_UNITS = {"m/s": 1.0, "knots": 1852.0 / 3600.0, "km/h": 1.0 / 3.6}
_SPEEDS = ("sog", "stw")


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
        return settled
    by_positions = _speed_by_positions(table, settled)
    for channel in speeds:
        settled[channel] = _settled(table, settled[channel], by_positions)
    if "sog" in settled and "cog" not in settled:
        alone = settled.pop("sog")
        if by_positions is None and "stw" not in settled and "u" not in settled:
            reason = (
                f"{alone.reason}; over ground by its name, taken as through the water,"
                " as there is no course over ground"
            )
            settled["stw"] = alone._replace(channel="stw", reason=reason)
    if "cog" in settled and "sog" not in settled:
        settled.pop("cog")
    return settled


def _speed_by_positions(
    table: LogTable, guesses: Mapping[str, ColumnGuess]
) -> Signal | None:
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


def _chord_speeds(t: Floats, x: Floats, y: Floats) -> Signal | None:
    """Speed over stretches of some 10 s, at their middles."""
    rows = max(1, round(10.0 / usual_step(t)))
    if t.size < 3 * rows:
        rows = max(1, t.size // 3)
    dx = x[rows:] - x[:-rows]
    dy = y[rows:] - y[:-rows]
    dt = t[rows:] - t[:-rows]
    middle = 0.5 * (t[rows:] + t[:-rows])
    return Signal(middle, np.hypot(dx, dy) / dt)


def _settled(
    table: LogTable, guess: ColumnGuess, by_positions: Signal | None
) -> ColumnGuess:
    """The guess with the unit in which a speed agrees best with the positions."""
    is_named = guess.reason == BY_NAME or guess.reason.startswith("from the row")
    if by_positions is None:
        if is_named or guess.reason.startswith(("from its cells", "paths")):
            return guess
        return _guessed(table, guess)
    ratio = _ratio(table, guess, by_positions)
    if ratio is None:
        return guess
    number, speed = ratio
    apart = {unit: abs(math.log(speed / number / one)) for unit, one in _UNITS.items()}
    nearest = min(apart, key=lambda unit: apart[unit])
    doubt = 0.05 if is_named else 0.3
    if apart[nearest] > doubt or (is_named and nearest == guess.unit):
        return guess
    reason = (
        f"by the positions, which change by {speed:.3g} m/s where it shows {number:.4g}"
    )
    if is_named and nearest != guess.unit:
        reason += f", not {guess.unit} as {guess.reason.removeprefix('from ')} says"
    return guess._replace(unit=nearest, reason=reason)


def _ratio(
    table: LogTable, guess: ColumnGuess, by_positions: Signal
) -> tuple[float, float] | None:
    """Median of a column and of the positions' speed, where the ship moves."""
    try:
        values = np.abs(table.numbers(guess.column))
    except InputError:
        return None
    known = values[np.isfinite(values) & (values < 100.0)]
    speeds = by_positions.values
    if not known.size or not np.median(known) > 0.0 or not np.median(speeds) > 0.0:
        return None
    return float(np.median(known)), float(np.median(speeds))


def _guessed(table: LogTable, guess: ColumnGuess) -> ColumnGuess:
    """The usual unit of a speed, said to be a guess."""
    try:
        values = np.abs(table.numbers(guess.column))
    except InputError:
        return guess
    largest = float(np.nanmax(values, initial=0.0))
    unit = "knots" if largest > 3.0 else "m/s"
    reason = (
        f"is a guess: there are no positions that tell, up to {largest:.4g}; knots,"
        " m/s or km/h"
    )
    return guess._replace(unit=unit, reason=reason)
