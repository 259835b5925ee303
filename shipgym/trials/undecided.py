"""Values of a ship file that are left to decide: ``rudder_positive = "decide"``."""

import re
from pathlib import Path
from typing import Any

from shipgym.checks import quoted
from shipgym.files import LARGEST_TOML, read_text

#: Stands in a ship file for a value that its reader has to choose.
_DECIDE = "decide"

_SECTIONS = ("ship", "columns", "conventions", "sensors", "trials")


def take_undecided(data: dict[str, Any], path: Path) -> tuple[str, ...]:
    """Take values "decide" out of the tables of a ship file; a message for each.

    A message names the line of the file and, from its comment, the choices.
    """
    keys: set[str] = set()
    for section in _SECTIONS:
        keys |= _take(data.get(section))
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


def _take(value: Any) -> set[str]:
    """Take values "decide" out of a table, or each of several; their keys."""
    keys = set()
    if isinstance(value, list):
        for table in value:
            keys |= _take(table)
    elif isinstance(value, dict):
        keys = {key for key, one in value.items() if one == _DECIDE}
        for key in keys:
            del value[key]
    return keys
