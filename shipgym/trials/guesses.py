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

    A column whose name ends with a unit of another quantity is not taken: a gyro in
    deg/s is no heading.
    """
    found: dict[str, Guess] = {}
    for channel, pattern in WORDS["names"].items():
        for name in table.header:
            text = name.lower().replace("_", " ")
            forms = (
                re.sub(r"[\[(].*", "", text).strip(),
                re.sub(r"[\[\]() ]+", " ", text).strip(),
            )
            unit = _unit_named(text, QUANTITIES[channel])
            known = name not in found and any(
                re.fullmatch(pattern, form) for form in forms
            )
            if known and unit is not None:
                found[name] = (
                    Guess(channel, name, unit, _NAMED)
                    if unit
                    else _by_size(table, channel, name)
                )
                break
    return list(found.values())


def _unit_named(name: str, quantity: str) -> str | None:
    """The unit of a quantity with which a name ends, empty where it ends with none; None: another's."""
    ends = {
        unit: rf"(.*[\[( ])?({words})[\]) ]*" for unit, words in WORDS["units"].items()
    }
    found = [unit for unit, end in ends.items() if re.fullmatch(end, name)]
    other = (
        None if max(map(len, found), default=0) > 1 else ""
    )  # one letter may be no unit: "Heading M"
    return next((unit for unit in found if unit in UNITS[quantity]), other)


def _by_size(table: Table, channel: str, name: str) -> Guess:
    quantity = QUANTITIES[channel]
    try:
        values = table.numbers(name)
    except InputError:  # clock times, degrees and minutes
        values = np.zeros(0)
    largest = float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))
    limit, unit = (
        WORDS["large"].get(channel) or WORDS["large"].get(quantity) or (np.inf, "")
    )
    if largest <= limit:
        unit = next(iter(UNITS[quantity]))
    if unit == "unix" and largest > 1e11:
        unit = "unix ms"
    reason = (
        f"from its size, up to {largest:.4g}" if values.size else "from its content"
    )
    return Guess(channel, name, unit, reason)


def guess_trial(path: str | Path) -> GuessedTrial:
    """A log, read with what is guessed, and where the readers' checks name something else, with that.

    Raises InputError, as the readers do, for a log that cannot be read so.
    """
    table = read_log(path)
    guesses = (
        {one.channel: one for one in guess_columns(table)}
        if table.time_unit == "s"
        else {}
    )
    changed: dict[str, Any] = {}
    tried: set[tuple[str, str]] = set()
    while True:
        columns = {
            one.channel: {"column": one.column, "unit": one.unit}
            for one in guesses.values()
        } or None
        conventions = Conventions(**changed, where=f"{path}:")
        try:
            trial = read_trials([table], columns, conventions, name=Path(path).name)[0]
            break
        except InputError as error:
            fixed = QUANTITIES.keys() - {
                one.channel for one in guesses.values() if one.reason != _NAMED
            }
            left = [
                one for one in error.instead if one not in tried and one[0] not in fixed
            ]
            if not left:
                raise
            tried.add(left[0])
            name, value = left[0]
            if name in guesses:
                _, column, unit, reason = guesses[name]
                guesses[name] = Guess(
                    name, column, value, f"by the check that refused {unit} ({reason})"
                )
            else:
                changed[name] = value
    used = [one.column for one in guesses.values()] or QUANTITIES
    unused = [name for name in table.header if name not in used]
    return GuessedTrial(list(guesses.values()), changed, trial, unused)
