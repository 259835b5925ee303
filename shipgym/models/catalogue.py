"""Shipped models by name: reference ships, identified models, and grey boxes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from os import PathLike
from os.path import exists
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shipgym.checks import check_choice, unexpected
from shipgym.errors import InputError
from shipgym.models.ship_model import ShipModel
from shipgym.ships.particulars import Particulars
from shipgym.ships.reference_ships import published_ships
from shipgym.ships.steering import SteeringGear
from shipgym.ships.structures import (
    REGISTERED_EQUATIONS,
    get_equations,
    list_equations,
    list_structures,
)

if TYPE_CHECKING:  # imported with the ships that need them
    from shipgym.ships.equations import ShipEquations
    from shipgym.ships.grey_boxes import GreyBox

LIBRARY = Path(__file__).parent / "library"


def model_of(ship: ShipEquations) -> ShipModel:
    """Make a model of a ship with its own equations."""
    return ShipModel(
        name=ship.name,
        structure=ship.name,
        particulars=ship.particulars,
        steering=ship.steering,
        coefficients=ship.coefficients,
        provenance={"source": ship.source},
        dynamics=ship,
        service_shaft_speed=ship.service_shaft_speed,
    )


# ---- reference ships -----------------------------------------------------------------


def mariner() -> ShipModel:
    """Mariner class cargo ship, 3 degrees of freedom."""
    ship = published_ships()["mariner"]
    # the literature writes the polynomials for a rudder positive to port: odd powers
    # of the rudder change their sign
    coefficients = {
        name: value * 1e-5 * (-1.0) ** name.count("d")
        for name, value in ship["coefficients"].items()
    }
    return ShipModel(
        name="mariner",
        structure="abkowitz",
        particulars=Particulars(**ship["particulars"]),
        steering=SteeringGear(**ship["steering"]),
        coefficients=coefficients,
        provenance={"source": ship["source"]},
    )


def container() -> ShipModel:
    """Container ship S175 (SR108), 4 degrees of freedom."""
    return model_of(get_equations("container"))


def container_stiff() -> ShipModel:
    """S175 with a metacentric height of 2.5 m, at the 22 knots that she is built for.

    She rolls with a period of 10.4 s; the published ship, with 0.3 m, takes 33 s.
    """
    ship = container()
    GM = 2.5  # m
    speed = 22.0 * 1852.0 / 3600.0  # m/s
    pace = speed / ship.particulars["speed"]
    return replace(
        ship,
        name="container-stiff",
        particulars=replace(
            ship.particulars, speed=speed, metacentric_height=GM, roll_period=10.4
        ),
        coefficients={**ship.coefficients, "GM": GM},
        service_shaft_speed=pace * ship.service_shaft_speed,
    )


def tanker() -> ShipModel:
    """Esso 190 000 dwt tanker, deep and shallow water."""
    return model_of(get_equations("tanker"))


def kvlcc2() -> ShipModel:
    """KVLCC2 at full scale, 320 m, by the MMG standard method."""
    model, ship = kvlcc2_l7(), published_ships()["kvlcc2 at full scale"]
    return replace(
        model,
        name="kvlcc2",
        particulars=Particulars(**ship["particulars"]),
        steering=SteeringGear(**ship["steering"]),
        coefficients={**model.coefficients, **ship["coefficients"]},
        service_shaft_speed=ship["service_shaft_speed"],
    )


def kvlcc2_l7() -> ShipModel:
    """KVLCC2 as a model of 7 m."""
    return replace(model_of(get_equations("kvlcc2")), name="kvlcc2-l7")


REFERENCE_SHIPS: dict[str, Callable[[], ShipModel]] = {
    "mariner": mariner,
    "container": container,
    "container-stiff": container_stiff,
    "tanker": tanker,
    "kvlcc2": kvlcc2,
    "kvlcc2-l7": kvlcc2_l7,
}


# ---- by name or file -----------------------------------------------------------------


def list_models() -> list[str]:
    """Names of the known models: reference ships, identified and registered ones."""
    identified = sorted(path.stem for path in LIBRARY.glob("*.json"))
    return [*REFERENCE_SHIPS, *identified, *REGISTERED_EQUATIONS]


def register_ship_equations(ship: ShipEquations | str | Path) -> ShipEquations:
    """Register a ship with its own equations, so that `load_model` finds it by name.

    Given is the ship, or the Python file that defines her as `SHIP`, which is run. A
    ship that does not come from a file, or from one that cannot be imported, stays in
    this process. Raises InputError for a file that does not define a ship, or a name
    that another ship or structure has.
    """
    from shipgym.ships.equations import ShipEquations, read_ship_equations

    new = ship if isinstance(ship, ShipEquations) else read_ship_equations(ship)
    registered = REGISTERED_EQUATIONS.get(new.name)
    again = registered is not None and registered.path == new.path
    taken = [
        *list_models(),
        *list_equations(),
        *list_structures(),
    ]
    if not again and new.name in taken:
        raise InputError(
            f"{new.path or 'register_ship_equations'}: name: expected a new one, got"
            f" {new.name!r}, which is another ship's or structure's"
        )
    REGISTERED_EQUATIONS[new.name] = new
    return new


def load_model(name: Any) -> ShipModel:
    """Load a model by name, or from a file.

    A name of `list_models`, the path of a model file, or that of a Python file with the
    equations of a ship (`register_ship_equations`), which is run; the content of a
    model file; a model is returned as it is. Raises InputError if there is no such
    model or file, or the file is not a valid model.
    """
    if isinstance(name, ShipModel):
        return name
    if isinstance(name, Mapping):
        return ShipModel.from_dict(name)
    if not isinstance(name, str | PathLike):
        expected = "a name, the path of a model file, or a ShipModel"
        raise unexpected("model", expected, name)
    path = Path(name)
    if path.suffix == ".py":
        return model_of(register_ship_equations(path))
    models = list_models()
    is_path = isinstance(name, PathLike) or path.suffix == ".json" or exists(path)
    if name not in models and is_path:
        return ShipModel.load(path)
    known = check_choice(name, models, "model (a name, or the path of a model file)")
    if known in REFERENCE_SHIPS:
        return REFERENCE_SHIPS[known]()
    if known in REGISTERED_EQUATIONS:
        return model_of(REGISTERED_EQUATIONS[known])
    return ShipModel.load(LIBRARY / f"{known}.json")


# ---- grey boxes ----------------------------------------------------------------------


def grey_box(
    reference: str | ShipModel, equations: Mapping[str, str] | None = None
) -> GreyBox:
    """A reference ship plus a table of terms, as a structure.

    The reference is a shipped model's name, the path of a model file, or a model. The
    terms, by equation `u`, `v`, `r`, are in units of service speed (`read_terms`), by
    default Mei's: du (the speed above service speed), v, r, delta and a constant, in
    all three. The target's shaft speed is known if the reference ship knows one. Raises
    InputError for a reference that does not exist or cannot be one, or a table that
    cannot be computed.
    """
    from shipgym.ships.grey_boxes import SOURCE, GreyBox
    from shipgym.ships.terms import read_terms

    ship = load_model(reference)
    # terms of Mei, Sun & Shi 2019 in each equation
    given = equations or dict.fromkeys("uvr", "du, v, r, delta, 1")
    table = {equation: read_terms(terms) for equation, terms in given.items()}
    bare = replace(ship, covariance=None, draws=None, envelope=None, provenance=None)
    return GreyBox(
        name="grey-box",
        source=SOURCE,
        equations=table,
        normalisation="service",
        quantity="acceleration",
        reference=bare,
        shaft="n" in ship.command_names,
    )


def fitted_box(ship: ShipModel) -> GreyBox:
    """Grey box on a model of the same ship, with its covariance and provenance."""
    reference = replace(ship, name=f"{ship.name}, {ship.structure}", envelope=None)
    return replace(grey_box(ship), reference=reference)


def converted_model(
    reference: str | ShipModel | GreyBox,
    particulars: Particulars,
    steering: SteeringGear,
    service_shaft_speed: float = 0.0,
) -> ShipModel:
    """Reference ship as a model of another ship: a grey box whose terms are zero.

    The reference is as in `grey_box`, or a grey box; particulars (with the service
    speed and the name), steering gear and shaft speed at service speed (1/s) are those
    of the target. A shaft speed of 0 is not known: the reference ship's is taken as at
    service speed.
    """
    if isinstance(reference, str | ShipModel):
        box = grey_box(reference)
        box = replace(box, shaft=box.shaft and service_shaft_speed > 0.0)
    else:
        box = reference
    return ShipModel(
        name=particulars.name,
        structure=box.name,
        particulars=particulars,
        steering=steering,
        coefficients=dict.fromkeys(box.coefficient_names, 0.0),
        dynamics=box,
        service_shaft_speed=service_shaft_speed,
        provenance={"source": box.source, "reference": box.ship.name},
    )
