"""Loops over ships without a task, compiled for a ship at the first call."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from shipgym.engine import batches, steered, trajectories
from shipgym.engine.compiled_ship import STILL_WATER, CompiledSea, CompiledShip
from shipgym.engine.compiling import compiled, plain
from shipgym.engine.lane_records import SeaChannels
from shipgym.engine.record_code import storer
from shipgym.engine.records import LANES, Rows
from shipgym.engine.trajectories import SEA_CHANNELS

VECTOR = "float64[::1]"
TABLE = "float64[:, ::1]"
SEA = f"{VECTOR}, uint64[::1], {VECTOR}"  # state, random numbers, parameters


@dataclass(frozen=True)
class Loop:
    """A loop as it is compiled."""

    function: Callable[..., Any]  # a plain Python function on arrays
    signature: str  # of its arguments, as Numba writes it
    lanes: int = 1  # of a tile of states: 64, or 1 where states are vectors
    # whether there is one ship only, so that her numbers are a vector
    shared: bool = True
    # hooks and constants besides those of the ship and the sea
    hooks: Mapping[str, Any] = field(default_factory=dict)


MEASURED_GEAR = {"HAS_LAG": False}
LOOPS = {
    "derivatives": Loop(
        trajectories.derivatives, f"void({TABLE}, {TABLE}, {VECTOR}, {TABLE})"
    ),
    "sample_sea": Loop(trajectories.sample_sea, f"void({TABLE}, {SEA})"),
    "simulate": Loop(
        trajectories.simulate, f"int64({TABLE}, {TABLE}, float64, {SEA}, {VECTOR})"
    ),
    "open_loop": Loop(
        trajectories.open_loop,
        f"int64({TABLE}, {VECTOR}, {VECTOR}, {VECTOR}, {TABLE}, float64, {VECTOR})",
        hooks=MEASURED_GEAR,
    ),
    "zigzag": Loop(
        steered.zigzag,
        f"UniTuple(int64, 2)({TABLE}, {VECTOR}, float64, float64, float64, float64,"
        f" boolean, {SEA}, {VECTOR})",
    ),
    "segments": Loop(
        batches.sail_segment,
        f"void({VECTOR}, {VECTOR}, {TABLE}, int64[::1], {TABLE})",
        LANES,
        shared=False,
        hooks=MEASURED_GEAR,
    ),
}


@cache
def ship_loop(ship: CompiledShip, name: str, sea: CompiledSea = STILL_WATER) -> Any:
    """Compile a loop of `LOOPS` for a ship, by default in still water."""
    loop = LOOPS[name]
    where = "in the open sea" if sea.windy else "in calm water"
    return compiled(
        loop.function,
        loop.signature,
        _hooks(ship, loop, sea),
        what=f"{ship.name} {where}: {name}",
    )


@cache
def plain_loop(ship: CompiledShip, name: str) -> Any:
    """Return a loop of `LOOPS` for a ship in still water, in plain Python."""
    loop = LOOPS[name]
    return plain(loop.function, _hooks(ship, loop, STILL_WATER))


def _hooks(ship: CompiledShip, loop: Loop, sea: CompiledSea) -> dict[str, Any]:
    """Functions and values for the hooks of a loop, by name."""
    channels = Rows(SeaChannels, len(ship.state_names), SEA_CHANNELS)
    return {
        **ship.hooks(loop.lanes, loop.shared),
        **sea.hooks(loop.lanes),
        "store_sea_channels": storer(channels, 1),
        **loop.hooks,
    }
