"""Types and annotations of the fields of a task's or sensor set's records."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from shipgym.engine.motion import Ship

#: A last field of `Settings` that holds any number of numbers, and its default, none.
Numbers = NDArray[np.float64]
NO_NUMBERS: Numbers = np.zeros(0)
#: A field of `State` that is a boolean, 1 or 0.
Flag = Annotated[float, bool]
#: Physical value of an observation of 1, or how it follows from ship and settings.
Scale = float | Callable[[Ship, Any], float]


@dataclass(frozen=True)
class ObservationSpec:
    """Bounds, unit and scale of an observation.

    Attributes
    ----------
    low, high : float
        Bounds of the observation.
    unit : str
        Unit of the quantity.
    scale : float or callable
        Physical value of an observation of 1, or `(ship, settings) -> float`.
    option : str
        `roll`, `shaft` or `shaft speed`, which the observation is made for; by default
        it is always made.
    """

    low: float
    high: float
    unit: str = "-"
    scale: Scale = 1.0
    option: str = ""


@dataclass(frozen=True)
class Setting:
    """Bounds of a setting.

    Attributes
    ----------
    about : str
        Its meaning, a sentence.
    at_least, at_most, above : float or None
        Its bounds.
    whole : bool
        Whether it is an integer.
    """

    about: str
    at_least: float | None = None
    at_most: float | None = None
    above: float | None = None
    whole: bool = False
