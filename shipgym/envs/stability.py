"""Identified models that run away are kept in their files, marked, and not sailed unless asked for."""

import warnings
from collections.abc import Iterable

from shipgym.errors import InputError
from shipgym.ships import ShipModel


def refuse_unstable(models: Iterable[ShipModel], allow_unstable: bool = False) -> None:
    """InputError for models found unstable when they were identified; a warning if `allow_unstable`."""
    marked = [model.name for model in models if (model.provenance or {}).get("stable") is False]
    if not marked:
        return
    found = f"model {marked[0]!r} was found unstable when it was identified: it runs away where ships do not"
    if not allow_unstable:
        raise InputError(
            f"{found}, expected a stable one; identify it from more trials or with the guard, or give "
            "allow_unstable=True to sail it all the same"
        )
    warnings.warn(f"{found}, do not trust what is learned or tuned on it", stacklevel=4)
