"""What is known beforehand of the coefficients of the MMG form: a reference ship's, or by main dimensions.

Sources of the formulas: Yoshimura & Masumoto 2012, Hydrodynamic database and
manoeuvring prediction method with medium high-speed merchant ships and fishing vessels,
MARSIM (hull, flow straightening); Kijima, Katsuno, Nakiri & Furukawa 1990, On the
manoeuvring performance of a ship with the parameter of loading condition, J. Soc. Naval
Architects of Japan 168 (hull as the alternative, x_H); Zhou, Sheng & Feng 1983 after
Motora's charts (added mass); Fujii & Tuda 1961 (rudder lift slope); Quadvlieg 2013
(a_H, t_R); Taylor (wake); ITTC 1957 and Denny-Mumford (resistance); Wageningen B4-50
(thrust).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from identification.simulation_error.formulas import FORMULAS, main_dimensions
from identification.simulation_error.similarity import (
    AUTO,
    LEAST_SIMILARITY,
    check_alike,
    correlations,
    select_reference,
    similarity_vector,
)
from shipgym import InputError, Particulars, ShipModel, load_model
from shipgym.arrays import Floats
from shipgym.checks import check_choice, quoted
from shipgym.files import shipped_toml
from shipgym.ships.catalogue import REFERENCE_SHIPS
from shipgym.ships.mmg import IDENTIFIED, MMG, SHIP, dimensions, standard_form
from shipgym.ships.particulars import ADDED_MASSES

YOSHIMURA, KIJIMA = "yoshimura", "kijima"
HULL_FORMULAS = (YOSHIMURA, KIJIMA)
UNLIKE = (
    "reference ship {!r} is not like this one: similarity {:.2f}; compare with prior ="
    " 'yoshimura'"
)
SPAN, DIAMETER, PITCH = (
    0.76,
    0.6,
    0.8,
)  # of rudder and propeller by draught, pitch by diameter: usual ones
VISCOSITY = 1.19e-6  # m^2/s, sea water at 15 deg
LARGEST_DRIFT, LARGEST_TURN = (
    0.35,
    0.8,
)  # to which Kijima's squares are turned into cubes

_NUMBERS = shipped_toml("identification.simulation_error", "mmg_prior.toml")
#: Least and largest block coefficient, L/B and B/T of the ships that the formulas were
#: made for.
RANGES: dict[str, list[float]] = _NUMBERS["ranges"]
DEVIATIONS: dict[str, list[float]] = _NUMBERS["deviations"]


@dataclass(frozen=True, eq=False)
class MMGPrior:
    """Normal distribution of the coefficients before any trial."""

    source: str  # the reference ship, or whose formulas
    ship: Particulars  # with what the MMG form needs, estimated where absent
    mean: dict[str, float]  # of all coefficients, those known beforehand too
    deviation: Floats  # of `IDENTIFIED`, shape (41,)
    remarks: tuple[str, ...] = ()  # what a user has to know of it
    similarity: Mapping[str, float] | None = (
        None  # of the candidates for the reference ship
    )


def mmg_prior(source: str | ShipModel, particulars: Particulars) -> MMGPrior:
    """The prior of a reference ship in the MMG form, or of formulas.

    `source`: a reference ship, "auto" for the one most like this ship, or "yoshimura"
    or "kijima"; `particulars`: with service speed; beam, draught, block coefficient and
    what of rudder and propeller is known. Raises InputError for a reference ship of
    other equations or unlike this one, and particulars that do not suffice.
    """
    ship = completed(particulars)
    if isinstance(source, str) and source in HULL_FORMULAS:
        mean, deviation = (
            formula_coefficients(source, ship),
            _deviations(1 + HULL_FORMULAS.index(source)),
        )
        prior = MMGPrior(source, ship, mean, deviation, _out_of_range(ship))
    elif isinstance(source, str) and source in FORMULAS:
        raise InputError(
            f"prior: {source!r} found with structure 'mmg', expected"
            f" {quoted(HULL_FORMULAS)} or a reference ship"
        )
    else:
        model, similarity = _reference(source, ship)
        mean, like = reference_coefficients(model), similarity.get(model.name, 1.0)
        remarks = () if like >= LEAST_SIMILARITY else (UNLIKE.format(model.name, like),)
        prior = MMGPrior(model.name, ship, mean, _deviations(0), remarks, similarity)
    prior.mean.update(_given_added_mass(particulars))
    prior.mean["nD_U0"] = _self_propulsion(prior.mean, ship)
    return prior


def _deviations(which: int) -> Floats:
    return np.array([DEVIATIONS[name][: which + 1][-1] for name in IDENTIFIED])


def _given_added_mass(p: Particulars) -> dict[str, float]:
    """What the particulars give of it and did not estimate, by rho L^2 d / 2."""
    names = {"mx": "X_udot", "my": "Y_vdot", "Jz": "N_rdot"}
    given = {
        name: p[d]
        for name, d in names.items()
        if p[d] is not None and d not in p.estimated
    }
    return {
        name: -value * p.length / p.require("draught") for name, value in given.items()
    }


def completed(particulars: Particulars) -> Particulars:
    """Particulars with rudder and propeller of usual size where absent, marked as estimated.

    Added masses are coefficients of the MMG form and stand there alone. The rudder's
    area is that of Det Norske Veritas, L T / 100 (1 + 25 (B / L)^2).
    """
    ship = particulars.completed()
    none: dict[str, Any] = dict.fromkeys(ADDED_MASSES)
    ship = replace(ship, **none, estimated=ship.estimated - none.keys())
    L, B, T = ship.length, ship.require("beam"), ship.require("draught")
    area = ship.rudder_area or L * T / 100.0 * (1.0 + 25.0 * (B / L) ** 2)
    aspect = (SPAN * T) ** 2 * (ship.rudders or 1.0) / area
    usual = {
        "rudder_area": area,
        "propeller_diameter": DIAMETER * T,
        "rudder_aspect_ratio": aspect,
    }
    absent: dict[str, Any] = {
        name: value for name, value in usual.items() if ship[name] is None
    }
    return replace(ship, **absent, estimated=ship.estimated | absent.keys())


def _reference(
    source: str | ShipModel, ship: Particulars
) -> tuple[ShipModel, dict[str, float]]:
    """The reference ship and the similarity of the candidates; refused where it has other equations.

    So is the best of the candidates where none is like the ship.
    """
    of_form = [
        name
        for name, make in REFERENCE_SHIPS.items()
        if make().structure in ("kvlcc2", MMG)
    ]
    name = select_reference(ship, candidates=of_form)[0] if source == AUTO else source
    model = name if isinstance(name, ShipModel) else load_model(name)
    if model.structure not in ("kvlcc2", MMG):
        raise InputError(
            f"reference_model: {model.name!r} found, which is not written in the MMG"
            f" form, expected one of {quoted(of_form)}, a model file of structure"
            " 'mmg', or none: prior = 'yoshimura' takes formulas"
        )
    others = {
        one: make().particulars
        for one, make in REFERENCE_SHIPS.items()
        if one != "mariner"
    }
    vectors = {model.name: similarity_vector(model.particulars)}
    vectors |= {one: similarity_vector(p.completed()) for one, p in others.items()}
    try:
        found = correlations(similarity_vector(ship), vectors)
    except InputError:  # too little is known to compare
        return model, {}
    if source == AUTO:
        otherwise = "give prior = 'yoshimura' for formulas of the main dimensions"
        check_alike(model.name, found[model.name], otherwise)
    return model, found


def reference_coefficients(model: ShipModel) -> dict[str, float]:
    """Coefficients of a reference ship in the general form."""
    if model.structure == MMG:
        return dict(model.coefficients)
    return standard_form(
        model.coefficients, model.particulars["speed"], model.service_shaft_speed
    )


def formula_coefficients(hull: str, ship: Particulars) -> dict[str, float]:
    """Coefficients from main dimensions; `hull`: "yoshimura" or "kijima"; `ship`: as `completed` gives it."""
    check_choice(hull, HULL_FORMULAS, "prior")
    L, B, _, Cb = main_dimensions(ship)
    slender = Cb * B / L
    wide = ship.propellers is not None and ship.propellers > 1.0
    wake = 0.55 * Cb - 0.20 if wide else 0.5 * Cb - 0.05
    aspect, pitch = (
        ship.require("rudder_aspect_ratio"),
        ship.propeller_pitch_ratio or PITCH,
    )
    found = dict.fromkeys(SHIP.coefficients, 0.0) | _added_mass(ship)
    found |= _yoshimura(ship, found["mx"], found["my"])
    found |= _kijima(ship, found["mx"]) if hull == KIJIMA else {}
    return found | {
        "R_0": _resistance(ship),
        "thrust": 1.0,
        "w_P0": wake,
        "C_1": 2.0,
        "C_2": 1.35,
        "t_R": 0.39,
        "a_H": 0.627 * Cb - 0.153,
        "x_H": -(0.4 + 0.1 * Cb),
        "l_R": -0.9,
        "gamma_R": 2.06 * slender + 0.14,
        "epsilon": 1.0,
        "kappa": 0.55,
        "f_alpha": 6.13 * aspect / (2.25 + aspect),
        "t_P": 0.6 * wake,
        "x_P": -0.48,
        "x_R": -0.5,
        "k_0": -0.073 + pitch * (0.602 - 0.113 * pitch),
        "k_1": -0.209 + pitch * (-0.134 + 0.101 * pitch),
        "k_2": -0.236 + pitch * (0.141 - 0.036 * pitch),
    }


def _yoshimura(ship: Particulars, mx: float, my: float) -> dict[str, float]:
    """The hull by Yoshimura & Masumoto 2012, written there for the drift angle beta = -v'."""
    L, B, d, Cb = main_dimensions(ship)
    slender, k, fine = Cb * B / L, 2.0 * d / L, (1.0 - Cb) * L / B
    # others cite N_vrr with other signs; this one is near KVLCC2's and Kijima's
    return {
        "X_vv": 1.15 * slender - 0.18,
        "X_vr": -(my - 1.91 * slender + 0.08),
        "X_rr": -0.085 * slender + 0.008 - ship.xg_prime * my,
        "X_vvvv": -6.68 * slender + 1.1,
        "Y_v": -(0.5 * math.pi * k + 1.4 * slender),
        "Y_r": mx + 0.5 * slender,
        "Y_vvv": -(0.185 * L / B + 0.48),
        "Y_vvr": -0.75,
        "Y_vrr": -(0.26 * fine + 0.11),
        "Y_rrr": -0.051,
        "N_v": -k,
        "N_r": k * (k - 0.54),
        "N_vvv": -(0.66 - 0.69 * Cb),
        "N_vvr": 1.55 * slender - 0.76,
        "N_vrr": 0.075 * fine - 0.098,
        "N_rrr": 0.25 * slender - 0.056,
    }


def _kijima(ship: Particulars, mx: float) -> dict[str, float]:
    """Sway and yaw of the hull by Kijima et al. 1990, squares as linear and cubic terms of least error."""
    L, B, d, Cb = main_dimensions(ship)
    m = 2.0 * ship.require("mass") / (ship.require("water_density") * L * L * d)
    slender, k, flat, fine = Cb * B / L, 2.0 * d / L, d * Cb / B, d * (1.0 - Cb) / B
    drift, turn = (
        (5 / 16 * most, 35 / 48 / most) for most in (LARGEST_DRIFT, LARGEST_TURN)
    )
    Y_bb, Y_rr = 2.5 * fine + 0.5, 0.343 * flat - 0.07
    N_bb, N_rr = 0.066 - 0.96 * fine, 0.5 * slender - 0.09
    return {
        "Y_v": -(0.5 * math.pi * k + 1.4 * slender + drift[0] * Y_bb),
        "Y_vvv": -drift[1] * Y_bb,
        "Y_r": m + mx - 1.5 * slender + turn[0] * Y_rr,
        "Y_rrr": turn[1] * Y_rr,
        "Y_vvr": 1.5 * flat - 0.65,
        "Y_vrr": -5.95 * fine,
        "N_v": -(k + drift[0] * N_bb),
        "N_vvv": -drift[1] * N_bb,
        "N_r": k * (k - 0.54) + turn[0] * N_rr,
        "N_rrr": turn[1] * N_rr,
        "N_vvr": -(57.5 * slender**2 - 18.4 * slender + 1.6),
        "N_vrr": 0.5 * flat - 0.05,
    }


def _added_mass(ship: Particulars) -> dict[str, float]:
    """Zhou et al. 1983 after Motora's charts, by rho L^2 d / 2."""
    L, B, d, Cb = main_dimensions(ship)
    m = 2.0 * ship.require("mass") / (ship.require("water_density") * L * L * d)
    long, flat = L / B, d / B
    surge = (
        0.398
        + 11.97 * Cb * (1 + 3.73 * flat)
        - 2.89 * Cb * long * (1 + 1.13 * flat)
        + 0.175 * Cb * long**2 * (1 + 0.541 * flat)
        - 1.107 * long * flat
    )
    sway = (
        0.882
        - 0.54 * Cb * (1 - 1.6 * flat)
        - 0.156 * (1 - 0.673 * Cb) * long
        + 0.826 * flat * long * (1 - 0.678 * flat)
        - 0.638 * Cb * flat * long * (1 - 0.669 * flat)
    )
    gyradius = 0.01 * (
        33.0 - 76.85 * Cb * (1 - 0.784 * Cb) + 3.43 * long * (1 - 0.63 * Cb)
    )
    return {"mx": 0.01 * m * surge, "my": m * sway, "Jz": m * gyradius**2}


def _resistance(ship: Particulars) -> float:
    """Of a hull without waves, by rho L d U^2 / 2: ITTC 1957 with a form factor of 0.3, roughness 0.0004."""
    L, B, d, Cb = main_dimensions(ship)
    friction = 0.075 / (math.log10(L * ship.require("speed") / VISCOSITY) - 2.0) ** 2
    return (1.3 * friction + 0.0004) * (1.7 + Cb * B / d)


def _self_propulsion(c: Mapping[str, float], ship: Particulars) -> float:
    """Speed n D_P / U0 at which thrust balances resistance at service speed."""
    known = dimensions(ship)
    D_P, propellers = known["D_P"], known["propellers"]
    inflow = 1.0 - c["w_P0"]
    thrust = (1.0 - c["t_P"]) * propellers * D_P**2 * c["thrust"]
    needed = c["R_0"] * 0.5 * ship.length * ship.require("draught") / thrust
    half, rest = (
        0.5 * c["k_1"] * inflow / c["k_0"],
        (c["k_2"] * inflow**2 - needed) / c["k_0"],
    )
    return -half + math.sqrt(half**2 - rest)


def _out_of_range(ship: Particulars) -> tuple[str, ...]:
    """What of the main dimensions lies outside the range of the formulas."""
    L, B, d, Cb = main_dimensions(ship)
    found = {"block coefficient": Cb, "L/B": L / B, "B/T": B / d}
    return tuple(
        f"{name} {found[name]:.3g} is outside the range of the regression formulas,"
        f" {low:g} to {high:g}: their coefficients are doubtful; name a reference_model"
        " like this ship"
        for name, (low, high) in RANGES.items()
        if not low <= found[name] <= high
    )
