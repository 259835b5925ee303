"""The rule that the file of a task may define, as a policy."""

from typing import Any

import numpy as np

from agents.controllers.memory import from_columns
from shipgym.engine.records import leaves
from shipgym.errors import InputError
from shipgym.models import ShipModel
from shipgym.python_files import asked
from shipgym.ships.manoeuvring_model import ship_of
from shipgym.tasks.task import Task


class TaskRule:
    """Steers by `rule(seen, ship, settings)` of a task's file, asked ship by ship.

    Raises InputError if the file defines none, or if it returns other numbers than the
    task commands.

    Parameters
    ----------
    task : Task
        The task, with the settings that its rule is given.
    model : ShipModel
        Her particulars are given to the rule.
    """

    def __init__(self, task: Task, model: ShipModel) -> None:
        definition = task.definition
        if definition.rule is None:
            raise InputError(
                f"{definition.source}: expected a function rule(seen, ship, settings)"
                " as a yardstick, got none; write one, or leave 'rule' out"
            )
        self.task = task
        self.rule = definition.rule
        self.ship = ship_of(model, task.water_depth)
        self.shown = task.observed(model)

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Any, Any]:
        """Return the commands of the rule, as `Policy.predict` does; no memory."""
        observations = np.asarray(observation, dtype=np.float64)
        rows = np.atleast_2d(observations)
        commands = np.array(
            [self._command(row) for row in rows],
            dtype=np.float32,
        )
        limited = np.clip(commands, -1.0, 1.0)
        return limited.reshape(*observations.shape[:-1], -1), state

    def _command(self, row: Any) -> Any:
        """Return the command for one ship, shape (n_commands,)."""
        record = self.task.definition.Observation
        numbers = dict.fromkeys(leaves(record), 0.0)  # of those that are not shown
        for quantity, value in zip(self.shown, row, strict=True):
            numbers[quantity.path] = float(value) * quantity.scale
        seen = from_columns(record, iter(numbers.values()))
        command = asked(self.rule, seen, self.ship, self.task.settings)
        numbers_of = np.atleast_1d(np.asarray(command, dtype=np.float64))
        if numbers_of.shape != (self.task.n_commands,):
            raise InputError(
                f"{self.task.definition.source}: rule: expected"
                f" {self.task.n_commands} numbers in [-1, 1], got {command!r}"
            )
        return numbers_of
