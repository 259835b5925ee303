"""Exported ships and autopilots: their C, made from templates, and their variables."""

import re
from collections.abc import Mapping
from functools import cache
from typing import Any, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined

import shipgym
from agents.export.c_structures import field_notes
from agents.export.c_syntax import KEYWORDS, comment, literal
from shipgym import InputError


class Variable(NamedTuple):
    """A number that an exported ship or autopilot takes or gives."""

    unit: str
    meaning: str
    start: float = 0.0  # value at the beginning

    @property
    def largest(self) -> float:
        """Largest magnitude that is taken; beyond it a number is no measurement."""
        # far beyond ships, but small enough to compute with
        by_unit = {"m": 1e8, "rad": 1e4, "m/s": 1e3, "rad/s": 1e2, "1/s": 1e4}
        return by_unit[self.unit]


Variables = Mapping[str, Variable]


def variables_of(record: Any) -> Variables:
    """Variables with units and meanings as they stand beside a record's fields."""
    found = {}
    for name, note in field_notes(record).items():
        unit, _, meaning = note.partition(", ")
        found[name] = Variable(unit.replace("^", ""), meaning)
    return found


class Source(NamedTuple):
    """A header and a source file by a name, and what a wrapper needs to know of them.

    Attributes
    ----------
    step : float
        s, of an autopilot its control interval, of a ship the longest advised step.
    title : str
        What was exported, in the user's own letters.
    sha256 : str
        Hash of the model's numbers.
    """

    name: str
    header: str
    source: str
    inputs: Variables
    outputs: Variables
    step: float
    ship: bool
    title: str
    sha256: str


def checked_name(name: str) -> str:
    """A name as C takes it, other characters replaced by underscores.

    Raises InputError for one that begins with no letter, is a word of C, or is too
    long.
    """
    allowed = re.sub(r"\W", "_", name, flags=re.ASCII)
    # at most 31 characters, so that what is made of it stays within the 63 of C99
    if not re.fullmatch(r"[A-Za-z]\w{,30}", allowed) or allowed in KEYWORDS:
        raise InputError(
            "name: expected at most 31 letters, digits and underscores, a letter"
            f" first, and no word of C, got {name[:60]!r}; give another with --name"
        )
    return allowed


def render(template: str, name: str = "", **data: Any) -> str:
    """A text made from one of the templates."""
    return (
        _environment()
        .get_template(template)
        .render(
            **data,
            name=name,
            NAME=name.upper(),
            version=shipgym.__version__,
        )
    )


def c_source(template: str, name: str, **data: Any) -> str:
    """Source in C made from a template, after the functions that it calls."""
    body = render(template, name, **data)
    return render("prelude.c.j2", name, body=body)


def hash_text(sha256: str) -> str:
    """A hash as it may stand in a string of C; another text is no hash."""
    return sha256 if re.fullmatch("[0-9a-f]{64}", sha256) else "unknown"


def _calls(text: str, function: str) -> bool:
    """True if a text of C calls a function."""
    return re.search(rf"\b{function}\(", text) is not None


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("agents.export"),
        undefined=StrictUndefined,
        trim_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"c": literal, "comment": comment}
    environment.tests["calling"] = _calls
    return environment
