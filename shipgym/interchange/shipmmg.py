"""Parameter sets of shipmmg: its dataclasses `Mmg3DofBasicParams`, `Mmg3DofManeuveringParams` and `KTParams`.

Source: shipmmg 0.0.11 (T. Mitsuyuki). Its MMG model is that of Yasukawa & Yoshimura
2015 with another law for the wake and with drift at the centre of gravity, which
`load_model("kvlcc2-l7")` has in its form "shipmmg".
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from shipgym.checks import check_number, check_table
from shipgym.errors import InputError
from shipgym.ships.catalogue import kvlcc2_l7
from shipgym.ships.conversions import nomoto, nomoto1_ship
from shipgym.ships.kvlcc2 import Coefficients, particulars
from shipgym.ships.particulars import Particulars
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.steering import SteeringGear

#: Fields that are coefficients here, with their names.
BASIC = {
    "L_pp": "L",
    "d": "d",
    "x_G": "xG",
    "D_p": "D_P",
    "A_R": "A_R",
    "f_α": "f_alpha",
    "ε": "epsilon",
    "t_R": "t_R",
    "a_H": "a_H",
    "γ_R_minus": "gamma_minus",
    "γ_R_plus": "gamma_plus",
    "l_R": "l_R",
    "κ": "kappa",
    "t_P": "t_P",
    "w_P0": "w_P0",
    "x_P": "x_P_package",
}
DERIVED = ("B", "m", "I_zG", "η", "m_x", "m_y", "J_z", "x_R", "x_H")
HULL = (
    "R_0",
    "X_vv",
    "X_vr",
    "X_rr",
    "X_vvvv",
    "Y_v",
    "Y_r",
    "Y_vvv",
    "Y_vvr",
    "Y_vrr",
    "Y_rrr",
    "N_v",
    "N_r",
    "N_vvv",
    "N_vvr",
    "N_vrr",
    "N_rrr",
)
MANEUVERING = {name: name for name in ("k_0", "k_1", "k_2")} | {
    f"{name}_dash": name for name in HULL
}

Parameters = dict[str, dict[str, float]]


def to_shipmmg(model: ShipModel, density: float = 1025.0) -> Parameters:
    """The parameters of a model for shipmmg.

    KVLCC2's equations in the form "shipmmg" have `basic_params` and
    `maneuvering_params`, of water of this density, kg/m^3; any other model with a
    straight course has `kt_params`, Nomoto's K (1/s) and T (s). Raises InputError for
    KVLCC2 in the published form, whose wake is another.
    """
    if model.structure != "kvlcc2":
        form = nomoto(model)
        return {"kt_params": {"K": form.K, "T": form.T}}
    c = Coefficients(**model.coefficients)
    if not c.PACKAGE_FORM:
        raise InputError(
            f"model '{model.name}': published form found, expected that of shipmmg,"
            " whose wake is another: shipgym.ships.catalogue.kvlcc2(form='shipmmg')"
        )
    basic = {name: getattr(c, own) for name, own in BASIC.items()}
    per_mass = density * 0.5 * c.L**2 * c.d
    basic |= {
        "B": model.particulars["beam"],
        "m": density * c.volume,
        "I_zG": density * c.volume * (0.25 * c.L) ** 2,
        "η": c.D_P / c.H_R,
        "m_x": c.mx * per_mass,
        "m_y": c.my * per_mass,
        "J_z": c.Jz * per_mass * c.L**2,
        "x_R": c.x_R * c.L,
        "x_H": c.x_H * c.L,
    }
    maneuvering = {name: getattr(c, own) for name, own in MANEUVERING.items()}
    return {"basic_params": basic, "maneuvering_params": maneuvering}


def from_shipmmg(
    parameters: Mapping[str, Mapping[str, Any]],
    speed: float,
    *,
    shaft_speed: float = 0.0,
    density: float = 1025.0,
    length: float | None = None,
    steering: SteeringGear | None = None,
    name: str = "shipmmg",
) -> ShipModel:
    """The model of parameters of shipmmg, each table as `dataclasses.asdict` gives it.

    Service speed, m/s, and shaft speed there, 1/s, shipmmg takes for each simulation,
    and knows no limits of the steering gear; a KT model needs the length between
    perpendiculars, m. Ship and water enter with the sum of their moments of inertia:
    the ship's becomes that of a radius of gyration of L/4, the water's the rest. Raises
    InputError for a table or field that is missing, unknown or no number.
    """
    if "kt_params" in parameters:
        kt = _numbers(parameters, "kt_params", ("K", "T"))
        ship = Particulars(check_number(length, "length"), name, speed=speed)
        return nomoto1_ship(kt["K"], kt["T"], ship, steering, name)
    basic = _numbers(parameters, "basic_params", (*BASIC, *DERIVED))
    maneuvering = _numbers(parameters, "maneuvering_params", tuple(MANEUVERING))
    L, per_mass = basic["L_pp"], density * 0.5 * basic["L_pp"] ** 2 * basic["d"]
    values = {own: basic[field] for field, own in BASIC.items()}
    values |= {own: maneuvering[field] for field, own in MANEUVERING.items()}
    inertia = basic["I_zG"] + basic["J_z"] - basic["m"] * (0.25 * L) ** 2
    c = Coefficients(
        **values,
        PACKAGE_FORM=1.0,
        volume=basic["m"] / density,
        H_R=basic["D_p"] / basic["η"],
        mx=basic["m_x"] / per_mass,
        my=basic["m_y"] / per_mass,
        Jz=inertia / (per_mass * L**2),
        x_R=basic["x_R"] / L,
        x_H=basic["x_H"] / L,
    )
    return replace(
        kvlcc2_l7("shipmmg"),
        name=name,
        particulars=particulars(name, c, basic["B"], speed),
        coefficients=c._asdict(),
        service_shaft_speed=shaft_speed,
        steering=steering or SteeringGear(),
        provenance={"source": "shipmmg"},
    )


def _numbers(
    parameters: Mapping[str, Any], table: str, names: tuple[str, ...]
) -> dict[str, float]:
    """The fields of one dataclass, all of them numbers."""
    given = check_table(parameters.get(table), table, names, names)
    return {name: check_number(given[name], f"{table}: {name}") for name in names}
