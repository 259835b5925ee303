"""Pictures of a voyage: chart with path, wake and ship, and read-outs."""

import os
from math import cos, degrees, hypot, sin
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shipgym.arrays import Floats
from shipgym.envs.engine import Engine
from shipgym.extras import library
from shipgym.tasks.guidance import track
from shipgym.tasks.shapes import ChartWidth, Circle, Line, Shape, ShipOutline, rgb
from shipgym.trials.units import KNOT

SIZE = 600  # pixels of a side
FINER = 2  # pixels drawn for one that is shown, so that edges are smooth
SIDE = FINER * SIZE
CHART_LENGTHS = 14.0  # ship lengths across the chart
USUAL_BEAM = 0.15  # of the length, where the beam is not known
WAKE_POINTS = 400  # that are kept

WATER = (234, 241, 245)
PANEL = (250, 252, 253)
HULL = (42, 62, 80)
WAKE = (120, 160, 190)
CORRIDOR = (222, 236, 224)

#: Outline of a ship from above: forward and to starboard, in lengths and beams.
OUTLINE = np.array([[0.5, 0.0], [0.38, 0.36], [0.2, 0.5], [-0.42, 0.5], [-0.5, 0.36]])
HULL_OUTLINE = np.vstack([OUTLINE, OUTLINE[::-1] * [1.0, -1.0]])


class Artist:
    """Draws one lane of an engine into arrays.

    Raises InputError where pygame-ce is not installed.
    """

    def __init__(self, lane: int = 0) -> None:
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        self._pygame = library("pygame", "render", "render_mode needs it")
        self._lane = lane
        self._wake: list[tuple[float, float]] = []

    def begin(self, engine: Engine) -> None:
        """Begin a new wake."""
        self._wake = []
        self.note(engine)

    def note(self, engine: Engine) -> None:
        """Add the position of the ship to the wake."""
        state = self._state(engine)
        self._wake.append((state["x"], state["y"]))
        del self._wake[:-WAKE_POINTS]

    def picture(self, engine: Engine) -> NDArray[np.uint8]:
        """Draw the lane, uint8 array of shape (600, 600, 3)."""
        state = self._state(engine)
        particulars = engine.model.particulars
        shapes = engine.shapes(self._lane)
        width = CHART_LENGTHS * particulars["length"]
        for shape in shapes:
            if isinstance(shape, ChartWidth):
                width = shape.width
        chart = _Chart(self._pygame, state["x"], state["y"], width)
        _draw_path(chart, engine, self._lane)
        if len(self._wake) > 1:
            chart.line(WAKE, self._wake)
        for shape in shapes:
            _draw_shape(chart, shape)
        _draw_ship(chart, state, particulars["length"], particulars.get("beam"))
        chart.write(_readouts(engine, self._lane, state))

        surface = self._pygame.transform.smoothscale(chart.surface, (SIZE, SIZE))
        columns = self._pygame.surfarray.array3d(surface)
        return np.transpose(columns, (1, 0, 2))

    def _state(self, engine: Engine) -> dict[str, float]:
        """Physical state of the lane."""
        states = engine.physical_state()
        return {name: float(values[self._lane]) for name, values in states.items()}


class _Chart:
    """Surface with places in m north and east, north up, the ship in the middle."""

    def __init__(self, pygame: Any, x: float, y: float, width: float) -> None:
        self.surface = pygame.Surface((SIDE, SIDE))
        self.surface.fill(WATER)
        self.metres = width / SIDE  # of a pixel
        self._draw = pygame.draw
        pygame.font.init()  # a window that was closed ends it
        self._font = pygame.font.Font(None, FINER * 20)
        self._centre = np.array([x, y])

    def pixels(self, points: Any) -> Floats:
        """Pixels to the right and down, of the shape of the points."""
        places = (np.asarray(points) - self._centre) / self.metres
        right_and_up: Floats = places[..., ::-1] * [1.0, -1.0]
        return SIDE / 2.0 + right_and_up

    def line(self, colour: Any, points: Any, width: int = 2 * FINER) -> None:
        """Draw a line through places."""
        self._draw.lines(self.surface, rgb(colour), False, self.pixels(points), width)

    def polygon(self, colour: Any, points: Any) -> None:
        """Fill the area between places."""
        self._draw.polygon(self.surface, rgb(colour), self.pixels(points))

    def circle(self, colour: Any, centre: Any, radius: float, width: int = 0) -> None:
        """Draw a circle of a radius in pixels, or fill it."""
        self._draw.circle(self.surface, rgb(colour), self.pixels(centre), radius, width)

    def write(self, lines: dict[str, str]) -> None:
        """Write labels and values in the upper left corner."""
        spacing = 19 * FINER
        margin = 8 * FINER
        right = 212 * FINER
        below = margin + spacing * len(lines)
        self.surface.fill(PANEL, (0, 0, right, below))
        down = margin
        for label, text in lines.items():
            name = self._font.render(label, True, rgb("faint"))
            value = self._font.render(text, True, rgb("ink"))
            left = right - margin - value.get_width()
            self.surface.blit(name, (margin, down))
            self.surface.blit(value, (left, down))
            down += spacing


def _direction(angle: float) -> Floats:
    return np.array([cos(angle), sin(angle)])


def hull_outline(
    place: ArrayLike,
    heading: float,
    length: float,
    beam: float | None,
) -> Floats:
    """Outline of a ship from the bow round, m north and east, shape (n, 2)."""
    ahead = _direction(heading)
    starboard = [-ahead[1], ahead[0]]
    size = [length, beam or USUAL_BEAM * length]
    axes = np.array([ahead, starboard])
    outline: Floats = (HULL_OUTLINE * size) @ axes + np.asarray(place)
    return outline


def _draw_path(chart: _Chart, engine: Engine, lane: int) -> None:
    waypoints = engine.waypoints(lane)
    if waypoints is None:
        return
    points: Any = track(waypoints, engine.path_metres("turn_radius"))
    half = (engine.path_metres("corridor") or 0.0) / chart.metres
    chart.line(CORRIDOR, points, round(2.0 * half))
    for point in points:
        chart.circle(CORRIDOR, point, half)
    chart.line("safe", points)
    for point in waypoints:
        chart.circle("safe", point, 5 * FINER, 2 * FINER)


def _draw_shape(chart: _Chart, shape: Shape) -> None:
    if isinstance(shape, Line):
        chart.line(shape.colour, shape.points)
    elif isinstance(shape, Circle):
        width = 0 if shape.filled else 2 * FINER
        radius = shape.radius / chart.metres
        chart.circle(shape.colour, (shape.x, shape.y), radius, width)
    elif isinstance(shape, ShipOutline):
        place = (shape.x, shape.y)
        hull = hull_outline(place, shape.psi, shape.length, shape.beam)
        chart.polygon(shape.colour, hull)


def _draw_ship(
    chart: _Chart,
    state: dict[str, float],
    length: float,
    beam: float | None,
) -> None:
    centre = np.array([state["x"], state["y"]])
    if "set_point" in state:
        order = centre + 1.6 * length * _direction(state["set_point"])
        chart.line("warning", [centre, order])

    ahead = _direction(state["psi"])
    chart.line(HULL, [centre, centre + 1.1 * length * ahead], FINER)
    # a rudder to starboard puts its trailing edge to starboard of the stern
    stern = centre - 0.5 * length * ahead
    blade = stern - 0.22 * length * _direction(state["psi"] - state["delta"])
    chart.line("danger", [stern, blade], 3 * FINER)
    chart.polygon(HULL, hull_outline(centre, state["psi"], length, beam))


def _readouts(engine: Engine, lane: int, state: dict[str, float]) -> dict[str, str]:
    """Quantities of a lane, with their values and units."""
    lines = {"speed": f"{hypot(state['u'], state['v']) / KNOT:.1f} kn"}
    for label, name in (("heading", "psi"), ("to steer", "set_point")):
        if name in state:
            lines[label] = f"{degrees(state[name]) % 360.0:05.1f} deg"
    for label, name in (("rudder", "delta"), ("heel", "phi")):
        if name in state:
            lines[label] = f"{degrees(state[name]):+.1f} deg"
    if "cross_track" in engine.task.info_names:
        lines["cross-track"] = f"{engine.info('cross_track')[lane]:+.0f} m"
    if state.get("wind_speed"):
        lines["wind"] = f"{state['wind_speed']:.1f} m/s"
    lines["reward"] = f"{engine.outputs.outcomes[0, lane]:+.3f}"
    return lines
