"""Structures and methods on the same trials, ranked by what they predict of trials not seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from identification.estimators.methods import METHODS, Method, get_method
from identification.options import name_of
from identification.pipeline import identify
from identification.regression.problem import held_out
from identification.report.comparison import comparison_page
from identification.result import IdentificationResult
from identification.simulation_error.refine import Refinement
from identification.validation.cross_validation import cross_validate
from identification.validation.ranking import Ranking, Standing, named, standing
from identification.validation.selection import RM_SVM, STRUCTURES, methods_of, reference_of
from shipgym.errors import InputError
from shipgym.files import write_json, write_text
from shipgym.ships import Structure, list_structures
from shipgym.ships.grey_boxes import GREY_BOX
from shipgym.ships.mmg import MMG
from shipgym.trials.identify_table import AUTO, OPTIONS, Options
from shipgym.trials.trial import Trial

#: Compared where none are named; for a grey box also RM-SVM.
USUAL = ("ls", "ridge", "tls-svm", "cv-lssvr", "abc-lssvr", "svr", "tmils", "output-error")
#: Files of a saved comparison: of the models only those of the methods, or of the structures, compared.
COMPARISON_FILES = (
    "comparison.json", "comparison.html", *(f"model-{name}.json" for name in (*METHODS, *list_structures()))
)  # fmt: skip


class Comparison(Ranking):
    """Structures and methods on the same trials, ranked; `Ranking` lists its attributes."""

    def save(self, folder: str | Path) -> None:
        """Write `comparison.json`, `comparison.html` and models.

        These are each method's `model-METHOD.json`, of several structures the best one's of each,
        `model-STRUCTURE.json`.

        Raises
        ------
        InputError
            If plotly is not installed.
        """
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        written = comparison_page(self)
        names = {name: name for name in self.results}
        if self.names[0] != self.standings[0].method:
            pairs = zip(self.standings, self.names, strict=True)
            names = {one.structure: name for one, name in reversed(list(pairs))}
        for name, result in names.items():
            self.results[result].model.save(folder / f"model-{name}.json")
        write_json(self.to_dict(), folder / "comparison.json")
        write_text(written, folder / "comparison.html")


def compare_methods(
    trials: Sequence[Trial],
    methods: Sequence[Any] | None = None,
    structures: Sequence[str | Structure] | None = None,
    **arguments: Any,
) -> Comparison:
    """Identify by several methods, or structures and methods, and rank them on trials held out.

    These are marked `validate` or named by `hold_out`; where there are none, each trial to fit in turn.

    Parameters
    ----------
    trials : sequence of Trial
        As for `identify`.
    methods : sequence of str or estimator, optional
        By default `USUAL`, and `rm-svm` for a grey box; of several structures those of "auto".
    structures : sequence of str or Structure, optional
        As for `identify`; `auto` for all that it tries. A `reference_model` goes to those that know one.
    **arguments
        Of `identify` but for `method`. A method is not given settings that it does not have.

    Raises
    ------
    InputError
        For an unknown method or setting, no two trials to hold one out of, and where nothing can be fitted.
    """
    if structures is not None:
        return _compare_structures(trials, methods, structures, arguments)
    if methods is None:
        methods = USUAL if arguments.get("structure") != GREY_BOX else (*USUAL, RM_SVM)
    given = {get_method(method).name: method for method in methods}
    if not given:
        raise InputError("methods: none found, expected at least one, such as ['ls', 'tls-svm']")
    marked = held_out(trials, arguments.get("hold_out", ()))
    fitted, held = ([trial for trial in marked if trial.use == use] for use in ("fit", "validate"))
    if not held and len(fitted) < 2:
        raise InputError(
            f"trials: {len(fitted)} to fit and none to validate found, expected one held out to rank "
            'the methods on; mark one use = "validate", or give two to fit'
        )
    left_out = _left_out(list(map(get_method, methods)), arguments)
    results: dict[str, IdentificationResult] = {}
    standings: list[Standing] = []
    refused: dict[str, str] = {}
    for name, method in given.items():
        own = {key: value for key, value in arguments.items() if key not in left_out.get(name, ())}
        try:
            result = identify(trials, method=method, **own)
            seen = {t.name: result.metrics["trials"][t.name] for t in held}
            if not held:
                own.pop("hold_out", None)
                seen = cross_validate(fitted, method=method, **{**own, "uncertainty": "analytic"})
        except InputError as error:
            refused[name] = str(error)
            continue
        standings.append(standing([result], seen, trials))
        results[standings[-1].method] = result
    if not results:
        raise InputError(next(iter(refused.values())))
    ranked = tuple(sorted(standings, key=lambda one: one.rank))
    return Comparison(ranked, results, refused, left_out, not held)


def _compare_structures(
    trials: Sequence[Trial],
    methods: Sequence[Any] | None,
    structures: Sequence[Any],
    given: Mapping[str, Any],
) -> Comparison:
    """The methods on each structure, in one ranking."""
    found: dict[str, Comparison] = {}
    refused: dict[str, str] = {}
    for structure in STRUCTURES if AUTO in structures else structures:
        name, reference = name_of(structure), reference_of(structure, given.get("reference_model"))
        wanted = methods_of(structure, Options.method) if methods is None else methods
        own = dict(given, structure=structure, reference_model=reference)
        try:
            found[name] = compare_methods(trials, wanted[:1] if structure == MMG else wanted, **own)
            refused |= {named(name, method): why for method, why in found[name].refused.items()}
        except InputError as error:
            refused[name] = str(error)
    if not found:
        raise InputError(next(iter(refused.values()), "structures: none found, expected at least one"))
    return Comparison(
        tuple(sorted((s for one in found.values() for s in one.standings), key=lambda one: one.rank)),
        {named(s, m): result for s, one in found.items() for m, result in one.results.items()},
        refused,
        {named(s, m): left for s, one in found.items() for m, left in one.left_out.items()},
        next(iter(found.values())).in_turn,
    )


def _left_out(chosen: Sequence[Method], arguments: Mapping[str, Any]) -> dict[str, tuple[str, ...]]:
    """Settings that each method does not have but another one does."""
    settings = [name for name in arguments if name in OPTIONS and OPTIONS[name].setting]
    of_refinement = {item.name for item in fields(Refinement)}

    def known(method: Method, setting: str) -> bool:
        return method.knows(setting) or (method.refined and setting in of_refinement)

    for setting in settings:
        if not any(known(method, setting) for method in chosen):
            names = ", ".join(method.name for method in chosen)
            raise InputError(f"settings: {setting} found, which none of the methods {names} knows")
    left = {method.name: tuple(s for s in settings if not known(method, s)) for method in chosen}
    return {name: unknown for name, unknown in left.items() if unknown}
