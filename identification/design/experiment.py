"""What trials say about each coefficient, and which manoeuvre to run next.

The Fisher information of a linear regression with white errors, X'X / sigma^2, adds up
over trials. Its inverse is the least covariance of the coefficients; candidates are
simulated on the current model and ranked by what adding their information makes of it
(Fedorov 1972, Theory of optimal experiments): c-optimal for one coefficient, D-optimal
for the volume of the ellipsoid of all of them, E-optimal for its longest axis.
Coefficients count relative to their size.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from rich.table import Table

from identification.design.reduction import table_of
from identification.regression.samples import Samples, build_samples
from identification.text import as_text, lined_table
from identification.validation.diagnostics import (
    JITTER,
    scaled_features,
    variance_inflation,
)
from identification.validation.hard_turn import hard_turn_features
from shipgym import InputError, ShipModel, Trial, UnstableModelError
from shipgym.arrays import Floats
from shipgym.checks import check_choice
from shipgym.manoeuvres import prbs_rudder, turning_circle, zigzag

Manoeuvre = Callable[[ShipModel], Trial]

CRITERIA = ("c", "D", "E")
DURATION = 40.0  # of a candidate, in the time to sail one ship length
STEPS = 60  # samples of a candidate in that time
WINDOW = 0.2  # over which velocities are integrated, in that time
FLOOR = 1e-14  # of the eigenvalues of an information, by the largest


@dataclass(frozen=True, eq=False)
class TrialInformation:
    """What one trial says about the coefficients."""

    name: str  # of the trial
    condition_number: dict[
        str, float
    ]  # by equation, of the features scaled to a root mean square of 1
    #: by coefficient of the accelerations' terms: how much the other terms increase its
    #: variance
    inflation: dict[str, float]
    #: Fisher information of the model's coefficients, shape (n_coefficients,
    #: n_coefficients)
    information: Floats


@dataclass(frozen=True, eq=False)
class Advice:
    """Which manoeuvres to run next.

    Attributes
    ----------
    criterion : str
        "c", "D" or "E".
    coefficient : str
        That which "c" shrinks.
    trials : tuple of TrialInformation
        Of the trials so far.
    before : dict of str to float
        Relative standard error of each coefficient from the trials so far.
    steps : tuple of dict of str to float
        Of each choice the gain of all candidates, the largest is best: by what factor
        the standard error ("c"), the mean axis ("D") or the longest axis ("E") of the
        relative errors shrinks.
    chosen : tuple of str
        The candidates to run, in this order.
    after : dict of str to float
        Relative standard errors with them.
    """

    criterion: str
    coefficient: str
    trials: tuple[TrialInformation, ...]
    before: dict[str, float]
    steps: tuple[dict[str, float], ...]
    chosen: tuple[str, ...]
    after: dict[str, float]

    def to_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON; of each trial's information the diagonal."""
        names = list(self.before)
        return {
            "criterion": self.criterion,
            "coefficient": self.coefficient,
            "trials": {
                trial.name: {
                    "condition_number": trial.condition_number,
                    "variance_inflation": trial.inflation,
                    "information": dict(
                        zip(names, np.diag(trial.information).tolist(), strict=True)
                    ),
                }
                for trial in self.trials
            },
            "relative_errors": {"now": self.before, "expected": self.after},
            "gains": list(self.steps),
            "run_next": list(self.chosen),
        }

    def __str__(self) -> str:
        return as_text(self._trials_so_far(), self._candidates(), self._errors())

    def _trials_so_far(self) -> Table:
        last = f"information on {self.coefficient}"
        table = lined_table(
            "Trials so far", "trial", "condition number", "largest inflation", last
        )
        at = list(self.before).index(self.coefficient)
        total = sum(float(trial.information[at, at]) for trial in self.trials)
        for trial in self.trials:
            worst = max(trial.inflation, key=lambda name: trial.inflation[name])
            numbers = ", ".join(
                f"{q} {value:.0f}" for q, value in trial.condition_number.items()
            )
            share = float(trial.information[at, at]) / total if total > 0.0 else 0.0
            inflation = f"{trial.inflation[worst]:.0f} ({worst})"
            table.add_row(
                trial.name, numbers, inflation, f"{100.0 * share:.0f} % of all"
            )
        return table

    def _candidates(self) -> Table:
        shrunk = f" for {self.coefficient}" if self.criterion == "c" else ""
        headings = (f">gain, choice {k + 1}" for k in range(len(self.steps)))
        table = lined_table(
            f"Run next ({self.criterion}-optimal{shrunk})", "candidate", *headings
        )
        choices = list(zip(self.steps, self.chosen, strict=True))
        for name in sorted(
            self.steps[0], key=lambda name: self.steps[0][name], reverse=True
        ):
            gains = (
                f"{gains[name]:.2f}{' *' if name == best else ''}"
                for gains, best in choices
            )
            table.add_row(name, *gains)
        return table

    def _errors(self) -> Table:
        table = Table(
            "coefficient", "relative error now", "expected", title_justify="left"
        )
        for name in sorted(
            self.before, key=lambda name: self.before[name], reverse=True
        ):
            table.add_row(name, f"{self.before[name]:.2g}", f"{self.after[name]:.2g}")
        return table


def fisher_information(
    model: ShipModel, samples: Samples, noise: Mapping[str, float]
) -> Floats:
    """Information on the model's coefficients, for exact features and white errors; it adds up over samples.

    `noise` is the variance of the targets' errors, by equation. Shape (n_coefficients,
    n_coefficients).
    """
    matrix = model.acceleration_matrix
    moments = np.zeros(matrix.shape)
    for q, rows in table_of(model).regression_rows.items():
        X = samples.features[q]
        moments[rows, rows] = X.T @ X / noise[q]
    return np.asarray(matrix.T @ moments @ matrix)


def standard_candidates(model: ShipModel) -> dict[str, Manoeuvre]:
    """Manoeuvres that trials usually consist of, each of 40 ship lengths at service speed.

    Zigzags and turning circles of several angles, up to the rudder's limit, and a
    pseudo-random binary rudder.
    """
    travel = model.travel_time
    times: dict[str, Any] = {"duration": DURATION * travel, "dt": travel / STEPS}
    limit = model.steering.rudder_limit_deg
    found: dict[str, Manoeuvre] = {}
    for angle in [
        angle for angle in (5.0, 10.0, 20.0, min(35.0, limit)) if angle <= limit
    ]:
        own: dict[str, Any] = {
            "rudder_deg": angle,
            "heading_deg": angle,
            "must_reverse": False,
        }
        found[f"zigzag {angle:g}/{angle:g}"] = partial(zigzag, **own, **times)
        found[f"turning circle {angle:g}"] = partial(
            turning_circle, rudder_deg=angle, **times
        )
        found[f"binary rudder {angle:g}"] = partial(
            prbs_rudder, amplitude_deg=angle, **times
        )
    return found


def check_criterion(criterion: str, coefficient: str | None) -> None:
    """Refuse an unknown criterion, and a coefficient beside one that is of all coefficients."""
    check_choice(criterion, CRITERIA, "criterion")
    if coefficient is not None and criterion != "c":
        told = (
            f"coefficient: '{coefficient}' found, which criterion '{criterion}' has no"
            " use for"
        )
        raise InputError(f"{told}; leave it out, or take criterion 'c'")


def advise(
    model: ShipModel,
    trials: Sequence[Trial],
    candidates: Mapping[str, Manoeuvre] | None = None,
    criterion: str = "c",
    coefficient: str | None = None,
    number: int = 1,
) -> Advice:
    """Which manoeuvres to run next, chosen one after the other.

    Raises InputError for an unknown criterion or coefficient, and where no candidate
    can be simulated.

    Parameters
    ----------
    model : ShipModel
        As identified from the trials so far; with a table of terms.
    trials : sequence of Trial
        Those trials; their residuals give the noise.
    candidates : mapping of str to callable, optional
        Simulate a manoeuvre with a model; by default `standard_candidates`. One with
        which the model runs away is left out.
    criterion : {"c", "D", "E"}
        What to shrink: the standard error of one coefficient, the volume or the longest
        axis of the ellipsoid.
    coefficient : str, optional
        Of "c"; by default the one whose standard error changes the accelerations of a
        hard turn most, so that a coefficient near zero is not taken for uncertain.
    number : int
        How many to choose; the same one may be chosen again.
    """
    check_criterion(criterion, coefficient)
    if coefficient is not None:
        check_choice(coefficient, model.coefficients, "coefficient")
    if number < 1:
        raise InputError(f"number: {number} found, expected at least 1")
    if not trials:
        raise InputError(
            "trials: none found, expected those that the model was identified from"
        )
    regressions = [_regression(model, trial) for trial in trials]
    noise = _noise(model, regressions)
    known = tuple(
        _information_of(model, t.name, s, noise)
        for t, s in zip(trials, regressions, strict=True)
    )
    offers = _offers(
        model, standard_candidates(model) if candidates is None else candidates, noise
    )
    names = tuple(model.coefficients)
    total = np.sum([trial.information for trial in known], axis=0)
    size = np.abs(np.array(list(model.coefficients.values())))
    size = np.where(
        size > 0.0, size, _errors(total, np.ones(len(size)))
    )  # the error itself of one that is 0
    before = dict(zip(names, _errors(total, size).tolist(), strict=True))
    worst = (
        _most_felt(model, size * np.array(list(before.values())))
        if coefficient is None
        else coefficient
    )
    steps, chosen = list[dict[str, float]](), list[str]()
    for _ in range(number):
        steps.append(_gains(total, offers, size, criterion, names.index(worst)))
        chosen.append(max(steps[-1], key=lambda name: steps[-1][name]))
        total = total + offers[chosen[-1]]
    after = dict(zip(names, _errors(total, size).tolist(), strict=True))
    return Advice(criterion, worst, known, before, tuple(steps), tuple(chosen), after)


def _most_felt(model: ShipModel, errors: Floats) -> str:
    """The coefficient whose error, shape (n_coefficients,), changes the accelerations of a hard turn most."""
    table, matrix = table_of(model), model.acceleration_matrix
    sizes = hard_turn_features(table, model.particulars, model.service_shaft_speed)
    values, felt = (
        matrix @ np.array(list(model.coefficients.values())),
        np.zeros(len(errors)),
    )
    for q, rows in table.regression_rows.items():
        felt = np.maximum(
            felt, np.abs(matrix[rows]).T @ sizes[q] / (np.abs(values[rows]) @ sizes[q])
        )
    return list(model.coefficients)[int(np.argmax(felt * errors))]


def _gains(
    total: Floats, offers: Mapping[str, Floats], size: Floats, criterion: str, at: int
) -> dict[str, float]:
    """By what factor each candidate would shrink what the criterion measures."""
    now = _uncertainty(total, size, criterion, at)
    return {
        name: now / _uncertainty(total + extra, size, criterion, at)
        for name, extra in offers.items()
    }


def _regression(model: ShipModel, trial: Trial) -> Samples:
    """Regression over windows of the same time, whatever the sampling."""
    window = max(
        round(WINDOW * model.travel_time / float(np.median(np.diff(trial.t)))), 1
    )
    window = min(window, max(len(trial) // 10, 1))
    ship, shaft = model.particulars, model.service_shaft_speed
    return build_samples(
        [trial], table_of(model), ship, "integral", window, shaft_speed=shaft
    )


def _noise(model: ShipModel, regressions: Sequence[Samples]) -> dict[str, float]:
    """Variance of what the model leaves of the targets, by equation."""
    values = model.acceleration_matrix @ np.array(list(model.coefficients.values()))
    noise = {}
    for q, rows in table_of(model).regression_rows.items():
        targets = np.concatenate([s.targets[q] for s in regressions])
        errors = (
            targets
            - np.concatenate([s.features[q] for s in regressions]) @ values[rows]
        )
        # data without noise leave rounding errors only
        noise[q] = max(
            float(np.mean(errors**2)),
            JITTER * float(np.mean(targets**2)),
            np.finfo(float).tiny,
        )
    return noise


def _information_of(
    model: ShipModel, name: str, samples: Samples, noise: Mapping[str, float]
) -> TrialInformation:
    condition, inflation = dict[str, float](), dict[str, float]()
    for q, X in samples.features.items():
        scaled, condition[q] = scaled_features(X)
        factors = variance_inflation(scaled).tolist()
        inflation |= dict(zip(model.table.regression_names(q), factors, strict=True))
    return TrialInformation(
        name, condition, inflation, fisher_information(model, samples, noise)
    )


def _offers(
    model: ShipModel, candidates: Mapping[str, Manoeuvre], noise: Mapping[str, float]
) -> dict[str, Floats]:
    """Information that each candidate would add."""
    offers = {}
    for name, manoeuvre in candidates.items():
        try:
            trial = manoeuvre(model)
        except UnstableModelError:
            continue
        if (
            "n_command" in trial and "n" not in trial
        ):  # what is only commanded is as commanded
            trial = trial.with_channels({"n": trial["n_command"]})
        offers[name] = fisher_information(model, _regression(model, trial), noise)
    if not offers:
        raise InputError(
            f"candidates: {len(candidates)} found, none that model {model.name!r}"
            " survives, expected one that can be simulated; give gentler manoeuvres"
        )
    return offers


def _covariance(information: Floats, size: Floats) -> Floats:
    """Covariance of the relative errors; what is not excited gets a large one instead of an infinite."""
    values, vectors = np.linalg.eigh(information * np.outer(size, size))
    values = np.maximum(values, FLOOR * max(values[-1], np.finfo(float).tiny))
    return np.asarray((vectors / values) @ vectors.T)


def _errors(information: Floats, size: Floats) -> Floats:
    return np.sqrt(np.diag(_covariance(information, size)))


def _uncertainty(information: Floats, size: Floats, criterion: str, at: int) -> float:
    """What the criterion shrinks, in the units of a relative standard error."""
    covariance = _covariance(information, size)
    if criterion == "c":
        return float(np.sqrt(covariance[at, at]))
    axes = np.sqrt(np.maximum(np.linalg.eigvalsh(covariance), np.finfo(float).tiny))
    return float(np.exp(np.mean(np.log(axes)))) if criterion == "D" else float(axes[-1])
