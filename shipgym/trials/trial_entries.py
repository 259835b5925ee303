"""The tables ``[[trials]]`` of a ship file, with what the file gives for all."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shipgym.checks import check_choice, check_table, check_text, placed, shown
from shipgym.errors import InputError
from shipgym.files import check_readable
from shipgym.ships.particulars import Particulars
from shipgym.trials.columns import Column, parse_columns
from shipgym.trials.conventions import Conventions, Installation
from shipgym.trials.cuts import check_cut
from shipgym.trials.trial import USES, check_kind

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
    sensors = check_table(data.get("sensors", {}), f"{path}: [sensors]")
    where = f"{path}: [conventions]"
    words = check_table(data.get("conventions", {}), where, _CONVENTIONS)
    Conventions(**words, xg=ship.xg, where=where)
    Installation.from_mapping(sensors, f"{path}: [sensors]")
    entries: dict[tuple[str, ...], TrialEntry] = {}
    for number, table in enumerate(tables, start=1):
        where = f"{path}: [[trials]] {number}"
        check_table(table, where, _KEYS)
        place = f"{where} sensors"
        own_sensors = table.get("sensors", {})
        check_table(own_sensors, place)
        own_columns = parse_columns(table.get("columns", {}), f"{where} columns")
        own_words = {key: table[key] for key in _CONVENTIONS if key in table}
        entry = _read_entry(
            table,
            path.parent,
            where,
            {**columns, **own_columns},
            Conventions(
                **{**words, **own_words},
                xg=ship.xg,
                where=where,
                installation=Installation.from_mapping(
                    {**sensors, **own_sensors}, place
                ),
            ),
        )
        part = (*map(os.path.normpath, entry.paths), str(entry.cut))
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


def _read_entry(
    table: Mapping[str, Any],
    folder: Path,
    where: str,
    columns: Mapping[str, Column],
    conventions: Conventions,
) -> TrialEntry:
    files = table.get("file", [])
    if not isinstance(files, list):
        files = [files]
    if not files:
        raise InputError(f'{where}: expected file = "run.csv", got no file')
    files = [check_text(file, f"{where} file") for file in files]
    paths = tuple(folder / file for file in files)
    use = check_choice(table.get("use", "fit"), USES, f"{where} use")
    if use != "skip":
        with placed(f"{where} file"):
            for path in paths:
                check_readable(path, "CSV file")
    if "kind" in table:
        check_kind(table["kind"], f"{where} kind")
    if "cut" in table:
        check_cut(table["cut"], where)
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
