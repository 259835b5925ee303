"""The coefficients of the MMG form that trials and prior make most probable.

Compared are segments back to back, each started from the smoothed measurement. How much
narrower the prior is made, the trials decide, each predicted from the others.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from identification.arrays import by_name
from identification.least_squares import Linearised
from identification.models.mmg_prior import MMGPrior, mmg_prior
from identification.models.prior_knowledge import PriorKnowledge
from identification.models.sailed import (
    CoefficientPrior,
    Sailed,
    covariance_of,
    with_prior,
)
from identification.models.segments import compared_channels, cut
from shipgym import ShipModel, Trial
from shipgym.arrays import Flags, Floats, Integers
from shipgym.ships.mmg import IDENTIFIED


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
    return replace(chosen, report=_prior_report(prior) | _report(fits, chosen))


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


def _prior_report(prior: MMGPrior) -> dict[str, Any]:
    report: dict[str, Any] = {"prior": prior.source}
    if prior.remarks:
        report["prior_remarks"] = list(prior.remarks)
    return report
