"""A name that the setup of PufferLib 3.0.0 uses but, without its games (NO_OCEAN=1), does not set."""

import builtins

vars(builtins)["c_extension_paths"] = []
