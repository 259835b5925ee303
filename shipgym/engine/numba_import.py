"""Numba, without settings from the working folder."""

import sys
import warnings
from functools import cache
from types import ModuleType


@cache
def load_numba() -> ModuleType:
    """Import Numba, which otherwise reads a `.numba_config.yaml` where data lie.

    Such a file could name a folder of machine code. A program that wants one imports
    Numba before shipgym does.
    """
    if "numba" in sys.modules:
        return sys.modules["numba"]

    yaml = sys.modules.get("yaml")
    sys.modules["yaml"] = None  # type: ignore[assignment]
    try:
        with warnings.catch_warnings(action="ignore"):  # that YAML is missing
            from numba.core import config
    finally:
        del sys.modules["yaml"]
        if yaml is not None:
            sys.modules["yaml"] = yaml
    config._config_fname = ""  # it is looked for again at each compilation
    return sys.modules["numba"]
