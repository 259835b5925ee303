"""The coefficients of the MMG form that trials and prior make most probable.

Compared are segments back to back, each started from the smoothed measurement. How much
narrower the prior is made, the trials decide, each predicted from the others.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from identification.arrays import by_name
from identification.least_squares import Linearised
from identification.models.prior_knowledge import PriorKnowledge
from identification.models.sailed import (
    CoefficientPrior,
    Sailed,
    compared_channels,
    covariance_of,
    cut,
    with_prior,
)
from shipgym import InputError, Particulars, ShipModel, Trial, load_model
from shipgym.arrays import Flags, Floats, Integers
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


class MMGPrior(NamedTuple):
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
    model = load_model(source)
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


@dataclass(frozen=True, eq=False)
class MMGFit:
    """The MMG form of greatest probability by one strength of the prior."""

    segments: Sailed
    z: Floats  # standard deviations of the prior from its mean, shape (41,)
    scales: Floats  # of the residuals by channel
    strength: float  # of the prior
    data: Linearised  # errors in these scales at z
    error: float = np.nan  # of segments held out, root mean square
    factor: float = 1.0  # on the standard errors, at which these are of size one
    report: dict[str, Any] = field(default_factory=dict)  # for the provenance

    @property
    def prior(self) -> CoefficientPrior:
        """The prior of the coefficients."""
        return self.segments.prior

    @property
    def model(self) -> ShipModel:
        """The model, its covariance widened by the errors held out."""
        covariance = covariance_of(self.data.jacobian)
        return self.segments.model(self.z, self.factor**2 * covariance)

    @property
    def free_coefficients(self) -> int:
        """Number of coefficients that the trials, and not the prior, determine.

        The trace of the resolution: 1 for what the prior says nothing of, 0 for what
        the trials say nothing of.
        """
        of_trials = np.linalg.svd(self.data.jacobian, compute_uv=False) ** 2
        resolved = of_trials / (of_trials + self.strength**2)
        return max(round(float(resolved.sum())), 1)

    def without(self, trials: Sequence[int]) -> ShipModel:
        """The model of the other trials, by their places."""
        held = np.isin(self.segments.of_trials, trials)
        z, _ = self._without(held)
        return self.segments.model(z)

    def held_out(self, scales: Floats) -> "MMGFit":
        """With the error of each group of segments by a fit of the others.

        The error is in the scales given; the factor makes the errors held out, by those
        that the covariance of the others' fit and the scatter of the residuals lead to
        expect, one on average; at least 1.
        """
        groups = held_out_groups(self.segments.of_trials)
        found = [
            self._errors_of(
                groups == group,
                scales,
            )
            for group in set(groups)
        ]
        mean_squares, excess, expected = np.array(found).T
        return replace(
            self,
            error=float(np.sqrt(np.mean(mean_squares))),
            factor=float(np.sqrt(max(excess.sum() / expected.sum(), 1.0))),
        )

    def _errors_of(self, held: Flags, scales: Floats) -> tuple[float, float, float]:
        """Mean squared error of segments by a fit of the others.

        Then its excess over the scatter of the residuals, and what the covariance of
        the fit leads to expect of that.
        """
        z, covariance = self._without(held)
        which = np.flatnonzero(held)
        errors, slopes = self.segments.linearised(
            z,
            self.scales,
            which,
        )
        n_errors = self.segments.n_errors(which) * len(scales)
        in_scales = errors.reshape(-1, len(scales)) * (self.scales / scales)
        return (
            np.sum(in_scales**2) / n_errors,
            float(errors @ errors) - n_errors,
            float(np.sum((slopes @ covariance) * slopes)),
        )

    def _without(self, held: Flags) -> tuple[Floats, Floats]:
        """Coefficients without some segments, and their covariance.

        From those of all segments two Gauss-Newton steps come near enough.
        """
        sizes = [part.measured[1:].size for part in self.segments.parts]
        kept = ~np.repeat(held, sizes)
        data = Linearised(self.data.residuals[kept], self.data.jacobian[kept])
        z = self.z + self._step(data, self.z)
        data = self.segments.linearised(z, self.scales, np.flatnonzero(~held))
        return z + self._step(data, z), covariance_of(data.jacobian)

    def _step(self, data: Linearised, z: Floats) -> Floats:
        """A Gauss-Newton step."""
        residuals, jacobian = with_prior(data, z, self.strength)
        step = np.linalg.solve(jacobian.T @ jacobian, jacobian.T @ residuals)
        return np.asarray(-step)


def fit_mmg(blank: ShipModel, trials: Sequence[Trial], asked: PriorKnowledge) -> MMGFit:
    """The MMG form of greatest probability, with its covariance, and a report.

    The prior is a reference ship, or formulas, by default those of Yoshimura & Masumoto
    2012. By its strength its standard deviations are divided; by default it is the
    strongest of 1, 2, 3 whose error, each trial predicted from the others, is within a
    tenth of the least. The report is for the provenance.
    """
    prior = mmg_prior(asked.source, blank.particulars)
    ship = replace(
        blank,
        particulars=prior.ship,
        coefficients=prior.mean,
    )
    segments = _segments(ship, trials, prior)
    strengths = (1.0, 2.0, 3.0) if asked.strength is None else (asked.strength,)
    fits = list[MMGFit]()
    z = np.zeros(len(IDENTIFIED))
    for strength in strengths:
        fit = _fit(segments, z, strength)
        fits.append(fit)
        z = fit.z
    # errors are compared in the same scales
    fits = [fit.held_out(fits[0].scales) for fit in fits]
    largest = 1.1 * min(fit.error for fit in fits)
    *_, chosen = (fit for fit in fits if fit.error <= largest)
    report = _report(fits, chosen) | {"prior": prior.source}
    if prior.remarks:
        report["prior_remarks"] = list(prior.remarks)
    return replace(chosen, report=report)


def _segments(ship: ShipModel, trials: Sequence[Trial], prior: MMGPrior) -> Sailed:
    """Segments of the trials, and the prior of all coefficients."""
    names = list(ship.coefficients)
    root = np.zeros((len(names), len(IDENTIFIED)))
    root[: len(IDENTIFIED)] = np.diag(prior.deviation)
    mean = np.array([prior.mean[name] for name in names])
    channels = compared_channels(ship, trials)
    lengths = 1.7  # of a segment, ship lengths at service speed
    step = 0.067  # between the samples that are compared
    parts = cut(
        trials,
        ship,
        channels,
        lengths,
        staggered=False,
        interval=step,
    )
    return Sailed(ship, channels, CoefficientPrior(prior.source, mean, root), parts)


def _fit(segments: Sailed, start: Floats, strength: float) -> MMGFit:
    """Fit all segments, the scales of the residuals renewed between rounds.

    From the mean of the prior, of which z is 0, there is a round more.
    """
    tolerances = (1e-2, 1e-4) if start.any() else (1e-2, 1e-2, 1e-4)
    z = start
    for tolerance in tolerances:
        scales = segments.scales(z)
        lost = ~np.isfinite(scales)
        scales[lost] = 1e2 * segments.floors[lost]
        fit = segments.most_probable(z, scales, strength, tolerance)
        z = fit.x
    data = segments.linearised(z, scales)
    return MMGFit(segments, z, scales, strength, data)


def held_out_groups(trial: Integers) -> Integers:
    """Group of each segment, held out together: a trial, of many every fifth one.

    `trial`: that of each segment. Of a single trial a third.
    """
    several = trial.max() > trial.min()
    if several:
        return trial % 5
    return np.arange(len(trial)) * 3 // len(trial)


def _report(fits: Sequence[MMGFit], best: MMGFit) -> dict[str, Any]:
    """For the provenance."""
    return {
        "prior_strength": best.strength,
        "errors_held_out": {f"{fit.strength:g}": fit.error for fit in fits},
        "model_error": {
            "factor": best.factor,
            "how": "simulated segments of trials left out in turn",
        },
        "residual_rms": by_name(best.segments.channels, best.scales),
    }
