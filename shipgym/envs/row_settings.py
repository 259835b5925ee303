"""Settings of a task for a reset, the same for all rows or one for each."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from shipgym.checks import placed
from shipgym.engine.records import is_list, members
from shipgym.errors import InputError
from shipgym.python_files import asked
from shipgym.ships import ShipModel
from shipgym.tasks.definition import TaskDefinition
from shipgym.tasks.source import keywords
from shipgym.tasks.task import Task

Options = dict[str, Any]


def parted(
    definition: TaskDefinition,
    options: Mapping[str, Any],
    n_rows: int,
) -> tuple[Options, Options]:
    """Settings that all rows share, and those with one more axis, of the rows.

    InputError if that axis has not one entry for each row.
    """
    kinds = {name: kind for name, kind, *_ in keywords(definition.Settings)}
    shared = {}
    by_row = {}
    for name, value in options.items():
        kind = kinds[name]
        if is_list(kind) or _axes_of(value) <= _depth(kind):
            shared[name] = value
            continue
        if len(value) != n_rows:
            raise InputError(
                f"options: {name}: expected one value for all rows, or one for each of"
                f" {n_rows}, got {len(value)}"
            )
        by_row[name] = value
    return shared, by_row


def _depth(kind: Any) -> int:
    """Axes of a setting: 0 of a number, 1 of an array of numbers."""
    depths = [_depth(part) for _, part in members(kind)]
    return 1 + max(depths) if depths else 0


def _axes_of(value: Any) -> int:
    try:
        return int(np.ndim(value))
    except ValueError:  # ragged
        return 0


def row_settings(
    task: Task,
    model: ShipModel,
    by_row: Options,
    n_rows: int,
) -> Sequence[Any] | None:
    """Settings of the task in each row; None if all rows share them.

    Raises InputError for a value that does not fit, naming the row, and for plans of
    several lengths.
    """
    if not by_row:
        return None
    definition = task.definition
    own = {}
    for name, value in task.options.items():
        if name in definition.settings:
            own[name] = value

    rows = []
    length = definition.plan_length(task.settings)
    for row in range(n_rows):
        values = {name: value[row] for name, value in by_row.items()}
        with placed(f"options: row {row}"):
            settings = definition.make_settings({**own, **values})
            asked(definition.check, settings, model)
        if asked(definition.plan_length, settings) != length:
            raise InputError(
                f"options: row {row}: expected plans of one length, {length}, got"
                f" another; give {', '.join(by_row)} for all rows"
            )
        rows.append(settings)
    return rows
