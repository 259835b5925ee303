"""Structures and methods on the same trials, ranked by what they predict of trials not seen."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from identification.estimators.methods import (
    METHODS,
    get_method,
    make_method,
    method_options,
)
from identification.options import AUTO, DEFAULT_METHOD, Options, name_of
from identification.pipeline import identify
from identification.progress import counted
from identification.regression.problem import held_out
from identification.report.comparison import comparison_page
from identification.result import IdentificationResult
from identification.uncertainty.uncertainty import Uncertainty
from identification.validation.ranking import (
    Ranking,
    Standing,
    in_turn,
    named,
    standing,
)
from identification.validation.selection import (
    RM_SVM,
    STRUCTURES,
    methods_of,
    reference_of,
)
from shipgym import InputError, Trial, list_structures
from shipgym.checks import check_number
from shipgym.files import write_json, write_text
from shipgym.ships import Structure
from shipgym.ships.grey_boxes import GREY_BOX
from shipgym.ships.mmg import MMG

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
    """Structures and methods on the same trials, ranked; `Ranking` lists its attributes."""

    def save(self, folder: str | Path) -> None:
        """Write `comparison.json`, `comparison.html` and each method's `model-METHOD.json`.

        Of several structures these are the best model of each, `model-STRUCTURE.json`.
        Raises InputError if plotly is not installed.
        """
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        written = comparison_page(self)
        several = self.standings[0].method not in self.results
        for one, name in reversed(list(zip(self.standings, self.results, strict=True))):
            self.results[name].model.save(
                folder / f"model-{one.structure if several else name}.json"
            )
        write_json(self.to_dict(), folder / "comparison.json")
        write_text(written, folder / "comparison.html")


def compare_methods(
    trials: Sequence[Trial],
    methods: Sequence[Any] | None = None,
    structures: Sequence[str | Structure] | None = None,
    settings: Mapping[str, Any] | None = None,
    **arguments: Any,
) -> Comparison:
    """Identify by several methods, or structures and methods, and rank them on held-out trials.

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
    wanted = (
        [arguments.pop("structure", Options.structure)]
        if structures is None
        else [*structures]
    )
    several = structures is not None or AUTO in wanted
    if not (
        pairs := _pairs(STRUCTURES if AUTO in wanted else wanted, methods, several)
    ):
        raise InputError(
            "methods: none found, expected at least one, such as ['ls', 'tls-svm']"
        )
    marked = held_out(trials, arguments.get("hold_out", ()))
    fitted, held = (
        [trial for trial in marked if trial.use == use] for use in ("fit", "validate")
    )
    if not held and len(fitted) < 2:
        told = (
            f"trials: {len(fitted)} to fit and none to validate found, expected a"
            " held-out trial to rank"
        )
        raise InputError(
            f'{told} the methods on; mark one use = "validate", or give two to fit'
        )
    left_out = _left_out([method for _, method in pairs], settings or {})
    found, refused = list[tuple[Standing, IdentificationResult]](), dict[str, str]()
    for structure, method in counted("structures and methods", pairs):
        name = get_method(method).name
        own = dict(arguments)
        if isinstance(method, str):
            known = {
                key: value
                for key, value in (settings or {}).items()
                if key not in left_out.get(name, ())
            }
            method = make_method(method, known) if known else method
        if several:
            own["reference_model"] = reference_of(structure, own.get("reference_model"))
        try:
            result = identify(trials, structure, method, **own)
            seen = {t.name: result.metrics["trials"][t.name] for t in held}
            if not held:
                own |= {
                    "structure": structure,
                    "method": method,
                    "uncertainty": Uncertainty(model_error=False),
                }
                seen = cross_validate(
                    fitted, **{k: v for k, v in own.items() if k != "hold_out"}
                )
        except InputError as error:
            refused[named(name_of(structure), name) if several else name] = str(error)
            continue
        found.append((standing([result], seen, trials), result))
    if not found:
        raise InputError(next(iter(refused.values())))
    found.sort(key=lambda pair: pair[0].rank)
    results = {
        named(one.structure, one.method) if several else one.method: result
        for one, result in found
    }
    return Comparison(
        tuple(one for one, _ in found), results, refused, left_out, not held
    )


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
            f"trials: {len(used)} to fit found, expected at least 2 to hold one out"
        )
    groups = len(used) if folds is None else folds
    groups = int(
        check_number(
            groups, "folds", at_least=2, at_most=len(used), hint="at most one per trial"
        )
    )
    own = {"uncertainty": Uncertainty(model_error=False), **arguments}
    return in_turn(lambda held: identify(used, hold_out=held, **own), used, groups)[0]


def _pairs(
    structures: Sequence[Any], methods: Sequence[Any] | None, several: bool
) -> list[tuple[Any, Any]]:
    """Structures, each with the methods that it is fitted by: those given, of the MMG form the first."""
    pairs: list[tuple[Any, Any]] = []
    for structure in {name_of(one): one for one in structures}.values():
        own = methods
        if own is None:
            usual = (*USUAL, RM_SVM) if structure == GREY_BOX else USUAL
            own = methods_of(structure, DEFAULT_METHOD) if several else usual
        elif several and structure == MMG:
            own = own[:1]
        pairs += [
            (structure, one)
            for one in {get_method(one).name: one for one in own}.values()
        ]
    return pairs


def _left_out(
    chosen: Sequence[Any], settings: Mapping[str, Any]
) -> dict[str, tuple[str, ...]]:
    """Settings that each method by name does not have but another one does."""
    left = {
        method: tuple(one for one in settings if one not in method_options(method))
        for method in chosen
        if isinstance(method, str)
    }
    for setting in settings:
        if all(setting in unknown for unknown in left.values()):
            raise InputError(
                f"{setting}: expected a setting of one of the methods"
                f" {', '.join(left)}, got one that none of them knows"
            )
    return {name: unknown for name, unknown in left.items() if unknown}
