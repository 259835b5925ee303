"""Pictures of a voyage: chart with path, wake and ship, compass and read-outs."""

import os
from itertools import pairwise
from math import atan2, cos, degrees, floor, hypot, log10, pi, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shipgym.arrays import Floats
from shipgym.envs.engine import Engine
from shipgym.extras import library
from shipgym.tasks.guidance import track
from shipgym.tasks.shapes import ChartWidth, Circle, Line, Shape, ShipOutline, rgb
from shipgym.trials.units import KNOT

SIZE = 600  # pixels of a side
FINER = 2  # pixels drawn for one that is shown, so that edges are smooth
CHART_LENGTHS = 14.0  # ship lengths across the chart
USUAL_BEAM = 0.15  # of the length, where the beam is not known
WAKE_POINTS = 400  # that are kept

WATER = (234, 241, 245)
GRID = (213, 224, 231)
INK = (28, 40, 48)
FAINT = (104, 122, 134)
PANEL = (250, 252, 253)
HULL = (42, 62, 80)
WAKE = (120, 160, 190)
RUDDER = (200, 60, 40)
PATH = (60, 110, 70)
CORRIDOR = (222, 236, 224)
ORDER = (200, 120, 10)
WIND = (120, 90, 160)
CURRENT = (0, 140, 150)

#: Outline of a ship from above: forward and to starboard, in lengths and beams.
OUTLINE = np.array([[0.5, 0.0], [0.38, 0.36], [0.2, 0.5], [-0.42, 0.5], [-0.5, 0.36]])
HULL_OUTLINE = np.vstack([OUTLINE, OUTLINE[:0:-1] * [1.0, -1.0]])


class Artist:
    """Draws one lane of an engine into arrays ("rgb_array"), or a window ("human").

    Raises InputError where pygame-ce is not installed.
    """

    def __init__(self, mode: str, lane: int = 0) -> None:
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        self._pygame = library("pygame", "render", f"render_mode {mode!r} needs it")
        self._mode = mode
        self._lane = lane
        self._canvas = _Canvas(self._pygame)
        self._window: Any = None
        self._clock: Any = None
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
        shapes = engine.shapes(self._lane)
        length = engine.model.particulars["length"]
        chart = _Chart(state["x"], state["y"], length, shapes)
        canvas = self._canvas
        canvas.fill(WATER)
        _draw_grid(canvas, chart)
        _draw_path(canvas, chart, engine, self._lane)
        if len(self._wake) > 1:
            canvas.line(WAKE, chart.pixels(self._wake), 2)
        for shape in shapes:
            _draw_shape(canvas, chart, shape)
        _draw_ship(canvas, chart, engine, state)
        _draw_compass(canvas, state)
        _draw_readouts(canvas, readouts(engine, self._lane, state))
        surface = canvas.shown()
        if self._mode == "human":
            self._show(surface)
        columns = self._pygame.surfarray.array3d(surface)
        return np.transpose(columns, (1, 0, 2))

    def _state(self, engine: Engine) -> dict[str, float]:
        """Physical state of the lane."""
        states = engine.physical_state()
        return {name: float(values[self._lane]) for name, values in states.items()}

    def _show(self, surface: Any) -> None:
        pygame = self._pygame
        if self._window is None:
            pygame.display.init()
            self._window = pygame.display.set_mode((SIZE, SIZE))
            pygame.display.set_caption("shipgym")
            self._clock = pygame.time.Clock()
        pygame.event.pump()
        self._window.blit(surface, (0, 0))
        pygame.display.flip()
        frames_per_second = 30
        self._clock.tick(frames_per_second)

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._pygame.display.quit()
            self._window = None


class _Chart:
    """Map from metres north and east to pixels, north up, the ship in the middle."""

    def __init__(self, x: float, y: float, length: float, shapes: Any) -> None:
        width = CHART_LENGTHS * length
        for shape in shapes:
            if isinstance(shape, ChartWidth):
                width = shape.width
        self.width = width
        self.metres = width / SIZE  # of a pixel
        self.centre = np.array([x, y])

    def pixels(self, points: Any) -> Floats:
        """Pixels to the right and down, of the shape of the points."""
        north, east = np.moveaxis(
            (np.asarray(points) - self.centre) / self.metres, -1, 0
        )
        middle = SIZE / 2.0
        return np.stack([middle + east, middle - north], axis=-1)

    @property
    def spacing(self) -> float:
        """Distance of grid lines, m: 1, 2 or 5 times a power of ten."""
        largest = self.width / 6.0
        power = 10.0 ** floor(log10(largest))
        return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= largest)


class _Canvas:
    """Draws in pixels of the picture on a finer surface."""

    def __init__(self, pygame: Any) -> None:
        pygame.font.init()
        self._pygame = pygame
        self._surface = pygame.Surface((FINER * SIZE, FINER * SIZE))
        self._font = pygame.font.Font(None, FINER * 20)

    def shown(self) -> Any:
        """Surface of the picture's size."""
        return self._pygame.transform.smoothscale(self._surface, (SIZE, SIZE))

    def fill(self, colour: Any) -> None:
        self._surface.fill(colour)

    def line(self, colour: Any, points: Any, width: int = 1) -> None:
        draw = self._pygame.draw.lines
        draw(self._surface, colour, False, _fine(points), FINER * width)

    def polygon(self, colour: Any, points: Any) -> None:
        self._pygame.draw.polygon(self._surface, colour, _fine(points))

    def circle(self, colour: Any, centre: Any, radius: float, width: int = 0) -> None:
        draw = self._pygame.draw.circle
        draw(self._surface, colour, _fine(centre), FINER * radius, FINER * width)

    def panel(self, colour: Any, box: Any) -> None:
        draw = self._pygame.draw.rect
        draw(self._surface, colour, _fine(box), border_radius=FINER * 8)

    def arrow(self, colour: Any, start: Any, end: Any) -> None:
        tail = np.asarray(start, dtype=float)
        tip = np.asarray(end, dtype=float)
        along, across = _axes(tail, tip)
        base = tip - 9.0 * along
        self.line(colour, [tail, base], 2)
        self.polygon(colour, [tip, base + 4.0 * across, base - 4.0 * across])

    def text(self, text: str, at: Any, colour: Any, right: bool = False) -> None:
        drawn = self._font.render(text, True, colour)
        x, y = _fine(at)
        if right:
            x -= drawn.get_width()
        self._surface.blit(drawn, (x, y))


def _fine(points: Any) -> Any:
    """Pixels of the finer surface."""
    return (FINER * np.asarray(points, dtype=float)).tolist()


def _axes(start: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Unit vectors along a line and across it."""
    along = (end - start) / max(hypot(*(end - start)), 1e-9)
    return along, np.array([-along[1], along[0]])


def _direction(angle: float) -> Floats:
    return np.array([cos(angle), sin(angle)])


def _hull(x: float, y: float, heading: float, length: float, beam: float) -> Floats:
    """Outline of a ship, m north and east, shape (n, 2)."""
    ahead = _direction(heading)
    starboard = [-ahead[1], ahead[0]]
    turned = (HULL_OUTLINE * [length, beam]) @ np.array([ahead, starboard])
    outline: Floats = turned + np.array([x, y])
    return outline


def _draw_grid(canvas: _Canvas, chart: _Chart) -> None:
    """Draw lines of constant north and east, and a scale as long as they are apart."""
    spacing = chart.spacing
    n_lines = int(chart.width / spacing) + 3
    for axis in (0, 1):
        half = 0.5 * chart.width
        first = floor((chart.centre[axis] - half) / spacing)
        for k in range(first, first + n_lines):
            ends = np.stack([chart.centre - half, chart.centre + half])
            ends[:, axis] = spacing * k
            canvas.line(GRID, chart.pixels(ends))
    left, bottom = 14.0, SIZE - 18.0
    right = left + spacing / chart.metres
    canvas.line(INK, [(left, bottom), (right, bottom)], 2)
    canvas.text(f"{spacing:g} m", (left, bottom - 16.0), FAINT)


def _draw_path(canvas: _Canvas, chart: _Chart, engine: Engine, lane: int) -> None:
    waypoints = engine.waypoints(lane)
    if waypoints is None:
        return
    points = chart.pixels(track(waypoints, engine.path_metres("turn_radius")))
    corridor = engine.path_metres("corridor")
    if corridor is not None:
        half = corridor / chart.metres
        for start, end in pairwise(points):
            side = half * _axes(start, end)[1]
            canvas.polygon(
                CORRIDOR, [start + side, end + side, end - side, start - side]
            )
        for point in points:
            canvas.circle(CORRIDOR, point, half)
    canvas.line(PATH, points, 2)
    for point in chart.pixels(waypoints):
        canvas.circle(WATER, point, 5)
        canvas.circle(PATH, point, 5, 2)


def _draw_shape(canvas: _Canvas, chart: _Chart, shape: Shape) -> None:
    if isinstance(shape, Line):
        canvas.line(rgb(shape.colour), chart.pixels(shape.points), 2)
    elif isinstance(shape, Circle):
        centre = chart.pixels([shape.x, shape.y])
        width = 0 if shape.filled else 2
        canvas.circle(rgb(shape.colour), centre, shape.radius / chart.metres, width)
    elif isinstance(shape, ShipOutline):
        beam = shape.beam or USUAL_BEAM * shape.length
        hull = _hull(shape.x, shape.y, shape.psi, shape.length, beam)
        canvas.polygon(rgb(shape.colour), chart.pixels(hull))


def _draw_ship(
    canvas: _Canvas,
    chart: _Chart,
    engine: Engine,
    state: dict[str, float],
) -> None:
    particulars = engine.model.particulars
    length = particulars["length"]
    centre = chart.centre
    middle = chart.pixels(centre)
    if "set_point" in state:
        order = centre + 1.6 * length * _direction(state["set_point"])
        canvas.arrow(ORDER, middle, chart.pixels(order))

    ahead = _direction(state["psi"])
    bow = centre + 1.1 * length * ahead
    canvas.line(HULL, [middle, chart.pixels(bow)])
    # a rudder to starboard puts its trailing edge to starboard of the stern
    stern = centre - 0.5 * length * ahead
    blade = stern - 0.22 * length * _direction(state["psi"] - state["delta"])
    canvas.line(RUDDER, chart.pixels([stern, blade]), 3)
    beam = particulars.get("beam") or USUAL_BEAM * length
    hull = _hull(state["x"], state["y"], state["psi"], length, beam)
    canvas.polygon(HULL, chart.pixels(hull))


def _draw_compass(canvas: _Canvas, state: dict[str, float]) -> None:
    """Draw heading, set-point, and where wind comes from and current sets to."""
    centre = np.array([SIZE - 64.0, 64.0])
    radius = 44.0

    def on_circle(part: float, bearing: float) -> Floats:
        return centre + part * radius * _direction(bearing - pi / 2.0)

    canvas.circle(PANEL, centre, 1.2 * radius)
    canvas.circle(FAINT, centre, radius, 1)
    canvas.text("N", centre - [5.0, 0.93 * radius], INK)
    canvas.arrow(HULL, on_circle(0.5, state["psi"] + pi), on_circle(0.8, state["psi"]))
    if "set_point" in state:
        order = state["set_point"]
        canvas.arrow(ORDER, on_circle(0.9, order), on_circle(1.15, order))
    if state.get("wind_speed"):
        wind_from = state["wind_from"]
        canvas.arrow(WIND, on_circle(1.3, wind_from), on_circle(0.85, wind_from))
    current, set_towards = _current(state)
    if current:
        canvas.arrow(CURRENT, on_circle(0.85, set_towards), on_circle(1.3, set_towards))


def _current(state: dict[str, float]) -> tuple[float, float]:
    """Speed of the current, m/s, and where it sets to, rad."""
    north = state.get("current_north", 0.0)
    east = state.get("current_east", 0.0)
    return hypot(east, north), atan2(east, north)


def _draw_readouts(canvas: _Canvas, lines: dict[str, str]) -> None:
    spacing = 19.0
    canvas.panel(PANEL, (8.0, 8.0, 212.0, 12.0 + spacing * len(lines)))
    # colours of read-outs whose quantity is drawn too
    legend = {
        "heading": HULL,
        "to steer": ORDER,
        "rudder": RUDDER,
        "wind": WIND,
        "current": CURRENT,
    }
    for row, (label, value) in enumerate(lines.items()):
        down = 15.0 + spacing * row
        canvas.text(label, (18.0, down), legend.get(label, FAINT))
        canvas.text(value, (210.0, down), INK, right=True)


def readouts(engine: Engine, lane: int, state: dict[str, float]) -> dict[str, str]:
    """Quantities of a lane, with their values and units."""
    speed = hypot(state["u"], state["v"])
    heading = state["psi"]
    lines = {
        "speed": f"{speed:.1f} m/s, {speed / KNOT:.1f} kn",
        "heading": _bearing(heading),
    }
    if "set_point" in state:
        set_point = state["set_point"]
        error = (set_point - heading + pi) % (2.0 * pi) - pi
        lines["to steer"] = _bearing(set_point)
        lines["heading error"] = f"{degrees(error):+.1f} deg"
    lines["rudder"] = f"{degrees(state['delta']):+.1f} deg"
    shaft = state.get("n", state.get("n_command"))
    if shaft is not None:
        lines["shaft"] = f"{60.0 * shaft:.0f} rpm"
    if "cross_track" in engine.task.info_names:
        lines["cross-track"] = f"{engine.info('cross_track')[lane]:+.0f} m"
    lines["reward"] = f"{engine.outputs.outcomes[0, lane]:+.3f}"
    if state.get("wind_speed"):
        lines["wind"] = f"{state['wind_speed']:.1f} m/s"
    current, _ = _current(state)
    if current:
        lines["current"] = f"{current:.2f} m/s"
    return lines


def _bearing(angle: float) -> str:
    """Text of an angle as on a compass."""
    tenths = round(degrees(angle) * 10.0) % 3600
    return f"{tenths / 10.0:05.1f} deg"
