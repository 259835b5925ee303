"""A name that the setup of PufferLib 3.0.0 uses and does not set where its games are left out (NO_OCEAN=1)."""

import builtins

vars(builtins)["c_extension_paths"] = []
