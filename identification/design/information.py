"""Fisher information of trials on each coefficient of a model.

That of a linear regression with white errors is X'X / sigma^2, which adds up over
trials. Its inverse is the least covariance of the coefficients.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identification.arrays import by_name, mean_square
from identification.judging.diagnostics import (
    JITTER,
    scaled_features,
    variance_inflation,
)
from identification.samples.samples import Samples, build_samples
from shipgym import InputError, ShipModel, Trial
from shipgym.arrays import Floats
from shipgym.ships import Structure
from shipgym.trials.resampling import usual_step


def table_of(model: ShipModel) -> Structure:
    """The table of terms of a model; InputError for equations written by hand."""
    if not isinstance(model.dynamics, Structure):
        raise InputError(
            "structure: expected a table of terms, such as 'abkowitz', got"
            f" {model.structure!r}"
        )
    return model.table


@dataclass(frozen=True, eq=False)
class TrialInformation:
    """Information of one trial on the coefficients."""

    name: str  # of the trial
    #: by equation, of the features scaled to a root mean square of 1
    condition_number: dict[str, float]
    #: by coefficient of the accelerations' terms: how much the other terms increase its
    #: variance
    inflation: dict[str, float]
    #: Fisher information of the model's coefficients, shape (n_coefficients,
    #: n_coefficients)
    information: Floats


def trial_regression(model: ShipModel, trial: Trial) -> Samples:
    """Regression of a trial over windows of the same time, whatever the sampling."""
    share = 0.2  # of the time to sail a ship length: velocities are integrated over it
    sampling_steps = share * model.travel_time / usual_step(trial.t)
    window = max(round(sampling_steps), 1)
    tenth = max(len(trial) // 10, 1)
    return build_samples(
        [trial],
        table_of(model),
        model.particulars,
        "integral",
        min(window, tenth),
        shaft_speed=model.service_shaft_speed,
    )


def noise_variance(
    model: ShipModel, regressions: Sequence[Samples]
) -> dict[str, float]:
    """Variance of what the model leaves of the targets, by equation."""
    accelerations = model.acceleration_matrix @ coefficient_values(model)
    smallest = np.finfo(float).tiny
    noise = {}
    rows_of = table_of(model).regression_rows
    for q, rows in rows_of.items():
        targets = np.concatenate([samples.targets[q] for samples in regressions])
        features = np.concatenate([samples.features[q] for samples in regressions])
        predicted = features @ accelerations[rows]
        errors = targets - predicted
        # data without noise leave rounding errors only
        rounding = JITTER * mean_square(targets)
        noise[q] = max(mean_square(errors), rounding, smallest)
    return noise


def fisher_information(
    model: ShipModel, samples: Samples, noise: Mapping[str, float]
) -> Floats:
    """Information on the model's coefficients, which adds up over samples.

    For exact features and white errors. `noise` is the variance of the targets' errors,
    by equation. Shape (n_coefficients, n_coefficients).
    """
    matrix = model.acceleration_matrix
    of_terms = np.zeros(matrix.shape)
    for q, rows in table_of(model).regression_rows.items():
        X = samples.features[q]
        moment = X.T @ X
        of_terms[rows, rows] = moment / noise[q]
    # the terms' accelerations are linear in the coefficients
    information = matrix.T @ of_terms @ matrix
    return np.asarray(information)


def trial_information(
    model: ShipModel, name: str, samples: Samples, noise: Mapping[str, float]
) -> TrialInformation:
    """Information of a trial, from its name and its regression."""
    condition = dict[str, float]()
    inflation = dict[str, float]()
    for q, X in samples.features.items():
        scaled, condition[q] = scaled_features(X)
        terms = model.table.regression_names(q)
        inflation |= by_name(terms, variance_inflation(scaled))
    return TrialInformation(
        name=name,
        condition_number=condition,
        inflation=inflation,
        information=fisher_information(model, samples, noise),
    )


def coefficient_values(model: ShipModel) -> Floats:
    """Coefficients of a model in their order, shape (n_coefficients,)."""
    return np.array(list(model.coefficients.values()))


def relative_covariance(information: Floats, size: Floats) -> Floats:
    """Covariance of the relative errors of coefficients of some sizes.

    What is not excited gets a large one instead of an infinite.
    """
    units = np.outer(size, size)
    relative = information * units
    values, vectors = np.linalg.eigh(relative)

    smallest = np.finfo(float).tiny
    largest = max(values[-1], smallest)
    regular = np.maximum(values, 1e-14 * largest)
    scaled = vectors / regular
    return np.asarray(scaled @ vectors.T)


def relative_errors(information: Floats, size: Floats) -> Floats:
    """Relative standard errors of coefficients of some sizes."""
    covariance = relative_covariance(information, size)
    return np.sqrt(np.diag(covariance))


def uncertainty(information: Floats, size: Floats, criterion: str, place: int) -> float:
    """The measure that a criterion shrinks, in units of a relative standard error.

    The standard error of the coefficient at a place ("c"), or the mean axis ("D") of
    the ellipsoid of the relative errors.
    """
    covariance = relative_covariance(information, size)
    if criterion == "c":
        variance = covariance[place, place]
        return float(np.sqrt(variance))
    variances = np.linalg.eigvalsh(covariance)
    positive = np.maximum(variances, np.finfo(float).tiny)
    mean_log = np.mean(np.log(np.sqrt(positive)))
    return float(np.exp(mean_log))
