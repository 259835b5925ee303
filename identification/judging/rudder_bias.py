"""Bias of the rudder: the angle, as it was logged, at which the ship runs straight.

A rudder indicator that is off, a propeller that turns one way and a hull that is not
quite symmetric look the same: a constant moment, which a structure without one is given
where the bias differs from zero.
"""

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from identification.estimators.covariance import joint_covariance, without_trials
from identification.judging.model_error import (
    DEFAULT,
    FEWEST_TRIALS,
)
from identification.models.guard import with_coefficients
from identification.models.methods import fit_all, get_method
from identification.samples.problem import Problem
from shipgym import InputError, ShipModel
from shipgym.arrays import Floats
from shipgym.models.linear import straight_running
from shipgym.ships import Structure, Term, get_structure, list_structures
from shipgym.ships.structures import MMG


class RudderBias(NamedTuple):
    """Rudder angle of a straight course."""

    angle_deg: float  # positive to starboard
    standard_error_deg: float
    in_model: bool  # whether the model has it: its own equations turn by themselves
    structure: str  # whose equations gave it

    @property
    def significant(self) -> bool:
        """True where its 95 % interval does not hold 0."""
        standard_errors = 2.0
        return abs(self.angle_deg) > standard_errors * self.standard_error_deg

    def plain(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {**self._asdict(), "significant": bool(self.significant)}


def rudder_bias(model: ShipModel, problem: Problem) -> RudderBias | None:
    """Bias of the rudder by a model, where it has a constant, or by Norrbin's equation.

    None without yaw and rudder, and where no straight course is found. `problem`: that
    the model was identified from.
    """
    equations = getattr(model.dynamics, "equations", "uvr")
    if "r" not in equations or "delta" not in model.command_names:
        return None
    try:
        if model.structure == MMG or has_constant(model.dynamics):
            return _of_model(model, in_model=True)
        return _of_companion(problem)
    except InputError:
        return None


def with_bias(model: ShipModel, problem: Problem) -> Structure | None:
    """The model's structure with a constant, where the bias differs from zero.

    None where it has one already, where it is no plain table, or where the bias may be
    chance.
    """
    table = model.dynamics
    if type(table) is not Structure or has_constant(table):
        return None
    bias = rudder_bias(
        model,
        problem,
    )
    if bias is None or not bias.significant:
        return None
    return with_constant(table)


def with_constant(table: Structure) -> Structure:
    """A table with a constant in sway and yaw, or in the memory of yaw."""
    name = f"{table.name}-bias"
    if name in list_structures():
        return get_structure(name)

    # a constant of yaw itself is lost in the unknown memory at the start
    sideways = ("v", "q") if table.remembers else ("v", "r")
    constant = Term("0", ())
    equations = dict(table.equations)
    for equation in sideways:
        if equation in equations:
            equations[equation] = (constant, *equations[equation])
    return replace(
        table,
        name=name,
        source=f"{table.source}; with the constant of a rudder that is off",
        equations=equations,
    )


def has_constant(dynamics: Any) -> bool:
    """Return True where a term of sway, yaw or its memory has no side."""
    if not isinstance(dynamics, Structure):
        return False
    sides = {"v", "r", "p", "phi", "delta"}
    return any(
        not {symbol.strip("|") for symbol in term.symbols} & sides
        for equation in ("v", "r", "q")
        for term in dynamics.equations.get(equation, ())
    )


def _of_model(model: ShipModel, in_model: bool) -> RudderBias:
    """Neutral rudder of a model, its error by the covariance of its coefficients."""
    values = np.array(list(model.coefficients.values()))
    neutral = _neutral(model, values)
    covariance = np.asarray(model.covariance)
    steps = 0.01 * np.sqrt(np.diag(covariance))
    slopes = np.zeros_like(values)
    for place in np.flatnonzero(steps):
        moved = values.copy()
        moved[place] += steps[place]
        slopes[place] = (_neutral(model, moved) - neutral) / steps[place]
    error = math.sqrt(max(float(slopes @ covariance @ slopes), 0.0))
    return RudderBias(
        angle_deg=math.degrees(neutral),
        standard_error_deg=math.degrees(error),
        in_model=in_model,
        structure=model.structure,
    )


def _neutral(model: ShipModel, values: Floats) -> float:
    """Rudder of a straight course by other coefficients, rad."""
    return straight_running(model.with_coefficients(values)).rudder


def _of_companion(problem: Problem) -> RudderBias:
    """Bias by Norrbin's equation with a constant, fitted by least squares.

    The error is that by the trials left out in turn (jackknife), or where they are few
    by the residuals, widened for the error of the equation.
    """
    table = get_structure("norrbin-bias")
    samples = problem.rows_of(table, problem.blank)
    estimators = fit_all(get_method("ls").make, samples)
    blank = replace(
        problem.blank,
        structure=table.name,
        dynamics=table,
        coefficients=dict.fromkeys(table.coefficient_names, 0.0),
        covariance=None,
        draws=None,
    )
    n_trials = len(problem.used)
    if n_trials < FEWEST_TRIALS:
        of_residuals = joint_covariance(
            estimators,
            samples,
            blank.travel_time,
        )
        covariance = DEFAULT**2 * of_residuals
    else:
        left_out = [
            without_trials(estimators, samples, [trial])[0]["r"].coef_
            for trial in range(n_trials)
        ]
        scatter = left_out - np.mean(left_out, axis=0)
        covariance = (n_trials - 1) / n_trials * (scatter.T @ scatter)
    model = with_coefficients(blank, estimators)
    return _of_model(replace(model, covariance=covariance), in_model=False)
