"""Ship and sea as loops take them: their functions, and the layout of their numbers."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any, NamedTuple

from shipgym.engine.motion import CALM, Motion, Push, Ship
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


@dataclass(frozen=True, eq=False)
class CompiledSea:
    """Records and functions of a sea.

    Attributes
    ----------
    state, parameters : Record, or pair of a Record and the paths that have a row
        For a `Layout`.
    functions : mapping
        Hooks by name: `push`, `evolve`, `begin_sea`, `encounter_frequency`, and the
        constant `HAS_SEA`.
    """

    state: Any
    parameters: Any
    functions: Mapping[str, Any]

    @property
    def windy(self) -> bool:
        """Whether there is current, wind or waves."""
        return bool(self.functions["HAS_SEA"])

    def hooks(self, lanes: int) -> dict[str, Any]:
        """Return the hooks that it gives; `lanes` are those of a tile of states."""
        rows = Layout(sea=self.state)["sea"]
        return {
            **self.functions,
            "load_sea": loader(rows, lanes),
            "store_sea": storer(rows, lanes),
            "load_sea_parameters": loader(Layout(sea=self.parameters)["sea"], 1),
        }


class NoNumbers(NamedTuple):
    """State and parameters of still water."""

    unused: float


def no_push(motion: Motion, sea: Any, p: Any) -> Push:
    """Still water pushes nobody."""
    return CALM


def unchanged(motion: Motion, h: float, sea: Any, word: Any, p: Any) -> Any:
    """Still water stays so."""
    return sea


#: Water of a loop that knows no sea.
STILL_WATER = CompiledSea(
    state=(NoNumbers, ()),
    parameters=(NoNumbers, ()),
    functions={"HAS_SEA": False, "push": no_push, "evolve": unchanged},
)


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
