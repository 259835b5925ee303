"""(b) KVLCC2, MARIN: RM-SVM on the four zigzags, as Mei et al. 2019."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from identification.judging.prediction import trial_metrics
from identification.pipeline import identify
from real_ships.data import Data, MeasuredShip
from real_ships.marin import MEASURED_ROW, SHIP, TURNS, painter
from real_ships.measures import (
    MEASURES,
    Floats,
    error_cells,
    mean_errors,
    turn_cells,
    turns,
    zigzag_errors,
)
from real_ships.section import Section, number, table
from shipgym.models import ShipModel

EVERY = 2  # about 1 Hz, as in the paper
#: Of the paper: advance and tactical diameter to either side, ship lengths.
PRINTED_TURNS = (3.22, 3.20, 3.26, 3.24)

GREY: dict[str, Any] = {"structure": "grey-box", "method": "rm-svm"}
METHODS: dict[str, dict[str, Any]] = {
    "least squares, abkowitz": {"structure": "abkowitz", "method": "ls"},
    "rm-svm, tanker": {**GREY, "reference_model": "tanker"},
    "rm-svm, kvlcc2": {**GREY, "reference_model": "kvlcc2"},
}
BARE = {"tanker": "tanker, nothing fitted", "kvlcc2": "kvlcc2, nothing fitted"}


def fit(
    ship: MeasuredShip, names: Sequence[str], settings: dict[str, Any]
) -> ShipModel:
    """A model of some of the runs."""
    runs = [ship.runs[name] for name in names]
    return identify(
        runs, particulars=ship.particulars, steering=ship.steering, **settings
    ).model


def held_out(ship: MeasuredShip, settings: dict[str, Any]) -> Floats:
    """Mean errors on each run, predicted from the three others."""
    return mean_errors(
        zigzag_errors(
            fit(ship, [other for other in ship.runs if other != name], settings), trial
        )
        for name, trial in ship.runs.items()
    )


def run(data: Data) -> Section:
    """The case."""
    ship = data.ship(SHIP, EVERY)
    bare = {label: ship.bare_reference(name) for name, label in BARE.items()}
    fitted = bare | {
        name: fit(ship, list(ship.runs), settings) for name, settings in METHODS.items()
    }
    zigzags = [
        [
            name,
            *error_cells(
                mean_errors(zigzag_errors(model, t) for t in ship.runs.values())
            ),
        ]
        for name, model in bare.items()
    ] + [
        [name, *error_cells(held_out(ship, settings))]
        for name, settings in METHODS.items()
    ]
    text = TEXT.format(
        zigzags=table(["fit", *MEASURES], zigzags),
        turns=table(
            ["fit of all four", *TURNS],
            [
                *([name, *turn_cells(turns(model))] for name, model in fitted.items()),
                ["printed, rm-svm", *(number(value, 2) for value in PRINTED_TURNS)],
                MEASURED_ROW,
            ],
        ),
        differences=differences(ship),
    )
    return Section(
        "KVLCC2, RM-SVM on MARIN's four zigzags",
        text,
        {"real_ships_b.svg": shown(ship, fitted)},
    )


def differences(ship: MeasuredShip) -> str:
    """How far the runs to either side agree."""
    sides = []
    for angle in (10, 20):
        starboard, port = (
            trial_metrics(ship.bare_reference("tanker"), trial, None)[
                "overshoot_1_deg"
            ]["measured"]
            for trial in (ship.runs[f"zz_{angle}_m"], ship.runs[f"zz_-{angle}_m"])
        )
        sides.append(f"{angle}/{angle}: {starboard:.1f} and {port:.1f}")
    return "; ".join(sides)


def shown(ship: MeasuredShip, fitted: dict[str, ShipModel]) -> Callable[[Any], None]:
    """What the figure shows."""
    return painter(
        {
            name: fitted[name]
            for name in (BARE["tanker"], "rm-svm, tanker", "rm-svm, kvlcc2")
        },
        ship.runs,
    )


TEXT = """
Samples are at about 1 Hz. The reference ships are Mei's (the tanker) and the KVLCC2 of
the literature. Each zigzag is predicted from the three others:

{zigzags}

Turning circles with 35 degrees of rudder, ship lengths:

{turns}

**Limits.** First overshoots to starboard and to port, measured, degrees: {differences};
the paper prints 13.8 for the 20/20 to starboard. The linear correction is extrapolated
to the steady turn, and may make it worse than that of the bare reference ship.

![MARIN's zigzags and circles by RM-SVM](images/real_ships_b.svg)
"""
