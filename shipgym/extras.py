"""Libraries of the package's extras, imported on first use."""

from importlib import import_module
from typing import Any

from shipgym.errors import InputError


def library(name: str, extra: str, use: str = "") -> Any:
    """Import a module by name; InputError says what needs it and how to install it."""
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        package, _, _ = name.partition(".")
        missing = f"{package} is not installed"
        if use:
            missing += f", {use}"
        raise InputError(f"{missing}: pip install 'shipgym[{extra}]'") from error


def axes_of(ax: Any = None) -> Any:
    """Axes of matplotlib: those given, or the current ones."""
    return ax or library("matplotlib.pyplot", "report", "plots need it").gca()
