"""Logs read with guessed columns and conventions, corrected by what checks propose."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import quoted, shown
from shipgym.errors import InputError
from shipgym.trials.conventions import Conventions, Installation
from shipgym.trials.guesses.attitudes import frame_by_names
from shipgym.trials.guesses.columns import ColumnGuess, guess_columns
from shipgym.trials.guesses.speeds import settle_speeds
from shipgym.trials.guesses.units import UNKNOWN
from shipgym.trials.readers.cell_texts import number_with_side
from shipgym.trials.readers.kinds import read_log
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.rudder_sign import rudder_sign
from shipgym.trials.trial import Trial, trial_of
from shipgym.trials.trial_import import import_tables
from shipgym.trials.units import QUANTITIES, si_unit

#: What a message names that is cured by a line of the ship file.
_CURABLE = ("[columns]", "[conventions]", "[sensors]", "declare ", "column = ")


class RudderSide(NamedTuple):
    """The side to which a positive rudder steers; None where it cannot be told."""

    side: str | None
    reason: str

    @property
    def choices(self) -> str:
        """What there is to decide."""
        return (
            '"starboard" or "port", the side to which the ship turns with a positive'
            f" rudder: {self.reason}"
        )


class ConventionGuess(NamedTuple):
    """A convention that is not the usual one, and why."""

    name: str
    value: str
    reason: str


class Decision(NamedTuple):
    """A line of the ship file that its reader has to complete, and the choices."""

    section: str  # "columns", "conventions", "sensors" or "trials"
    key: str
    choices: str


@dataclass(frozen=True)
class TrialGuess:
    """A log, and the columns and conventions with which it could be read."""

    paths: tuple[Path, ...]  # several that were written at the same time are one log
    columns: list[ColumnGuess]
    conventions: list[ConventionGuess]  # those that are not the usual ones
    trial: Trial | None  # none where a decision is needed first
    unused: list[str]  # columns of which no channel was made
    side: RudderSide | None  # to which a positive rudder steers; none without one
    decisions: list[Decision] = field(default_factory=list)

    @property
    def path(self) -> Path:
        """The file, or the first one."""
        return self.paths[0]

    @property
    def column_names(self) -> list[str]:
        """Names and units of the columns that are used."""
        return [one.declaration for one in self.columns]

    @property
    def unused_names(self) -> str:
        """Names of the columns that are not used."""
        return ", ".join(shown(name) for name in self.unused)

    @property
    def reading(self) -> dict[str, str]:
        """What each channel, and the rudder's sign, was read as, and why."""
        reading = {}
        for one in self.columns:
            unit = one.unit
            for key, value in one.extra:
                unit += f", {key} {value}"
            where = f"column '{one.column}' in {unit}"
            reading[one.channel] = f"{where}, unit {one.reason}"
        for convention in self.conventions:
            reading[convention.name] = f"{convention.value}: {convention.reason}"
        if self.side is not None:
            side = self.side.side or "not known, drawn as to starboard"
            reading["rudder positive to"] = f"{side}: {self.side.reason}"
        if self.unused:
            reading["columns not used"] = self.unused_names
        return reading


def guess_trial(path: str | Path, *others: str | Path) -> TrialGuess:
    """Read a log with guesses; where a check proposes another setting, try that.

    A unit given in a column's name is kept unless the positions contradict it. What a
    line of a ship file can cure is a decision. With `others`, files that were written
    at the same time are read as one log, each channel from the file with most rows of
    it. Raises InputError, as the readers do, for other logs that cannot be read.
    """
    tables = [read_log(one) for one in (path, *others)]
    guesses = _Guesses(tables)
    if not all(_knows_channels(table) for table in tables):
        guesses.columns, guesses.decisions = _guess_tables(tables)
    names = {channel: one.column for channel, one in guesses.columns.items()}
    east = frame_by_names(names)
    if east is not None:
        guesses.take_convention("frame", "enu", east)
    trial = _trial_by_proposals(guesses)
    side = None
    if trial is None:
        guesses.conventions = {}
    else:
        is_turned = "rudder_positive" in guesses.conventions
        side = _rudder_side(guesses, trial, is_turned=is_turned)
        if side is not None and side.side == "port" and not is_turned:
            guesses.take_convention("rudder_positive", "port", side.reason)
            trial = _read(guesses)
        guesses.conventions.pop("rudder_positive", None)
    unused = []
    for table in tables:
        unused += _unused(table, guesses.columns)
    return TrialGuess(
        paths=tuple(table.path for table in tables),
        columns=list(guesses.columns.values()),
        conventions=list(guesses.conventions.values()),
        trial=trial,
        unused=unused,
        side=side,
        decisions=guesses.decisions,
    )


@dataclass
class _Guesses:
    """Tables of a log, and the guesses so far with which they are read."""

    tables: Sequence[LogTable]
    columns: dict[str, ColumnGuess] = field(default_factory=dict)
    conventions: dict[str, ConventionGuess] = field(default_factory=dict)
    decisions: list[Decision] = field(default_factory=list)

    def take_convention(self, name: str, value: str, reason: str) -> None:
        """Read the log with a convention from now on."""
        self.conventions[name] = ConventionGuess(name, value, reason)

    def take_proposal(self, name: str, value: str) -> None:
        """Read the log with a unit or a convention that a check proposed."""
        column = self.columns.get(name)
        if column is not None:
            self.columns[name] = _with_unit(column, value)
        else:
            self.take_convention(name, value, "without it the log is refused")


def _trial_by_proposals(guesses: _Guesses) -> Trial | None:
    """Read a log, with what its checks propose; None where there is to decide first."""
    tried: set[tuple[str, str]] = set()
    while all(one.section == "sensors" for one in guesses.decisions):
        try:
            return _read(guesses)
        except InputError as error:
            proposal = _next_proposal(error, guesses.columns, tried)
            if proposal is None:
                decision = _decision(error, guesses.decisions)
                guesses.decisions.append(decision)
            else:
                tried.add(proposal)
                guesses.take_proposal(*proposal)
    return None


def _knows_channels(table: LogTable) -> bool:
    """Return whether a reader named the columns by their channels, with units."""
    return bool(table.units) and table.cells.keys() <= QUANTITIES.keys()


def _guess_tables(
    tables: Sequence[LogTable],
) -> tuple[dict[str, ColumnGuess], list[Decision]]:
    """Columns of all tables by channel, and what is left to decide."""
    columns: dict[str, ColumnGuess] = {}
    decisions: list[Decision] = []
    by_density = sorted(tables, key=lambda table: len(table.rows), reverse=True)
    for table in by_density:
        found = {guess.channel: guess for guess in guess_columns(table)}
        decisions += _unknown_units(found)
        settled = settle_speeds(table, found)
        for channel, guess in settled.items():
            if len(tables) > 1 and channel != "t":
                reason = f"{guess.reason}; from {table.path.name}"
                guess = guess._replace(reason=reason)
            columns.setdefault(channel, guess)
    asked = {one.key for one in decisions}
    decisions += _missing_columns(tables, columns, asked)
    return columns, decisions


def _rudder_side(
    guesses: _Guesses, trial: Trial, *, is_turned: bool
) -> RudderSide | None:
    """Side of the rudder in a log that was read, `is_turned` with positive to port.

    None without a rudder or heading.
    """
    rudder = trial.channels.get("delta", trial.channels.get("delta_command"))
    if "psi" not in trial or rudder is None:
        return None
    columns = guesses.columns
    column = columns.get("delta") or columns.get("delta_command")
    for table in guesses.tables:
        if column is None or column.column not in table.cells:
            continue
        first = table.first_text(column.column)
        if table.decimal_comma:
            first = first.replace(",", ".")
        if number_with_side(first) is not None:
            return RudderSide("starboard", "the letters S and P of its values")
    found = rudder_sign(trial.t, trial["psi"], rudder)
    if found.side is None:
        hint = found.side_by_hint(is_turned=is_turned)
        return RudderSide(None, f"the log does not tell{hint}")
    if not is_turned:
        return RudderSide(found.side, found.reason)
    if found.side == "port":
        return RudderSide(None, "two checks of the log contradict each other")
    return RudderSide("port", found.reason)


def _unused(table: LogTable, columns: Mapping[str, ColumnGuess]) -> list[str]:
    used = set()
    for guess in columns.values():
        used.add(guess.column)
        for _, value in guess.extra:
            names = value if isinstance(value, tuple) else [str(value)]
            used.update(names)
    known = used or QUANTITIES.keys()
    return [name for name in table.header if name not in known]


def _unknown_units(columns: dict[str, ColumnGuess]) -> list[Decision]:
    """Take out columns whose unit is not known; decisions on those that matter."""
    matter = ("t", "psi", "r", "delta", "delta_command", "sog", "stw", "u")
    decisions = []
    for channel, guess in list(columns.items()):
        if guess.unit != UNKNOWN:
            continue
        del columns[channel]
        if channel not in matter:
            continue
        unit = si_unit(channel)
        line = f'{{ column = {guess.quoted}, unit = "{unit}" }} where that is its unit'
        if channel in ("delta", "delta_command"):
            line = (
                f"{{ column = {guess.quoted}, full = 100 }} where 100 of it are 35 deg"
                " of rudder"
            )
        choices = f"column {guess.quoted}, whose unit {guess.reason}: {line}"
        decisions.append(Decision("columns", channel, choices))
    return decisions


def _missing_columns(
    tables: Sequence[LogTable],
    columns: Mapping[str, ColumnGuess],
    asked: Collection[str],
) -> list[Decision]:
    """Decisions on columns without which a log shows no motion."""
    wanted = {"t": "time"}
    of_motion = {"psi", "r", "x", "lat", "u"}
    if not of_motion & {*columns, *asked}:
        wanted["psi"] = "heading"
        if "delta" not in columns:
            wanted["delta"] = "rudder angle"
    used = {guess.column for guess in columns.values()}
    missing = []
    for channel, words in wanted.items():
        if channel not in columns and channel not in asked:
            choices = _choices(tables, used, channel, words)
            missing.append(Decision("columns", channel, choices))
    return missing


def _choices(
    tables: Sequence[LogTable], used: set[str], channel: str, words: str
) -> str:
    """Free columns that behave as a channel does, or all free ones where none does."""
    free = []
    alike = []
    for table in tables:
        for name in table.header:
            if name in used:
                continue
            free.append(name)
            values = table.likely_numbers(name, sided=True)
            if values is not None and _behaves(channel, values):
                alike.append(name)
    first = next(iter(alike or free), words)
    unit = "s" if channel == "t" else "deg"
    column = f'{{ column = "{first}", unit = "{unit}" }}'
    return (
        f"the column of the {words}, one of {quoted(alike or free)[:1000]}, as {column}"
    )


def _behaves(channel: str, values: Floats) -> bool:
    """Return whether values behave as time, a heading or a rudder in degrees or rad."""
    known = values[np.isfinite(values)]
    if known.size < 3 or np.ptp(known) == 0.0:
        return False
    steps = np.diff(known)
    if channel == "t":
        return bool(np.mean(steps > 0.0) > 0.99)
    largest = np.abs(known).max()
    counts = bool(np.all(steps > 0.0))  # as a number of rows does
    if channel == "psi":
        return not counts and largest <= 720.0
    swings = known.min() < 0.0 < known.max()
    return bool(swings and largest <= 90.0)


def _decision(error: InputError, decisions: list[Decision]) -> Decision:
    """The decision that a refusal leaves to the user; the error where it is none."""
    message = str(error)
    of_clock = "clock_offsets" in message
    is_curable = any(cure in message for cure in _CURABLE)
    if of_clock and not decisions:
        choices = f'"correct" or "keep": {message}'
        return Decision("sensors", "clock_offsets", choices)
    if of_clock or not is_curable:
        raise error
    choices = f'"fit" once this is settled, or "skip": {message}'
    return Decision("trials", "use", choices)


def _read(guesses: _Guesses) -> Trial:
    """Read a log with the guesses so far."""
    tables = guesses.tables
    columns = {}
    for channel, guess in guesses.columns.items():
        columns[channel] = guess.as_column
    words: dict[str, Any] = {"where": f"{tables[0].path}:"}
    for one in guesses.conventions.values():
        words[one.name] = one.value
    if any(one.key == "clock_offsets" for one in guesses.decisions):
        words["installation"] = Installation(clock_offsets="keep")
    conventions = Conventions(**words)
    log = import_tables(tables, columns or None, conventions)
    files = [table.path.name for table in tables]
    return trial_of(log, " + ".join(files))


def _next_proposal(
    error: InputError, columns: Mapping[str, ColumnGuess], tried: set[tuple[str, str]]
) -> tuple[str, str] | None:
    """First proposal of a refusal that was not tried and is no unit given by a name."""
    for proposal in error.instead:
        name, _ = proposal
        may_be_tried = name not in QUANTITIES  # a convention
        if name in columns:
            may_be_tried = not columns[name].is_named
        if may_be_tried and proposal not in tried:
            return proposal
    return None


def _with_unit(guess: ColumnGuess, unit: str) -> ColumnGuess:
    """A column with the unit that a check proposed."""
    reason = f"by the check that refused {guess.unit} ({guess.reason})"
    return guess._replace(unit=unit, reason=reason)
