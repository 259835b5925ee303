"""The ship file: a TOML file of a ship's particulars, conventions and trials."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

from shipgym.checks import check_choice, check_keys, check_table, data_only, placed
from shipgym.errors import InputError
from shipgym.files import LARGEST_TOML, expecting, parse_toml, read_text
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from shipgym.ships.structures import own_structure
from shipgym.ships.term_table import Structure
from shipgym.trials.readers.kinds import read_log
from shipgym.trials.scale import check_scale
from shipgym.trials.trial import USES, Trial, cut_trials, trial_of
from shipgym.trials.trial_entries import TrialEntry, read_entries
from shipgym.trials.trial_import import import_tables, lacking

_SECTIONS = (
    "ship",
    "steering",
    "columns",
    "conventions",
    "sensors",
    "structure",
    "identify",
    "wind",
    "trials",
)

#: A line whose value its reader has to choose, with the choices behind it.
_LINE = re.compile(
    r'[ \t]*([\w.-]+)[ \t]*=[ \t]*"decide"[ \t]*(?:#[ \t]*DECIDE:[ \t]*(.*)|#.*)?'
)
#: A speed that `new-ship` guessed and nobody changed.
_GUESSED_SPEED = re.compile(r"^speed = .*# guessed: ", re.MULTILINE)


@dataclass(frozen=True)
class ShipFile:
    """A ship file, read and checked; :meth:`load` makes one.

    Attributes
    ----------
    path : Path
        The TOML file.
    particulars : Particulars
        As given; ``particulars.completed()`` estimates the rest.
    steering : SteeringGear or None
        None where ``[steering]`` gives nothing.
    identify : dict
        Options of the identification as they stand in ``[identify]``, the table
        ``[wind]`` among them; `identification.pipeline.reading` checks them.
    entries : tuple of TrialEntry
        The trials, not read yet.
    structure : Structure or None
        The table of terms in ``[structure]``.
    undecided : tuple of str
        A message for each value ``"decide"``, which `shipgym new-ship` writes where a
        log does not tell; the usual value stands in its place.
    """

    path: Path
    particulars: Particulars
    steering: SteeringGear | None
    identify: dict[str, Any]
    entries: tuple[TrialEntry, ...]
    structure: Structure | None = None
    undecided: tuple[str, ...] = ()

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read and check a ship file; its logs must exist, :meth:`trials` reads them.

        Paths in the file are relative to its folder, or absolute. Raises InputError for
        a missing file, broken TOML, an unknown key or word, a wrong type or value, no
        trials, a trial listed twice or a missing log, naming file, field, value and
        remedy.
        """
        path = Path(path)
        text, undecided = _read_decided(path)
        data = parse_toml(text, f"{path}:")
        check_keys(data, _SECTIONS, str(path))
        particulars = _read_particulars(path, data)
        if _GUESSED_SPEED.search(text):
            particulars = replace(particulars, estimated=frozenset({"speed"}))
        steering = structure = None
        if data.get("steering", {}) != {}:
            where = f"{path}: [steering]"
            steering = SteeringGear.from_mapping(data["steering"], where)
        if "structure" in data:
            structure = own_structure(data["structure"], f"{path}: [structure]")
        return cls(
            path=path,
            particulars=particulars,
            steering=steering,
            identify=_read_options(path, data),
            entries=read_entries(path, data, particulars),
            structure=structure,
            undecided=undecided,
        )

    def trials(self, use: str | None = None, *, decided: bool = True) -> list[Trial]:
        """Read the trials of a use, by default all but those to skip.

        In the order of the file. Raises InputError for anything wrong with a log and,
        if `decided`, for the first line that is not decided.
        """
        if decided and self.undecided:
            raise InputError(self.undecided[0])
        if use is not None:
            check_choice(use, USES, f"{self.path}: trials(use)")
        return [
            trial
            for entry in self.entries
            if entry.use == use or (use is None and entry.use != "skip")
            for trial in self._read(entry)
        ]

    def faults(self) -> list[str]:
        """What is left to decide, and what is wrong with each log; empty if nothing."""
        used = [entry for entry in self.entries if entry.use != "skip"]
        of_logs = [fault for entry in used for fault in self._faults(entry)]
        return [*self.undecided, *of_logs]

    def _faults(self, entry: TrialEntry) -> list[str]:
        """What is wrong with a log, or what it lacks to identify a model."""
        try:
            first, *_ = self._read(entry)
        except InputError as error:
            return [str(error)]
        known = {*first.channels, *(["u"] if self.particulars.speed else [])}
        return [f"{entry.where}: {words}" for words in lacking(known)]

    def _read(self, entry: TrialEntry) -> list[Trial]:
        """Trials of a log: one, or those that it is cut into."""
        facts: dict[str, Any] = {
            "kind": entry.kind,
            "use": entry.use,
            "length": self.particulars.length,
        }
        with placed(entry.where):
            tables = [read_log(path) for path in entry.paths]
            log = import_tables(tables, entry.columns, entry.conventions)
            if entry.cut is None:
                trials = [trial_of(log, entry.file, **facts)]
            else:
                trials = cut_trials(entry.cut, log, entry.file, entry.where, **facts)
        where = f"{entry.where}: {entry.paths[0]}"
        for trial in trials:
            check_scale(trial, self.particulars, where)
        return trials


def _read_particulars(path: Path, data: Mapping[str, Any]) -> Particulars:
    if "ship" not in data:
        raise InputError(
            f"{path}: expected a table [ship] with at least the ship's length in m, got"
            " none"
        )
    where = f"{path}: [ship]"
    table = check_table(data["ship"], where)
    if "estimated" in table:
        raise InputError(
            f"{where}: unknown key 'estimated'; leave out what is not known"
        )
    return Particulars.from_mapping(table, where)


def _read_options(path: Path, data: Mapping[str, Any]) -> dict[str, Any]:
    """Options of the identification, with the table ``[wind]`` among them."""
    where = f"{path}: [identify]"
    options = dict(check_table(data.get("identify", {}), where))
    if "wind" in data:
        options["wind"] = data["wind"]
    data_only(options, where)
    return options


def _read_decided(path: Path) -> tuple[str, tuple[str, ...]]:
    """Text of a ship file without the values "decide", and a message for each.

    A message names the line of the file and, from its comment, the choices.
    """
    with expecting("ship file", path):
        text = read_text(path, "ship file (TOML)", LARGEST_TOML)
        parse_toml(text, f"{path}:")
    lines = text.splitlines()
    messages = []
    for number, line in enumerate(lines, start=1):
        match = _LINE.fullmatch(line)
        if match is not None:
            key, choices = match.groups("a value as in docs/ship_file.md")
            messages.append(
                f"{path}: line {number}: {key}: expected a decision, got"
                f' "decide"; write {choices.strip()}'
            )
            lines[number - 1] = ""
    return "\n".join(lines), tuple(messages)
