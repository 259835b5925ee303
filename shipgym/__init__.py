"""Ships for people who steer them with software: trials, models, manoeuvres and environments.

Importing shipgym registers its environments with Gymnasium. Everything else is imported when used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from shipgym.envs.registration import register_environments

if TYPE_CHECKING:
    from shipgym import manoeuvres, plots
    from shipgym import sea as weather
    from shipgym.envs.checker import check_vector_env
    from shipgym.envs.episode import Episode
    from shipgym.envs.recording import RecordEpisode
    from shipgym.envs.sb3 import ShipVecEnv
    from shipgym.errors import InputError, ManoeuvreError, UnstableModelError
    from shipgym.manoeuvres import towing_tank
    from shipgym.sea.conditions import Current, Waves, Weather, Wind, sea_states
    from shipgym.ships import (
        ShipEquations,
        ShipModel,
        list_models,
        list_structures,
        load_model,
        register_ship_equations,
        register_structure,
    )
    from shipgym.ships.checker import ModelCheck, check_ship_model
    from shipgym.ships.particulars import Particulars
    from shipgym.ships.scaling import scale_model
    from shipgym.ships.stability import StraightLineStability, straight_line_stability
    from shipgym.ships.steering import SteeringGear
    from shipgym.trials.ship_file import ShipFile
    from shipgym.trials.trial import Trial

__version__ = "0.1.0"

_HOME = {
    "Current": "shipgym.sea.conditions",
    "Episode": "shipgym.envs.episode",
    "InputError": "shipgym.errors",
    "ManoeuvreError": "shipgym.errors",
    "ModelCheck": "shipgym.ships.checker",
    "Particulars": "shipgym.ships.particulars",
    "RecordEpisode": "shipgym.envs.recording",
    "ShipEquations": "shipgym.ships",
    "ShipFile": "shipgym.trials.ship_file",
    "ShipModel": "shipgym.ships",
    "ShipVecEnv": "shipgym.envs.sb3",
    "SteeringGear": "shipgym.ships.steering",
    "StraightLineStability": "shipgym.ships.stability",
    "Trial": "shipgym.trials.trial",
    "UnstableModelError": "shipgym.errors",
    "Waves": "shipgym.sea.conditions",
    "Weather": "shipgym.sea.conditions",
    "Wind": "shipgym.sea.conditions",
    "check_ship_model": "shipgym.ships.checker",
    "check_vector_env": "shipgym.envs.checker",
    "list_models": "shipgym.ships",
    "list_structures": "shipgym.ships",
    "load_model": "shipgym.ships",
    "register_ship_equations": "shipgym.ships",
    "register_structure": "shipgym.ships",
    "scale_model": "shipgym.ships.scaling",
    "straight_line_stability": "shipgym.ships.stability",
    "sea_states": "shipgym.sea.conditions",
}

_MODULES = {
    "manoeuvres": "shipgym.manoeuvres",
    "plots": "shipgym.plots",
    "towing_tank": "shipgym.manoeuvres.towing_tank",
    "weather": "shipgym.sea",
}

__all__ = [
    "Current",
    "Episode",
    "InputError",
    "ManoeuvreError",
    "ModelCheck",
    "Particulars",
    "RecordEpisode",
    "ShipEquations",
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
    "register_ship_equations",
    "register_structure",
    "scale_model",
    "sea_states",
    "straight_line_stability",
    "towing_tank",
    "weather",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name in _MODULES:
        return import_module(_MODULES[name])
    if name not in _HOME:
        raise AttributeError(f"module 'shipgym' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


register_environments()
