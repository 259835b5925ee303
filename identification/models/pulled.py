"""Coefficients pulled toward what is known of similar ships: what holds in hard turns.

Generalised ridge regression: |y - X w|^2 + (w - w0)' S (w - w0) is made small by
fitting w - w0 to the samples and to the root of S as further samples (Hoerl & Kennard
1970; Tikhonov 1963). w0 and S are those of a `Prior`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from identification.arrays import by_name, mean_square
from identification.estimators.estimator import Estimator, Estimators, FitTask
from identification.models.formulas import FORMULAS
from identification.models.guard import reasons_unstable, with_coefficients
from identification.models.methods import Method
from identification.models.prior import Prior, formula_prior, reference_prior
from identification.models.prior_knowledge import PriorKnowledge
from identification.samples.folds import TRIALS, Fold, sample_folds
from identification.samples.samples import Samples
from shipgym import InputError, ShipModel
from shipgym.arrays import Flags, Floats
from shipgym.ships import GreyBox

STRENGTHS: tuple[float, ...] = (0.0, *np.geomspace(1e-4, 10.0, 11).tolist(), np.inf)


def with_prior(method: Method, knowledge: PriorKnowledge, blank: ShipModel) -> Method:
    """The method, with its coefficients pulled toward a prior.

    The method fits what the prior leaves: where it drops a direction, the prior's
    coefficients stay. `knowledge`: its source is "auto", "clarke", "kijima", or a
    reference ship; a strength of 0 leaves the method as it is, infinity gives the
    prior, None chooses by cross-validation (`Pulled.chosen_strength`); `blank`: the
    target but for its coefficients. Raises InputError for a grey box, which has a
    reference ship, and for a prior without coefficients for the structure.
    """
    source = knowledge.source
    assert source is not None
    if isinstance(blank.table, GreyBox):
        raise InputError(
            "prior: expected none with structure 'grey-box', which has a reference"
            f" ship already, got {source!r}; leave the prior out, or choose another"
            " structure"
        )
    if isinstance(source, str) and source in FORMULAS:
        prior = formula_prior(source, blank)
    else:
        prior = reference_prior(source, blank)

    def fit(make: Callable[[], Estimator], task: FitTask) -> Estimators:
        pulled = Pulled(method, make, prior, task)
        return pulled.fitted(knowledge.strength, knowledge.folds)

    return replace(method, fit=fit)


@dataclass(frozen=True, eq=False)
class Pulled:
    """A method whose coefficients are pulled toward a prior."""

    method: Method  # fits where there is no pull
    make: Callable[[], Estimator]  # makes an unfitted estimator
    prior: Prior
    task: FitTask  # with the regression

    def at(self, strength: float, samples: Samples | None = None) -> Estimators:
        """Fit with a strength: 0 is the method as it is, infinity the prior."""
        if samples is None:
            samples = self.task.samples
        if strength == 0.0:
            task = replace(self.task, samples=samples)
            return self.method.fit(self.make, task)
        return {
            q: pulled_estimator(self.make(), samples, q, self.prior, strength)
            for q in samples.features
        }

    def fitted(self, strength: float | None, folds: str) -> Estimators:
        """Fit with the strength given, or chosen; `prior_` of each reports on it."""
        report: dict[str, Any] = {"prior_source": self.prior.name}
        if strength is None:
            best, scores = self.chosen_strength(folds)
            report["prior_scores"] = scores
            strength = self.steady_strength(best)
            if strength > best:
                report["prior_raised_from"] = best
        # JSON knows no infinity
        is_finite = np.isfinite(strength)
        report["prior_strength"] = strength if is_finite else None

        estimators = self.at(strength)
        for estimator in estimators.values():
            estimator.prior_ = report  # type: ignore[attr-defined]
        return estimators

    def steady_strength(self, least: float) -> float:
        """The least strength, from a given one on, with which no model runs away.

        The given one where there is none.
        """
        task = self.task
        first = STRENGTHS.index(least)
        for strength in STRENGTHS[first:]:
            estimators = self.at(strength)
            model = with_coefficients(task.blank, estimators)
            if not reasons_unstable(model, task.trials):
                return strength
        return least

    def chosen_strength(self, folds: str = TRIALS) -> tuple[float, dict[str, float]]:
        """The strongest pull that is as good as the best on samples held out.

        Held out are the trials one by one, or blocks of time of a single trial, or each
        of those with the largest rudder by a fit to all that have less. Returns the
        error of each strength too, a mean square by that of no change at all.
        """
        splits = sample_folds(self.task.trials, self.task.samples, folds)
        errors = np.array([self._held_out(strength, splits) for strength in STRENGTHS])
        names = [f"{strength:.3g}" for strength in STRENGTHS]
        scores = by_name(names, errors.mean(axis=1))
        chosen = strongest_as_good(errors)
        return float(STRENGTHS[chosen]), scores

    def _held_out(self, strength: float, splits: Sequence[Fold]) -> list[float]:
        """Errors of fits with a strength on what each split holds out."""
        errors = []
        for split in splits:
            estimators = self.at(strength, split.fit)
            error = relative_error(estimators, split.held)
            errors.append(error)
        return errors


def strongest_as_good(errors: Floats) -> int:
    """The last row of errors that is as good as the best.

    Within one standard error of the best (Breiman et al. 1984), because what the prior
    is for, hard turns, is in none of the folds. `errors` have the shape (n_strengths,
    n_folds).
    """
    mean = errors.mean(axis=1)
    best = int(np.argmin(mean))
    excess = errors - errors[best]
    deviation = excess.std(axis=1)

    n_folds = errors.shape[1]
    freedom = max(n_folds - 1, 1)
    standard_error = deviation / np.sqrt(freedom)
    as_good = excess.mean(axis=1) <= standard_error
    places = np.flatnonzero(as_good)
    return int(places[-1])


def pulled_estimator(
    estimator: Estimator,
    samples: Samples,
    q: str,
    prior: Prior,
    strength: float,
) -> Estimator:
    """Fit the samples of an equation, and the prior as further ones."""
    X = samples.features[q]
    centre = prior.centre[q]
    rest = samples.targets[q] - X @ centre
    if np.isinf(strength):
        return _prior_itself(estimator, X, rest, centre, prior.known[q])

    pull = _pull(samples.duration, prior.roots[q], strength)
    no_change = np.zeros(len(pull))
    estimator.fit(
        np.vstack([X, pull]),
        np.concatenate([rest, no_change]),
    )
    estimator.coef_ = estimator.coef_ + centre
    if hasattr(estimator, "weights_"):
        estimator.weights_ = estimator.weights_[: len(X)]
    return estimator


def _pull(durations: Floats, root: Floats, strength: float) -> Floats:
    """Features of the prior, which count as samples do, whatever their number.

    `durations`: of the samples, s.
    """
    n_samples = len(durations)
    window = float(np.mean(durations))
    weight = strength * np.sqrt(n_samples) * window
    return np.asarray(weight * root)


def _prior_itself(
    estimator: Estimator,
    X: Floats,
    rest: Floats,
    centre: Floats,
    known: Flags,
) -> Estimator:
    """The prior's own coefficients; those it leaves open are fitted."""
    n_terms = len(known)
    free = np.flatnonzero(~known)
    coefficients = centre.copy()
    moment = np.zeros((n_terms, n_terms))
    covariance = np.zeros((n_terms, n_terms))
    if free.size:
        estimator.fit(X[:, free], rest)
        among_free = np.ix_(free, free)
        coefficients[free] = estimator.coef_
        moment[among_free] = estimator.inverse_moment_
        covariance[among_free] = estimator.covariance_
    else:
        estimator.fit(X, rest)  # for its attributes alone

    estimator.coef_ = coefficients
    estimator.inverse_moment_ = moment
    estimator.covariance_ = covariance
    estimator.n_features_in_ = n_terms  # type: ignore[attr-defined]
    return estimator


def relative_error(estimators: Mapping[str, Estimator], held: Samples) -> float:
    """Mean square error of the targets by their mean square, mean over equations."""
    smallest = np.finfo(float).tiny
    ratios = []
    for q, targets in held.targets.items():
        features = held.features[q]
        predicted = features @ estimators[q].coef_
        error = mean_square(targets - predicted)
        size = max(mean_square(targets), smallest)
        ratios.append(error / size)
    return float(np.mean(ratios))
