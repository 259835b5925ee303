"""Episodes compiled for a ship, a sea, a sensor set and a task."""

from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

from shipgym.engine import episodes, sailing, stages, tiles
from shipgym.engine.compiled_ship import CompiledSea, CompiledShip
from shipgym.engine.compiling import compiled, plain_python
from shipgym.engine.envelope import Envelope
from shipgym.engine.lane_records import (
    CONSTRAINT,
    Commands,
    EpisodeCounters,
    Outcome,
    Random,
    Rules,
    SeaRandom,
)
from shipgym.engine.memory import Arguments
from shipgym.engine.motion import Motion, Ship
from shipgym.engine.record_code import clipped_storer, loader, storer, summed, zeros
from shipgym.engine.records import LANES, Layout
from shipgym.engine.specialise import is_plain, takes_entries, users_functions


@dataclass(frozen=True, eq=False)
class EpisodeProgram:
    """Episodes of one task with ships that differ in numbers only.

    Attributes
    ----------
    ship : CompiledShip
    sea : CompiledSea
    task : shipgym.tasks.definition.TaskDefinition
    sensors : shipgym.instruments.sensor_set.SensorSet
    shared : bool
        Whether all lanes have the same ship and sea.
    checked : bool
        Whether users' functions are compiled with checks of indices and divisors.
    """

    ship: CompiledShip
    sea: CompiledSea
    task: Any
    sensors: Any
    shared: bool
    checked: bool = True

    @cached_property
    def state_rows(self) -> Layout:
        """Rows of a tile of states; behind them the plan of an episode."""
        return Layout(
            motion=(Motion, self.ship.state_names),
            sea=self.sea.state,
            commands=Commands,
            counters=EpisodeCounters,
            memory=self.sensors.Memory,
            task_state=self.task.State,
        )

    @cached_property
    def result_rows(self) -> Layout:
        """Rows of the results of an interval in one tile."""
        return Layout(
            outcome=Outcome,
            reward=self.task.Reward,
            observation=self.task.Observation,
            **(stages.BETWEEN_STAGES if self.ship.staged else {}),
        )

    @cached_property
    def ship_rows(self) -> Layout:
        """Rows of the numbers of a ship."""
        return Layout(
            ship=Ship,
            coefficients=self.ship.coefficients,
            envelope=Envelope,
            sea_parameters=self.sea.parameters,
            scale=self.task.Observation,
        )

    @cached_property
    def random_rows(self) -> Layout:
        """Rows of a tile of random numbers."""
        return Layout(random=Random, sea_random=SeaRandom)

    def row(self, name: str) -> int:
        """Row of a number of the state by its name: `u`, `course`, `steps`."""
        for record in ("motion", "commands", "counters", "task_state", "sea"):
            rows = self.state_rows[record]
            if name in rows.present:
                return rows.row(name)
        raise KeyError(name)

    def info_row(self, name: str) -> int:
        """Row of an entry of `info` among the results, or the states."""
        rows = self.result_rows
        part = name.removeprefix("reward_")
        constraint = name.removeprefix(CONSTRAINT)
        if name in self.task.reported or constraint != name:
            return self.state_rows["task_state"].row(constraint)
        if name in Outcome._fields or part == "end":
            return rows["outcome"].row(part)
        parts = self.task.reward_names
        number: int = parts.index(part)
        return rows["reward"].first + number

    @cached_property
    def hooks(self) -> dict[str, Any]:
        """Functions and values for the hooks and constants of loops, by name."""
        of_ships = 1 if self.shared else LANES
        settings = Layout(rules=Rules, sensor_settings=self.sensors.Settings)
        return {
            "GROUP": 1 if plain_python() else tiles.GROUP,
            "SHARED_SHIP": self.shared,
            "CHECKED": self.checked,
            "MAY_FAIL": self.checked and self._may_fail,
            "PLAN_ROW": self.state_rows.n_rows,
            **_loaders(self.state_rows, LANES),
            **_storers(self.state_rows),
            **_loaders(self.result_rows, LANES),
            **_storers(self.result_rows),
            **_loaders(self.random_rows, LANES),
            **_storers(self.random_rows),
            **_loaders(self.ship_rows, of_ships),
            **_loaders(settings, 1),
            **_loaders(Layout(task_settings=self.task.Settings), 1),
            **_loaders(Layout(arguments=Arguments), 1),
            **self._task_hooks(),
            "measure": self.sensors.measure,
            "readings": self.sensors.readings,
            "HAS_NOISE": self.sensors.noise,
            "HAS_FILTER": self.sensors.filter,
            "sail_lanes": sailing.sail_in_one_loop,
            **self.ship.hooks(shared=self.shared),
            **self.ship.staged,
            **self.sea.functions,
        }

    @cached_property
    def users_code(self) -> frozenset[Any]:
        """Functions of users that the loop is made of."""
        found = set()
        for function in self.hooks.values():
            if is_plain(function):
                found |= users_functions(function, {})
        return frozenset(found)

    @cached_property
    def _may_fail(self) -> bool:
        """Whether a function that each interval calls takes entries of arrays."""
        task = self.task
        asked = (
            task.step,
            task.observe,
            task.due,
            task.worst_cost,
        )
        sensors = (self.sensors.measure, self.sensors.readings)
        return any(takes_entries(one, {}) for one in (*asked, *sensors))

    def _task_hooks(self) -> dict[str, Any]:
        """Functions of the task, and what its records are used for."""
        task = self.task
        return {
            "task_begin": task.begin,
            "task_step": task.step,
            "observe": task.observe,
            "due": task.due,
            "on_event": task.on_event,
            "worst_cost": task.worst_cost,
            "no_reward": zeros(task.Reward),
            "total_reward": summed(task.Reward),
            "store_observation": clipped_storer(
                self.result_rows["observation"],
                {path: (one.low, one.high) for path, one in task.observations.items()},
            ),
        }

    @cached_property
    def run(self) -> Any:
        """The loop `shipgym.engine.episodes.run`."""
        what = f"{self.task.name} for {self.ship.name!r}"
        return compiled(episodes.run, episodes.SIGNATURE, self.hooks, what)


episode_program = cache(EpisodeProgram)  # compiled once in a process


def _loaders(layout: Layout, lanes: int) -> dict[str, Any]:
    """Functions that load the records of a layout, by the names of hooks."""
    return {f"load_{name}": loader(rows, lanes) for name, rows in layout.rows.items()}


def _storers(layout: Layout) -> dict[str, Any]:
    """Functions that store the records of a layout, by the names of hooks."""
    return {f"store_{name}": storer(rows) for name, rows in layout.rows.items()}
