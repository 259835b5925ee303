"""A current that differs from place to place, by a function in a Python file."""

from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np

from shipgym.checks import check_text
from shipgym.errors import InputError
from shipgym.python_files import check_function, load_file, place_of, refuse_closure
from shipgym.refused_code import refuse_foreign_random


@dataclass(frozen=True)
class CurrentField:
    """A current by place: the function `current(x, y)` of a Python file.

    It returns the north and east component, m/s, at a place north and east of the
    origin, m, and is compiled into the loop over ships. In a file it may call functions
    of `math`, and those of `shipgym.tasks.contract`; it chooses by `pick` or a
    conditional expression. Environments alone know such a current.

    Raises InputError for a file without such a function.

    Parameters
    ----------
    file : str or Path
        The Python file.
    """

    file: str | Path

    def __post_init__(self) -> None:
        path = Path(check_text(str(self.file), "current file")).resolve()
        object.__setattr__(self, "file", str(path))
        what = "a function current(x, y) -> (north, east), m/s"
        found = getattr(load_file(path, f"a Python file with {what}"), "current", None)
        if found is None:
            raise InputError(f"{path}: expected {what}, got no 'current'")
        check_function(found, 2, f"{path}: current", what)
        refuse_closure(found)
        refuse_foreign_random(found)
        self._refuse_infinite(found)

    def _refuse_infinite(self, current: Any) -> None:
        """Refuse a current that is no number at the origin, where ships begin."""
        try:
            at_origin = current(0.0, 0.0)
            flow = np.asarray(at_origin, dtype=np.float64)
        except ArithmeticError as error:
            why = f"{type(error).__name__}: {error} at x = 0 and y = 0"
            raise InputError(f"{place_of(current, error)}: {why}") from None
        except (TypeError, ValueError):
            return  # refused with line and reason where it is compiled
        if flow.shape == () or (flow.shape == (2,) and np.isfinite(flow).all()):
            return
        raise InputError(
            f"{place_of(current)}: expected two finite numbers, m/s, at x = 0 and"
            f" y = 0, got {at_origin}"
        )

    @cached_property
    def function(self) -> Any:
        """Function of place and settings of a task, for loops."""
        return current_by_place(vars(load_file(Path(self.file)))["current"])

    @property
    def calm(self) -> bool:
        """False: water flows somewhere."""
        return False


def current_of_file(x: float, y: float) -> Any:
    """Hook: `current` of the file."""
    raise NotImplementedError("filled by `current_by_place`")


def without_settings(x: float, y: float, settings: Any) -> Any:
    """Current of a file that knows nothing of the task."""
    return current_of_file(x, y)


@cache
def current_by_place(function: Any) -> Any:
    """Return the function of a task's current that calls that of a file."""
    hooks = {"__name__": __name__, "current_of_file": function}
    return FunctionType(without_settings.__code__, hooks, "without_settings")


def function_of_file(function: Any) -> Any:
    """Return the function of a file that a current calls, or itself."""
    return function.__globals__.get("current_of_file", function)
