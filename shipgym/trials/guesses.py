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
from shipgym.trials.trial_import import RUDDER_SIGNS, Conventions
from shipgym.trials.units import QUANTITIES, UNITS

WORDS: dict[str, dict[str, Any]] = shipped_toml("shipgym.trials", "guesses.toml")


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


def guess_columns(table: Table) -> list[Guess]:
    """The channels of a table; none where no column has a name that is known."""
    found: dict[str, Guess] = {}
    for channel, pattern in WORDS["names"].items():
        for name in table.header:
            bare = re.sub(r"[\[(].*", "", name.lower().replace("_", " ")).strip()
            if name not in found and re.fullmatch(pattern, bare):
                found[name] = _guess(table, channel, name)
                break
    return list(found.values())


def _guess(table: Table, channel: str, name: str) -> Guess:
    quantity = QUANTITIES[channel]
    told = re.split(r"[\[( _]", name.lower().strip(" ])"))[-1]
    for unit, pattern in WORDS["units"].items():
        if unit in UNITS[quantity] and re.fullmatch(pattern, told):
            return Guess(channel, name, unit, "from its name")
    try:
        values = table.numbers(name)
    except InputError:  # clock times, degrees and minutes
        values = np.zeros(0)
    largest = float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))
    large = {"t": (1e8, "unix")} | WORDS["large"]
    limit, unit = large.get(channel) or large.get(quantity) or (np.inf, "")
    if largest <= limit:
        unit = next(iter(UNITS[quantity]))
    reason = f"from its size, up to {largest:.4g}" if values.size else "from its content"
    return Guess(channel, name, unit, reason)


def guess_trial(path: str | Path) -> tuple[list[Guess], str, Trial]:
    """The columns of a log, the side to which a positive rudder steers, and the log read so.

    Raises InputError, as the readers do, for a log that can be read with neither sign of the rudder.
    """
    table = read_log(path)
    guesses = [] if table.time_unit != "s" else guess_columns(table)
    columns = {one.channel: {"column": one.column, "unit": one.unit} for one in guesses} or None
    first = InputError(f"{path}: cannot be read")
    for side in RUDDER_SIGNS:
        try:
            conventions = Conventions(side, where=f"{path}:")
            return guesses, side, read_trials([table], columns, conventions, name=Path(path).name)[0]
        except InputError as error:
            first = error if side == RUDDER_SIGNS[0] else first
            if "rudder_positive" not in str(error):
                break
    raise first
