"""Scene of one lane of an engine, and the wake behind its ship."""

from math import atan2, degrees, hypot, pi

import numpy as np
from numpy.typing import NDArray

from shipgym.arrays import Floats
from shipgym.envs.engine import Engine
from shipgym.envs.rendering import Renderer, Scene
from shipgym.trials.units import KNOT


class Artist:
    """Draws one lane of an engine; modes as in `Renderer`."""

    def __init__(self, mode: str, lane: int = 0) -> None:
        self._renderer = Renderer(mode)
        self._lane = lane
        self._wake: list[tuple[float, float]] = []

    def begin(self, engine: Engine) -> None:
        """Begin a new wake."""
        self._wake = []
        self.note(engine)

    def note(self, engine: Engine) -> None:
        """Add the position of the ship to the wake."""
        state = engine.physical_state()
        north = float(state["x"][self._lane])
        east = float(state["y"][self._lane])
        self._wake.append((north, east))
        wake_points = 400  # points of the wake that are kept
        del self._wake[:-wake_points]

    def picture(self, engine: Engine) -> NDArray[np.uint8]:
        """Draw the lane, uint8 array of shape (600, 600, 3)."""
        wake = np.array(self._wake).reshape(-1, 2)
        return self._renderer.draw(scene(engine, self._lane, wake))

    def close(self) -> None:
        """Close the window, if there is one."""
        self._renderer.close()


def scene(engine: Engine, lane: int, wake: Floats) -> Scene:
    """Scene of one lane."""
    state = {}
    for name, values in engine.physical_state().items():
        state[name] = float(values[lane])
    particulars = engine.model.particulars
    length = particulars["length"]

    wind = None
    if state.get("wind_speed"):
        wind = (state["wind_speed"], state["wind_from"])
    current = None
    north = state.get("current_north", 0.0)
    east = state.get("current_east", 0.0)
    if north or east:
        current = (hypot(north, east), atan2(east, north))
    usual_beam = 0.15  # of the length, where the beam is not known
    return Scene(
        x=state["x"],
        y=state["y"],
        heading=state["psi"],
        rudder=state["delta"],
        length=length,
        beam=particulars.get("beam") or usual_beam * length,
        rudder_limit=engine.model.steering.limit,
        wake=wake,
        course_order=state.get("set_point", state["psi"]),
        waypoints=engine.waypoints(lane),
        turn_radius=engine.path_metres("turn_radius"),
        corridor=engine.path_metres("corridor"),
        wind=wind,
        current=current,
        shapes=engine.shapes(lane),
        readouts=_readouts(engine, lane, state),
    )


def _readouts(engine: Engine, lane: int, state: dict[str, float]) -> dict[str, str]:
    """Speed, errors and the last reward."""
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
    rudder_deg = degrees(state["delta"])
    lines["rudder"] = f"{rudder_deg:+.1f} deg"
    is_ordered = len(engine.command) > 1
    if "n" in state:
        lines["shaft"] = _shaft(engine, lane, state["n"])
    elif is_ordered:  # a shaft without lag turns as ordered
        lines["shaft"] = _shaft(engine, lane, state["n_command"])
    if "cross_track" in engine.task.info_names:
        cross_track = engine.info("cross_track")[lane]
        lines["cross-track"] = f"{cross_track:+.0f} m"
    reward = engine.outputs.outcomes[0, lane]
    lines["reward"] = f"{reward:+.3f}"
    return lines


def _shaft(engine: Engine, lane: int, shaft_speed: float) -> str:
    """Shaft speed, and the order where the shaft is commanded."""
    text = f"{60.0 * shaft_speed:.0f} rpm"
    if len(engine.command) < 2:
        return text
    share = engine.command[1][lane]
    return f"{text}, ordered {share:+.2f}"


def _bearing(angle: float) -> str:
    """Text of an angle as on a compass."""
    tenths = round(degrees(angle) * 10.0) % 3600
    return f"{tenths / 10.0:05.1f} deg"
