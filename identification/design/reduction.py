"""Which terms a regression needs, by backward elimination.

Among the terms that are uncertain or belong to a collinear group the one of largest
relative standard error is dropped, unless what is held out is then explained worse (Xu
2020, section 5). Held out are five stretches of the samples, each predicted from the
others.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from rich.table import Table

from identification.arrays import by_name, column_rms, mean_square
from identification.estimators.lssvm import TruncatedLSSVM
from identification.judging.diagnostics import (
    COLLINEAR,
    correlation_matrix,
    variance_inflation,
)
from identification.pipeline import identify
from identification.pipeline.result import IdentificationResult
from identification.text import as_text
from shipgym import InputError, Trial, register_structure
from shipgym.arrays import Floats, finite
from shipgym.ships import GreyBox, Structure

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


@dataclass(frozen=True)
class Reduction:
    """The path of a reduction, whose last model is chosen.

    Attributes
    ----------
    path : tuple of ReductionStep
        In the order in which terms were dropped.
    """

    path: tuple[ReductionStep, ...]

    @property
    def terms(self) -> tuple[str, ...]:
        """Terms of the chosen model."""
        return self.path[-1].terms

    @property
    def coefficients(self) -> dict[str, float]:
        """Coefficients of the chosen model."""
        return self.path[-1].coefficients

    def __str__(self) -> str:
        headings = ("terms", "dropped", "worst relative error", "R2", "held-out R2")
        table = Table(*headings)
        for step in self.path:
            errors = step.relative_errors
            worst = max(errors, key=lambda name: errors[name])
            table.add_row(
                str(len(step.terms)),
                step.changed,
                f"{errors[worst]:.3g} ({worst})",
                f"{step.r_squared:.6f}",
                f"{step.held_out:.6f}",
            )
        return as_text(table)


@dataclass(frozen=True, eq=False)
class _Regression:
    """Features and targets of an equation, in time order."""

    features: Floats  # shape (n_samples, n_terms)
    targets: Floats  # shape (n_samples,)
    names: list[str]  # of the terms

    def fitted(self, kept: Sequence[int], changed: str) -> ReductionStep:
        """The model of some terms."""
        # scikit-learn takes a second to import
        from sklearn.model_selection import KFold, cross_val_predict

        X, y = self.features[:, kept], self.targets
        names = tuple(self.names[term] for term in kept)
        estimator = TruncatedLSSVM(selection="full", fit_intercept=False)
        estimator.fit(X, y)
        held_out = cross_val_predict(
            estimator,
            X,
            y,
            cv=KFold(FOLDS),
        )
        errors = _relative_errors(estimator, y - X @ estimator.coef_)
        return ReductionStep(
            terms=names,
            changed=changed,
            coefficients=by_name(names, estimator.coef_),
            relative_errors=by_name(names, errors),
            r_squared=self._explained(X @ estimator.coef_),
            held_out=self._explained(held_out),
        )

    def _explained(self, predicted: Floats) -> float:
        """Share of the targets that a prediction explains."""
        return 1.0 - mean_square(self.targets - predicted) / mean_square(self.targets)


def _relative_errors(estimator: TruncatedLSSVM, left: Floats) -> Floats:
    """Standard errors by the sizes of the coefficients, from what the fit left."""
    variance = left @ left / max(len(left) - estimator.rank_, 1)
    deviations = np.sqrt(variance * np.diag(estimator.inverse_moment_))
    with np.errstate(divide="ignore"):  # infinite for a coefficient of 0
        return deviations / np.abs(estimator.coef_)


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
    kept = list(range(len(regression.names)))
    path = [regression.fitted(kept, "")]
    best = path[0].held_out

    def order(term: int) -> tuple[bool, float, int]:
        name = regression.names[term]
        # rounded, so that of two terms that say the same every computer drops the first
        error = float(f"{path[-1].relative_errors[name]:.6g}")
        return name in prefer, -error, term

    def without_one() -> ReductionStep | None:
        """The first model without one term that explains enough; None for none."""
        errors = path[-1].relative_errors
        uncertain = {k for k in kept if errors[regression.names[k]] > threshold}
        candidates = uncertain | collinear_terms(regression.features, kept)
        for term in sorted(candidates, key=order):
            fewer = [other for other in kept if other != term]
            step = regression.fitted(fewer, regression.names[term])
            if step.held_out >= best - tolerance:
                return step
        return None

    while len(kept) > 1 and (step := without_one()) is not None:
        path.append(step)
        kept.remove(regression.names.index(step.changed))
        best = max(best, step.held_out)
    return Reduction(tuple(path))


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
    features = np.asarray(
        X,
        dtype=float,
    )
    targets = np.asarray(y, dtype=float)
    labels = list(names)
    if len(targets) < FOLDS * max(len(labels), 2):
        raise InputError(
            f"X: expected at least {FOLDS} times as many samples as terms, got"
            f" {len(targets)} samples for {len(labels)} terms"
        )
    for name, column in zip((*labels, "y"), (*features.T, targets), strict=True):
        if not column.any():
            raise InputError(f"X, y: expected {name} to be excited, got 0 throughout")
    return _Regression(features, targets, labels)


@dataclass(frozen=True, eq=False)
class ReducedIdentification:
    """A structure reduced on its trials, and both models.

    Attributes
    ----------
    full : IdentificationResult
        With all terms.
    reductions : dict of str to Reduction
        By equation, the path and the terms chosen.
    structure : Structure
        Of the terms chosen, registered by its name.
    reduced : IdentificationResult
        With it.
    """

    full: IdentificationResult
    reductions: dict[str, Reduction]
    structure: Structure
    reduced: IdentificationResult

    def to_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON; infinite errors are null."""
        full, reduced = self.full, self.reduced
        equations = {}
        for q, reduction in self.reductions.items():
            path = [asdict(step) for step in reduction.path]
            for step in path:
                errors = step["relative_errors"].items()
                step["relative_errors"] = {name: finite(one) for name, one in errors}
            equations[q] = path
        return {
            "structure": self.structure.name,
            "equations": equations,
            "terms": {
                "full": len(full.coefficients),
                "reduced": len(reduced.coefficients),
            },
            "trials": {
                "full": full.metrics["trials"],
                "reduced": reduced.metrics["trials"],
            },
        }


def identify_reduced(
    trials: Sequence[Trial],
    tolerance: float = 1e-3,
    **arguments: Any,
) -> ReducedIdentification:
    """Identify a structure, reduce it on the same samples, and identify what is left.

    Raises InputError for a grey box, whose table is what its reference ship leaves, for
    a structure with a memory of yaw, and for fewer than five samples a term.

    Parameters
    ----------
    trials : sequence of Trial
        As for `identify`. Those held out have no part in the reduction either.
    tolerance : float
        By how much the R2 of stretches held out may fall.
    **arguments
        Of `identify`.
    """
    full = identify(trials, **arguments)
    table = full.model.table
    _check_reducible(table)
    reductions = {
        q: backward_elimination(X, y, table.names(q), tolerance=tolerance)
        for q, X, y in full.samples.by_equation()
    }
    smaller = reduced_structure(table, reductions)
    names = [smaller.names(q) for q in smaller.equations]
    digest = hashlib.sha256(repr(names).encode()).hexdigest()
    registered = register_structure(
        f"{table.name}-{digest[:6]}",
        smaller.equations,
        smaller.source,
        smaller.normalisation,
        smaller.quantity,
    )
    reduced = identify(trials, **{**arguments, "structure": registered.name})
    return ReducedIdentification(full, reductions, registered, reduced)


def _check_reducible(table: Structure) -> None:
    """Refuse a structure whose equations are not those of its regression."""
    if isinstance(table, GreyBox):
        raise InputError(
            "structure: expected one of its own to reduce, such as 'abkowitz', got"
            f" {table.name!r}, whose table adds to a reference ship"
        )
    if tuple(table.regressed) != tuple(table.equations):
        raise InputError(
            "structure: expected one without memory to reduce, such as 'abkowitz', got"
            f" {table.name!r}, whose memory of yaw has no regression of its own"
        )


def reduced_structure(
    structure: Structure, reductions: Mapping[str, Reduction]
) -> Structure:
    """The structure with the terms that were chosen.

    Of forces, sway and yaw, which inertia couples, keep the
    terms that either needs.
    """
    kept = {}
    for q, terms in structure.equations.items():
        labels = zip(terms, structure.names(q), strict=True)
        chosen = reductions[q].terms
        kept[q] = {term.name for term, label in labels if label in chosen}
    if structure.quantity == "force" and {"v", "r"} <= kept.keys():
        kept["v"] = kept["r"] = kept["v"] | kept["r"]
    equations = {}
    for q, terms in structure.equations.items():
        equations[q] = tuple(term for term in terms if term.name in kept[q])
    source = f"{structure.source}; reduced"
    return replace(structure, source=source, equations=equations)
