"""Values of a ship file that are left to decide: ``rudder_positive = "decide"``."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from shipgym.files import LARGEST_TOML, read_text

#: Stands in a ship file for a value that its reader has to choose.
DECIDE = "decide"

_SECTIONS = ("columns", "conventions", "sensors", "trials")


def take_undecided(data: dict[str, Any], path: Path) -> tuple[str, ...]:
    """Take values "decide" out of the tables of a ship file; a message for each.

    A message names the line of the file and, from its comment, the choices.
    """
    keys = []
    for section in _SECTIONS:
        for table in _tables(data.get(section)):
            keys += [key for key, value in table.items() if value == DECIDE]
    if not keys:
        return ()

    lines = read_text(path, "ship file", LARGEST_TOML).splitlines()
    messages = []
    for number, line in enumerate(lines, start=1):
        match = re.match(rf'\s*([\w-]+)\s*=\s*"{DECIDE}"(?:\s*#\s*DECIDE:(.*))?', line)
        if match and match[1] in keys:
            choices = (match[2] or "").strip() or "a value as in docs/ship_file.md"
            messages.append(
                f"{path}: line {number}: {match[1]}: expected a decision, got"
                f' "{DECIDE}"; write {choices}'
            )
    for section in _SECTIONS:
        for table in _tables(data.get(section)):
            for key in [key for key, value in table.items() if value == DECIDE]:
                del table[key]
    return tuple(messages) or (
        f'{path}: expected decisions, got "{DECIDE}" for {keys}',
    )


def _tables(section: Any) -> Iterator[dict[str, Any]]:
    """A table, or each of several."""
    tables = section if isinstance(section, list) else [section]
    for table in tables:
        if isinstance(table, dict):
            yield table
