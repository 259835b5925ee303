"""Episodes compiled for a ship, a sea, a sensor set and a task: where their numbers stand, and the loops."""

from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

from shipgym.engine import episodes, stages
from shipgym.engine.addresses import plan_at
from shipgym.engine.compiling import compiled, plain_python
from shipgym.engine.envelope import Envelope
from shipgym.engine.motion import Motion, Ship
from shipgym.engine.places import load_envelope, load_scale, load_sea_parameters
from shipgym.engine.record_code import (
    bounded_storer,
    chooser,
    loader,
    number_storer,
    storer,
    summer,
    zero,
)
from shipgym.engine.records import LANES, Layout, leaves
from shipgym.engine.specialise import Part
from shipgym.engine.vessel import Vessel, nothing, the_common
from shipgym.instruments.sensor_set import SensorSet
from shipgym.sea import open_sea
from shipgym.tasks.definition import TaskDefinition

#: Functions of `episodes` that loops call; others become part of them.
CALLED = (
    "begin_lane",
    "begin_next",
    "let_events_come",
    "observe_lane",
    "show",
    "take_commands",
    "sail_lanes",
    "conclude_lanes",
)


@dataclass(frozen=True, eq=False)
class Voyages:
    """Episodes of one task with ships that differ in numbers only."""

    vessel: Vessel
    task: TaskDefinition
    sensors: SensorSet
    windy: bool  # whether there is current, wind or waves
    shared: bool  # whether all lanes have the same ship and sea

    @cached_property
    def state(self) -> Layout:
        """Rows of a tile of states; behind them the plan of an episode."""
        return Layout(
            motion=(Motion, self.vessel.state_names),
            sea=open_sea.sea_records(self.windy)[0],
            course=episodes.Course,
            memory=self.sensors.Memory,
            state=self.task.State,
        )

    @cached_property
    def result(self) -> Layout:
        """Rows of what comes of an interval in one tile."""
        seen = {
            "outcome": episodes.Outcome,
            "reward": self.task.Reward,
            "observation": self.task.Observation,
        }
        return Layout(**seen, **(stages.ROOM if self.vessel.summed else {}))

    @cached_property
    def ship(self) -> Layout:
        """Rows of the numbers of a ship."""
        return Layout(
            ship=Ship,
            coefficients=self.vessel.coefficients,
            envelope=Envelope,
            sea=open_sea.sea_records(self.windy)[1],
            scale=self.task.Observation,
        )

    @cached_property
    def settings(self) -> Layout:
        """Places of the settings of engine, sensor set and task."""
        return Layout(
            rules=episodes.Rules, sensor=self.sensors.Settings, task=self.task.Settings
        )

    def row(self, name: str) -> int:
        """Row of a number of the state by its name: `u`, `course`, `steps`."""
        for record in ("motion", "course", "state", "sea"):
            if name in self.state[record].present:
                return self.state[record].row(name)
        raise KeyError(name)

    def info_offset(self, name: str) -> int:
        """Where an entry of `info` stands: the offset of its row in the result, or in the state."""
        if name in self.task.reported:
            return episodes.OF_STATE + LANES * self.state["state"].row(name)
        part = name.removeprefix("reward_")
        if name in episodes.Outcome._fields or part == "end":
            return LANES * self.result["outcome"].row(part)
        paths = {path.rpartition(".")[2]: path for path in leaves(self.task.Reward)}
        return LANES * self.result["reward"].row(paths[part])

    @cached_property
    def parts(self) -> dict[str, Any]:
        """What takes the place of the globals of `shipgym.engine.episodes`."""
        return {
            **self._records(),
            **self._ships(),
            **self._functions(),
            **self.vessel.summed,
        }

    def _records(self) -> dict[str, Any]:
        rows, result = self.state, self.result
        made: dict[str, Any] = {}
        for name, place in (rows.rows | result.rows).items():
            made[f"load_{name}"], made[f"store_{name}"] = loader(place), storer(place)
        for name in ("motion", "sea", "state", "memory"):
            # most of a task's state stays as it is
            made[f"choose_{name}"] = chooser(rows[name].record, stored=name != "state")
        made["choose_reward"] = chooser(self.task.Reward)
        bounds = {path: (seen.low, seen.high) for path, seen in self.task.seen.items()}
        settings = self.settings
        return made | {
            "store_ended": number_storer(rows["course"].row("ended")),
            "store_ran_away": number_storer(rows["course"].row("ran_away")),
            "store_observation": bounded_storer(result["observation"], bounds),
            "no_reward": zero(self.task.Reward),
            "total_reward": summer(self.task.Reward),
            "read_rules": loader(settings["rules"], 1),
            "read_sensor": loader(settings["sensor"], 1),
            "read_settings": loader(settings["task"], 1),
            "plan_of": plan_at(rows.n_rows),
        }

    def _ships(self) -> dict[str, Any]:
        lanes = 1 if self.shared else LANES
        load = {name: loader(place, lanes) for name, place in self.ship.rows.items()}
        return {
            **self.vessel.parts(shared=self.shared),
            "load_envelope": load["envelope"],
            "load_scale": load["scale"],
            "load_sea_parameters": load["sea"],
            "common_sea": Part(read_sea if self.shared else nothing),
            "sea_at": Part(the_common if self.shared else sea_of_lane),
            "common_view": Part(read_view if self.shared else nothing),
            "view_at": Part(the_common if self.shared else view_of_lane),
        }

    def _functions(self) -> dict[str, Any]:
        task, sensors = self.task, self.sensors
        return {
            name: Part(getattr(episodes, name), inline=False) for name in CALLED
        } | {
            **open_sea.sea_functions(self.windy),
            "GROUP": 1 if plain_python() else episodes.GROUP,
            "HAS_NOISE": self.sensors.noise,
            "HAS_FILTER": self.sensors.filter,
            "measure": Part(sensors.measure),
            "readings": Part(sensors.readings),
            "task_begin": Part(task.begin, inline=False),
            "on_event": Part(task.on_event, inline=False),
            "task_step": Part(task.step),
            "observe": Part(task.observe),
            "due": Part(task.due),
            "worst_cost": Part(task.worst_cost),
        }

    @cached_property
    def run(self) -> Any:
        """The loop `shipgym.engine.episodes.run`."""
        what = f"{self.task.name} for {self.vessel.name!r}"
        return compiled(episodes.run, episodes.SIGNATURE, self.parts, what)


def read_sea(ships: Any) -> Any:
    """The sea of all lanes, read once before a loop."""
    return load_sea_parameters(ships, 0)


def sea_of_lane(common: Any, ships: Any, lane: int) -> Any:
    """The sea of one lane."""
    return load_sea_parameters(ships, lane)


def read_view(ships: Any) -> Any:
    """Envelope and scales of observations of all lanes, read once before a loop."""
    return load_envelope(ships, 0), load_scale(ships, 0)


def view_of_lane(common: Any, ships: Any, lane: int) -> Any:
    """Envelope and scales of observations of one lane."""
    return load_envelope(ships, lane), load_scale(ships, lane)


voyages = cache(Voyages)  # compiled once in a process
