"""The container ship of section 7.4, integrated accurately and as its source does.

The MSS toolbox, from which the thesis has its ship, integrates by Euler's rule at the
step of its samples (`zigzag`); so do the trials `by_euler`. The trials are those of
Table 7.4.1: 900 s from 8 m/s and 80 rpm, sampled at 0.5 s. The shaft orders of the
straight lines are not printed beyond their range.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from papers.row import sampled
from shipgym.manoeuvres import zigzag
from shipgym.models import ShipModel
from shipgym.models.catalogue import container
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]

SPEED, SHAFT_RPM = 8.0, 80.0
DURATION, STEP, INTERVAL = 900.0, 0.1, 0.5  # of the simulation and of the samples, s
RPM = 1.0 / 60.0
#: Shaft orders of the straight lines, rpm, each held for 150 s: a stand-in within the
#: printed ranges.
ORDERS = {
    "learned": (120, 160, 140, 130, 150, 120),
    "verified": (100, 160, 120, 140, 110, 150),
}


@cache
def ship() -> ShipModel:
    """The container ship at the thesis' speed."""
    reference = container()
    return replace(
        reference,
        particulars=replace(reference.particulars, speed=SPEED),
        steering=replace(reference.steering, rudder_limit_deg=35.0),
    )


@cache
def zigzag_trial(angle_deg: float, by_euler: bool = False) -> Trial:
    """A zigzag as sampled, of the ship integrated accurately or by Euler's rule."""
    name = f"zigzag {angle_deg:g}/{angle_deg:g}"
    model = ship()
    if by_euler:
        helm = Helm(np.radians(angle_deg), model)
        return euler_trial(model, helm.order, name, "zigzag")

    trial = zigzag(
        model, angle_deg, angle_deg, duration=DURATION, dt=STEP, switch="step"
    )
    return sampled(trial, round(INTERVAL / STEP), name, trial.channels)


@cache
def straight_line(use: str, by_euler: bool = False) -> Trial:
    """A straight line with varying shaft orders as sampled; `learned` or `verified`."""
    orders = np.array(ORDERS[use]) * RPM
    step = INTERVAL if by_euler else STEP
    shaft = np.repeat(orders, round(DURATION / len(orders) / step))
    name = f"straight line {use}"
    if by_euler:
        held = [*shaft, shaft[-1]]
        return euler_trial(ship(), lambda k, _: np.array([0.0, held[k]]), name)

    commands = np.column_stack([np.zeros_like(shaft), shaft])
    run = ship().simulate(commands, STEP)
    return sampled(run, round(INTERVAL / STEP), name, run.channels)


class Helm:
    """Order of a zigzag, reversed at the first sample beyond the heading."""

    def __init__(self, angle: float, model: ShipModel) -> None:
        self.angle = angle
        self.rudder = angle
        self.shaft = model.service_shaft_speed
        self.heading = model.state_names.index("psi")

    def order(self, _: int, state: Floats) -> Floats:
        """Rudder and shaft ordered in a state."""
        if np.sign(self.rudder) * state[self.heading] >= self.angle:
            self.rudder = -self.rudder
        return np.array([self.rudder, self.shaft])


def euler_trial(
    model: ShipModel,
    order: Callable[[int, Floats], Floats],
    name: str,
    kind: str | None = None,
) -> Trial:
    """Sail a ship by Euler's rule at the interval of the samples."""
    count = round(DURATION / INTERVAL) + 1
    states = np.empty((count, len(model.state_names)))
    commands = np.empty((count, len(model.command_names)))
    state = model.service_state.copy()
    for k in range(count):
        states[k] = state
        commands[k] = order(k, state)
        state = state + INTERVAL * model.derivatives(state, commands[k])

    channels = dict(zip(model.state_names, states.T, strict=True))
    channels["delta_command"] = commands[:, 0]
    channels["n_command"] = commands[:, 1]
    return Trial(
        np.arange(count) * INTERVAL,
        channels,
        name=name,
        kind=kind,
        length=model.particulars["length"],
    )
