"""Logs read with guessed columns and conventions, corrected by what checks propose."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from shipgym.errors import InputError
from shipgym.trials.columns import Column
from shipgym.trials.conventions import Conventions
from shipgym.trials.guesses.columns import ColumnGuess, guess_columns
from shipgym.trials.plausibility.refusal import Proposal
from shipgym.trials.readers.kinds import read_log
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.trial import Trial, trial_of
from shipgym.trials.trial_import import import_tables
from shipgym.trials.units import QUANTITIES


class ConventionGuess(NamedTuple):
    """A convention that is not the usual one, and why."""

    name: str
    value: str
    reason: str


@dataclass(frozen=True)
class TrialGuess:
    """A log, and the columns and conventions with which it could be read."""

    columns: list[ColumnGuess]
    conventions: list[ConventionGuess]  # those that are not the usual ones
    trial: Trial
    unused: list[str]  # columns of which no channel was made


def guess_trial(path: str | Path, *, checksums: str = "optional") -> TrialGuess:
    """Read a log with guesses; where a check proposes another setting, try that.

    A unit given in a column's name is kept. With `checksums` "required" sentences of
    NMEA 0183 without one count as damaged. Raises InputError, as the readers do, for
    a log that cannot be read so.
    """
    table = read_log(path, checksums=checksums)
    columns: dict[str, ColumnGuess] = {}
    if not table.units:  # the reader knows none
        columns = {guess.channel: guess for guess in guess_columns(table)}
    conventions: dict[str, ConventionGuess] = {}
    tried: set[Proposal] = set()
    while True:
        try:
            trial = _read(table, columns, conventions)
            break
        except InputError as error:
            proposal = _next_proposal(error, columns, tried)
            if proposal is None:
                raise
        tried.add(proposal)
        name, value = proposal
        if name in columns:
            columns[name] = _with_unit(columns[name], value)
        else:
            reason = "without it a log is refused"
            conventions[name] = ConventionGuess(name, value, reason)

    used = {guess.column for guess in columns.values()} or QUANTITIES.keys()
    return TrialGuess(
        columns=list(columns.values()),
        conventions=list(conventions.values()),
        trial=trial,
        unused=[name for name in table.header if name not in used],
    )


def _read(
    table: LogTable,
    guesses: Mapping[str, ColumnGuess],
    conventions: Mapping[str, ConventionGuess],
) -> Trial:
    """Read a log with the guesses so far."""
    columns = {}
    for channel, guess in guesses.items():
        columns[channel] = Column(guess.column, guess.unit)
    words: dict[str, Any] = {"where": f"{table.path}:"}
    for one in conventions.values():
        words[one.name] = one.value
    log = import_tables(
        [table],
        columns or None,
        Conventions(**words),
    )
    return trial_of(log, table.path.name)


def _next_proposal(
    error: InputError, columns: Mapping[str, ColumnGuess], tried: set[Proposal]
) -> Proposal | None:
    """First proposal of a refusal that was not tried and is no unit given by a name."""
    for name, value in error.instead:
        proposal = Proposal(name, value)
        may_be_tried = name not in QUANTITIES  # a convention
        if name in columns:
            may_be_tried = columns[name].reason != "from its name"
        if may_be_tried and proposal not in tried:
            return proposal
    return None


def _with_unit(guess: ColumnGuess, unit: str) -> ColumnGuess:
    """A column with the unit that a check proposed."""
    reason = f"by the check that refused {guess.unit} ({guess.reason})"
    return guess._replace(unit=unit, reason=reason)
