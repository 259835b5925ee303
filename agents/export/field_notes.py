"""Notes on the fields of a record: the comments of its definition."""

import inspect
import re
from functools import cache
from typing import Any, NamedTuple


class Label(NamedTuple):
    """Name of a number in C, and what it is: unit first, then the meaning."""

    name: str
    note: str = ""


@cache
def field_notes(record: Any) -> dict[str, str]:
    """Comments by the fields of a record: those beside a field, or on lines before it.

    Empty for a record whose definition is not at hand.
    """
    definition = getattr(record, "noted", record)
    try:
        source = inspect.getsource(definition)
    except (OSError, TypeError):
        return {}

    notes = {}
    before: list[str] = []
    for line in source.splitlines():
        code, _, beside = line.partition("# ")
        field = re.match(r"    (\w+): ", code)
        if field is None:
            is_comment = beside and not code.strip()
            before = [*before, beside] if is_comment else []
            continue
        note = beside or " ".join(before)
        if note:
            notes[field[1]] = note.strip()
        before = []
    return notes
