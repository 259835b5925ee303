"""From captive tests to the coefficients of a table for forces: X, Y and N in one regression.

A coefficient that stands in several equations (`shipgym.ships.shared_structure`) has
one column; the rows of X, Y and N are stacked. Source: Xu, Hassani & Guedes Soares
2020, equations 18 to 22, who fit the equations one after the other.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline
from sklearn.metrics import r2_score

from identification.estimators.estimator import Estimator
from identification.estimators.lssvm import TruncatedLSSVM
from identification.estimators.threads import single_threaded
from shipgym import InputError, Particulars, ShipModel, SteeringGear, Trial
from shipgym.arrays import Floats, Integers
from shipgym.checks import check_choice
from shipgym.manoeuvres.towing_tank import rigid_body_forces
from shipgym.ships import get_structure
from shipgym.ships.shared_structure import ACCELERATIONS, AXES, SharedStructure

FORCES = ("X", "Y", "N")
NEEDED = ("u", "v", "r", *FORCES)
# of the usual change of a velocity from sample to sample: another angle of a static
# test
JUMP = 20.0
FEWEST = 4  # samples between jumps
METHODS = {
    "ls": "full",
    "tls-svm": "l-curve",
}  # how each chooses the directions that it keeps


@dataclass(frozen=True, eq=False)
class ForceRegression:
    """Forces of captive tests as a linear function of the coefficients, prime system.

    Attributes
    ----------
    features : array of shape (n_rows, n_coefficients)
        The share of each coefficient; rows of all X, then all Y, then all N.
    targets : array of shape (n_rows,)
        Hydrodynamic force or moment.
    names : tuple of str
        Of the coefficients, in the order of the columns.
    equation : array of shape (n_rows,)
        0, 1, 2 for X, Y, N.
    trial : array of shape (n_rows,)
        Index of the trial.
    """

    features: Floats
    targets: Floats
    names: tuple[str, ...]
    equation: Integers
    trial: Integers

    def __len__(self) -> int:
        return len(self.targets)

    def scales(self) -> Floats:
        """Root mean square of each row's force over all tests, shape (n_rows,)."""
        sizes = np.array(
            [np.sqrt(np.mean(self.targets[self.equation == i] ** 2)) for i in range(3)]
        )
        return np.where(sizes > 0.0, sizes, 1.0)[self.equation]

    def r_squared(self, coefficients: Floats) -> dict[str, float]:
        """Share of the variance of X, Y and N that is explained (equation 22)."""
        fitted, forces = (
            self.features @ coefficients,
            {f: self.equation == i for i, f in enumerate(FORCES)},
        )
        return {
            f: float(r2_score(self.targets[rows], fitted[rows]))
            for f, rows in forces.items()
        }


def force_regression(
    trials: Sequence[Trial],
    structure: SharedStructure,
    particulars: Particulars,
    model_inertia: bool = True,
) -> ForceRegression:
    """Stack the forces of captive tests over X, Y and N.

    Raises InputError for no trial, a missing channel, or a ship at rest.

    Parameters
    ----------
    trials : sequence of Trial
        With the channels u, v, r, X, Y, N, from `shipgym.manoeuvres.towing_tank` or a
        real one. Accelerations are those of splines through the velocities, which a
        carriage prescribes, between jumps of a static test.
    structure : SharedStructure
        Such as `pmm38`.
    particulars : Particulars
        Length, water density; mass, centre of gravity and yaw gyradius where
        `model_inertia`.
    model_inertia : bool
        Whether the inertia of the ship herself is in the forces (`Tank.model_inertia`);
        it is taken out.
    """
    if not trials:
        raise InputError(
            "trials: none found, expected captive tests with the channels u, v, r, X,"
            " Y, N"
        )
    ship, names = particulars.completed(), structure.coefficient_names
    parts, index = [], []
    for i, trial in enumerate(trials):
        if missing := [name for name in NEEDED if name not in trial]:
            raise InputError(
                f"trial {trial.name!r}: channel {missing[0]!r} is missing, structure"
                f" {structure.name!r} needs {', '.join(NEEDED)}; give captive tests"
            )
        for rows in _between_jumps(trial):
            parts.append(_one_piece(trial, rows, structure, ship, model_inertia))
            index += [i] * (rows.stop - rows.start)
    if not parts:
        raise InputError(
            f"trial {trials[0].name!r}: nowhere {FEWEST} samples between jumps of the"
            " velocity, expected more"
        )
    features, targets = (
        np.concatenate(part, axis=1) for part in zip(*parts, strict=True)
    )
    equation, trial_index = np.repeat(np.arange(3), len(index)), np.tile(index, 3)
    return ForceRegression(
        features.reshape(-1, len(names)), targets.ravel(), names, equation, trial_index
    )


def _between_jumps(trial: Trial) -> list[slice]:
    """Stretches in which the velocities change smoothly."""
    jumps = np.zeros(len(trial) - 1, dtype=bool)
    for name in "uvr":
        change = np.abs(np.diff(trial[name]))
        floor = 1e-9 * float(np.abs(trial[name]).max())
        jumps |= change > np.maximum(JUMP * np.median(change), floor) + floor
    edges = [0, *(np.flatnonzero(jumps) + 1).tolist(), len(trial)]
    return [slice(i, j) for i, j in pairwise(edges) if j - i >= FEWEST]


def _one_piece(
    trial: Trial,
    rows: slice,
    structure: SharedStructure,
    ship: Particulars,
    model_inertia: bool,
) -> tuple[Floats, Floats]:
    """Features and targets of X, Y, N over one stretch, prime system; the first axis is the force."""
    t, length = trial.t[rows], ship.length
    u, v, r = (trial[name][rows] for name in "uvr")
    speed = np.hypot(u, v)
    if not np.all(speed > 0.0):
        raise InputError(
            f"trial {trial.name!r}: a ship at rest found, expected way on her: U"
            " divides the forces"
        )
    rates = [CubicSpline(t, values)(t, 1) * length / speed**2 for values in (u, v, r)]
    prime = {"u": u / speed, "v": v / speed, "r": r * length / speed}
    prime |= dict(
        zip(ACCELERATIONS, (rates[0], rates[1], rates[2] * length), strict=True)
    )
    prime |= {f"|{name}|": np.abs(prime[name]) for name in "uvr"}
    unit = 0.5 * ship.require("water_density") * length**2 * speed**2
    targets = np.array(
        [
            trial[force][rows] / unit / (length if force == "N" else 1.0)
            for force in FORCES
        ]
    )
    if model_inertia:
        inertia = ship.mass_prime, ship.mass_prime * ship.xg_prime, ship.inertia_prime
        motion = ([prime[name] for name in names] for names in (AXES, ACCELERATIONS))
        targets += rigid_body_forces(inertia, *motion)
    column = {name: i for i, name in enumerate(structure.coefficient_names)}
    features = np.zeros((len(AXES), len(t), len(column)))
    for own, axis in zip(features, AXES, strict=True):
        for share in structure.shares[axis]:
            factors = [
                prime[symbol] ** float(power) for symbol, power in share.term.powers
            ]
            own[:, column[share.coefficient]] += share.sign * np.prod(factors, axis=0)
    return features, targets


def fit_forces(
    regression: ForceRegression, estimator: Estimator
) -> tuple[Floats, Floats]:
    """Coefficients and their covariance; X, Y and N count alike, each by its root mean square.

    `estimator` has no intercept. The covariance is for white errors of the size of each
    force's residuals.
    """
    scales = regression.scales()
    features, targets = (
        regression.features / scales[:, None],
        regression.targets / scales,
    )
    estimator.fit(features, targets)
    half = features @ estimator.inverse_moment_
    left, leverages = (
        targets - estimator.predict(features),
        np.sum(half * features, axis=1),
    )
    variances = force_variances(regression.equation, left, leverages)
    covariance = (half.T * variances[regression.equation]) @ half
    return estimator.coef_, 0.5 * (covariance + covariance.T)


def force_variances(equation: Integers, residuals: Floats, leverages: Floats) -> Floats:
    """Variances of the errors of X, Y and N, each by its residuals, shape (3, ...).

    `equation`: 0, 1, 2 for X, Y, N, shape (n_rows,); `residuals`: of the fit, shape
    (n_rows, ...); `leverages`: diagonal of the matrix that maps targets to fitted
    values, shape (n_rows,).
    """
    forces = [equation == i for i in range(len(FORCES))]
    freedom = [max(float(np.sum(1.0 - leverages[rows])), 1.0) for rows in forces]
    squares = [np.sum(residuals[rows] ** 2, axis=0) for rows in forces]
    return np.array([square / n for square, n in zip(squares, freedom, strict=True)])


@single_threaded()
def identify_forces(
    trials: Sequence[Trial],
    structure: str = "pmm18",
    particulars: Particulars | None = None,
    *,
    method: str = "tls-svm",
    rank: int | None = None,
    model_inertia: bool = True,
    steering: SteeringGear | None = None,
    name: str | None = None,
) -> ShipModel:
    """Identify a table for forces, added masses included, from captive tests.

    Returns a ShipModel with the covariance of the coefficients, for white errors; its
    provenance holds R^2 of X, Y, N. Raises InputError for a structure of free-running
    trials, and what `force_regression` refuses.

    Parameters
    ----------
    trials, particulars, model_inertia
        As in `force_regression`; the service speed is that of the model.
    structure : str
        `pmm38`, `pmm18` or another table of shares.
    method : {"tls-svm", "ls"}
        Truncated LS-SVM, or least squares; each of X, Y and N is scaled by its root
        mean square.
    rank : int, optional
        Directions that `tls-svm` keeps; by default by its L-curve.
    steering, name : optional
        Of the model; the name by default the ship's.
    """
    check_choice(method, METHODS, "method")
    if rank is not None and method != "tls-svm":
        raise InputError(
            f"rank: {rank} found with method {method!r}, which keeps all; choose"
            " 'tls-svm'"
        )
    if particulars is None:
        raise InputError(
            "particulars: None found, expected at least length, speed and mass of the"
            " ship"
        )
    table = get_structure(structure)
    if not isinstance(table, SharedStructure):
        raise InputError(
            f"structure: {structure!r} found, which is identified from free-running"
            " trials, expected one for captive tests, such as 'pmm18'; use identify"
        )
    regression = force_regression(trials, table, particulars, model_inertia)
    estimator = TruncatedLSSVM(
        selection=METHODS[method], rank=rank, fit_intercept=False
    )
    coefficients, covariance = fit_forces(regression, estimator)
    provenance = {
        "structure": structure,
        "method": method,
        "rank": estimator.rank_,
        "r_squared": regression.r_squared(coefficients),
        "trials": [{"name": trial.name, "sha256": trial.sha256} for trial in trials],
    }
    return ShipModel(
        name=name or particulars.name,
        structure=structure,
        particulars=particulars.completed(),
        steering=steering or SteeringGear(),
        covariance=covariance,
        provenance=provenance,
        coefficients=dict(zip(regression.names, coefficients.tolist(), strict=True)),
    )
