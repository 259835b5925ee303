"""Identification of a ship file: its options, the user's, and its trials."""

from collections.abc import Mapping
from typing import Any

import identification
from identification.pipeline.options import AUTO, identify_arguments, read_table
from shipgym import ShipFile, Trial
from shipgym.checks import placed
from shipgym.ships.structures import GREY_BOX, MMG


def identification_settings(
    ship: ShipFile, given: Mapping[str, Any], unnamed: str = AUTO
) -> dict[str, Any]:
    """Options of an identification by full name: those given, else the ship file's.

    Parameters
    ----------
    ship : ShipFile
        Files that its options name are found from its folder.
    given : mapping
        Options by name, such as those of the command line; None for one that was not
        given.
    unnamed : str
        The structure where neither names one, nor a kernel.

    Raises
    ------
    InputError
        For an option that does not exist, or a value that it cannot have.
    """
    given = {name: value for name, value in given.items() if value is not None}
    table = ship.identify
    of_file = read_table(table, f"{ship.path}: [identify]")
    # Options that may name a model's file.
    models = ("reference_model", "prior")
    for option in models:
        model = str(of_file.get(option, ""))
        if model.endswith(".json"):
            path = ship.path.parent / model
            of_file[option] = str(path)

    asked = read_table(given, "options")
    chosen = of_file | asked
    _choose_structure(chosen, asked, unnamed, ship)
    return chosen


def _choose_structure(
    chosen: dict[str, Any], asked: Mapping[str, Any], unnamed: str, ship: ShipFile
) -> None:
    """Complete the structure and its reference ship, which the options may imply."""
    if chosen.get("method") == "rm-svm" and "reference_model" in chosen:
        # it needs a grey box, so a reference ship implies the structure
        named = asked if asked.get("method") == "rm-svm" else chosen
        chosen["structure"] = named.get("structure") or GREY_BOX

    if chosen.get("structure") == GREY_BOX:
        chosen.setdefault("reference_model", "auto")
    elif "structure" in asked and "reference_model" not in asked:
        # one in the ship file belongs to the structure that is named there
        chosen.pop("reference_model", None)
    of_one_method = (AUTO, MMG, GREY_BOX) if "kernel" in chosen else (AUTO, MMG)
    is_new = not {"structure", "kernel"}.isdisjoint(asked)
    is_fixed = chosen.get("structure", GREY_BOX) in of_one_method
    if is_new and is_fixed and "method" not in asked:
        # so does its method
        for name in {name for name in chosen if name.split(".")[0] == "method"}:
            if name not in asked:
                del chosen[name]

    own = ship.structure
    if "kernel" not in chosen:
        chosen.setdefault("structure", unnamed if own is None else own.name)
    if own is not None and chosen.get("structure") == own.name:
        chosen["structure"] = own


def trials_of(
    ship: ShipFile, settings: Mapping[str, Any]
) -> tuple[list[Trial], dict[str, Any]]:
    """The trials of a ship file, and the arguments of `identify`.

    `settings`: from `identification_settings`. The arguments hold particulars and
    steering gear of the ship file.
    """
    trials = list(ship.trials())
    with placed(str(ship.path)):
        arguments = identify_arguments(settings)
    arguments.setdefault("particulars", ship.particulars)
    arguments.setdefault("steering", ship.steering)
    return trials, arguments


def identify_ship(
    ship: ShipFile, settings: Mapping[str, Any]
) -> identification.IdentificationResult:
    """`identify` on a ship file, which its errors name.

    `ship`: its trials are read; `settings`: from `identification_settings`.
    """
    trials, arguments = trials_of(ship, settings)
    with placed(str(ship.path)):
        return identification.identify(trials, **arguments)


def reduce_ship(
    ship: ShipFile, settings: Mapping[str, Any], tolerance: float
) -> identification.ReducedIdentification:
    """`identify_reduced` on a ship file."""
    trials, arguments = trials_of(ship, settings)
    with placed(str(ship.path)):
        return identification.identify_reduced(trials, tolerance, **arguments)
