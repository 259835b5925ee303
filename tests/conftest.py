"""Compiled ships of tests lie in a folder of their own if the user's is closed."""

import os
import tempfile

import pytest

from shipgym.engine.cache import CACHE_VARIABLE, cache_folder
from shipgym.engine.numba_import import load_numba

load_numba()  # test modules that import Numba themselves must not be the first

try:
    cache_folder().mkdir(parents=True, exist_ok=True)
except OSError:
    os.environ[CACHE_VARIABLE] = tempfile.mkdtemp(prefix="shipgym-tests-")


@pytest.fixture(autouse=True)
def _own_environment(monkeypatch):
    """What a command run in this process sets for its children ends with the test."""
    monkeypatch.setenv("PYTHONSAFEPATH", "")
