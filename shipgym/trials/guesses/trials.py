"""Logs read with guessed columns and conventions, corrected by what checks propose."""

import json
import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import quoted, shown
from shipgym.errors import InputError
from shipgym.trials.columns import ColumnGuess
from shipgym.trials.conventions import Conventions
from shipgym.trials.guesses.columns import (
    RUDDERS,
    UNKNOWN,
    guess_columns,
    unit_by_size,
)
from shipgym.trials.readers.cell_texts import number_with_side
from shipgym.trials.readers.kinds import read_log
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.rudder_sign import RudderSide, rudder_side
from shipgym.trials.trial import Trial, trial_of
from shipgym.trials.trial_import import import_table
from shipgym.trials.units import QUANTITIES, si_unit

#: Channels of which a log without their unit has to be asked about.
_NEEDED = ("t", "psi", "r", *RUDDERS, "sog", "stw", "u")
#: Names of messages of ROS, whose world is east, north, up, and whose bodies are
#: forward, port, up (REP 103).
_ROS = re.compile(
    r"(^|[._/])(orientation|pose|twist|angular_?velocity)[._/](?!.*(head|hdg|compass))",
    re.IGNORECASE,
)


class ConventionGuess(NamedTuple):
    """A convention that is not the usual one, and why."""

    name: str
    value: str
    reason: str


class Decision(NamedTuple):
    """A line of the ship file that its reader has to complete, and the choices."""

    section: str  # "columns" or "trials"
    key: str
    choices: str


@dataclass
class TrialGuess:
    """A log, and the columns and conventions with which it could be read.

    Attributes
    ----------
    table : LogTable
        The file.
    columns : list of ColumnGuess
        Empty where the reader knows the channels.
    conventions : list of ConventionGuess
        Those that are not the usual ones.
    decisions : list of Decision
        What is to be decided first.
    trial : Trial or None
        None where a decision is needed first.
    side : RudderSide or None
        To which a positive rudder steers; None without one.
    """

    table: LogTable
    columns: list[ColumnGuess] = field(default_factory=list)
    conventions: list[ConventionGuess] = field(default_factory=list)
    decisions: list[Decision] = field(default_factory=list)
    trial: Trial | None = None
    side: RudderSide | None = None

    @property
    def unused(self) -> list[str]:
        """Columns of which no channel was made."""
        used: set[Any] = {*QUANTITIES} if not self.columns else set()
        used.update(*(guess.names for guess in self.columns))
        return [name for name in self.table.header if name not in used]

    @property
    def unused_names(self) -> str:
        """Names of the columns that are not used."""
        return ", ".join(shown(name) for name in self.unused)

    @property
    def reading(self) -> dict[str, str]:
        """What each channel, and the rudder's sign, was read as, and why."""
        reading = dict(self.table.sources)
        for one in self.columns:
            where = f"column '{one.name}' in {one.unit}"
            for key, value in one.extra.items():
                where += f", {key} {value}"
            reading[one.channel] = f"{where}, unit {one.reason}"
        for convention in self.conventions:
            reading[convention.name] = f"{convention.value}: {convention.reason}"
        if self.side is not None:
            side = self.side.side or "not known, drawn as to starboard"
            reading["rudder positive to"] = f"{side}: {self.side.reason}"
        if self.unused:
            reading["columns not used"] = self.unused_names
        return reading

    def take(self, name: str, value: str, reason: str) -> None:
        """Read the log with a unit or a convention from now on."""
        if name not in QUANTITIES:
            self.conventions.append(ConventionGuess(name, value, reason))
        together = ("u", "v") if name == "u" else (name,)
        columns = []
        for one in self.columns:
            if one.channel in together:
                because = f"fits where {one.unit} does not ({one.reason})"
                one = replace(one, unit=value, reason=because)
            columns.append(one)
        self.columns = columns

    def read(self) -> Trial:
        """Read the log with the guesses so far."""
        columns = {one.channel: one for one in self.columns}
        words: dict[str, Any] = {one.name: one.value for one in self.conventions}
        conventions = Conventions(**words, where=f"{self.table.path}:")
        log = import_table(self.table, columns or None, conventions)
        return trial_of(log, self.table.path.name)


def guess_trial(path: str | Path) -> TrialGuess:
    """Read a log with guesses; where a check proposes another setting, try that.

    A unit given in a column's name is kept unless the positions contradict it. Where a
    log cannot be read so, that is a decision. Raises InputError for a file that is no
    log.
    """
    table = read_log(path)
    guess = TrialGuess(table)
    # some readers name the columns by their channels, with units
    if not (table.units and table.cells.keys() <= QUANTITIES.keys()):
        _guess_table(guess)
    _take_frame(guess)
    guess.trial = _trial_by_proposals(guess)
    if guess.trial is not None and guess.trial.channels.keys().isdisjoint(RUDDERS):
        guess.decisions += _rudder_by_behaviour(guess)
    if guess.trial is None:
        guess.conventions = []
        return guess
    guess.side = _rudder_side(guess, guess.trial)
    if guess.side and guess.side.side == "port":
        guess.take("rudder_positive", "port", guess.side.reason)
        guess.trial = guess.read()
    guess.conventions = [
        one for one in guess.conventions if one.name != "rudder_positive"
    ]
    return guess


def _take_frame(guess: TrialGuess) -> None:
    """Count angles from east where the names of their columns are those of ROS."""
    for one in guess.columns:
        if one.channel in ("psi", "r") and _ROS.search(one.name):
            reason = (
                f"'{one.name}' is named as messages of ROS, whose angles count from"
                " east and to port; check it with a turn whose side is known"
            )
            guess.take("frame", "enu", reason)
            return


def _trial_by_proposals(guess: TrialGuess) -> Trial | None:
    """Read a log, with what its checks propose; None where there is to decide first."""
    tried: set[tuple[str, str]] = set()
    while not guess.decisions:
        try:
            return guess.read()
        except InputError as error:
            free = {one.channel for one in guess.columns if not one.is_named}
            proposals = (
                one
                for one in error.instead
                if one not in tried and (one[0] in free or one[0] not in QUANTITIES)
            )
            proposal = next(proposals, None)
            if proposal is not None:
                tried.add(proposal)
                guess.take(*proposal, "without it the log is refused")
            else:
                choices = f'"fit" once this is settled, or "skip": {error}'
                guess.decisions.append(Decision("trials", "use", choices))
    return None


def _guess_table(guess: TrialGuess) -> None:
    """Add the columns by channel, and what is left to decide."""
    _check_numbers(guess.table)
    found = guess_columns(guess.table)
    columns = {one.channel: one for one in found}
    decisions = _unknown_units(columns)
    guess.decisions += decisions
    guess.columns = list(columns.values())
    _ask_for_missing(guess)


def _check_numbers(table: LogTable) -> None:
    """Refuse a text in which no column holds numbers."""
    columns = map(table.likely_numbers, table.header)
    if not any(one is not None and np.isfinite(one).any() for one in columns):
        raise InputError(
            f"{table.path}: expected a log, got a text without a table of numbers; name"
            " a log, its columns named in one line and numbers below"
        )


def _ask_for_missing(guess: TrialGuess) -> None:
    """Add decisions on columns without which a log shows no motion."""
    known = {one.channel for one in guess.columns}
    known |= {one.key for one in guess.decisions}
    wanted = {"t": "time"}
    if known.isdisjoint(("psi", "r", "x", "lat", "u")):
        wanted |= {"psi": "heading", "delta": "rudder angle"}
    for channel, words in wanted.items():
        if channel not in known:
            unit = "s" if channel == "t" else "deg"
            choices = (
                f"the column of the {words}, one of {quoted(guess.unused)[:1000]}, as"
                f' {{ column = "...", unit = "{unit}" }}'
            )
            guess.decisions.append(Decision("columns", channel, choices))


def _rudder_by_behaviour(guess: TrialGuess) -> list[Decision]:
    """A decision on a column within 40 that moves before the heading turns."""
    for name in guess.unused:
        values = guess.table.likely_numbers(name)
        if values is None or not _is_small(values):
            continue
        unit = unit_by_size(values, "delta").unit
        rudder = ColumnGuess(name, unit, channel="delta")
        columns = [*guess.columns, rudder]
        candidate = TrialGuess(guess.table, columns, [*guess.conventions])
        trial = _trial_by_proposals(candidate)
        side = _rudder_side(candidate, trial) if trial is not None else None
        if side is not None and side.side is not None:
            choices = (
                "likely the rudder, as it moves before the heading turns:"
                f" {rudder.declaration}"
            )
            return [Decision("columns", "delta", choices)]
    return []


def _is_small(values: Floats) -> bool:
    """Return whether values are to both sides of zero and within 40."""
    known = values[np.isfinite(values)]
    return bool(-40.0 <= known.min(initial=0.0) < 0.0 < known.max(initial=0.0) <= 40.0)


def _rudder_side(guess: TrialGuess, trial: Trial) -> RudderSide | None:
    """Side of the rudder by its letters or its turning; None without it or heading."""
    command = trial.channels.get("delta_command")
    rudder = trial.channels.get("delta", command)
    if "psi" not in trial or rudder is None or np.ptp(rudder) == 0.0:
        return None
    for one in guess.columns:
        text = guess.table.first_text(one.name)
        if one.channel in RUDDERS and number_with_side(text) is not None:
            return RudderSide("starboard", "the letters S and P of its values")
    found = rudder_side(trial.t, trial["psi"], rudder)
    is_turned = any(one.name == "rudder_positive" for one in guess.conventions)
    return found._replace(side="port") if found.side and is_turned else found


def _unknown_units(columns: dict[str, ColumnGuess]) -> list[Decision]:
    """Take out columns whose unit is not known; decisions on those that matter."""
    decisions = []
    unknown = [one for one in columns.values() if one.unit == UNKNOWN]
    for guess in unknown:
        channel = guess.channel
        del columns[channel]
        if channel not in _NEEDED:
            continue
        usual = si_unit(channel)
        unit = f'unit = "{usual}" }} where that is its unit'
        if channel in RUDDERS:
            unit = "full = 100 } where 100 of it are 35 deg of rudder"
        name = json.dumps(guess.name, ensure_ascii=False)
        choices = (
            f"column {name}, whose unit {guess.reason}: {{ column = {name}, {unit}"
        )
        decisions.append(Decision("columns", channel, choices))
    return decisions
