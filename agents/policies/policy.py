"""Learned policies: what reinforcement learning found, run in NumPy.

A policy is a network on `[observation(t - frame_stack + 1), ..., observation(t), base
action(t)]`, its observations in the scales of the environment; the base's action only
if there is a base. Where an episode begins, the first observation fills the frame
stack. Without a base the network's output, limited to [-1, 1], is the action. With one
the action is `clip(base + authority * output, -1, 1)`: residual policy learning. The
output is repeated for `action_repeat` control intervals, while the base goes on with
its feedback; from one output to the next the part goes by at most `rate_limit` in an
interval, from 0 where an episode begins.

Sources: Silver, Allen, Tenenbaum & Kaelbling 2018, Residual policy learning,
arXiv:1812.06298; Johannink et al. 2019, Residual reinforcement learning for robot
control, ICRA.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.controllers.controller import FORMAT, Action, Controller
from agents.controllers.interface import Fitting
from agents.controllers.memory import (
    checked_memory,
    checked_observation,
    checked_starts,
)
from agents.policies.network import Network, Numbers
from agents.policies.policy_extraction import sb3_fields
from agents.policies.weights_file import Tensors, write_policy
from shipgym import InputError
from shipgym.checks import check_choice, check_number, check_whole
from shipgym.envs.episode import as_json
from shipgym.envs.pace import NO_LIMIT, toward
from shipgym.tasks.task import ACTIONS, RUDDER_ORDERS

ORDERS = np.array(RUDDER_ORDERS, dtype=np.float32)
#: Number of the network's outputs by the kind of action.
OUTPUTS = {"rudder": 1, "rudder-discrete": len(RUDDER_ORDERS), "rudder-shaft": 2}


class PolicyMemory(NamedTuple):
    """Memory of a policy of n ships; a single ship is a row too."""

    seen: (
        Numbers  # past observations, oldest first, (n, frame_stack - 1, n_observations)
    )
    base: Any  # state of the base
    left: Numbers  # control intervals that the output still lasts, (n, 1)
    output: Numbers  # of the network at the last decision, (n, n_outputs)
    in_force: Numbers  # the same, limited in rate, (n, n_outputs)


#: Fields of a policy that its file holds as they are.
PLAIN = (
    "observation_names",
    "observation_scales",
    "action",
    "frame_stack",
    "authority",
    "action_repeat",
    "rate_limit",
)


@dataclass(frozen=True, eq=False)
class LearnedPolicy(Fitting):
    """A learned autopilot with `predict` as in `Controller`; steers without torch.

    Raises InputError naming the field whose value does not fit.

    Attributes
    ----------
    network : Network
        Weights, activation and output.
    observation_names : tuple of str
        What it observes, in order.
    observation_scales : tuple of float
        Physical value of each observation of 1, SI units.
    action : {"rudder", "rudder-discrete", "rudder-shaft"}
        What it commands. With discrete orders, the one with the largest output.
    frame_stack : int
        Number of observations the network sees, the newest last.
    base : Controller or None
        Whose rudder the network adds to.
    authority : float
        Fraction of the rudder limit by which it may differ from the base; 1 without a
        base.
    action_repeat : int
        Control intervals for which an output of the network lasts.
    rate_limit : float
        Largest change of the output in force in a control interval; 2, its whole range,
        does not limit it.
    env_id : str
        Environment that it learned in.
    env_options : dict
        Its options, as JSON has them.
    model_name, model_sha256 : str
        The model that it learned on, and a hash of its structure and numbers.
    training : dict
        How it was made, as JSON has it: algorithm, seeds, steps, command, versions,
        learning curve, score.
    """

    network: Network = field(repr=False)
    observation_names: tuple[str, ...]
    observation_scales: tuple[float, ...]
    action: str = "rudder"
    frame_stack: int = 1
    base: Controller | None = None
    authority: float = 1.0
    action_repeat: int = 1
    rate_limit: float = NO_LIMIT
    env_id: str = "shipgym/CourseKeeping-v0"
    env_options: Mapping[str, Any] = field(default_factory=dict)
    model_name: str = "unknown"
    model_sha256: str = "unknown"
    training: Mapping[str, Any] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        check_choice(self.action, ACTIONS, "action")
        check_part(self)
        names = self.observation_names
        scales = self.observation_scales
        if len(scales) != len(names):
            raise InputError(
                f"observation_scales: expected {len(names)} numbers, got {len(scales)}"
            )
        if self.action == "rudder-discrete" and self.rate_limit < NO_LIMIT:
            raise InputError(
                f"rate_limit: expected {NO_LIMIT:g} with discrete orders, got"
                f" {self.rate_limit:g}"
            )
        if self.base is not None:
            if self.action != "rudder":
                raise InputError(
                    f"action: expected 'rudder' with a base, got '{self.action}'"
                )
            self.base.check_fits(names, scales, "base")
        self._check_network()

    def _check_network(self) -> None:
        n_inputs, *_, n_outputs = self.network.sizes
        n_observed = self.frame_stack * len(self.observation_names)
        n_proposed = 0 if self.base is None else 1
        expected = n_observed + n_proposed
        if n_inputs != expected:
            raise InputError(
                f"network: expected {expected} inputs, {n_observed} observations of the"
                f" frame stack and {n_proposed} of a base, got {n_inputs}"
            )
        expected = OUTPUTS[self.action]
        if n_outputs != expected:
            raise InputError(
                f"network: expected {expected} outputs for action '{self.action}', got"
                f" {n_outputs}"
            )

    @classmethod
    def from_sb3(
        cls, agent: Any, env: Any = None, training: Mapping[str, Any] | None = None
    ) -> Self:
        """The policy of a trained agent of stable-baselines3.

        Arguments and errors as in `agents.policies.policy_extraction.sb3_fields`;
        `training` is a record of how it was made.
        """
        return cls(**sb3_fields(agent, env), training=dict(training or {}))

    @property
    def name(self) -> str:
        """Short name: the algorithm, or `learned`."""
        return str(self.training.get("algorithm", "learned"))

    @property
    def remembers(self) -> bool:
        """True if a command depends on earlier observations."""
        return (
            self.frame_stack > 1
            or self.base is not None
            or self.action_repeat > 1
            or self.rate_limit < NO_LIMIT
        )

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Action, Any]:
        """Commands as in `Policy.predict`: the mean, or the most likely discrete order.

        Of discrete orders the order itself is returned, not its number (`order_numbers`
        gives it). The state is a `Memory` if the policy `remembers` anything, else as
        given.
        """
        given = checked_observation(observation, self.observation_names)
        *shape, _ = given.shape
        shown = np.atleast_2d(given)[:, : len(self.observation_names)]
        rows = shown.astype(np.float32)  # of the network; a base takes all digits
        if not self.remembers:
            commands = self.commands(self.network(rows))
            return commands.reshape(*shape, commands.shape[1]), state

        memory = self._recalled(state, episode_start, rows)
        window = np.concatenate([memory.seen, rows[:, None]], axis=1)
        memory = memory._replace(seen=window[:, 1:])
        inputs = window.reshape(len(rows), -1)

        proposed = None
        if self.base is not None:
            order, base_state = self.base.predict(
                given,
                memory.base,
                episode_start,
                deterministic,
            )
            proposed = np.asarray(order, dtype=np.float32).reshape(-1, 1)
            inputs = np.hstack([inputs, proposed])

        memory = self._decided(inputs, memory)
        commands = self.commands(memory.in_force, proposed)
        commands = commands.reshape(*shape, commands.shape[1])
        if self.base is not None:
            base_state = self.base.after_order(base_state, commands)
            memory = memory._replace(base=base_state)
        return commands, memory

    def _decided(self, inputs: Numbers, memory: PolicyMemory) -> PolicyMemory:
        """Ask the network for ships whose last output is over, or was not a number."""
        left = memory.left
        output = memory.output
        in_force = memory.in_force
        is_known = np.isfinite(output + in_force)
        is_due = (left < 1.0) | ~is_known.all(axis=1, keepdims=True)
        if is_due.any():
            left = np.where(is_due, np.float32(self.action_repeat), left)
            output = np.where(is_due, self.network(inputs), output)

        if self.rate_limit < NO_LIMIT:
            before = np.where(np.isfinite(in_force), in_force, np.float32(0.0))
            in_force = toward(output, before, self.rate_limit)
        else:
            in_force = output
        return memory._replace(
            left=left - 1.0,
            output=output,
            in_force=in_force,
        )

    def commands(self, output: Numbers, proposed: Numbers | None = None) -> Action:
        """Commands for outputs of the network and a base's action, both (n, ...)."""
        if self.action == "rudder-discrete":
            likeliest = output.argmax(axis=1, keepdims=True)
            return np.asarray(ORDERS[likeliest])
        action = np.clip(output, -1.0, 1.0)
        if proposed is not None:
            action = combined(proposed, action, float(self.authority))
        return action

    def _recalled(self, state: Any, starts: Any, rows: Numbers) -> PolicyMemory:
        """Memory of each ship; where an episode begins, the present fills the past."""
        n = len(rows)
        past = self.frame_stack - 1
        output = np.zeros((n, OUTPUTS[self.action]), dtype=np.float32)
        fresh = PolicyMemory(
            seen=np.repeat(rows[:, None], past, axis=1),
            base=None,
            left=np.zeros((n, 1), dtype=np.float32),
            output=output,
            in_force=output,
        )
        if state is None:
            return fresh
        if not isinstance(state, PolicyMemory):
            raise InputError(
                "state: expected what the last predict returned, or None where episodes"
                f" begin, got {type(state).__name__}"
            )
        checked_memory(state.seen, fresh.seen.shape)
        begins = checked_starts(starts, (n,))[:, None]
        return PolicyMemory(
            seen=np.where(begins[:, None], fresh.seen, state.seen),
            base=state.base,
            left=np.where(begins, fresh.left, state.left),
            output=np.where(begins, output, state.output),
            in_force=np.where(begins, output, state.in_force),
        )

    @property
    def remedy(self) -> str:
        """What to do where it does not fit."""
        return (
            f"policy '{self.name}' learned on another ship or task (model"
            f" '{self.model_name}', {self.env_id}); train one in this environment"
        )

    def save(self, path: str | Path) -> None:
        """Write NAME.json and NAME.safetensors (fields in docs/policies.md)."""
        content, tensors = self.file_fields()
        write_policy(content, tensors, Path(path))

    def file_fields(self) -> tuple[dict[str, Any], Tensors]:
        """Content of its JSON, and its weights by name."""
        tensors = Tensors()
        for i, layer in enumerate(self.network.layers):
            for part, numbers in layer._asdict().items():
                tensors[f"layers.{i}.{part}"] = np.ascontiguousarray(numbers)
        network = self.network
        content = {
            "format": FORMAT,
            "kind": "learned",
            **{name: getattr(self, name) for name in PLAIN},
            "network": {
                "activation": network.activation,
                "output": network.output,
                "sizes": network.sizes,
            },
            "base": None if self.base is None else self.base.to_dict(),
            "environment": {
                "id": self.env_id,
                "options": self.env_options,
            },
            "model": {"name": self.model_name, "sha256": self.model_sha256},
            "training": self.training,
        }
        return as_json(content), tensors


def check_part(agent: Any) -> None:
    """Refuse an impossible share of the rudder, frame stack, repeat or rate.

    `agent`: a policy, or the ships among which it learns (`ResidualVecEnv`).
    """
    check_number(
        agent.authority,
        "authority",
        above=0.0,
        at_most=2.0,
    )
    check_whole(agent.frame_stack, "frame_stack", at_least=1)
    check_whole(agent.action_repeat, "action_repeat", at_least=1)
    check_number(agent.rate_limit, "rate_limit", above=0.0, at_most=NO_LIMIT)
    if agent.base is None and agent.authority != 1.0:
        raise InputError(
            f"authority: expected 1 without a base, got {agent.authority:g}; give a"
            " base to which the agent adds"
        )


def combined(proposed: Any, part: Any, authority: float) -> Any:
    """Action of a base and what a policy adds to it."""
    return np.clip(proposed + authority * part, -1.0, 1.0)


def order_numbers(action: ArrayLike) -> NDArray[np.int64]:
    """Numbers of discrete rudder orders, for the action "rudder-discrete".

    `action`: as `LearnedPolicy.predict` hands them back, shape (..., 1). Returns the
    index of the nearest order, shape (...).
    """
    given = np.asarray(action, dtype=np.float32)
    numbers: NDArray[np.int64] = np.abs(given - ORDERS).argmin(axis=-1)
    return numbers
