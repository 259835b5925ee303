"""The options of `identify`, and how provenance and settings.json record them."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, fields, is_dataclass
from typing import Any

import numpy as np

import shipgym
from identification.estimators.kernel_residual import KernelResidual
from identification.estimators.linear import LinearRegressor
from identification.judging.uncertainty import Uncertainty
from identification.models.methods import METHODS, make_method, method_options
from identification.models.prior_knowledge import PriorKnowledge
from identification.models.refinement import Refinement
from identification.samples.preprocess import Preprocessing
from identification.samples.samples import Sampling
from identification.samples.still_water import check_current, check_wind
from shipgym import InputError, Particulars, ShipModel, SteeringGear, Trial
from shipgym.checks import (
    check_choice,
    check_flag,
    check_number,
    check_table,
    check_text,
    did_you_mean,
)
from shipgym.ships import Structure
from shipgym.ships.structures import GREY_BOX, MMG

Given = Particulars | Mapping[str, Any] | None  # particulars, as `identify` takes them
DEFAULT_METHOD = "tls-svm"
MAP = "map"  # the method of the MMG form: maximum a posteriori
AUTO = "auto"  # the structure that is chosen by trials held out

#: Stages of an identification that are one object each.
STAGES: dict[str, type] = {
    "samples": Sampling,
    "preprocessing": Preprocessing,
    "kernel": KernelResidual,
    "prior": PriorKnowledge,
    "uncertainty": Uncertainty,
}


@dataclass(frozen=True, eq=False)
class Options:
    """The arguments of `identify` but for the trials.

    A stage is an object, such as `samples=Sampling(window=3)`, or the word of a default
    one, such as "spline".

    Parameters
    ----------
    structure : str, Structure or None
        Terms of the model: a name of `shipgym.list_structures`, a table, or "auto": the
        structure and method that predict held-out trials best. None is "abkowitz", with
        a kernel "grey-box".
    method : str, estimator or None
        How the coefficients are fitted. None is "tls-svm" for a table of terms, the
        only method of "mmg", and the one that suits it for each structure that "auto"
        tries. Otherwise a name of
        `identification.models.methods.METHODS`, such as "tls-svm", an estimator
        such as `TruncatedLSSVM(rank=12)`, a `Refinement`, or any object with
        scikit-learn's interface, `fit(X, y)` that sets `coef_`, of which each equation
        gets a copy.
    samples : str or Sampling
        How a trial becomes a regression.
    particulars : Particulars or mapping
        Of the ship; at least the length, and, for structures of forces, what is needed
        to estimate mass and added mass. The service speed is estimated from the start
        of the trials where absent.
    steering : SteeringGear or None
        Estimated from the rudders of the trials where absent.
    preprocessing : str or Preprocessing
        How noisy channels are smoothed, and whether outliers are repaired.
    reference_model : str, ShipModel or None
        Reference ship of a grey box: a model, its name or file, or "auto", the one
        most like this ship.
    kernel : str, KernelResidual or None
        Kernel of an LS-SVM on what a reference ship leaves.
    prior : str, ShipModel, PriorKnowledge or None
        What the coefficients of `mmg` are pulled toward.
    uncertainty : str or Uncertainty
        Where the covariance of the coefficients comes from.
    current : str or table
        Steady current in velocities over ground. "auto": estimated, and removed if it
        differs from zero; "none": left in; or a known one in m/s, such as
        `{ north = 0.2, east = -0.1 }`. Columns current_north and current_east take
        precedence.
    wind : str or table
        Force of the wind in columns wind_speed and wind_from. "auto": by Blendermann's
        coefficients; "none": not removed; `{ relative = true }`: the wind is that felt
        on board, measured from the bow.
    rudder_bias : {"auto", "none"}
        "auto": a structure without a constant gets one where the bias of the rudder
        differs from zero; "none": it stays as it is.
    guarded : bool
        Whether a model that runs away in a hard turn is fitted again, with the weakest
        sufficient penalty on terms that are large there and invisible in the data.
    name : str or None
        Of the model; by default that of the ship.
    service_shaft_speed : float or None, above 0
        Shaft speed at service speed, 1/s; by default that at the start of the trials.
    """

    structure: str | Structure | None = None
    method: Any = None
    samples: Any = "spline"  # a Sampling once made, and so with the other stages
    particulars: Given = None
    steering: SteeringGear | None = None
    _: KW_ONLY
    preprocessing: Any = "spline"
    reference_model: str | ShipModel | None = None
    kernel: Any = None
    prior: Any = None
    uncertainty: Any = "analytic"
    current: str | Mapping[str, float] = "auto"
    wind: str | Mapping[str, Any] = "auto"
    rudder_bias: str = "auto"
    guarded: bool = True
    name: str | None = None
    service_shaft_speed: float | None = None

    def __post_init__(self) -> None:
        for name, kind in STAGES.items():
            value = getattr(self, name)
            is_word = isinstance(value, str | ShipModel) or not is_dataclass(value)
            if is_word and value is not None:
                object.__setattr__(self, name, kind(value))
        if not isinstance(self.steering, SteeringGear | None):
            raise InputError(
                "steering: expected a SteeringGear, or None to estimate it from the"
                f" rudders, got {self.steering!r}"
            )
        if self.structure is None:
            unnamed = "abkowitz" if self.kernel is None else GREY_BOX
            object.__setattr__(self, "structure", unnamed)
        if not isinstance(self.structure, Structure):
            check_text(self.structure, "structure")
        if self.kernel is not None and self.structure == AUTO:
            raise InputError(
                "kernel: expected a structure beneath it that is named, got 'auto';"
                " choose 'linear', another such as 'mmg', or 'grey-box' with a"
                " reference_model"
            )
        if not isinstance(self.reference_model, ShipModel | None):
            check_text(self.reference_model, "reference_model")
        check_current(self.current)
        check_wind(self.wind)
        check_choice(self.rudder_bias, ("auto", "none"), "rudder_bias")
        if self.prior is not None and self.structure not in (MMG, AUTO):
            raise InputError(
                "prior: expected none but with structure 'mmg', whose coefficients it"
                f" holds, got structure {name_of(self.structure)!r}; leave the prior"
                " out, or choose 'mmg' or 'auto'"
            )
        check_flag(self.guarded, "guarded")
        if self.name is not None:
            check_text(self.name, "name")
        speed = self.service_shaft_speed
        if speed is not None:
            check_number(speed, "service_shaft_speed", above=0.0, hint="1/s")


def name_of(value: Any) -> str:
    """The name of a model, a structure or a method, or of an estimator's class."""
    if isinstance(value, str):
        return value
    if isinstance(value, LinearRegressor):
        return value.method_name
    if isinstance(value, ShipModel | Structure | Refinement):
        return value.name
    return type(value).__name__


def whole_call(options: Options, trials: Sequence[Trial]) -> dict[str, Any]:
    """The whole call for settings.json, trials by name, use and hash."""
    return {
        "software": f"shipgym {shipgym.__version__}",
        **settings_of(options, [item.name for item in fields(options)]),
        "trials": [
            {"name": trial.name, "use": trial.use, "sha256": trial.raw.sha256}
            for trial in trials
        ],
    }


def settings_of(value: Any, names: Iterable[str]) -> dict[str, Any]:
    """Attributes of an object by name, as JSON knows them."""
    return {name: plain(getattr(value, name)) for name in names}


def plain(value: Any) -> Any:
    """A setting as JSON knows it: infinity as null, models and trials by name."""
    if isinstance(value, str | int | bool | None):
        return value
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    if isinstance(value, ShipModel | Trial):
        return value.name
    if hasattr(value, "to_dict"):
        return value.to_dict()
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    if hasattr(value, "get_params"):
        return {"name": name_of(value), **plain(value.get_params(deep=False))}
    if is_dataclass(value):
        return settings_of(value, [item.name for item in fields(value)])
    return repr(value)


#: The setting of each stage that its name alone stands for.
WORDS = {name: fields(kind)[0].name for name, kind in STAGES.items()}
WORDS["method"] = "name"
#: Arguments of `identify` that are no stage, and come from such a table.
ARGUMENTS = tuple(
    item.name
    for item in fields(Options)
    if item.name not in (*WORDS, "particulars", "steering")
)


def stage_settings() -> dict[str, list[str]]:
    """Names of the settings of each stage but for the one that its name stands for."""
    found = {}
    for stage, kind in STAGES.items():
        found[stage] = [item.name for item in fields(kind)][1:]
    of_methods = [option for method in METHODS for option in method_options(method)]
    found["method"] = list(dict.fromkeys(of_methods))
    return found


def option_names() -> dict[str, str]:
    """Full names of options by every name that they may be given."""
    found: dict[str, str] = {}
    for stage, settings in stage_settings().items():  # the method comes last
        for setting in settings:
            name = f"{stage}.{setting}"
            found[setting] = name
            found[name] = name
        found[f"{stage}.{WORDS[stage]}"] = stage
    return found | {name: name for name in (*ARGUMENTS, *WORDS)}


def read_table(table: Any, where: str) -> dict[str, Any]:
    """Values of a table of options by their full names.

    Parameters
    ----------
    table : mapping
        Values by name; a stage may be a table of its settings.
    where : str
        Begins messages, such as ``"ship.toml: [identify]"``.

    Raises
    ------
    InputError
        For an unknown option.
    """
    known = option_names()
    found: dict[str, Any] = {}
    for name, value in check_table(
        table,
        where,
    ).items():
        own = {name: value}
        if name in WORDS and isinstance(value, Mapping):
            own = {f"{name}.{setting}": one for setting, one in value.items()}
        for option, one in own.items():
            if option not in known:
                alone = ", ".join(name for name in known if "." not in name)
                raise InputError(
                    f"{where} {option}: expected an option of identify, got an unknown"
                    f" one.{did_you_mean(option, known) or f' There are {alone}.'}"
                )
            found[known[option]] = one
    return found


def identify_arguments(values: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of `identify` from options by their full names.

    Raises InputError for values that they cannot have, and for options that do not
    belong together.
    """
    arguments = {name: values[name] for name in ARGUMENTS if name in values}
    for stage, kind in STAGES.items():
        settings = _settings_of(values, stage)
        if stage == "kernel" and settings and "kernel" not in values:
            raise InputError(
                f"{', '.join(settings)}: expected a kernel that this is a setting of,"
                ' got none; give kernel = "rbf"'
            )
        if stage in values:
            settings[WORDS[stage]] = values[stage]
        if settings:
            arguments[stage] = kind(**settings)

    if "method" in values:
        arguments["method"] = check_choice(
            values["method"],
            (*METHODS, MAP),
            "method",
        )
    settings = _settings_of(values, "method")
    if settings:
        made = make_method(arguments.get("method", DEFAULT_METHOD), settings)
        if not isinstance(made, Refinement):
            made.check()
        arguments["method"] = made
    Options(**arguments)
    return arguments


def _settings_of(values: Mapping[str, Any], stage: str) -> dict[str, Any]:
    """The settings of a stage among options by their full names."""
    prefix = f"{stage}."
    return {
        name.removeprefix(prefix): value
        for name, value in values.items()
        if name.startswith(prefix)
    }
