"""A model at another length and speed: from model scale to full scale and back."""

from dataclasses import replace

import numpy as np

from shipgym.checks import check_number
from shipgym.errors import InputError
from shipgym.ships.envelope import Envelope
from shipgym.ships.particulars import BOUNDS, Particulars
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.steering import SteeringGear
from shipgym.ships.term_table import Structure


def scale_model(
    model: ShipModel,
    length: float,
    speed: float | None = None,
    water_density: float | None = None,
) -> ShipModel:
    """A geometrically similar ship of another length, at another service speed.

    What is dimensionless stays: the manoeuvre is the same in ship lengths sailed.
    Speeds go with the ratio of the service speeds, times with that of the times to sail
    a ship length; the steering gear follows. Scale effects (friction, wake) are not
    estimated.

    Raises InputError for a length, speed or density that is not positive, and for
    reference ships, whose equations are written for one length.

    Parameters
    ----------
    model : ShipModel
        With a table of terms.
    length : float
        Of the new ship, m.
    speed : float, optional
        Its service speed, m/s; by default that of the same Froude number.
    water_density : float, optional
        Of its water, kg/m3; by default as it was.

    Notes
    -----
    Froude's law: speed as the root of the length, so that gravity and inertia stay in
    proportion (ITTC Recommended Procedure 7.5-02-06-01). At another Froude number the
    righting moment of a table with roll, which is gravity's, does not follow the speed:
    keep to the default there.
    """
    table = model.dynamics
    if not table.scales:
        raise InputError(
            f"model {model.name!r}: the equations of reference ship '{table.name}'"
            " found, which are written for one length; expected a model with a table"
            " of terms, such as one identified from its trials"
        )
    check_number(length, "length", above=0.0, hint="in m")
    size = length / model.particulars.length
    speed = model.particulars["speed"] * np.sqrt(size) if speed is None else speed
    check_number(speed, "speed", above=0.0, hint="in m/s")
    fast = float(speed) / model.particulars["speed"]
    quick, gear = fast / size, model.steering
    gear = SteeringGear(
        gear.rudder_limit_deg,
        gear.rudder_rate_deg_s * quick,
        gear.time_constant / quick,
    )
    factors = dict.fromkeys(model.coefficients, 1.0)  # those without unit
    if isinstance(table, Structure) and table.normalisation == "si":
        factors = _coefficient_factors(table, size, fast)
    scale = np.array(list(factors.values()))
    box, unit = model.envelope, np.array([fast, fast, quick, 1.0])
    origin = {
        "from_length": model.particulars.length,
        "from_speed": model.particulars["speed"],
    }
    return replace(
        model,
        steering=gear,
        particulars=_particulars(model.particulars, size, float(speed), water_density),
        coefficients={
            name: value * factors[name] for name, value in model.coefficients.items()
        },
        covariance=(
            None
            if model.covariance is None
            else model.covariance * np.outer(scale, scale)
        ),
        envelope=box
        and Envelope(
            box.low * unit, box.high * unit, box.centre * unit, box.shape / unit
        ),
        provenance=(model.provenance or {}) | {"scaled": origin},
        service_shaft_speed=model.service_shaft_speed * fast / size,
    )


def _coefficient_factors(
    table: Structure, size: float, fast: float
) -> dict[str, float]:
    """What each coefficient of a table in SI units is multiplied by: the change of units."""
    similar = replace(table, normalisation="service")
    return {
        name: similar.feature_scale(equation, term, size, fast, fast / size)
        for equation in table.equations
        for name, term in zip(table.names(equation), table.terms(equation), strict=True)
    }


def _particulars(
    ship: Particulars, size: float, speed: float, water_density: float | None
) -> Particulars:
    growth = {
        name: given["growth"] for name, given in BOUNDS.items() if "growth" in given
    }
    changes = {
        name: ship[name] * size**power
        for name, power in growth.items()
        if ship[name] is not None
    }
    density = ship.water_density if water_density is None else water_density
    if ship.mass is not None:
        denser = (
            1.0
            if water_density is None
            else water_density / ship.require("water_density")
        )
        changes["mass"] = ship.mass * size**3 * denser
    return replace(
        ship, length=ship.length * size, speed=speed, water_density=density, **changes
    )
