"""The recipe for KVLCC2: a reduced Abkowitz table pulled toward a reference ship.

The table was found on the HSVA zigzags: without the cubes of the rudder, it predicts
larger rudders than it has seen. How strong the pull is, each fit finds among its own
runs.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from identification import PriorKnowledge, Refinement
from identification.estimators.estimator import FitTask
from identification.models.guard import reasons_unstable, with_coefficients
from identification.models.methods import get_method
from identification.models.prior import Prior, reference_prior
from identification.models.pulled import Pulled
from identification.pipeline import identify
from identification.pipeline.result import IdentificationResult
from identification.samples.samples import build_samples
from real_ships.data import MeasuredShip
from real_ships.measures import zigzag_errors
from shipgym.models import ShipModel
from shipgym.ships import get_structure, register_structure
from shipgym.ships.steering import SteeringGear
from shipgym.ships.terms import short_terms

REFERENCE = "kvlcc2-l7"
STRENGTHS = (0.0, 0.01, 0.03, 0.1, 0.2)
#: What the six HSVA zigzags choose.
PULL = 0.1
#: Share by which the error held out may exceed the least: the pull is for turns, which
#: are in no zigzag.
TOLERANCE = 0.25

ROOT = (
    "Abkowitz, Mariner form, without products of rudder and drift and with less of"
    " surge"
)
SURGE, SWAY_AND_YAW = "u uu vv rr dd vr vd", "0 0u 0uu v r d vvv vvr ud uv ur uud"


STRUCTURE = "abkowitz12"
#: Terms of sway and yaw and source of the tables of this study.
OWN = {
    STRUCTURE: (SWAY_AND_YAW, f"{ROOT}; without the cube of the rudder"),
    "abkowitz13": (SWAY_AND_YAW + " ddd", ROOT),
}
#: Among which a table may be chosen.
TABLES = ("abkowitz", "abkowitz13", STRUCTURE)


def known(structure: str) -> str:
    """The name of a structure, made known where it is one of this study's."""
    if structure in OWN:
        sway_and_yaw, source = OWN[structure]
        terms = short_terms(sway_and_yaw)
        table = {"u": short_terms(SURGE), "v": terms, "r": terms}
        register_structure(
            structure, table, source, normalisation="prime", quantity="force"
        )
    return structure


#: Refinement from there, the reference ship's turns inside its cost.
REFINEMENT = Refinement(
    segment_lengths=8.0,
    segment_start="measured",
    rudder_offsets=True,
    pull=1e-2,
    anchor=REFERENCE,
    anchor_weight=1e-2,
)


@cache
def _blank(ship: MeasuredShip, structure: str) -> tuple[ShipModel, Prior]:
    """The ship but for its coefficients, and what they are pulled to."""
    names = get_structure(known(structure)).coefficient_names
    particulars = ship.particulars.completed()
    blank = ShipModel(
        particulars.name,
        structure,
        particulars,
        ship.steering or SteeringGear(),
        dict.fromkeys(names, 0.0),
    )
    return blank, reference_prior(REFERENCE, blank)


@cache
def pulled(
    ship: MeasuredShip,
    names: tuple[str, ...],
    strength: float,
    structure: str = STRUCTURE,
) -> ShipModel:
    """Least squares on some runs, pulled toward the reference ship."""
    blank, prior = _blank(ship, structure)
    runs = [ship.runs[name] for name in names]
    samples = build_samples(runs, blank.table, blank.particulars, gear=blank.steering)
    method = get_method("ls")
    pulled_fit = Pulled(method, method.make, prior, FitTask(samples, blank, runs))
    return with_coefficients(blank, pulled_fit.at(strength))


def held_out_error(
    ship: MeasuredShip,
    names: Sequence[str],
    strength: float,
    structure: str = STRUCTURE,
) -> float:
    """RMS error of r, deg/s, over runs predicted one by one from the others.

    Infinite where a model runs away.
    """
    squares = []
    for held in names:
        model = pulled(
            ship, tuple(name for name in names if name != held), strength, structure
        )
        error = float(zigzag_errors(model, ship.runs[held])[0])
        squares.append(error**2 if np.isfinite(error) else np.inf)
    return float(np.sqrt(np.mean(squares)))


def chosen_strength(
    ship: MeasuredShip, names: Sequence[str]
) -> tuple[float, dict[float, float]]:
    """The strongest pull whose error held out is within a quarter of the least.

    Returns
    -------
    strength : float
    errors : dict of float to float
        Held out, deg/s, by strength.
    """
    errors = {strength: held_out_error(ship, names, strength) for strength in STRENGTHS}
    least = min(errors.values())
    most = (1.0 + TOLERANCE) * least
    tolerable = [strength for strength, error in errors.items() if error <= most]
    return max(tolerable), errors


def fitted(ship: MeasuredShip, names: Sequence[str]) -> ShipModel:
    """The fit of some runs with the pull that they choose."""
    strength, _ = chosen_strength(ship, names)
    return steady(ship, names, strength, STRUCTURE)


def with_fixed_pull(ship: MeasuredShip, names: Sequence[str]) -> ShipModel:
    """The pull that all six runs choose."""
    return steady(ship, names, PULL, STRUCTURE)


def fitted_with_table(ship: MeasuredShip, names: Sequence[str]) -> ShipModel:
    """The fit whose table and pull predict each of the runs best from the others."""
    options = [
        (held_out_error(ship, names, s, table), s, table)
        for table in TABLES
        for s in STRENGTHS
    ]
    _, strength, table = min(options)
    return steady(ship, names, strength, table)


def steady(
    ship: MeasuredShip, names: Sequence[str], least: float, structure: str
) -> ShipModel:
    """The least pull from a given one on that keeps the model stable; else that one."""
    runs = [ship.runs[name] for name in names]
    for strength in STRENGTHS[STRENGTHS.index(least) :]:
        model = pulled(ship, tuple(names), strength, structure)
        if not reasons_unstable(model, runs):
            return model
    return pulled(ship, tuple(names), least, structure)


def refined(ship: MeasuredShip, names: Sequence[str]) -> IdentificationResult:
    """Refinement by simulation from the same start, reference turns in its cost."""
    strength, _ = chosen_strength(ship, names)
    return identify(
        [ship.runs[name] for name in names],
        known(STRUCTURE),
        REFINEMENT,
        particulars=ship.particulars,
        steering=ship.steering,
        prior=PriorKnowledge(REFERENCE, strength),
    )
