"""Which terms a model needs: backward elimination, forward selection, and sensitivity of a manoeuvre.

Backward (Xu 2020, section 5; leave-one-out): among the terms that are uncertain or
belong to a collinear group drop the one of largest relative standard error, unless what
is held out is then explained worse. Forward (Chen, Billings & Luo 1989, Int. J. Control
50(5)): by orthogonal least squares add the term that explains most of what is left.
Held out are five stretches of the samples, each predicted from the others.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from rich.table import Table

from identification.estimators.lssvm import TruncatedLSSVM
from identification.regression.samples import Samples
from identification.text import as_text
from identification.validation.diagnostics import COLLINEAR, JITTER, variance_inflation
from shipgym import InputError, ShipModel, Trial, UnstableModelError
from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_number
from shipgym.ships import Structure

FOLDS = 5
SENSED = ("u", "v", "r", "psi")


@dataclass(frozen=True)
class ReductionStep:
    """A model on the path."""

    terms: tuple[str, ...]  # its terms
    # the term dropped or added to get here; empty for the first model of an elimination
    changed: str
    #: of each term: coefficient, and standard error by its size
    coefficients: dict[str, float]
    relative_errors: dict[str, float]
    #: share of the targets that is explained: of all samples, and of stretches
    #: predicted from the others
    r_squared: float
    held_out: float
    # share that the change explains of all (negative for a term that was dropped)
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
        table = Table(
            "terms", "changed", "worst relative error", "R2", "held-out R2", ""
        )
        for k, step in enumerate(self.path):
            worst = max(
                step.relative_errors, key=lambda name: step.relative_errors[name]
            )
            table.add_row(
                str(len(step.terms)),
                step.changed,
                f"{step.relative_errors[worst]:.3g} ({worst})",
                f"{step.r_squared:.6f}",
                f"{step.held_out:.6f}",
                "chosen" if k == self.chosen else "",
            )
        return as_text(table)


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
    features, targets, labels = _checked(X, y, names)
    check_number(tolerance, "tolerance", at_least=0.0)
    check_number(threshold, "threshold", at_least=0.0)
    kept = list(range(len(labels)))
    path = [_step(features, targets, labels, kept, "", 0.0)]
    best = path[0].held_out
    while len(kept) > 1:
        errors = path[-1].relative_errors
        uncertain = {i for i in kept if errors[labels[i]] > threshold} | _collinear(
            features, kept
        )
        # rounded, so that of two terms that say the same every computer drops the first
        error = {i: float(f"{errors[labels[i]]:.6g}") for i in uncertain}
        for term in sorted(
            uncertain, key=lambda i: (labels[i] in prefer, -error[i], i)
        ):
            fewer = [i for i in kept if i != term]
            step = _step(
                features, targets, labels, fewer, labels[term], path[-1].r_squared
            )
            if step.held_out >= best - tolerance:
                path.append(step)
                kept, best = fewer, max(best, step.held_out)
                break
        else:
            break
    return Reduction(tuple(path), len(path) - 1)


def forward_selection(
    X: ArrayLike,
    y: ArrayLike,
    names: Sequence[str],
    tolerance: float = 1e-3,
    most: int | None = None,
) -> Reduction:
    """Add terms by error reduction ratio; choose the shortest model near the best on what is held out.

    Returns a Reduction whose path goes on beyond the chosen model. Raises InputError
    for shapes that do not fit and fewer than five samples a term.

    Parameters
    ----------
    X, y, names
        As in `backward_elimination`.
    tolerance : float
        By how much the held-out R2 of the chosen model may lie below the best of the
        path.
    most : int, optional
        Terms at which to stop.
    """
    features, targets, labels = _checked(X, y, names)
    check_number(tolerance, "tolerance", at_least=0.0)
    rest = features / np.sqrt(np.mean(features**2, axis=0))
    left = targets.copy()
    chosen, path = list[int](), list[ReductionStep]()
    while len(chosen) < min(most or len(labels), len(labels)):
        size = np.einsum("ij,ij->j", rest, rest)
        usable = (
            size > len(targets) * JITTER
        )  # what the terms before do not say already
        if not usable.any():
            break
        ratio = np.where(
            usable, (rest.T @ left) ** 2 / np.where(usable, size, 1.0), -1.0
        )
        term = int(np.argmax(ratio))
        direction = rest[:, term] / np.sqrt(size[term])
        left = left - direction * (direction @ left)
        rest = rest - np.outer(direction, direction @ rest)
        chosen.append(term)
        before = path[-1].r_squared if path else 0.0
        path.append(_step(features, targets, labels, chosen, labels[term], before))
    best = max(step.held_out for step in path)
    first = next(k for k, step in enumerate(path) if step.held_out >= best - tolerance)
    return Reduction(tuple(path), first)


def reduce(
    samples: Samples,
    structure: Structure,
    direction: str = "backward",
    tolerance: float = 1e-3,
) -> dict[str, Reduction]:
    """Reduce each equation of a structure by elimination ("backward") or selection ("forward").

    Returns the reductions by equation, with the coefficients of the features in SI
    units; the tolerance is that of the held-out R2.
    """
    check_choice(direction, ("backward", "forward"), "direction")
    run = backward_elimination if direction == "backward" else forward_selection
    return {
        q: run(
            samples.features[q],
            samples.targets[q],
            structure.names(q),
            tolerance=tolerance,
        )
        for q in structure.equations
    }


def reduced_structure(
    structure: Structure, reductions: dict[str, Reduction], name: str
) -> Structure:
    """The structure, by a name of its own, with the terms that were chosen; register it to identify it.

    Of forces, sway and yaw, which inertia couples, keep the terms that either needs.
    """
    kept = {
        q: {
            t.name
            for t, label in zip(structure.terms(q), structure.names(q), strict=True)
            if label in reductions[q].terms
        }
        for q in structure.equations
    }
    if structure.quantity == "force" and {"v", "r"} <= kept.keys():
        kept["v"] = kept["r"] = kept["v"] | kept["r"]
    equations = {
        q: tuple(t for t in structure.terms(q) if t.name in kept[q])
        for q in structure.equations
    }
    return replace(
        structure, name=name, source=f"{structure.source}; reduced", equations=equations
    )


def table_of(model: ShipModel) -> Structure:
    """The table of terms of a model; InputError for a ship with equations written by hand."""
    if not isinstance(model.dynamics, Structure):
        raise InputError(
            f"structure: {model.structure!r} found, expected a table of terms, as"
            " 'abkowitz'"
        )
    return model.table


def sensitivity(
    model: ShipModel, manoeuvre: Callable[[ShipModel], Trial], change: float = 0.01
) -> dict[str, float]:
    """Change of a simulated manoeuvre per per cent of each coefficient (Cao 2015).

    Raises InputError for a ship with equations written by hand.

    Parameters
    ----------
    model : ShipModel
        With a table of terms.
    manoeuvre : callable
        Simulates it with a model, such as ``zigzag``.
    change : float
        Relative step to either side.

    Returns
    -------
    dict of str to float
        By coefficient, the largest first: root mean square change of u, v, r and psi,
        each by its span, in per cent per per cent. Infinite where the changed ship runs
        away.
    """
    check_number(change, "change", above=0.0, below=1.0)
    table_of(model)
    base = manoeuvre(model)
    spans, found = (
        {c: float(np.ptp(base[c])) for c in SENSED if np.ptp(base[c]) > 0.0},
        {},
    )
    for name, value in model.coefficients.items():
        try:
            up, down = (
                manoeuvre(
                    replace(
                        model, coefficients={**model.coefficients, name: value * factor}
                    )
                )
                for factor in (1.0 + change, 1.0 - change)
            )
        except UnstableModelError:
            found[name] = np.inf
            continue
        rows = min(len(up), len(down))
        squares = [
            np.mean((up[c][:rows] - down[c][:rows]) ** 2) / spans[c] ** 2 for c in spans
        ]
        found[name] = float(np.sqrt(np.mean(squares)) / (2.0 * change))
    return dict(sorted(found.items(), key=lambda item: item[1], reverse=True))


def _step(
    features: Floats,
    targets: Floats,
    labels: Sequence[str],
    kept: Sequence[int],
    changed: str,
    before: float,
) -> ReductionStep:
    from sklearn.model_selection import KFold, cross_val_predict

    X, names = features[:, kept], tuple(labels[i] for i in kept)
    estimator = TruncatedLSSVM(selection="full", fit_intercept=False).fit(X, targets)
    left_out = targets - cross_val_predict(estimator, X, targets, cv=KFold(FOLDS))
    deviation, size = np.sqrt(np.diag(estimator.covariance_)), np.abs(estimator.coef_)
    relative = np.divide(
        deviation, size, out=np.full(len(names), np.inf), where=size > 0.0
    )
    residual, power = targets - X @ estimator.coef_, float(targets @ targets)
    r_squared, held_out = (1.0 - float(e @ e) / power for e in (residual, left_out))
    coefficients, relative_errors = (
        dict(zip(names, values.tolist(), strict=True))
        for values in (estimator.coef_, relative)
    )
    explained = r_squared - before if changed else r_squared
    return ReductionStep(
        names, changed, coefficients, relative_errors, r_squared, held_out, explained
    )


def _collinear(features: Floats, kept: Sequence[int]) -> set[int]:
    """Terms that others nearly make up, by pair or by variance inflation."""
    scaled = features[:, kept] / np.sqrt(np.mean(features[:, kept] ** 2, axis=0))
    correlation = scaled.T @ scaled / len(scaled)
    pairs = np.abs(correlation - np.diag(np.diag(correlation))) > COLLINEAR
    member = pairs.any(axis=0) | (
        variance_inflation(scaled) > 1.0 / (1.0 - COLLINEAR**2)
    )
    return {i for i, yes in zip(kept, member.tolist(), strict=True) if yes}


def _checked(
    X: ArrayLike, y: ArrayLike, names: Sequence[str]
) -> tuple[Floats, Floats, list[str]]:
    features, targets, labels = (
        np.asarray(X, dtype=float),
        np.asarray(y, dtype=float),
        list(names),
    )
    if (
        features.ndim != 2
        or targets.shape != features.shape[:1]
        or len(labels) != features.shape[1]
    ):
        raise InputError(
            f"X, y, names: shapes {features.shape}, {targets.shape} and {len(labels)}"
            " names found, expected (n_samples, n_terms), (n_samples,) and one name a"
            " term"
        )
    if not (np.all(np.isfinite(features)) and np.all(np.isfinite(targets))):
        raise InputError(
            "X, y: a value that is not finite found, expected numbers; repair the"
            " samples first"
        )
    if len(targets) < FOLDS * max(len(labels), 2):
        raise InputError(
            f"X: {len(targets)} samples found for {len(labels)} terms, expected at"
            f" least {FOLDS} times as many"
        )
    silent = [
        name
        for name, column in zip(labels, features.T, strict=True)
        if not column.any()
    ]
    if silent or not targets.any():
        raise InputError(
            f"X, y: {silent[0] if silent else 'y'} is 0 throughout, expected it to be"
            " excited"
        )
    return features, targets, labels
