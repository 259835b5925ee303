"""Values of a ship file that are left to decide: ``rudder_positive = "decide"``."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from shipgym.checks import quoted
from shipgym.files import LARGEST_TOML, read_text

#: Stands in a ship file for a value that its reader has to choose.
_DECIDE = "decide"

_SECTIONS = ("columns", "conventions", "sensors", "trials")


def take_undecided(data: dict[str, Any], path: Path) -> tuple[str, ...]:
    """Take values "decide" out of the tables of a ship file; a message for each.

    A message names the line of the file and, from its comment, the choices.
    """
    keys = set()
    for section in _SECTIONS:
        for table in _tables(data.get(section)):
            keys |= _take(table)
    if not keys:
        return ()

    messages = []
    text = read_text(path, "ship file", LARGEST_TOML)
    pattern = re.compile(rf'\s*([\w-]+)\s*=\s*"{_DECIDE}"(?:\s*#\s*DECIDE:\s*(.*))?')
    for number, line in enumerate(text.splitlines(), start=1):
        match = pattern.match(line)
        if match is None:
            continue
        key, choices = match.groups("a value as in docs/ship_file.md")
        where = f"{path}: line {number}: {key}"
        answers = choices.strip()
        messages.append(
            f'{where}: expected a decision, got "{_DECIDE}"; write {answers}'
        )
    if not messages:
        names = quoted(sorted(keys))
        messages = [f'{path}: expected decisions, got "{_DECIDE}" for {names}']
    return tuple(messages)


def _take(table: dict[str, Any]) -> set[str]:
    """Take values "decide" out of a table; their keys."""
    keys = set()
    for key, value in [*table.items()]:
        if value == _DECIDE:
            keys.add(key)
            del table[key]
    return keys


def _tables(section: Any) -> Iterator[dict[str, Any]]:
    """A table, or each of several."""
    tables = [section]
    if isinstance(section, list):
        tables = section
    for table in tables:
        if isinstance(table, dict):
            yield table
