"""The coefficients of the MMG form that trials and prior make most probable, by simulation error in segments.

The cost is that of the simulated states in segments back to back, each started from the
smoothed measurement, by their own scatter, plus the squared distance from the prior
(Maine & Iliff 1985, NASA RP-1138, 2.5, output error with prior). How much narrower the
prior is made, the trials decide, each predicted from the others.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from identification.options import MAP, Options, name_of
from identification.regression.problem import Problem
from identification.simulation_error.mmg_prior import YOSHIMURA, MMGPrior, mmg_prior
from identification.simulation_error.prior_knowledge import PriorKnowledge
from identification.simulation_error.segments import (
    Segment,
    channel_units,
    compared_channels,
    cut,
    sailed,
)
from identification.uncertainty.uncertainty import Uncertainty
from shipgym import InputError, ShipModel, Trial
from shipgym.arrays import Floats, Integers
from shipgym.checks import check_number
from shipgym.engine.motion import Ship
from shipgym.engine.records import LANES
from shipgym.ships.mmg import IDENTIFIED

SEGMENT_LENGTHS, INTERVAL = (
    1.7,
    0.067,
)  # of segments, and between samples, ship lengths at service speed
CORRELATED = 1.0  # ship lengths, over which errors are one error
FLOORS = {
    "u": 0.0017,
    "v": 0.0017,
    "r": 0.0021,
    "psi": np.radians(0.1),
}  # by U0, U0, U0 / L, 1
STRENGTHS = (1.0, 2.0, 3.0)  # of the prior: its deviations divided by it
MARGIN = 0.1  # by which the error held out may exceed the least for a stronger prior
STEPS_HELD_OUT = 2  # of Gauss-Newton, from the fit of all trials to that of some
STEP = 1e-4  # of finite differences, standard deviations of the prior
MOST_GROUPS, PIECES = 5, 3  # groups of trials held out; pieces of a single trial
LARGEST = 1e3  # residual of a ship that runs away, in scales


@dataclass(frozen=True, eq=False)
class Estimate:
    """What a fit found."""

    # coefficients in standard deviations of the prior from its mean, shape (41,)
    z: Floats
    scales: Floats  # of the residuals by channel
    strength: float  # of the prior
    covariance: Floats  # of z, Gauss-Newton
    evaluations: int


def checked_mmg(options: Options) -> Options:
    """The options of an identification of the MMG form; InputError for those that it does not have."""
    if not (options.method_is_default or options.method == MAP):
        raise InputError(
            "method: expected none with structure 'mmg', which is not linear in its"
            " coefficients and fitted by simulation error with a prior, got"
            f" {name_of(options.method)!r}; leave the method and its settings out, or"
            " choose another structure"
        )
    if options.uncertainty.covariance != Uncertainty.covariance:
        raise InputError(
            "uncertainty: expected 'analytic' with structure 'mmg', got"
            f" {options.uncertainty.covariance!r}; leave it out, or choose another"
            " structure"
        )
    prior = None if options.prior is None else options.prior.source
    if prior is not None and options.reference_model is not None:
        raise InputError(
            "reference_model: expected none together with prior"
            f" {name_of(prior)!r}, got {name_of(options.reference_model)!r}: the"
            " coefficients of structure 'mmg' are pulled to one reference ship, or to"
            " formulas"
        )
    return replace(options, method=MAP)


def fit_mmg(problem: Problem, options: Options) -> tuple[ShipModel, dict[str, Any]]:
    """The MMG form of greatest probability, with its covariance, and the report for the provenance.

    Options by `checked_mmg`. The prior is that of the `reference_model`, or of `prior`:
    a reference ship, or formulas, by default those of Yoshimura & Masumoto 2012. By its
    strength its standard deviations are divided; by default it is the strongest of 1,
    2, 3 whose error, each trial predicted from the others, is within a tenth of the
    least.
    """
    asked = options.prior or PriorKnowledge()
    source = options.reference_model or asked.source or YOSHIMURA
    prior = mmg_prior(source, problem.blank.particulars)
    given = asked.strength
    if given is not None:
        check_number(given, "prior_strength", above=0.0)
    strengths = STRENGTHS if given is None else (given,)
    cost = _Problem(replace(problem.blank, particulars=prior.ship), problem.used, prior)
    estimates, z = list[Estimate](), np.zeros(len(IDENTIFIED))
    for strength in strengths:
        estimates.append(cost.solve(z, strength))
        z = estimates[-1].z
    errors, factors = zip(
        *(cost.held_out(one, estimates[0].scales) for one in estimates), strict=True
    )
    chosen = max(
        k for k, error in enumerate(errors) if error <= (1.0 + MARGIN) * min(errors)
    )
    best, factor = estimates[chosen], factors[chosen]
    told = {
        "similarity": dict(prior.similarity or {}),
        "prior_remarks": list(prior.remarks),
    }
    report = {
        "prior": prior.source,
        **{name: value for name, value in told.items() if value},
        "prior_strength": best.strength,
        "errors_held_out": {
            f"{e.strength:g}": error for e, error in zip(estimates, errors, strict=True)
        },
        "model_error": {
            "factor": factor,
            "how": "simulated segments of trials left out in turn",
        },
        "segments": len(cost.segments),
        "evaluations": sum(one.evaluations for one in estimates),
        "residual_rms": dict(zip(cost.channels, best.scales.tolist(), strict=True)),
        "deviations_from_prior": dict(
            zip(IDENTIFIED, best.z.round(3).tolist(), strict=True)
        ),
    }
    covariance, inner = np.zeros((len(prior.mean),) * 2), slice(len(IDENTIFIED))
    covariance[inner, inner] = (
        factor**2 * best.covariance * np.outer(prior.deviation, prior.deviation)
    )
    return replace(cost.model(best.z), covariance=covariance), report


class _Problem:
    """Segments, and what ships of given coefficients do in them."""

    def __init__(
        self, blank: ShipModel, trials: Sequence[Trial], prior: MMGPrior
    ) -> None:
        self.blank, self.prior = replace(blank, coefficients=prior.mean), prior
        self.mean = np.array([prior.mean[name] for name in IDENTIFIED])
        self.numbers = self.blank.ship_numbers()
        self.channels = compared_channels(blank, trials)
        self.columns = [blank.state_names.index(name) for name in self.channels]
        floors = np.array([FLOORS[name] for name in self.channels])
        self.floors = floors * channel_units(blank, self.channels)
        self.segments = cut(
            trials, self.blank, self.channels, SEGMENT_LENGTHS, False, interval=INTERVAL
        )
        self.groups = _groups(self.segments)
        self.kept: dict[bytes, tuple[Floats, Floats]] = {}

    def model(self, z: Floats) -> ShipModel:
        """The model of some coefficients."""
        values = dict(
            zip(
                IDENTIFIED, (self.mean + z * self.prior.deviation).tolist(), strict=True
            )
        )
        return replace(self.blank, coefficients=self.prior.mean | values)

    def at(self, z: Floats, which: Integers) -> tuple[Floats, Floats]:
        """As `simulated`, which is not done twice in a row."""
        key = z.tobytes() + which.tobytes()
        if key not in self.kept:
            self.kept = {key: self.simulated(z, which)}
        return self.kept[key]

    def rows(
        self, z: Floats, which: Integers, scales: Floats, strength: float
    ) -> tuple[Floats, Floats]:
        """Errors of some segments in their scales, then those of the prior, and their slopes.

        Shapes (n_rows + 41,) and (n_rows + 41, 41).
        """
        errors, slopes = self.at(z, which)
        with np.errstate(invalid="ignore"):
            scaled = np.clip(
                np.nan_to_num(errors / scales, nan=LARGEST), -LARGEST, LARGEST
            ).ravel()
            steep = np.nan_to_num(slopes / scales[:, None], posinf=0.0, neginf=0.0)
        own = strength * np.eye(len(z))
        return np.append(scaled, strength * z), np.vstack(
            [steep.reshape(len(scaled), -1), own]
        )

    def simulated(self, z: Floats, which: Integers) -> tuple[Floats, Floats]:
        """Errors of the simulated channels and their slopes, of some segments.

        Each times the root of the share that its step has of the time over which errors
        are one error; shapes (n_samples, n_channels) and (n_samples, n_channels, 41).
        """
        first, n = len(Ship._fields), len(IDENTIFIED)
        ships = np.repeat(self.numbers, LANES).reshape(-1, LANES)
        ships[first : first + n] = (self.mean + z * self.prior.deviation)[:, None]
        ships[first + np.arange(n), 1 + np.arange(n)] += STEP * self.prior.deviation
        parts = []
        for segment in (self.segments[k] for k in which):
            lanes = sailed(
                self.blank,
                segment,
                ships,
                np.repeat(segment.start, LANES),
                np.zeros(LANES),
            )
            off = lanes[1:, self.columns, : n + 1] - segment.measured[1:, :, None]
            parts.append(off * np.sqrt(self._weight(segment) / len(off)))
        found = np.concatenate(parts)
        errors = found[:, :, 0]
        with np.errstate(invalid="ignore", over="ignore"):  # of ships that run away
            slopes = (found[:, :, 1:] - errors[:, :, None]) / STEP
        return errors, slopes

    def scales(self, errors: Floats, which: Integers) -> Floats:
        """Root mean square of the errors by channel, not below the floors."""
        shares = sum(self._weight(self.segments[k]) for k in which)
        with np.errstate(invalid="ignore", over="ignore"):
            rms = np.sqrt(np.sum(errors**2, axis=0) / shares)
        return np.maximum(
            np.where(np.isfinite(rms), rms, 1e2 * self.floors), self.floors
        )

    def _weight(self, segment: Segment) -> float:
        return float(segment.inputs[-1, 0] - segment.times[0]) / (
            CORRELATED * self.blank.travel_time
        )

    def solve(self, start: Floats, strength: float) -> Estimate:
        """Fit all segments, the scales of the residuals renewed between rounds, fewer from an earlier fit."""
        everything, z, evaluations = np.arange(len(self.segments)), start, 0
        for last in (False, False, True) if not start.any() else (False, True):
            scales = self.scales(self.at(z, everything)[0], everything)
            given, tolerance = (everything, scales, strength), 1e-4 if last else 1e-2
            found = least_squares(
                lambda x, *a: self.rows(x, *a)[0],
                z,
                lambda x, *a: self.rows(x, *a)[1],
                args=given,
                method="trf",
                ftol=tolerance,
                xtol=tolerance,
                max_nfev=30,
            )
            z, evaluations = found.x, evaluations + found.nfev
        return Estimate(
            z,
            scales,
            strength,
            _covariance(self.rows(z, *given)[1][: -len(z)]),
            evaluations,
        )

    def held_out(self, whole: Estimate, scales: Floats) -> tuple[float, float]:
        """Error of each group of segments by a fit of the others, and the factor on the standard errors.

        The fit of the others takes Gauss-Newton steps from that of all. The error is in
        the scales given; the factor makes the errors held out, by those that the
        covariance of the others' fit and the scatter of the residuals lead to expect,
        one on average; at least 1.
        """
        errors, excess, expected = [], 0.0, 0.0
        for group in np.unique(self.groups):
            rest, held = (
                np.flatnonzero(self.groups != group),
                np.flatnonzero(self.groups == group),
            )
            z = whole.z
            for _ in range(STEPS_HELD_OUT):
                residuals, jacobian = self.rows(z, rest, whole.scales, whole.strength)
                z = z - np.linalg.solve(jacobian.T @ jacobian, jacobian.T @ residuals)
            covariance = _covariance(jacobian[: -len(z)])
            error, slopes = (
                part[: -len(z)] for part in self.rows(z, held, whole.scales, 0.0)
            )
            weight = sum(self._weight(self.segments[k]) for k in held) * len(scales)
            errors.append(
                np.sum((error.reshape(-1, len(scales)) * (whole.scales / scales)) ** 2)
                / weight
            )
            excess += float(error @ error) - weight
            expected += float(np.sum((slopes @ covariance) * slopes))
        return float(np.sqrt(np.mean(errors))), float(
            np.sqrt(max(excess / expected, 1.0))
        )


def _covariance(slopes: Floats) -> Floats:
    """Gauss-Newton covariance with the prior as it is: a stronger one chosen for the fit is no knowledge."""
    inverse = np.linalg.inv(slopes.T @ slopes + np.eye(slopes.shape[1]))
    return 0.5 * (inverse + inverse.T)


def _groups(segments: Sequence[Segment]) -> Integers:
    """Which segments are held out together: of a trial, of every fifth one, or a third of a single one."""
    trial = np.array([segment.trial for segment in segments])
    if trial.max() == trial.min():
        return np.arange(len(trial)) * PIECES // len(trial)
    return trial % MOST_GROUPS
