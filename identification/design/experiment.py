"""Which manoeuvre to run next.

Candidates are simulated on the current model and ranked by what adding their Fisher
information makes of the least standard error of one coefficient (c-optimal; Fedorov
1972, Theory of optimal experiments). The information of a linear regression with white
errors is X'X / sigma^2, which adds up over trials.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from identification.arrays import by_name, mean_square
from identification.models.guard import hard_turn_features
from identification.samples.samples import Samples, build_samples
from identification.text import as_text, lined_table
from shipgym import InputError, ShipModel, Trial, UnstableModelError
from shipgym.arrays import Floats
from shipgym.checks import check_choice
from shipgym.manoeuvres import turning_circle, zigzag
from shipgym.models.by_name import takes_name
from shipgym.ships import Structure
from shipgym.trials.resampling import usual_step

#: Simulates a manoeuvre with a model.
Candidate = Callable[[ShipModel], Trial]


@dataclass(frozen=True, eq=False)
class Advice:
    """Which manoeuvres to run next.

    Attributes
    ----------
    coefficient : str
        That whose standard error is shrunk.
    before : dict of str to float
        Relative standard error of each coefficient from the trials so far.
    steps : tuple of dict of str to float
        Of each choice the gain of all candidates, the largest is best: by what factor
        the standard error shrinks.
    chosen : tuple of str
        The candidates to run, in this order.
    after : dict of str to float
        Relative standard errors with them.
    """

    coefficient: str
    before: dict[str, float]
    steps: tuple[dict[str, float], ...]
    chosen: tuple[str, ...]
    after: dict[str, float]

    def to_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        return {
            "coefficient": self.coefficient,
            "relative_errors": {"now": self.before, "expected": self.after},
            "gains": list(self.steps),
            "run_next": list(self.chosen),
        }

    def __str__(self) -> str:
        headings = [f">gain, choice {k + 1}" for k in range(len(self.chosen))]
        gains = lined_table(f"Run next for {self.coefficient}", "candidate", *headings)
        for name in _descending(self.steps[0]):
            cells = [
                f"{step[name]:.2f}{' *' if name == chosen else ''}"
                for step, chosen in zip(self.steps, self.chosen, strict=True)
            ]
            gains.add_row(name, *cells)
        errors = lined_table(
            "Relative standard errors", "coefficient", ">now", ">expected"
        )
        for name in _descending(self.before):
            errors.add_row(name, f"{self.before[name]:.2g}", f"{self.after[name]:.2g}")
        return as_text(gains, errors)


def _descending(values: Mapping[str, float]) -> list[str]:
    """Names, that of the largest value first."""
    return sorted(values, key=lambda name: -values[name])


def standard_candidates(model: ShipModel) -> dict[str, Candidate]:
    """Manoeuvres that trials usually consist of, each of 40 ship lengths.

    Zigzags and turning circles of several angles, up to the rudder's limit; lengths at
    service speed.
    """
    travel = model.travel_time
    times: dict[str, Any] = {"duration": 40.0 * travel, "dt": travel / 60}
    weave = partial(zigzag, must_reverse=False, **times)
    turn = partial(turning_circle, **times)
    limit = model.steering.rudder_limit_deg
    found: dict[str, Candidate] = {}
    for angle in (5.0, 10.0, 20.0, min(35.0, limit)):
        if angle <= limit:
            found |= {
                f"zigzag {angle:g}/{angle:g}": partial(
                    weave, rudder_deg=angle, heading_deg=angle
                ),
                f"turning circle {angle:g}": partial(turn, rudder_deg=angle),
            }
    return found


@takes_name
def advise(
    model: ShipModel,
    trials: Sequence[Trial],
    candidates: Mapping[str, Candidate] | None = None,
    coefficient: str | None = None,
    number: int = 1,
) -> Advice:
    """Which manoeuvres to run next, chosen one after the other.

    Raises InputError for an unknown coefficient, and where no candidate can be
    simulated.

    Parameters
    ----------
    model : ShipModel
        As identified from the trials so far; with a table of terms.
    trials : sequence of Trial
        Those trials; their residuals give the noise.
    candidates : mapping of str to callable, optional
        Simulate a manoeuvre with a model; by default `standard_candidates`. One with
        which the model runs away is left out.
    coefficient : str, optional
        Whose standard error is shrunk; by default the one whose error changes the
        accelerations of a hard turn most.
    number : int
        How many to choose; the same one may be chosen again.
    """
    if not trials:
        raise InputError(
            "trials: expected those that the model was identified from, got none"
        )
    if not isinstance(model.dynamics, Structure):
        raise InputError(
            "structure: expected a table of terms, such as 'abkowitz', got"
            f" {model.structure!r}"
        )
    regressions = [_regression(model, trial) for trial in trials]
    noise = _noise_variance(model, regressions)
    total = np.sum([_information(model, rows, noise) for rows in regressions], axis=0)
    values = np.array(list(model.coefficients.values()))
    errors = _relative_errors(total, np.ones(len(values)))
    size = np.where(values, np.abs(values), errors)
    before = _relative_errors(total, size)

    names = list(model.coefficients)
    if coefficient is None:
        coefficient = names[int(np.argmax(_felt_per_unit(model) * size * before))]
    check_choice(coefficient, names, "coefficient")
    place = names.index(coefficient)
    offers = _offers(model, candidates or standard_candidates(model), noise)
    steps, chosen = [], []
    for _ in range(number):
        gains = _gains(total, offers, size, place)
        steps.append(gains)
        chosen.append(_descending(gains)[0])
        total = total + offers[chosen[-1]]
    return Advice(
        coefficient=coefficient,
        before=by_name(names, before),
        steps=tuple(steps),
        chosen=tuple(chosen),
        after=by_name(names, _relative_errors(total, size)),
    )


def _gains(
    total: Floats,
    offers: Mapping[str, Floats],
    size: Floats,
    place: int,
) -> dict[str, float]:
    """By what factor each candidate shrinks the error of a coefficient."""
    now = _relative_errors(total, size)[place]
    return {
        name: float(now / _relative_errors(total + offer, size)[place])
        for name, offer in offers.items()
    }


def _regression(model: ShipModel, trial: Trial) -> Samples:
    """Regression of a trial over windows of the same time, whatever the sampling."""
    share = 0.2  # of the time to sail a ship length: velocities are integrated over it
    window = max(round(share * model.travel_time / usual_step(trial.t)), 1)
    return build_samples(
        [trial],
        model.table,
        model.particulars,
        "integral",
        min(window, max(len(trial) // 10, 1)),
        shaft_speed=model.service_shaft_speed,
    )


def _noise_variance(
    model: ShipModel, regressions: Sequence[Samples]
) -> dict[str, float]:
    """Variance of what the model leaves of the targets, by equation."""
    accelerations = _accelerations(model)
    noise = {}
    for q, rows in model.table.regression_rows.items():
        targets = np.concatenate([samples.targets[q] for samples in regressions])
        features = np.concatenate([samples.features[q] for samples in regressions])
        # data without noise leave rounding errors only
        least = max(1e-12 * mean_square(targets), 1e-300)
        noise[q] = max(mean_square(targets - features @ accelerations[rows]), least)
    return noise


def _accelerations(model: ShipModel) -> Floats:
    """Coefficients of the accelerations' terms."""
    values = np.array(list(model.coefficients.values()))
    return np.asarray(model.acceleration_matrix @ values)


def _information(
    model: ShipModel, samples: Samples, noise: Mapping[str, float]
) -> Floats:
    """Fisher information on the coefficients, for exact features and white errors.

    `noise` is the variance of the targets' errors, by equation. Shape (n_coefficients,
    n_coefficients).
    """
    matrix = model.acceleration_matrix
    of_terms = np.zeros(matrix.shape)
    for q, rows in model.table.regression_rows.items():
        X = samples.features[q]
        of_terms[rows, rows] = X.T @ X / noise[q]
    return matrix.T @ of_terms @ matrix


def _relative_errors(information: Floats, size: Floats) -> Floats:
    """Relative standard errors of coefficients of some sizes.

    What is not excited gets a large one instead of an infinite.
    """
    values, vectors = np.linalg.eigh(information * np.outer(size, size))
    least = 1e-14 * max(values[-1], np.finfo(float).tiny)
    return np.asarray(np.sqrt(vectors**2 @ (1.0 / np.maximum(values, least))))


def _felt_per_unit(model: ShipModel) -> Floats:
    """Change of an acceleration in a hard turn by a unit of each coefficient.

    By the size of all its terms, in the equation where it is largest, shape
    (n_coefficients,).
    """
    table = model.table
    sizes = hard_turn_features(
        table,
        model.particulars,
        model.service_shaft_speed,
    )
    matrix = model.acceleration_matrix
    terms = _accelerations(model)
    felt = np.zeros(matrix.shape[1])
    for q, rows in table.regression_rows.items():
        by_coefficient = np.abs(matrix[rows]).T @ sizes[q]
        felt = np.maximum(felt, by_coefficient / (np.abs(terms[rows]) @ sizes[q]))
    return felt


def _offers(
    model: ShipModel, candidates: Mapping[str, Candidate], noise: Mapping[str, float]
) -> dict[str, Floats]:
    """Information that each candidate would add."""
    offers = {}
    for name, manoeuvre in candidates.items():
        try:
            trial = manoeuvre(model)
        except UnstableModelError:
            continue
        if "n_command" in trial and "n" not in trial:  # the shaft is as commanded
            trial = trial.with_channels({"n": trial["n_command"]})
        offers[name] = _information(model, _regression(model, trial), noise)
    if not offers:
        raise InputError(
            f"candidates: expected one that model {model.name!r} can simulate, got"
            f" {len(candidates)} in which it runs away; give gentler manoeuvres"
        )
    return offers
