"""The tables ``[[trials]]`` of a ship file, each with what the file has for all of them."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shipgym.checks import (
    check_choice,
    check_table,
    check_text,
    placed,
)
from shipgym.errors import InputError
from shipgym.files import check_readable
from shipgym.ships.particulars import Particulars
from shipgym.trials.columns import parse_columns
from shipgym.trials.conventions import Conventions
from shipgym.trials.cuts import check_cut
from shipgym.trials.installation import AS_LOGGED, Installation
from shipgym.trials.trial import KINDS, USES

_CONVENTIONS = ("rudder_positive", "velocity_frame", "origin", "repair")
_KEYS = ("file", "kind", "use", "columns", "cut", "sensors", *_CONVENTIONS)


@dataclass(frozen=True)
class TrialEntry:
    """One ``[[trials]]`` table, checked, with what it takes over from the file's own tables.

    Attributes
    ----------
    file : str
        As written, of several joined by " + "; the trial's name.
    paths : tuple of Path
        Of the file, or of the files that were logged at the same time.
    cut : "rudder", list or None
        Stretches that are trials each; None: the whole log.
    kind : str or None
        The manoeuvre.
    use : str
        What the trial is for.
    columns : mapping or None
        By channel as written; None: those named like channels.
    conventions : Conventions
        Signs, frame and origin.
    where : str
        Begin of messages: "ship.toml: [[trials]] 2".
    """

    file: str
    paths: tuple[Path, ...]
    cut: Any
    kind: str | None
    use: str
    columns: Mapping[str, Any] | None
    conventions: Conventions
    where: str

    @property
    def log_part(self) -> tuple[str, ...]:
        """What no two entries share: the files and how they are cut."""
        return (*map(os.path.normpath, self.paths), str(self.cut))


@dataclass(frozen=True)
class _Shared:
    """What a ship file has for all of its trials."""

    path: Path
    ship: Particulars
    columns: Mapping[str, Any]
    conventions: Mapping[str, Any]
    sensors: Mapping[str, Any]


def read_entries(
    path: Path, data: Mapping[str, Any], ship: Particulars
) -> tuple[TrialEntry, ...]:
    """Check the trials of a ship file; their files must exist.

    Raises InputError for no trials, a trial listed twice, a missing file, and anything
    wrong in a table, naming it.
    """
    tables = data.get("trials", [])
    if not isinstance(tables, list):
        raise InputError(
            f"{path}: trials: expected tables that begin with [[trials]], got a single"
            " value"
        )
    if not tables:
        raise InputError(
            f'{path}: expected at least one [[trials]] table with file = "run.csv", got'
            " none"
        )
    shared = _read_shared(path, data, ship)
    entries = [
        _read_entry(table, f"{path}: [[trials]] {number}", shared)
        for number, table in enumerate(tables, start=1)
    ]
    _check_entries(path, entries)
    return tuple(entries)


def _read_shared(path: Path, data: Mapping[str, Any], ship: Particulars) -> _Shared:
    columns = check_table(data.get("columns", {}), f"{path}: [columns]")
    parse_columns(columns, f"{path}: [columns]")
    where = f"{path}: [conventions]"
    conventions = data.get("conventions", {})
    check_table(conventions, where, _CONVENTIONS)
    Conventions(**conventions, xg=ship.xg, where=where)
    sensors = check_table(data.get("sensors", {}), f"{path}: [sensors]")
    if sensors:
        Installation.from_mapping(sensors, f"{path}: [sensors]", ship)
    return _Shared(
        path=path,
        ship=ship,
        columns=columns,
        conventions=conventions,
        sensors=sensors,
    )


def _read_entry(table: Any, where: str, shared: _Shared) -> TrialEntry:
    check_table(table, where, _KEYS)
    files = _files(table, where)
    paths = tuple(shared.path.parent / file for file in files)
    use = check_choice(table.get("use", "fit"), USES, f"{where} use")
    if use != "skip":
        with placed(f"{where} file"):
            for path in paths:
                check_readable(path, "CSV file")

    kind = table.get("kind")
    if kind is not None:
        check_choice(kind, KINDS, f"{where} kind")
    cut = table.get("cut")
    check_cut(cut, where)
    columns = check_table(table.get("columns", {}), f"{where} columns")
    parse_columns(columns, f"{where} columns")
    return TrialEntry(
        file=" + ".join(files),
        paths=paths,
        cut=cut,
        kind=kind,
        use=use,
        columns={**shared.columns, **columns} or None,
        conventions=_conventions(table, where, shared),
        where=where,
    )


def _files(table: Mapping[str, Any], where: str) -> list[str]:
    if "file" not in table:
        raise InputError(f'{where}: expected file = "run.csv", got no file')
    files = table["file"]
    if not isinstance(files, list) or not files:
        files = [files]
    return [check_text(file, f"{where} file") for file in files]


def _conventions(table: Mapping[str, Any], where: str, shared: _Shared) -> Conventions:
    """Conventions of an entry, where nothing else stands those of the file."""
    own = {key: table[key] for key in _CONVENTIONS if key in table}
    return Conventions(
        **{**shared.conventions, **own},
        xg=shared.ship.xg,
        where=where,
        installation=_installation(table, where, shared),
    )


def _installation(
    table: Mapping[str, Any], where: str, shared: _Shared
) -> Installation:
    own = check_table(table.get("sensors", {}), f"{where} sensors")
    sensors = {**shared.sensors, **own}
    if not sensors:
        return AS_LOGGED
    return Installation.from_mapping(sensors, f"{where} sensors", shared.ship)


def _check_entries(path: Path, entries: Sequence[TrialEntry]) -> None:
    listed = set()
    for entry in entries:
        if entry.log_part in listed:
            raise InputError(
                f"{entry.where} file: expected each file once, got '{entry.file}' again"
            )
        listed.add(entry.log_part)
    if all(entry.use == "skip" for entry in entries):
        raise InputError(
            f'{path}: expected at least one trial to fit, got use = "skip" for all; set'
            ' use = "fit"'
        )
