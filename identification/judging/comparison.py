"""Structures and methods on the same trials, ranked by what they predict."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from identification.judging.ranking import (
    RankedFit,
    Ranking,
    fit_name,
    in_turn,
    ranked_fit,
)
from identification.judging.selection import (
    RM_SVM,
    STRUCTURES,
    methods_of,
    reference_of,
)
from identification.judging.uncertainty import Uncertainty
from identification.models.methods import (
    METHODS,
    get_method,
    make_method,
    method_options,
)
from identification.options import AUTO, DEFAULT_METHOD, Options, name_of
from identification.pipeline import identify
from identification.progress import counted
from identification.report.comparison import comparison_page
from identification.result import IdentificationResult
from identification.samples.problem import held_out
from shipgym import InputError, ShipModel, Trial, list_structures
from shipgym.checks import check_number
from shipgym.files import write_json, write_text
from shipgym.ships import Structure
from shipgym.ships.structures import GREY_BOX, MMG

#: Compared where none are named; for a grey box also RM-SVM.
USUAL = (
    "ls",
    "ridge",
    "tls-svm",
    "cv-lssvr",
    "abc-lssvr",
    "svr",
    "tmils",
    "output-error",
)
#: Files of a saved comparison: of the models only those of the methods, or of the
#: structures, compared.
COMPARISON_FILES = (
    "comparison.json",
    "comparison.html",
    *(f"model-{name}.json" for name in (*METHODS, *list_structures())),
)


class Comparison(Ranking):
    """Structures and methods, ranked; `Ranking` lists its attributes."""

    def save(self, folder: str | Path) -> None:
        """Write `comparison.json`, `comparison.html` and models.

        Of one structure the model of each method, `model-METHOD.json`; of several the
        best model of each, `model-STRUCTURE.json`. Raises InputError if plotly is not
        installed.
        """
        page = comparison_page(self)
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        for name, model in self._models().items():
            path = folder / f"model-{name}.json"
            model.save(path)
        write_json(self.to_dict(), folder / "comparison.json")
        write_text(page, folder / "comparison.html")

    def _models(self) -> dict[str, ShipModel]:
        """Models to save: of each method, or the best of each structure."""
        one_structure = self.ranked[0].method in self.results
        results = self.results.values()
        models = dict[str, ShipModel]()
        for fit, result in zip(self.ranked, results, strict=True):
            name = fit.structure
            if one_structure:
                name = fit.method
            models.setdefault(name, result.model)
        return models


def compare_methods(
    trials: Sequence[Trial],
    methods: Sequence[Any] | None = None,
    structures: Sequence[str | Structure] | None = None,
    settings: Mapping[str, Any] | None = None,
    **arguments: Any,
) -> Comparison:
    """Identify by several methods, or structures too, and rank them on held-out trials.

    These are marked `validate` or named by `hold_out`; where there are none, each trial
    to fit in turn.

    Raises InputError for an unknown method or setting, no two trials to hold one out
    of, and where nothing can be fitted.

    Parameters
    ----------
    trials : sequence of Trial
        As for `identify`.
    methods : sequence of str or estimator, optional
        By default `USUAL`, and `rm-svm` for a grey box; of several structures those of
        "auto".
    structures : sequence of str or Structure, optional
        As for `identify`; `auto` for all that it tries. A `reference_model` goes to
        those that know one.
    settings : mapping, optional
        Settings by name for the methods given by name. A method is not given settings
        that it does not have.
    **arguments
        Of `identify` but for `method`.
    """
    arguments = {"rudder_bias": "none", **arguments}  # structures as they are named
    pairs, several = _asked(structures, methods, arguments)
    fitted, held = _by_use(held_out(trials, arguments.get("hold_out", ())))
    settings = settings or {}
    left_out = _left_out([method for _, method in pairs], settings)

    compared = _Compared(trials, fitted, held, arguments)
    for structure, method in counted("structures and methods", pairs):
        name = get_method(method).name
        own = _with_settings(method, settings, left_out.get(name, ()))
        if several:
            compared.add_structure(structure, own, name)
        else:
            compared.add(structure, own, name, arguments)

    ranked, results = compared.ranked(several)
    refused = compared.refused
    return Comparison(ranked, results, refused, left_out, in_turn=not held)


@dataclass(frozen=True, eq=False)
class _Compared:
    """Fits to the same trials."""

    trials: Sequence[Trial]
    fitted: list[Trial]
    held: list[Trial]
    arguments: Mapping[str, Any]  # of `identify` but for structure and method
    found: list[tuple[RankedFit, IdentificationResult]] = field(default_factory=list)
    refused: dict[str, str] = field(default_factory=dict)  # why, by name

    def add_structure(self, structure: Any, method: Any, name: str) -> None:
        """Fit one of several structures, with its own reference ship."""
        reference = self.arguments.get("reference_model")
        own = {"reference_model": reference_of(structure, reference)}
        name = fit_name(name_of(structure), name)
        self.add(structure, method, name, {**self.arguments, **own})

    def add(
        self,
        structure: Any,
        method: Any,
        name: str,
        arguments: Mapping[str, Any],
    ) -> None:
        """Fit a structure by a method, or remember why it cannot be fitted."""
        try:
            result = identify(self.trials, structure, method, **arguments)
            if self.held:
                metrics = result.metrics["trials"]
                seen = {trial.name: metrics[trial.name] for trial in self.held}
            else:
                seen = _each_in_turn(self.fitted, structure, method, arguments)
        except InputError as error:
            self.refused[name] = str(error)
            return
        fit = ranked_fit([result], seen, self.trials)
        self.found.append((fit, result))

    def ranked(
        self, several: bool
    ) -> tuple[tuple[RankedFit, ...], dict[str, IdentificationResult]]:
        """Fits, the best first, and their results by method, or structure and method.

        Raises InputError with the first reason where nothing could be fitted.
        """
        if not self.found:
            first_reason = next(iter(self.refused.values()))
            raise InputError(first_reason)

        best_first = sorted(self.found, key=lambda entry: entry[0].rank)
        results = dict[str, IdentificationResult]()
        for fit, result in best_first:
            name = fit.method
            if several:
                name = fit_name(fit.structure, fit.method)
            results[name] = result
        ranked = tuple(fit for fit, _ in best_first)
        return ranked, results


def _with_settings(
    method: Any, settings: Mapping[str, Any], left_out: Sequence[str]
) -> Any:
    """A method given by name with those of the settings that it has."""
    known = {name: settings[name] for name in settings if name not in left_out}
    if isinstance(method, str) and method in METHODS:
        return make_method(method, known)  # an object: no default that may change
    return method


def _by_use(trials: Sequence[Trial]) -> tuple[list[Trial], list[Trial]]:
    """Trials to fit and trials held out; InputError where none can be held out."""
    fitted = [trial for trial in trials if trial.use == "fit"]
    held = [trial for trial in trials if trial.use == "validate"]
    n_fitted = len(fitted)
    if not held and n_fitted < 2:
        raise InputError(
            "trials: expected a held-out trial to rank the methods on, got"
            f" {n_fitted} to fit and none to validate; mark one use ="
            ' "validate", or give two to fit'
        )
    return fitted, held


def _each_in_turn(
    trials: Sequence[Trial],
    structure: Any,
    method: Any,
    arguments: Mapping[str, Any],
) -> dict[str, Any]:
    """Metrics of each trial, predicted by a fit of the others."""
    own = {
        "structure": structure,
        "method": method,
        "uncertainty": Uncertainty(model_error=False),
    }
    others = {name: value for name, value in arguments.items() if name != "hold_out"}
    return cross_validate(trials, **{**others, **own})


def cross_validate(
    trials: Sequence[Trial], folds: int | None = None, **arguments: Any
) -> dict[str, Any]:
    """Predict each trial by a model identified from others.

    Returns, for each trial by its name, the metrics (`IdentificationResult.metrics`) of
    its prediction. Raises InputError for fewer than 2 trials or more folds than trials.

    Parameters
    ----------
    trials : sequence of Trial
        Those with `use` "fit" take part.
    folds : int, optional
        Groups of trials that are held out together, in their order; by default each by
        itself.
    **arguments
        Of `identify`.
    """
    used = [trial for trial in trials if trial.use == "fit"]
    if len(used) < 2:
        raise InputError(
            f"trials: expected at least 2 to fit, to hold one out, got {len(used)}"
        )
    groups = check_number(
        len(used) if folds is None else folds,
        "folds",
        at_least=2,
        at_most=len(used),
        hint="at most one per trial",
    )
    settings = {"uncertainty": Uncertainty(model_error=False), **arguments}

    def without(held: list[str]) -> IdentificationResult:
        return identify(used, hold_out=held, **settings)

    metrics, _ = in_turn(without, used, int(groups))
    return metrics


def _asked(
    structures: Sequence[str | Structure] | None,
    methods: Sequence[Any] | None,
    arguments: dict[str, Any],
) -> tuple[list[tuple[Any, Any]], bool]:
    """Structures and methods to fit, and whether there are several structures.

    Takes the structure out of the arguments of `identify`.
    """
    if structures is None:
        wanted = [arguments.pop("structure", Options.structure)]
    else:
        wanted = list(structures)
    several = structures is not None or AUTO in wanted
    if AUTO in wanted:
        wanted = list(STRUCTURES)

    pairs = fit_pairs(wanted, methods, several)
    if not pairs:
        raise InputError(
            "methods: expected at least one, such as ['ls', 'tls-svm'], got none"
        )
    return pairs, several


def fit_pairs(
    structures: Sequence[Any], methods: Sequence[Any] | None, several: bool
) -> list[tuple[Any, Any]]:
    """Structures, each with the methods that it is fitted by.

    These are the `methods` given; of several structures the MMG form takes the first.
    """
    by_name = {name_of(structure): structure for structure in structures}
    pairs: list[tuple[Any, Any]] = []
    for structure in by_name.values():
        own = methods
        if own is None:
            own = _usual_methods(structure, several)
        elif several and structure == MMG:
            own = own[:1]
        named = {get_method(method).name: method for method in own}
        for method in named.values():
            pairs.append((structure, method))
    return pairs


def _usual_methods(structure: Any, several: bool) -> tuple[str, ...]:
    """Methods where none are named."""
    if several:
        return methods_of(structure, DEFAULT_METHOD)
    return (*USUAL, RM_SVM) if structure == GREY_BOX else USUAL


def _left_out(
    chosen: Sequence[Any], settings: Mapping[str, Any]
) -> dict[str, tuple[str, ...]]:
    """Settings that each method by name does not have but another one does."""
    left = dict[str, tuple[str, ...]]()
    for method in chosen:
        if isinstance(method, str):
            own = method_options(method)
            left[method] = tuple(name for name in settings if name not in own)

    for setting in settings:
        if all(setting in unknown for unknown in left.values()):
            names = ", ".join(left)
            raise InputError(
                f"{setting}: expected a setting of one of the methods"
                f" {names}, got one that none of them knows"
            )
    return {name: unknown for name, unknown in left.items() if unknown}
