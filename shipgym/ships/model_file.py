"""The model file: JSON, versioned, written whole or not at all, validated field by field on reading.

Format 1:

    format         1 name           text structure      {"name", "source",
    "normalisation", "quantity", "equations": {"u" | "v" | "r" | "p" | "q":
                   [{"name", "powers"}, ...]}}, where normalisation ("prime") and
                   quantity ("force") may be absent; for a table of captive tests
                   {"name", "source", "shares": {"u" | "v" | "r": [{"coefficient",
                   "name", "powers", "sign"}, ...]}}; for a reference ship {"name",
                   "source"}; a grey box has besides its terms "shaft" (whether the
                   shaft speed is known) and "reference": a reference ship, as a whole
                   model file; one with a kernel has in place of "equations" its
                   "kernel": {"offset", "scale", "centres", "basis"}
    normalisation  that of the structure: "prime", "service" or "si"; "own" for the
    equations of a reference
                   ship
    service_shaft_speed  1/s coefficients   {name: value} covariance     null or a list
    of rows, in the order of the coefficients particulars    SI units, added masses in
    the prime system, "estimated": names steering       {"rudder_limit_deg",
    "rudder_rate_deg_s", "time_constant"} envelope       null or {"channels", "low",
    "high", "centre", "shape"} of u, v, r, delta provenance     null or an object sha256
    of coefficients and covariance (`numbers_hash`); may be absent
"""

import hashlib
import json
from collections.abc import Callable, Collection, Mapping
from typing import Any, TypeVar

import numpy as np

from shipgym.checks import (
    check_array,
    check_choice,
    check_flag,
    check_format,
    check_keys,
    check_number,
    check_table,
    check_text,
    quoted,
    shown,
)
from shipgym.errors import InputError
from shipgym.ships.envelope import CHANNELS, Envelope
from shipgym.ships.equations import ShipEquations
from shipgym.ships.grey_boxes import GreyBox
from shipgym.ships.kernel_boxes import Kernel, kernel_box
from shipgym.ships.manoeuvring_model import FORMAT, ManoeuvringModel
from shipgym.ships.particulars import Particulars
from shipgym.ships.shared_structure import ACCELERATIONS, AXES, SharedStructure
from shipgym.ships.steering import SteeringGear
from shipgym.ships.structures import EQUATIONS, SHIPPED_EQUATIONS
from shipgym.ships.term_table import EQUATION_NAMES, Structure
from shipgym.ships.terms import MOST_TERMS, SYMBOLS

Model = TypeVar("Model", bound=ManoeuvringModel)

FIELDS = (
    "format",
    "name",
    "structure",
    "normalisation",
    "coefficients",
    "covariance",
    "particulars",
    "steering",
    "service_shaft_speed",
    "envelope",
    "provenance",
    "sha256",
)
STRUCTURE_FIELDS = (
    "name",
    "source",
    "normalisation",
    "quantity",
    "equations",
    "shaft",
    "reference",
    "shares",
    "kernel",
)
REQUIRED = ("format", "name", "structure", "coefficients", "particulars", "steering")


def read_model(
    fields: Mapping[str, Any], where: str, make: Callable[..., Model]
) -> Model:
    """The model that `ManoeuvringModel.to_dict` wrote, made by `make` (`ShipModel`).

    Raises InputError that starts with `where` and names the field at fault.
    """
    check_format(fields, FORMAT, where)
    check_keys(fields, FIELDS, where, REQUIRED)
    dynamics = _dynamics(fields["structure"], f"{where}: structure", make)
    normalisation = dynamics.normalisation
    if fields.get("normalisation", normalisation) != normalisation:
        raise InputError(
            f"{where}: normalisation {fields['normalisation']!r} found, expected"
            f" {normalisation!r}"
        )
    coefficients = _coefficients(
        fields["coefficients"], dynamics, f"{where}: coefficients"
    )
    covariance, provenance = fields.get("covariance"), fields.get("provenance")
    model = make(
        name=check_text(fields["name"], f"{where}: name"),
        structure=dynamics.name,
        particulars=Particulars.from_dict(
            check_table(fields["particulars"], f"{where}: particulars")
        ),
        steering=SteeringGear.from_mapping(fields["steering"], f"{where}: steering"),
        coefficients=coefficients,
        covariance=(
            None
            if covariance is None
            else _matrix(covariance, len(coefficients), where)
        ),
        envelope=read_envelope(fields.get("envelope"), f"{where}: envelope"),
        provenance=(
            None
            if provenance is None
            else dict(check_table(provenance, f"{where}: provenance"))
        ),
        own_table=None if dynamics.name in SHIPPED_EQUATIONS else dynamics,
        service_shaft_speed=check_number(
            fields.get("service_shaft_speed", 0.0),
            f"{where}: service_shaft_speed",
            at_least=0.0,
        ),
    )
    found = numbers_hash(model)
    if fields.get("sha256", found) != found:
        raise InputError(
            f"{where}: sha256: {shown(fields['sha256'])} found, expected {found!r},"
            " that of the file's coefficients and covariance: they were changed after"
            " the file was written; take another copy, or, if the change is yours,"
            " leave out the field sha256"
        )
    model.ship_numbers()  # refuses particulars that the structure cannot do with
    return model


def numbers_hash(model: ManoeuvringModel) -> str:
    """SHA-256 of a model's coefficients and covariance, in the order of its structure."""
    covariance = None if model.covariance is None else model.covariance.tolist()
    return hashlib.sha256(
        json.dumps([model.coefficients, covariance]).encode()
    ).hexdigest()


def _dynamics(
    value: Any, where: str, make: Callable[..., ManoeuvringModel]
) -> Structure | ShipEquations:
    """A table of terms, or the equations of a ship that has her own, by name."""
    table = check_table(value, where, STRUCTURE_FIELDS)
    if {"shares", "kernel", "equations"} & table.keys():
        for name in ("source", "name"):
            check_text(table.get(name), f"{where}.{name}")
    if "shares" in table:
        shares = {
            **dict.fromkeys(AXES),
            **check_table(table["shares"], f"{where}.shares"),
        }
        _check_lists(
            shares, AXES, (*SYMBOLS, *ACCELERATIONS), f"{where}.shares", "shares"
        )
        return SharedStructure.from_dict(table)
    if "kernel" in table:  # stands in place of the terms
        table = {**table, "equations": {"u": [{"name": "0", "powers": {}}]}}
    if "equations" in table:
        _check_lists(table["equations"], EQUATION_NAMES, SYMBOLS, f"{where}.equations")
        structure = Structure.from_dict(table)
        if not {"reference", "shaft", "kernel"} & table.keys():
            return structure
        reference = check_table(table.get("reference"), f"{where}.reference")
        box = GreyBox(
            structure.name,
            structure.source,
            structure.equations,
            structure.normalisation,
            structure.quantity,
            read_model(reference, f"{where}.reference", make),
            check_flag(table.get("shaft", False), f"{where}.shaft"),
        )
        return (
            kernel_box(box, _kernel(table["kernel"], f"{where}.kernel"))
            if "kernel" in table
            else box
        )
    try:
        return EQUATIONS[check_choice(table.get("name"), EQUATIONS, f"{where}.name")]
    except InputError as error:
        raise InputError(
            f"{error} A ship with equations of her own is made known by "
            "shipgym.register_ship_equations(file)."
        ) from None


def _kernel(value: Any, where: str) -> Kernel:
    """The radial basis functions of a kernel."""
    shapes: dict[str, tuple[int | None, ...]] = {
        "offset": (4,),
        "scale": (4,),
        "centres": (None, 4),
        "basis": (None, None),
    }
    table = check_table(value, where, shapes)
    return Kernel(
        *(
            check_array(table.get(name), shapes[name], f"{where}.{name}")
            for name in shapes
        )
    )


def _check_lists(
    value: Any,
    equations: Collection[str],
    symbols: Collection[str],
    where: str,
    what: str = "terms",
) -> None:
    """Check lists of terms or shares by equation: their texts, powers of symbols, and the sign of a share."""
    shares = what == "shares"
    texts = ("coefficient", "name") if shares else ("name",)
    for equation, listed in check_table(value, where, equations).items():
        if not isinstance(listed, list) or not 0 < len(listed) <= MOST_TERMS:
            raise InputError(
                f"{where}.{equation}: expected a list of {what}, 1 to {MOST_TERMS}"
            )
        for i, entry in enumerate(listed):
            place = f"{where}.{equation}[{i}]"
            term = check_table(
                entry, place, (*texts, "powers", *(("sign",) if shares else ()))
            )
            for name in texts:
                check_text(term.get(name), f"{place}.{name}")
            check_table(term.get("powers"), f"{place}.powers", symbols)
            if shares:
                check_number(
                    term.get("sign"), f"{place}.sign", at_least=-1.0, at_most=1.0
                )


def _coefficients(
    value: Any, structure: Structure | ShipEquations, where: str
) -> dict[str, float]:
    table = check_table(value, where)
    names = structure.coefficient_names
    if len(table) != len(names):
        raise InputError(
            f"{where}: {len(table)} found, expected {len(names)} for structure"
            f" '{structure.name}'; missing:"
            f" {quoted(name for name in names if name not in table)}"
        )
    check_keys(table, names, where)
    return {name: check_number(table[name], f"{where}.{name}") for name in names}


def _matrix(value: Any, n: int, where: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    matrix = check_array(value, (n, n), f"{where}: covariance")
    if not np.allclose(matrix, matrix.T, rtol=1e-9, atol=0.0):
        raise InputError(f"{where}: covariance: not symmetric")
    if np.any(np.diag(matrix) < 0.0):
        raise InputError(f"{where}: covariance: a variance on the diagonal is negative")
    return matrix


def read_envelope(value: Any, where: str) -> Envelope | None:
    """The envelope that `Envelope.to_dict` wrote; None for null. InputError names the field at fault."""
    if value is None:
        return None
    table = check_table(value, where, ("channels", "low", "high", "centre", "shape"))
    if table.get("channels") != list(CHANNELS):
        raise InputError(
            f"{where}.channels: {table.get('channels')!r} found, expected"
            f" {list(CHANNELS)}"
        )
    shapes = {"low": (4,), "high": (4,), "centre": (4,), "shape": (4, 4)}
    return Envelope(
        *(
            check_array(table.get(name), shapes[name], f"{where}.{name}")
            for name in shapes
        )
    )
