"""Several methods on the same trials, ranked by how well they predict trials that they have not seen."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from identification.estimators.methods import METHODS, Method, get_method
from identification.pipeline import identify
from identification.result import IdentificationResult
from identification.simulation_error.refine import Refinement
from identification.validation.cross_validation import cross_validate
from identification.validation.prediction import COMPARED
from shipgym.errors import InputError
from shipgym.json_file import write_json
from shipgym.ships.grey_boxes import GREY_BOX
from shipgym.trials.trial import Trial
from shipgym.whole_file import write_text

#: Compared where none are named; for a grey box also RM-SVM.
USUAL = ("ls", "ridge", "tls-svm", "cv-lssvr", "abc-lssvr", "svr", "tmils", "output-error")
#: Files of a saved comparison: of the models only those of the methods compared.
COMPARISON_FILES = ("comparison.json", "comparison.html", *(f"model-{name}.json" for name in METHODS))


@dataclass(frozen=True)
class Standing:
    """How well a method predicts the trials held out.

    Attributes
    ----------
    method : str
        Its name.
    stable : bool
        Whether its model passed the guard.
    ran_away : int
        Trials held out on which its simulation ran away.
    error : float or None
        Root mean square error of the simulated u, v, r and psi by the standard deviation of what was
        measured, mean over channels and trials: 0 for perfect, 1 for no better than a constant. None where
        one ran away.
    heading_deg, yaw_rate_deg_s : float or None
        Root mean square error, mean over the trials on which it did not run away.
    errors : dict of str to float or None
        `error` of each trial.
    """

    method: str
    stable: bool
    ran_away: int
    error: float | None
    heading_deg: float | None
    yaw_rate_deg_s: float | None
    errors: dict[str, float | None]


@dataclass(frozen=True, eq=False)
class Comparison:
    """Methods on the same trials, ranked.

    Attributes
    ----------
    standings : tuple of Standing
        The best first: those that run away on fewest trials, and among them the smallest error.
    results : dict of str to IdentificationResult
        By method, identified from all trials to fit.
    refused : dict of str to str
        Why a method could not be fitted.
    left_out : dict of str to tuple of str
        Settings that a method does not know and was not given.
    in_turn : bool
        Whether no trial was marked `validate`, so that each trial to fit was held out in turn.
    """

    standings: tuple[Standing, ...]
    results: dict[str, IdentificationResult]
    refused: dict[str, str]
    left_out: dict[str, tuple[str, ...]]
    in_turn: bool

    @property
    def best(self) -> IdentificationResult:
        """What the first of the ranking identified."""
        return self.results[self.standings[0].method]

    def to_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        return {
            "held_out": "each trial in turn" if self.in_turn else "trials marked validate",
            "ranking": [asdict(standing) for standing in self.standings],
            "refused": self.refused,
            "settings_left_out": {name: list(left) for name, left in self.left_out.items()},
            "settings": next(iter(self.results.values())).settings | {"method": list(self.results)},
        }

    def save(self, folder: str | Path) -> None:
        """Write `comparison.json`, `comparison.html` and each method's `model-METHOD.json`.

        Raises
        ------
        InputError
            If plotly is not installed.
        """
        from identification.report.comparison import comparison_page

        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        written = comparison_page(self)
        for name, result in self.results.items():
            result.model.save(folder / f"model-{name}.json")
        write_json(self.to_dict(), folder / "comparison.json")
        write_text(written, folder / "comparison.html")


def compare_methods(
    trials: Sequence[Trial], methods: Sequence[str] | None = None, **arguments: Any
) -> Comparison:
    """Identify by several methods and rank them on trials held out.

    Held out are the trials marked `validate` or named by `hold_out`; where there are none, each trial to fit
    in turn.

    Parameters
    ----------
    trials : sequence of Trial
        As for `identify`.
    methods : sequence of str, optional
        By default `USUAL`, and `rm-svm` for a grey box.
    **arguments
        Of `identify` but for `method`. A method is not given settings that it does not know.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        For an unknown method, a setting that none of the methods knows, no two trials to hold one out of, and
        where no method can be fitted.
    """
    names = list(methods) if methods is not None else _usual(arguments.get("structure"))
    chosen = {name: get_method(name) for name in names}
    if not chosen:
        raise InputError("methods: none found, expected at least one, such as ['ls', 'tls-svm']")
    held = {trial.name for trial in trials if trial.use == "validate"} | _named(arguments)
    fitted = [trial for trial in trials if trial.use == "fit" and trial.name not in held]
    if not held and len(fitted) < 2:
        raise InputError(
            f"trials: {len(fitted)} to fit and none to validate found, expected one held out to rank "
            'the methods on; mark one use = "validate", or give two to fit'
        )
    left_out = _left_out(chosen, arguments)
    results: dict[str, IdentificationResult] = {}
    seen: dict[str, dict[str, Any]] = {}
    refused: dict[str, str] = {}
    for name in chosen:
        own = {key: value for key, value in arguments.items() if key not in left_out.get(name, ())}
        try:
            result = identify(trials, method=name, **own)
            seen[name] = _in_turn(fitted, name, own) if not held else _seen(result)
            results[name] = result
        except InputError as error:
            refused[name] = str(error)
    if not results:
        raise InputError(next(iter(refused.values())))
    standings = [_standing(name, results[name], seen[name], trials) for name in results]
    standings.sort(key=lambda s: (s.ran_away, not s.stable, s.error is None, s.error or 0.0))
    return Comparison(tuple(standings), results, refused, left_out, not held)


def _named(arguments: Mapping[str, Any]) -> set[str]:
    """Trials that `hold_out` names."""
    names = arguments.get("hold_out", ())
    return {names} if isinstance(names, str) else set(names)


def _usual(structure: str | None) -> list[str]:
    return [*USUAL, "rm-svm"] if structure == GREY_BOX else list(USUAL)


def _left_out(chosen: Mapping[str, Method], arguments: Mapping[str, Any]) -> dict[str, tuple[str, ...]]:
    """Settings that each method does not know, which some other one does."""
    own = inspect.signature(identify).parameters
    settings = [name for name in arguments if name not in own]
    of_refinement = {item.name for item in fields(Refinement)}

    def known(method: Method, setting: str) -> bool:
        return method.knows(setting) or (method.refined and setting in of_refinement)

    for setting in settings:
        if not any(known(method, setting) for method in chosen.values()):
            raise InputError(
                f"settings: {setting} found, which none of the methods {', '.join(chosen)} knows"
            )
    left = {name: tuple(s for s in settings if not known(method, s)) for name, method in chosen.items()}
    return {name: unknown for name, unknown in left.items() if unknown}


def _seen(result: IdentificationResult) -> dict[str, Any]:
    """Metrics of the trials that were held out."""
    return {name: m for name, m in result.metrics["trials"].items() if m["use"] == "validate"}


def _in_turn(trials: Sequence[Trial], method: str, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Metrics of each trial, predicted by a model identified from the others."""
    own = {key: value for key, value in arguments.items() if key not in ("hold_out", "uncertainty")}
    return cross_validate(trials, method=method, **own)


def _standing(
    name: str, result: IdentificationResult, seen: Mapping[str, Any], trials: Sequence[Trial]
) -> Standing:
    measured = {trial.name: trial for trial in trials}
    errors = {trial: _error(metrics, measured[trial]) for trial, metrics in seen.items()}
    known = [error for error in errors.values() if error is not None]
    whole = len(known) == len(errors)
    return Standing(
        method=name,
        stable=result.stable,
        ran_away=sum(metrics["diverged"] for metrics in seen.values()),
        error=float(np.mean(known)) if whole else None,
        heading_deg=_mean_degrees(seen, "psi"),
        yaw_rate_deg_s=_mean_degrees(seen, "r"),
        errors=errors,
    )


def _error(metrics: Mapping[str, Any], trial: Trial) -> float | None:
    """Errors of the channels by their standard deviation; None where the simulation ran away."""
    ratios = [
        metrics["rmse"][channel] / float(np.std(trial[channel]))
        for channel in COMPARED
        if metrics["rmse"][channel] is not None and np.std(trial[channel]) > 0.0
    ]
    return float(np.mean(ratios)) if ratios else None


def _mean_degrees(seen: Mapping[str, Any], channel: str) -> float | None:
    found = [m["rmse"][channel] for m in seen.values() if m["rmse"][channel] is not None]
    return float(np.degrees(np.mean(found))) if found else None
