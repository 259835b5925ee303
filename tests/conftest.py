"""Tests keep compiled ships in a folder of their own where the user's cache is refused
or closed."""

import os
import tempfile

import pytest

from shipgym.engine.cache_folder import CACHE_VARIABLE, open_folder

try:
    open_folder()
except (OSError, ValueError):
    os.environ[CACHE_VARIABLE] = tempfile.mkdtemp(prefix="shipgym-tests-")


@pytest.fixture(autouse=True)
def _own_environment(monkeypatch):
    """What a command run in this process sets for its children ends with the test."""
    monkeypatch.setenv("PYTHONSAFEPATH", "")
