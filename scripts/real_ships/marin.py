"""(b) KVLCC2: from HSVA's zigzags alone, MARIN's zigzags and turning circles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from identification.pipeline import identify
from identification.samples.prediction import predict
from real_ships.data import Data, MeasuredShip
from real_ships.hsva import OURS
from real_ships.hsva import RUNS as HSVA_RUNS
from real_ships.hsva import SHIP as HSVA
from real_ships.measures import (
    MEASURES,
    error_cells,
    mean_errors,
    turn_cells,
    turns,
    zigzag_errors,
)
from real_ships.recipe import (
    REFERENCE,
    STRENGTHS,
    STRUCTURE,
    chosen_strength,
    known,
    pulled,
    refined,
)
from real_ships.section import Section, headings, number, table
from shipgym.models import ShipModel
from shipgym.models.scaling import scale_model
from shipgym.trials.trial import Trial

SHIP, HSVA_EVERY = "kvlcc2_marin", 4
#: Advance and tactical diameter to starboard, ship lengths: measured, printed in Mei
#: 2019.
MEASURED = (3.25, 3.34)
TURNS = ("advance +35", "diameter +35", "advance -35", "diameter -35")


def models(
    hsva: MeasuredShip, marin: MeasuredShip
) -> tuple[dict[str, ShipModel], float, dict[float, float]]:
    """Models of the HSVA zigzags at MARIN's scale, the pull, and its errors."""
    runs = [hsva.runs[name] for name in HSVA_RUNS]
    found = {}
    for structure in ("abkowitz", "cubic", STRUCTURE):
        fit = identify(
            runs,
            known(structure),
            "ls",
            particulars=hsva.particulars,
            steering=hsva.steering,
        )
        found[f"least squares, {structure}"] = fit.model
    strength, errors = chosen_strength(hsva, HSVA_RUNS)
    found["abkowitz12, refined by simulation"] = refined(hsva, HSVA_RUNS).model
    found[OURS] = pulled(hsva, HSVA_RUNS, strength)
    at_full_scale = {name: full_scale(model, marin) for name, model in found.items()}
    return (
        {f"{REFERENCE}, nothing fitted": bare(marin)} | at_full_scale,
        strength,
        errors,
    )


def full_scale(model: ShipModel, marin: MeasuredShip) -> ShipModel:
    """The model at MARIN's length, speed and shaft speed at the start of its runs.

    The tanks ran different propellers: shaft speeds are told by each one's at service
    speed.
    """
    scaled = scale_model(model, marin.particulars.length, marin.particulars["speed"])
    shaft = float(np.mean([trial["n"][0] for trial in marin.runs.values()]))
    return replace(
        scaled, service_shaft_speed=shaft, steering=marin.steering or scaled.steering
    )


def bare(marin: MeasuredShip) -> ShipModel:
    """The reference ship at MARIN's scale."""
    return marin.bare_reference(REFERENCE)


def run(data: Data) -> Section:
    """The case."""
    hsva, marin = data.ship(HSVA, HSVA_EVERY), data.ship(SHIP)
    found, strength, errors = models(hsva, marin)
    rows = [
        [
            name,
            *error_cells(
                mean_errors(zigzag_errors(model, t) for t in marin.runs.values())
            ),
        ]
        for name, model in found.items()
    ]
    sailed = [[name, *turn_cells(turns(model))] for name, model in found.items()]
    best = OURS
    text = TEXT.format(
        zigzags=table(["fit", *MEASURES], rows),
        runs=table(
            ["run", *MEASURES],
            [
                [name, *error_cells(zigzag_errors(found[best], t))]
                for name, t in marin.runs.items()
            ],
        ),
        turns=table(["fit", *TURNS], [*sailed, MEASURED_ROW]),
        path=table(
            ["strength", "r held out, deg/s", *TURNS],
            [
                [f"{s:g}", number(errors[s]), *turn_cells(turns(_at(hsva, s)))]
                for s in STRENGTHS
            ],
        ),
        strength=f"{strength:g}",
        verdict=verdict(found[best]),
    )
    return Section(
        "KVLCC2, MARIN's runs from HSVA's zigzags",
        text,
        {"real_ships_b.svg": painter(found, marin.runs)},
    )


def _at(hsva: MeasuredShip, strength: float) -> ShipModel:
    return pulled(hsva, HSVA_RUNS, strength)


MEASURED_ROW = [
    "measured (Mei 2019)",
    *(number(value, 2) for value in MEASURED),
    "-",
    "-",
]


def verdict(model: ShipModel) -> str:
    """The errors of the turn to starboard against the aims, in words."""
    turn = turns(model)[0]
    if (
        turn is None
        or turn.advance_lengths is None
        or turn.tactical_diameter_lengths is None
    ):
        return "It runs away in the turn."
    advance, diameter = (
        100.0 * (ours / measured - 1.0)
        for ours, measured in zip(
            (turn.advance_lengths, turn.tactical_diameter_lengths),
            MEASURED,
            strict=True,
        )
    )
    return (
        f"To starboard its advance is {advance:+.1f} % and its tactical diameter "
        f"{diameter:+.1f} % off the measured ones (aims 1 and 4 %)."
    )


def painter(
    models_: dict[str, ShipModel], runs: dict[str, Trial]
) -> Callable[[Any], None]:
    """Headings of the zigzags to starboard, and the circles."""

    def paint(figure: Any) -> None:
        axes: Sequence[Any] = figure.subplots(1, 3, width_ratios=(1.2, 1.2, 1.0))
        for axis, name in zip(axes, ("zz_10_m", "zz_20_m"), strict=False):
            predictions = {
                label: predict(model, runs[name]) for label, model in models_.items()
            }
            headings(axis, runs[name], predictions, f"{name}, predicted")
            axis.set_ylim(-60.0, 60.0)
        axes[0].legend(fontsize=5.0)
        _circles(axes[2], models_)

    return paint


def _circles(axis: Any, models_: dict[str, ShipModel]) -> None:
    from shipgym.errors import UnstableModelError
    from shipgym.manoeuvres import turning_circle

    axis.plot([], [])  # the measured runs' colour is not used up
    for label, model in models_.items():
        length = model.particulars["length"]
        for side, colour in zip(
            (35.0, -35.0), (f"C{list(models_).index(label)}",) * 2, strict=True
        ):
            try:
                circle = turning_circle(model, side, 700.0, 2.0)
            except UnstableModelError:
                continue
            axis.plot(circle["y"] / length, circle["x"] / length, colour, lw=0.8)
    axis.set(title="rudder 35 deg", xlabel="y / L", ylabel="x / L", aspect="equal")


TEXT = """
Fitted to all six HSVA zigzags of (a), scaled to MARIN's length and speed by Froude's
law. The settings come from HSVA data alone, with one exception: by how much a stronger
pull may increase the error on the zigzags (a quarter) was set after it was known how
the turns depend on the pull. MARIN's zigzags are predicted open loop from the measured
rudder, full scale (times 6.76 for the yaw rate of a 7 m model).

{zigzags}

By run, `abkowitz12` with the pull:

{runs}

Turning circles with 35 degrees of rudder from straight ahead at service speed, ship
lengths:

{turns}

The refinement fits the simulated motion in segments of 8 ship lengths; the reference
ship's turns are included in its cost (`anchor="kvlcc2-l7"`) with a weight of 0.01.

{verdict} The measured values printed for -35 repeat those of +35 and are not used; the
data here do not include measured circles.

The pull, {strength}, is found as in (a), each of the six runs predicted from the five
others. The next table shows how the turn depends on it, which the zigzags hardly
determine:

{path}

**Limits.** MARIN's neutral helm is about -0.8 to -1.2 degrees, HSVA's is not: this
makes the heading of an unstable ship drift, whatever the model. The steady turn (drift
of 20 degrees, speed down to 0.37) lies outside all zigzags. It is determined by the
reference ship: the weaker the pull, the better the zigzags and the wider the circle.
The rule that chooses the pull gives up a quarter of the zigzags' accuracy for it; that
quarter is a judgement, not a measurement.

![MARIN's zigzags and circles](images/real_ships_b.svg)
"""
