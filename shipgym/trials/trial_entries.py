"""The tables ``[[trials]]`` of a ship file, with what the file gives for all."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from shipgym.checks import check_choice, check_table, check_text, placed
from shipgym.errors import InputError
from shipgym.files import check_readable
from shipgym.ships.particulars import Particulars
from shipgym.trials.columns import Column, parse_columns
from shipgym.trials.conventions import AS_LOGGED, Conventions, Installation
from shipgym.trials.cuts import check_cut
from shipgym.trials.trial import KINDS, USES

_CONVENTIONS = ("rudder_positive", "velocity_frame", "frame", "origin", "repair")
_KEYS = ("file", "kind", "use", "columns", "cut", "sensors", *_CONVENTIONS)


@dataclass(frozen=True)
class TrialEntry:
    """One ``[[trials]]`` table, checked and completed by the file's own tables.

    Attributes
    ----------
    file : str
        As written, of several joined by " + "; the trial's name.
    paths : tuple of Path
        Of the file, or of the files that were logged at the same time.
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
    paths: tuple[Path, ...]
    use: str
    kind: str | None
    cut: Any
    columns: Mapping[str, Column] | None
    conventions: Conventions
    where: str


@dataclass(frozen=True)
class _Shared:
    """Contents of a ship file that hold for all of its trials."""

    ship: Particulars
    columns: Mapping[str, Column]
    sensors: Mapping[str, Any]
    conventions: Conventions


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
    entries = []
    for number, table in enumerate(tables, start=1):
        where = f"{path}: [[trials]] {number}"
        entries.append(_read_entry(table, path.parent, where, shared))
    _check_entries(path, entries)
    return tuple(entries)


def _read_shared(path: Path, data: Mapping[str, Any], ship: Particulars) -> _Shared:
    columns = parse_columns(data.get("columns", {}), f"{path}: [columns]")
    where = f"{path}: [conventions]"
    words = check_table(data.get("conventions", {}), where, _CONVENTIONS)
    sensors = check_table(data.get("sensors", {}), f"{path}: [sensors]")
    installation = AS_LOGGED
    if sensors:
        installation = Installation.from_mapping(sensors, f"{path}: [sensors]", ship)
    conventions = Conventions(
        **words, xg=ship.xg, where=where, installation=installation
    )
    return _Shared(ship, columns, sensors, conventions)


def _read_entry(table: Any, folder: Path, where: str, shared: _Shared) -> TrialEntry:
    check_table(table, where, _KEYS)
    files = _files(table, where)
    paths = tuple(folder / file for file in files)
    use = check_choice(table.get("use", "fit"), USES, f"{where} use")
    if use != "skip":
        with placed(f"{where} file"):
            for path in paths:
                check_readable(path, "CSV file")

    if "kind" in table:
        check_choice(table["kind"], KINDS, f"{where} kind")
    if "cut" in table:
        check_cut(table["cut"], where)
    columns = shared.columns
    if "columns" in table:
        columns = {**columns, **parse_columns(table["columns"], f"{where} columns")}
    conventions = shared.conventions
    own = {*_CONVENTIONS, "sensors"} & table.keys()
    if own:
        conventions = _own_conventions(table, where, shared)
    return TrialEntry(
        file=" + ".join(files),
        paths=paths,
        use=use,
        kind=table.get("kind"),
        cut=table.get("cut"),
        columns=columns or None,
        conventions=conventions,
        where=where,
    )


def _files(table: Mapping[str, Any], where: str) -> list[str]:
    if "file" not in table:
        raise InputError(f'{where}: expected file = "run.csv", got no file')
    files = table["file"]
    if not isinstance(files, list) or not files:
        files = [files]
    return [check_text(file, f"{where} file") for file in files]


def _own_conventions(
    table: Mapping[str, Any], where: str, shared: _Shared
) -> Conventions:
    """Conventions of an entry; where it has no word of its own, that of the file."""
    own = {key: table[key] for key in _CONVENTIONS if key in table}
    installation = shared.conventions.installation
    if "sensors" in table:
        place = f"{where} sensors"
        own_sensors = check_table(table["sensors"], place)
        sensors = {**shared.sensors, **own_sensors}
        installation = Installation.from_mapping(sensors, place, shared.ship)
    return replace(shared.conventions, where=where, installation=installation, **own)


def _check_entries(path: Path, entries: Sequence[TrialEntry]) -> None:
    """Refuse a file listed again with the same cut, and a file with nothing to fit."""
    listed = set()
    for entry in entries:
        part = (*map(os.path.normpath, entry.paths), str(entry.cut))
        if part in listed:
            raise InputError(
                f"{entry.where} file: expected each file once, got '{entry.file}' again"
            )
        listed.add(part)
    if all(entry.use == "skip" for entry in entries):
        raise InputError(
            f'{path}: expected at least one trial to fit, got use = "skip" for all; set'
            ' use = "fit"'
        )
