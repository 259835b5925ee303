"""Tests keep compiled ships in a folder of their own where the user's cache is refused
or closed."""

import os
import tempfile

from shipgym.engine.cache_folder import CACHE_VARIABLE, open_folder

try:
    open_folder()
except (OSError, ValueError):
    os.environ[CACHE_VARIABLE] = tempfile.mkdtemp(prefix="shipgym-tests-")
