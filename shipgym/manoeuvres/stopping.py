"""Stopping (IMO MSC/Circ.1053, ITTC 7.5-04-02-01)."""

from dataclasses import dataclass

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError, ManoeuvreError
from shipgym.manoeuvres.execution import distance_sailed, ship_length
from shipgym.manoeuvres.registry import Manoeuvre
from shipgym.models import ShipModel
from shipgym.models.by_name import takes_name
from shipgym.models.simulate import simulate
from shipgym.ships import ShipEquations
from shipgym.trials.navigation import rotate_to_body
from shipgym.trials.trial import Trial


@dataclass(frozen=True)
class StoppingIndices:
    """Indices of a stopping trial."""

    # distance sailed along the track until at rest, ship lengths: the stopping distance
    track_reach_lengths: float
    # the same along and across the heading at the order, ship lengths; to starboard
    # positive
    head_reach_lengths: float
    side_reach_lengths: float
    heading_change_deg: float  # degrees, positive to starboard
    time_s: float  # s


def goes_astern(model: ShipModel) -> bool:
    """Return whether the equations of a ship hold for a shaft that turns astern."""
    return isinstance(model.dynamics, ShipEquations) and model.dynamics.astern


@takes_name
def crash_stop(model: ShipModel, water_depth: float = np.inf) -> Trial:
    """Full astern stopping test: the shaft astern as fast as ahead, until at rest.

    From service speed, rudder amidships. Of the reference ships only `tanker` has
    equations that hold for a shaft astern. Samples are a fortieth of the time to travel
    one ship length apart; `water_depth` as in `zigzag`.

    Raises InputError for a ship whose equations do not hold astern; ManoeuvreError,
    with the trial so far, if the ship is not at rest after 300 times the time to travel
    one ship length; UnstableModelError if the ship runs away.
    """
    if not goes_astern(model):
        raise InputError(
            f"model {model.name!r}: expected equations that hold for a shaft astern,"
            " got others; use a ship such as 'tanker'"
        )
    step = model.travel_time / 40
    order = [0.0, -model.service_shaft_speed]
    for lengths in (30, 300):  # what she does astern after a short stop is not asked
        orders = np.tile(order, (lengths * 40, 1))
        trial = simulate(model, orders, step, water_depth=water_depth)
        at_rest = np.flatnonzero(trial["u"] <= 0.0)
        if at_rest.size:
            break
    else:
        raise ManoeuvreError(
            f"crash stop of {model.name!r}: expected a ship at rest, got"
            f" {trial['u'][-1]:.3g} m/s after {trial.duration:.0f} s",
            trial,
        )
    rows = slice(at_rest[0] + 1)
    return trial.part(rows).with_(kind="straight", length=trial.length)


def stopping_indices(trial: Trial) -> StoppingIndices:
    """Stopping distance of a trial, from the order at its first sample to its end.

    The trial has u, v, x, y and psi, and the ship's length. Raises InputError if a
    channel or the length is missing.
    """
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


def standard_stops(model: ShipModel) -> dict[str, Manoeuvre]:
    """The crash stop, if the shaft reverses."""
    if not goes_astern(model):
        return {}
    return {
        "crash stop": Manoeuvre(
            crash_stop,
            stopping_indices,
            StoppingIndices,
            "The shaft ordered full astern at service speed, the rudder amidships,"
            " until dead in the water.",
        )
    }
