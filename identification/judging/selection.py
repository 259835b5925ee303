"""Which structure and method predict held-out trials best, for `structure = "auto"`."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from identification.arrays import root_mean_square
from identification.judging.extrapolation import holds_turn, largest_rudders
from identification.judging.ranking import RankedFit, fit_name
from identification.judging.rudder_bias import with_bias
from identification.judging.usual_hull import with_usual_hull
from identification.models.refinement import whole_trials
from identification.models.similarity import AUTO
from identification.options import MAP, Options, name_of
from identification.progress import counted
from identification.result import IdentificationResult
from identification.samples.folds import pieces
from identification.samples.prediction import predict, predicts_track
from shipgym import InputError, Particulars, ShipModel, Trial
from shipgym.arrays import Integers
from shipgym.ships.structures import GREY_BOX, MMG
from shipgym.trials.resampling import usual_step

#: Of few coefficients, those with the bias of the rudder last; by the simulated motion
#: of whole trials, in which a small bias shows, too.
RESPONSES = ("nomoto", "norrbin", "nomoto-bias", "norrbin-bias")
TABLES = (
    *RESPONSES,
    "nomoto2",
    "linear-steering",
    "steering7",
    "abkowitz",
    "abkowitz-full",
    "cubic",
    "mmg4dof",
)
STRUCTURES = (*TABLES, GREY_BOX, MMG)
RM_SVM = "rm-svm"
#: Methods that a table that predicts best is also fitted by; quick ones.
OTHERS = ("ls", "cv-lssvr")


class Fitted(Protocol):
    """A structure fitted to trials."""

    @property
    def problem(self) -> Any:
        """The problem that it was fitted to."""

    @property
    def model(self) -> ShipModel:
        """The model of all trials."""

    @property
    def free_coefficients(self) -> int:
        """Number of coefficients that the trials determine."""

    @property
    def stable(self) -> bool:
        """Whether it passed the guard."""

    def without(self, trials: Sequence[int]) -> ShipModel:
        """The model of the other trials, by their places."""

    def result(
        self, options: Options, sea: Mapping[str, Any] | None = None
    ) -> IdentificationResult:
        """The model with uncertainty and predictions."""


#: From trials and options of a structure that is named to its fit.
Fit = Callable[[Sequence[Trial], Options], Fitted]


class Choice(NamedTuple):
    """The structure and method that predict best."""

    options: Options
    fit: Fitted  # of all trials
    report: dict[str, Any]  # the ranking, for the provenance


def select(
    fit: Fit,
    trials: Sequence[Trial],
    options: Options,
    structures: Sequence[str] = STRUCTURES,
) -> Choice:
    """The structure and method that predict the heading of trials held out best.

    Every structure that trials and particulars allow is fitted by its usual method,
    those of few coefficients by output error too, a table that comes first by others,
    and each trial (each third of a single one) predicted by fits without it; those of
    the largest rudder also by fits to the trials of less rudder. The choice is the one
    with the fewest coefficients whose error exceeds the least by no more than one
    standard error of their difference over the trials (a quarter at most), or by 2 %. A
    method other than the default is the only one, and what does not know a setting is
    refused; InputError where nothing can be fitted, with the first reason.
    """
    to_fit = [trial for trial in trials if trial.use == "fit"]
    parts = list(trials)
    held_out = "each trial in turn"
    single = len(to_fit) == 1
    if single:
        parts = [part.with_(kind=None) for part in pieces(to_fit[0])]
        held_out = "each third of the only trial"
    attempts = _Attempts(fit, parts, options)
    attempts.add_all(structures)

    ranked = attempts.by_rank()
    windy = in_wind(parts)
    best = simplest(ranked, windy)
    turns: dict[str, Any] = {"shown_by": "a trial that turns"}
    if not holds_turn(to_fit):
        by_error = best
        best = simplest(shown_to_turn(ranked, options), windy)
        turns = _turns(best, by_error)
    others = [other for other in ranked if other is not best]
    report = {
        "held_out": held_out,
        "ranking": [asdict(one) for one in (best, *others)],
        "refused": attempts.refused,
        "turns": turns,
    }
    own, whole = attempts.fits[fit_name(best.structure, best.method)]
    if single:
        whole = fit(trials, own)
    found = Choice(own, whole, report)
    if options.rudder_bias == "none":
        return found
    biased = f"{best.structure}-bias"
    if biased in structures and options.method_is_default:
        return _response_with_bias(found, biased, fit, trials)
    return _with_bias(found, fit, trials)


def _with_bias(choice: Choice, fit: Fit, trials: Sequence[Trial]) -> Choice:
    """The same table with a constant, where it has none and the bias differs from 0."""
    table = with_bias(choice.fit.model, choice.fit.problem)
    if table is None:
        return choice
    options = replace(choice.options, structure=table)
    other = fit(trials, options)
    return Choice(options, other, choice.report) if other.stable else choice


def shown_to_turn(ranked: Sequence[RankedFit], options: Options) -> list[RankedFit]:
    """The fits that are known to turn where no trial does; all where none is.

    Those of few parameters, and those that a prior, formulas or a reference ship hold
    in a hard turn. The terms of a table that zigzags fix are not known beyond them.
    """
    held = {*RESPONSES, GREY_BOX, MMG}
    if options.prior is not None:
        held.update(TABLES)
    known = []
    for fit in ranked:
        if fit.structure in held and not fit.ran_away:
            known.append(fit)
    return known or list(ranked)


def _turns(taken: RankedFit, by_error: RankedFit) -> dict[str, Any]:
    """What holds a hard turn of the fit that is taken, where no trial turns.

    `by_error`: the fit that would be taken by its error alone.
    """
    shown_by = "nothing"
    if taken.structure in RESPONSES:
        shown_by = "its few parameters"
    elif taken.structure in (GREY_BOX, MMG):
        shown_by = "its prior"
    passed_over = None
    if by_error is not taken:
        passed_over = fit_name(by_error.structure, by_error.method)
    return {"shown_by": shown_by, "predicts_better": passed_over}


def _response_with_bias(
    choice: Choice, structure: str, fit: Fit, trials: Sequence[Trial]
) -> Choice:
    """The same structure with the bias of the rudder, where that differs from 0.

    By the standard error of the bias in the fit to all trials: in what is predicted
    from the start of a short piece it hardly shows.
    """
    options = replace(choice.options, structure=structure, method=whole_trials())
    other = fit(trials, options)
    bias = other.result(options).metrics.get("rudder_bias")
    report = choice.report | {"rudder_bias": bias}
    if bias is None or not bias["significant"] or not other.stable:
        return choice._replace(report=report)
    return Choice(options, other, report)


@dataclass(frozen=True, eq=False)
class _Attempts:
    """Structures and methods that were tried on the same trials."""

    fit: Fit
    trials: Sequence[Trial]
    options: Options
    ranked: list[RankedFit] = field(default_factory=list)
    refused: dict[str, str] = field(default_factory=dict)  # why, by name
    fits: dict[str, tuple[Options, Fitted]] = field(default_factory=dict)  # by name

    def add_all(self, structures: Sequence[str]) -> None:
        """Try structures, each by its usual methods, the best table by others too.

        Raises InputError where none can be fitted.
        """
        free = self.options.method_is_default
        for structure in counted("structures", structures):
            if not free:
                self.add(structure, self.options.method)
                continue
            usual, *_ = methods_of(structure, self.options.method)
            self.add(structure, usual)
            if structure in RESPONSES:
                self.add(structure, whole_trials())
        if not self.ranked:
            first_reason = next(iter(self.refused.values()))
            raise InputError(first_reason)

        best, *_ = self.by_rank()
        if free and best.structure in TABLES and best.structure not in RESPONSES:
            for method in OTHERS:
                self.add(best.structure, method)

    def add(self, structure: str, method: Any) -> None:
        """Try a structure and a method, or remember why it cannot be fitted."""
        reference = reference_of(structure, self.options.reference_model)
        own = replace(
            self.options,
            structure=structure,
            method=method,
            reference_model=reference,
        )
        if structure in (GREY_BOX, MMG) and own.particulars is not None:
            own = replace(own, particulars=_of_usual_hull(own.particulars))
        name = fit_name(structure, MAP if structure == MMG else name_of(method))
        try:
            found = self.fit(self.trials, own)
            self.ranked.append(_ranked(own, found))
        except InputError as error:
            self.refused[name] = str(error)
        else:
            self.fits[name] = own, found

    def by_rank(self) -> list[RankedFit]:
        """The fits, the best first."""
        return sorted(self.ranked, key=lambda fit: fit.rank)


def _of_usual_hull(given: Particulars | Mapping[str, Any]) -> Particulars:
    """Particulars by which a reference ship or formulas are found."""
    if not isinstance(given, Particulars):
        given = Particulars.from_mapping(given)
    return with_usual_hull(given)


class HeldOut(NamedTuple):
    """Errors of the prediction of a trial held out."""

    #: of the heading, by its standard deviation; without one, of the yaw rate; in wind
    #: that of `_turning_error`
    relative: float
    heading: float  # root mean square, rad
    yaw_rate: float  # rad/s
    speed: float  # of the surge speed, by its standard deviation


def _ranked(options: Options, fit: Fitted) -> RankedFit:
    """Rank of a fit, by what it predicts of trials held out."""
    trials = fit.problem.used
    seen: dict[str, list[HeldOut | None]] = {trial.name: [] for trial in trials}
    for group in _groups(trials):
        model = fit.without(group.tolist())
        for place in group:
            trial = trials[place]
            seen[trial.name].append(_held_out(model, trial))

    every = [error for errors in seen.values() for error in errors]
    ran_away = [error for error in every if error is None]
    known = [error for error in every if error is not None]
    errors = {name: _mean_error(found) for name, found in seen.items()}
    mean_error = None
    heading = None
    yaw_rate = None
    if known:
        heading = float(np.degrees(np.mean([error.heading for error in known])))
        yaw_rate = float(np.degrees(np.mean([error.yaw_rate for error in known])))
    if known and not ran_away:
        mean_error = float(np.mean(list(errors.values())))
    method = MAP if options.structure == MMG else name_of(options.method)
    return RankedFit(
        structure=name_of(options.structure),
        method=method,
        coefficients=fit.free_coefficients,
        stable=fit.stable,
        ran_away=len(ran_away),
        error=mean_error,
        heading_deg=heading,
        yaw_rate_deg_s=yaw_rate,
        errors=errors,
        predicts_speed=_predicts_speed(fit.model, known),
    )


def _predicts_speed(model: ShipModel, known: Sequence[HeldOut]) -> bool:
    """Whether the speed in trials held out is better predicted than by a constant."""
    if not known or not predicts_track(model):
        return False
    most = np.sqrt(0.5)
    return bool(np.mean([error.speed for error in known]) < most)


def _groups(trials: Sequence[Trial]) -> list[Integers]:
    """Places of the trials that are held out together: each, and the largest rudders.

    These are what a hard turn is to trials of less rudder.
    """
    groups = [np.array([place]) for place in range(len(trials))]
    largest = largest_rudders(trials)
    if largest.size:
        groups.append(largest)
    return groups


def _held_out(model: ShipModel, trial: Trial) -> HeldOut | None:
    """Errors of the prediction of a trial; None where the model runs away."""
    run = predict(model, trial)
    if run is None:
        return None
    errors = {}
    relative = {}
    for name in ("psi", "r", "u"):
        if name in trial:
            errors[name] = root_mean_square(run[name] - trial[name])
            relative[name] = errors[name] / max(float(np.std(trial[name])), 1e-12)
    error = next(iter(relative.values()))
    if "psi" in trial and in_wind([trial]):
        error = _turning_error(model, run, trial)
    return HeldOut(
        relative=error,
        heading=errors.get("psi", np.nan),
        yaw_rate=errors["r"],
        speed=relative.get("u", np.inf),
    )


def in_wind(trials: Sequence[Trial]) -> bool:
    """Return True where wind was logged and its force is known."""
    return any("wind_rdot" in trial for trial in trials)


def _turning_error(model: ShipModel, run: Trial, trial: Trial) -> float:
    """Error of a prediction in how far the ship turns in one ship length, relative.

    Root mean squares. What is left of the moment of the wind makes the heading of a
    gentle zigzag drift, and hardly matters in a turn.
    """
    steps = model.travel_time / usual_step(trial.t)
    lag = min(max(round(steps), 1), len(trial) - 1)
    heading = trial["psi"]
    turned = heading[lag:] - heading[:-lag]
    error = run["psi"] - heading
    change = error[lag:] - error[:-lag]
    return root_mean_square(change) / max(root_mean_square(turned), 1e-12)


def _mean_error(found: Sequence[HeldOut | None]) -> float | None:
    """Mean relative error of a trial; None where a model ran away on it."""
    known = [error.relative for error in found if error is not None]
    if len(known) < len(found):
        return None
    return float(np.mean(known))


def methods_of(structure: str, usual: str) -> tuple[str, ...]:
    """Methods that a structure is fitted by where none are named, the usual first."""
    if structure == GREY_BOX:
        return (RM_SVM,)
    if structure == MMG:
        return (usual,)
    return (usual, *OTHERS)


def reference_of(structure: str, named: Any) -> Any:
    """The reference ship of a structure that knows one, as named; None for others."""
    if structure == GREY_BOX:
        return named or AUTO
    if structure == MMG:
        return named
    return None


def simplest(ranked: Sequence[RankedFit], in_wind: bool = False) -> RankedFit:
    """The fit of fewest coefficients whose errors differ from the first's by chance.

    Of those with no larger error than it has, one that predicts the speed, too. In wind
    no other is taken while there is one: the speed changes with the course, and with it
    how the ship turns.
    """
    if in_wind:
        with_speed = [fit for fit in ranked if fit.predicts_speed]
        ranked = with_speed or ranked
    first = ranked[0]
    if first.error is None:
        return first
    as_good = []
    for fit in ranked:
        sails = fit.stable and not fit.ran_away
        if sails and _differs_by_chance(fit, first):
            as_good.append(fit)
    if not as_good:
        return first

    fewest = min(as_good, key=_coefficients)
    most = fewest.error or 0.0
    with_speed = []
    for fit in as_good:
        if fit.predicts_speed and (fit.error or 0.0) <= most:
            with_speed.append(fit)
    return min(with_speed, key=_coefficients, default=fewest)


def _coefficients(fit: RankedFit) -> tuple[int, bool]:
    """Number of coefficients, of methods of one structure the usual first."""
    return fit.coefficients, fit.method in OTHERS


def _differs_by_chance(fit: RankedFit, first: RankedFit) -> bool:
    """Tell whether errors exceed the first's by no more than chance.

    By one standard error of the difference, but no more than a quarter of the first's:
    of few trials a single one that goes wrong makes that error large. 2 % are nothing.
    """
    differences = []
    for name, error in first.errors.items():
        own = fit.errors[name] or 0.0
        difference = own - (error or 0.0)
        differences.append(difference)
    n_trials = len(differences)
    excess = np.mean(differences)
    deviation = float(np.std(differences, ddof=1))
    standard_error = deviation / np.sqrt(n_trials)
    least = first.error or 0.0
    by_chance = min(standard_error, 0.25 * least)
    nothing = 0.02 * least
    return bool(excess <= max(by_chance, nothing))
