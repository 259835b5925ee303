"""Structures of C for records and tuples, and initialisers of constants."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from agents.export.c_syntax import NUMBERS, Kind, comment, literal, members
from agents.export.field_notes import Label, field_notes
from agents.export.units_text import unit_of
from shipgym.engine.records import field_types, is_record, is_table, table_of


@dataclass
class Structures:
    """Structures that have been written, under names that begin with `prefix`.

    Attributes
    ----------
    prefix : str
    real : str
        Type of C for numbers, double or float.
    types : dict
        Names of structures by record or tuple of kinds; those that are given are
        declared elsewhere.
    texts : list of str
        Declarations in an order in which C can read them.
    labels : dict
        Names in C of members that are but numbered in Python, by record.
    """

    prefix: str
    real: str = "double"
    types: dict[Kind, str] = field(default_factory=dict)
    texts: list[str] = field(default_factory=list)
    labels: dict[Kind, Mapping[str, Label]] = field(default_factory=dict)
    taken: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        public = (
            "init",
            "step",
            "step_with",
            "defaults",
            "state",
            "input",
            "parameters",
        )
        for ending in public:
            self.taken.add(f"{self.prefix}_{ending}")

    def type(self, kind: Kind) -> str:
        """C type of a kind; a structure is written when it is first needed."""
        if kind in NUMBERS:
            return self.real if kind is float else NUMBERS[kind]
        if is_table(kind):
            return f"const {self.real} *"
        if kind not in self.types:
            base = kind.__name__ if is_record(kind) else f"Tuple{len(kind)}"
            name = self.free_name(base)
            self.declare(kind, name)
        return self.types[kind]

    def declare(self, kind: Kind, name: str) -> None:
        """Write the structure of a record or a tuple under a name."""
        declared = []
        for member, member_kind in members(kind).items():
            label = self.label(kind, member)
            note = f" /* {comment(label.note)} */" if label.note else ""
            declared.append(f"{self.type(member_kind)} {label.name};{note}")
        if not declared:
            declared.append("int nothing;")  # C has no structure without members

        inside = "\n    ".join(declared)
        self.types[kind] = name
        self.texts.append(f"typedef struct {{\n    {inside}\n}} {name};\n")

    def label(self, kind: Kind, member: str) -> Label:
        """Name of a member in C, and a note on what it is."""
        if kind in self.labels:
            return self.labels[kind][member]
        note = field_notes(kind).get(member, "")
        return Label(member, note)

    def constant_label(self, kind: Kind, member: str) -> Label:
        """Name and note of a member of a constant.

        A record of what is measured, as a row of a matrix, has a coefficient for each
        of its members, whose unit is another.
        """
        label = self.label(kind, member)
        is_coefficient = kind not in self.labels and is_record(kind)
        if is_coefficient and field_types(kind).get(member) is Any:
            return label._replace(note="")
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
            return literal(next(numbers), self.real)
        if is_table(kind):
            return self._array(kind.rows, numbers, name)

        deeper = f"{indent}    "
        lines = []
        for member, member_kind in members(kind).items():
            label = self.constant_label(kind, member)
            value = self.initialiser(member_kind, numbers, label.name, deeper)
            note = f" /* {comment(label.note)} */" if label.note else ""
            lines.append(f"{deeper}.{label.name} = {value},{note}\n")
        inside = "".join(lines) or f"{deeper}0\n"
        return f"{{\n{inside}{indent}}}"

    def _array(self, rows: int, numbers: Iterator[float], name: str) -> str:
        """Declare an array and return its name."""
        array = self.free_name(name)
        literals = []
        for number in islice(numbers, rows):
            literals.append(literal(number, self.real))

        inside = ",\n    ".join(literals)
        head = f"static const {self.real} {array}[{rows}]"
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


@dataclass(frozen=True)
class Parameter:
    """A number of a constant that may be set.

    Attributes
    ----------
    path : str
        Where it is in the structure, such as `law.gains.sway`.
    unit : str
        Empty if its note begins with none.
    """

    path: str
    value: float
    note: str
    unit: str

    @property
    def is_limit(self) -> bool:
        """True for what bounds a magnitude, which may not be negative."""
        name = self.path.rpartition(".")[2]
        return name in ("limit", "reach", "rudder_limit", "rudder_rate")


def parameters_of(
    structures: Structures, kind: Kind, numbers: Iterator[float], before: str = ""
) -> list[Parameter]:
    """Numbers of a constant with their paths; those of tables are left out."""
    found = []
    for member, part in members(kind).items():
        label = structures.constant_label(kind, member)
        path = f"{before}{label.name}"
        if is_table(part):
            _ = list(islice(numbers, part.rows))
        elif part in NUMBERS:
            parameter = Parameter(
                path=path,
                value=next(numbers),
                note=label.note,
                unit=unit_of(label.note),
            )
            found.append(parameter)
        else:
            found += parameters_of(structures, part, numbers, f"{path}.")
    return found


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
    # a field that may be anything is a number
    known = [float if kind is Any else kind for kind in field_types(record).values()]
    if list(kinds.values()) == known:
        return record
    return record_kind(record.__name__, kinds, noted=record)


def record_kind(name: str, kinds: Mapping[str, Kind], noted: Kind = None) -> Kind:
    """A record of fields of these kinds, with the notes that another record has."""
    make: Any = NamedTuple
    record = make(name, list(kinds.items()))
    record.noted = noted or record
    return record


def leaf_paths(kind: Kind, before: str = "", tables: bool = False) -> list[str]:
    """Paths of all numbers of a record, such as `law.gains.sway`, or of its tables."""
    paths = []
    for name, part in members(kind).items():
        path = f"{before}{name}"
        is_wanted = is_table(part) if tables else part in NUMBERS
        if is_wanted:
            paths.append(path)
        elif is_record(part):
            deeper = leaf_paths(part, f"{path}.", tables)
            paths += deeper
    return paths


def numbers_of(value: Any) -> Iterator[float]:
    """Numbers of a record and of the records and arrays in it, in order."""
    for one in value:
        if isinstance(one, tuple | np.ndarray):
            yield from numbers_of(one)
        else:
            yield float(one)
