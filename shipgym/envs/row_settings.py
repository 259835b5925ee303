"""Settings of a task for a reset, the same for all rows or one for each."""

from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np

from shipgym.checks import placed, quoted
from shipgym.engine.records import is_list, members
from shipgym.errors import InputError
from shipgym.models import ShipModel
from shipgym.python_files import asked
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


def options_of_rows(
    task: Task,
    given: Sequence[Options],
    n_rows: int,
) -> Options:
    """Options of a reset of all rows, given those of each.

    A row that does not name a setting has that of the task. InputError for options of
    another number than rows, and for those that rows cannot have on their own.
    """
    if len(given) != n_rows:
        raise InputError(
            f"options: expected one dictionary for each of {n_rows} rows, got"
            f" {len(given)}"
        )
    first = given[0]
    if all(options is first for options in given):
        return dict(first)

    own = {}
    for name, kind, _, default in keywords(task.definition.Settings):
        if not is_list(kind):
            own[name] = task.options.get(name, default)

    combined = {}
    for name in dict.fromkeys(chain.from_iterable(given)):
        values = [options.get(name, own.get(name)) for options in given]
        if all(_are_equal(value, values[0]) for value in values):
            combined[name] = values[0]
        elif name in own:
            combined[name] = values
        else:
            raise InputError(
                f"options: {name}: expected the same for all rows, got several; only"
                f" settings may differ: {quoted(own)}"
            )
    return combined


def _are_equal(value: Any, other: Any) -> bool:
    try:
        return bool(value == other)
    except ValueError:  # arrays
        return np.array_equal(value, other)


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
