"""Observations and memories as controllers take them: one row a ship, a single ship without that axis."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shipgym import InputError
from shipgym.tasks.steering import INTEGRAL_ZONE
from shipgym.tasks.task import OBSERVATION_NAMES

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Records = NDArray[np.void]


def records(memory: Floats, record: np.dtype[Any]) -> Records:
    """Memories of ships as records of named numbers, a view: (n, size) as (n,), (size,) as ()."""
    return np.ascontiguousarray(memory).view(record)[..., 0]


def size_of(record: np.dtype[Any]) -> int:
    """How many numbers a record has."""
    return record.itemsize // np.dtype(np.float64).itemsize


def checked_observation(
    observation: ArrayLike, names: Sequence[str], dtype: type[np.generic] = np.float64
) -> NDArray[Any]:
    """Observations as an array of shape (n_ships, n) or (n,), with no fewer than there are names."""
    given, n = np.asarray(observation, dtype=dtype), len(names)
    if given.ndim not in (1, 2) or given.shape[-1] < n:
        raise InputError(
            f"observation: shape {given.shape} found, expected ({n},) or (n, {n}), or"
            f" more: '{names[-1]}' is the last that is needed"
        )
    return given


def checked_starts(starts: Any, shape: tuple[int, ...]) -> Flags:
    """Where episodes begin, one for all ships or one for each, in the shape of the ships; None is nowhere."""
    flags = np.asarray(False if starts is None else starts, dtype=np.bool_)
    n = int(np.prod(shape))
    if flags.size not in (1, n):
        raise InputError(
            f"episode_start: {flags.size} found, expected one for each of {n} ships"
        )
    return np.full(shape, flags.reshape(shape if flags.size == n else ()))


def checked_memory(memory: Any, shape: tuple[int, ...]) -> NDArray[Any]:
    """Return the memory of ships, which must have a shape: not that of other ships or another controller."""
    if np.shape(memory) != shape:
        raise InputError(
            f"state: shape {np.shape(memory)} found, expected {shape}: what the last"
            " predict of as many ships returned, or None where episodes begin"
        )
    return np.asarray(memory)


def begun(
    memory: Any, starts: Any, shape: tuple[int, ...], size: int
) -> tuple[Floats, Flags]:
    """Memory of each ship, a copy with zeros where an episode begins, and where it does.

    `memory`: what the last `predict` returned, shape (*shape, size); None where all
    episodes begin; `starts`: where the memory is that of the episode before; `shape`:
    (n_ships,), or () for a single ship.
    """
    if memory is None:
        return np.zeros((*shape, size)), np.ones(shape, dtype=np.bool_)
    kept = np.array(checked_memory(memory, (*shape, size)), dtype=np.float64, order="C")
    begins = checked_starts(starts, shape)
    kept[begins] = 0.0
    return kept, begins


def heading_error(seen: dict[str, Floats]) -> Floats:
    """Heading error of each ship, rad, in (-pi, pi]."""
    return np.arctan2(seen["heading_error_sin"], seen["heading_error_cos"])


def on_course(
    seen: NDArray[Any], error: Floats, integral: Floats, reach: float
) -> NDArray[np.float32]:
    """Observations of ships with another heading error, rad, and its integral of at most `reach`, rad s."""
    shown = seen.astype(np.float32)
    angle = {"heading_error_sin": np.sin(error), "heading_error_cos": np.cos(error)}
    for name, value in {**angle, "heading_error_integral": integral / reach}.items():
        shown[..., OBSERVATION_NAMES.index(name)] = value
    return shown


def gathered(
    integral: Floats | float,
    error: Floats | float,
    begins: Any,
    dt: float,
    reach: float,
) -> Floats:
    """Integral of the heading error, rad s, an interval later, as environments have it."""
    more = np.where((np.abs(error) > INTEGRAL_ZONE) | begins, 0.0, error * dt)
    return np.clip(integral + more, -reach, reach)


def deviations(seen: dict[str, Floats], rudder: Any, sway: Any) -> Floats:
    """Deviations from straight running, shape (n, 5), in the order of `linear_loop.SIGNALS`."""
    signals = (
        seen["sway"] - sway,
        seen["yaw_rate"],
        heading_error(seen),
        seen["rudder"] - rudder,
        seen["heading_error_integral"],
    )
    return np.stack(signals, axis=-1)
