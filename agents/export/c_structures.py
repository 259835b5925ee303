"""Structures of C for records and tuples, and initialisers of constants."""

import inspect
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from agents.export.c_syntax import NUMBERS, Kind, comment, literal, members
from shipgym.engine.records import field_types, is_record, is_table, table_of


class Label(NamedTuple):
    """Name of a number in C, and what it is: unit first, then the meaning."""

    name: str
    note: str = ""

    @property
    def after_name(self) -> str:
        """Its note as a comment behind the name."""
        return f" /* {comment(self.note)} */" if self.note else ""


@dataclass
class Structures:
    """Structures that have been written, under names that begin with `prefix`.

    Attributes
    ----------
    prefix : str
    types : dict
        Names of structures by record or tuple of kinds; those that are given are
        declared elsewhere.
    texts : list of str
        Declarations in an order in which C can read them.
    labels : dict
        Names in C of members that are but numbered in Python, by record.
    """

    prefix: str
    types: dict[Kind, str] = field(default_factory=dict)
    texts: list[str] = field(default_factory=list)
    labels: dict[Kind, Mapping[str, Label]] = field(default_factory=dict)
    taken: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        public = ("init", "step", "state", "input", "parameters")
        self.taken |= {f"{self.prefix}_{ending}" for ending in public}

    def type(self, kind: Kind) -> str:
        """C type of a kind; a structure is written when it is first needed."""
        if kind in NUMBERS:
            return NUMBERS[kind]
        if is_table(kind):
            return "const double *"
        if kind not in self.types:
            base = kind.__name__ if is_record(kind) else f"Tuple{len(kind)}"
            self.declare(kind, self.free_name(base))
        return self.types[kind]

    def declare(self, kind: Kind, name: str) -> None:
        """Write the structure of a record or a tuple under a name."""
        declared = []
        for member, member_kind in members(kind).items():
            label = self.label(kind, member)
            declared.append(f"{self.type(member_kind)} {label.name};{label.after_name}")
        # C has no structure without members
        inside = "\n    ".join(declared or ["int nothing;"])
        self.types[kind] = name
        self.texts.append(f"typedef struct {{\n    {inside}\n}} {name};\n")

    def label(self, kind: Kind, member: str) -> Label:
        """Name of a member in C, and a note on what it is."""
        if kind in self.labels:
            return self.labels[kind][member]
        return Label(member, field_notes(kind).get(member, ""))

    def constant_label(self, kind: Kind, member: str) -> Label:
        """Name and note of a member of a constant.

        A record of what is measured, as a row of a matrix, has a coefficient for each
        of its members, whose unit is another.
        """
        label = self.label(kind, member)
        is_coefficient = kind not in self.labels and is_record(kind)
        if is_coefficient and field_types(kind).get(member) is Any:
            return Label(label.name)
        return label

    def initialiser(
        self,
        kind: Kind,
        numbers: Iterator[float],
        name: str = "value",
        indent: str = "",
    ) -> str:
        """Initialiser by numbers in order, one line each; tables become arrays."""
        if kind in NUMBERS:
            return literal(next(numbers))
        if is_table(kind):
            return self._array(
                [literal(one) for one in islice(numbers, kind.rows)], name
            )

        deeper = f"{indent}    "
        lines = []
        for member, member_kind in members(kind).items():
            label = self.constant_label(kind, member)
            value = self.initialiser(member_kind, numbers, label.name, deeper)
            lines.append(f"{deeper}.{label.name} = {value},{label.after_name}\n")
        inside = "".join(lines) or f"{deeper}0\n"
        return f"{{\n{inside}{indent}}}"

    def _array(self, literals: list[str], name: str) -> str:
        """Declare an array and return its name."""
        array = self.free_name(name)
        inside = ",\n    ".join(literals)
        head = f"static const double {array}[{len(literals)}]"
        self.texts.append(f"{head} = {{\n    {inside},\n}};\n")
        return array

    def free_name(self, name: str) -> str:
        """A name with the prefix that is not taken yet, with a number if need be."""
        first = f"{self.prefix}_{name}"
        free = first
        number = 2
        while free in self.taken:
            free = f"{first}{number}"
            number += 1
        self.taken.add(free)
        return free


@cache
def field_notes(record: Any) -> dict[str, str]:
    """Comments by the fields of a record: those beside a field, or on lines before it.

    Empty for a record whose definition is not at hand.
    """
    try:
        source = inspect.getsource(getattr(record, "noted", record))
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


def kind_of(value: Any) -> Kind:
    """Kind of a record's value, with tables of the lengths that its arrays have."""
    if isinstance(value, np.ndarray):
        return table_of(len(value))
    if not isinstance(value, tuple):
        return float
    record: Any = type(value)
    kinds = {
        name: kind_of(part) for name, part in zip(record._fields, value, strict=True)
    }
    if list(kinds.values()) == list(members(record).values()):
        return record
    return record_kind(record.__name__, kinds, noted=record)


def record_kind(name: str, kinds: Mapping[str, Kind], noted: Kind = None) -> Kind:
    """A record of fields of these kinds, with the notes that another record has."""
    make: Any = NamedTuple
    record = make(name, list(kinds.items()))
    record.noted = noted or record
    return record


def leaf_paths(kind: Kind, before: str = "") -> list[str]:
    """Paths of all numbers of a record, such as `law.gains.sway`."""
    paths = []
    for name, part in members(kind).items():
        path = f"{before}{name}"
        if is_record(part):
            paths += leaf_paths(part, f"{path}.")
        elif part in NUMBERS:
            paths.append(path)
    return paths


def numbers_of(value: Any) -> Iterator[float]:
    """Numbers of a record and of the records and arrays in it, in order."""
    for one in value:
        if isinstance(one, tuple | np.ndarray):
            yield from numbers_of(one)
        else:
            yield float(one)
