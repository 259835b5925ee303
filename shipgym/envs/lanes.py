"""State of many ships by lane: layout, reading, writing and copies between steps."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shipgym.arrays import Floats
from shipgym.engine.envelope import Four, Triangle
from shipgym.engine.episode_program import EpisodeProgram
from shipgym.engine.lane_records import Rules
from shipgym.engine.memory import Arguments, allocated, table_in, zeros
from shipgym.engine.motion import Ship
from shipgym.engine.records import LANES, flat, leaves
from shipgym.envs.outputs import ANSWER_FLAGS, ANSWER_OUTCOMES, OutputPool, Outputs
from shipgym.envs.randomisation import Pool
from shipgym.instruments.noise import SEA_TRIAL
from shipgym.models import ShipModel
from shipgym.sea.weather_column import weather_column
from shipgym.tasks.shapes import Shape, shapes_of
from shipgym.tasks.task import Task


class Lanes:
    """The arrays that loops work on; `Engine` steps them.

    Parameters
    ----------
    program : EpisodeProgram
        Layout of the numbers.
    model : ShipModel
        The ship, or the first of them.
    task : Task
    num_envs : int
    own : Pool
        One ship and sea for all lanes or one each, or the pool.
    drawn : bool
        Whether each episode draws a ship and a sea of the pool.
    cut_off : float
        Control intervals after which episodes are truncated.
    """

    outputs: Outputs  # of the last step

    def __init__(
        self,
        program: EpisodeProgram,
        model: ShipModel,
        task: Task,
        num_envs: int,
        own: Pool,
        drawn: bool,
        cut_off: float,
    ) -> None:
        self.program = program
        self.model = model
        self.task = task
        self.num_envs = num_envs
        self.windy = program.sea.windy
        self.dt = task.interval(model)
        self.flag_names = [name for name in task.info_names if name in task.flags]
        self._output_pool = self._pool_of_outputs()

        n_tiles = -(-num_envs // LANES)
        tables = self._allocate(
            **self._filled_tables(own, drawn, n_tiles),
            settings=np.array([self._settings(cut_off)]),
            **self._empty_tables(n_tiles),
            **self._output_rows(),
        )
        self._states = tables["states"]
        self._random = lanes_of(tables["random"])
        self._ships = tables["ships"]
        self._actions = tables["actions"]
        self._chosen = tables["chosen"][0]

    def _pool_of_outputs(self) -> OutputPool:
        """Make the pool of the arrays that steps return."""
        task = self.task
        return OutputPool(
            self.num_envs,
            n_observed=len(task.observed(self.model)),
            n_outcomes=ANSWER_OUTCOMES + len(task.info_names),
            n_flags=ANSWER_FLAGS + len(self.flag_names),
        )

    def _filled_tables(self, own: Pool, drawn: bool, n_tiles: int) -> dict[str, Floats]:
        """Tables of ships, of their pool, and of settings of the task."""
        columns = ship_columns(own, self.windy, self.task, self.model, drawn)
        n_ship_rows = columns.shape[1]
        pool = columns if drawn else np.zeros((0, n_ship_rows))
        return {
            "ships": ship_tiles(columns, n_tiles, len(own) > 1),
            "pool": pool.reshape(1, -1),
            "task_settings": np.array([flat(self.task.settings)]),
        }

    def _empty_tables(self, n_tiles: int) -> dict[str, NDArray[Any]]:
        """Zeros of states, random numbers, results, actions and chosen lanes."""
        program = self.program
        n_plan = int(self.task.definition.plan_length(self.task.settings))
        n_state = program.state_rows.n_rows + n_plan
        n_random = program.random_rows.n_rows
        n_results = program.result_rows.n_rows
        return {
            "states": np.zeros((n_tiles, n_state * LANES)),
            "random": np.zeros((n_tiles, n_random * LANES), dtype=np.uint64),
            "results": np.zeros((1, n_results * LANES)),
            "actions": np.zeros(
                (self.task.n_commands, self.num_envs),
                dtype=np.float32,
            ),
            "chosen": np.zeros((1, self.num_envs), dtype=np.bool_),
        }

    def _allocate(self, **contents: NDArray[Any]) -> dict[str, NDArray[Any]]:
        """Copy tables into one block of memory, for loops; return views of it."""
        n_arguments = len(leaves(Arguments))
        blocks, end = allocated(contents, first=n_arguments)
        arguments = Arguments(**blocks, **self._output_pool.blocks)
        self._memory = zeros(end)
        head = self._memory[:n_arguments].view(np.int64)
        head[:] = flat(arguments)

        tables = {}
        for name, content in contents.items():
            table = table_in(self._memory, blocks[name], content.dtype)
            table[:] = content
            tables[name] = table
        return tables

    def _settings(self, cut_off: float) -> list[float]:
        """Settings of engine and sensor set, one after another."""
        task = self.task
        rules = Rules(
            dt=self.dt,
            substeps=task.substeps(self.model),
            time_limit=task.episode_steps,
            cut_off=min(cut_off, task.episode_steps),
            largest_distance=task.max_envelope_distance,
            least_shaft=task.least_shaft(self.model),
            half_reward_cost=task.half_reward_cost,
            perfect_step=task.definition.perfect_step,
            loss_horizon=task.end_intervals,
        )
        sensors = self.program.sensors
        sensor_settings = task.sensor_settings
        if sensor_settings is None:
            noise = {}
            if sensors.noise:  # in multiples of that of a sea trial's sensors
                noise = {name: task.noise * one for name, one in SEA_TRIAL.items()}
            sensor_settings = sensors.make_settings(noise)
        return [*flat(rules), *flat(sensor_settings)]

    def _output_rows(self) -> dict[str, NDArray[np.int64]]:
        """Entries of a tile's results at which rows of outputs begin, shape (1, n)."""
        rows = self.program.result_rows
        observed = []
        for quantity in self.task.observed(self.model):
            observed.append(rows["observation"].row(quantity.path))
        outcomes = ("reward", "terminated", "truncated")
        answer = [rows["outcome"].row(name) for name in outcomes]
        info = [self.program.info_row(name) for name in self.task.info_names]
        of_results = len(info) - len(self.task.reported)
        names = (*outcomes, *self.task.info_names)
        flags = [*outcomes[1:], *self.flag_names]
        return {
            "observed": _first_entries(observed),
            "informed": _first_entries(answer + info[:of_results]),
            "reported": _first_entries(info[of_results:]),
            "flagged": np.array([[names.index(name) for name in flags]]),
        }

    @property
    def episodes(self) -> NDArray[np.uint64]:
        """Number of each lane's episode under its key, shape (num_envs,), a copy."""
        return self._random[:, 1].reshape(-1)[: self.num_envs].copy()

    @property
    def steps(self) -> Floats:
        """Control intervals of each lane's episode, shape (num_envs,), a copy."""
        return self.read("steps")

    def read(self, name: str) -> Floats:
        """Read one number of the state for each lane, a copy.

        Its name is that of a field of `Motion`, `Commands`, `EpisodeCounters`, the
        state of the task or `Sea`: `u`, `rudder_command`, `steps`.
        """
        lanes = self._row(name).reshape(-1)
        return lanes[: self.num_envs].copy()

    def write(self, name: str, values: ArrayLike) -> None:
        """Write one number of the state in all lanes, see `read`."""
        row = self._row(name)
        lanes = row.copy().reshape(-1)
        lanes[: self.num_envs] = values
        row[:] = lanes.reshape(-1, LANES)

    def _row(self, name: str) -> Floats:
        """One number of the state in all tiles, shape (n_tiles, 64), a view."""
        first = LANES * self.program.row(name)
        return self._states[:, first : first + LANES]

    def physical_state(self) -> dict[str, Floats]:
        """State, set-point, commands and, unless it is calm, weather, in SI units.

        Each is of shape (num_envs,). Heading and yaw rate are without the first-order
        motion in waves, which is named separately, as is the weather
        (`shipgym.engine.trajectories.SeaChannels`). `set_point` is the heading to
        steer, rad.
        """
        state = {name: self.read(name) for name in self.model.state_names}
        if "heading_setpoint" in self.program.state_rows["task_state"].present:
            state["set_point"] = self.read("heading_setpoint")

        rudder_command = self.read("rudder_command")
        state["delta_command"] = rudder_command * self._ship_number("rudder_limit")
        if "n" in self.model.command_names:
            shaft_command = self.read("shaft_command")
            state["n_command"] = shaft_command * self._ship_number("shaft")
        if self.windy:
            state |= self._weather_now()
        return state

    def _weather_now(self) -> dict[str, Floats]:
        """Weather of each lane, by the names of the channels of trials."""
        names = ["psi_wave", "r_wave", "current_north", "current_east"]
        weather = {name: self.read(name) for name in names}

        mean_speed = self._ship_number("wind_speed")
        wind_north = self.read("wind_north")
        wind_east = self.read("wind_east")
        weather["wind_speed"] = mean_speed + self.read("gust")
        weather["wind_from"] = np.arctan2(wind_east, wind_north)
        return weather

    def _ship_number(self, name: str) -> Floats:
        """Number of the ships, or of their sea, for each lane, shape (num_envs,)."""
        layout = self.program.ship_rows
        is_ships = name in layout["ship"].present
        record = "ship" if is_ships else "sea_parameters"
        row = layout[record].row(name)
        if self.program.shared:
            return np.full(self.num_envs, self._ships[0, row])

        lanes = lanes_of(self._ships)[:, row].reshape(-1)
        return lanes[: self.num_envs].copy()

    def waypoints(self, lane: int = 0) -> Floats | None:
        """North and east of the path of a lane's episode, m, shape (n, 2).

        None where there is none.
        """
        if not self.task.follows_path:
            return None
        plans = lanes_of(self._states)[:, self.program.state_rows.n_rows :]
        tile, lane_in_tile = divmod(lane, LANES)
        plan = plans[tile, :, lane_in_tile]
        if len(plan) == 0:
            return None
        return plan.reshape(-1, 2).copy()

    def path_metres(self, name: str) -> float | None:
        """Return a setting of the path that is in ship lengths, in m.

        It is `corridor` or `turn_radius`; None for a task without one.
        """
        lengths = getattr(self.task, name, None)
        if lengths is None:
            return None
        return float(lengths * self.model.particulars["length"])

    def shapes(self, lane: int) -> tuple[Shape, ...]:
        """Shapes that the task has drawn for a lane (`shipgym.tasks.shapes`)."""
        draw = self.task.definition.draw
        if draw is None:
            return ()
        tile, lane_in_tile = divmod(lane, LANES)
        hooks = self.program.hooks
        ships = self._ships[tile % len(self._ships)]
        states = self._states[tile]
        return shapes_of(
            draw,
            hooks["load_motion"](states, lane_in_tile),
            hooks["load_task_state"](states, lane_in_tile),
            hooks["load_ship"](ships, lane_in_tile),
            self.task.settings,
        )

    def get_state(self) -> dict[str, Any]:
        """Return all that `set_state` needs to continue from here, copies by name."""
        return {
            "states": self._states.copy(),
            "random": self._random.copy(),
            "ships": self._ships.copy(),
            "outputs": self.outputs.memory.copy(),
        }


def _first_entries(rows: Sequence[int]) -> NDArray[np.int64]:
    """First entries of rows in a tile, shape (1, n_rows)."""
    return LANES * np.array([rows], dtype=np.int64)


def lanes_of(tiles: NDArray[Any]) -> NDArray[Any]:
    """Tiles with an axis for their lanes, shape (n_tiles, n_rows, 64), a view."""
    return tiles.reshape(len(tiles), -1, LANES)


def ship_columns(
    pool: Pool,
    windy: bool,
    task: Task,
    base: ShipModel,
    drawn: bool,
) -> Floats:
    """Numbers of ships and of the seas around them, a row each.

    The sea is computed once for each kind of ship. Ships that are drawn for an
    episode are seen in the scales of the environment's model.
    """
    step = task.substep(base)
    known: dict[tuple[int, int], Floats] = {}
    columns = []
    for model, sea in pool:
        numbers = model.ship_numbers(task.water_depth, step)
        if drawn and model.particulars["length"] == base.particulars["length"]:
            scale_speed = Ship._fields.index("scale_speed")
            numbers[scale_speed] = base.particulars["speed"]

        kind = (id(model.particulars), id(sea))
        if windy and kind not in known:
            known[kind] = weather_column(model, sea, step, task.water_depth)
        sea_parameters = known.get(kind, np.zeros(0))

        ship = Ship(*numbers[: len(Ship._fields)].tolist())
        factors = _scale_factors(task, ship)
        envelope = envelope_numbers(model)
        columns.append([*numbers, *envelope, *sea_parameters, *factors])
    return np.stack(columns)


def _scale_factors(task: Task, ship: Ship) -> list[float]:
    """Observations of quantities of 1; 0 for those that such a ship does not have."""
    factors = []
    for spec in task.definition.observations.values():
        scale = task.scale_of(
            spec,
            ship,
        )
        factors.append(1.0 / scale if scale else 0.0)
    return factors


def envelope_numbers(model: ShipModel) -> Floats:
    """Numbers of `Envelope` of a model's data; without data everything is inside."""
    data = model.envelope
    if data is not None:
        triangle = data.shape[np.triu_indices(4)]
        return np.concatenate([data.low, data.high, data.centre, triangle])

    n = len(Four._fields)
    return np.repeat([-np.inf, np.inf, 0.0], [n, n, n + len(Triangle._fields)])


def ship_tiles(columns: Floats, tiles: int, own: bool) -> Floats:
    """Return one vector for all lanes, or a tile for each tile of states."""
    if len(columns) == 1 and not own:
        return columns.copy()
    n_lanes = tiles * LANES
    missing = max(n_lanes - len(columns), 0)
    filling = np.tile(columns[:1], (missing, 1))
    lanes = np.concatenate([columns[:n_lanes], filling])
    by_tile = lanes.reshape(tiles, LANES, -1)
    by_row = by_tile.transpose(0, 2, 1)
    return np.ascontiguousarray(by_row).reshape(tiles, -1)
