"""Coefficients pulled toward what is known of similar ships: what holds in short trials and hard turns.

Generalised ridge regression: |y - X w|^2 + (w - w0)' S (w - w0) is made small by
fitting w - w0 to the samples and to the root of S as further samples (Hoerl & Kennard
1970; Tikhonov 1963).

Two kinds of prior. A reference ship: w0 is what the structure gives on its virtual
trials at the target's scale, and S is the moment of those trials' features, so that
this is the same as mixing samples of a reference ship's zigzags and turns into the
regression. Formulas (Clarke 1983, Kijima 1990): w0 is theirs, and S is diagonal, each
coefficient weighed by what its term contributes in a hard turn.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from identification.estimators.estimator import Estimator, Estimators, FitTask
from identification.estimators.methods import Method, fit_all, get_method
from identification.regression.samples import Samples, build_samples
from identification.simulation_error.formulas import FORMULAS, formula_coefficients
from identification.simulation_error.prior_knowledge import PriorKnowledge
from identification.simulation_error.similarity import AUTO, select_reference
from identification.validation.folds import (
    LARGEST_RUDDER,
    TRIALS,
    of_largest_rudder,
)
from identification.validation.guard import (
    hard_turn_features,
    reasons_unstable,
    with_coefficients,
)
from shipgym import InputError, ShipModel, Trial
from shipgym.arrays import Flags, Floats
from shipgym.manoeuvres import turning_circle, zigzag
from shipgym.ships import GreyBox, converted_model

STRENGTHS = (0.0, *np.geomspace(1e-4, 10.0, 11).tolist(), np.inf)
BLOCKS = 5  # of time, into which a single trial is cut
#: Virtual trials of a reference ship: rudder and heading of zigzags, rudder of turns,
#: degrees.
ZIGZAGS = ((10.0, 10.0, False), (20.0, 20.0, True), (35.0, 20.0, False))
TURNS = (35.0, -35.0, 15.0, -15.0)
DURATION_LENGTHS, STEP_LENGTHS = (
    20.0,
    0.05,
)  # of the virtual trials, ship lengths at service speed


@dataclass(frozen=True, eq=False)
class Prior:
    """What the coefficients of the SI features are pulled to."""

    name: str  # the reference ship, or whose formulas
    centre: dict[str, Floats]  # w0 of each equation, shape (n_terms,)
    #: root of S per sample and second of window: S is strength^2 n_samples duration^2
    #: root' root, shape (n_rows, n_terms)
    roots: dict[str, Floats]
    #: which coefficients the prior determines; the others are free, shape (n_terms,)
    known: dict[str, Flags]


def formula_prior(formula: str, blank: ShipModel) -> Prior:
    """The prior of the formulas of Clarke 1983 or Kijima 1990; arguments as in `formula_coefficients`."""
    ship, table = blank.particulars, blank.table
    found = formula_coefficients(formula, table, ship)
    sizes = hard_turn_features(table, ship, blank.service_shaft_speed)
    centre = {q: values for q, (values, _) in found.items()}
    known = {q: rows for q, (_, rows) in found.items()}
    return Prior(
        formula,
        centre,
        {q: np.diag(sizes[q])[rows] for q, rows in known.items()},
        known,
    )


def reference_prior(reference: str | ShipModel, blank: ShipModel) -> Prior:
    """The prior of a reference ship: its virtual trials at the target's scale, in the target's structure.

    A model, its name or file, or "auto" for the shipped one most like the target, which
    is complete but for its coefficients. Raises InputError for a reference that does
    not exist, or too little known to choose one.
    """
    ship, table = blank.particulars, blank.table
    model = _at_target(reference, blank)
    samples = build_samples(
        virtual_trials(model),
        table,
        ship,
        smoothing="none",
        gear=blank.steering,
        window=1,
        shaft_speed=blank.service_shaft_speed,
    )
    centre = {
        q: one.coef_ for q, one in fit_all(get_method("ls").make, samples).items()
    }
    weight = 1.0 / (samples.duration[:, None] * np.sqrt(len(samples)))
    roots = {
        q: np.asarray(np.linalg.qr(X * weight, mode="r"))
        for q, X in samples.features.items()
    }
    assert isinstance(model.table, GreyBox)
    known = {q: np.ones(len(values), dtype=bool) for q, values in centre.items()}
    return Prior(model.table.ship.name, centre, roots, known)


def _at_target(reference: str | ShipModel, blank: ShipModel) -> ShipModel:
    """A reference ship at the target's scale."""
    ship = blank.particulars
    if reference == AUTO:
        reference, _ = select_reference(ship.completed())
    return converted_model(reference, ship, blank.steering, blank.service_shaft_speed)


def reference_turns(reference: str | ShipModel, blank: ShipModel) -> list[Trial]:
    """A reference ship's turning circles at the target's scale; arguments as in `reference_prior`."""
    turns = virtual_trials(_at_target(reference, blank))[len(ZIGZAGS) :]
    return [turn.part(slice(None, None, 2)) for turn in turns]


def virtual_trials(model: ShipModel) -> list[Trial]:
    """Zigzags and turning circles to both sides, up to the rudder's limit, with the channel n."""
    travel = model.travel_time
    timing: dict[str, Any] = {
        "duration": DURATION_LENGTHS * travel,
        "dt": STEP_LENGTHS * travel,
    }
    limit = model.steering.rudder_limit_deg
    runs = [
        zigzag(model, min(rudder, limit), heading, port, **timing)
        for rudder, heading, port in ZIGZAGS
    ]
    runs += [
        turning_circle(model, float(np.clip(rudder, -limit, limit)), **timing)
        for rudder in TURNS
    ]
    trials = []
    for index, run in enumerate(runs):
        channels = {name: run[name] for name in model.state_names}
        channels["n"] = np.full(len(run), model.service_shaft_speed)
        trials.append(Trial(run.t, channels, name=f"virtual-{index}"))
    return trials


def with_prior(method: Method, knowledge: PriorKnowledge, blank: ShipModel) -> Method:
    """The method, with its coefficients pulled toward a prior.

    The method fits what the prior leaves: where it drops a direction, the prior's
    coefficients stay. `knowledge`: its source is "auto", "clarke", "kijima", or a
    reference ship; a strength of 0 leaves the method as it is, infinity gives the
    prior, None chooses by cross-validation (`Pulled.chosen_strength`); `blank`: the
    target but for its coefficients. Raises InputError for a grey box, which has a
    reference ship, and for a prior without coefficients for the structure.
    """
    source = knowledge.source
    assert source is not None
    if isinstance(blank.table, GreyBox):
        raise InputError(
            "prior: expected none with structure 'grey-box', which has a reference ship"
            f" already, got {source!r}; leave the prior out, or choose another"
            " structure"
        )
    by_formula = isinstance(source, str) and source in FORMULAS
    prior = (
        formula_prior(str(source), blank)
        if by_formula
        else reference_prior(source, blank)
    )

    def fit(make: Callable[[], Estimator], task: FitTask) -> Estimators:
        pulled = Pulled(method, make, prior, task)
        return pulled.fitted(knowledge.strength, knowledge.folds)

    return replace(method, fit=fit)


@dataclass(frozen=True, eq=False)
class Pulled:
    """A method whose coefficients are pulled toward a prior."""

    method: Method  # fits where there is no pull
    make: Callable[[], Estimator]  # makes an unfitted estimator
    prior: Prior
    task: FitTask  # with the regression

    def at(self, strength: float, samples: Samples | None = None) -> Estimators:
        """Estimators fitted with a strength: 0 is the method as it is, infinity the prior."""
        samples = self.task.samples if samples is None else samples
        if strength == 0.0:
            return self.method.fit(self.make, replace(self.task, samples=samples))
        return {
            q: _toward(self.make(), samples, q, self.prior, strength)
            for q in samples.features
        }

    def fitted(self, strength: float | None, folds: str) -> Estimators:
        """Estimators fitted with the strength given, or chosen, with a report as `prior_`."""
        report: dict[str, Any] = {"prior_source": self.prior.name}
        if strength is None:
            best, report["prior_scores"] = self.chosen_strength(folds)
            strength = self.steady_strength(best)
            if strength > best:
                report["prior_raised_from"] = best
        estimators = self.at(strength)
        report["prior_strength"] = (
            None if np.isinf(strength) else strength
        )  # JSON knows no infinity
        for estimator in estimators.values():
            estimator.prior_ = report  # type: ignore[attr-defined]
        return estimators

    def steady_strength(self, least: float) -> float:
        """The least strength, from a given one on, with which the model does not run away, else that one."""
        for strength in STRENGTHS[STRENGTHS.index(least) :]:
            model = with_coefficients(self.task.blank, self.at(strength))
            if not reasons_unstable(model, self.task.trials):
                return float(strength)
        return least

    def chosen_strength(self, folds: str = TRIALS) -> tuple[float, dict[str, float]]:
        """The strongest pull that is as good as the best on samples held out, and the error of each strength.

        Held out are the trials one by one, or blocks of time of a single trial, or each
        of those with the largest rudder by a fit to all that have less. As good: within
        one standard error of the best (Breiman et al. 1984), because what the prior is
        for, hard turns, is in none of them. Errors are mean squares by that of no
        change at all.
        """
        splits = list(_folds(self.task, folds))
        errors = np.array(
            [[_error(self.at(s, fit), held) for fit, held in splits] for s in STRENGTHS]
        )
        mean = errors.mean(axis=1)
        excess = errors - errors[int(np.argmin(mean))]
        standard_error = excess.std(axis=1) / np.sqrt(max(len(splits) - 1, 1))
        as_good = np.flatnonzero(excess.mean(axis=1) <= standard_error)
        scores = {
            f"{s:.3g}": float(value) for s, value in zip(STRENGTHS, mean, strict=True)
        }
        return float(STRENGTHS[int(as_good[-1])]), scores


def _toward(
    estimator: Estimator, samples: Samples, q: str, prior: Prior, strength: float
) -> Estimator:
    X, centre, known = samples.features[q], prior.centre[q], prior.known[q]
    rest = samples.targets[q] - X @ centre
    if np.isinf(strength):
        return _held(estimator, X, rest, centre, known)
    pull = (
        strength * np.sqrt(len(X)) * float(np.mean(samples.duration)) * prior.roots[q]
    )
    estimator.fit(np.vstack([X, pull]), np.concatenate([rest, np.zeros(len(pull))]))
    estimator.coef_ = estimator.coef_ + centre
    if hasattr(estimator, "weights_"):
        estimator.weights_ = estimator.weights_[: len(X)]
    return estimator


def _held(
    estimator: Estimator, X: Floats, rest: Floats, centre: Floats, known: Flags
) -> Estimator:
    """The prior's own coefficients; those it leaves open are fitted."""
    free, (moment, covariance) = (
        np.flatnonzero(~known),
        np.zeros((2, len(known), len(known))),
    )
    estimator.fit(
        X[:, free] if free.size else X, rest
    )  # without free ones for its attributes alone
    coefficients = centre.copy()
    if free.size:
        coefficients[free] = estimator.coef_
        moment[np.ix_(free, free)] = estimator.inverse_moment_
        covariance[np.ix_(free, free)] = estimator.covariance_
    estimator.coef_, estimator.inverse_moment_, estimator.covariance_ = (
        coefficients,
        moment,
        covariance,
    )
    estimator.n_features_in_ = len(known)  # type: ignore[attr-defined]
    return estimator


def _folds(task: FitTask, folds: str) -> Iterator[tuple[Samples, Samples]]:
    """Samples to fit and samples held out."""
    samples = task.samples
    if folds == LARGEST_RUDDER:
        largest = of_largest_rudder(task.trials, "prior_folds")
        fit = samples.select(~largest[samples.trial])
        yield from (
            (fit, samples.select(samples.trial == held))
            for held in np.flatnonzero(largest)
        )
        return
    several = samples.trial.max() > samples.trial.min()
    groups = (
        samples.trial if several else np.arange(len(samples)) * BLOCKS // len(samples)
    )
    for group in np.unique(groups):
        yield samples.select(groups != group), samples.select(groups == group)


def _error(estimators: Mapping[str, Estimator], held: Samples) -> float:
    """Mean over the equations of the square error by the square of the target."""
    errors = {
        q: y - held.features[q] @ estimators[q].coef_ for q, y in held.targets.items()
    }
    sizes = {
        q: max(float(np.mean(y**2)), np.finfo(float).tiny)
        for q, y in held.targets.items()
    }
    return float(np.mean([np.mean(error**2) / sizes[q] for q, error in errors.items()]))
