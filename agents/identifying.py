"""Identification of a ship file: its options, those given beside it, and its trials."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import identification
from identification import IdentificationResult, identify
from identification.estimators.methods import METHODS
from shipgym import ShipFile, Trial
from shipgym.checks import placed
from shipgym.ships.grey_boxes import GREY_BOX
from shipgym.trials.identify_table import AUTO, check_options

if TYPE_CHECKING:
    from identification import Comparison, ReducedIdentification

RM_SVM = (  # needs a grey box, so a reference ship beside it implies the structure
    "rm-svm"
)
MODELS = ("reference_model", "prior", "anchor")  # options that may name a model's file


def identification_settings(
    ship: ShipFile, given: Mapping[str, Any], unnamed: str = AUTO
) -> dict[str, Any]:
    """Arguments of `identify`: those given, else the ship file's; the others are left to their defaults.

    `ship`: files that it names are found from its folder; `given`: by option; None for
    those that were not given; `unnamed`: the structure where neither names one, nor a
    kernel. Raises InputError for an option that does not exist or has a value of
    another kind.
    """
    own = dict(ship.identify)
    for option in MODELS:
        if str(own.get(option, "")).endswith(".json"):
            own[option] = str(ship.path.parent / own[option])
    chosen = own | check_options(
        {k: v for k, v in given.items() if v is not None}, "options"
    )
    if chosen.get("method") == RM_SVM and "reference_model" in chosen:
        named = (
            given if given.get("method") == RM_SVM else chosen
        )  # the command line goes before the file
        chosen["structure"] = named.get("structure") or GREY_BOX
    if chosen.get("structure") == GREY_BOX:
        chosen.setdefault("reference_model", "auto")
    elif (
        "structure" in given
        and given["structure"] is not None
        and given.get("reference_model") is None
    ):
        chosen.pop("reference_model", None)  # of the structure that the ship file names
    if "kernel" not in chosen:
        chosen.setdefault(
            "structure", unnamed if ship.structure is None else ship.structure.name
        )
    if ship.structure is not None and chosen.get("structure") == ship.structure.name:
        chosen["structure"] = ship.structure
    return chosen


def trials_of(
    ship: ShipFile, settings: Mapping[str, Any]
) -> tuple[list[Trial], dict[str, Any]]:
    """The trials of a ship file, and the settings with what else it says.

    That is its particulars and steering gear, and the extra trials read, which are left
    out of the others.
    """
    extra = settings.get("extra_trials", [])
    trials = [trial for trial in ship.trials() if trial.name not in extra]
    arguments = {"particulars": ship.particulars, "steering": ship.steering, **settings}
    if extra:
        arguments["extra_trials"] = [ship.trial(file) for file in extra]
    return trials, arguments


def identify_ship(ship: ShipFile, settings: Mapping[str, Any]) -> IdentificationResult:
    """`identify` on a ship file, which its errors name.

    `ship`: its trials are read; `settings`: from `identification_settings`.
    """
    trials, arguments = trials_of(ship, settings)
    with placed(str(ship.path)):
        return identify(trials, **arguments)


def compare_ship(
    ship: ShipFile,
    settings: Mapping[str, Any],
    structures: str | None,
    methods: str | None,
) -> Comparison:
    """`compare_methods` on a ship file.

    `ship`: its trials are read; `settings`: from `identification_settings`; their
    method does not count, and their structure where `structures` are named; names have
    commas between, None is for the usual `methods`, and "all" for every one.
    """
    trials, arguments = trials_of(ship, settings)
    arguments.pop("method", None)
    known: dict[str, Any] = (
        {} if ship.structure is None else {ship.structure.name: ship.structure}
    )
    wanted = structures and [
        known.get(name.strip(), name.strip()) for name in structures.split(",")
    ]
    if wanted:
        arguments.pop("structure", None)
    names = (
        list(METHODS)
        if methods == "all"
        else methods and [n.strip() for n in methods.split(",")]
    )
    with placed(str(ship.path)):
        return identification.compare_methods(
            trials, names or None, wanted or None, **arguments
        )


def reduce_ship(
    ship: ShipFile, settings: Mapping[str, Any], direction: str, tolerance: float
) -> ReducedIdentification:
    """`identify_reduced` on a ship file."""
    trials, arguments = trials_of(ship, settings)
    with placed(str(ship.path)):
        return identification.identify_reduced(
            trials, direction, tolerance, **arguments
        )
