"""Grey boxes by the name of their reference ship, and reference ships as models of other ships."""

from collections.abc import Mapping
from dataclasses import replace

from shipgym.ships.catalogue import load_model
from shipgym.ships.grey_boxes import GREY_BOX, LINEAR, SOURCE, GreyBox
from shipgym.ships.particulars import Particulars
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.steering import SteeringGear
from shipgym.ships.terms import Term, read_terms


def grey_box(
    reference: str | ShipModel,
    equations: Mapping[str, str | tuple[Term, ...]] | None = None,
    shaft: bool | None = None,
    name: str = GREY_BOX,
) -> GreyBox:
    """A reference ship plus a table of terms, as a structure of a given name.

    The reference is a shipped model's name, the path of a model file, or a model. The terms, by equation `u`,
    `v`, `r`, are in units of service speed (`read_terms`), by default Mei's: du (the speed above service
    speed), v, r, delta and a constant, in all three. `shaft` says whether the target's shaft speed is known,
    by default if the reference ship knows one. Raises InputError for a reference that does not exist or
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

    The reference is as in `grey_box`, or a grey box; particulars (with the service speed), steering gear,
    shaft speed at service speed (1/s) and name are those of the target. A shaft speed of 0 is not known: the
    reference ship's is taken as at service speed.
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
