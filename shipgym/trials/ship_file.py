"""The ship file: one TOML file with a ship's particulars, its data's conventions and its trials."""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self, TypeVar

from shipgym.checks import (
    check_choice,
    check_keys,
    check_table,
    check_text,
    data_only,
    placed,
)
from shipgym.errors import InputError
from shipgym.files import check_readable, read_toml
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from shipgym.ships.structures import own_structure
from shipgym.ships.term_table import Structure
from shipgym.trials.columns import parse_columns
from shipgym.trials.cuts import check_cut
from shipgym.trials.navigation import Instruments
from shipgym.trials.scale import check_scale
from shipgym.trials.tables import read_log
from shipgym.trials.trial import KINDS, USES, Trial, read_trials
from shipgym.trials.trial_import import Conventions

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
_CONVENTIONS = ("rudder_positive", "velocity_frame", "origin", "repair")
Read = TypeVar("Read")
_TRIAL = ("file", "kind", "use", "columns", "cut", "sensors", *_CONVENTIONS)


@dataclass(frozen=True)
class TrialEntry:
    """One ``[[trials]]`` table, checked, with what it takes over from the file's own tables."""

    file: str  # as written, of several joined by " + "; the trial's name
    paths: tuple[
        Path, ...
    ]  # of the file, or of the files that were logged at the same time
    cut: Any  # "rudder", or stretches that are trials each; None: the whole log
    kind: str | None
    use: str
    columns: (
        Mapping[str, Any] | None
    )  # by channel as written; None: those named like channels
    conventions: Conventions
    where: str  # start of messages: "ship.toml: [[trials]] 2"


@dataclass(frozen=True)
class ShipFile:
    """A ship file, read and checked; :meth:`load` makes one."""

    path: Path  # the TOML file
    particulars: Particulars  # as given; ``particulars.completed()`` estimates the rest
    steering: SteeringGear | None  # none where the file has no ``[steering]``
    #: options of the identification, as written in ``[identify]``;
    #: `identification.reading` checks them
    identify: dict[str, Any]
    entries: tuple[TrialEntry, ...]  # the trials, not read yet
    structure: Structure | None = None  # the table of terms in ``[structure]``

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read and check a ship file; the trials' CSV files must exist and are read by :meth:`trials`.

        Paths in the file are relative to its folder, or absolute. Raises InputError for
        a missing file, broken TOML, an unknown key or word, a wrong type or value, no
        trials, a trial listed twice or a missing CSV file, naming file, field, value
        and remedy.
        """
        path = Path(path)
        data = read_toml(path, "ship file")
        check_keys(data, _SECTIONS, str(path))
        if "ship" not in data:
            raise InputError(
                f"{path}: no table [ship] found, expected one with at least the ship's"
                " length in m"
            )
        ship = check_table(data["ship"], f"{path}: [ship]")
        if "estimated" in ship:
            raise InputError(
                f"{path}: [ship]: unknown key 'estimated'; leave out what is not known"
            )

        def section(name: str, read: Callable[[Any, str], Read]) -> Read | None:
            return read(data[name], f"{path}: [{name}]") if name in data else None

        particulars = Particulars.from_mapping(ship, f"{path}: [ship]")
        steering = section("steering", SteeringGear.from_mapping)
        identify = dict(check_table(data.get("identify", {}), f"{path}: [identify]"))
        if "wind" in data:
            identify["wind"] = data["wind"]
        data_only(identify, f"{path}: [identify]")
        structure = section("structure", own_structure)
        return cls(
            path,
            particulars,
            steering,
            identify,
            _entries(path, data, particulars),
            structure,
        )

    def completed_particulars(self) -> Particulars:
        """The particulars with what is absent estimated and marked (:meth:`Particulars.completed`)."""
        with placed(str(self.path)):
            return self.particulars.completed()

    def trials(self, use: str | None = None) -> list[Trial]:
        """Read the trials of a use, by default all but those to skip, each named by its ``file``.

        In the order of the file. Raises InputError for anything wrong with a CSV file.
        """
        if use is not None:
            check_choice(use, USES, f"{self.path}: trials(use)")
        wanted = [
            e
            for e in self.entries
            if (e.use == use if use is not None else e.use != "skip")
        ]
        return [trial for entry in wanted for trial in self._read(entry)]

    def trial(self, file: str) -> Trial:
        """Read one trial by its ``file`` (of a log that is cut, the first), whatever its use."""
        files = [entry.file for entry in self.entries]
        check_choice(file, files, f"{self.path}: trial")
        return self._read(self.entries[files.index(file)])[0]

    def _read(self, entry: TrialEntry) -> list[Trial]:
        with placed(entry.where):
            trials = read_trials(
                [read_log(path) for path in entry.paths],
                entry.columns,
                entry.conventions,
                entry.cut,
                name=entry.file,
                kind=entry.kind,
                use=entry.use,
                length=self.particulars.length,
            )
        for trial in trials:
            check_scale(trial, self.particulars, f"{entry.where}: {entry.paths[0]}")
        return trials


def _entries(
    path: Path, data: Mapping[str, Any], particulars: Particulars
) -> tuple[TrialEntry, ...]:
    tables = data.get("trials", [])
    if not isinstance(tables, list):
        raise InputError(
            f"{path}: trials: a single value found, expected tables that begin with"
            " [[trials]]"
        )
    if not tables:
        raise InputError(
            f"{path}: no trials found, expected at least one [[trials]] table with file"
            ' = "run.csv"'
        )
    shared = {
        name: check_table(data.get(name, {}), f"{path}: [{name}]")
        for name in ("conventions", "columns", "sensors")
    }
    check_keys(shared["conventions"], _CONVENTIONS, f"{path}: [conventions]")
    _conventions(shared["conventions"], {}, particulars, f"{path}: [conventions]")
    parse_columns(shared["columns"], f"{path}: [columns]")
    Instruments.from_mapping(shared["sensors"], f"{path}: [sensors]", particulars)
    entries = [
        _entry(path, f"{path}: [[trials]] {k}", table, shared, particulars)
        for k, table in enumerate(tables, start=1)
    ]
    by_path = {_place(entry): entry for entry in reversed(entries)}
    for entry in entries:
        if by_path[_place(entry)] is not entry:
            raise InputError(
                f"{entry.where} file: '{entry.file}' is listed twice, expected each"
                " file once"
            )
    if all(entry.use == "skip" for entry in entries):
        raise InputError(
            f'{path}: all trials have use = "skip", expected at least one to fit; set'
            ' use = "fit"'
        )
    return tuple(entries)


def _place(entry: TrialEntry) -> tuple[str, ...]:
    """What no two entries share: the files and how they are cut."""
    return (*map(os.path.normpath, entry.paths), str(entry.cut))


def _entry(
    path: Path,
    where: str,
    table: Any,
    shared: Mapping[str, Mapping[str, Any]],
    particulars: Particulars,
) -> TrialEntry:
    """One table, where nothing else stands with what the file has for all."""
    check_keys(check_table(table, where), _TRIAL, where)
    if "file" not in table:
        raise InputError(f'{where}: no file found, expected file = "run.csv"')
    files = (
        table["file"]
        if isinstance(table["file"], list) and table["file"]
        else [table["file"]]
    )
    paths = tuple(path.parent / check_text(file, f"{where} file") for file in files)
    check_cut(table.get("cut"), where)
    kind = (
        check_choice(table["kind"], KINDS, f"{where} kind") if "kind" in table else None
    )
    use = check_choice(table.get("use", "fit"), USES, f"{where} use")
    columns = check_table(table.get("columns", {}), f"{where} columns")
    parse_columns(columns, f"{where} columns")
    sensors = {
        **shared["sensors"],
        **check_table(table.get("sensors", {}), f"{where} sensors"),
    }
    words = {
        **shared["conventions"],
        **{key: table[key] for key in _CONVENTIONS if key in table},
    }
    if use != "skip":
        with placed(f"{where} file"):
            for one in paths:
                check_readable(one, "CSV file")
    conventions = _conventions(words, sensors, particulars, where)
    name, columns = " + ".join(files), {**shared["columns"], **columns}
    return TrialEntry(
        name, paths, table.get("cut"), kind, use, columns or None, conventions, where
    )


def _conventions(
    words: Mapping[str, Any],
    sensors: Mapping[str, Any],
    particulars: Particulars,
    where: str,
) -> Conventions:
    tools = Instruments.from_mapping(sensors, f"{where} sensors", particulars)
    return Conventions(**words, xg=particulars.xg, where=where, instruments=tools)
