"""Pictures of a voyage: a chart with path, wake and ship to scale, compass, rudder gauge and read-outs."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from math import cos, degrees, floor, hypot, log10, pi, radians, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shipgym.errors import InputError

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]
Point = tuple[float, float]
Colour = tuple[int, int, int]

SIZE = 600  # pixels of a side
CHART_LENGTHS = 14.0  # ship lengths across the chart
RENDER_MODES = ("human", "rgb_array")
FRAMES_PER_SECOND = 30

WATER, GRID, INK, FAINT = (234, 241, 245), (213, 224, 231), (28, 40, 48), (104, 122, 134)
PANEL, HULL, WAKE, RUDDER = (250, 252, 253), (42, 62, 80), (120, 160, 190), (200, 60, 40)
PATH, CORRIDOR, ORDER, WIND, CURRENT = (
    (60, 110, 70), (222, 236, 224), (60, 110, 70), (120, 90, 160), (30, 120, 170),
)  # fmt: skip

#: Outline of a ship from above: forward and to starboard, in lengths and beams.
OUTLINE = np.array([[0.5, 0.0], [0.38, 0.36], [0.2, 0.5], [-0.42, 0.5], [-0.5, 0.36]])
HULL_OUTLINE = np.vstack([OUTLINE, OUTLINE[:0:-1] * [1.0, -1.0]])


@dataclass(frozen=True, eq=False)
class Scene:
    """What one picture shows, SI units.

    Attributes
    ----------
    x, y : float
        Position of the ship, north and east, m.
    heading, rudder : float
        rad.
    length, beam : float
        Of the ship, m.
    rudder_limit : float
        rad.
    wake : array of shape (n, 2)
        Where the ship has been.
    course_order : float or None
        Heading to steer, rad.
    waypoints : array of shape (n, 2) or None
        Of the path.
    corridor : float or None
        Half the width of the corridor along the path, m.
    wind : tuple of float or None
        Speed, m/s, and direction it comes from, rad.
    current : tuple of float or None
        Speed, m/s, and direction it sets towards, rad.
    readouts : mapping of str to str
        Lines of text: what, and how much with its unit.
    """

    x: float
    y: float
    heading: float
    rudder: float
    length: float
    beam: float
    rudder_limit: float
    wake: Floats
    course_order: float | None = None
    waypoints: Floats | None = None
    corridor: float | None = None
    wind: tuple[float, float] | None = None
    current: tuple[float, float] | None = None
    readouts: Mapping[str, str] = field(default_factory=dict)


class Renderer:
    """Draws scenes, into arrays or a window.

    Parameters
    ----------
    mode : {"rgb_array", "human"}
        Whether `draw` shows the picture in a window too.

    Raises
    ------
    InputError
        For another mode, or where pygame-ce is not installed.
    """

    def __init__(self, mode: str) -> None:
        self.mode = check_render_mode(mode)
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        try:
            import pygame
        except ImportError:
            raise InputError(
                f"render_mode: {mode!r} needs the package pygame-ce; install it with "
                "pip install 'shipgym[render]'"
            ) from None
        self._pygame = pygame
        pygame.font.init()
        self._font = pygame.font.Font(None, 20)
        self._small = pygame.font.Font(None, 16)
        self._surface = pygame.Surface((SIZE, SIZE))
        self._window: Any = None
        self._clock: Any = None

    def draw(self, scene: Scene) -> Picture:
        """The picture of a scene.

        Parameters
        ----------
        scene : Scene

        Returns
        -------
        uint8 array of shape (600, 600, 3)
        """
        chart = _Chart(scene)
        self._surface.fill(WATER)
        self._draw_grid(chart)
        self._draw_path(chart, scene)
        self._draw_wake(chart, scene)
        self._draw_ship(chart, scene)
        self._draw_scale(chart)
        self._draw_compass(scene, (SIZE - 70.0, 70.0), 52.0)
        self._draw_gauge(scene, (SIZE / 2.0, SIZE - 34.0), 180.0)
        self._draw_readouts(scene)
        if self.mode == "human":
            self._show()
        pixels: Picture = np.transpose(self._pygame.surfarray.array3d(self._surface), (1, 0, 2))
        return pixels

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
            self._pygame.draw.line(self._surface, GRID, (0, offset), (SIZE, offset))
        for offset in chart.grid_lines(1):
            self._pygame.draw.line(self._surface, GRID, (offset, 0), (offset, SIZE))

    def _draw_path(self, chart: _Chart, scene: Scene) -> None:
        if scene.waypoints is None:
            return
        draw, points = self._pygame.draw, chart.pixels(scene.waypoints)
        if scene.corridor is not None:
            half = scene.corridor / chart.metres
            for start, end in pairwise(points):
                draw.polygon(self._surface, CORRIDOR, _strip(start, end, half))
            for point in points:
                draw.circle(self._surface, CORRIDOR, point.tolist(), half)
        draw.lines(self._surface, PATH, False, points.tolist(), 2)
        for point in points:
            draw.circle(self._surface, PATH, point.tolist(), 5, 2)

    def _draw_wake(self, chart: _Chart, scene: Scene) -> None:
        if len(scene.wake) > 1:
            self._pygame.draw.lines(self._surface, WAKE, False, chart.pixels(scene.wake).tolist(), 2)

    def _draw_ship(self, chart: _Chart, scene: Scene) -> None:
        draw = self._pygame.draw
        centre = np.array([scene.x, scene.y])
        size = np.array([scene.length, scene.beam])
        draw.polygon(
            self._surface, HULL, chart.pixels(centre + _turned(HULL_OUTLINE * size, scene.heading)).tolist()
        )
        if scene.course_order is not None:
            ahead = centre + 1.6 * scene.length * _direction(scene.course_order)
            self._arrow(chart.pixels(centre), chart.pixels(ahead), ORDER)
        bow = centre + 1.1 * scene.length * _direction(scene.heading)
        draw.line(self._surface, HULL, chart.pixels(centre).tolist(), chart.pixels(bow).tolist(), 1)
        stern = centre - 0.5 * scene.length * _direction(scene.heading)
        # a rudder to starboard puts its trailing edge to starboard of the stern
        blade = stern - 0.22 * scene.length * _direction(scene.heading - scene.rudder)
        draw.line(self._surface, RUDDER, chart.pixels(stern).tolist(), chart.pixels(blade).tolist(), 3)

    def _draw_scale(self, chart: _Chart) -> None:
        pixels = chart.spacing / chart.metres
        left, bottom = 14.0, SIZE - 18.0
        self._pygame.draw.line(self._surface, INK, (left, bottom), (left + pixels, bottom), 2)
        self._text(f"{chart.spacing:g} m", (left, bottom - 16.0), self._small, FAINT)

    def _draw_compass(self, scene: Scene, centre: Point, radius: float) -> None:
        draw = self._pygame.draw
        draw.circle(self._surface, PANEL, centre, radius + 12.0)
        draw.circle(self._surface, FAINT, centre, radius, 1)
        for angle in range(0, 360, 30):
            outer, inner = (_on_circle(centre, radius - inset, radians(angle)) for inset in (0.0, 5.0))
            draw.line(self._surface, FAINT, outer, inner)
        for name, angle in (("N", 0), ("E", 90), ("S", 180), ("W", 270)):
            self._text(name, _on_circle(centre, radius - 13.0, radians(angle)), self._small, INK, "centre")
        if scene.course_order is not None:
            self._arrow(centre, _on_circle(centre, radius, scene.course_order), ORDER)
        self._arrow(centre, _on_circle(centre, radius - 4.0, scene.heading), HULL)
        if scene.wind is not None:
            origin = scene.wind[1]
            self._arrow(_on_circle(centre, radius + 11, origin), _on_circle(centre, 24.0, origin), WIND)
        if scene.current is not None:
            tip = _on_circle(centre, radius + 11.0, scene.current[1])
            self._arrow(_on_circle(centre, 24.0, scene.current[1]), tip, CURRENT)

    def _draw_gauge(self, scene: Scene, centre: Point, width: float) -> None:
        draw, (x, y) = self._pygame.draw, centre
        box = (x - width / 2.0 - 28.0, y - 24.0, width + 56.0, 50.0)
        draw.rect(self._surface, PANEL, box, border_radius=8)
        draw.line(self._surface, FAINT, (x - width / 2.0, y), (x + width / 2.0, y))
        for part in (-1.0, -0.5, 0.0, 0.5, 1.0):
            at = x + part * width / 2.0
            draw.line(self._surface, FAINT, (at, y - 5.0), (at, y + 5.0))
        tip = x + max(-1.0, min(1.0, scene.rudder / scene.rudder_limit)) * width / 2.0
        draw.line(self._surface, RUDDER, (x, y), (tip, y), 5)
        limit = degrees(scene.rudder_limit)
        self._text(f"port {limit:.0f}", (x - width / 2.0, y + 15.0), self._small, FAINT, "centre")
        self._text(f"stbd {limit:.0f}", (x + width / 2.0, y + 15.0), self._small, FAINT, "centre")
        self._text(f"rudder {degrees(scene.rudder):+.1f} deg", (x, y - 14.0), self._small, INK, "centre")

    def _draw_readouts(self, scene: Scene) -> None:
        lines = list(scene.readouts.items())
        if scene.wind is not None:
            lines.append(("wind", f"{scene.wind[0]:.1f} m/s"))
        if scene.current is not None:
            lines.append(("current", f"{scene.current[0]:.2f} m/s"))
        if not lines:
            return
        box = (8.0, 8.0, 212.0, 12.0 + 19.0 * len(lines))
        self._pygame.draw.rect(self._surface, PANEL, box, border_radius=8)
        colours = {"wind": WIND, "current": CURRENT}
        for k, (what, much) in enumerate(lines):
            height = 15.0 + 19.0 * k
            self._text(what, (18.0, height), self._font, colours.get(what, FAINT))
            self._text(much, (210.0, height), self._font, INK, "right")

    def _arrow(self, start: Any, end: Any, colour: Colour) -> None:
        tail, tip = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
        along = (tip - tail) / max(hypot(*(tip - tail)), 1e-9)
        across = np.array([-along[1], along[0]])
        head = [tip, tip - 9.0 * along + 4.0 * across, tip - 9.0 * along - 4.0 * across]
        self._pygame.draw.line(self._surface, colour, tail.tolist(), (tip - 5.0 * along).tolist(), 2)
        self._pygame.draw.polygon(self._surface, colour, [point.tolist() for point in head])

    def _text(self, text: str, at: Point, font: Any, colour: Colour, anchor: str = "left") -> None:
        drawn = font.render(text, True, colour)
        width, height = drawn.get_size()
        shift = {"left": (0.0, 0.0), "right": (width, 0.0), "centre": (width / 2.0, height / 2.0)}[anchor]
        self._surface.blit(drawn, (at[0] - shift[0], at[1] - shift[1]))


class _Chart:
    """From metres north and east to pixels, north up, the ship in the middle."""

    def __init__(self, scene: Scene) -> None:
        self.metres = CHART_LENGTHS * scene.length / SIZE  # of a pixel
        self.spacing = _round_number(CHART_LENGTHS * scene.length / 6.0)
        self._centre = np.array([scene.x, scene.y])

    def pixels(self, points: Floats) -> Floats:
        """Pixels to the right and down, of the shape of the points."""
        north, east = np.moveaxis((np.asarray(points) - self._centre) / self.metres, -1, 0)
        return np.stack([SIZE / 2.0 + east, SIZE / 2.0 - north], axis=-1)

    def grid_lines(self, axis: int) -> Floats:
        """Pixels of the lines of constant north (axis 0, down) or east (1, to the right)."""
        half = 0.5 * SIZE * self.metres
        first = floor((self._centre[axis] - half) / self.spacing)
        lines = self.spacing * (first + np.arange(int(2.0 * half / self.spacing) + 3))
        points = np.zeros((len(lines), 2)) + self._centre
        points[:, axis] = lines
        return self.pixels(points)[:, 1 - axis]


def check_render_mode(mode: str) -> str:
    """A render mode that there is.

    Raises
    ------
    InputError
        For another.
    """
    if mode not in RENDER_MODES:
        raise InputError(
            f"render_mode: {mode!r} found, expected one of {', '.join(map(repr, RENDER_MODES))}, or None"
        )
    return mode


def _round_number(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above a value."""
    power = 10.0 ** floor(log10(value))
    return power * max(step for step in (1.0, 2.0, 5.0) if step * power <= value)


def _direction(angle: float) -> Floats:
    return np.array([cos(angle), sin(angle)])


def _turned(points: Floats, angle: float) -> Floats:
    """Points forward and to starboard as north and east."""
    rotation = np.array([[cos(angle), sin(angle)], [-sin(angle), cos(angle)]])
    turned: Floats = points @ rotation
    return turned


def _on_circle(centre: Point, radius: float, bearing: float) -> Point:
    angle = bearing - pi / 2.0
    return centre[0] + radius * cos(angle), centre[1] + radius * sin(angle)


def _strip(start: Floats, end: Floats, half: float) -> list[list[float]]:
    along = (end - start) / max(hypot(*(end - start)), 1e-9)
    across = half * np.array([-along[1], along[0]])
    return [
        (start + across).tolist(),
        (end + across).tolist(),
        (end - across).tolist(),
        (start - across).tolist(),
    ]
