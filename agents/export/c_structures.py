"""Structures of C for records and tuples, and initialisers of constants."""

import inspect
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np

from agents.export.c_syntax import c_name, comment, free, literal
from shipgym.engine.records import is_record


class Label(NamedTuple):
    """Name of a number in C, and what it is: unit first, then the meaning."""

    name: str
    note: str = ""

    @property
    def after_name(self) -> str:
        """Its note as a comment behind the name."""
        return f" /* {comment(self.note)} */" if self.note else ""


class Rows(NamedTuple):
    """Kind of a table of so many numbers."""

    n: int


class Struct(NamedTuple):
    """Kind of a record or a tuple."""

    record: Any
    labels: tuple[Label, ...]
    kinds: tuple[Any, ...]  # float, bool, Rows, Struct, or a function

    @property
    def name(self) -> str:
        """Name of the record."""
        if is_record(self.record):
            return str(self.record.__name__)
        return f"Tuple{len(self.kinds)}"

    def made(self, values: Any) -> Any:
        """A record, or tuple, of values."""
        return self.record(*values) if is_record(self.record) else tuple(values)


@dataclass
class Structures:
    """Structures that have been written, under names that begin with `prefix`.

    Attributes
    ----------
    prefix : str
    types : dict
        Names of structures by kind.
    texts : list of str
        Declarations in an order in which C can read them.
    labels : dict
        Names in C of members that are but numbered in Python, by record.
    """

    prefix: str
    types: dict[Struct, str] = field(default_factory=dict)
    texts: list[str] = field(default_factory=list)
    labels: dict[Any, Mapping[str, Label]] = field(default_factory=dict)
    taken: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        public = ("init", "step", "state", "input", "parameters")
        self.taken |= {f"{self.prefix}_{ending}" for ending in public}

    def kind_of(self, value: Any) -> Any:
        """Kind of a value: of a number, an array, a record, or a function itself."""
        if isinstance(value, FunctionType):
            return value
        if hasattr(value, "writer"):  # a node, or a function that is called
            return value.kind
        if isinstance(value, np.ndarray):
            return Rows(len(value))
        if isinstance(value, tuple):
            kinds = tuple([self.kind_of(part) for part in value])
            return Struct(
                type(value),
                self._labels_of(value),
                kinds,
            )
        if isinstance(value, bool | np.bool_):
            return bool
        if isinstance(value, int | float | np.number):
            return float
        raise TypeError(f"expected numbers and records of them, got {value!r}")

    def _labels_of(self, value: Any) -> tuple[Label, ...]:
        record = type(value)
        if record in self.labels:
            return tuple(self.labels[record].values())
        if not is_record(record):
            return tuple([Label(f"v{i}") for i in range(len(value))])
        notes = field_notes(record)
        return tuple([Label(c_name(one), notes.get(one, "")) for one in record._fields])

    def type(self, kind: Any) -> str:
        """C type of a kind; a structure is written when it is first needed."""
        if not isinstance(kind, Struct):
            return {float: "double", bool: "bool"}.get(kind, "const double *")
        if kind not in self.types:
            self.declare(kind, self.free_name(kind.name))
        return self.types[kind]

    def declare(self, kind: Struct, name: str) -> None:
        """Write the structure of a record or a tuple under a name."""
        if kind in self.types:
            self.texts.append(f"typedef {self.types[kind]} {name};\n")
            return
        declared = [
            f"{self.type(part)} {label.name};{label.after_name}"
            for label, part in zip(kind.labels, kind.kinds, strict=True)
        ]
        # C has no structure without members
        inside = "\n    ".join(declared or ["int nothing;"])
        self.types[kind] = name
        self.texts.append(f"typedef struct {{\n    {inside}\n}} {name};\n")

    def declared(self, **values: Any) -> list[str]:
        """Structures of values under the prefix and these names, for a header."""
        for ending, value in values.items():
            self.declare(self.kind_of(value), f"{self.prefix}_{ending}")
        header, self.texts = self.texts, []
        return header

    def initialiser(self, value: Any, name: str = "value", indent: str = "") -> str:
        """Initialiser of a value, one number a line; tables become arrays."""
        if isinstance(value, np.ndarray):
            array = self.free_name(name)
            inside = ",\n    ".join([literal(one) for one in value.tolist()])
            self.texts.append(
                f"static const double {array}[{len(value)}] = {{\n    {inside},\n}};\n"
            )
            return array
        if not isinstance(value, tuple):
            return literal(value)

        deeper = f"{indent}    "
        lines = []
        for part, label in zip(value, self._labels_of(value), strict=True):
            shown = self.initialiser(part, label.name, deeper)
            lines.append(f"{deeper}.{label.name} = {shown},\n")
        inside = "".join(lines) or f"{deeper}0\n"
        return f"{{\n{inside}{indent}}}"

    def free_name(self, name: str) -> str:
        """A name with the prefix that is not taken yet."""
        made = free(f"{self.prefix}_{name}", self.taken)
        self.taken.add(made)
        return made


def field_notes(record: Any) -> dict[str, str]:
    """Comments by the fields of a record: those beside a field, or on lines before it.

    Empty for a record whose definition is not at hand.
    """
    try:
        source = inspect.getsource(record)
    except (OSError, TypeError):
        return {}
    notes = {}
    before: list[str] = []
    for line in source.splitlines():
        code, _, beside = line.partition("# ")
        name = re.match(r"    (\w+): ", code)
        if name is None:
            is_comment = beside and not code.strip()
            before = [*before, beside] if is_comment else []
            continue
        notes[name[1]] = (beside or " ".join(before)).strip()
        before = []
    return notes


def leaf_paths(value: Any, before: str = "") -> Iterator[str]:
    """Paths of all numbers of a record, such as `law.gains.sway`."""
    for name, part in value._asdict().items():
        path = f"{before}{c_name(name)}"
        if isinstance(part, tuple):
            yield from leaf_paths(part, f"{path}.")
        else:
            yield path
