"""Units of speeds by comparison with the positions of the same log."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.columns import ColumnGuess
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.recording import read_recording
from shipgym.trials.resampling import usual_step
from shipgym.trials.units import KNOT

_SPEEDS = ("sog", "stw", "u")
_UNITS = {"m/s": 1.0, "knots": KNOT, "km/h": 1.0 / 3.6}


def settle_speeds(
    table: LogTable, guesses: Mapping[str, ColumnGuess]
) -> dict[str, ColumnGuess]:
    """Guesses with units of speeds by the positions, or guessed without these."""
    settled = dict(guesses)
    speeds = [settled[channel] for channel in _SPEEDS if channel in settled]
    known = _speed_by_positions(table, settled) if speeds else None
    is_si = any(guess.unit in ("rad", "rad/s") for guess in guesses.values())
    for guess in speeds:
        parts = [guess]
        if guess.channel == "u" and "v" in settled:
            parts.append(settled["v"])
        values = [table.likely_numbers(part.name) for part in parts]
        if values[0] is None:
            continue
        sizes = np.sqrt(sum(np.square(one) for one in values if one is not None))
        if known is not None:
            guess = _by_positions(guess, _middle(sizes[sizes < 100.0]), known)
        elif not _is_known(guess):
            guess = _guessed(guess, float(np.nanmax(sizes, initial=0.0)), is_si=is_si)
        for part in parts:
            settled[part.channel] = replace(part, unit=guess.unit, reason=guess.reason)
    return settled


def _is_known(guess: ColumnGuess) -> bool:
    """Return whether the log itself names the unit of a speed."""
    elsewhere = ("from the row of", "from its cells", "paths")
    return guess.is_named or guess.reason.startswith(elsewhere)


def _middle(speeds: Floats) -> float:
    """Median of speeds; 0 where there are none."""
    return float(np.median(speeds)) if speeds.size else 0.0


def _speed_by_positions(
    table: LogTable, guesses: Mapping[str, ColumnGuess]
) -> float | None:
    """Usual speed over stretches of some 10 s, m/s; None without positions."""
    for pair in (("lat", "lon"), ("x", "y")):
        if not {"t", *pair} <= guesses.keys():
            continue
        columns = {name: guesses[name] for name in ("t", *pair)}
        try:
            signals = read_recording(table, columns, "interpolate").signals
        except InputError:
            return None
        t, x = signals["x"]
        _, y = signals["y"]
        if x.size != y.size:
            return None
        rows = max(1, min(round(10.0 / usual_step(t)), t.size // 3))
        change_of_t, *sailed = (one[rows:] - one[:-rows] for one in (t, x, y))
        return _middle(np.hypot(*sailed) / change_of_t)
    return None


def _by_positions(
    guess: ColumnGuess,
    number: float,
    known: float,
) -> ColumnGuess:
    """The guess with the unit in which its usual number agrees best with a speed."""
    if not known > 0.0 or not number > 0.0:
        return guess
    apart = {unit: abs(math.log(known / number / one)) for unit, one in _UNITS.items()}
    nearest = min(apart, key=lambda unit: apart[unit])
    is_named = _is_known(guess)
    # a name is contradicted by what fits exactly alone
    if apart[nearest] > (0.05 if is_named else 0.3):
        return guess
    if is_named and nearest == guess.unit:
        return guess
    reason = (
        f"by the positions, which change by {known:.3g} m/s where it shows {number:.4g}"
    )
    if is_named:
        reason += f", not {guess.unit} as its name or row of units says"
    return replace(guess, unit=nearest, reason=reason)


def _guessed(guess: ColumnGuess, largest: float, *, is_si: bool) -> ColumnGuess:
    """The usual unit of a speed, said to be a guess."""
    fastest = 15.0 if is_si else 3.0  # that is likelier in m/s
    beside = ", with angles in rad" if is_si else ""
    reason = (
        f"is a guess: there are no positions that tell, up to {largest:.4g}{beside};"
        " knots, m/s or km/h"
    )
    return replace(guess, unit="m/s" if largest <= fastest else "knots", reason=reason)
