"""Libraries of the package's extras, imported on first use."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

from lazy_loader import attach_stub

from shipgym.checks import did_you_mean
from shipgym.errors import InputError

#: Classes of `identification` by the names that papers have for them.
IN_PAPERS = {
    "TLSSVM": "TruncatedLSSVM",
    "ABCLSSVR": "TunedLSSVM",
    "PSOLSSVR": "TunedLSSVM",
    "LSSVR": "LSSVM",
    "LSSVM": "LSSVM",
    "RMSVM": "RMSVM",
}


def public_names(
    package: str, file: str
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """What a package's `__getattr__`, `__dir__` and `__all__` are, by its `.pyi` file.

    Each name is imported when it is first used; an unknown one is refused with the
    nearest.
    """
    get, names, listed = attach_stub(package, file)

    def named(name: str) -> Any:
        try:
            return get(name)
        except AttributeError:
            meant = IN_PAPERS.get(name.upper().replace("_", ""))
            near = did_you_mean(meant or name, listed)
            if meant and meant not in listed:
                near = f" It is identification.{meant}."
            message = f"module {package!r} has no attribute {name!r}.{near}"
            # with a name, Python adds no nearest name of its own
            raise AttributeError(message, name=name) from None

    return named, names, listed


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
