"""The shipped models by name: reference ships, identified models in `library/`, and grey boxes on them."""

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Literal

from shipgym.checks import check_choice
from shipgym.errors import InputError
from shipgym.ships import container as container_file
from shipgym.ships import kvlcc2 as kvlcc2_file
from shipgym.ships import tanker as tanker_file
from shipgym.ships.equations import ShipEquations, read_ship_equations
from shipgym.ships.grey_boxes import GREY_BOX, LINEAR, SOURCE, GreyBox
from shipgym.ships.mariner import mariner
from shipgym.ships.particulars import Particulars
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.steering import SteeringGear
from shipgym.ships.structures import EQUATIONS, SHIPPED_EQUATIONS, list_structures
from shipgym.ships.terms import Term, read_terms

LIBRARY = Path(__file__).parent / "library"

Form = Literal["published", "shipmmg"]


def model_of(
    ship: ShipEquations, coefficients: Mapping[str, float] | None = None
) -> ShipModel:
    """A ship with equations of her own as a model, some coefficients changed or none."""
    return ShipModel(
        name=ship.name,
        structure=ship.name,
        particulars=ship.particulars,
        steering=ship.steering,
        coefficients={**ship.coefficients, **(coefficients or {})},
        provenance={"source": ship.source},
        own_table=None if ship.name in SHIPPED_EQUATIONS else ship,
        service_shaft_speed=ship.service_shaft_speed,
    )


def container(rudder_limit_deg: float = 35.0) -> ShipModel:
    """The container ship S175 (SR108), 4 degrees of freedom; the MSS toolbox has a limit of 10 degrees."""
    steering = replace(container_file.SHIP.steering, rudder_limit_deg=rudder_limit_deg)
    return replace(model_of(container_file.SHIP), steering=steering)


def tanker(rudder_limit_deg: float = 35.0) -> ShipModel:
    """The Esso 190 000 dwt tanker, deep and shallow water; the MSS toolbox has a limit of 10 degrees."""
    model = model_of(tanker_file.SHIP)
    return replace(
        model, steering=replace(model.steering, rudder_limit_deg=rudder_limit_deg)
    )


def kvlcc2(form: Form = "published") -> ShipModel:
    """KVLCC2 at full scale, 320 m: the standard method as published, or the variant of shipmmg 0.0.11."""
    model = kvlcc2_l7(form)
    scale = kvlcc2_file.FULL_SCALE
    return replace(
        model,
        name="kvlcc2",
        particulars=kvlcc2_file.particulars(
            "KVLCC2", kvlcc2_file.Coefficients(**scale), 58.0, 7.973889
        ),
        steering=replace(model.steering, rudder_rate_deg_s=2.34),
        coefficients={**model.coefficients, **scale},
        service_shaft_speed=1.77851,
    )


def kvlcc2_l7(form: Form = "published") -> ShipModel:
    """KVLCC2 as a model of 7 m; `form` as in `kvlcc2`."""
    model = model_of(kvlcc2_file.SHIP, {"PACKAGE_FORM": float(form == "shipmmg")})
    return replace(
        model,
        name="kvlcc2-l7",
        provenance={"source": kvlcc2_file.SHIP.source, "form": form},
    )


REFERENCE_SHIPS: dict[str, Callable[[], ShipModel]] = {
    "mariner": mariner,
    "container": container,
    "tanker": tanker,
    "kvlcc2": kvlcc2,
    "kvlcc2-l7": kvlcc2_l7,
}


def list_models() -> list[str]:
    """Names of the known models: reference ships, identified ones, then ships that were registered."""
    registered = [name for name in EQUATIONS if name not in SHIPPED_EQUATIONS]
    return [
        *REFERENCE_SHIPS,
        *sorted(path.stem for path in LIBRARY.glob("*.json")),
        *registered,
    ]


def register_ship_equations(ship: ShipEquations | str | Path) -> ShipEquations:
    """Register a ship with equations of her own, so that `load_model` finds her by name.

    Given is the ship, or the Python file that defines her as `SHIP`, which is run. A
    ship that does not come from a file, or from one that cannot be imported, stays in
    this process. Raises InputError for a file that does not define a ship, or a name
    that another ship or structure has.
    """
    found = ship if isinstance(ship, ShipEquations) else read_ship_equations(ship)
    name = found.name
    registered = EQUATIONS.get(name)
    again = (
        registered is not None
        and registered.path == found.path
        and name not in SHIPPED_EQUATIONS
    )
    if not again and name in (*list_models(), *list_structures()):
        raise InputError(
            f"{found.path or 'register_ship_equations'}: name {name!r} found, which is"
            " another ship's or structure's; expected a new name"
        )
    EQUATIONS[name] = found
    return found


def load_model(name: str | Path) -> ShipModel:
    """A model by name, or from a file.

    A name of `list_models`, the path of a model file, or that of a Python file with the
    equations of a ship (`register_ship_equations`), which is run. Raises InputError if
    there is no such model or file, or the file is not a valid model.
    """
    path = Path(name)
    if path.suffix == ".py":
        return model_of(register_ship_equations(path))
    there = os.path.exists(path)  # noqa: PTH110 - a Path raises OSError for a text too long for one
    if name not in list_models() and (
        path.suffix == ".json" or there or isinstance(name, Path)
    ):
        return ShipModel.load(path)
    known = check_choice(
        name, list_models(), "model (a name, or the path of a model file)"
    )
    if known in REFERENCE_SHIPS:
        return REFERENCE_SHIPS[known]()
    return (
        model_of(EQUATIONS[known])
        if known in EQUATIONS
        else ShipModel.load(LIBRARY / f"{known}.json")
    )


def truth_of(model: str | Path | ShipModel) -> ShipModel:
    """The reference ship whose simulated trials an identified model comes from.

    What was designed, tuned or trained on the model can be evaluated on her: the
    shipped identified models name her in their provenance, as `truth`. A model is given
    as itself, or as `load_model` takes it.

    Raises InputError for a model that names no reference ship of its size: a reference
    ship herself, one identified from recorded trials, one that was scaled.

    >>> truth_of("mariner-tls-svm").name
    'mariner'
    """
    known = model if isinstance(model, ShipModel) else load_model(model)
    name = str((known.provenance or {}).get("truth"))
    ship = REFERENCE_SHIPS[name]() if name in REFERENCE_SHIPS else None
    if ship is None or ship.particulars.length != known.particulars.length:
        raise InputError(
            f"model {known.name!r}: provenance.truth {name!r} found, expected the"
            " reference ship of her size behind the trials, as 'mariner-tls-svm' names"
            " it; evaluate on a ship that you name yourself"
        )
    return ship


def grey_box(
    reference: str | ShipModel,
    equations: Mapping[str, str | tuple[Term, ...]] | None = None,
    shaft: bool | None = None,
    name: str = GREY_BOX,
) -> GreyBox:
    """A reference ship plus a table of terms, as a structure of a given name.

    The reference is a shipped model's name, the path of a model file, or a model. The
    terms, by equation `u`, `v`, `r`, are in units of service speed (`read_terms`), by
    default Mei's: du (the speed above service speed), v, r, delta and a constant, in
    all three. `shaft` says whether the target's shaft speed is known, by default if the
    reference ship knows one. Raises InputError for a reference that does not exist or
    cannot be one, or a table that cannot be computed.
    """
    ship = reference if isinstance(reference, ShipModel) else load_model(reference)
    table = {
        q: read_terms(terms) if isinstance(terms, str) else tuple(terms)
        for q, terms in (equations or dict.fromkeys("uvr", LINEAR)).items()
    }
    stripped = replace(ship, covariance=None, envelope=None, provenance=None)
    known = "n" in ship.command_names if shaft is None else shaft
    return GreyBox(name, SOURCE, table, "service", "acceleration", stripped, known)


def fitted_box(ship: ShipModel) -> GreyBox:
    """A grey box on a model of the very same ship, whose covariance and provenance it keeps."""
    named = f"{ship.name}, {ship.structure}"
    return replace(grey_box(ship), reference=replace(ship, name=named, envelope=None))


def converted_model(
    reference: str | ShipModel | GreyBox,
    particulars: Particulars,
    steering: SteeringGear,
    service_shaft_speed: float = 0.0,
    name: str | None = None,
) -> ShipModel:
    """The bare reference ship as a model of another ship: a grey box whose terms are all zero.

    The reference is as in `grey_box`, or a grey box; particulars (with the service
    speed), steering gear, shaft speed at service speed (1/s) and name are those of the
    target. A shaft speed of 0 is not known: the reference ship's is taken as at service
    speed.
    """
    box = reference
    if not isinstance(box, GreyBox):
        box = grey_box(box)
        box = replace(box, shaft=box.shaft and service_shaft_speed > 0.0)
    return ShipModel(
        name=particulars.name if name is None else name,
        structure=box.name,
        particulars=particulars,
        steering=steering,
        coefficients=dict.fromkeys(box.coefficient_names, 0.0),
        own_table=box,
        service_shaft_speed=service_shaft_speed,
        provenance={"source": box.source, "reference": box.ship.name},
    )
