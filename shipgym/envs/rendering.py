"""Pictures of a voyage: a chart with path, wake and ship to scale, compass, rudder gauge and read-outs."""

import os
from collections.abc import Mapping
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

Picture = NDArray[np.uint8]
Point = tuple[float, float]
Colour = tuple[int, int, int]

SIZE = 600  # pixels of a side
CHART_LENGTHS = 14.0  # ship lengths across the chart
RENDER_MODES = ("human", "rgb_array")
FRAMES_PER_SECOND = 30
FINER = 2  # pixels drawn for one that is shown, so that edges are smooth

WATER, GRID, INK, FAINT = (
    (234, 241, 245),
    (213, 224, 231),
    (28, 40, 48),
    (104, 122, 134),
)
PANEL, HULL, WAKE, RUDDER = (
    (250, 252, 253),
    (42, 62, 80),
    (120, 160, 190),
    (200, 60, 40),
)
PATH, CORRIDOR, ORDER, WIND, CURRENT = (
    (60, 110, 70),
    (222, 236, 224),
    (200, 120, 10),
    (120, 90, 160),
    (0, 140, 150),
)

#: Colours of read-outs whose quantity is drawn too.
LEGEND = {
    "heading": HULL,
    "to steer": ORDER,
    "rudder": RUDDER,
    "wind": WIND,
    "current": CURRENT,
}

#: Outline of a ship from above: forward and to starboard, in lengths and beams.
OUTLINE = np.array([[0.5, 0.0], [0.38, 0.36], [0.2, 0.5], [-0.42, 0.5], [-0.5, 0.36]])
HULL_OUTLINE = np.vstack([OUTLINE, OUTLINE[:0:-1] * [1.0, -1.0]])


@dataclass(frozen=True, eq=False)
class Scene:
    """What one picture shows, SI units."""

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
    readouts: Mapping[str, str] = field(
        default_factory=dict
    )  # a quantity, and its value with the unit


class _Chart:
    """From metres north and east to pixels, north up, the ship in the middle."""

    def __init__(self, scene: Scene) -> None:
        self.metres = CHART_LENGTHS * scene.length / SIZE  # of a pixel
        # of the grid: the largest of 1, 2, 5 times a power of ten that is not above a
        # sixth of the chart
        sixth = CHART_LENGTHS * scene.length / 6.0
        power = 10.0 ** floor(log10(sixth))
        self.spacing = power * max(
            step for step in (1.0, 2.0, 5.0) if step * power <= sixth
        )
        self._centre = np.array([scene.x, scene.y])

    def pixels(self, points: Any) -> Floats:
        """Pixels to the right and down, of the shape of the points."""
        north, east = np.moveaxis(
            (np.asarray(points) - self._centre) / self.metres, -1, 0
        )
        return np.stack([SIZE / 2.0 + east, SIZE / 2.0 - north], axis=-1)

    def grid_lines(self, axis: int) -> Floats:
        """Pixels of the lines of constant north (axis 0, down) or east (1, to the right)."""
        half = 0.5 * SIZE * self.metres
        first = floor((self._centre[axis] - half) / self.spacing)
        lines = self.spacing * (first + np.arange(int(2.0 * half / self.spacing) + 3))
        points = np.zeros((len(lines), 2)) + self._centre
        points[:, axis] = lines
        return self.pixels(points)[:, 1 - axis]


class Renderer:
    """Draws scenes into arrays ("rgb_array") or in a window too ("human").

    Raises InputError for another mode, or where pygame-ce is not installed.
    """

    def __init__(self, mode: str) -> None:
        self.mode = check_choice(mode, RENDER_MODES, "render_mode")
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        self._pygame = pygame = library(
            "pygame", "render", f"render_mode {mode!r} needs it"
        )
        self._brush = _Brush(pygame)
        self._surface = pygame.Surface((SIZE, SIZE))
        self._window: Any = None
        self._clock: Any = None

    def draw(self, scene: Scene) -> Picture:
        """The picture of a scene, a uint8 array of shape (600, 600, 3)."""
        chart = _Chart(scene)
        self._brush.fill(WATER)
        self._draw_grid(chart)
        self._draw_path(chart, scene)
        if len(scene.wake) > 1:
            self._brush.lines(WAKE, chart.pixels(scene.wake), 2)
        self._draw_ship(chart, scene)
        self._draw_scale(chart)
        self._draw_compass(scene, (SIZE - 70.0, 70.0), 52.0)
        self._draw_gauge(scene, (SIZE / 2.0, SIZE - 34.0), 180.0)
        self._draw_readouts(scene)
        self._brush.show(self._surface)
        if self.mode == "human":
            self._show()
        return np.transpose(self._pygame.surfarray.array3d(self._surface), (1, 0, 2))

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
        self._clock.tick(FRAMES_PER_SECOND)

    def _draw_grid(self, chart: _Chart) -> None:
        for offset in chart.grid_lines(0):
            self._brush.line(GRID, (0.0, offset), (SIZE, offset))
        for offset in chart.grid_lines(1):
            self._brush.line(GRID, (offset, 0.0), (offset, SIZE))

    def _draw_path(self, chart: _Chart, scene: Scene) -> None:
        if scene.waypoints is None:
            return
        brush, points = (
            self._brush,
            chart.pixels(track(scene.waypoints, scene.turn_radius)),
        )
        if scene.corridor is not None:
            half = scene.corridor / chart.metres
            for start, end in pairwise(points):
                side = half * _axes(start, end)[1]
                brush.polygon(
                    CORRIDOR, [start + side, end + side, end - side, start - side]
                )
            for point in points:
                brush.circle(CORRIDOR, point, half)
        brush.lines(PATH, points, 2)
        for point in chart.pixels(scene.waypoints):
            brush.circle(WATER, point, 5)
            brush.circle(PATH, point, 5, 2)

    def _draw_ship(self, chart: _Chart, scene: Scene) -> None:
        brush, ahead = self._brush, _direction(scene.heading)
        centre = np.array([scene.x, scene.y])
        if scene.course_order is not None:
            order = centre + 1.6 * scene.length * _direction(scene.course_order)
            brush.arrow(ORDER, chart.pixels(centre), chart.pixels(order))
        bow, stern = (
            centre + 1.1 * scene.length * ahead,
            centre - 0.5 * scene.length * ahead,
        )
        brush.line(HULL, chart.pixels(centre), chart.pixels(bow))
        # a rudder to starboard puts its trailing edge to starboard of the stern
        blade = stern - 0.22 * scene.length * _direction(scene.heading - scene.rudder)
        brush.line(RUDDER, chart.pixels(stern), chart.pixels(blade), 3)
        turned = np.array(
            [ahead, [-ahead[1], ahead[0]]]
        )  # forward and to starboard as north and east
        brush.polygon(
            HULL,
            chart.pixels(centre + HULL_OUTLINE * [scene.length, scene.beam] @ turned),
        )

    def _draw_scale(self, chart: _Chart) -> None:
        pixels = chart.spacing / chart.metres
        left, bottom = 14.0, SIZE - 18.0
        self._brush.line(INK, (left, bottom), (left + pixels, bottom), 2)
        self._brush.text(
            f"{chart.spacing:g} m", (left, bottom - 16.0), FAINT, small=True
        )

    def _draw_compass(self, scene: Scene, centre: Point, radius: float) -> None:
        brush = self._brush
        brush.circle(PANEL, centre, radius + 12.0)
        brush.circle(FAINT, centre, radius, 1)
        for angle in range(0, 360, 30):
            outer, inner = (
                _on_circle(centre, radius - inset, radians(angle))
                for inset in (0.0, 5.0)
            )
            brush.line(FAINT, outer, inner)
        for name, angle in (("N", 0), ("E", 90), ("S", 180), ("W", 270)):
            brush.text(
                name,
                _on_circle(centre, radius - 15.0, radians(angle)),
                INK,
                "centre",
                small=True,
            )
        needle = radius - 22.0  # leaves the letters free
        brush.arrow(
            HULL,
            _on_circle(centre, 0.6 * needle, scene.heading + pi),
            _on_circle(centre, needle, scene.heading),
        )
        if scene.course_order is not None:
            corners = ((-4.0, 0.0), (9.0, -0.09), (9.0, 0.09))
            order = scene.course_order
            brush.polygon(
                ORDER,
                [
                    _on_circle(centre, radius + out, order + side)
                    for out, side in corners
                ],
            )
        for colour, flow, ends in (
            (WIND, scene.wind, (12.0, -8.0)),
            (CURRENT, scene.current, (-8.0, 12.0)),
        ):
            if flow is not None:
                brush.arrow(
                    colour, *(_on_circle(centre, radius + out, flow[1]) for out in ends)
                )

    def _draw_gauge(self, scene: Scene, centre: Point, width: float) -> None:
        brush, (x, y) = self._brush, centre
        brush.panel(PANEL, (x - width / 2.0 - 28.0, y - 24.0, width + 56.0, 50.0))
        brush.line(FAINT, (x - width / 2.0, y), (x + width / 2.0, y))
        for part in (-1.0, -0.5, 0.0, 0.5, 1.0):
            at = x + part * width / 2.0
            brush.line(FAINT, (at, y - 5.0), (at, y + 5.0))
        tip = x + max(-1.0, min(1.0, scene.rudder / scene.rudder_limit)) * width / 2.0
        brush.line(RUDDER, (x, y), (tip, y), 5)
        limit = degrees(scene.rudder_limit)
        brush.text(
            f"port {limit:.0f}",
            (x - width / 2.0, y + 15.0),
            FAINT,
            "centre",
            small=True,
        )
        brush.text(
            f"stbd {limit:.0f}",
            (x + width / 2.0, y + 15.0),
            FAINT,
            "centre",
            small=True,
        )
        brush.text(
            f"rudder {degrees(scene.rudder):+.1f} deg",
            (x, y - 14.0),
            INK,
            "centre",
            small=True,
        )

    def _draw_readouts(self, scene: Scene) -> None:
        lines = list(scene.readouts.items())
        if scene.wind is not None:
            lines.append(("wind", f"{scene.wind[0]:.1f} m/s"))
        if scene.current is not None:
            lines.append(("current", f"{scene.current[0]:.2f} m/s"))
        if not lines:
            return
        self._brush.panel(PANEL, (8.0, 8.0, 212.0, 12.0 + 19.0 * len(lines)))
        for k, (label, value) in enumerate(lines):
            height = 15.0 + 19.0 * k
            self._brush.text(label, (18.0, height), LEGEND.get(label, FAINT))
            self._brush.text(value, (210.0, height), INK, "right")


class _Brush:
    """Draws in pixels of the picture on a finer surface."""

    def __init__(self, pygame: Any) -> None:
        pygame.font.init()
        self._pygame = pygame
        self._surface = pygame.Surface((FINER * SIZE, FINER * SIZE))
        self._fonts = {
            small: pygame.font.Font(None, FINER * (16 if small else 20))
            for small in (False, True)
        }

    def show(self, surface: Any) -> None:
        """Bring the picture to its size."""
        self._pygame.transform.smoothscale(self._surface, (SIZE, SIZE), surface)

    def fill(self, colour: Colour) -> None:
        self._surface.fill(colour)

    def line(self, colour: Colour, start: Any, end: Any, width: int = 1) -> None:
        self._pygame.draw.line(
            self._surface, colour, _fine(start), _fine(end), FINER * width
        )

    def lines(self, colour: Colour, points: Any, width: int) -> None:
        self._pygame.draw.lines(
            self._surface, colour, False, _fine(points), FINER * width
        )

    def polygon(self, colour: Colour, points: Any) -> None:
        self._pygame.draw.polygon(self._surface, colour, _fine(points))

    def circle(
        self, colour: Colour, centre: Any, radius: float, width: int = 0
    ) -> None:
        self._pygame.draw.circle(
            self._surface, colour, _fine(centre), FINER * radius, FINER * width
        )

    def panel(self, colour: Colour, box: Any) -> None:
        self._pygame.draw.rect(
            self._surface, colour, _fine(box), border_radius=FINER * 8
        )

    def arrow(self, colour: Colour, start: Any, end: Any) -> None:
        tail, tip = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
        along, across = _axes(tail, tip)
        self.line(colour, tail, tip - 5.0 * along, 2)
        self.polygon(
            colour,
            [tip, tip - 9.0 * along + 4.0 * across, tip - 9.0 * along - 4.0 * across],
        )

    def text(
        self,
        text: str,
        at: Point,
        colour: Colour,
        anchor: str = "left",
        small: bool = False,
    ) -> None:
        drawn = self._fonts[small].render(text, True, colour)
        width, height = drawn.get_size()
        shift = {
            "left": (0.0, 0.0),
            "right": (width, 0.0),
            "centre": (width / 2.0, height / 2.0),
        }[anchor]
        self._surface.blit(drawn, (FINER * at[0] - shift[0], FINER * at[1] - shift[1]))


def _fine(points: Any) -> Any:
    """Pixels of the finer surface."""
    return (FINER * np.asarray(points, dtype=float)).tolist()


def _direction(angle: float) -> Floats:
    return np.array([cos(angle), sin(angle)])


def _on_circle(centre: Point, radius: float, bearing: float) -> Point:
    angle = bearing - pi / 2.0
    return centre[0] + radius * cos(angle), centre[1] + radius * sin(angle)


def _axes(start: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Unit vectors along a line and across it."""
    along = (end - start) / max(hypot(*(end - start)), 1e-9)
    return along, np.array([-along[1], along[0]])
