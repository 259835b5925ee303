"""The ship file: a TOML file of a ship's particulars, conventions and trials."""

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

from shipgym.checks import (
    check_choice,
    check_keys,
    check_table,
    check_text,
    data_only,
    placed,
    shown,
)
from shipgym.errors import InputError
from shipgym.files import LARGEST_TOML, check_readable, expecting, parse_toml, read_text
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from shipgym.ships.structures import own_structure
from shipgym.ships.term_table import Structure
from shipgym.trials.columns import Column, parse_columns
from shipgym.trials.conventions import Conventions, Installation
from shipgym.trials.cuts import check_cut
from shipgym.trials.readers.kinds import read_log
from shipgym.trials.scale import check_scale
from shipgym.trials.trial import USES, Trial, check_kind, cut_trials, trial_of
from shipgym.trials.trial_import import import_table, lacking

_CONVENTIONS = ("rudder_positive", "velocity_frame", "frame", "origin", "repair")
_KEYS = ("file", "kind", "use", "columns", "cut", "sensors", *_CONVENTIONS)


@dataclass(frozen=True)
class TrialEntry:
    """One ``[[trials]]`` table, checked and completed by the file's own tables.

    Attributes
    ----------
    file : str
        As written; the trial's name.
    path : Path
        Of the file.
    use : str
        What the trial is for.
    kind : str or None
        The manoeuvre.
    cut : "rudder", list or None
        Stretches that are trials each; None: the whole log.
    columns : mapping or None
        By channel; None: those named like channels.
    conventions : Conventions
        Signs, frame and origin.
    where : str
        Begin of messages: "ship.toml: [[trials]] 2".
    """

    file: str
    path: Path
    use: str
    kind: str | None
    cut: Any
    columns: Mapping[str, Column] | None
    conventions: Conventions
    where: str


def read_entries(
    path: Path, data: Mapping[str, Any], ship: Particulars
) -> tuple[TrialEntry, ...]:
    """Check the trials of a ship file; their files must exist.

    Raises InputError for no trials, a trial listed twice, a missing file, and anything
    wrong in a table, naming it.
    """
    tables = data.get("trials", [])
    if not isinstance(tables, list) or not tables:
        raise InputError(
            f"{path}: trials: expected tables that begin with [[trials]], at least one"
            f' with file = "run.csv", got {shown(tables)}'
        )
    columns = parse_columns(data.get("columns", {}), f"{path}: [columns]")
    sensors = data.get("sensors", {})
    installation = Installation.from_mapping(sensors, f"{path}: [sensors]")
    where = f"{path}: [conventions]"
    words = check_table(data.get("conventions", {}), where, _CONVENTIONS)
    usual = Conventions(**words, xg=ship.xg, where=where, installation=installation)
    entries: dict[tuple[str, str], TrialEntry] = {}
    for number, table in enumerate(tables, start=1):
        where = f"{path}: [[trials]] {number}"
        check_table(table, where, _KEYS)
        own_columns = parse_columns(table.get("columns", {}), f"{where} columns")
        own = {key: table[key] for key in _CONVENTIONS if key in table}
        if "sensors" in table:
            place = f"{where} sensors"
            every = {**sensors, **check_table(table["sensors"], place)}
            own["installation"] = Installation.from_mapping(every, place)
        conventions = replace(usual, **own, where=where)
        _check_antenna(conventions.installation, ship, where)
        known = {**columns, **own_columns}
        entry = _read_entry(table, path.parent, where, known, conventions)
        part = os.path.normpath(entry.path), str(entry.cut)
        if part in entries:
            raise InputError(
                f"{where} file: expected each file once, got '{entry.file}' again"
            )
        entries[part] = entry
    if all(entry.use == "skip" for entry in entries.values()):
        raise InputError(
            f'{path}: expected at least one trial to fit, got use = "skip" for all; set'
            ' use = "fit"'
        )
    return tuple(entries.values())


def _check_antenna(at: Installation, ship: Particulars, where: str) -> None:
    """Refuse an antenna that is not on the ship."""
    beam = ship.beam or ship.length
    for side, place, size in (
        ("forward", at.forward, ship.length),
        ("starboard", at.starboard, beam),
    ):
        if abs(place) > 0.75 * size:
            raise InputError(
                f"{where} gnss_antenna.{side}: expected a place on the ship, in m from"
                f" midship, got {place:g} where her size is {size:g} m; correct it"
            )


def _read_entry(
    table: Mapping[str, Any],
    folder: Path,
    where: str,
    columns: Mapping[str, Column],
    conventions: Conventions,
) -> TrialEntry:
    if "file" not in table:
        raise InputError(f'{where}: expected file = "run.csv", got no file')
    if isinstance(table["file"], list):
        raise InputError(
            f"{where} file: expected one file, got a list; join files of one time by"
            " their clocks, as pandas.merge_asof does"
        )
    file = check_text(table["file"], f"{where} file")
    path = folder / file
    use = check_choice(table.get("use", "fit"), USES, f"{where} use")
    if use != "skip":
        with placed(f"{where} file"):
            check_readable(path, "CSV file")
    if "kind" in table:
        check_kind(table["kind"], f"{where} kind")
    if "cut" in table:
        check_cut(table["cut"], where)
    return TrialEntry(
        file=file,
        path=path,
        use=use,
        kind=table.get("kind"),
        cut=table.get("cut"),
        columns=columns or None,
        conventions=conventions,
        where=where,
    )


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
        ``[wind]`` among them; `identification.pipeline.options` checks them.
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

    def trials(self, *, decided: bool = True) -> list[Trial]:
        """Read the trials but those to skip, in the order of the file.

        Raises InputError for anything wrong with a log and, if `decided`, for the first
        line that is not decided.
        """
        if decided and self.undecided:
            raise InputError(self.undecided[0])
        return [trial for entry in self._used for trial in self._read(entry)]

    @property
    def _used(self) -> list[TrialEntry]:
        return [entry for entry in self.entries if entry.use != "skip"]

    def faults(self) -> list[str]:
        """What is left to decide, and what is wrong with each log; empty if nothing."""
        of_logs = [fault for entry in self._used for fault in self._faults(entry)]
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
            table = read_log(entry.path)
            log = import_table(table, entry.columns, entry.conventions)
            if entry.cut is None:
                trials = [trial_of(log, entry.file, **facts)]
            else:
                trials = cut_trials(entry.cut, log, entry.file, entry.where, **facts)
        where = f"{entry.where}: {entry.path}"
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
