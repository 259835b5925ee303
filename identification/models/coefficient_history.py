"""The history of a model's coefficients over a trial, by a recursive method."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sklearn.base import clone

from identification.estimators.recursive import Recursion
from identification.models.methods import get_method
from identification.samples.samples import Samples, build_samples
from shipgym import InputError, Particulars, Trial
from shipgym.arrays import Floats, Integers
from shipgym.checks import check_choice
from shipgym.ships import Structure, get_structure


@dataclass(frozen=True, eq=False)
class CoefficientHistory:
    """Coefficients over time.

    Attributes
    ----------
    names : tuple of str
        Of the coefficients.
    t : array of shape (n_rows,)
        End of each row's window, s, in the time of its trial.
    trial : array of shape (n_rows,)
        Index of the trial.
    values : array of shape (n_rows, n_coefficients)
        Estimate after each row, in the normalisation of the structure.
    """

    names: tuple[str, ...]
    t: Floats
    trial: Integers
    values: Floats

    def __getitem__(self, name: str) -> Floats:
        """The history of one coefficient, shape (n_rows,)."""
        check_choice(name, self.names, "coefficient history")
        return self.values[:, self.names.index(name)]

    @property
    def last(self) -> dict[str, float]:
        """The last estimate by name."""
        return dict(zip(self.names, self.values[-1].tolist(), strict=True))


def coefficient_history(
    source: Samples | Trial | Sequence[Trial],
    structure: str | Structure,
    particulars: Particulars,
    method: str | Recursion = "rls",
    *,
    shaft_speed: float = 0.0,
    **sampling: Any,
) -> CoefficientHistory:
    """Run a recursive method over trials and keep every estimate.

    Raises InputError for a method that is not recursive.

    Parameters
    ----------
    source : Samples, Trial or sequence of Trial
        The regression, or what it is built from.
    structure : str or Structure
        Terms of the model.
    particulars : Particulars
        Length and service speed, and for structures of forces mass and added mass or
        what they are estimated from.
    method : {"rls", "sg", "nisg", "mils", "tmils"} or Recursion
        The method; an estimator brings its own settings.
    shaft_speed : float
        At service speed, 1/s, for structures that refer to it.
    **sampling
        `samples`, `window`, `gear`, `smooth` of `build_samples`.
    """
    table = structure
    if isinstance(table, str):
        table = get_structure(table)
    estimator = _recursion(method)
    ship = particulars
    if table.quantity == "force":
        ship = particulars.completed()
    samples = source
    if not isinstance(samples, Samples):
        trials = [samples] if isinstance(samples, Trial) else list(samples)
        samples = build_samples(
            trials,
            structure=table,
            particulars=ship,
            shaft_speed=shaft_speed,
            **sampling,
        )

    accelerations = _acceleration_history(estimator, samples, table)
    matrix = table.acceleration_matrix(ship, shaft_speed)
    coefficients = np.linalg.solve(matrix, accelerations.T)
    return CoefficientHistory(
        names=table.coefficient_names,
        t=samples.start + samples.duration,
        trial=samples.trial,
        values=np.asarray(coefficients.T),
    )


def _recursion(method: str | Recursion) -> Recursion:
    """The estimator of a recursive method."""
    estimator: Any = method
    if isinstance(method, str):
        estimator = get_method(method).make()
    if not isinstance(estimator, Recursion):
        raise InputError(
            "method: expected a recursive one, such as 'rls', got"
            f" {method!r}, which fits all samples at once"
        )
    return estimator


def _acceleration_history(
    estimator: Recursion, samples: Samples, table: Structure
) -> Floats:
    """Coefficients of the accelerations after each row, the equations side by side."""
    histories = []
    for q in table.regressed:
        own = clone(estimator)
        history = own.fit_history(samples.features[q], samples.targets[q])
        histories.append(history)
    return np.hstack(histories)
