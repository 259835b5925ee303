"""(d) KVLCC2, static captive tests: truncated LS-SVM, reduced as by Xu et al. 2020.

81 steady conditions of drift, rudder and propeller loading, without yaw or
acceleration: what they tell is the hull's response to drift and the rudder's force, not
inertia or damping of yaw.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.design.reduction import FOLDS, Reduction, backward_elimination
from identification.estimators.lssvm import TruncatedLSSVM
from real_ships.data import Data
from real_ships.section import Section, number, table
from shipgym.errors import InputError

Floats = NDArray[np.float64]

FILE = Path("kvlcc2_captive") / "captive_static.csv"
TOLERANCE = 2e-4  # of the held-out R2, while terms are dropped
SERVICE_SPEED = 1.1702  # m/s, of most of the tests; the shaft turns alike in all
FORCES = ("X'", "Y'", "N'")
COLUMNS = ("beta(deg)", "delta(deg)", "Speed(m/s)", *FORCES, "test type")

#: Powers of v' = -sin(beta), of the rudder d (rad, positive to starboard) and of the
#: loading n' = U0/U.
TERMS: dict[str, tuple[tuple[int, int, int], ...]] = {
    "X'": (
        (0, 0, 0),
        (0, 0, 1),
        (0, 0, 2),
        (2, 0, 0),
        (4, 0, 0),
        (0, 2, 2),
        (1, 1, 2),
        (1, 0, 1),
        (0, 1, 2),
        (2, 2, 2),
        (1, 3, 2),
    ),
    "Y'": (
        (0, 0, 1),
        (0, 0, 2),
        (1, 0, 0),
        (1, 0, 1),
        (3, 0, 0),
        (5, 0, 0),
        (0, 1, 1),
        (0, 1, 2),
        (0, 3, 2),
        (2, 1, 2),
        (1, 2, 2),
        (2, 0, 0),
    ),
}
TERMS["N'"] = TERMS["Y'"]


@dataclass(frozen=True, eq=False)
class Captive:
    """Steady conditions: v', rudder, loading; forces; which kind of test."""

    v: Floats
    d: Floats
    n: Floats
    forces: dict[str, Floats]
    kind: NDArray[np.str_]

    def features(self, force: str) -> Floats:
        """Regressors by the square of the loading, shape (n_conditions, n_terms)."""
        return np.column_stack(
            [self.v**i * self.d**j * self.n ** (k - 2.0) for i, j, k in TERMS[force]]
        )

    def targets(self, force: str) -> Floats:
        """Force by rho L^2 U0^2/2, lest slow tests outweigh all."""
        return np.asarray(self.forces[force] / self.n**2)


def names(force: str) -> list[str]:
    """Of the terms: letters as many times as their power, 0 for the constant."""
    return ["v" * i + "d" * j + "n" * k or "0" for i, j, k in TERMS[force]]


def read(folder: Path) -> Captive:
    """The tests, with the rudder positive to starboard (in the file to port).

    A test that stands there twice counts once. Their order is dealt out so that each of
    the stretches that the reduction holds out has tests of every kind.

    Raises
    ------
    InputError
        Where the file is missing or lacks a column.
    """
    path = folder / FILE
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read ({error.strerror}); give the folder of the data"
        ) from error
    missing = [name for name in COLUMNS if not rows or name not in rows[0]]
    if missing:
        raise InputError(
            f"{path}: column {missing[0]!r} is missing, expected {', '.join(COLUMNS)}"
        )
    rows = list(
        {tuple(float(row[name]) for name in COLUMNS[:-1]): row for row in rows}.values()
    )
    dealt = [row for fold in range(FOLDS) for row in rows[fold::FOLDS]]
    column = {
        name: np.array([float(row[name]) for row in dealt]) for name in COLUMNS[:-1]
    }
    return Captive(
        v=-np.sin(np.radians(column["beta(deg)"])),
        d=-np.radians(column["delta(deg)"]),
        n=SERVICE_SPEED / column["Speed(m/s)"],
        forces={force: column[force] for force in FORCES},
        kind=np.array([row["test type"] for row in dealt]),
    )


@dataclass(frozen=True, eq=False)
class Found:
    """Of one force: the truncated fit of all terms, and the reduction."""

    full: TruncatedLSSVM
    held_out: dict[str, float]
    reduction: Reduction


def r_squared(y: Floats, predicted: Floats) -> float:
    """Share of the variance."""
    return 1.0 - float(np.sum((y - predicted) ** 2) / np.sum((y - y.mean()) ** 2))


def held_out(
    X: Floats,
    y: Floats,
    fit: Callable[[Floats, Floats], Floats],
    folds: Sequence[NDArray[np.int64]],
) -> float:
    """R2 of conditions predicted from the others."""
    predicted = np.empty(len(y))
    for rows in folds:
        others = np.setdiff1d(np.arange(len(y)), rows)
        predicted[rows] = X[rows] @ fit(X[others], y[others])
    return r_squared(y, predicted)


def least_squares(X: Floats, y: Floats) -> Floats:
    """Coefficients."""
    return np.asarray(
        TruncatedLSSVM(selection="full", fit_intercept=False).fit(X, y).coef_
    )


def truncated(X: Floats, y: Floats) -> Floats:
    """Coefficients; the rank by generalised cross-validation."""
    return np.asarray(
        TruncatedLSSVM(selection="gcv", fit_intercept=False).fit(X, y).coef_
    )


def study(tests: Captive, force: str) -> Found:
    """All fits of one force."""
    X, y = tests.features(force), tests.targets(force)
    reduction = backward_elimination(X, y, names(force), TOLERANCE)
    kept = [names(force).index(name) for name in reduction.terms]
    folds = np.array_split(np.arange(len(y)), FOLDS)
    scores = {
        "least squares": held_out(X, y, least_squares, folds),
        "tls-svm": held_out(X, y, truncated, folds),
        "tls-svm, reduced": held_out(X[:, kept], y, truncated, folds),
    }
    full = TruncatedLSSVM(selection="gcv", fit_intercept=False).fit(X, y)
    return Found(full, scores, reduction)


def combined(tests: Captive, force: str, terms: Sequence[str]) -> float:
    """R2 of the tests with drift and rudder, which are then not fitted."""
    kept = [names(force).index(name) for name in terms]
    X = tests.features(force)[:, kept]
    y = tests.targets(force)
    apart = (tests.v != 0.0) & (tests.d != 0.0)
    fitted = ~apart
    X = X[:, X[fitted].any(axis=0)]  # terms of both are 0 in all other tests
    coefficients = truncated(X[fitted], y[fitted])
    predicted = X[apart] @ coefficients
    return r_squared(y[apart], predicted)


def run(data: Data) -> Section:
    """The case."""
    tests = read(data.measured)
    found = {force: study(tests, force) for force in FORCES}
    rows = []
    for force, of_force in found.items():
        steps = of_force.reduction.path
        both = combined(tests, force, of_force.reduction.terms)
        counts = (len(TERMS[force]), of_force.full.rank_, len(of_force.reduction.terms))
        for (name, score), count in zip(of_force.held_out.items(), counts, strict=True):
            fitted = (
                steps[-1].r_squared if name.endswith("reduced") else steps[0].r_squared
            )
            rows.append(
                [
                    force,
                    name,
                    str(count),
                    number(fitted, 4) if name != "tls-svm" else "-",
                    number(score, 4),
                    number(both, 4) if name.endswith("reduced") else "-",
                ]
            )
    text = TEXT.format(
        count=len(tests.d),
        fits=table(
            [
                "force",
                "fit",
                "terms or rank",
                "R2 of all",
                "R2 held out",
                "R2 of drift with rudder",
            ],
            rows,
        ),
    )
    return Section(
        "KVLCC2, captive tests", text, {"real_ships_d.svg": _painter(tests, found)}
    )


def _painter(tests: Captive, found: dict[str, Found]) -> Callable[[Any], None]:
    def paint(figure: Any) -> None:
        for axis, force in zip(figure.subplots(1, 3), FORCES, strict=True):
            reduction = found[force].reduction
            kept = [names(force).index(name) for name in reduction.terms]
            measured = tests.targets(force)
            predicted = tests.features(force)[:, kept] @ np.array(
                [reduction.coefficients[t] for t in reduction.terms]
            )
            for kind in sorted(set(tests.kind.tolist())):
                rows = tests.kind == kind
                axis.plot(
                    1e3 * measured[rows], 1e3 * predicted[rows], ".", ms=4, label=kind
                )
            ends = 1e3 * np.array(
                [tests.targets(force).min(), tests.targets(force).max()]
            )
            axis.plot(ends, ends, "k", lw=0.6)
            axis.set(title=f"{force}, 1e-3", xlabel="measured", ylabel="reduced model")
        axis.legend(fontsize=6)

    return paint


TEXT = """
{count} different steady conditions at a constant shaft speed: rudder at six speeds,
drift, drift with rudder. Terms: powers of v' = -sin(drift), rudder d and loading n =
U0/U; forces by rho L^2 U0^2/2 with one U0 for all. Uncertain or collinear terms are
dropped one by one as long as the held-out tests (five folds with tests of every kind)
are explained as well. In the last column the tests with drift and rudder are predicted
from those with one of them alone.

{fits}

**Limits.** Without yaw or acceleration the tests identify neither inertia nor the
damping of yaw; the cross terms of rudder and drift appear only in the tests with both.

![Measured and modelled forces](images/real_ships_d.svg)
"""
