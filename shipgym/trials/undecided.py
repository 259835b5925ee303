"""Values of a ship file that are left to decide: ``rudder_positive = "decide"``."""

import re
from pathlib import Path
from typing import Any

from shipgym.files import LARGEST_TOML, read_text

#: Stands in a ship file for a value that its reader has to choose.
_LINE = re.compile(r'\s*([\w-]+)\s*=\s*"decide"(?:\s*#\s*DECIDE:\s*(.*))?')


def take_undecided(data: dict[str, Any], path: Path) -> tuple[str, ...]:
    """Take values "decide" out of the tables of a ship file; a message for each.

    A message names the line of the file and, from its comment, the choices.
    """
    tables = [data.get(name) for name in ("ship", "columns", "conventions", "sensors")]
    trials = data.get("trials")
    undecided = [
        (table, key)
        for table in (*tables, *(trials if isinstance(trials, list) else []))
        if isinstance(table, dict)
        for key, value in table.items()
        if value == "decide"
    ]
    for table, key in undecided:
        del table[key]
    messages = []
    text = read_text(path, "ship file", LARGEST_TOML) if undecided else ""
    for number, line in enumerate(text.splitlines(), start=1):
        match = _LINE.match(line)
        if match is not None:
            key, choices = match.groups("a value as in docs/ship_file.md")
            messages.append(
                f"{path}: line {number}: {key}: expected a decision, got"
                f' "decide"; write {choices.strip()}'
            )
    if undecided and not messages:
        messages = [f'{path}: expected decisions, got "decide"']
    return tuple(messages)
