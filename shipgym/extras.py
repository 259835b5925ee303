"""Libraries that come with an extra of the package, imported when they are first used."""

from importlib import import_module
from typing import Any

from shipgym.errors import InputError


def library(name: str, extra: str, use: str = "") -> Any:
    """A module by name; InputError that says what needs it, and how it is installed, where it is not."""
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        what = f"{name.partition('.')[0]} is not installed{use and f', {use}'}"
        raise InputError(f"{what}: pip install 'shipgym[{extra}]'") from error
