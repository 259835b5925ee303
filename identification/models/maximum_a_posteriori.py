"""The coefficients of the MMG form that trials and prior make most probable.

How much narrower the prior is made, the trials decide, each predicted from the others.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from identification.arrays import by_name
from identification.models.hull_formulas import YOSHIMURA
from identification.models.mmg_prior import MMGPrior, mmg_prior
from identification.models.posterior import Estimate, HeldOutError, Posterior
from identification.models.prior_knowledge import PriorKnowledge
from shipgym import ShipModel, Trial
from shipgym.arrays import Floats
from shipgym.ships.mmg import IDENTIFIED


class _Candidate(NamedTuple):
    """An estimate by one strength of the prior, and how it predicts what it omits."""

    estimate: Estimate
    held_out: HeldOutError


@dataclass(frozen=True, eq=False)
class MMGFit:
    """The MMG form of greatest probability."""

    model: ShipModel  # with its covariance
    report: dict[str, Any]  # for the provenance
    posterior: Posterior
    estimate: Estimate

    @property
    def free_coefficients(self) -> int:
        """Number of coefficients that the trials, and not the prior, determine.

        The trace of the resolution: 1 for what the prior says nothing of, 0 for what
        the trials say nothing of.
        """
        variances = np.linalg.eigvalsh(self.estimate.covariance)
        of_trials = 1.0 / variances - 1.0
        of_prior = self.estimate.strength**2
        resolved = of_trials / (of_trials + of_prior)
        return max(round(float(resolved.sum())), 1)

    def without(self, trials: Sequence[int]) -> ShipModel:
        """The model of the other trials, by their places."""
        z = self.posterior.without_trials(trials, self.estimate)
        return self.posterior.model(z)


def fit_mmg(blank: ShipModel, trials: Sequence[Trial], asked: PriorKnowledge) -> MMGFit:
    """The MMG form of greatest probability, with its covariance, and a report.

    The prior is a reference ship, or formulas, by default those of Yoshimura & Masumoto
    2012. By its strength its standard deviations are divided; by default it is the
    strongest of 1, 2, 3 whose error, each trial predicted from the others, is within a
    tenth of the least. The report is for the provenance.
    """
    prior = mmg_prior(asked.source or YOSHIMURA, blank.particulars)
    ship = replace(blank, particulars=prior.ship)
    posterior = Posterior(ship, trials, prior)
    candidates = _candidates(posterior, _strengths(asked))
    errors = [candidate.held_out.error for candidate in candidates]
    best = strongest_as_good(errors)
    chosen = candidates[best]

    model = _chosen_model(posterior, chosen)
    report = _report(posterior, candidates, chosen)
    return MMGFit(model, report, posterior, chosen.estimate)


def _chosen_model(posterior: Posterior, chosen: _Candidate) -> ShipModel:
    """The model of an estimate, its covariance widened by the errors held out."""
    estimate, held_out = chosen
    widened = held_out.factor**2 * estimate.covariance
    model = posterior.model(estimate.z)
    covariance = _coefficient_covariance(posterior.mmg_prior, widened)
    return replace(model, covariance=covariance)


def _strengths(asked: PriorKnowledge) -> tuple[float, ...]:
    """Strengths of the prior to choose from, or the one that was given."""
    if asked.strength is None:
        return 1.0, 2.0, 3.0
    return (asked.strength,)


def _candidates(posterior: Posterior, strengths: Sequence[float]) -> list[_Candidate]:
    """Estimates by rising strength, each begun where the one before it ended."""
    estimates = list[Estimate]()
    z = np.zeros(len(IDENTIFIED))
    for strength in strengths:
        estimate = posterior.most_probable(z, strength)
        estimates.append(estimate)
        z = estimate.z

    # errors are compared in the same scales
    scales = estimates[0].scales
    candidates = []
    for estimate in estimates:
        held_out = posterior.held_out(estimate, scales)
        candidates.append(_Candidate(estimate, held_out))
    return candidates


def strongest_as_good(errors: list[float]) -> int:
    """The last of errors by strength that is within a tenth of the least."""
    largest = 1.1 * min(errors)
    as_good = [k for k, error in enumerate(errors) if error <= largest]
    return as_good[-1]


def _coefficient_covariance(prior: MMGPrior, covariance: Floats) -> Floats:
    """Covariance of all coefficients from that of z; 0 of those known beforehand."""
    n_coefficients = len(prior.mean)
    whole = np.zeros((n_coefficients, n_coefficients))
    identified = slice(len(IDENTIFIED))
    units = np.outer(prior.deviation, prior.deviation)
    whole[identified, identified] = covariance * units
    return whole


def _report(
    posterior: Posterior, candidates: Sequence[_Candidate], chosen: _Candidate
) -> dict[str, Any]:
    """For the provenance."""
    errors = dict[str, float]()
    evaluations = 0
    for estimate, held_out in candidates:
        errors[f"{estimate.strength:g}"] = held_out.error
        evaluations += estimate.evaluations

    best = chosen.estimate
    return _prior_report(posterior.mmg_prior) | {
        "prior_strength": best.strength,
        "errors_held_out": errors,
        "model_error": {
            "factor": chosen.held_out.factor,
            "how": "simulated segments of trials left out in turn",
        },
        "segments": len(posterior.segments),
        "evaluations": evaluations,
        "residual_rms": by_name(posterior.channels, best.scales),
        "deviations_from_prior": by_name(IDENTIFIED, best.z.round(3)),
    }


def _prior_report(prior: MMGPrior) -> dict[str, Any]:
    report: dict[str, Any] = {"prior": prior.source}
    if prior.similarity:
        report["similarity"] = dict(prior.similarity)
    if prior.remarks:
        report["prior_remarks"] = list(prior.remarks)
    return report
