"""The bare physics of ships, without tasks and environments."""

from __future__ import annotations

import numpy as np

import shipgym
from shipgym.engine.loops import ship_loop
from shipgym.engine.records import LANES
from speed.measure import MODEL, SHORT_REPEATS, SHORT_STEPS, Row, best_time
from speed.numpy_ships import numpy_step

#: Ships whose bare physics is timed, and the aim for them.
FLEET = {
    "mariner": "40 M steps/s, ",
    MODEL: "40 M steps/s, ",
    "container": "15 M steps/s, ",
    "tanker": "",
    "kvlcc2": "",
}


def batched_physics(name: str, n_ships: int, aim: str) -> Row:
    """Runge-Kutta steps of the bare ship, one core, against NumPy arrays."""
    model = shipgym.load_model(name)
    random = np.random.default_rng(0)
    rudders = np.radians(30.0) * random.uniform(-1.0, 1.0, n_ships)
    states = np.repeat(model.service_state[None], n_ships, axis=0)
    commands = np.column_stack([rudders, np.full(n_ships, model.service_shaft_speed)])
    tiles, ships = n_ships // LANES, model.ship_numbers()[None]
    tiled, orders = (
        np.ascontiguousarray(a.reshape(tiles, LANES, -1).transpose(0, 2, 1)).reshape(
            tiles, -1
        )
        for a in (states, commands)
    )
    h, steps = (
        0.01 * model.particulars["length"] / model.particulars["speed"],
        SHORT_STEPS // n_ships,
    )
    advance, on_arrays = ship_loop(model.compiled, "shared_ship"), numpy_step(model)
    columns, shafts = (
        tuple(np.ascontiguousarray(states.T)),
        np.ascontiguousarray(commands[:, 1]),
    )
    compiled = (
        steps
        * n_ships
        / best_time(lambda: advance(tiled, orders, h, steps, ships), SHORT_REPEATS)
    )
    plain = n_ships / best_time(
        lambda: on_arrays(columns, rudders, shafts, h), SHORT_REPEATS
    )
    return Row(
        f"physics of {n_ships} ships, {name}",
        f"{compiled / 1e6:.1f} M steps/s",
        f"NumPy {plain / 1e6:.2f} M steps/s",
        compiled / plain,
        f"{aim}10 times",
    )


def zigzag_run() -> Row:
    """A 20/20 zigzag of 600 s at 0.1 s, the Trial included."""
    ship = shipgym.load_model(MODEL)
    shipgym.manoeuvres.zigzag(ship, 20.0, 20.0)
    seconds = best_time(lambda: shipgym.manoeuvres.zigzag(ship, 20.0, 20.0), 20)
    return Row(
        "zigzag 20/20, 600 s at 0.1 s", f"{1e3 * seconds:.1f} ms", "", None, "5 ms"
    )
