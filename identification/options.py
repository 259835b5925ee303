"""The options of `identify`, as a model's provenance and settings.json record them."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, is_dataclass
from typing import Any

import numpy as np

import shipgym
from shipgym import Particulars, ShipModel, SteeringGear, Trial
from shipgym.ships import Structure
from shipgym.trials.identify_table import Options

Given = Particulars | Mapping[str, Any] | None  # particulars, as `identify` takes them

__all__ = ["Given", "Options", "name_of", "provenance_settings", "whole_call"]


def provenance_settings(
    options: Options, of_method: Mapping[str, Any]
) -> dict[str, Any]:
    """Settings for the provenance: those of the samples and of the method."""
    found = {
        "window": options.window,
        "smooth": options.smooth,
        "guarded": options.guarded,
        **of_method,
    }
    if options.preprocessing is not None:
        found["preprocessing"] = options.preprocessing
    return {key: _plain(value) for key, value in found.items()}


def whole_call(
    options: Options,
    trials: Sequence[Trial],
    particulars: Given,
    steering: SteeringGear | None,
) -> dict[str, Any]:
    """The whole call for settings.json, trials by name, use and hash."""
    given = {
        **options.own(),
        **options.settings(),
        "particulars": particulars,
        "steering": steering,
    }
    return {
        "software": f"shipgym {shipgym.__version__}",
        **{key: _plain(value) for key, value in given.items()},
        "trials": [
            {"name": trial.name, "use": trial.use, "sha256": trial.raw.sha256}
            for trial in trials
        ],
    }


def name_of(value: Any) -> str:
    """The name of a model or of a method, of an estimator that of its class."""
    if isinstance(value, str):
        return value
    return (
        value.name if isinstance(value, ShipModel | Structure) else type(value).__name__
    )


def _plain(value: Any) -> Any:
    """A setting as JSON knows it: infinity as null, models and trials by their names."""
    if isinstance(value, ShipModel | Trial):
        return value.name
    if isinstance(value, Particulars | SteeringGear | Structure):
        return value.to_dict()
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        return {"kind": type(value).__name__} | _plain(asdict(value))
    if hasattr(value, "fit"):
        settings = value.get_params(deep=False) if hasattr(value, "get_params") else {}
        return {"kind": type(value).__name__} | _plain(settings)
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple | set | frozenset):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value if isinstance(value, str | int | float | bool | None) else repr(value)
