"""The accelerations of a grey box as a source file: reference ship, table of terms, and their sum."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from shipgym.engine.generator import WITHOUT, accelerations_source
from shipgym.ships.term_table import Structure

if TYPE_CHECKING:
    from shipgym.ships.grey_box import GreyBox
    from shipgym.ships.ship_model import ShipModel

#: Names of a ship's file that the grey box has of its own.
OWN = r"\b(ROLL|SHAFT|LENGTH|COEFFICIENTS|accelerations|shaft_acceleration)\b"

SUM = """

# The sum: the reference ship at the converted state, its accelerations converted back, and the terms.

from math import inf

from .layout import LENGTH, SERVICE_SHAFT, SERVICE_SPEED

ROLL = {roll}
REFERENCE_LENGTH, REFERENCE_SPEED, REFERENCE_SHAFT = {length!r}, {speed!r}, {shaft!r}


@inlined
def accelerations(u, v, r, p, phi, delta, n, depth, ship, lane):
    fast = REFERENCE_SPEED / ship[SERVICE_SPEED + lane]
    quick = fast * ship[LENGTH + lane] / REFERENCE_LENGTH
    turns = {turns}
    surge, sway, yaw, roll = reference_accelerations(
        fast * u, fast * v, quick * r, quick * p, phi, delta, turns, inf, ship, lane
    )
    udot, vdot, rdot, pdot = correction(u, v, r, p, phi, delta, n, inf, ship, lane)
    linear, angular = 1.0 / (fast * quick), 1.0 / (quick * quick)
    return udot + linear * surge, vdot + linear * sway, rdot + angular * yaw, angular * roll
"""


def grey_box_source(box: GreyBox) -> str:
    """Source of `accelerations.py` for a grey box.

    The reference ship's own file comes first, its names marked as the reference's; then the table of terms,
    whose coefficients are read at run time; then the sum of both.
    """
    ship = box.ship
    table = accelerations_source(box)
    for equation, damping in WITHOUT.items():  # an equation without terms is the reference ship's alone
        table = table.replace(damping, f"    {equation}dot = 0.0\n")
    return (
        _reference_source(ship)
        + "\n\n"
        + table.replace("def accelerations(", "def correction(")
        + SUM.format(
            roll=box.rolls,
            length=ship.particulars["length"],
            speed=ship.particulars["speed"],
            shaft=float(ship.service_shaft_speed),
            turns="n * (REFERENCE_SHAFT / ship[SERVICE_SHAFT + lane])" if box.shaft else "REFERENCE_SHAFT",
        )
    )


def _reference_source(ship: ShipModel) -> str:
    """The file of the reference ship, with what it would read of a ship at run time written out."""
    text = ship.accelerations_source
    if isinstance(ship.dynamics, Structure):
        values = ship.dynamics.kernel_coefficients(
            ship.coefficients, ship.particulars, ship.service_shaft_speed
        ).tolist()
        text = re.sub(
            r"ship\[COEFFICIENTS \+ (\d+) \* LANES \+ lane\]", lambda m: f"({values[int(m[1])]!r})", text
        )
        for row, value in {
            "LENGTH": ship.particulars["length"],
            "SERVICE_SPEED": ship.particulars["speed"],
            "SERVICE_SHAFT": float(ship.service_shaft_speed),
        }.items():
            text = text.replace(f"ship[{row} + lane]", f"({value!r})")
        text = re.sub(r"from \.layout import .*\n", "", text)
    return re.sub(OWN, r"reference_\1", text)
