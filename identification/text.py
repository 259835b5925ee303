"""Tables as plain text."""

from io import StringIO

from rich.console import Console, JustifyMethod, RenderableType
from rich.table import Table

WIDTH = 100


def as_text(*tables: RenderableType) -> str:
    """Tables and lines one below the other, without colours."""
    file = StringIO()
    console = Console(file=file, width=WIDTH, color_system=None)
    for table in tables:
        console.print(table, highlight=False, soft_wrap=isinstance(table, str))
    return file.getvalue()


def lined_table(title: str, *headings: str) -> Table:
    """A table with its title to the left; a heading after a > is aligned right."""
    table = Table(title=title, title_justify="left")
    for heading in headings:
        is_right = heading.startswith(">")
        justify: JustifyMethod = "right" if is_right else "left"
        table.add_column(heading.removeprefix(">"), justify=justify)
    return table
