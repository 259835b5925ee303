"""Ships for people who steer them with software: trials, models, manoeuvres and environments.

Importing shipgym registers its environments with Gymnasium. Everything else is imported when used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from shipgym.envs.registration import register_environments

if TYPE_CHECKING:
    from shipgym import manoeuvres, plots, towing_tank, weather
    from shipgym.envs.checker import check_vector_env
    from shipgym.envs.recording import RecordEpisode
    from shipgym.envs.sb3 import ShipVecEnv
    from shipgym.episode import Episode
    from shipgym.errors import InputError, ManoeuvreError, UnstableModelError
    from shipgym.models import ShipModel, list_models, list_structures, load_model, register_structure
    from shipgym.models.checker import ModelCheck, check_ship_model
    from shipgym.models.scaling import scale_model
    from shipgym.models.stability import StraightLineStability, straight_line_stability
    from shipgym.particulars import Particulars
    from shipgym.ship_file import ShipFile
    from shipgym.steering import SteeringGear
    from shipgym.trial import Trial
    from shipgym.weather.conditions import Current, Waves, Weather, Wind, sea_states

__version__ = "0.1.0"

_HOME = {
    "Current": "shipgym.weather.conditions",
    "Episode": "shipgym.episode",
    "InputError": "shipgym.errors",
    "ManoeuvreError": "shipgym.errors",
    "ModelCheck": "shipgym.models.checker",
    "Particulars": "shipgym.particulars",
    "RecordEpisode": "shipgym.envs.recording",
    "ShipFile": "shipgym.ship_file",
    "ShipModel": "shipgym.models",
    "ShipVecEnv": "shipgym.envs.sb3",
    "SteeringGear": "shipgym.steering",
    "StraightLineStability": "shipgym.models.stability",
    "Trial": "shipgym.trial",
    "UnstableModelError": "shipgym.errors",
    "Waves": "shipgym.weather.conditions",
    "Weather": "shipgym.weather.conditions",
    "Wind": "shipgym.weather.conditions",
    "check_ship_model": "shipgym.models.checker",
    "check_vector_env": "shipgym.envs.checker",
    "list_models": "shipgym.models",
    "list_structures": "shipgym.models",
    "load_model": "shipgym.models",
    "register_structure": "shipgym.models",
    "scale_model": "shipgym.models.scaling",
    "straight_line_stability": "shipgym.models.stability",
    "sea_states": "shipgym.weather.conditions",
}

_SUBPACKAGES = ("manoeuvres", "plots", "towing_tank", "weather")

__all__ = [
    "Current",
    "Episode",
    "InputError",
    "ManoeuvreError",
    "ModelCheck",
    "Particulars",
    "RecordEpisode",
    "ShipFile",
    "ShipModel",
    "ShipVecEnv",
    "SteeringGear",
    "StraightLineStability",
    "Trial",
    "UnstableModelError",
    "Waves",
    "Weather",
    "Wind",
    "check_ship_model",
    "check_vector_env",
    "list_models",
    "list_structures",
    "load_model",
    "manoeuvres",
    "plots",
    "register_structure",
    "scale_model",
    "sea_states",
    "straight_line_stability",
    "towing_tank",
    "weather",
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
