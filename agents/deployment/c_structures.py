"""Structures of C for records and tuples, and initialisers of constants."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from agents.deployment.c_syntax import NUMBERS, Kind, literal, members
from shipgym.engine.records import field_types, is_record, is_table, table_of


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
    """

    prefix: str
    types: dict[Kind, str] = field(default_factory=dict)
    texts: list[str] = field(default_factory=list)
    taken: set[str] = field(default_factory=set)

    def type(self, kind: Kind) -> str:
        """C type of a kind; a structure is written when it is first needed."""
        if kind in NUMBERS:
            return NUMBERS[kind]
        if is_table(kind):
            return "const double *"
        if kind not in self.types:
            base = kind.__name__ if is_record(kind) else f"Tuple{len(kind)}"
            name = self.free_name(base)
            self.declare(kind, name)
        return self.types[kind]

    def declare(self, kind: Kind, name: str) -> None:
        """Write the structure of a record or a tuple under a name."""
        declared = []
        for member, member_kind in members(kind).items():
            declared.append(f"{self.type(member_kind)} {member};")
        if not declared:
            declared.append("int nothing;")  # C has no structure without members

        inside = "\n    ".join(declared)
        self.types[kind] = name
        self.texts.append(f"typedef struct {{\n    {inside}\n}} {name};\n")

    def initialiser(
        self, kind: Kind, numbers: Iterator[float], name: str = "value"
    ) -> str:
        """Initialiser by numbers in order; tables in it become arrays."""
        if kind in NUMBERS:
            return literal(next(numbers))
        if is_table(kind):
            return self._array(kind.rows, numbers, name)

        fields = []
        for member, member_kind in members(kind).items():
            value = self.initialiser(member_kind, numbers, member)
            fields.append(f".{member} = {value}")
        inside = ", ".join(fields) or "0"
        return f"{{{inside}}}"

    def _array(self, rows: int, numbers: Iterator[float], name: str) -> str:
        """Declare an array and return its name."""
        array = self.free_name(name)
        literals = [literal(number) for number in islice(numbers, rows)]
        inside = ", ".join(literals)
        declaration = f"static const double {array}[{rows}] = {{{inside}}};\n"
        self.texts.append(declaration)
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


def kind_of(value: Any) -> Kind:
    """Kind of a record's value, with tables of the lengths that its arrays have."""
    if isinstance(value, np.ndarray):
        return table_of(len(value))
    if not isinstance(value, tuple):
        return float
    record: Any = type(value)
    kinds = {}
    for name, part in zip(record._fields, value, strict=True):
        kinds[name] = kind_of(part)
    if kinds == field_types(record):
        return record
    return record_kind(record.__name__, kinds)


def record_kind(name: str, kinds: Mapping[str, Kind]) -> Kind:
    """A record of fields of these kinds."""
    make: Any = NamedTuple
    return make(name, list(kinds.items()))


def numbers_of(value: Any) -> Iterator[float]:
    """Numbers of a record and of the records and arrays in it, in order."""
    for one in value:
        if isinstance(one, tuple | np.ndarray):
            yield from numbers_of(one)
        else:
            yield float(one)
