"""A ship as loops take her: her functions, what she has, and where her numbers stand."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any

from shipgym.engine.motion import Motion, Ship
from shipgym.engine.places import load_coefficients, load_ship
from shipgym.engine.record_code import loader, row_reader, storer
from shipgym.engine.records import LANES, Layout, Record, Rows
from shipgym.engine.specialise import Part


@dataclass(frozen=True, eq=False)
class Vessel:
    """What is compiled of a ship; ships that share it differ in numbers only."""

    name: str  # for messages
    state_names: tuple[str, ...]  # numbers of `Motion` that she has, in its order
    coefficients: Record  # `NamedTuple` of the numbers that her functions read
    # Parts or other globals: `accelerations`, `shaft_acceleration`, and what these name
    # in turn
    functions: Mapping[str, Any]
    lag: bool  # whether her steering gear has a time constant
    # of a ship part of whose accelerations is a sum over a table: Parts that take the
    # place of her functions where many ships are sailed (`shipgym.engine.stages`)
    summed: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def motion(self) -> Rows:
        """Rows of her state."""
        return Rows(Motion, 0, self.state_names)

    @cached_property
    def layout(self) -> Layout:
        """Rows of her numbers: `Ship`, then her coefficients."""
        return Layout(ship=Ship, coefficients=self.coefficients)

    def parts(self, lanes: int = LANES, shared: bool = True) -> dict[str, Any]:
        """What takes the place of the globals of `shipgym.engine.motion` and of the loops.

        `lanes` are those of a tile of states, 64, or 1 where states are vectors. With
        `shared` all lanes have the same ship: her numbers are a vector and not a tile.
        """
        of_ships = 1 if shared else LANES
        return {
            **self.functions,
            "HAS_ROLL": "phi" in self.state_names,
            "HAS_SHAFT": "n" in self.state_names,
            "HAS_MEMORY": "q" in self.state_names,
            "HAS_LAG": self.lag,
            "HAS_SEA": False,
            "load_motion": loader(self.motion, lanes),
            "store_motion": storer(self.motion, lanes),
            **{
                f"load_{name}": loader(rows, of_ships)
                for name, rows in self.layout.rows.items()
            },
            "row_of": row_reader(of_ships),
            "common_ship": Part(read_ship if shared else nothing),
            "ship_at": Part(the_common if shared else ship_of_lane),
        }


@cache
def vessel_of(
    name: str,
    state_names: tuple[str, ...],
    coefficients: Record,
    functions: tuple[tuple[str, Any], ...],
    lag: bool,
    summed: tuple[tuple[str, Any], ...] = (),
) -> Vessel:
    """The one vessel of these fields, so that what is compiled for one ship serves all that are like her."""
    return Vessel(name, state_names, coefficients, dict(functions), lag, dict(summed))


def read_ship(ships: Any) -> Any:
    """Ship and coefficients of one ship, or of all lanes, read once before a loop."""
    return load_ship(ships, 0), load_coefficients(ships, 0)


def the_common(common: Any, ships: Any, lane: int) -> Any:
    """The ship that was read before the loop."""
    return common


def nothing(ships: Any) -> int:
    """Nothing is common to all lanes."""
    return 0


def ship_of_lane(common: Any, ships: Any, lane: int) -> Any:
    """Ship and coefficients of one lane."""
    return load_ship(ships, lane), load_coefficients(ships, lane)
