"""MARIN's free-running KVLCC2: what was measured, her scale, and how it is drawn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from identification.samples.prediction import predict
from real_ships.data import MeasuredShip
from real_ships.section import headings, number
from shipgym.models import ShipModel, converted_model
from shipgym.ships import GreyBox
from shipgym.trials.trial import Trial

SHIP = "kvlcc2_marin"
#: Advance and tactical diameter to starboard, ship lengths: measured, printed in Mei
#: 2019.
MEASURED = (3.25, 3.34)
TURNS = ("advance +35", "diameter +35", "advance -35", "diameter -35")
MEASURED_ROW = [
    "measured (Mei 2019)",
    *(number(value, 2) for value in MEASURED),
    "-",
    "-",
]


def full_scale(model: ShipModel, marin: MeasuredShip) -> ShipModel:
    """The model at MARIN's length, speed and shaft speed at the start of its runs.

    The tanks ran different propellers: shaft speeds are told by each one's at service
    speed.
    """
    ship = marin.particulars
    travel = ship["length"] / ship["speed"]
    gear = marin.steering or replace(
        model.steering,
        rudder_rate_deg_s=model.steering.rudder_rate_deg_s * model.travel_time / travel,
        time_constant=model.steering.time_constant * travel / model.travel_time,
    )
    shaft = float(np.mean([trial["n"][0] for trial in marin.runs.values()]))
    box = model.dynamics
    # of a bare reference at another scale the reference itself
    own: Any = box.ship if isinstance(box, GreyBox) else model
    return converted_model(own, ship, gear, shaft)


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
