"""Regression of the coefficients of a table for forces on captive tests.

A coefficient that stands in several equations (`shipgym.ships.shared_structure`) has
one column; the rows of X, Y and N are stacked. Source: Xu, Hassani & Guedes Soares
2020, equations 18 to 22, who fit the equations one after the other.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from sklearn.metrics import r2_score

from identification.arrays import by_name, root_mean_square, stretches
from identification.estimators.estimator import Estimator
from identification.estimators.lssvm import TruncatedLSSVM
from identification.estimators.threads import single_threaded
from shipgym import InputError, Particulars, ShipModel, SteeringGear, Trial
from shipgym.arrays import Floats, Integers
from shipgym.ships import Term, get_structure
from shipgym.ships.shared_structure import ACCELERATIONS, AXES, SharedStructure

FORCES = ("X", "Y", "N")
FEWEST = 4  # samples between jumps


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
        own = [self.targets[self.equation == i] for i in range(len(FORCES))]
        by_force = np.array([root_mean_square(targets) or 1.0 for targets in own])
        return by_force[self.equation]

    def r_squared(self, coefficients: Floats) -> dict[str, float]:
        """Share of the variance of X, Y and N that is explained (equation 22)."""
        fitted = self.features @ coefficients
        shares = {}
        for i, force in enumerate(FORCES):
            own = self.equation == i
            shares[force] = float(r2_score(self.targets[own], fitted[own]))
        return shares


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
        With the channels u, v, r, X, Y, N. Accelerations are those of splines through
        the velocities, which a carriage prescribes, between jumps of a static test.
    structure : SharedStructure
        Such as `pmm38`.
    particulars : Particulars
        Length, water density; mass, centre of gravity and yaw gyradius where
        `model_inertia`.
    model_inertia : bool
        Whether the inertia of the ship herself is in the forces of a captive test;
        it is taken out.
    """
    if not trials:
        raise InputError(
            "trials: expected captive tests with the channels u, v, r, X, Y, N, got"
            " none"
        )
    ship = particulars.completed()
    features, targets, index = [], [], []
    for i, piece in _pieces(trials, structure):
        motion = _prime_motion(piece, ship)
        forces = _prime_forces(
            piece,
            motion=motion,
            ship=ship,
            model_inertia=model_inertia,
        )
        features.append(_shares(motion, structure))
        targets.append(forces)
        index += [i] * len(piece)
    if not index:
        raise InputError(
            f"trial {trials[0].name!r}: expected {FEWEST} samples somewhere between"
            " jumps of the velocity, got fewer"
        )

    n_forces, n_rows = len(FORCES), len(index)
    names = structure.coefficient_names
    return ForceRegression(
        features=np.concatenate(features, axis=1).reshape(-1, len(names)),
        targets=np.concatenate(targets, axis=1).ravel(),
        names=names,
        equation=np.repeat(np.arange(n_forces), n_rows),
        trial=np.tile(index, n_forces),
    )


def _pieces(
    trials: Sequence[Trial], structure: SharedStructure
) -> Iterator[tuple[int, Trial]]:
    """Parts of trials between jumps of the velocity, each with its trial's index."""
    for i, trial in enumerate(trials):
        _check_channels(trial, structure)
        for rows in between_jumps(trial):
            yield i, trial.part(rows)


def _check_channels(trial: Trial, structure: SharedStructure) -> None:
    needed = ("u", "v", "r", *FORCES)
    for name in needed:
        if name not in trial:
            raise InputError(
                f"trial {trial.name!r}: expected the channels {', '.join(needed)} for"
                f" structure {structure.name!r}, got no {name!r}; give captive tests"
            )


def between_jumps(trial: Trial) -> list[slice]:
    """Stretches of a captive test in which the velocities change smoothly.

    A jump is a change from sample to sample of more than 20 usual ones, the median of
    the test; stretches of fewer than 4 samples are left out.
    """
    is_jump = np.zeros(len(trial) - 1, dtype=bool)
    # Times the usual change of a velocity from sample to sample: another angle of a
    # static test.
    jump = 20.0
    for name in AXES:
        velocity = trial[name]
        moves = np.diff(velocity)
        changes = np.abs(moves)
        usual = float(np.median(changes))
        fastest = float(np.abs(velocity).max())
        rounding = 1e-9 * fastest
        largest = max(jump * usual, rounding)
        is_jump |= changes > largest + rounding
    return stretches(is_jump, FEWEST)


def _prime_motion(trial: Trial, ship: Particulars) -> dict[str, Floats]:
    """Velocities, their sizes, and accelerations of a carriage, prime system."""
    length = ship.length
    speed = np.hypot(trial["u"], trial["v"])
    if not np.all(speed > 0.0):
        raise InputError(
            f"trial {trial.name!r}: expected way on the ship, whose speed divides the"
            " forces, got a ship at rest"
        )
    motion = {}
    scales = {"u": 1.0, "v": 1.0, "r": length}
    for name, scale in scales.items():
        velocity = trial[name]
        spline = CubicSpline(trial.t, velocity)
        rate = spline(trial.t, nu=1)
        prime = velocity * scale / speed
        motion[name] = prime
        motion[f"|{name}|"] = np.abs(prime)
        motion[f"{name}dot"] = rate * length / speed**2 * scale
    return motion


def _prime_forces(
    trial: Trial,
    motion: dict[str, Floats],
    ship: Particulars,
    model_inertia: bool,
) -> Floats:
    """Hydrodynamic X, Y and N, prime system, shape (3, n_samples)."""
    length = ship.length
    speed = np.hypot(trial["u"], trial["v"])
    density = ship.require("water_density")
    unit = 0.5 * density * length**2 * speed**2
    forces = np.array(
        [
            trial["X"] / unit,
            trial["Y"] / unit,
            trial["N"] / unit / length,
        ]
    )
    if not model_inertia:
        return forces

    mass = ship.mass_prime
    velocities = [motion[name] for name in AXES]
    accelerations = [motion[name] for name in ACCELERATIONS]
    rigid = (mass, mass * ship.xg_prime, ship.inertia_prime)
    return forces + rigid_body_forces(rigid, velocities, accelerations)


def rigid_body_forces(
    rigid: Sequence[float],
    velocity: Sequence[Floats] | Floats,
    acceleration: Sequence[Floats] | Floats,
) -> Floats:
    """Forces X, Y and moment N that accelerate a ship without water, about midship.

    Fossen 2011, 3.3. All in SI units or all in the prime system: `rigid` is mass, its
    static moment and the yaw inertia; forces, and velocity and acceleration in surge,
    sway and yaw, have the shape (3, n_samples).
    """
    m, static, yaw = rigid
    u, v, r = velocity
    udot, vdot, rdot = acceleration
    ahead = udot - v * r
    aside = vdot + u * r
    return np.array(
        [
            m * ahead - static * r * r,
            m * aside + static * rdot,
            yaw * rdot + static * aside,
        ]
    )


def _shares(motion: dict[str, Floats], structure: SharedStructure) -> Floats:
    """Share of each coefficient in X, Y and N, shape (3, n_samples, n_coefficients)."""
    names = structure.coefficient_names
    n_samples = len(motion["u"])
    found = np.zeros((len(AXES), n_samples, len(names)))
    for i, axis in enumerate(AXES):
        for share in structure.shares[axis]:
            column = names.index(share.coefficient)
            value = _value(share.term, motion)
            found[i, :, column] += share.sign * value
    return found


def _value(term: Term, motion: dict[str, Floats]) -> Floats:
    """The product of a term's powers."""
    factors = []
    for symbol, power in term.powers:
        factor = motion[symbol] ** float(power)
        factors.append(factor)
    return np.asarray(np.prod(factors, axis=0))


def fit_forces(
    regression: ForceRegression, estimator: Estimator
) -> tuple[Floats, Floats]:
    """Coefficients and their covariance.

    X, Y and N weigh the same, each by its root mean square. `estimator` has no
    intercept. The covariance is for white errors of the size of each force's residuals.
    """
    scales = regression.scales()
    features = regression.features / scales[:, None]
    targets = regression.targets / scales
    estimator.fit(features, targets)

    fitted = estimator.predict(features)
    residuals = targets - fitted
    half = features @ estimator.inverse_moment_
    leverages = np.sum(half * features, axis=1)
    by_force = force_variances(regression.equation, residuals, leverages)
    variances = by_force[regression.equation]
    covariance = (half.T * variances) @ half
    symmetric = 0.5 * (covariance + covariance.T)
    return estimator.coef_, symmetric


def force_variances(equation: Integers, residuals: Floats, leverages: Floats) -> Floats:
    """Variances of the errors of X, Y and N, each by its residuals, shape (3, ...).

    `equation`: 0, 1, 2 for X, Y, N, shape (n_rows,); `residuals`: of the fit, shape
    (n_rows, ...); `leverages`: diagonal of the matrix that maps targets to fitted
    values, shape (n_rows,).
    """
    variances = []
    for i in range(len(FORCES)):
        own = equation == i
        own_residuals = residuals[own]
        squares = np.sum(own_residuals**2, axis=0)
        free = 1.0 - leverages[own]
        freedom = float(np.sum(free))
        variances.append(squares / max(freedom, 1.0))
    return np.array(variances)


@single_threaded()
def identify_forces(
    trials: Sequence[Trial],
    structure: str = "pmm18",
    particulars: Particulars | None = None,
    *,
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
    rank : int, optional
        Directions that the truncated LS-SVM keeps; by default by its L-curve. Each of
        X, Y and N is scaled by its root mean square.
    steering, name : optional
        Of the model; the name by default the ship's.
    """
    if particulars is None:
        raise InputError(
            "particulars: expected at least length, speed and mass of the ship, got"
            " None"
        )
    table = _captive_structure(structure)
    regression = force_regression(
        trials,
        structure=table,
        particulars=particulars,
        model_inertia=model_inertia,
    )
    estimator = TruncatedLSSVM(rank=rank, fit_intercept=False)
    values, covariance = fit_forces(regression, estimator)
    provenance = {
        "structure": structure,
        "method": TruncatedLSSVM.name,
        "rank": estimator.rank_,
        "r_squared": regression.r_squared(values),
        "trials": [{"name": trial.name, "sha256": trial.sha256} for trial in trials],
    }
    return ShipModel(
        name=name or particulars.name,
        structure=structure,
        particulars=particulars.completed(),
        steering=steering or SteeringGear(),
        covariance=covariance,
        provenance=provenance,
        coefficients=by_name(regression.names, values),
    )


def _captive_structure(name: str) -> SharedStructure:
    structure = get_structure(name)
    if not isinstance(structure, SharedStructure):
        raise InputError(
            "structure: expected one for captive tests, such as 'pmm18', got"
            f" {name!r}, which is identified from free-running trials; use identify"
        )
    return structure
