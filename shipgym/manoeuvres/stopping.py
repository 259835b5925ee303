"""Stopping (IMO MSC/Circ.1053, ITTC 7.5-04-02-01)."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_number
from shipgym.errors import InputError, ManoeuvreError
from shipgym.manoeuvres.execution import distance_sailed, require, ship_length
from shipgym.manoeuvres.registry import Manoeuvre
from shipgym.models import ShipModel
from shipgym.models.by_name import takes_name
from shipgym.models.simulate import Passage, as_trial, orders
from shipgym.ships import ShipEquations
from shipgym.trials.navigation import rotate_to_body
from shipgym.trials.trial import Trial


@dataclass(frozen=True)
class StoppingIndices:
    """Indices of a stopping trial."""

    # distance sailed along the track until the speed is reached, ship lengths: the
    # stopping distance
    track_reach_lengths: float
    # the same along and across the heading at the order, ship lengths; to starboard
    # positive
    head_reach_lengths: float
    side_reach_lengths: float
    heading_change_deg: float  # degrees, positive to starboard
    time_s: float  # s


def stopping(
    model: ShipModel,
    shaft_speed: float = 0.0,
    speed_ratio: float = 0.1,
    water_depth: float = np.inf,
) -> Trial:
    """Simulate a stop from service speed, rudder amidships, until the ship is slow.

    A shaft ordered astern needs equations that hold there: of the reference ships only
    those of `tanker` do. The propellers of `container` and `kvlcc2` are open-water
    curves of a shaft turning ahead; with the shaft stopped they are used beyond the
    advance ratios they were measured at, where the container ship's has no drag and
    KVLCC2's that of a propeller dragged along.

    The shaft is ordered to `shaft_speed`, 1/s, 0 for stopped, negative for astern. The
    trial ends at `speed_ratio` of the surge speed at service, 0 for dead in the water,
    which only a shaft astern brings about. Samples are a fortieth of the time to
    travel one ship length apart; the water depth is in m.

    Raises InputError for a ship whose propeller is not in its equations, an order
    astern where they do not hold, an order that does not slow the ship down, or dead in
    the water without an order astern; ManoeuvreError, with the trial so far, if the
    ship is still faster after 300 times the time to travel one ship length;
    UnstableModelError if the ship runs away.
    """
    order = stopping_order(model, shaft_speed, speed_ratio)
    n_steps = 40  # of a ship length
    step = model.travel_time / n_steps
    target = speed_ratio * model.particulars["speed"]

    passage = Passage(model, step, water_depth)
    held = np.tile([0.0, order], (n_steps, 1))
    column = model.state_names.index("u")
    states = passage.states(model.service_state, 0)
    is_slow = False
    longest = 300  # of a stopping trial, L / U0
    while not is_slow and len(states) <= longest * n_steps:
        sailed = step * (len(states) - 1)
        length = passage.states(states[-1], n_steps)
        passage.run("simulate", length, held, step, since=sailed)
        slow = length[1:, column] <= target
        is_slow = bool(slow.any())
        last = slow.argmax() + 2 if is_slow else n_steps + 1
        states = np.concatenate([states, length[1:last]])

    rudder = np.zeros(len(states))
    shaft = np.full(len(states), order)
    commands = orders(model, rudder, shaft)
    trial = as_trial(model, step, states, commands, "straight")
    if is_slow:
        return trial
    raise ManoeuvreError(
        f"stopping of {model.name!r}: expected a surge speed of {target:.3g} m/s, got"
        f" {trial['u'][-1]:.3g} m/s after {trial.duration:.0f} s; order the shaft to"
        " less, or stop at a larger speed_ratio",
        trial,
    )


def stopping_order(model: ShipModel, shaft_speed: float, speed_ratio: float) -> float:
    """The order for the shaft, 1/s, after checking it and the ratio of speeds."""
    service = shaft_of(model)
    least = -1.5 * service if goes_astern(model) else 0.0
    hint = "less than at service speed, and astern only where her equations hold there"
    order = check_number(
        shaft_speed, "shaft_speed", at_least=least, below=service, hint=hint
    )
    check_number(speed_ratio, "speed_ratio", at_least=0.0, below=1.0)
    return order


def shaft_of(model: ShipModel) -> float:
    """Shaft speed at service speed, 1/s; InputError for a ship without a shaft."""
    if "n" not in model.command_names:
        raise InputError(
            f"model {model.name!r}: expected one that is ordered a shaft speed, got"
            f" the commands {', '.join(model.command_names)}; its thrust is inside its"
            " surge coefficients: use a ship with a propeller, such as 'container' or"
            " 'tanker'"
        )
    return model.service_shaft_speed


def goes_astern(model: ShipModel) -> bool:
    """Return whether the equations of a ship hold for a shaft that turns astern."""
    return isinstance(model.dynamics, ShipEquations) and model.dynamics.astern


@takes_name
def crash_stop(model: ShipModel, water_depth: float = np.inf) -> Trial:
    """Full astern stopping test: the shaft astern as fast as ahead, until at rest.

    InputError for a ship whose equations do not hold astern; `water_depth` as in
    `zigzag`.
    """
    return stopping(model, -shaft_of(model), speed_ratio=0.0, water_depth=water_depth)


def stopping_indices(trial: Trial) -> StoppingIndices:
    """Stopping distance of a trial, from the order at its first sample to its end.

    The trial has u, v, x, y and psi, and the ship's length. Raises InputError if a
    channel or the length is missing.
    """
    require(trial, ("u", "v", "x", "y", "psi"), "a stopping trial")
    lpp = ship_length(trial)
    psi = trial["psi"]

    def change(values: Floats) -> float:
        return float(values[-1] - values[0])

    north = change(trial["x"])
    east = change(trial["y"])
    ahead, aside = rotate_to_body(north, east, psi[0])
    return StoppingIndices(
        track_reach_lengths=change(distance_sailed(trial)) / lpp,
        head_reach_lengths=float(ahead) / lpp,
        side_reach_lengths=float(aside) / lpp,
        heading_change_deg=float(np.degrees(change(psi))),
        time_s=trial.duration,
    )


def standard_stops(
    model: ShipModel, water_depth: float = np.inf
) -> dict[str, Manoeuvre]:
    """Inertia stop and, if the shaft reverses, crash stop."""
    if "n" not in model.command_names:
        return {}
    found = {
        "inertia stop": Manoeuvre(
            partial(stopping, water_depth=water_depth),
            stopping_indices,
            StoppingIndices,
            "The shaft stopped at service speed, the rudder amidships, until a tenth of"
            " it is left.",
        )
    }
    if goes_astern(model):
        found["crash stop"] = Manoeuvre(
            partial(crash_stop, water_depth=water_depth),
            stopping_indices,
            StoppingIndices,
            "The shaft ordered full astern at service speed, the rudder amidships,"
            " until dead in the water.",
        )
    return found
