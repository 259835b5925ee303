"""Ship as loops take her: her functions, equipment, and the layout of her numbers."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any

from shipgym.engine.motion import Motion, Ship
from shipgym.engine.record_code import loader, storer
from shipgym.engine.records import LANES, Layout, Record, Rows


@dataclass(frozen=True, eq=False)
class CompiledShip:
    """Compiled functions of a ship; ships that share them differ in numbers only.

    Attributes
    ----------
    name : str
        For messages.
    state_names : tuple of str
        Numbers of `Motion` that she has, in its order.
    coefficients : Record
        `NamedTuple` of the numbers that her functions read.
    functions : mapping
        Hooks by name: `accelerations`, `shaft_acceleration`, and functions and numbers
        that these name in turn.
    lag : bool
        Whether her steering gear has a time constant.
    staged : mapping
        Hooks of `shipgym.engine.stages`, of a ship part of whose accelerations is a sum
        over a table: they replace her functions where many ships are simulated.
    """

    name: str
    state_names: tuple[str, ...]
    coefficients: Record
    functions: Mapping[str, Any]
    lag: bool
    staged: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def motion(self) -> Rows:
        """Rows of her state."""
        return Rows(Motion, 0, self.state_names)

    @cached_property
    def layout(self) -> Layout:
        """Rows of her numbers: `Ship`, then her coefficients."""
        return Layout(ship=Ship, coefficients=self.coefficients)

    def hooks(self, lanes: int = LANES, shared: bool = True) -> dict[str, Any]:
        """Return the hooks that she gives, by name.

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
            "load_ship": loader(self.layout["ship"], of_ships),
            "load_coefficients": loader(self.layout["coefficients"], of_ships),
        }


@cache
def compiled_ship(
    name: str,
    state_names: tuple[str, ...],
    coefficients: Record,
    functions: tuple[tuple[str, Any], ...],
    lag: bool,
    staged: tuple[tuple[str, Any], ...] = (),
) -> CompiledShip:
    """Return the one `CompiledShip` of these fields.

    Code compiled for one ship thus serves all ships like her.
    """
    return CompiledShip(
        name, state_names, coefficients, dict(functions), lag, dict(staged)
    )
