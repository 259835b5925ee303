"""Pictures of a voyage: chart with path, wake and ship, compass, gauge, read-outs."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import cos, degrees, floor, hypot, log10, pi, radians, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shipgym.arrays import Floats
from shipgym.checks import check_choice
from shipgym.extras import library
from shipgym.tasks.guidance import track
from shipgym.tasks.shapes import ChartWidth, Circle, Line, Shape, ShipOutline, rgb

Picture = NDArray[np.uint8]
Point = tuple[float, float]
Colour = tuple[int, int, int]

SIZE = 600  # pixels of a side
FINER = 2  # pixels drawn for one that is shown, so that edges are smooth


@dataclass(frozen=True)
class Colours:
    """Colours of a picture: red, green and blue."""

    water: Colour = (234, 241, 245)
    grid: Colour = (213, 224, 231)
    ink: Colour = (28, 40, 48)
    faint: Colour = (104, 122, 134)
    panel: Colour = (250, 252, 253)
    hull: Colour = (42, 62, 80)
    wake: Colour = (120, 160, 190)
    rudder: Colour = (200, 60, 40)
    path: Colour = (60, 110, 70)
    corridor: Colour = (222, 236, 224)
    order: Colour = (200, 120, 10)
    wind: Colour = (120, 90, 160)
    current: Colour = (0, 140, 150)


COLOURS = Colours()

#: Outline of a ship from above: forward and to starboard, in lengths and beams.
OUTLINE = np.array([[0.5, 0.0], [0.38, 0.36], [0.2, 0.5], [-0.42, 0.5], [-0.5, 0.36]])
HULL_OUTLINE = np.vstack([OUTLINE, OUTLINE[:0:-1] * [1.0, -1.0]])


@dataclass(frozen=True, eq=False)
class Scene:
    """Content of one picture, SI units."""

    x: float  # north, m
    y: float  # east, m
    heading: float
    rudder: float
    length: float
    beam: float
    rudder_limit: float
    wake: Floats  # where the ship has been, shape (n, 2)
    course_order: float | None = None  # heading to steer
    waypoints: Floats | None = None  # shape (n, 2)
    turn_radius: float | None = None  # of the path at its waypoints
    corridor: float | None = None  # half its width
    wind: tuple[float, float] | None = None  # speed, and direction it comes from
    current: tuple[float, float] | None = None  # speed, and direction it sets towards
    # of the task, drawn beneath the ship
    shapes: Sequence[Shape] = ()
    # a quantity, and its value with the unit
    readouts: Mapping[str, str] = field(default_factory=dict)


class _Chart:
    """Map from metres north and east to pixels, north up, the ship in the middle."""

    def __init__(self, scene: Scene) -> None:
        chart_lengths = 14.0  # ship lengths across the chart
        width = chart_lengths * scene.length
        for shape in scene.shapes:
            if isinstance(shape, ChartWidth):
                width = shape.width
        self.metres = width / SIZE  # of a pixel
        # of the grid: the largest of 1, 2, 5 times a power of ten that is not above a
        # sixth of the chart
        largest = width / 6.0
        power = 10.0 ** floor(log10(largest))
        for step in (1.0, 2.0, 5.0):
            if step * power <= largest:
                self.spacing = step * power
        self._centre = np.array([scene.x, scene.y])

    def pixels(self, points: Any) -> Floats:
        """Pixels to the right and down, of the shape of the points."""
        from_centre = (np.asarray(points) - self._centre) / self.metres
        north = from_centre[..., 0]
        east = from_centre[..., 1]
        middle = SIZE / 2.0
        return np.stack([middle + east, middle - north], axis=-1)

    def grid_lines(self, axis: int) -> Floats:
        """Pixels of the lines of constant north (axis 0, down) or east (1, right)."""
        half = 0.5 * SIZE * self.metres
        first = floor((self._centre[axis] - half) / self.spacing)
        n_lines = int(2.0 * half / self.spacing) + 3
        points = np.tile(self._centre, (n_lines, 1))
        points[:, axis] = self.spacing * (first + np.arange(n_lines))
        other_axis = 1 - axis
        return self.pixels(points)[:, other_axis]


class Renderer:
    """Draws scenes into arrays ("rgb_array") or in a window too ("human").

    Raises InputError for another mode, or where pygame-ce is not installed.
    """

    def __init__(self, mode: str) -> None:
        render_modes = ("human", "rgb_array")
        self.mode = check_choice(mode, render_modes, "render_mode")
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        use = f"render_mode {mode!r} needs it"
        pygame = library("pygame", "render", use)
        self._pygame = pygame
        self._brush = _Brush(pygame)
        self._surface = pygame.Surface((SIZE, SIZE))
        self._window: Any = None
        self._clock: Any = None

    def draw(self, scene: Scene) -> Picture:
        """Draw a scene, a uint8 array of shape (600, 600, 3)."""
        chart = _Chart(scene)
        brush = self._brush
        brush.fill(COLOURS.water)
        self._draw_grid(chart)
        self._draw_path(chart, scene)
        if len(scene.wake) > 1:
            brush.lines(COLOURS.wake, chart.pixels(scene.wake), 2)
        for shape in scene.shapes:
            self._draw_shape(chart, shape)
        self._draw_ship(chart, scene)
        self._draw_scale(chart)
        self._draw_compass(scene, centre=(SIZE - 70.0, 70.0), radius=52.0)
        self._draw_gauge(scene, centre=(SIZE / 2.0, SIZE - 34.0), width=180.0)
        self._draw_readouts(scene)

        brush.show(self._surface)
        if self.mode == "human":
            self._show()
        columns = self._pygame.surfarray.array3d(self._surface)
        return np.transpose(columns, (1, 0, 2))

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._pygame.display.quit()
            self._window = None

    def _show(self) -> None:
        pygame = self._pygame
        if self._window is None:
            pygame.display.init()
            self._window = pygame.display.set_mode((SIZE, SIZE))
            pygame.display.set_caption("shipgym")
            self._clock = pygame.time.Clock()
        pygame.event.pump()
        self._window.blit(self._surface, (0, 0))
        pygame.display.flip()
        frames_per_second = 30
        self._clock.tick(frames_per_second)

    def _draw_grid(self, chart: _Chart) -> None:
        for down in chart.grid_lines(axis=0):
            left = (0.0, down)
            right = (SIZE, down)
            self._brush.line(COLOURS.grid, left, right)
        for across in chart.grid_lines(axis=1):
            top = (across, 0.0)
            bottom = (across, SIZE)
            self._brush.line(COLOURS.grid, top, bottom)

    def _draw_path(self, chart: _Chart, scene: Scene) -> None:
        if scene.waypoints is None:
            return
        brush = self._brush
        points = chart.pixels(track(scene.waypoints, scene.turn_radius))
        if scene.corridor is not None:
            half = scene.corridor / chart.metres
            for start, end in pairwise(points):
                _, across = _axes(start, end)
                side = half * across
                corners = [start + side, end + side, end - side, start - side]
                brush.polygon(COLOURS.corridor, corners)
            for point in points:
                brush.circle(COLOURS.corridor, point, half)

        brush.lines(COLOURS.path, points, 2)
        for point in chart.pixels(scene.waypoints):
            brush.circle(COLOURS.water, point, 5)
            brush.circle(COLOURS.path, point, 5, 2)

    def _draw_shape(self, chart: _Chart, shape: Shape) -> None:
        brush = self._brush
        if isinstance(shape, Line):
            brush.lines(rgb(shape.colour), chart.pixels(shape.points), 2)
        elif isinstance(shape, Circle):
            centre = chart.pixels([shape.x, shape.y])
            width = 0 if shape.filled else 2
            brush.circle(rgb(shape.colour), centre, shape.radius / chart.metres, width)
        elif isinstance(shape, ShipOutline):
            beam = shape.beam or shape.length / 7.0
            hull = _hull(shape.x, shape.y, shape.psi, shape.length, beam)
            brush.polygon(rgb(shape.colour), chart.pixels(hull))

    def _draw_ship(self, chart: _Chart, scene: Scene) -> None:
        brush = self._brush
        length = scene.length
        centre = np.array([scene.x, scene.y])
        middle = chart.pixels(centre)
        if scene.course_order is not None:
            order = centre + 1.6 * length * _direction(scene.course_order)
            brush.arrow(COLOURS.order, middle, chart.pixels(order))

        ahead = _direction(scene.heading)
        bow = centre + 1.1 * length * ahead
        stern = centre - 0.5 * length * ahead
        brush.line(COLOURS.hull, middle, chart.pixels(bow))
        # a rudder to starboard puts its trailing edge to starboard of the stern
        blade = stern - 0.22 * length * _direction(scene.heading - scene.rudder)
        brush.line(COLOURS.rudder, chart.pixels(stern), chart.pixels(blade), 3)

        hull = _hull(scene.x, scene.y, scene.heading, length, scene.beam)
        brush.polygon(COLOURS.hull, chart.pixels(hull))

    def _draw_scale(self, chart: _Chart) -> None:
        left = 14.0
        right = left + chart.spacing / chart.metres
        bottom = SIZE - 18.0
        self._brush.line(COLOURS.ink, (left, bottom), (right, bottom), 2)
        label = f"{chart.spacing:g} m"
        self._brush.text(label, (left, bottom - 16.0), COLOURS.faint, small=True)

    def _draw_compass(self, scene: Scene, centre: Point, radius: float) -> None:
        brush = self._brush
        brush.circle(COLOURS.panel, centre, radius + 12.0)
        brush.circle(COLOURS.faint, centre, radius, 1)
        for angle in range(0, 360, 30):
            outer = _on_circle(centre, radius, radians(angle))
            inner = _on_circle(centre, radius - 5.0, radians(angle))
            brush.line(COLOURS.faint, outer, inner)
        for name, angle in {"N": 0, "E": 90, "S": 180, "W": 270}.items():
            place = _on_circle(centre, radius - 15.0, radians(angle))
            brush.text(name, place, COLOURS.ink, "centre", small=True)

        needle = radius - 22.0  # keeps clear of the letters
        tail = _on_circle(centre, 0.6 * needle, scene.heading + pi)
        tip = _on_circle(centre, needle, scene.heading)
        brush.arrow(COLOURS.hull, tail, tip)
        order = scene.course_order
        if order is not None:
            triangle = [
                _on_circle(centre, radius - 4.0, order),
                _on_circle(centre, radius + 9.0, order - 0.09),
                _on_circle(centre, radius + 9.0, order + 0.09),
            ]
            brush.polygon(COLOURS.order, triangle)

        outside = radius + 12.0
        inside = radius - 8.0
        if scene.wind is not None:
            _, wind_from = scene.wind
            start = _on_circle(centre, outside, wind_from)
            brush.arrow(COLOURS.wind, start, _on_circle(centre, inside, wind_from))
        if scene.current is not None:
            _, set_towards = scene.current
            start = _on_circle(centre, inside, set_towards)
            brush.arrow(
                COLOURS.current, start, _on_circle(centre, outside, set_towards)
            )

    def _draw_gauge(self, scene: Scene, centre: Point, width: float) -> None:
        brush = self._brush
        x, y = centre
        half = width / 2.0
        left = x - half
        right = x + half
        brush.panel(COLOURS.panel, (left - 28.0, y - 24.0, width + 56.0, 50.0))
        brush.line(COLOURS.faint, (left, y), (right, y))
        for tick in np.linspace(left, right, 5):
            brush.line(COLOURS.faint, (tick, y - 5.0), (tick, y + 5.0))
        part = max(-1.0, min(1.0, scene.rudder / scene.rudder_limit))
        brush.line(COLOURS.rudder, (x, y), (x + part * half, y), 5)

        limit_deg = degrees(scene.rudder_limit)
        port = f"port {limit_deg:.0f}"
        starboard = f"stbd {limit_deg:.0f}"
        angle = f"rudder {degrees(scene.rudder):+.1f} deg"
        brush.text(port, (left, y + 15.0), COLOURS.faint, "centre", small=True)
        brush.text(starboard, (right, y + 15.0), COLOURS.faint, "centre", small=True)
        brush.text(angle, (x, y - 14.0), COLOURS.ink, "centre", small=True)

    def _draw_readouts(self, scene: Scene) -> None:
        readouts = dict(scene.readouts)
        if scene.wind is not None:
            wind_speed, _ = scene.wind
            readouts["wind"] = f"{wind_speed:.1f} m/s"
        if scene.current is not None:
            current_speed, _ = scene.current
            readouts["current"] = f"{current_speed:.2f} m/s"
        if not readouts:
            return

        spacing = 19.0
        height = 12.0 + spacing * len(readouts)
        self._brush.panel(COLOURS.panel, (8.0, 8.0, 212.0, height))
        down = 15.0
        # Colours of read-outs whose quantity is drawn too.
        legend = {
            "heading": COLOURS.hull,
            "to steer": COLOURS.order,
            "rudder": COLOURS.rudder,
            "wind": COLOURS.wind,
            "current": COLOURS.current,
        }
        for label, value in readouts.items():
            self._brush.text(label, (18.0, down), legend.get(label, COLOURS.faint))
            self._brush.text(value, (210.0, down), COLOURS.ink, "right")
            down += spacing


class _Brush:
    """Draws in pixels of the picture on a finer surface."""

    def __init__(self, pygame: Any) -> None:
        pygame.font.init()
        self._draw = pygame.draw
        self._smoothscale = pygame.transform.smoothscale
        self._surface = pygame.Surface((FINER * SIZE, FINER * SIZE))
        self._font = pygame.font.Font(None, FINER * 20)
        self._small_font = pygame.font.Font(None, FINER * 16)

    def show(self, surface: Any) -> None:
        """Scale the picture to its size."""
        self._smoothscale(self._surface, (SIZE, SIZE), surface)

    def fill(self, colour: Colour) -> None:
        self._surface.fill(colour)

    def line(self, colour: Colour, start: Any, end: Any, width: int = 1) -> None:
        ends = _fine(start), _fine(end)
        self._draw.line(self._surface, colour, *ends, FINER * width)

    def lines(self, colour: Colour, points: Any, width: int) -> None:
        closed = False
        self._draw.lines(self._surface, colour, closed, _fine(points), FINER * width)

    def polygon(self, colour: Colour, points: Any) -> None:
        self._draw.polygon(self._surface, colour, _fine(points))

    def circle(
        self,
        colour: Colour,
        centre: Any,
        radius: float,
        width: int = 0,
    ) -> None:
        self._draw.circle(
            self._surface,
            colour,
            _fine(centre),
            radius=FINER * radius,
            width=FINER * width,
        )

    def panel(self, colour: Colour, box: Any) -> None:
        self._draw.rect(
            self._surface,
            colour,
            _fine(box),
            border_radius=FINER * 8,
        )

    def arrow(self, colour: Colour, start: Any, end: Any) -> None:
        tail = np.asarray(start, dtype=float)
        tip = np.asarray(end, dtype=float)
        along, across = _axes(tail, tip)
        self.line(colour, tail, tip - 5.0 * along, 2)
        base = tip - 9.0 * along
        side = 4.0 * across
        self.polygon(colour, [tip, base + side, base - side])

    def text(
        self,
        text: str,
        at: Point,
        colour: Colour,
        anchor: str = "left",
        small: bool = False,
    ) -> None:
        font = self._small_font if small else self._font
        drawn = font.render(text, True, colour)
        width, height = drawn.get_size()
        x, y = _fine(at)
        if anchor == "right":
            x -= width
        elif anchor == "centre":
            x -= width / 2.0
            y -= height / 2.0
        self._surface.blit(drawn, (x, y))


def _fine(points: Any) -> Any:
    """Pixels of the finer surface."""
    return (FINER * np.asarray(points, dtype=float)).tolist()


def _hull(x: float, y: float, heading: float, length: float, beam: float) -> Floats:
    """Outline of a ship, m north and east, shape (n, 2)."""
    ahead = _direction(heading)
    starboard = [-ahead[1], ahead[0]]
    turned = (HULL_OUTLINE * [length, beam]) @ np.array([ahead, starboard])
    outline: Floats = turned + np.array([x, y])
    return outline


def _direction(angle: float) -> Floats:
    return np.array([cos(angle), sin(angle)])


def _on_circle(centre: Point, radius: float, bearing: float) -> Point:
    x, y = centre
    angle = bearing - pi / 2.0
    return x + radius * cos(angle), y + radius * sin(angle)


def _axes(start: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Unit vectors along a line and across it."""
    distance = max(hypot(*(end - start)), 1e-9)
    along = (end - start) / distance
    return along, np.array([-along[1], along[0]])
