"""A measured zigzag sailed again by a model, its rudder reversed at the headings at which it was reversed.

Open loop, a tenth of a degree of neutral helm moves the second overshoot of a 10/10
zigzag by two degrees, because the rudder is reversed when the measured ship got there,
not the simulated one.
"""

from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from identification.validation.start import with_start
from shipgym import ShipModel, Trial, UnstableModelError
from shipgym.arrays import Floats
from shipgym.manoeuvres.execution import reversals, rudder
from shipgym.ships.orders import checked_orders, two_commands
from shipgym.ships.simulate import Conditions, Passage

STEP = 0.02  # of the time to sail one ship length
# times the measured one; a heading that is not reached by then is never reached
LONGEST_LEG = 2.0


def closed_loop(model: ShipModel, trial: Trial) -> Trial | None:
    """A zigzag with the measured rudder angles, reversed at the measured headings by the model's gear.

    None where the model runs away or a heading is never reached, without a reversal,
    and for a model whose state is not recorded.
    """
    if not set(model.state_names) <= {*trial.channels, "x", "y"}:
        return None
    begun, passage = (
        with_start(model, trial),
        Passage(model, Conditions(), STEP * model.travel_time),
    )
    state = np.array(
        [begun[c][0] if c in trial.channels else 0.0 for c in model.state_names]
    )
    t, states, orders = trial.t[:1], state[None], []
    for leg in _legs(trial):
        try:
            times, sailed = _sail(passage, trial, states[-1], leg, t[-1])
        except UnstableModelError:
            return None
        if not len(times):
            return None
        t, states = np.append(t, times), np.vstack([states, sailed])
        orders += [leg.order] * len(times)
    channels = dict(zip(model.state_names, states.T, strict=True))
    channels["delta_command"] = np.array([*orders, orders[-1]])
    return Trial(
        t,
        channels,
        name=trial.name,
        kind=trial.kind,
        length=model.particulars["length"],
    )


class Leg(NamedTuple):
    """What is held between two reversals of the rudder."""

    order: float  # rudder angle, rad
    duration: float  # s, as measured
    target: (
        float | None
    )  # the heading at which it ends, rad; None where it ends by the clock


@lru_cache(maxsize=16)  # every model drawn sails the same trials
def _legs(trial: Trial) -> tuple[Leg, ...]:
    start, turns = reversals(trial)
    delta, edges = rudder(trial), [float(trial.t[0]), start, *turns, float(trial.t[-1])]
    found = []
    for leg, (begin, end) in enumerate(pairwise(edges)):
        held = (trial.t >= 0.25 * begin + 0.75 * end) & (trial.t <= end)
        if end > begin and held.any():
            target = (
                float(np.interp(end, trial.t, trial["psi"]))
                if 1 <= leg <= len(turns)
                else None
            )
            found.append(Leg(float(np.median(delta[held])), end - begin, target))
    return tuple(found)


def _sail(
    passage: Passage, trial: Trial, state: Floats, leg: Leg, begin: float
) -> tuple[Floats, Floats]:
    """Times and states of a leg that begins at some time; none where its target is not reached."""
    model, dt, target = passage.model, passage.dt, leg.target
    count = max(
        int(np.ceil(leg.duration * (1.0 if target is None else LONGEST_LEG) / dt)), 2
    )
    t = begin + dt * np.arange(count + 1, dtype=float)
    commands = np.tile(model.service_command, (count, 1))
    approach = target is None and begin == trial.t[0]  # with whatever helm there was
    commands[:, 0] = (
        np.interp(t[:-1], trial.t, rudder(trial)) if approach else leg.order
    )
    if "n" in model.command_names and "n" in trial.channels:
        commands[:, 1] = np.interp(t[:-1], trial.t, trial["n"])
    sailed = passage.states(state, count)
    passage.run("simulate", sailed, two_commands(checked_orders(model, commands)), dt)
    if target is None:
        return t[1:], sailed[1:]
    psi = sailed[:, model.state_names.index("psi")]
    beyond = np.flatnonzero((psi - target) * np.sign(target - psi[0]) >= 0.0)
    if not len(beyond) or beyond[0] == 0:
        return np.empty(0), sailed[:0]
    k = int(
        beyond[0]
        # the state between two steps is straight enough: a step is a fiftieth of a
        # length
    )
    part = float((target - psi[k - 1]) / (psi[k] - psi[k - 1]))
    t[k], sailed[k] = (
        t[k - 1] + part * dt,
        (1.0 - part) * sailed[k - 1] + part * sailed[k],
    )
    return t[1 : k + 1], sailed[1 : k + 1]
