"""Values of a ship file that are left to decide: ``rudder_positive = "decide"``."""

import re
from pathlib import Path
from typing import Any

from shipgym.files import LARGEST_TOML, parse_toml, read_text, read_toml

#: A line whose value its reader has to choose, with the choices behind it.
_LINE = re.compile(
    r'[ \t]*([\w.-]+)[ \t]*=[ \t]*"decide"[ \t]*(?:#[ \t]*DECIDE:[ \t]*(.*)|#.*)?'
)


def read_decided(path: Path) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Tables of a ship file without the values "decide", and a message for each.

    A message names the line of the file and, from its comment, the choices.
    """
    data = read_toml(path, "ship file")
    lines = read_text(path, "ship file", LARGEST_TOML).splitlines()
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
    if messages:
        data = parse_toml("\n".join(lines), f"{path}:")
    return data, tuple(messages)
