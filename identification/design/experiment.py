"""Which manoeuvre to run next.

Candidates are simulated on the current model and ranked by what adding their
information makes of the least covariance (Fedorov 1972, Theory of optimal experiments):
c-optimal for one coefficient, D-optimal for the volume of the ellipsoid of all of them.
Coefficients count relative to their size.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from rich.table import Table

from identification.arrays import by_name
from identification.design.information import (
    TrialInformation,
    coefficient_values,
    fisher_information,
    noise_variance,
    relative_errors,
    table_of,
    trial_information,
    trial_regression,
    uncertainty,
)
from identification.models.hard_turn import hard_turn_features
from identification.text import as_text, lined_table
from shipgym import InputError, ShipModel, Trial, UnstableModelError
from shipgym.arrays import Floats
from shipgym.checks import check_choice
from shipgym.manoeuvres import prbs_rudder, turning_circle, zigzag
from shipgym.models.by_name import takes_name

#: Simulates a manoeuvre with a model.
Candidate = Callable[[ShipModel], Trial]


@dataclass(frozen=True, eq=False)
class Advice:
    """Which manoeuvres to run next.

    Attributes
    ----------
    criterion : str
        "c" or "D".
    coefficient : str
        That which "c" shrinks.
    trials : tuple of TrialInformation
        Of the trials so far.
    before : dict of str to float
        Relative standard error of each coefficient from the trials so far.
    steps : tuple of dict of str to float
        Of each choice the gain of all candidates, the largest is best: by what factor
        the standard error ("c") or the mean axis ("D") of the relative errors shrinks.
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
        trials = {}
        for trial in self.trials:
            diagonal = np.diag(trial.information)
            trials[trial.name] = {
                "condition_number": trial.condition_number,
                "variance_inflation": trial.inflation,
                "information": by_name(self.before, diagonal),
            }
        return {
            "criterion": self.criterion,
            "coefficient": self.coefficient,
            "trials": trials,
            "relative_errors": {"now": self.before, "expected": self.after},
            "gains": list(self.steps),
            "run_next": list(self.chosen),
        }

    def __str__(self) -> str:
        return as_text(self._trials_so_far(), self._candidates(), self._errors())

    def _trials_so_far(self) -> Table:
        place = list(self.before).index(self.coefficient)
        known = np.array([trial.information[place, place] for trial in self.trials])
        shares = known / (known.sum() or 1.0)
        table = lined_table(
            "Trials so far",
            "trial",
            "condition number",
            "largest inflation",
            f"information on {self.coefficient}",
        )
        for trial, share in zip(self.trials, shares, strict=True):
            worst, inflation = _descending(trial.inflation)[0]
            conditions = [f"{q} {c:.0f}" for q, c in trial.condition_number.items()]
            per_cent = 100.0 * share
            table.add_row(
                trial.name,
                ", ".join(conditions),
                f"{inflation:.0f} ({worst})",
                f"{per_cent:.0f} % of all",
            )
        return table

    def _candidates(self) -> Table:
        shrunk = f" for {self.coefficient}" if self.criterion == "c" else ""
        title = f"Run next ({self.criterion}-optimal{shrunk})"
        numbers = range(1, len(self.chosen) + 1)
        headings = [f">gain, choice {number}" for number in numbers]
        table = lined_table(title, "candidate", *headings)
        for name, _ in _descending(self.steps[0]):
            cells = []
            for step, chosen in zip(self.steps, self.chosen, strict=True):
                gain = f"{step[name]:.2f}"
                if name == chosen:
                    gain += " *"
                cells.append(gain)
            table.add_row(name, *cells)
        return table

    def _errors(self) -> Table:
        table = Table(
            "coefficient",
            "relative error now",
            "expected",
            title_justify="left",
        )
        for name, before in _descending(self.before):
            after = self.after[name]
            table.add_row(name, f"{before:.2g}", f"{after:.2g}")
        return table


def _descending(values: Mapping[str, float]) -> list[tuple[str, float]]:
    """Names and values, the largest first."""
    return sorted(values.items(), key=lambda item: item[1], reverse=True)


def standard_candidates(model: ShipModel) -> dict[str, Candidate]:
    """Manoeuvres that trials usually consist of, each of 40 ship lengths.

    Zigzags and turning circles of several angles, up to the rudder's limit, and a
    pseudo-random binary rudder; lengths at service speed.
    """
    travel = model.travel_time
    times: dict[str, Any] = {"duration": 40.0 * travel, "dt": travel / 60}
    limit = model.steering.rudder_limit_deg
    usual = (5.0, 10.0, 20.0, min(35.0, limit))

    found: dict[str, Candidate] = {}
    for angle in usual:
        if angle > limit:
            continue
        found[f"zigzag {angle:g}/{angle:g}"] = partial(
            zigzag,
            rudder_deg=angle,
            heading_deg=angle,
            must_reverse=False,
            **times,
        )
        found[f"turning circle {angle:g}"] = partial(
            turning_circle,
            rudder_deg=angle,
            **times,
        )
        found[f"binary rudder {angle:g}"] = partial(
            prbs_rudder,
            amplitude_deg=angle,
            **times,
        )
    return found


def check_criterion(criterion: str, coefficient: str | None) -> None:
    """Refuse an unknown criterion, and a coefficient for one of all coefficients."""
    criteria = ("c", "D")
    check_choice(criterion, criteria, "criterion")
    if coefficient is not None and criterion != "c":
        raise InputError(
            f"coefficient: expected none with criterion '{criterion}', which is of all"
            f" coefficients, got '{coefficient}'; leave it out, or take criterion 'c'"
        )


@takes_name
def advise(
    model: ShipModel,
    trials: Sequence[Trial],
    candidates: Mapping[str, Candidate] | None = None,
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
    criterion : {"c", "D"}
        What to shrink: the standard error of one coefficient, or the volume of the
        ellipsoid.
    coefficient : str, optional
        Of "c"; by default the one whose standard error changes the accelerations of a
        hard turn most, so that a coefficient near zero is not taken for uncertain.
    number : int
        How many to choose; the same one may be chosen again.
    """
    _check_advisable(model, trials, criterion, coefficient, number)
    regressions = [trial_regression(model, trial) for trial in trials]
    noise = noise_variance(model, regressions)
    known = tuple(
        trial_information(model, trial.name, samples, noise)
        for trial, samples in zip(trials, regressions, strict=True)
    )
    if candidates is None:
        candidates = standard_candidates(model)
    offers = _offers(model, candidates, noise)

    total = np.sum([trial.information for trial in known], axis=0)
    size = _sizes(model, total)
    before = relative_errors(total, size)
    if coefficient is None:
        coefficient = most_felt(model, size * before)

    names = list(model.coefficients)
    place = names.index(coefficient)
    plan = _plan(total, offers, size, criterion, place, number)
    after = relative_errors(plan.information, size)
    return Advice(
        criterion=criterion,
        coefficient=coefficient,
        trials=known,
        before=by_name(names, before),
        steps=tuple(plan.steps),
        chosen=tuple(plan.chosen),
        after=by_name(names, after),
    )


class _Plan(NamedTuple):
    """Candidates chosen one after the other."""

    steps: list[dict[str, float]]  # gain of each candidate, by choice
    chosen: list[str]
    information: Floats  # with those chosen


def _plan(
    total: Floats,
    offers: Mapping[str, Floats],
    size: Floats,
    criterion: str,
    place: int,
    number: int,
) -> _Plan:
    """Choose a number of candidates, each the best after those before it."""
    steps = list[dict[str, float]]()
    chosen = list[str]()
    for _ in range(number):
        gains = gains_of(total, offers, size, criterion, place)
        best, _ = _descending(gains)[0]
        steps.append(gains)
        chosen.append(best)
        total = total + offers[best]
    return _Plan(steps, chosen, total)


def _check_advisable(
    model: ShipModel,
    trials: Sequence[Trial],
    criterion: str,
    coefficient: str | None,
    number: int,
) -> None:
    check_criterion(criterion, coefficient)
    if coefficient is not None:
        check_choice(coefficient, model.coefficients, "coefficient")
    if number < 1:
        raise InputError(f"number: expected at least 1, got {number}")
    if not trials:
        raise InputError(
            "trials: expected those that the model was identified from, got none"
        )


def _sizes(model: ShipModel, total: Floats) -> Floats:
    """Sizes of the coefficients; of one that is 0 its error from some information."""
    size = np.abs(coefficient_values(model))
    errors = relative_errors(total, np.ones(len(size)))
    return np.where(size > 0.0, size, errors)


def most_felt(model: ShipModel, errors: Floats) -> str:
    """The coefficient whose error changes the accelerations of a hard turn most.

    `errors`: standard errors, shape (n_coefficients,).
    """
    felt = _felt_per_unit(model)
    worst = int(np.argmax(felt * errors))
    names = list(model.coefficients)
    return names[worst]


def _felt_per_unit(model: ShipModel) -> Floats:
    """Change of an acceleration in a hard turn by a unit of each coefficient.

    By the size of all its terms, in the equation where it is largest, shape
    (n_coefficients,).
    """
    table = table_of(model)
    sizes = hard_turn_features(table, model.particulars, model.service_shaft_speed)
    matrix = model.acceleration_matrix
    terms = matrix @ coefficient_values(model)

    felt = np.zeros(matrix.shape[1])
    for q, rows in table.regression_rows.items():
        by_coefficient = np.abs(matrix[rows]).T @ sizes[q]
        whole = np.abs(terms[rows]) @ sizes[q]
        share = by_coefficient / whole
        felt = np.maximum(felt, share)
    return felt


def gains_of(
    total: Floats,
    offers: Mapping[str, Floats],
    size: Floats,
    criterion: str,
    place: int,
) -> dict[str, float]:
    """Factor by which each candidate would shrink what the criterion measures.

    `total`: information so far, `offers`: that of each candidate; `place`: of the
    coefficient that "c" shrinks.
    """
    now = uncertainty(total, size, criterion, place)
    gains = {}
    for name, offer in offers.items():
        expected = uncertainty(total + offer, size, criterion, place)
        gains[name] = now / expected
    return gains


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
        regression = trial_regression(model, trial)
        offers[name] = fisher_information(model, regression, noise)
    if not offers:
        raise InputError(
            f"candidates: expected one that model {model.name!r} can simulate, got"
            f" {len(candidates)} in which it runs away; give gentler manoeuvres"
        )
    return offers
