"""Places that loops name and parts take: what a ship, a sea, a sensor set and a task put there.

Each function stands for one that is given when a loop is compiled
(`shipgym.engine.specialise`); the one here raises an error that names who gives it.
"""

from typing import Any

from shipgym.files import shipped_toml

#: Functions by what gives them.
PLACES: dict[str, list[str]] = shipped_toml("shipgym.engine", "places.toml")


def __getattr__(name: str) -> Any:
    """A function that raises an error naming who gives it."""
    giver = next((giver for giver, names in PLACES.items() if name in names), None)
    if giver is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

    def place(*arguments: Any) -> Any:
        raise RuntimeError(
            f"{name} is a place that {giver} fill when a loop is compiled"
        )

    place.__name__ = name
    return place
