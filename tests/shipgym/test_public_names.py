"""What `import shipgym` gives, and what it costs."""

import importlib
import inspect
import json
import subprocess
import sys
from pathlib import Path

import gymnasium
import pytest

import shipgym
import shipgym.manoeuvres
import shipgym.sea

DEFAULTS = Path(__file__).with_name("defaults.json")
PUBLIC = (
    "shipgym",
    "shipgym.manoeuvres",
    "shipgym.sea",
    "shipgym.ships",
    "identification",
    "agents",
)


def defaults():
    """Default of each argument of what is public, methods of classes among it, by package, name, argument."""
    found = {}
    for package in map(importlib.import_module, PUBLIC):
        for name in sorted(set(package.__all__) - {"ShipVecEnv"}):  # which loads torch
            given = getattr(package, name)
            if not callable(given) or (
                inspect.isclass(given) and issubclass(given, Exception)
            ):
                continue
            for called, function in {
                f"{package.__name__}.{name}": given,
                **methods(package, name),
            }.items():
                parameters = inspect.signature(function).parameters.values()
                own = {
                    p.name: p.default
                    for p in parameters
                    if isinstance(p.default, int | float | str | tuple)
                }
                if own:
                    found[called] = json.loads(json.dumps(own, default=repr))
    return found


def methods(package, name):
    """Public methods of a class that are written in the project, by their full names."""
    given = getattr(package, name)
    if not inspect.isclass(given):
        return {}
    pairs = inspect.getmembers(given, inspect.isfunction)
    return {
        f"{package.__name__}.{name}.{key}": method
        for key, method in pairs
        if not key.startswith("_") and method.__module__.split(".")[0] in PUBLIC
    }


def test_defaults_are_those_that_users_have():
    """Recorded by `python tests/shipgym/test_public_names.py`, where one is changed on purpose."""
    assert defaults() == json.loads(DEFAULTS.read_text(encoding="utf-8"))


@pytest.mark.parametrize("package", [shipgym, shipgym.sea, shipgym.manoeuvres])
def test_every_public_name_is_there(package):
    for name in package.__all__:
        assert getattr(package, name) is not None
    with pytest.raises(AttributeError, match="weathr"):
        _ = package.weathr


def test_wind_and_towing_tank_are_reached_by_their_names():
    from shipgym.manoeuvres import towing_tank

    assert shipgym.towing_tank is towing_tank
    assert shipgym.Wind is shipgym.sea.Wind


def test_the_import_registers_environments_and_loads_nothing_that_compiles():
    code = (
        "import sys, shipgym; sys.exit(any(name in sys.modules for name in ('numba',"
        " 'scipy', 'control', 'plotly', 'torch')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
    assert "shipgym/CourseKeeping-v0" in gymnasium.registry


if __name__ == "__main__":
    DEFAULTS.write_text(json.dumps(defaults(), indent=1) + "\n", encoding="utf-8")
