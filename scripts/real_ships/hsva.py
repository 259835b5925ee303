"""(a) KVLCC2, HSVA: fit any three zigzags, predict the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import combinations
from typing import Any

import numpy as np

from identification.models.guard import reasons_unstable
from identification.pipeline import identify
from identification.samples.prediction import predict
from real_ships.data import Data, MeasuredShip
from real_ships.measures import (
    MEASURES,
    Floats,
    error_cells,
    mean_errors,
    turns,
    zigzag_errors,
)
from real_ships.recipe import (
    REFERENCE,
    STRUCTURE,
    fitted,
    fitted_with_table,
    known,
    with_fixed_pull,
)
from real_ships.section import Section, table
from shipgym.manoeuvres import TurningIndices
from shipgym.models import ShipModel

SHIP, EVERY = "kvlcc2_hsva", 4
#: Zigzags that switch at 5 or 10 degrees; those that switch at 1 degree are left aside.
RUNS = ("Z_10_05", "Z_10_10_S", "Z_15_05", "Z_20_05", "Z_20_10_S", "Z_30_05")
SLIGHT = ("Z_05_01", "Z_10_01", "Z_15_01")
TRIPLES = tuple(combinations(RUNS, 3))
TURNS = (
    "advance +35, L",
    "diameter +35, L",
    "advance -35, L",
    "diameter -35, L",
    "fits that turn",
)
AIMS = ["aim", "0.105", "4.3", "0.4", "1.0", "", ""]
SHOWN = TRIPLES[0]

Fit = Callable[[MeasuredShip, Sequence[str]], tuple[ShipModel, bool]]


def plain(
    ship: MeasuredShip, names: Sequence[str], structure: str, method: str
) -> tuple[ShipModel, bool]:
    """A fit with nothing chosen, and whether the guard let it pass."""
    runs = [ship.runs[name] for name in names]
    result = identify(
        runs,
        known(structure),
        method,
        particulars=ship.particulars,
        steering=ship.steering,
    )
    return result.model, result.stable


def bare(ship: MeasuredShip, names: Sequence[str]) -> tuple[ShipModel, bool]:
    """The reference ship as it is."""
    return ship.bare_reference(REFERENCE), True


def chosen(
    ship: MeasuredShip,
    names: Sequence[str],
    fit: Callable[[MeasuredShip, Sequence[str]], ShipModel],
) -> tuple[ShipModel, bool]:
    """A recipe, and whether the guard lets its model pass."""
    model = fit(ship, names)
    return model, not reasons_unstable(model, [ship.runs[name] for name in names])


OURS = "abkowitz12, pulled to kvlcc2-l7"
METHODS: dict[str, Fit] = {
    f"{REFERENCE}, nothing fitted": bare,
    "least squares, abkowitz": partial(plain, structure="abkowitz", method="ls"),
    "least squares, cubic": partial(plain, structure="cubic", method="ls"),
    "tls-svm, abkowitz": partial(plain, structure="abkowitz", method="tls-svm"),
    "least squares, abkowitz12": partial(plain, structure=STRUCTURE, method="ls"),
    "table and pull chosen within the triple": partial(chosen, fit=fitted_with_table),
    "abkowitz12, pull chosen within the triple": partial(chosen, fit=fitted),
    OURS: partial(chosen, fit=with_fixed_pull),
}


def study(ship: MeasuredShip, fit: Fit) -> dict[str, Any]:
    """Errors on the runs not used and the turns, over all triples."""
    errors: dict[str, list[Floats]] = {name: [] for name in RUNS}
    found: dict[str, Any] = {"errors": errors, "unstable": 0, "turns": []}
    for triple in TRIPLES:
        model, stable = fit(ship, triple)
        found["unstable"] += not stable
        found["turns"].append(turns(model))
        for name in RUNS:
            if name not in triple:
                errors[name].append(zigzag_errors(model, ship.runs[name]))
        if triple == SHOWN:
            found["model"] = model
    return found


def run(data: Data) -> Section:
    """The case."""
    ship = data.ship(SHIP, EVERY)
    found = {name: study(ship, fit) for name, fit in METHODS.items()}
    rows = [summary_row(name, result) for name, result in found.items()]
    best = found[OURS]
    per_run = [
        [name, *error_cells(mean_errors(errors)), str(len(errors))]
        for name, errors in best["errors"].items()
        if errors
    ]
    slight = [
        [name, *error_cells(zigzag_errors(best["model"], ship.runs[name]))]
        for name in SLIGHT
    ]
    text = TEXT.format(
        count=len(TRIPLES),
        table=table(
            ["fit", *MEASURES, "ran away", "runs away in the guard"], [*rows, AIMS]
        ),
        turns=table(
            ["fit", *TURNS], [turn_row(name, result) for name, result in found.items()]
        ),
        runs=table(["run", *MEASURES, "times predicted"], per_run),
        slight=table(["run", *MEASURES], slight),
    )
    return Section(
        "KVLCC2, HSVA zigzags from three others",
        text,
        {"real_ships_a.svg": _painter(ship, found)},
    )


def summary_row(name: str, result: dict[str, Any]) -> list[str]:
    """Means over all predictions, and counts of models that fail or are refused."""
    errors = [error for of_run in result["errors"].values() for error in of_run]
    away = int(sum(np.isnan(error[0]) for error in errors))
    return [
        name,
        *error_cells(mean_errors(errors)),
        f"{away} of {len(errors)}",
        f"{result['unstable']} of {len(TRIPLES)}",
    ]


def turn_row(name: str, result: dict[str, Any]) -> list[str]:
    """Means and standard deviations over the fits."""
    sailed = np.array(
        [
            [np.nan if w is None else w for w in _lengths(pair)]
            for pair in result["turns"]
        ]
    )
    kept = sailed[~np.isnan(sailed).any(axis=1)]
    if not len(kept):
        return [name, *["-"] * 4, "0"]
    cells = [
        f"{m:.2f} +- {s:.2f}"
        for m, s in zip(kept.mean(axis=0), kept.std(axis=0), strict=True)
    ]
    return [name, *cells, str(len(kept))]


def _lengths(pair: Sequence[TurningIndices | None]) -> list[float | None]:
    found: list[float | None] = []
    for turn in pair:
        found += (
            [None, None]
            if turn is None
            else [turn.advance_lengths, turn.tactical_diameter_lengths]
        )
    return found


def _painter(ship: MeasuredShip, found: dict[str, Any]) -> Callable[[Any], None]:
    shown = [name for name in RUNS if name not in SHOWN][-2:]
    names = [*list(METHODS)[:2], OURS]

    def paint(figure: Any) -> None:
        axes = figure.subplots(2, len(shown), sharex="col")
        for column, name in enumerate(shown):
            trial = ship.runs[name]
            for row, channel in enumerate(("psi", "r")):
                axes[row][column].plot(
                    trial.t, np.degrees(trial[channel]), "k", lw=1.2, label="measured"
                )
                for label in names:
                    prediction = predict(found[label]["model"], trial)
                    if prediction is not None:
                        axes[row][column].plot(
                            prediction.t,
                            np.degrees(prediction[channel]),
                            lw=0.8,
                            label=label,
                        )
            axes[0][column].set_title(f"{name}, predicted")
            axes[1][column].set_xlabel("t, s")
        axes[0][0].set_ylabel("heading, deg")
        axes[1][0].set_ylabel("yaw rate, deg/s")
        axes[1][0].legend(fontsize=5.5)

    return paint


TEXT = """
Means over the runs that are not used, for all {count} ways to take three of the six
zigzags that switch at 5 or 10 degrees, predicted open loop from the measured rudder;
every fourth sample (5 Hz).

{table}

Fits that the guard refuses run away in a simulated hard turn or reversal; the table
still shows their predictions, without the runs in which they run away.

`abkowitz12` is the Abkowitz table of the Mariner without the cube of the rudder, its
products with drift, and three terms of surge. Its coefficients are pulled toward the
KVLCC2 of the literature by virtual trials of that ship, which determines the turn.
Chosen within the triple, the pull is the strongest of 0 to 0.2 whose error of r, each
run predicted from the two others, is within a quarter of the smallest. The last row has
the pull of 0.1 that this rule gives for all six runs, see (b): one recipe for zigzags
and turns. **The table itself was found while looking at all six runs** (some fifty were
tried), so its figures are optimistic. 'Table and pull chosen within the triple' chooses
between `abkowitz`, `abkowitz12` and `abkowitz12` with the cube of the rudder, and the
pull with the smallest error, within each triple: only the list of three tables depends
on the runs that it predicts. If a model runs away in the guard, the next stronger pull
is taken.

Turns of the same fits with the rudder at 35 degrees, from straight ahead, means and
standard deviations over the fits (measured at MARIN, see (b): 3.25 and 3.34 to
starboard):

{turns}

By run, `abkowitz12` with the pull:

{runs}

**Limits.** Repeats of the 10/10 agree within 0.2 to 0.5 degrees of first overshoot: the
aim of 0.4 is within the repeatability of the experiment itself. Z_10_05 is the worst in
second overshoot: even least squares with the full Abkowitz table on all six runs misses
it by 2.9 degrees. Z_30_05 is an extrapolation from runs of at most 20 degrees of
rudder. Zigzags that switch at 1 degree are not counted: KVLCC2 is neutral to unstable
on course ([measurements](measurements.md)), and in open loop the smallest error of the
neutral helm grows into a heading drift; the model of the first triple gives

{slight}

![Predicted zigzags](images/real_ships_a.svg)
"""
