"""Choice of C by simulation: the error of the trials as the candidate model sails them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.estimators.decomposition import decompose
from identification.estimators.estimator import FitTask
from identification.estimators.tuned import TunedLSSVM
from identification.search import get_optimiser
from identification.validation.prediction import predict
from shipgym.arrays import Floats
from shipgym.ships import ShipModel
from shipgym.trials.trial import Trial

COMPARED = ("u", "v", "r")
RAN_AWAY = 1e3  # error, relative to the motion, of a ship that ran away


def free_running_error(model: ShipModel, trials: Sequence[Trial]) -> float:
    """Mean squared error of open-loop predictions, each channel relative to its variance in the trial.

    0 for a perfect model, 1 for one that predicts the mean; 1e3 for each trial that ran away.
    """
    errors = []
    for trial in trials:
        prediction = predict(model, trial)
        if prediction is None:
            errors.append(RAN_AWAY)
            continue
        motion = [c for c in COMPARED if np.ptp(trial[c]) > 0.0]
        errors.append(
            float(np.mean([np.mean((prediction[c] - trial[c]) ** 2) / np.var(trial[c]) for c in motion]))
        )
    return float(np.mean(np.minimum(errors, RAN_AWAY)))


def fit_free_running(settings: TunedLSSVM, task: FitTask) -> dict[str, TunedLSSVM]:
    """Estimators of all equations, their C chosen together by the error of simulated trials.

    `settings`: not fitted; gives optimiser, bounds, seed and scale; `task`: its trials are simulated. Returns
    the estimators by equation; the variables of their common search are log10 C in the order of the
    equations.
    """
    samples, blank, trials = task.samples, task.blank, task.trials
    equations = blank.table.regressed
    whitened = {
        q: decompose(samples.features[q], samples.targets[q], settings.scale, settings.fit_intercept)
        for q in equations
    }

    def error(log_c: Floats) -> float:
        accelerations = {}
        for q, exponent in zip(equations, log_c, strict=True):
            fit = whitened[q]
            filters = fit.filters(10.0**exponent, len(fit.singular_values))
            accelerations[q] = fit.directions.T @ (filters * fit.projections) / fit.scale
        return free_running_error(blank.with_accelerations(accelerations), trials)

    bounds = [settings.log_bounds()] * len(equations)
    optimiser = get_optimiser(settings.optimiser)
    search = optimiser.minimise(
        lambda candidates: np.array([error(x) for x in candidates]), bounds, settings.seed
    )
    estimators = {}
    for k, q in enumerate(equations):
        own = replace(search, x=search.x[k : k + 1], course=search.course[:, k : k + 1])
        estimator = TunedLSSVM(**settings.get_params(deep=False))
        estimators[q] = estimator.fit_with(
            samples.features[q], samples.targets[q], 10.0 ** float(search.x[k]), own
        )
    return estimators
