"""Prior of the coefficients of the MMG form.

Those of a reference ship, or from main dimensions.
"""

import math
from dataclasses import dataclass

import numpy as np

from shipgym import InputError, Particulars, ShipModel, load_model
from shipgym.arrays import Floats
from shipgym.ships.hull_formulas import (
    YOSHIMURA,
    completed,
    formula_coefficients,
    self_propulsion,
)
from shipgym.ships.mmg import IDENTIFIED, standard_form
from shipgym.ships.particulars import main_dimensions
from shipgym.ships.structures import MMG

#: Standard deviations of the coefficients before any trial, about a reference ship and
#: about formulas. With formulas at least the root mean square of what published
#: coefficients of ships differ by from them (`test_mmg.py`); sources do not agree on
#: the signs in N_vrr.
DEVIATIONS = {
    "mx": (0.005, 0.0062),
    "my": (0.03, 0.04),
    "Jz": (0.002, 0.004),
    "R_0": (0.006, 0.006),
    "X_vv": (0.03, 0.06),
    "X_vr": (0.04, 0.084),
    "X_rr": (0.02, 0.03),
    "X_vvvv": (0.4, 0.6),
    "Y_v": (0.04, 0.08),
    "Y_r": (0.03, 0.05),
    "Y_vvv": (0.6, 0.6),
    "Y_vvr": (0.4, 0.83),
    "Y_vrr": (0.3, 0.3),
    "Y_rrr": (0.05, 0.053),
    "N_v": (0.02, 0.03),
    "N_r": (0.007, 0.016),
    "N_vvv": (0.1, 0.16),
    "N_vvr": (0.1, 0.17),
    "N_vrr": (0.05, 0.23),
    "N_rrr": (0.01, 0.03),
    "thrust": (0.25, 0.25),
    "w_P0": (0.1, 0.1),
    "C_1": (0.5, 0.5),
    "C_2": (0.25, 0.25),
    "C_2_side": (0.25, 0.25),
    "t_R": (0.05, 0.1),
    "a_H": (0.1, 0.12),
    "x_H": (0.05, 0.05),
    "l_R": (0.1, 0.2),
    "gamma_R": (0.12, 0.15),
    "gamma_R_side": (0.12, 0.12),
    "epsilon": (0.2, 0.2),
    "kappa": (0.12, 0.12),
    "f_alpha": (0.2, 0.47),
    "delta_0": (math.radians(1.0), math.radians(1.0)),
    "Y_0": (0.001, 0.001),
    "N_0": (0.0005, 0.0005),
    "c_R": (0.5, 0.5),
    "speed_power": (0.5, 0.5),
    "N_absr": (0.003, 0.003),
    "N_rr": (0.008, 0.008),
}


@dataclass(frozen=True, eq=False)
class MMGPrior:
    """Normal distribution of the coefficients before any trial."""

    source: str  # the reference ship, or whose formulas
    ship: Particulars  # with what the MMG form needs, estimated where absent
    mean: dict[str, float]  # of all coefficients, those known beforehand too
    deviation: Floats  # of `IDENTIFIED`, shape (41,)
    remarks: tuple[str, ...]  # what a user has to know of it


def mmg_prior(source: str | ShipModel, particulars: Particulars) -> MMGPrior:
    """The prior of a reference ship in the MMG form, or of formulas.

    `source`: a reference ship, or "yoshimura"; `particulars`: with service speed; beam,
    draught, block coefficient and what of rudder and propeller is known. Raises
    InputError for a reference ship of other equations, and particulars that do not
    suffice.
    """
    ship = completed(particulars)
    if isinstance(source, str) and source == YOSHIMURA:
        name, column, remarks = source, 1, _out_of_range(ship)
        mean = formula_coefficients(ship)
    else:
        model = _in_mmg_form(source)
        name, column, remarks = model.name, 0, ()
        mean = reference_coefficients(model)
    mean |= _given_added_mass(particulars)
    mean["nD_U0"] = self_propulsion(mean, ship)
    deviation = np.array([DEVIATIONS[one][column] for one in IDENTIFIED])
    return MMGPrior(name, ship, mean, deviation, remarks)


def _in_mmg_form(source: str | ShipModel) -> ShipModel:
    """The reference ship named; InputError for one that is not of the MMG form."""
    model = source if isinstance(source, ShipModel) else load_model(source)
    if model.structure not in ("kvlcc2", MMG):
        raise InputError(
            "prior: expected a ship in the MMG form, 'kvlcc2', 'kvlcc2-l7' or a model"
            f" file of structure 'mmg', got {model.name!r}; or give prior ="
            " 'yoshimura' for formulas"
        )
    return model


def reference_coefficients(model: ShipModel) -> dict[str, float]:
    """Coefficients of a reference ship in the general form."""
    if model.structure == MMG:
        return dict(model.coefficients)
    return standard_form(
        model.coefficients,
        model.particulars["speed"],
        model.service_shaft_speed,
    )


def _given_added_mass(p: Particulars) -> dict[str, float]:
    """Added masses that were given, not estimated, by rho L^2 d / 2."""
    symbols = {"mx": "X_udot", "my": "Y_vdot", "Jz": "N_rdot"}
    given = {}
    for symbol, name in symbols.items():
        derivative = p[name]
        if derivative is None or name in p.estimated:
            continue
        # the prime system is by rho L^3 / 2
        draught = p.require("draught")
        given[symbol] = -derivative * p.length / draught
    return given


def _out_of_range(ship: Particulars) -> tuple[str, ...]:
    """Remarks on main dimensions outside those that the formulas were made for.

    To be read with caution: the databases behind them are not published whole.
    """
    L, B, T, C_b = main_dimensions(ship)
    ratios = [
        ("block coefficient", C_b, 0.50, 0.86),
        ("L/B", L / B, 3.5, 7.5),
        ("B/T", B / T, 2.0, 4.5),
    ]
    return tuple(
        f"{name} {value:.3g} is outside the range of the regression formulas, {low:g}"
        f" to {high:g}: their coefficients are doubtful; name as prior a ship in the"
        " MMG form that is like this one"
        for name, value, low, high in ratios
        if not low <= value <= high
    )
