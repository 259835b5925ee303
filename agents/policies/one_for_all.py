"""One policy for many ships: it is told the ship and the path, and is made for each by `for_ship`.

Beside what every policy observes the network has inputs that stay the same throughout,
its context: how the ship answers her rudder, and how narrow and how winding the path
is, all without units (lengths in ship lengths, times in those to travel one at service
speed). Constant inputs are a part of the first layer's bias; so what is made for a ship
is a `LearnedPolicy` like any other, which adds to the wheel-over autopilot designed on
her model, with settings that a rule found on the fleet gives for her path (`base_for`).

Sources: Yu, Tan, Liu & Turk 2017, Preparing for the unknown: learning a universal
policy with online system identification, RSS (a policy that is told the dynamics);
Nomoto, Taguchi, Honda & Hirano 1957 (the linear steering dynamics); Johannink et al.
2019, Residual reinforcement learning for robot control, ICRA.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from agents.controllers.controller import FORMAT, check_names, model_hash
from agents.controllers.linear_loop import rate_weight
from agents.controllers.lq import LQ
from agents.controllers.wheel_over import WheelOver, own_lead, own_turn
from agents.policies.network import Network
from agents.policies.policy import LARGEST_AUTHORITY, LearnedPolicy, network_fields
from agents.policies.weights_file import as_json, write_policy
from shipgym import InputError, ShipModel
from shipgym.arrays import Floats
from shipgym.checks import check_keys, check_number
from shipgym.ships.linear import steering_state_space
from shipgym.tasks.steering import RUDDER_WEIGHT
from shipgym.tasks.task import Task

ONE_FOR_ALL = "one-for-all"  # its name, and the kind of its file
ENV_ID = "shipgym/PathFollowing-v1"
#: What it is told, in order.
CONTEXT = (
    "damping",
    "stability",
    "rudder_gain",
    "rudder_effect",
    "drift",
    "gear_rate",
    "gear_lag",
    "rudder_limit",
    "turn_radius",
    "turn_reach",
    "path_radius",
    "corridor",
)
#: Settings of its base for which the fleet has a rule: a factor on the design's own
#: where the corridor is one ship length or wider, and NAME_power, the power of a
#: narrower corridor that it changes with.
RULED = ("lookahead", "reach", "crab_share", "rudder_weight", "rate_weight", "integral")
RULES = (*RULED, *(f"{name}_power" for name in RULED))
# deviation from the fleet's mean, in its standard deviations, that the network is shown
LARGEST = 3.0
# of the range that the fleet covers: beyond it by so much nothing is added, and a ship
# is refused
FAR = 0.2


def context(model: ShipModel, task: Task) -> Floats:
    """What the policy is told of a ship and of her path, without units.

    With d/dt (v, r) = A (v, r) + B delta about straight running in the prime system:
    `damping` -trace A, `stability` det A (negative for a ship unstable on her course),
    `rudder_gain` the numerator of r / delta at rest (over the stability it is Nomoto's
    K'), `rudder_effect` the yaw acceleration by a radian of rudder, `drift` v / r in a
    steady turn; of the steering gear `gear_rate`, the share of the limit that it turns
    while she travels her length, `gear_lag` and `rudder_limit` (rad); radius and reach
    of her own turn with moderate rudder (`own_turn`); turn radius and corridor of the
    path. A ship scaled by Froude's law, or mirrored, has the same.

    `model`: as identified; `task`: path following of version 1. Returns an array of
    shape (12,), in the order of `CONTEXT`. Raises InputError if the model has no
    straight course, or does not turn.
    """
    gear, p = model.steering, model.particulars
    A, B = steering_state_space(model)
    time, units = (
        p["length"] / p["speed"],
        np.array([p["speed"], p["speed"] / p["length"]]),
    )
    A, b = time * A * units / units[:, None], time * B[:, 0] / units
    turning = A[1, 0] * b[0] - A[0, 0] * b[1]
    drift = (A[0, 1] * b[1] - A[1, 1] * b[0]) / turning
    return np.array(
        [
            -np.trace(A),
            np.linalg.det(A),
            turning,
            b[1],
            drift,
            gear.rate * time / gear.limit,
            gear.time_constant / time,
            gear.limit,
            *own_turn(model),
            task.turn_radius,
            task.corridor,
        ]
    )


def base_for(model: ShipModel, task: Task, rule: Mapping[str, float]) -> WheelOver:
    """The wheel-over autopilot of a ship and path, its settings by a rule (`RULES`; none: the design's own).

    Raises InputError if it cannot be designed.
    """

    def factor(name: str) -> float:
        return float(
            rule.get(name, 1.0)
            * min(task.corridor, 1.0) ** rule.get(f"{name}_power", 0.0)
        )

    pilot = LQ.from_model(
        model,
        dt=task.interval(model),
        integral_lengths=20.0 * factor("integral"),
        rudder_weight=RUDDER_WEIGHT * factor("rudder_weight"),
        rate_weight_s2=rate_weight(model) * factor("rate_weight"),
    )
    lookahead, reach = (
        task.lookahead * factor("lookahead"),
        own_lead(model, pilot) * factor("reach"),
    )
    return WheelOver.from_model(
        model,
        autopilot=pilot,
        task=task,
        lookahead_lengths=lookahead,
        reach_lengths=reach,
        crab_share=min(factor("crab_share"), 2.0),
    )


@dataclass(frozen=True, eq=False)
class OneForAll:
    """A policy for a fleet, from which `for_ship` makes that of one ship and path.

    Raises InputError naming the field whose value does not fit.
    """

    network: Network  # on what is observed, the base's action and the context
    observation_names: tuple[str, ...]  # what is observed
    #: mean, standard deviation, least and largest of the context in the fleet that it
    #: was trained on
    fleet: Floats  # shape (12, 4)
    # how long an output is repeated, times to travel a ship length at service speed
    decision: float
    authority: float  # share of the rudder limit by which it may differ from the base
    training: Mapping[str, Any] = field(
        default_factory=dict
    )  # how it was made, as JSON has it
    rule: Mapping[str, float] = field(
        default_factory=dict
    )  # of its base's settings, see `base_for`

    def __post_init__(self) -> None:
        check_number(self.decision, "decision", above=0.0)
        check_number(self.authority, "authority", above=0.0, at_most=LARGEST_AUTHORITY)
        for name, (_, deviation, low, high) in zip(CONTEXT, self.fleet, strict=True):
            check_number(deviation, f"context.{name}[1]", above=0.0)
            check_number(high, f"context.{name}[3]", above=low)
        check_keys(self.rule, RULES, "rule")
        for name, value in self.rule.items():
            least = -4.0 if name.endswith("_power") else 1e-3
            check_number(value, f"rule.{name}", at_least=least, at_most=1e3)
        sizes, n_in = self.network.sizes, len(self.observation_names) + 1 + len(CONTEXT)
        if (sizes[0], sizes[-1]) != (n_in, 1):
            raise InputError(
                f"network: sizes {sizes} found, expected {n_in} inputs and 1 output"
            )

    def inputs(self, told: Floats) -> Floats:
        """A context as the network is shown it, shape (12,) or (n, 12)."""
        return np.clip((told - self.fleet[:, 0]) / self.fleet[:, 1], -LARGEST, LARGEST)

    def for_ship(self, model: ShipModel, task: Task | None = None) -> LearnedPolicy:
        """Make the policy of one ship from her model; nothing is searched or learned.

        `task`: the path to follow, by default that of PathFollowing-v1. The policy's
        `training` says under "outside" by how much of the fleet's range the ship or the
        path is outside it, by `CONTEXT`; the farther, the less it adds to its base.
        Raises InputError if the path is not of version 1, wheel-over cannot be designed
        for the ship, or she is far from all that it was trained on.
        """
        asked = task or Task.of("PathFollowing-v1")
        observed = asked.observed(model)[: len(self.observation_names)]
        where = f"{ONE_FOR_ALL} on '{asked.name}'"
        check_names([one.name for one in observed], self.observation_names, where)
        base, told = base_for(model, asked, self.rule), context(model, asked)
        outside = self.outside(told, model.name)
        ((weight, bias), *rest), n_in = self.network.layers, len(observed) + 1
        first = (
            weight[:, :n_in].copy(),
            (bias + weight[:, n_in:] @ self.inputs(told)).astype(np.float32),
        )
        time = model.particulars["length"] / model.particulars["speed"]
        return LearnedPolicy(
            network=replace(self.network, layers=(first, *rest)),
            observation_names=self.observation_names,
            observation_scales=tuple(one.scale for one in observed),
            base=base,
            authority=self.authority * (1.0 - max(outside.values(), default=0.0) / FAR),
            action_repeat=max(1, round(self.decision * time / asked.interval(model))),
            env_id=ENV_ID,
            env_options=as_json(asked.options),
            model_name=model.name,
            model_sha256=model_hash(model),
            training={**self.training, "algorithm": ONE_FOR_ALL, "outside": outside},
        )

    def outside(self, told: Floats, name: str) -> dict[str, float]:
        """By how much of the fleet's range a context is outside it; InputError, with the ship, where far."""
        found: dict[str, float] = {}
        for one, value, (_, _, low, high) in zip(
            CONTEXT, told.tolist(), self.fleet.tolist(), strict=True
        ):
            beyond = max(low - value, value - high) / (high - low)
            if not beyond < FAR:
                raise InputError(
                    f"model {name!r}: {one} {value:.3g} found, {ONE_FOR_ALL} was"
                    f" trained on {low:.3g} to {high:.3g} and would be guessing; take"
                    " wheel-over, or train an agent for this ship"
                )
            found |= {one: beyond} if beyond > 0.0 else {}
        return found

    def save(self, path: str | Path) -> None:
        """Write NAME.json and, beside it, NAME.safetensors (fields in docs/policies.md)."""
        network, tensors = network_fields(self.network)
        content = {
            "format": FORMAT,
            "kind": ONE_FOR_ALL,
            "observation_names": list(self.observation_names),
            "context": dict(zip(CONTEXT, self.fleet.tolist(), strict=True)),
            "network": network,
            "decision": self.decision,
            "authority": self.authority,
            "training": as_json(self.training),
            "rule": dict(self.rule),
        }
        write_policy(content, tensors, Path(path))
