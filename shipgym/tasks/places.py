"""Lines of users' files at which messages point."""

import ast
from pathlib import Path


def place_of_field(where: str, record: str, path: str) -> str:
    """File, line and name of a field of a record in a file, for messages."""
    name = f"{record}.{path}"
    field = path.partition(".")[0]
    file = Path(where)
    if file.suffix != ".py" or not file.is_file():
        return f"{where}: {name}"
    for node in ast.walk(ast.parse(file.read_bytes())):
        if isinstance(node, ast.ClassDef) and node.name == record:
            line = _line_of(node, field)
            return f"{where}, line {line}: {name}"
    return f"{where}: {name}"


def _line_of(record: ast.ClassDef, field: str) -> int:
    """Line of a field, or of the record if it has none of that name."""
    for node in record.body:
        target = getattr(node, "target", None)
        if getattr(target, "id", None) == field:
            return node.lineno
    return record.lineno
