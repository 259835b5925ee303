"""The loops by name, compiled for a ship when they are first asked for."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from shipgym.engine import batches, trajectories
from shipgym.engine.compiling import compiled
from shipgym.engine.records import LANES
from shipgym.engine.specialise import Part
from shipgym.engine.vessel import Vessel
from shipgym.sea.open_sea import sea_parts

VECTOR, TABLE = "float64[::1]", "float64[:, ::1]"
SEA = f"{VECTOR}, uint64[::1], {VECTOR}"  # state, random numbers, parameters


@dataclass(frozen=True)
class Loop:
    """A loop as it is compiled."""

    function: Callable[..., Any]  # a plain Python function on arrays
    signature: str  # of its arguments, as Numba writes it
    lanes: int = 1  # of a tile of states: 64, or 1 where states are vectors
    shared: bool = (
        True  # whether there is one ship only, so that her numbers are a vector
    )
    parts: Mapping[str, Any] = field(
        default_factory=dict
    )  # beside the ship's and the sea's


MEASURED_GEAR = {"HAS_LAG": False}
LOOPS = {
    "derivatives": Loop(
        trajectories.derivatives, f"void({TABLE}, {TABLE}, {VECTOR}, {VECTOR}, {TABLE})"
    ),
    "meet": Loop(trajectories.meet, f"void({TABLE}, {SEA})"),
    "simulate": Loop(
        trajectories.simulate, f"int64({TABLE}, {TABLE}, float64, {SEA}, {VECTOR})"
    ),
    "open_loop": Loop(
        trajectories.open_loop,
        f"int64({TABLE}, {VECTOR}, {VECTOR}, {VECTOR}, {TABLE}, float64, {VECTOR})",
        parts=MEASURED_GEAR,
    ),
    "zigzag": Loop(
        trajectories.zigzag,
        f"UniTuple(int64, 2)({TABLE}, {VECTOR}, {', '.join(4 * ['float64'])}, boolean,"
        f" {SEA}, {VECTOR})",
        parts={"advanced": Part(trajectories.advanced, inline=False)},
    ),
    "steer_rate": Loop(
        trajectories.steer_rate,
        f"int64({TABLE}, {VECTOR}, {VECTOR}, {', '.join(5 * ['float64'])}, {SEA},"
        f" {VECTOR})",
    ),
    "segments": Loop(
        batches.sail_segment,
        f"void({VECTOR}, {VECTOR}, {VECTOR}, {TABLE}, int64[::1], {TABLE})",
        LANES,
        shared=False,
        parts=MEASURED_GEAR,
    ),
    "fleet": Loop(batches.advance_batch, batches.SIGNATURE, LANES, shared=False),
    "alike": Loop(batches.advance_batch, batches.SIGNATURE, LANES),
}


@cache
def ship_loop(vessel: Vessel, name: str, windy: bool = False) -> Any:
    """A loop of `LOOPS` for a ship in calm water or in the open sea; see `compiled`."""
    loop = LOOPS[name]
    parts = {
        **vessel.parts(loop.lanes, loop.shared),
        **sea_parts(windy, loop.lanes),
        **loop.parts,
    }
    where = "in the open sea" if windy else "in calm water"
    return compiled(
        loop.function, loop.signature, parts, f"{vessel.name} {where}: {name}"
    )
