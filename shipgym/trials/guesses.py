"""Which column of a log holds which channel, guessed by its name and size, with the reason of each guess."""

import json
import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from shipgym.errors import InputError
from shipgym.files import shipped_toml
from shipgym.trials.csv_reader import Table
from shipgym.trials.tables import read_log
from shipgym.trials.trial import Trial, read_trials
from shipgym.trials.trial_import import Conventions
from shipgym.trials.units import QUANTITIES, UNITS

WORDS: dict[str, dict[str, Any]] = shipped_toml("shipgym.trials", "guesses.toml")
_NAMED = "from its name"
_SINCE_1970 = 1e8  # s; more is no time since the start of a log


class Guess(NamedTuple):
    """The column of a channel."""

    channel: str
    column: str
    unit: str
    reason: str

    @property
    def quoted(self) -> str:
        """The name of the column as TOML has it."""
        return json.dumps(self.column, ensure_ascii=False)


class GuessedTrial(NamedTuple):
    """A log, and the columns and conventions with which it could be read."""

    columns: list[Guess]
    conventions: dict[str, str]  # those that are not the usual ones
    trial: Trial
    unused: list[str]  # names of the columns of which no channel was made


def guess_columns(table: Table) -> list[Guess]:
    """The channels of a table; none where no column has a name that is known.

    A column whose name ends with a unit of another quantity is not taken: a gyro in deg/s is no heading.
    """
    found: dict[str, Guess] = {}
    readings = {name: _without_units(name) for name in table.header}
    for words in ("names", "names_with_unit"):
        for channel, pattern in WORDS[words].items():
            for name, bare in readings.items():
                fitting = [unit for unit in bare if unit in UNITS[QUANTITIES[channel]]]
                known = any(re.fullmatch(pattern, bare[unit]) for unit in ("", *fitting))
                any_unit = words == "names" and max(map(len, bare)) < 2  # one letter may be none: "Rudder S"
                taken = channel in found or any(name == one.column for one in found.values())
                if known and not taken and (fitting or any_unit):
                    found[channel] = _guess(table, channel, name, fitting)
    return list(found.values())


def _without_units(name: str) -> dict[str, str]:
    """A name without brackets as it is, and by each unit that may end it, the longer ones first, without."""
    text = name.lower().replace("_", " ")
    ends = {unit: rf"(?:(.*)[\[( ])?(?:{words})[\]) ]*" for unit, words in WORDS["units"].items()}
    found = {unit: re.fullmatch(end, text) for unit, end in {"": "(.*)", **ends}.items()}
    return {unit: re.sub(r"[\[(].*", "", match[1] or "").strip() for unit, match in found.items() if match}


def _guess(table: Table, channel: str, name: str, named: list[str]) -> Guess:
    if named and channel != "t":
        return Guess(channel, name, named[0], _NAMED)
    try:
        values = table.numbers(name)
    except InputError:  # clock times, degrees and minutes
        values = np.zeros(0)
    quantity = QUANTITIES[channel]
    largest = float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))
    limit, unit = WORDS["large"].get(channel) or WORDS["large"].get(quantity) or (np.inf, "")
    size = f"from its size, up to {largest:.4g}" if values.size else "from its content"
    if named or largest <= limit:
        unit = (*named, *UNITS[quantity])[0]
    if channel == "t" and largest * UNITS[quantity][unit] > _SINCE_1970:
        return Guess(channel, name, "unix ms" if largest > 1e3 * _SINCE_1970 else "unix", size)
    return Guess(channel, name, unit, _NAMED if named else size)


def guess_trial(path: str | Path) -> GuessedTrial:
    """A log, read with what is guessed, and where the readers' checks name something else, with that.

    Raises InputError, as the readers do, for a log that cannot be read so.
    """
    table = read_log(path)
    guesses = {one.channel: one for one in guess_columns(table)} if table.time_unit == "s" else {}
    changed: dict[str, Any] = {}
    tried: set[tuple[str, str]] = set()
    while True:
        columns = {one.channel: {"column": one.column, "unit": one.unit} for one in guesses.values()} or None
        conventions = Conventions(**changed, where=f"{path}:")
        try:
            trial = read_trials([table], columns, conventions, name=Path(path).name)[0]
            break
        except InputError as error:
            fixed = QUANTITIES.keys() - {one.channel for one in guesses.values() if one.reason != _NAMED}
            left = [one for one in error.instead if one not in tried and one[0] not in fixed]
            if not left:
                raise
            tried.add(left[0])
            name, value = left[0]
            if name in guesses:
                _, column, unit, reason = guesses[name]
                guesses[name] = Guess(name, column, value, f"by the check that refused {unit} ({reason})")
            else:
                changed[name] = value
    used = [one.column for one in guesses.values()] or QUANTITIES
    unused = [name for name in table.header if name not in used]
    return GuessedTrial(list(guesses.values()), changed, trial, unused)
