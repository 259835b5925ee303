"""Ships for people who steer them with software: trials, models, manoeuvres and environments.

Importing shipgym registers its environments with Gymnasium. Everything else is imported when used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from shipgym.envs.registration import register_environments

if TYPE_CHECKING:
    from shipgym import manoeuvres, plots, towing_tank
    from shipgym.errors import InputError, ManoeuvreError, UnstableModelError
    from shipgym.models import ShipModel, list_models, load_model
    from shipgym.particulars import Particulars
    from shipgym.ship_file import ShipFile
    from shipgym.steering import SteeringGear
    from shipgym.trial import Trial

__version__ = "0.1.0"

_HOME = {
    "InputError": "shipgym.errors",
    "ManoeuvreError": "shipgym.errors",
    "Particulars": "shipgym.particulars",
    "ShipFile": "shipgym.ship_file",
    "ShipModel": "shipgym.models",
    "SteeringGear": "shipgym.steering",
    "Trial": "shipgym.trial",
    "UnstableModelError": "shipgym.errors",
    "list_models": "shipgym.models",
    "load_model": "shipgym.models",
}

_SUBPACKAGES = ("manoeuvres", "plots", "towing_tank")

__all__ = [
    "InputError",
    "ManoeuvreError",
    "Particulars",
    "ShipFile",
    "ShipModel",
    "SteeringGear",
    "Trial",
    "UnstableModelError",
    "list_models",
    "load_model",
    "manoeuvres",
    "plots",
    "towing_tank",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name in _SUBPACKAGES:
        return import_module(f"shipgym.{name}")
    if name not in _HOME:
        raise AttributeError(f"module 'shipgym' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


register_environments()
