"""A measured zigzag sailed again, the rudder reversed at the measured headings.

Open loop, a tenth of a degree of neutral helm moves the second overshoot of a 10/10
zigzag by two degrees, because the rudder is reversed when the measured ship got there,
not the simulated one.
"""

from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from identification.samples.prediction import with_start
from shipgym import ShipModel, Trial, UnstableModelError
from shipgym.arrays import Floats
from shipgym.manoeuvres.execution import reversals, rudder
from shipgym.models.simulate import Passage, checked_orders
from shipgym.ships.manoeuvring_model import two_commands


class ZigzagLeg(NamedTuple):
    """Part of a zigzag between two reversals of the rudder."""

    order: float | None  # rudder angle, rad; None: as measured
    duration: float  # s, as measured
    # the heading at which it ends, rad; None where it ends by the clock
    target: float | None


def closed_loop(model: ShipModel, trial: Trial) -> Trial | None:
    """A zigzag with the measured rudder angles, reversed at the measured headings.

    The model's gear moves the rudder. None where the model runs away or a heading is
    never reached, without a reversal, and for a model whose state is not recorded.
    """
    names = model.state_names
    if not {*trial.channels, "x", "y"}.issuperset(names):
        return None
    begun = with_start(model, trial)
    start = [begun[name][0] if name in begun else 0.0 for name in names]
    passage = Passage(model, 0.02 * model.travel_time)
    times, states, orders = [trial.t[:1]], [np.array([start])], [np.zeros(0)]
    try:
        for leg in legs(trial):
            sailed = _sail(
                passage,
                trial,
                leg,
                times[-1][-1],
                states[-1][-1],
            )
            if sailed is None:
                return None
            for parts, own in zip((times, states, orders), sailed, strict=True):
                parts.append(own)
    except UnstableModelError:
        return None
    ordered = np.concatenate(orders)
    channels = dict(zip(names, np.vstack(states).T, strict=True))
    channels["delta_command"] = np.append(ordered, ordered[-1])
    return Trial(
        np.concatenate(times),
        channels,
        name=trial.name,
        kind=trial.kind,
        length=model.particulars["length"],
    )


@lru_cache(maxsize=16)  # every model drawn sails the same trials
def legs(trial: Trial) -> tuple[ZigzagLeg, ...]:
    """Legs of a measured zigzag; the approach and the last one end by the clock."""
    start, turns = reversals(trial)
    t, delta = trial.t, rudder(trial)
    edges = [float(t[0]), start, *turns, float(t[-1])]
    found = list[ZigzagLeg]()
    for number, (begin, end) in enumerate(pairwise(edges)):
        held = (t >= 0.25 * begin + 0.75 * end) & (t <= end)
        if end <= begin or not held.any():
            continue
        target = None
        if 1 <= number <= len(turns):
            target = float(np.interp(end, t, trial["psi"]))
        is_approach = not found and target is None
        order = None if is_approach else float(np.median(delta[held]))
        found.append(ZigzagLeg(order, end - begin, target))
    return tuple(found)


def _sail(
    passage: Passage, trial: Trial, leg: ZigzagLeg, begin: float, state: Floats
) -> tuple[Floats, Floats, Floats] | None:
    """Times, states and orders of a leg after its first sample.

    None where its target is not reached in twice the measured time.
    """
    model, dt = passage.model, passage.dt
    longest = leg.duration * (1.0 if leg.target is None else 2.0)
    n_steps = max(int(np.ceil(longest / dt)), 2)
    t = begin + dt * np.arange(
        n_steps + 1,
        dtype=float,
    )
    commands = np.tile(model.service_command, (n_steps, 1))
    commands[:, 0] = leg.order
    if leg.order is None:
        commands[:, 0] = np.interp(
            t[:-1],
            trial.t,
            rudder(trial),
        )
    if "n" in model.command_names and "n" in trial:
        commands[:, 1] = np.interp(t[:-1], trial.t, trial["n"])
    states = passage.states(state, n_steps)
    orders = two_commands(checked_orders(model, commands))
    passage.run(
        "simulate",
        states,
        orders,
        dt,
    )

    last = n_steps
    if leg.target is not None:
        left = leg.target - states[:, model.state_names.index("psi")]
        last = int(np.argmax(left * np.sign(left[0]) <= 0.0))
        if last == 0:
            return None
        # a step is a fiftieth of a length: between two the state is straight enough
        part = float(left[last - 1] / (left[last - 1] - left[last]))
        t[last] = t[last - 1] + part * dt
        states[last] = (1.0 - part) * states[last - 1] + part * states[last]
    sailed = slice(1, last + 1)
    return t[sailed], states[sailed], commands[:last, 0]
