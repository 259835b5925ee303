"""A model at another length and speed: from model scale to full scale and back."""

from dataclasses import replace
from typing import Any

import numpy as np

from shipgym.checks import check_number
from shipgym.errors import InputError
from shipgym.models.by_name import takes_name
from shipgym.models.ship_model import ShipModel
from shipgym.ships.envelope import Envelope
from shipgym.ships.particulars import LIMITS, Particulars
from shipgym.ships.term_table import Structure


@takes_name
def scale_model(
    model: ShipModel,
    length: float,
    speed: float | None = None,
) -> ShipModel:
    """A geometrically similar ship of another length, at another service speed.

    What is dimensionless stays: the manoeuvre is the same in ship lengths sailed.
    Speeds go with the ratio of the service speeds, times with that of the times to sail
    a ship length; the steering gear follows. Scale effects (friction, wake) are not
    estimated.

    Raises InputError for a length or speed that is not positive, and for reference
    ships, whose equations are written for one length.

    Parameters
    ----------
    model : ShipModel
        With a table of terms.
    length : float
        Of the new ship, m.
    speed : float, optional
        Its service speed, m/s; by default that of the same Froude number.

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
            f"model {model.name!r}: expected a table of terms, such as that of a model"
            " identified from its trials, got the equations of reference ship"
            f" '{table.name}', which are written for one length"
        )
    check_number(length, "length", above=0.0, hint="in m")
    size = length / model.particulars.length
    service = model.particulars["speed"]
    if speed is None:
        speed = float(service * np.sqrt(size))
    speed = check_number(speed, "speed", above=0.0, hint="in m/s")
    fast = speed / service
    quick = fast / size

    gear = replace(
        model.steering,
        rudder_rate_deg_s=model.steering.rudder_rate_deg_s * quick,
        time_constant=model.steering.time_constant / quick,
    )
    origin = {"from_length": model.particulars.length, "from_speed": service}
    scaled = replace(
        model,
        steering=gear,
        particulars=_particulars(model.particulars, size, speed),
        envelope=_envelope(model.envelope, fast, quick),
        provenance=(model.provenance or {}) | {"scaled": origin},
        service_shaft_speed=model.service_shaft_speed * fast / size,
    )
    if isinstance(table, Structure) and table.normalisation == "si":
        return _with_coefficients(scaled, _coefficient_factors(table, size, fast))
    return scaled  # coefficients without unit


def _with_coefficients(model: ShipModel, factors: dict[str, float]) -> ShipModel:
    """Copy whose coefficients, covariance and draws are those by some factors."""
    coefficients = {}
    for name, value in model.coefficients.items():
        coefficients[name] = value * factors[name]
    covariance, draws = model.covariance, model.draws
    scale = np.array(list(factors.values()))
    if covariance is not None:
        covariance = covariance * np.outer(scale, scale)
    if draws is not None:
        draws = draws * scale
    return replace(
        model,
        coefficients=coefficients,
        covariance=covariance,
        draws=draws,
    )


def _envelope(envelope: Envelope | None, fast: float, quick: float) -> Envelope | None:
    """Envelope at another speed and turn rate, by those before."""
    if envelope is None:
        return None
    unit = np.array([fast, fast, quick, 1.0])  # of u, v, r, delta
    return Envelope(
        low=envelope.low * unit,
        high=envelope.high * unit,
        centre=envelope.centre * unit,
        shape=envelope.shape / unit,
    )


def _coefficient_factors(
    table: Structure, size: float, fast: float
) -> dict[str, float]:
    """Factor of each coefficient of a table in SI units: the change of units."""
    similar = replace(table, normalisation="service")
    quick = fast / size
    factors = {}
    for equation in table.equations:
        names = table.names(equation)
        terms = table.terms(equation)
        for name, term in zip(names, terms, strict=True):
            factors[name] = similar.feature_scale(equation, term, size, fast, quick)
    return factors


def _particulars(ship: Particulars, size: float, speed: float) -> Particulars:
    changes: dict[str, Any] = {
        "speed": speed,
        "length": ship.length * size,
    }
    for name, limits in LIMITS.items():
        value = ship[name]
        if limits.growth and value is not None:
            changes[name] = value * size**limits.growth
    if ship.mass is not None:
        changes["mass"] = ship.mass * size**3
    return replace(ship, **changes)
