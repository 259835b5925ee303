"""Which structure and which method predict trials held out best, where none is named: `structure = "auto"`.

Fits are cheap but for that by simulation error: all structures are fitted once, and the trials left out by
normal equations; only the best are fitted again without each trial, and only the best table by other methods.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from identification.options import Options
from identification.result import IdentificationResult
from identification.simulation_error.similarity import AUTO
from identification.uncertainty.model_error import without_trial
from identification.validation.folds import PIECES
from identification.validation.guarded_fit import with_coefficients
from identification.validation.prediction import predict, trial_metrics
from identification.validation.ranking import Ranking, Standing, named, predicted_in_turn, standing
from shipgym.errors import InputError
from shipgym.ships.grey_boxes import GREY_BOX
from shipgym.ships.mmg import MMG
from shipgym.trials.trial import Trial

Identify = Callable[..., IdentificationResult]

TABLES = (
    "nomoto", "norrbin", "nomoto2", "linear-steering", "steering7", "abkowitz", "abkowitz-full", "cubic",
    "mmg4dof",
)  # fmt: skip
USUAL = {GREY_BOX: "rm-svm"}  # method of a structure, where not that of `identify`
SLOW = "output-error"  # takes seconds a fit
OTHERS = ("cv-lssvr", SLOW)  # methods that the best table is also fitted by
MOST_SAMPLES = 6000  # of all trials, for the slow one
FINALISTS = 3  # tables that are fitted again without each trial
MOST_GROUPS = 5  # of trials that are held out together
SELECTION = ("held_out", "ranking", "refused")  # of a ranking, for the provenance
LEAST_DIFFERENCE = 0.02  # of errors, relative; a smaller one decides nothing


def rank_structures(identify: Identify, trials: Sequence[Trial], options: Options) -> Ranking:
    """Fit every structure that trials and particulars allow and rank them by each trial to fit held out.

    The first of the ranking is the one with the fewest coefficients whose error exceeds the least by no more
    than one standard error of their difference over the trials, or by 2 %.

    Parameters
    ----------
    identify : callable
        From trials and options of one structure to a result.
    trials : sequence of Trial
        To fit; a single one is cut into three, each predicted from the others.
    options : Options
        A method other than the default is the only one, and settings are those of the method; what does not
        know them is refused.

    Raises
    ------
    InputError
        Where no structure can be fitted, with the reason of the first.
    """
    free = options.method == Options.method and not options.settings()
    cheap = replace(options, hold_out=(), model_error=False, uncertainty="analytic")
    search = _Search(identify, trials if len(trials) != 1 else _pieces(trials[0]), cheap)
    for structure in (*TABLES, GREY_BOX, MMG):
        search.fit(structure, USUAL.get(structure, options.method) if free else options.method)
    if not search.results:
        raise InputError(next(iter(search.refused.values())))
    tables = [one for one in search.ranked() if one.structure in TABLES]
    for one in search.ranked():
        if one not in tables[FINALISTS:]:
            search.hold_out(one)
    table = next((one for one in search.ranked() if one.structure in TABLES), None)
    for method in OTHERS if free and table is not None else ():
        if search.fit(table.structure, method):
            search.hold_out(search.standings[named(table.structure, method)])
    ranked = search.ranked()
    best = _simplest(ranked)
    rest = [one for one in ranked if one is not best]
    return Ranking((best, *rest), search.results, search.refused, {}, in_turn=True)


@dataclass(eq=False)
class _Search:
    """Fits of all trials by what they are called, and how well they predict trials held out."""

    identify: Identify
    trials: Sequence[Trial]  # to fit
    options: Options
    results: dict[str, IdentificationResult] = field(default_factory=dict)
    standings: dict[str, Standing] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)

    def ranked(self) -> list[Standing]:
        """The standings, those of trials that were really held out first."""
        return sorted(self.standings.values(), key=lambda one: (not one.refitted, *one.rank))

    def fit(self, structure: str, method: str) -> bool:
        """Fit all trials, and predict each by the fit without its rows; whether that can be done."""
        name, samples = named(structure, method), sum(map(len, self.trials))
        if method == SLOW and samples > MOST_SAMPLES:
            self.refused[name] = f"{samples} samples found, which take long, expected at most {MOST_SAMPLES}"
            return False
        try:
            found = self.identify(self.trials, with_structure(self.options, structure, method))
        except InputError as error:
            self.refused[name] = str(error)
            return False
        name = named(structure, (found.model.provenance or {})["method"])
        self.results[name] = found
        self.standings[name] = standing(found, _without_rows(found, self.trials), self.trials, refitted=False)
        return True

    def hold_out(self, one: Standing) -> None:
        """Predict each trial by a fit of the others."""
        options = with_structure(self.options, one.structure, one.method)
        name = named(one.structure, one.method)
        try:
            seen = predicted_in_turn(
                lambda held: self.identify(self.trials, replace(options, hold_out=held)),
                self.trials,
                MOST_GROUPS,
            )
        except InputError as error:
            self.refused[name] = str(error)
            del self.standings[name], self.results[name]
        else:
            self.standings[name] = standing(self.results[name], seen, self.trials)


def with_structure(options: Options, structure: str, method: str) -> Options:
    """The options for one structure: only some know a reference ship."""
    reference = {GREY_BOX: options.reference_model or AUTO, MMG: options.reference_model}
    return replace(options, structure=structure, method=method, reference_model=reference.get(structure))


def _without_rows(found: IdentificationResult, trials: Sequence[Trial]) -> dict[str, Any]:
    """Metrics of each trial, predicted by the fit whose normal equations the trial was taken off.

    Of the MMG form, which has none, those of the fit: she is always held out.
    """
    if found.model.structure == MMG:
        return dict(found.metrics["trials"])
    metrics = {}
    for k, trial in enumerate(trials):
        estimators, _ = without_trial(found.estimators, found.samples, k)
        model = with_coefficients(found.model, estimators)
        metrics[trial.name] = trial_metrics(model, trial, predict(model, trial))
    return metrics


def _simplest(ranked: Sequence[Standing]) -> Standing:
    """Of those whose errors differ from the first's by chance that with the fewest coefficients."""
    first = ranked[0]
    if first.error is None:
        return first
    tied = [one for one in ranked if one.refitted and one.stable and not one.ran_away and _alike(one, first)]
    return min(tied, key=lambda one: (one.coefficients, one.method in OTHERS), default=first)


def _alike(one: Standing, first: Standing) -> bool:
    excess = np.array([(one.errors[name] or 0.0) - (error or 0.0) for name, error in first.errors.items()])
    chance = float(np.std(excess, ddof=1)) / np.sqrt(len(excess))
    return float(excess.mean()) <= max(chance, LEAST_DIFFERENCE * (first.error or 0.0))


def _pieces(trial: Trial) -> list[Trial]:
    """A trial cut into pieces, which have no indices of a manoeuvre."""
    edges = np.linspace(0, len(trial), PIECES + 1).astype(int).tolist()
    return [
        Trial(trial.t[a:b], {n: v[a:b] for n, v in trial.channels.items()}, name=f"{trial.name}, part {k}")
        for k, (a, b) in enumerate(pairwise(edges), start=1)
    ]
