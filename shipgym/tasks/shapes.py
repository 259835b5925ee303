"""Shapes that a task has drawn in pictures of its environment.

A task file may define `draw(motion, state, ship, settings)`, plain Python that is
called for each picture and returns a list of shapes, drawn one over another beneath the
ship. Places are m north and east, colours red, green, blue or
of the names ink, faint, land, safe, warning and danger.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

from shipgym.checks import unexpected
from shipgym.errors import InputError
from shipgym.python_files import asked, place_of

Rgb = tuple[int, int, int]
#: Colours by name.
_COLOURS: dict[str, Rgb] = {
    "ink": (28, 40, 48),
    "faint": (104, 122, 134),
    "land": (226, 219, 200),
    "safe": (60, 110, 70),
    "warning": (200, 120, 10),
    "danger": (200, 60, 40),
}
Colour = str | Rgb


class Line(NamedTuple):
    """Line through points, shape (n, 2)."""

    points: Any
    colour: Colour = "ink"


class Circle(NamedTuple):
    """Circle, its line or, `filled`, its area."""

    x: float  # m, of its centre
    y: float
    radius: float  # m
    colour: Colour = "ink"
    filled: bool = False


class ShipOutline(NamedTuple):
    """Another ship from above."""

    x: float  # m
    y: float
    psi: float  # rad, heading
    length: float  # m
    beam: float | None = None  # m, by default 0.15 of the length
    colour: Colour = "ink"


class ChartWidth(NamedTuple):
    """Width of the chart, in place of fourteen ship lengths; the last one counts."""

    width: float  # m


Shape = Line | Circle | ShipOutline | ChartWidth


def rgb(colour: Colour) -> Rgb:
    """Red, green and blue of a colour."""
    return _COLOURS[colour] if isinstance(colour, str) else colour


def shapes_of(draw: Any, *arguments: Any) -> tuple[Shape, ...]:
    """Ask a task for its shapes; InputError, with file and line, for anything else."""
    try:
        shapes = asked(draw, *arguments)
    except InputError as error:
        if error.__cause__ is not None:  # it names the place
            raise
        raise InputError(f"{place_of(draw, error)}: {error}") from None
    listed = shapes if isinstance(shapes, Sequence) else [shapes]
    for shape in listed:
        if not isinstance(shape, Shape):
            expected = "a list of Line, Circle, ShipOutline and ChartWidth"
            raise unexpected(place_of(draw), expected, shape)
    return tuple(listed)
