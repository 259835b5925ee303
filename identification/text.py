"""Tables as plain text."""

from __future__ import annotations

from io import StringIO

from rich.console import Console, RenderableType

WIDTH = 100


def as_text(*tables: RenderableType) -> str:
    """Tables one below the other, without colours."""
    file = StringIO()
    Console(file=file, width=WIDTH, color_system=None).print(*tables)
    return file.getvalue()
