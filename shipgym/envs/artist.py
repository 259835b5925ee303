"""What an environment's picture shows: the scene of one lane of an engine, and the wake behind its ship."""

from math import atan2, degrees, hypot, pi

import numpy as np
from numpy.typing import NDArray

from shipgym.arrays import Floats
from shipgym.envs.engine import Engine
from shipgym.envs.rendering import Renderer, Scene
from shipgym.trials.units import KNOT

WAKE_POINTS = 400  # kept of the wake
USUAL_BEAM = 0.15  # of the length, where the beam is not known


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
        """Note where the ship is."""
        state = engine.physical_state()
        self._wake.append(
            (float(state["x"][self._lane]), float(state["y"][self._lane]))
        )
        del self._wake[:-WAKE_POINTS]

    def picture(self, engine: Engine) -> NDArray[np.uint8]:
        """The picture, uint8 array of shape (600, 600, 3)."""
        return self._renderer.draw(
            scene(engine, self._lane, np.array(self._wake).reshape(-1, 2))
        )

    def close(self) -> None:
        """Close the window, if there is one."""
        self._renderer.close()


def scene(engine: Engine, lane: int, wake: Floats) -> Scene:
    """What a picture of one lane shows."""
    state = {
        name: float(values[lane]) for name, values in engine.physical_state().items()
    }
    particulars = engine.model.particulars
    length, wind = particulars["length"], state.get("wind_speed", 0.0)
    north, east = state.get("current_north", 0.0), state.get("current_east", 0.0)
    return Scene(
        x=state["x"],
        y=state["y"],
        heading=state["psi"],
        rudder=state["delta"],
        length=length,
        beam=particulars.get("beam") or USUAL_BEAM * length,
        rudder_limit=engine.model.steering.limit,
        wake=wake,
        course_order=state.get("set_point", state["psi"]),
        waypoints=engine.waypoints(lane),
        turn_radius=engine.path_metres("turn_radius"),
        corridor=engine.path_metres("corridor"),
        wind=(wind, state["wind_from"]) if wind else None,
        current=(hypot(north, east), atan2(east, north)) if north or east else None,
        readouts=_readouts(engine, lane, state),
    )


def _readouts(engine: Engine, lane: int, state: dict[str, float]) -> dict[str, str]:
    """Speed, errors and the last reward."""
    speed = hypot(state["u"], state["v"])
    lines = {
        "speed": f"{speed:.1f} m/s, {speed / KNOT:.1f} kn",
        "heading": _bearing(state["psi"]),
    }
    if "set_point" in state:
        error = (state["set_point"] - state["psi"] + pi) % (2.0 * pi) - pi
        lines |= {
            "to steer": _bearing(state["set_point"]),
            "heading error": f"{degrees(error):+.1f} deg",
        }
    lines["rudder"] = f"{degrees(state['delta']):+.1f} deg"
    if "cross_track" in engine.task.info_names:
        lines["cross-track"] = f"{engine.info('cross_track')[lane]:+.0f} m"
    return {**lines, "reward": f"{engine.outputs.outcomes[0, lane]:+.3f}"}


def _bearing(angle: float) -> str:
    """An angle as a compass shows it."""
    return f"{round(degrees(angle) * 10.0) % 3600 / 10.0:05.1f} deg"
