"""Which terms a regression needs, by backward elimination.

Among the terms that are uncertain or belong to a collinear group the one of largest
relative standard error is dropped, unless what is held out is then explained worse (Xu
2020, section 5). Held out are five stretches of the samples, each predicted from the
others.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from rich.table import Table

from identification.arrays import by_name, column_rms
from identification.estimators.lssvm import TruncatedLSSVM
from identification.judging.diagnostics import (
    COLLINEAR,
    correlation_matrix,
    variance_inflation,
)
from identification.text import as_text
from shipgym import InputError
from shipgym.arrays import Floats
from shipgym.checks import check_number

FOLDS = 5


@dataclass(frozen=True)
class ReductionStep:
    """A model on the path."""

    terms: tuple[str, ...]  # its terms
    # the term dropped to get here; empty for the first model
    changed: str
    #: of each term: coefficient, and standard error by its size
    coefficients: dict[str, float]
    relative_errors: dict[str, float]
    #: share of the targets that is explained: of all samples, and of stretches
    #: predicted from the others
    r_squared: float
    held_out: float
    # share that the change explains of all: negative, for the first model all
    error_reduction: float


@dataclass(frozen=True)
class Reduction:
    """The whole path of a reduction and the model that it chose.

    Attributes
    ----------
    path : tuple of ReductionStep
        In the order in which terms were dropped or added.
    chosen : int
        Which of them.
    """

    path: tuple[ReductionStep, ...]
    chosen: int

    @property
    def terms(self) -> tuple[str, ...]:
        """Terms of the chosen model."""
        return self.path[self.chosen].terms

    @property
    def coefficients(self) -> dict[str, float]:
        """Coefficients of the chosen model."""
        return self.path[self.chosen].coefficients

    def __str__(self) -> str:
        headings = ("terms", "changed", "worst relative error", "R2", "held-out R2", "")
        table = Table(*headings)
        for k, step in enumerate(self.path):
            errors = step.relative_errors
            worst = max(errors, key=lambda name: errors[name])
            table.add_row(
                str(len(step.terms)),
                step.changed,
                f"{errors[worst]:.3g} ({worst})",
                f"{step.r_squared:.6f}",
                f"{step.held_out:.6f}",
                "chosen" if k == self.chosen else "",
            )
        return as_text(table)


@dataclass(frozen=True, eq=False)
class _Regression:
    """Features and targets of an equation, in time order."""

    features: Floats  # shape (n_samples, n_terms)
    targets: Floats  # shape (n_samples,)
    names: list[str]  # of the terms

    def fitted(self, kept: Sequence[int], changed: str, before: float) -> ReductionStep:
        """The model of some terms; `before`: the share explained before the change."""
        # scikit-learn takes a second to import
        from sklearn.model_selection import KFold, cross_val_predict

        X, y = self.features[:, kept], self.targets
        names = tuple(self.names[term] for term in kept)
        estimator = TruncatedLSSVM(selection="full", fit_intercept=False)
        estimator.fit(X, y)
        predicted = cross_val_predict(estimator, X, y, cv=KFold(FOLDS))

        r_squared = self._explained(X @ estimator.coef_)
        return ReductionStep(
            terms=names,
            changed=changed,
            coefficients=by_name(names, estimator.coef_),
            relative_errors=by_name(names, _relative_errors(estimator)),
            r_squared=r_squared,
            held_out=self._explained(predicted),
            error_reduction=r_squared - before if changed else r_squared,
        )

    def _explained(self, predicted: Floats) -> float:
        """Share of the targets that a prediction explains."""
        left = self.targets - predicted
        power = float(self.targets @ self.targets)
        unexplained = float(left @ left)
        return 1.0 - unexplained / power


def _relative_errors(estimator: TruncatedLSSVM) -> Floats:
    """Standard errors of the coefficients by their sizes, infinite for one of 0."""
    variances = np.diag(estimator.covariance_)
    size = np.abs(estimator.coef_)
    errors = np.full(len(size), np.inf)
    np.divide(
        np.sqrt(variances),
        size,
        out=errors,
        where=size > 0.0,
    )
    return errors


def backward_elimination(
    X: ArrayLike,
    y: ArrayLike,
    names: Sequence[str],
    tolerance: float = 1e-3,
    threshold: float = 0.1,
    prefer: Sequence[str] = (),
) -> Reduction:
    """Drop terms one by one as long as held-out data is explained equally well.

    Returns a Reduction whose path ends with the chosen model. Raises InputError for
    shapes that do not fit and fewer than five samples a term.

    Parameters
    ----------
    X : array-like of shape (n_samples, n_terms)
        Features, in time order.
    y : array-like of shape (n_samples,)
        Targets.
    names : sequence of str
        Of the terms.
    tolerance : float
        By how much the held-out R2 may fall below the best seen.
    threshold : float
        Relative standard error above which a term is a candidate; terms of a collinear
        group always are.
    prefer : sequence of str
        Terms that are dropped only where no other candidate can be: where two say the
        same, it decides.
    """
    regression = _checked(X, y, names)
    check_number(tolerance, "tolerance", at_least=0.0)
    check_number(threshold, "threshold", at_least=0.0)
    kept = list(range(len(regression.names)))
    path = [regression.fitted(kept, "", 0.0)]
    best = path[0].held_out
    while len(kept) > 1:
        step = _without_one(
            regression,
            kept,
            path[-1],
            threshold=threshold,
            prefer=prefer,
            least=best - tolerance,
        )
        if step is None:
            break
        path.append(step)
        kept.remove(regression.names.index(step.changed))
        best = max(best, step.held_out)
    return Reduction(tuple(path), chosen=len(path) - 1)


def _without_one(
    regression: _Regression,
    kept: Sequence[int],
    last: ReductionStep,
    threshold: float,
    prefer: Sequence[str],
    least: float,
) -> ReductionStep | None:
    """The first model without one term that explains at least as much; None for none.

    Compared is the share explained of what is held out, with the `least` one.
    """
    names = regression.names
    errors = last.relative_errors
    uncertain = {term for term in kept if errors[names[term]] > threshold}
    candidates = uncertain | collinear_terms(regression.features, kept)

    def order(term: int) -> tuple[bool, float, int]:
        name = names[term]
        # rounded, so that of two terms that say the same every computer drops the first
        error = float(f"{errors[name]:.6g}")
        return name in prefer, -error, term

    for term in sorted(candidates, key=order):
        fewer = [other for other in kept if other != term]
        step = regression.fitted(fewer, names[term], last.r_squared)
        if step.held_out >= least:
            return step
    return None


def collinear_terms(features: Floats, kept: Sequence[int]) -> set[int]:
    """Terms that others nearly make up, by pair or by variance inflation."""
    own = features[:, kept]
    scaled = own / column_rms(own)
    correlation = np.abs(correlation_matrix(scaled))
    np.fill_diagonal(correlation, 0.0)
    in_pair = np.any(correlation > COLLINEAR, axis=0)

    # that of two terms whose correlation is at the limit
    largest_inflation = 1.0 / (1.0 - COLLINEAR**2)
    by_all = variance_inflation(scaled) > largest_inflation
    places = np.flatnonzero(in_pair | by_all).tolist()
    return {kept[place] for place in places}


def _checked(X: ArrayLike, y: ArrayLike, names: Sequence[str]) -> _Regression:
    """The regression; InputError for wrong shapes and samples that say nothing."""
    features = np.asarray(X, dtype=float)
    targets = np.asarray(y, dtype=float)
    labels = list(names)
    if features.ndim != 2 or (len(targets), len(labels)) != features.shape:
        raise InputError(
            "X, y, names: expected the shapes (n_samples, n_terms) and (n_samples,)"
            f" and one name a term, got {features.shape}, {targets.shape} and"
            f" {len(labels)} names"
        )
    if not (np.isfinite(features).all() and np.isfinite(targets).all()):
        raise InputError(
            "X, y: expected numbers, got a value that is not finite; repair the samples"
            " first"
        )
    if len(targets) < FOLDS * max(len(labels), 2):
        raise InputError(
            f"X: expected at least {FOLDS} times as many samples as terms, got"
            f" {len(targets)} samples for {len(labels)} terms"
        )
    excited = np.append(features.any(axis=0), targets.any())
    for name, moves in zip((*labels, "y"), excited, strict=True):
        if not moves:
            raise InputError(f"X, y: expected {name} to be excited, got 0 throughout")
    return _Regression(features, targets, labels)
