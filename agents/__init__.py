"""Autopilots for the ships of shipgym: classical, learned, and the command line.

The public names stand in `__init__.pyi`; each is imported when it is first used.
"""

import os
import sys

# `python -m agents.cli` finds modules in the working folder first, where a stranger's
# may lie; while it imports this package, its first argument is still "-m"
if (
    sys.argv[:1] == ["-m"]
    and not sys.flags.safe_path
    and __path__ != [sys.path[0] + os.sep + "agents"]  # as in a checkout
):
    del sys.path[0]

from shipgym.extras import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
