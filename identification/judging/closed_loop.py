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
from shipgym.models.simulate import Conditions, Passage, checked_orders
from shipgym.ships.manoeuvring_model import ManoeuvringModel, two_commands


class ZigzagLeg(NamedTuple):
    """Part of a zigzag between two reversals of the rudder."""

    order: float  # rudder angle, rad
    duration: float  # s, as measured
    # the heading at which it ends, rad; None where it ends by the clock
    target: float | None
    approach: bool  # whether it is the first one, which may have any helm

    @property
    def longest(self) -> float:
        """Time after which its heading is taken never to be reached, s."""
        if self.target is None:
            return self.duration
        return 2.0 * self.duration


class _Sailed(NamedTuple):
    """Samples of a leg after its first one, or of all legs."""

    t: Floats  # s, shape (n_samples,)
    states: Floats  # shape (n_samples, n_columns)
    orders: Floats  # rudder angles ordered, rad, shape (n_samples,)


def closed_loop(model: ShipModel, trial: Trial) -> Trial | None:
    """A zigzag with the measured rudder angles, reversed at the measured headings.

    The model's gear moves the rudder. None where the model runs away or a heading is
    never reached, without a reversal, and for a model whose state is not recorded.
    """
    names = model.state_names
    recorded = {*trial.channels, "x", "y"}
    if not recorded.issuperset(names):
        return None
    try:
        sailed = _sail_legs(model, trial)
    except UnstableModelError:
        return None
    if sailed is None:
        return None

    channels = dict(zip(names, sailed.states.T, strict=True))
    channels["delta_command"] = sailed.orders
    return Trial(
        sailed.t,
        channels,
        name=trial.name,
        kind=trial.kind,
        length=model.particulars["length"],
    )


def _sail_legs(model: ShipModel, trial: Trial) -> _Sailed | None:
    """Sail all legs from the start of a trial; None where a target is not reached."""
    begun = with_start(model, trial)
    start = [begun[name][0] if name in begun else 0.0 for name in model.state_names]
    step = 0.02 * model.travel_time
    passage = Passage(model, Conditions(), step)
    times = [trial.t[:1]]
    states = [np.array([start])]
    orders = list[float]()
    for leg in legs(trial):
        begin = times[-1][-1]
        state = states[-1][-1]
        sailed = _sail(passage, trial, leg, begin, state)
        if sailed is None:
            return None
        times.append(sailed.t)
        states.append(sailed.states)
        orders.extend(sailed.orders)

    return _Sailed(
        t=np.concatenate(times),
        states=np.vstack(states),
        orders=np.array([*orders, orders[-1]]),
    )


@lru_cache(maxsize=16)  # every model drawn sails the same trials
def legs(trial: Trial) -> tuple[ZigzagLeg, ...]:
    """Legs of a measured zigzag; the approach and the last one end by the clock."""
    start, turns = reversals(trial)
    t, delta = trial.t, rudder(trial)
    edges = [float(t[0]), start, *turns, float(t[-1])]
    found = list[ZigzagLeg]()
    for number, (begin, end) in enumerate(pairwise(edges)):
        last_quarter = 0.25 * begin + 0.75 * end
        held = (t >= last_quarter) & (t <= end)
        if end <= begin or not held.any():
            continue

        target = None
        if 1 <= number <= len(turns):
            target = float(np.interp(end, t, trial["psi"]))
        leg = ZigzagLeg(
            order=float(np.median(delta[held])),
            duration=end - begin,
            target=target,
            approach=not found,
        )
        found.append(leg)
    return tuple(found)


def _sail(
    passage: Passage, trial: Trial, leg: ZigzagLeg, begin: float, state: Floats
) -> _Sailed | None:
    """Sail a leg from a time and a state; None where its target is not reached."""
    dt = passage.dt
    n_steps = max(int(np.ceil(leg.longest / dt)), 2)
    steps = np.arange(n_steps + 1, dtype=float)
    t = begin + dt * steps
    commands = _commands(passage.model, trial, leg, t[:-1])
    states = _simulated(passage, state, commands)

    last = n_steps
    if leg.target is not None:
        heading = passage.model.state_names.index("psi")
        psi = states[:, heading]
        last = _end_at(leg.target, psi, t, states)
        if last == 0:
            return None
    sailed = slice(1, last + 1)
    return _Sailed(
        t=t[sailed],
        states=states[sailed],
        orders=np.full(last, leg.order),
    )


def _simulated(passage: Passage, state: Floats, commands: Floats) -> Floats:
    """States from a first one on, a step for each row of commands."""
    orders = two_commands(checked_orders(passage.model, commands))
    states = passage.states(state, len(commands))
    passage.run("simulate", states, orders, passage.dt)
    return states


def _commands(
    model: ManoeuvringModel, trial: Trial, leg: ZigzagLeg, t: Floats
) -> Floats:
    """Rudder of the leg and shaft as measured, shape (n_steps, n_commands)."""
    ordered, shaft = 0, 1
    commands = np.tile(model.service_command, (len(t), 1))
    commands[:, ordered] = leg.order
    if leg.approach and leg.target is None:
        measured = rudder(trial)
        commands[:, ordered] = np.interp(t, trial.t, measured)
    if "n" in model.command_names and "n" in trial:
        commands[:, shaft] = np.interp(t, trial.t, trial["n"])
    return commands


def _end_at(target: float, psi: Floats, t: Floats, states: Floats) -> int:
    """Move the first sample beyond the target's heading onto it, and return its place.

    0 where the leg never gets there, and where the heading is passed already.
    """
    left = target - psi
    side = np.sign(left[0])
    beyond = left * side <= 0.0
    last = int(np.argmax(beyond))
    if last == 0:
        return 0

    # a step is a fiftieth of a length: between two the state is straight enough
    before = last - 1
    gained = psi[last] - psi[before]
    part = float(left[before] / gained)
    step = t[last] - t[before]
    t[last] = t[before] + part * step
    begin, end = states[before], states[last]
    states[last] = (1.0 - part) * begin + part * end
    return last
