"""Rows of a native vector environment, as the single environments they stand for."""

from typing import Any, Self

from shipgym.arrays import Floats

#: Attributes that all rows share, by the names of the single environment.
SHARED = (
    "corridor",
    "dt",
    "metadata",
    "model",
    "observation_names",
    "observation_scales",
    "render_mode",
    "spec",
    "task",
    "turn_radius",
)
SPACES = ("observation_space", "action_space")  # of one ship


class Row:
    """Attributes of the single environment of one row, and those of `set_attr`.

    `env`: a `ShipVectorEnv`; `number`: of its row.
    """

    def __init__(self, env: Any, number: int) -> None:
        self._env = env
        self._number = number

    def __getattr__(self, name: str) -> Any:
        if name not in (*SHARED, *SPACES):
            raise AttributeError(f"a row has no attribute {name!r}")
        return getattr(self._env, f"single_{name}" if name in SPACES else name)

    @property
    def unwrapped(self) -> Self:
        """The row itself."""
        return self

    @property
    def waypoints(self) -> Floats | None:
        """North and east of this episode's path, m, shape (n, 2); None without one."""
        waypoints: Floats | None = self._env.waypoints(self._number)
        return waypoints

    def physical_state(self) -> dict[str, float]:
        """State, set-point and weather by name, SI units (`Engine.physical_state`)."""
        state = self._env.physical_state()
        return {name: float(values[self._number]) for name, values in state.items()}

    def render(self) -> Any:
        """Picture, uint8 array of shape (600, 600, 3); None without a render mode."""
        pictures = self._env.render()
        return None if pictures is None else pictures[self._number]


FIXED = {*SHARED, *SPACES, *(name for name in vars(Row) if not name.startswith("_"))}
