"""The shipped models by name: reference ships, and identified models in `library/`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from shipgym.checks import check_choice
from shipgym.ships.container import container
from shipgym.ships.kvlcc2 import kvlcc2, kvlcc2_l7
from shipgym.ships.mariner import mariner
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.tanker import tanker

LIBRARY = Path(__file__).parent / "library"
REFERENCE_SHIPS: dict[str, Callable[[], ShipModel]] = {
    "mariner": mariner,
    "container": container,
    "tanker": tanker,
    "kvlcc2": kvlcc2,
    "kvlcc2-l7": kvlcc2_l7,
}


def list_models() -> list[str]:
    """Names of the shipped models: reference ships first, then identified ones."""
    return [*REFERENCE_SHIPS, *sorted(path.stem for path in LIBRARY.glob("*.json"))]


def load_model(name: str | Path) -> ShipModel:
    """A shipped model by name, or a model from a file.

    Parameters
    ----------
    name : str or Path
        A name of `list_models`, or the path of a model file.

    Returns
    -------
    ShipModel

    Raises
    ------
    InputError
        If there is no such model or file, or the file is not a valid model.
    """
    path = Path(name)
    if name not in list_models() and (path.suffix == ".json" or path.exists() or isinstance(name, Path)):
        return ShipModel.load(path)
    known = check_choice(name, list_models(), "model (a name, or the path of a model file)")
    return REFERENCE_SHIPS[known]() if known in REFERENCE_SHIPS else ShipModel.load(LIBRARY / f"{known}.json")
