"""Model file: versioned JSON, written atomically, validated field by field.

Format 1 has these fields:

* `format`: 1; `name`: a string.
* `structure`: a table of terms, {"name", "source", "normalisation", "quantity",
  "equations": {"u" | "v" | "r" | "p" | "q": [{"name", "powers"}, ...]}}, where
  normalisation ("prime") and quantity ("force") may be absent; for a table of captive
  tests {"name", "source", "shares": {"u" | "v" | "r": [{"coefficient", "name",
  "powers", "sign"}, ...]}}; for a reference ship {"name", "source"}; a grey box has
  besides its terms "shaft" (whether the shaft speed is known) and "reference": a
  reference ship, as a whole model file; one with a kernel has in place of "equations"
  its "kernel": {"offset", "scale", "centres", "basis"}.
* `normalisation`: that of the structure: "prime", "service" or "si"; "own" for the
  equations of a reference ship.
* `service_shaft_speed`: 1/s.
* `coefficients`: {name: value}; `covariance`: null or a list of rows, in their order.
* `particulars`: SI units, added masses in the prime system, "estimated": names.
* `steering`: {"rudder_limit_deg", "rudder_rate_deg_s", "time_constant"}.
* `envelope`: null or {"channels", "low", "high", "centre", "shape"} of u, v, r, delta.
* `provenance`: null or an object.
* `draws`: rows of coefficients drawn from a posterior, in their order; absent where
  there are none.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import (
    check_array,
    check_choice,
    check_format,
    check_keys,
    check_number,
    check_table,
    check_text,
    placed,
    unexpected,
)
from shipgym.errors import InputError
from shipgym.ships.envelope import Envelope
from shipgym.ships.manoeuvring_model import MODEL_FORMAT, ManoeuvringModel
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from shipgym.ships.structures import get_equations, list_equations
from shipgym.ships.term_table import Structure

if TYPE_CHECKING:  # few models have equations
    from shipgym.ships.equations import ShipEquations

Model = TypeVar("Model", bound=ManoeuvringModel)

OPTIONAL = (
    "normalisation",
    "covariance",
    "service_shaft_speed",
    "envelope",
    "provenance",
    "draws",
)


def read_model(
    fields: Mapping[str, Any], where: str, make: Callable[..., Model]
) -> Model:
    """Read the model that `ManoeuvringModel.to_dict` wrote, made by `make`.

    Raises InputError that starts with `where` and names the field at fault.
    """
    check_format(fields, MODEL_FORMAT, where)
    required = (
        "format",
        "name",
        "structure",
        "coefficients",
        "particulars",
        "steering",
    )
    check_keys(fields, (*required, *OPTIONAL), where, required)
    dynamics = _read_dynamics(fields["structure"], f"{where}: structure", make)
    unit = dynamics.normalisation
    check_choice(fields.get("normalisation", unit), (unit,), f"{where}: normalisation")
    covariance = fields.get("covariance")
    if covariance is not None:
        n = len(dynamics.coefficient_names)
        covariance = _read_covariance(covariance, n, f"{where}: covariance")
    draws = _read_draws(fields, dynamics.coefficient_names, f"{where}: draws")
    envelope = fields.get("envelope")
    if envelope is not None:
        envelope = Envelope.from_dict(envelope, f"{where}: envelope")
    provenance = fields.get("provenance")
    if provenance is not None:
        provenance = dict(check_table(provenance, f"{where}: provenance"))
    shaft_speed = check_number(
        fields.get("service_shaft_speed", 0.0),
        f"{where}: service_shaft_speed",
        at_least=0.0,
    )

    model = make(
        name=check_text(fields["name"], f"{where}: name"),
        structure=dynamics.name,
        particulars=Particulars.from_mapping(
            fields["particulars"],
            f"{where}: particulars",
        ),
        steering=SteeringGear.from_mapping(fields["steering"], f"{where}: steering"),
        coefficients=check_table(fields["coefficients"], f"{where}: coefficients"),
        covariance=covariance,
        envelope=envelope,
        provenance=provenance,
        dynamics=dynamics,
        service_shaft_speed=shaft_speed,
        draws=draws,
    )
    model.ship_numbers()  # refuses particulars that the structure cannot do with
    return model


def _read_dynamics(
    value: Any, where: str, make: Callable[..., ManoeuvringModel]
) -> Structure | ShipEquations:
    """Read a table of terms, or find a ship's own equations by name."""
    table = check_table(
        value,
        where,
        (
            "name",
            "source",
            "normalisation",
            "quantity",
            "equations",
            "shaft",
            "reference",
            "shares",
            "kernel",
        ),
    )
    if "shares" in table:
        from shipgym.ships.shared_structure import SharedStructure

        return SharedStructure.from_dict(table, where)
    if "kernel" in table:
        from shipgym.ships.kernel_boxes import KernelBox

        return KernelBox.read(table, where, _read_reference(table, where, make))
    if "equations" in table and ("reference" in table or "shaft" in table):
        from shipgym.ships.grey_boxes import GreyBox

        return GreyBox.read(table, where, _read_reference(table, where, make))
    if "equations" in table:
        return Structure.from_dict(table, where)
    try:
        name = check_choice(table.get("name"), list_equations(), f"{where}.name")
    except InputError as error:
        raise InputError(
            f"{error} A ship with equations of her own is made known by"
            " shipgym.register_ship_equations(file)."
        ) from None
    return get_equations(name)


def _read_reference(
    table: Mapping[str, Any], where: str, make: Callable[..., Model]
) -> Model:
    """Read the reference ship of a grey box."""
    place = f"{where}.reference"
    with placed(place):
        given = table.get("reference")
        fields = check_table(given, place)
        return read_model(fields, place, make)


def _read_draws(
    fields: Mapping[str, Any], names: Sequence[str], where: str
) -> Floats | None:
    """Draws of a posterior; None where there are none."""
    rows = fields.get("draws")
    if rows is None:
        return None
    if fields.get("covariance") is None:
        raise unexpected(where, "none without their covariance", rows)
    draws = check_array(rows, (None, len(names)), where)
    if len(draws) < 2:
        raise unexpected(where, "two rows at least", rows)
    return draws


def _read_covariance(value: Any, n: int, where: str) -> Floats:
    matrix = check_array(value, (n, n), where)
    if not np.allclose(matrix, matrix.T, rtol=1e-9, atol=0.0):
        raise InputError(f"{where}: expected a symmetric matrix, got another")
    least_variance = np.diag(matrix).min()
    if least_variance < 0.0:
        raise unexpected(
            where,
            "no negative variance on the diagonal",
            float(least_variance),
        )
    return matrix
