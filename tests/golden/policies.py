"""Golden sections `policies` and `bridge`: what steers on board, over fixed observations and readings.

`policies` has networks with weights at random in every option. `bridge` has autopilots as they stand on a bridge, the helm, routes, and
a simulated ship's instruments.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from agents import LQ, PID
from agents.controllers.registry import controller_class
from agents.deployment.autopilot import Autopilot, observation_bounds
from agents.deployment.helm import Helm
from agents.deployment.nmea import NmeaReading, readings, sentences
from agents.deployment.route import Route
from agents.deployment.sensors import HelmSensors, Limits
from agents.deployment.simulated import SimulatedShip
from agents.policies.policy import LearnedPolicy, order_numbers, toward
from shipgym import load_model
from shipgym.tasks.task import Task
from tests.agents.policies import MARINER, random_network, random_policy
from tests.golden.controllers import SHIPS, flattened, series
from tests.golden.store import Floats, numbers_in, vector

#: Networks compute in single precision.
TOLERANCES = {"": 1e-5}
POLICIES: dict[str, Callable[[], Any]] = {
    "plain": random_policy,
    "tanh": lambda: random_policy(
        network=random_network(8, 16, 1, activation="tanh", output="tanh")
    ),
    "discrete": lambda: random_policy(action="rudder-discrete", frame_stack=2),
    "shaft": lambda: random_policy(
        action="rudder-shaft", rate_limit=0.13, action_repeat=2
    ),
    "frames": lambda: random_policy(frame_stack=3, seed=4),
    "residual": lambda: random_policy(
        base=LQ.from_model(MARINER), authority=0.37, frame_stack=2, seed=1
    ),
    "slow": lambda: random_policy(
        base=PID.from_model(MARINER), authority=0.8, action_repeat=3, rate_limit=0.07
    ),
    "wheel-over": lambda: path_policy(action_repeat=2, authority=0.6),
}


def path_policy(**more: Any) -> LearnedPolicy:
    """One that adds to wheel-over on paths."""
    task = Task.of("PathFollowing")
    shown = task.observed(MARINER)
    base = controller_class("wheel-over").from_model(MARINER, task=task)  # type: ignore[attr-defined]
    return LearnedPolicy(
        random_network(len(shown) + 1, 16, 1, seed=3),
        tuple(one.name for one in shown),
        tuple(one.scale for one in shown),
        base=base,
        env_id="shipgym/PathFollowing-v0",
        model_name="mariner",
        **more,
    )


def cases() -> list[str]:
    """Learned policies."""
    return [*POLICIES, "functions"]


def record(case: str) -> dict[str, Floats]:
    """The values of a case."""
    if case in POLICIES:
        return of_policy(POLICIES[case]())
    return record_functions()


def of_policy(policy: Any) -> dict[str, Floats]:
    """What a policy's file says, what it commands side by side and alone, and what it remembers."""
    content, tensors = policy.file_fields()
    found = numbers_in(content, left_out=("training",))
    found |= {
        name: np.array([one.sum(), np.abs(one).sum()], float)
        for name, one in tensors.items()
    }
    state, alone, actions, own = None, None, [], []
    for step, seen in enumerate(series(policy.observation_names, 24)):
        begins = (
            np.arange(SHIPS) == 1 if step == 13 else np.zeros(SHIPS, dtype=np.bool_)
        )
        action, state = policy.predict(seen, state, begins)
        actions.append(action)
        if step < 7:
            action, alone = policy.predict(seen[2], alone)
            own.append(action)
    found |= {"commands": vector(actions), "alone": vector(own)}
    return found | {
        f"memory {k}": vector(one) for k, one in enumerate(flattened(state))
    }


def record_functions() -> dict[str, Floats]:
    """Functions of policies at numbers worth a look."""
    single = np.array([[0.7, -1.3], [0.2, 0.4]], np.float32)
    return {
        "toward": vector(
            toward(single, np.array([[0.1, -0.2], [0.25, -0.9]], np.float32), 0.17)
        ),
        "orders": vector(order_numbers([[-0.93], [0.11], [0.49], [1.0]])),
    }


#: Kinds of autopilots on a bridge, and learned ones.
ABOARD: dict[str, Callable[[], Any]] = {
    **{
        kind: lambda kind=kind: controller_class(kind).from_model(MARINER)  # type: ignore[misc]
        for kind in (
            "pid",
            "lq",
            "lqg",
            "turn-rate",
            "los",
            "ilos",
            "alos",
        )
    },
    "wheel-over": lambda: controller_class("wheel-over").from_model(
        MARINER, task=Task.of("PathFollowing")
    ),  # type: ignore[attr-defined]
    "learned": random_policy,
    "residual": POLICIES["residual"],
    "learned paths": path_policy,
}
BRIDGE = ("autopilots", "route", "helm", "helm on a route", "instruments")


def record_bridge(case: str) -> dict[str, Floats]:
    """The values of a case of the section `bridge`."""
    found: dict[str, Floats] = globals()[f"of_{case.replace(' ', '_')}"]()
    return found


def of_autopilots() -> dict[str, Floats]:
    """Orders of each autopilot, given numbers of one ship that no environment shows."""
    found = {}
    for name, made in ABOARD.items():
        pilot = Autopilot(made())
        pilot.largest = min(pilot.largest, 0.5)
        orders = []
        for k in range(25):
            given = {
                "set_point": 6.1 + 0.3 * (k > 8),
                "heading": 0.4 + 0.2 * np.sin(0.3 * k),
                "yaw_rate": 0.006 * np.cos(0.3 * k),
                "sway": 0.3 * np.sin(0.2 * k),
                "surge": 7.1 + 0.02 * k,
                "rudder": 0.1 * np.sin(0.5 * k),
                "rate_of_turn": 0.004 * (k > 15),
                "cross_track": 90.0 - 7.0 * k,
                "course": 0.35 + 0.2 * np.sin(0.3 * k),
                "next_turn_distance": 500.0 - 20.0 * k,
                "next_turn_angle": -0.6,
                "second_turn_distance": 1300.0 - 20.0 * k,
                "second_turn_angle": 0.9,
            }
            orders.append(pilot.step({one: given[one] for one in pilot.inputs}))
        inside = [pilot.dt, pilot.limit, pilot.integral, pilot.last_command]
        found |= {f"{name} orders": vector(orders), f"{name} inside": vector(inside)}
    return found | {
        f"bounds {name}": vector(pair) for name, pair in observation_bounds().items()
    }


def track(radius: float = 610.0) -> Route:
    """A route with turns to both sides, in the south and across the date line."""
    return Route(
        np.array(
            [[-33.9, 179.95], [-33.86, 179.97], [-33.85, -179.99], [-33.8, -179.98]]
        ),
        radius,
    )


def of_route() -> dict[str, Floats]:
    """What a route tells a ship beside it, leg after leg."""
    route, found = track(), []
    for k in range(60):
        latitude, longitude = (
            -33.9 + 0.0017 * k,
            179.95 + 0.00115 * k + 0.004 * np.sin(0.2 * k),
        )
        found.append(
            [
                *route.given(np.radians(latitude), np.radians(longitude)).values(),
                route.ended,
            ]
        )
    return {
        "given": vector(found),
        "plan": vector(route.plan),
        "origin": vector(route.origin),
    }


def of_helm() -> dict[str, Floats]:
    """Orders of a helm with readings of several instruments; what it makes of silence and disagreement."""
    limits = Limits(
        silence_s=2.2,
        disagreement=0.8,
        rudder_deg=6.0,
        rudder_rate_deg_s=3.1,
        persistence_s=1.3,
        order_deg=21.0,
        off_heading_deg=7.0,
        off_track_m=130.0,
        early_s=45.0,
    )
    found = {
        "between": vector(
            [
                limits.between(one)
                for one in (
                    "heading",
                    "yaw_rate",
                    "latitude",
                    "cross_track",
                    "surge",
                    "waypoint_distance",
                )
            ]
        )
    }
    sensors = HelmSensors(limits)
    for one in (("course", 0.7), ("speed", 6.1), ("heading", 0.4)):
        sensors.take(NmeaReading(*one, "GP"), 1.0)
    found["over ground"] = vector(
        list(sensors.numbers(["surge", "sway", "heading"], 2.0).values())
    )
    for name, heading, rate in (
        ("pid", 0.6, None),
        ("turn-rate", None, -0.004),
        ("turn-rate", 0.9, 0.003),
        ("los", None, None),
    ):
        helm = Helm(
            controller_class(name).from_model(MARINER), heading, limits, rate=rate
        )  # type: ignore[attr-defined]
        rows = []
        for k in range(40):
            now, turned = 1.0 * k, 0.3 + 0.2 * np.sin(0.2 * k)
            told = {
                "heading": turned,
                "yaw_rate": 0.04 * np.cos(0.2 * k),
                "rudder": helm.order,
                "leg": 0.5,
                "sway": 0.2,
                "cross_track": 110.0 + 2.0 * k,
                "speed": 6.0,
                "waypoint_distance": 500.0 - 12.0 * k,
                "surge": 6.2,
            }
            for quantity, value in told.items():
                if not (quantity == "yaw_rate" and k > 33):
                    helm.sensors.take(NmeaReading(quantity, value, "II"), now)
            helm.watch(1.0, now)
            helm.steer(now)
            rows.append(
                [
                    helm.order,
                    len(helm.warnings),
                    len(helm.alarm),
                    len(helm.silent),
                    helm.sensors.expected or 0.0,
                ]
            )
        found[f"{name} {heading} {rate}"] = vector(rows)
    return found


def of_helm_on_a_route() -> dict[str, Floats]:
    """A ship in a current and wind, steered along a route by what her instruments show."""
    guide = controller_class("wheel-over").from_model(
        MARINER, task=Task.of("PathFollowing")
    )  # type: ignore[attr-defined]
    places = np.array([[54.0, 7.5], [54.012, 7.5], [54.02, 7.53], [54.03, 7.53]])
    helm = Helm(
        guide,
        None,
        Limits(off_track_m=30.0, early_s=70.0),
        Route(places, guide.gains["path_radius"]),
    )
    ship, rows, said = (
        SimulatedShip(MARINER, leg=0.3, weather="slight", seed=5, step=0.5),
        [],
        [],
    )
    for k in range(420):
        for name, value in ship.measured().items():
            helm.sensors.take(NmeaReading(name, value, "II"), 1.0 * k)
        helm.watch(1.0, 1.0 * k)
        helm.steer(1.0 * k)
        ship.order = helm.order
        ship.advance()
        ship.advance()
        if k % 20 == 0:
            rows.append([helm.order, *ship.now.values()])
        said.append([len(one) for one in (helm.status, helm.alarm)])
    return {
        "track": vector(rows),
        "said": vector(said),
        "seconds": vector(
            helm.seconds_to_turn(
                {
                    "next_turn_distance": 900.0,
                    "next_turn_angle": 0.3,
                    "second_turn_distance": 700.0,
                    "second_turn_angle": 0.1,
                },
                419.0,
            )
        ),
    }


def of_instruments() -> dict[str, Floats]:
    """What the instruments of a ship that rolls show, in a sea."""
    ship = SimulatedShip(load_model("container"), leg=0.7, weather="moderate", seed=3)
    rows = []
    for k in range(80):
        if k % 10 == 0:
            rows.append(list(ship.measured().values()))
        ship.order = 0.2 * np.sin(0.1 * k)
        ship.advance()
    return {"measured": vector(rows), "state": vector(list(ship.now.values()))}


def texts(name: str) -> str:
    """Sentences of NMEA 0183 that are sent."""
    return "\n".join(said_by_helm() if name == "nmea helm" else said_by_ship())


def said_by_helm() -> list[str]:
    """Sentences and statuses of helms, from standby to an alarm, with warnings."""
    said = []
    limits = Limits(off_heading_deg=3.0, off_track_m=30.0, persistence_s=1.0)
    for kind, heading, rate in (
        ("lq", 0.7, None),
        ("turn-rate", None, 0.004),
        ("ilos", None, None),
    ):
        helm = Helm(
            controller_class(kind).from_model(MARINER), heading, limits, rate=rate
        )  # type: ignore[attr-defined]
        said += [helm.status, helm.sentences()]
        for now in (0.0, 1.0, 2.0, 3.0, 4.0):
            told = {
                "heading": 0.6,
                "yaw_rate": 0.001,
                "rudder": -0.1 * now,
                "leg": 0.5,
                "sway": 0.2,
                "surge": 7.0,
                "cross_track": 50.0,
                "speed": 6.0,
                "waypoint_distance": 300.0,
                "course": 0.61,
            }
            for quantity, value in told.items():
                helm.sensors.take(NmeaReading(quantity, value, "II"), now)
            if kind == "lq":
                helm.sensors.take(NmeaReading("heading", 0.8, "GP"), now)
            helm.watch(1.0, now)
            helm.steer(now)
            said += [helm.status, helm.sentences()]
        helm.watch(1.0, 20.0)
        said += [helm.status, helm.sentences()]
    return said


def said_by_ship() -> list[str]:
    """Sentences of a ship that rolls, in a sea, and what they tell."""
    ship = SimulatedShip(load_model("container"), leg=0.7, weather="moderate", seed=3)
    said = []
    for k in range(31):
        if k % 6 == 0:
            said.append(ship.sentences())
            said += [
                f"{one.quantity} {one.value:.6f} {one.talker}"
                for line in said[-1].splitlines()
                for one in readings(line) or ()
            ]
        for line in sentences(
            "AGROR,-7.5,A,,V,B" if k < 20 else "AGROR,3.0,V,,V,B"
        ).splitlines():
            ship.hear(line)
        said.append(f"order {ship.order:.4f}")
        if k == 28:  # to where latitude and longitude have odd degrees
            ship.states[0, :2] += 133e3, 100e3
        ship.advance()
    return said


TEXTS = ("nmea helm", "nmea ship")
