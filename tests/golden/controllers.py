"""Golden section `controllers`: designs of every kind, and their commands over fixed series of observations.

Each kind is designed twice: as it is for one ship, and with settings that are not the
defaults for another. The series of observations is no voyage: smooth, of all sizes from
small motions to those beyond the limits, with jumps of the course, and different for
each ship. Guidance is also shown paths of two tasks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import astuple, replace
from typing import Any

import numpy as np

from agents import LQ, PID
from agents.controllers import guided, kalman, linear_loop, turn_rate, wheel_over
from agents.controllers.controller_file import read_controller
from agents.controllers.law import Turns, gathered
from agents.controllers.memory import from_columns, on_course
from agents.controllers.registry import controller_class
from agents.controllers.robustness import margin_uncertainty
from shipgym import ShipModel, load_model
from shipgym.ships.conversions import nomoto2_ship
from shipgym.ships.linear import nomoto
from shipgym.tasks.task import Task, path_following_task
from tests.golden.store import Floats, numbers_in, vector

STEPS, SHIPS = 48, 3
TOLERANCES = {"": 1e-6}
AGAIN = 20  # step at which an episode begins anew for one of the ships
#: Size of what is observed beside the heading error, over its scale, by name.
SIZES = {
    "yaw_rate": 0.3,
    "sway": 0.15,
    "rudder": 0.6,
    "last_command": 0.5,
    "heading_error_integral": 0.7,
    "cross_track": 1.3,
    "turn_angle": 0.7,
    "next_turn_angle": 0.6,
    "second_turn_angle": 0.4,
}
LINEAR = {
    "dt": 0.8,
    "integral_lengths": 13.0,
    "rudder_weight": 0.23,
    "rate_weight_s2": 17.0,
}
PATHS: dict[str, Callable[[], Task]] = {
    "narrow": lambda: path_following_task(noise=0.7, lookahead=2.3, corridor=0.8),
    "travel": lambda: path_following_task(rudder_travel_weight=0.03),
}
SETTINGS: dict[str, dict[str, Any]] = {
    "pid": {"dt": 1.3, "frequency": 0.043, "damping": 0.77, "integral_lengths": 13.0},
    "lq": LINEAR,
    "lqg": {
        **LINEAR,
        "noise": 1.7,
        "disturbance_deg": 1.3,
        "wave_period": 9.1,
        "wave_heading_deg": 0.7,
    },
    "turn-rate": {"dt": 1.7, "frequency": 0.031, "rate_deg_min": 23.0},
    "los": {"lookahead_lengths": 1.7, "integral_lengths": 11.0},
    "ilos": {"lookahead_lengths": 2.7},
    "alos": {"integral_lengths": 9.0},
    "wheel-over": {
        "lookahead_lengths": 1.7,
        "reach_lengths": 1.3,
        "crab_share": 0.7,
    },
    "mpc": {
        "horizon_lengths": 2.3,
        "deviation_deg": 4.0,
        "reach_lengths": 1.1,
    },
}
GUIDES = ("los", "ilos", "alos", "wheel-over", "mpc")
SHIP_OF = {"lqg": "mariner-tls-svm"}
OTHERS = (
    "steering",
    "kvlcc2",
    "container",
    "second order",
    "functions",
)


def cases() -> list[str]:
    """Kinds of controllers as they are and with other settings, and what belongs to none of them."""
    return [*SETTINGS, *(f"{kind} set" for kind in SETTINGS), *OTHERS]


def record(case: str) -> dict[str, Floats]:
    """The values of a case."""
    if case in OTHERS:
        return globals()[f"record_{case.replace(' ', '_')}"]()
    kind, _, settings = case.partition(" ")
    if kind in GUIDES:
        return of_guide(kind, SETTINGS[kind] if settings else {})
    model = load_model(SHIP_OF.get(kind, "mariner") if settings else "mariner")
    return of_controller(
        controller_class(kind).from_model(model, **(SETTINGS[kind] if settings else {}))
    )


def of_guide(kind: str, settings: dict[str, Any]) -> dict[str, Floats]:
    """A guidance law over LQ, with settings over PID if it leads any, on the paths of two tasks."""
    model, found = load_model("mariner"), {}
    for name, path in PATHS.items():
        more: dict[str, Any] = {"task": path(), **settings}
        if settings and kind != "mpc":
            more["autopilot"] = PID.from_model(model, dt=more["task"].interval(model))
        elif kind == "mpc":
            more = {"horizon_lengths": 1.5, **more}
        made = controller_class(kind).from_model(model, **more)
        found |= {
            f"{name} {one}": values for one, values in of_controller(made).items()
        }
    return found


def of_controller(made: Any) -> dict[str, Floats]:
    """What its file says, what it commands to ships side by side and to one, and what it remembers."""
    again = read_controller(made.to_dict(), "file")
    found = numbers_in(again.to_dict(), left_out=("ship",))
    found |= {
        "loop": np.concatenate([vector(one) for one in vars(made.loop()).values()])
    }
    # a search among plans has to tell them apart
    shown = series(made.observation_names, largest=0.13 if made.kind == "mpc" else 0.9)
    state, alone, actions, own = None, None, [], []
    for step, seen in enumerate(shown):
        begins = (
            np.arange(SHIPS) == 1 if step == AGAIN else np.zeros(SHIPS, dtype=np.bool_)
        )
        action, state = again.predict(seen, state, begins)
        actions.append(action[:, 0])
        if step < 5:
            action, alone = again.predict(seen[2], alone)
            own.append(action)
    orders, _ = orders_of(made, shown[:12])
    return found | {"commands": vector(actions), "alone": vector(own), "orders": orders}


def orders_of(made: Any, shown: Floats) -> tuple[Floats, Any]:
    """Orders before they are limited, rad, of what is no guidance."""
    if hasattr(made, "autopilot"):
        return vector(0.0), None
    nothing = np.zeros((made.memory_size, SHIPS))
    memory, orders = from_columns(made.memory_record, iter(nothing)), []
    for step, rows in enumerate(shown):
        seen = made.signals(rows)
        if made.kind == "turn-rate" and step % 3 == 0:
            seen = seen._replace(rate_of_turn=np.array([0.0, 0.004, -0.007]))
        order, memory = made.steer(seen, memory)
        orders.append(order)
    return vector(orders), memory


def flattened(state: Any) -> list[Any]:
    """Arrays of nested tuples."""
    if isinstance(state, tuple):
        return [array for part in state for array in flattened(part)]
    return [] if state is None else [state]


def series(names: tuple[str, ...], steps: int = STEPS, largest: float = 0.9) -> Floats:
    """Observations by the names, of shape (steps, SHIPS, n): smooth, with two jumps of the course.

    `largest`: of motions, of the last ship; with 0.9 she is beyond the limits.
    """
    at, ship = np.arange(steps)[:, None], np.arange(SHIPS)
    size = np.array([0.01, min(0.25, 0.4 * largest), largest])  # of motions, by ship
    error = (
        1.6 * size * np.sin(0.13 * at + ship)
        + np.where(at > 30, 0.7 * size, 0.0)
        - 0.4 * (at > 40) * size
    )
    rows = []
    for k, name in enumerate(names):
        if name.startswith(("heading_error_s", "course_error_s")):
            rows.append(np.sin(error + 0.05 * (name[0] == "c")))
        elif name.endswith("_cos"):
            rows.append(np.cos(error + 0.05 * (name[0] == "c")))
        elif name == "surge":
            rows.append(0.9 + 0.2 * np.sin(0.1 * at + 2.0 * ship))
        elif name.endswith("distance"):
            rows.append(
                0.45
                - 0.4 * np.sin(0.12 * at + ship)
                + (0.5 if name.startswith("second") else 0.0)
            )
        else:
            rows.append(
                SIZES[name]
                * np.minimum(size * 1.5, 1.0)
                * np.sin((0.17 + 0.02 * k) * at + k + ship)
            )
    return np.stack(rows, axis=-1)


def rates(made: Any, models: list[ShipModel]) -> dict[str, Floats]:
    """Margins of a controller on ships."""
    found = margin_uncertainty(made, models)
    return {
        "nominal": vector(astuple(found.nominal)),
        "stable": vector(found.stable),
        **found.by_name,
        **{f"quantiles {name}": values for name, values in found.quantiles().items()},
    }


def record_steering() -> dict[str, Floats]:
    """Margins of PID and LQ on ships that differ from what they were designed on."""
    found: dict[str, Floats] = {}
    model = load_model("mariner-tls-svm")
    ships = [
        replace(
            model,
            coefficients={
                **model.coefficients,
                "N_d": share * model.coefficients["N_d"],
            },
        )
        for share in (0.7, 1.0, 1.45, -1.0)
    ]
    for made in (PID.from_model(model), LQ.from_model(model, **LINEAR)):
        found |= {
            f"{made.kind} {name}": values for name, values in rates(made, ships).items()
        }
    return found


def under(model: ShipModel, *kinds: str) -> dict[str, Floats]:
    """A ship under controllers of some kinds."""
    return {
        f"{kind} {name}": values
        for kind in kinds
        for name, values in of_controller(
            controller_class(kind).from_model(model)
        ).items()
    }


def record_kvlcc2() -> dict[str, Floats]:
    """A ship that is hardly stable on her course, with a shaft."""
    return under(load_model("kvlcc2"), "pid", "turn-rate")


def record_container() -> dict[str, Floats]:
    """A ship that rolls."""
    return under(load_model("container"), "lq", "lqg", "pid")


def record_second_order() -> dict[str, Floats]:
    """Ships whose yaw has a memory, or is of first order."""
    ship = load_model("mariner")
    model = nomoto2_ship(nomoto(ship), ship.particulars, ship.steering)
    return under(model, "lq", "pid")


def record_functions() -> dict[str, Floats]:
    """Functions that designs are made of, at numbers that no design has."""
    model, dt = load_model("mariner"), 1.3
    A, B = linear_loop.sampled(
        np.array([[-0.02, -3.1, 0.9], [-0.001, -0.05, 0.003]]), 0.0, dt
    )
    ship = linear_loop.sample_ship(model, dt, first_order=True)
    motion, drive = kalman.wave_model(9.3, 0.013, dt)
    gain, deviations = kalman.kalman_gain(
        0.9 * motion, 2.0 * drive, np.eye(2)[:1], np.array([[1e-4]])
    )
    reach = on_course(
        np.zeros((2, 9)), np.array([0.3, -2.0]), np.array([1.7, -0.9]), 7.0
    )
    return {
        "sampled": np.concatenate([vector(A), vector(B)]),
        "first order": np.concatenate(
            [vector(ship.A), vector(ship.B), vector(astuple(ship.about))]
        ),
        "wave motion": vector(motion),
        "wave drive": vector(drive),
        "kalman": vector(gain),
        "innovations": vector(deviations),
        "on course": vector(reach),
        "gathered": gathered(
            np.array([0.1, 5.0, -5.0, 2.0]),
            np.array([0.05, 0.09, -0.02, 0.4]),
            np.ones(4),
            3.0,
            5.1,
        ),
        "begun": vector(gathered(0.4, 0.07, 0.0, 3.0, 5.1)),
        "bend": guided.bend(
            700.0,
            Turns(
                np.array([100.0, 600.0, 650.0]),
                np.array([0.7, -0.4, 0.0]),
                np.array([500.0, 690.0, 900.0]),
                np.array([-0.3, 0.9, 0.2]),
            ),
            400.0,
        ),
        "own lead": vector(
            [
                wheel_over.own_lead(model, one)
                for one in (None, LQ.from_model(model, **LINEAR))
            ]
        ),
        "steady turns": vector([*turn_rate.steady_turns(model, 0.01)]),
        "rate weight": vector([linear_loop.rate_weight(model), model.travel_time]),
    }
