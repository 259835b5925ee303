"""The options of `identify`, checked together, and how they are told in a model and in settings.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, is_dataclass
from typing import Any

import numpy as np

import shipgym
from identification.validation.folds import TRIALS
from shipgym.checks import check_choice
from shipgym.errors import InputError
from shipgym.ships import ShipModel
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from shipgym.trials.trial import Trial

UNCERTAINTIES = ("analytic", "bootstrap")
#: Those that `problem.pose` takes.
POSED = (
    "service_shaft_speed", "name", "window", "smooth", "preprocessing", "repair", "hold_out",
    "reference_model",
)  # fmt: skip


@dataclass(frozen=True)
class Options:
    """Options of `identify` that are not settings of the machine.

    Attributes
    ----------
    structure : str
        Terms of the model: a name of `shipgym.list_structures`.
    method : str
        A name of `identification.estimators.methods.METHODS`.
    samples : {"spline", "integral", "euler"}
        How the samples become a regression.
    service_shaft_speed : float, optional
        Shaft speed at service speed, 1/s, for structures that know it; by default that at the start of the
        trials.
    name : str, optional
        Of the model; by default the ship's.
    window : int, optional
        Sampling steps over which the velocities are integrated; see `samples.build_samples`.
    smooth : bool
        Whether noisy channels are smoothed first.
    preprocessing : {"spline", "savgol", "median", "rts", "none"}, optional
        How they are smoothed (`preprocess.smoothed_channels`); by default by splines.
    repair : bool
        Whether outliers are replaced and short dropouts filled first (`preprocess.repaired`).
    hold_out : sequence of str
        Names of trials that are predicted only, as if they were marked `validate`.
    reference_model : str or ShipModel, optional
        Of the structure "grey-box": a model, its name or file, or "auto" for the reference ship most like
        this one (`similarity.select_reference`).
    guarded : bool
        Whether a model that runs away (`guard.reasons_unstable`) is fitted again with a penalty on what
        is large in a hard turn and invisible in the data. The provenance tells what was done.
    uncertainty : {"analytic", "bootstrap"}
        Where the covariance comes from: the formula for errors correlated over the time to sail one ship
        length, or refits to blocks of that time drawn with replacement (`bootstrap`).
    prior : str or ShipModel, optional
        What the coefficients are pulled to: a reference ship's ("auto" for the most similar, or a model, its
        name or file), or the regression formulas "clarke" or "kijima". See `prior`.
    prior_strength : float, optional
        0 for none, infinite for the prior itself; by default chosen by cross-validation.
    prior_folds : {"trials", "largest-rudder"}
        What that holds out: each trial in turn, or those of the largest rudder.

    Raises
    ------
    InputError
        For an unknown uncertainty, and for settings of a prior without one.
    """

    structure: str = "abkowitz"
    method: str = "tls-svm"
    samples: str = "spline"
    service_shaft_speed: float | None = None
    name: str | None = None
    window: int | None = None
    smooth: bool = True
    preprocessing: str | None = None
    repair: bool = False
    hold_out: Sequence[str] = ()
    reference_model: str | ShipModel | None = None
    guarded: bool = True
    uncertainty: str = "analytic"
    prior: str | ShipModel | None = None
    prior_strength: float | None = None
    prior_folds: str = TRIALS

    def __post_init__(self) -> None:
        check_choice(self.uncertainty, UNCERTAINTIES, "uncertainty")
        if self.prior is None and self.prior_strength is not None:
            raise InputError(
                f"prior_strength: {self.prior_strength} found without a prior; name one, or leave it out"
            )
        if self.prior is None and self.prior_folds != TRIALS:
            raise InputError(
                f"prior_folds: {self.prior_folds!r} found without a prior; name one, or leave it out"
            )

    def posed(self) -> dict[str, Any]:
        """Arguments of `problem.pose` beside trials, structure, samples, particulars and steering."""
        return {name: getattr(self, name) for name in POSED}

    def asked(self, of_machine: Mapping[str, Any]) -> dict[str, Any]:
        """Settings for the provenance: those of the samples and of the machine."""
        found = {"window": self.window, "smooth": self.smooth, "guarded": self.guarded, **of_machine}
        if self.preprocessing is not None:
            found["preprocessing"] = self.preprocessing
        return {key: _plain(value) for key, value in found.items()}

    def call(
        self,
        settings: Mapping[str, Any],
        trials: Sequence[Trial],
        particulars: Particulars | Mapping[str, Any] | None,
        steering: SteeringGear | None,
    ) -> dict[str, Any]:
        """The whole call for settings.json, trials by name, use and hash."""
        own = {item.name: getattr(self, item.name) for item in fields(self)}
        arguments = {**own, **settings, "particulars": particulars, "steering": steering}
        known = [{"name": trial.name, "use": trial.use, "sha256": trial.raw.sha256} for trial in trials]
        return {
            "software": f"shipgym {shipgym.__version__}",
            **{key: _plain(value) for key, value in arguments.items()},
            "trials": known,
        }


def _plain(value: Any) -> Any:
    """A setting as JSON knows it: infinity as null, models and trials by their names."""
    if isinstance(value, ShipModel | Trial):
        return value.name
    if isinstance(value, Particulars | SteeringGear):
        return value.to_dict()
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        return {"kind": type(value).__name__, **{k: _plain(v) for k, v in asdict(value).items()}}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple | set | frozenset):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
