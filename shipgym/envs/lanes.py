"""The state of many ships by lane: laid out, read, written, copied, taken and put back between two steps."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shipgym.arrays import Floats
from shipgym.checks import check_table, shown
from shipgym.engine.envelope import Envelope
from shipgym.engine.episodes import Rules
from shipgym.engine.motion import Ship
from shipgym.engine.records import LANES, flat, leaves
from shipgym.engine.voyages import Voyages
from shipgym.envs.outputs import STEP_FLAGS, STEP_OUTCOME, OutputPool, Outputs
from shipgym.envs.randomisation import Pool
from shipgym.errors import InputError
from shipgym.sea.weather_column import weather_column
from shipgym.ships import ShipModel
from shipgym.tasks.task import Task
from shipgym.trials.sensors import SEA_TRIAL

#: Settings of a bridge's instruments, and the channel of a sea trial whose noise they
#: take.
SENSOR_NOISE = {"heading": "psi", "yaw_rate": "r", "speed": "u", "position": "x"}


class Lanes:
    """The arrays that loops work on; `Engine` steps them.

    `own` are the lanes' ships and seas, one for all or one each; or, if `drawn`, the
    pool of which each episode draws one.
    """

    shown: Outputs  # what the last step answered

    def __init__(
        self,
        made: Voyages,
        model: ShipModel,
        task: Task,
        num_envs: int,
        own: Pool,
        drawn: bool,
    ) -> None:
        self.model, self.task, self.num_envs = model, task, num_envs
        self.windy, self.dt = made.windy, task.interval(model)
        self._voyages = made  # says where each number stands
        tiles = -(-num_envs // LANES)
        columns = ship_columns(own, self.windy, task, model, drawn)
        self._pool = columns if drawn else np.zeros((0, columns.shape[1]))
        self._ships = ship_tiles(columns, tiles, len(own) > 1)
        plan = int(task.definition.plan_length(task.settings))
        self._states = np.zeros((tiles, (made.state.n_rows + plan) * LANES))
        self._keys = np.zeros(
            (tiles, 3, LANES), dtype=np.uint64
        )  # words of the random numbers
        rules = Rules(
            self.dt,
            task.substeps(model),
            task.episode_steps,
            task.max_envelope_distance,
            task.least_shaft(model),
        )
        noise = {
            field: SEA_TRIAL[channel].noise * task.noise
            for field, channel in SENSOR_NOISE.items()
        }
        sensor = task.sensor_settings or made.sensors.make_settings(
            noise if made.sensors.noise else {}
        )
        self._settings = np.array(
            [*rules, *flat(sensor), *flat(task.settings)], dtype=float
        )
        self.flag_names = [name for name in task.info_names if name in task.flags]
        observed = [quantity.path for quantity in task.observed(model)]
        self._rows = self._shown_rows(observed)
        self._outputs = OutputPool(
            num_envs,
            len(observed),
            STEP_OUTCOME + len(task.info_names),
            STEP_FLAGS + len(self.flag_names),
        )

    def _shown_rows(self, observed: Sequence[str]) -> NDArray[np.int64]:
        """How many observations, outcomes and flags there are, and the offsets of their rows."""
        made = self._voyages
        outcomes = [
            LANES * made.result["outcome"].row(name)
            for name in ("reward", "terminated", "truncated")
        ]
        rows = [
            [LANES * made.result["observation"].row(path) for path in observed],
            [*outcomes, *(made.info_offset(name) for name in self.task.info_names)],
            [*outcomes[1:], *(made.info_offset(name) for name in self.flag_names)],
        ]
        return np.array(
            [*map(len, rows), *(row for kind in rows for row in kind)], dtype=np.int64
        )

    @property
    def episodes(self) -> NDArray[np.uint64]:
        """Number of each lane's episode under its key, shape (num_envs,), a copy."""
        return self._keys[:, 1].reshape(-1)[: self.num_envs].copy()

    @property
    def steps(self) -> Floats:
        """Control intervals of each lane's episode so far, shape (num_envs,), a copy."""
        return self.read("steps")

    def read(self, name: str) -> Floats:
        """One number of the state for each lane by its name (`u`, `delta`, `course`, `steps`), a copy."""
        row = self._voyages.row(name) * LANES
        return self._states[:, row : row + LANES].reshape(-1)[: self.num_envs].copy()

    def write(self, name: str, values: ArrayLike) -> None:
        """Write one number of the state in all lanes: for trials of what might be, see `read`."""
        row = self._voyages.row(name) * LANES
        lanes = self._states[:, row : row + LANES].copy().reshape(-1)
        lanes[: self.num_envs] = values
        self._states[:, row : row + LANES] = lanes.reshape(-1, LANES)

    def physical_state(self) -> dict[str, Floats]:
        """State, course, commands and, unless it is calm, the weather, SI units, each of shape (num_envs,).

        Heading and yaw rate are without the first-order motion in waves, which has
        names of its own, as has the weather (`weather_rows.CHANNEL_NAMES`). `set_point`
        is the heading to steer, rad.
        """
        state = {name: self.read(name) for name in self.model.state_names}
        if "course" in self._voyages.state["state"].present:
            state["set_point"] = self.read("course")
        state["delta_command"] = self.read("rudder_command") * self._ship_row(
            "rudder_limit"
        )
        if "n" in self.model.command_names:
            state["n_command"] = self.read("shaft_command") * self._ship_row("shaft")
        return {**state, **self._weather_now()} if self.windy else state

    def _weather_now(self) -> dict[str, Floats]:
        """What the weather is in each lane, by the names of the channels of trials."""
        roll = ["phi_wave", "p_wave"] if "phi" in self.model.state_names else []
        names = ["psi_wave", "r_wave", *roll, "current_north", "current_east"]
        now = {name: self.read(name) for name in names}
        now["wind_speed"] = self._ship_row("wind_speed") + self.read("gust")
        return {
            **now,
            "wind_from": np.arctan2(self.read("wind_east"), self.read("wind_north")),
        }

    def _ship_row(self, name: str) -> Floats:
        """One number of the ships, or of their sea, for each lane, shape (num_envs,)."""
        layout = self._voyages.ship
        rows = layout["ship"] if name in layout["ship"].present else layout["sea"]
        if self._voyages.shared:
            return np.full(self.num_envs, self._ships[0, rows.row(name)])
        first = rows.row(name) * LANES
        return self._ships[:, first : first + LANES].reshape(-1)[: self.num_envs].copy()

    def waypoints(self, lane: int = 0) -> Floats | None:
        """North and east of the path of a lane's episode, m, shape (n, 2); None where there is none."""
        plan = lanes_of(self._states)[:, self._voyages.state.n_rows :]
        if plan.shape[1] == 0 or "waypoints" not in self.task.definition.settings:
            return None
        tile, lane = divmod(lane, LANES)
        return plan[tile, :, lane].reshape(-1, 2).copy()

    def path_metres(self, name: str) -> float | None:
        """A setting of the path that is in ship lengths, `corridor` or `turn_radius`, m; None without one."""
        lengths = getattr(self.task, name, None)
        return (
            None
            if lengths is None
            else float(lengths * self.model.particulars["length"])
        )

    def get_state(self) -> dict[str, Any]:
        """All that `set_state` needs to go on from here, copies by name."""
        shown, gear = self.shown, self._voyages.state
        rows = [
            f"{name}.{path}"
            for name, place in gear.rows.items()
            for path in place.present
        ]
        made_for = {
            "task": self.task.name,
            "model": self.model.name,
            "num_envs": self.num_envs,
            "rows": rows,
        }
        outputs = {
            name: getattr(shown, name).copy()
            for name in ("observations", "outcomes", "flags")
        }
        return {"made_for": made_for, **self.memory(), **outputs}

    def check_state(self, state: Mapping[str, Any]) -> None:
        """Refuse a state that an engine made alike did not give; InputError says what differs."""
        own = self.get_state()
        check_table(state, "state", tuple(own), required=own)
        made_for = check_table(state["made_for"], "state: made_for")
        for name, expected in own["made_for"].items():
            if (found := made_for.get(name)) != expected:
                raise InputError(
                    f"state: {name} {shown(found)} found, expected {shown(expected)}: a"
                    " state fits an environment made by the same arguments in the same"
                    " version"
                )
        for name, expected in own.items():
            if name != "made_for" and np.shape(state[name]) != np.shape(expected):
                found = f"of shape {np.shape(state[name])}"
                raise InputError(
                    f"state: {name} {found} found, expected {np.shape(expected)}"
                )
        if self._voyages.shared and not np.array_equal(
            state["ships"], self._ships, equal_nan=True
        ):
            raise InputError(
                f"state: of another ship than this {self.model.name!r}, expected the"
                " same"
            )
        lanes = np.moveaxis(lanes_of(state["states"]), 1, 2).reshape(
            -1, len(self._states[0]) // LANES
        )
        for lane, row in np.argwhere(~np.isfinite(lanes[: self.num_envs]))[:1]:
            name = (*own["made_for"]["rows"], *["plan"] * row)[row]
            raise InputError(
                f"state: {name} in row {lane} is not finite, expected a number"
            )
        if not np.isfinite(state["observations"]).all():
            raise InputError("state: observations are not finite, expected numbers")

    def memory(self) -> dict[str, NDArray[Any]]:
        """All that the steps to come depend on beside their commands, copies by name."""
        return {
            "states": self._states.copy(),
            "keys": self._keys.copy(),
            "ships": self._ships.copy(),
        }

    def remember(self, memory: Mapping[str, NDArray[Any]]) -> None:
        """Go on from what `memory` of the same engine, or of one made alike, gave."""
        self._states[:], self._keys[:] = memory["states"], memory["keys"]
        self._ships[:] = memory["ships"]


def lanes_of(tiles: NDArray[Any]) -> NDArray[Any]:
    """Tiles with an axis for their lanes, shape (n_tiles, n_rows, 64), a view."""
    return tiles.reshape(len(tiles), -1, LANES)


def ship_columns(
    pool: Pool, windy: bool, task: Task, base: ShipModel, drawn: bool
) -> Floats:
    """Numbers of ships and of the seas they meet, a row each; the sea worked out once for each kind of ship.

    Ships that are drawn for an episode are seen in the scales of the environment's
    model.
    """
    known: dict[tuple[int, int], Floats] = {}
    columns = []
    for model, sea in pool:
        kind = (id(model.particulars), id(sea))
        if windy and kind not in known:
            known[kind] = weather_column(
                model, sea, task.substep(base), task.water_depth
            )
        numbers = model.ship_numbers(task.water_depth, task.substep(base))
        if drawn and model.particulars["length"] == base.particulars["length"]:
            numbers[Ship._fields.index("scale_speed")] = base.particulars["speed"]
        ship = Ship(*numbers[: len(Ship._fields)].tolist())
        scales = [task.scale(path, ship) for path in task.definition.seen]
        per_scale = [1.0 / scale if scale else 0.0 for scale in scales]
        columns.append(
            [*numbers, *envelope_numbers(model), *known.get(kind, ()), *per_scale]
        )
    return np.stack(columns)


def envelope_numbers(model: ShipModel) -> Floats:
    """The envelope of a model's data in the order of its record; without one everything is inside."""
    if model.envelope is None:
        numbers = np.zeros(len(leaves(Envelope)))
        numbers[:4], numbers[4:8] = -np.inf, np.inf
        return numbers
    data = model.envelope
    return np.concatenate(
        [data.low, data.high, data.centre, data.shape[np.triu_indices(4)]]
    )


def ship_tiles(columns: Floats, tiles: int, own: bool) -> Floats:
    """One vector for all lanes, or a tile for each tile of states."""
    if len(columns) == 1 and not own:
        return columns.copy()
    rest = np.tile(columns[:1], (max(tiles * LANES - len(columns), 0), 1))
    lanes = np.concatenate([columns[: tiles * LANES], rest])
    return np.ascontiguousarray(
        lanes.reshape(tiles, LANES, -1).transpose(0, 2, 1)
    ).reshape(tiles, -1)
