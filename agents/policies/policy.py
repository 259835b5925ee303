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

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.controllers.controller import (
    FORMAT,
    Action,
    Controller,
    check_names,
    check_scales,
)
from agents.controllers.memory import (
    checked_memory,
    checked_observation,
    checked_starts,
)
from agents.policies.network import Network, Numbers
from agents.policies.policy_extraction import sb3_fields, task_showing
from agents.policies.weights_file import Tensors, as_json, write_policy
from shipgym import InputError, ShipModel
from shipgym.checks import check_choice, check_number, check_whole
from shipgym.tasks.definition import read_definition
from shipgym.tasks.task import ACTIONS, RUDDER_ORDERS, Task

ORDERS = np.array(RUDDER_ORDERS, dtype=np.float32)
#: Number of the network's outputs by the kind of action.
OUTPUTS = {"rudder": 1, "rudder-discrete": len(RUDDER_ORDERS), "rudder-shaft": 2}
LARGEST_AUTHORITY = 2.0
NO_LIMIT = 2.0  # of the rate: outputs are in [-1, 1]
#: Options of an environment that decide what is observed and in which scales.
SHOWING = ("action", "roll", "corridor", "ground")


class Memory(NamedTuple):
    """What a policy with a frame stack, a base or an action repeat remembers."""

    #: past observations, oldest first; for a single observation without the first axis,
    #: shape (n, frame_stack - 1, n_observations)
    seen: Numbers
    base: Any  # state of the base
    #: control intervals until the next decision, the network's outputs of the last one,
    #: and those in force, limited in rate; for a single observation without the first
    #: axis, shape (n, 1 + 2 n_outputs)
    repeated: Numbers


@dataclass(frozen=True, eq=False)
class LearnedPolicy:
    """A learned autopilot in the signature of `Controller.predict`; steers without torch.

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

    network: Network
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
    training: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_choice(self.action, ACTIONS, "action")
        check_part(self)
        if self.action == "rudder-discrete" and self.rate_limit < NO_LIMIT:
            raise InputError(
                f"rate_limit: {self.rate_limit:g} found with discrete orders,"
                " expected 2"
            )
        n, n_scales = len(self.observation_names), len(self.observation_scales)
        if n_scales != n:
            raise InputError(
                f"observation_scales: {n_scales} found, expected {n} numbers"
            )
        if self.base is not None:
            if self.action != "rudder":
                raise InputError(
                    f"action: '{self.action}' found together with a base, expected"
                    " 'rudder'"
                )
            self.base.check_fits(
                self.observation_names, self.observation_scales, "base"
            )
        n_in = self.frame_stack * n + (self.base is not None)
        n_out, has = OUTPUTS[self.action], self.network.sizes
        if has[0] != n_in:
            why = f"{self.frame_stack} x {n} observations and the base's"
            raise InputError(f"network: {has[0]} inputs found, expected {n_in}: {why}")
        if has[-1] != n_out:
            why = f"for action '{self.action}'"
            raise InputError(
                f"network: {has[-1]} outputs found, expected {n_out}: {why}"
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

    def reset(self) -> None:
        """The state with which an episode begins: None, whatever the number of ships."""

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Action, Any]:
        """See `Policy.predict`: the mean of what was learned, or of discrete orders the most likely one.

        Of discrete orders the order itself is returned, not its number (`order_numbers`
        gives it). The state is a `Memory` if there is a frame stack, a base, an action
        repeat or a rate limit, else as given.
        """
        n = len(self.observation_names)
        given = checked_observation(observation, self.observation_names, np.float32)
        rows = np.atleast_2d(given)
        if (self.frame_stack, self.base, self.action_repeat, self.rate_limit) == (
            1,
            None,
            1,
            NO_LIMIT,
        ):
            action = self.commands(self.network(rows[:, :n]), None)
            return (action if given.ndim == 2 else action[0]), state
        seen, inner, held = self._recalled(
            state, episode_start, rows[:, :n], given.ndim
        )
        window = np.concatenate([seen, rows[:, None, :n]], axis=1)
        inputs, proposed = window.reshape(len(rows), -1), None
        if self.base is not None:
            order, inner = self.base.predict(given, inner, episode_start, deterministic)
            proposed = np.asarray(order, dtype=np.float32).reshape(len(rows), 1)
            inputs = np.concatenate([inputs, proposed], axis=1)
        held = self._decided(inputs, held)
        action = self.commands(held[:, 1 + OUTPUTS[self.action] :], proposed)
        kept = window[:, 1:].copy()
        if given.ndim == 2:
            return action, Memory(kept, inner, held)
        return action[0], Memory(kept[0], inner, held[0])

    def _decided(self, inputs: Numbers, held: Numbers) -> Numbers:
        """Outputs in use: new ones of the ships whose last decision is over, or was not a number."""
        due = (held[:, 0] < 1.0) | ~np.isfinite(held).all(axis=1)
        left, outputs, before = np.split(held, [1, 1 + OUTPUTS[self.action]], axis=1)
        if due.any():
            left = np.where(due[:, None], np.float32(self.action_repeat), left)
            outputs = np.where(due[:, None], self.network(inputs), outputs)
        in_force = outputs
        if (
            self.rate_limit < NO_LIMIT
        ):  # limited from those before, if they were numbers
            in_force = toward(
                outputs, np.where(np.isfinite(before), before, 0.0), self.rate_limit
            )
        return np.concatenate([left - 1.0, outputs, in_force], axis=1)

    def commands(self, output: Numbers, proposed: Numbers | None) -> Action:
        """What is commanded for the network's outputs and the base's action, each of shape (n, ...)."""
        if self.action == "rudder-discrete":
            return ORDERS[output.argmax(axis=1), None]
        limited = np.clip(output, -1.0, 1.0)
        if proposed is None:
            return limited
        return combined(proposed, limited, float(self.authority))

    def _recalled(
        self, state: Any, starts: Any, rows: Numbers, ndim: int
    ) -> tuple[Numbers, Any, Numbers]:
        """What each ship remembers, as in `Memory`; where an episode begins, the present fills the past."""
        past, n = self.frame_stack - 1, len(rows)
        present = np.repeat(rows[:, None], past, axis=1)
        nothing = np.zeros((n, 1 + 2 * OUTPUTS[self.action]), dtype=np.float32)
        if state is None:
            return present, None, nothing
        if not isinstance(state, tuple) or len(state) != len(Memory._fields):
            raise InputError(
                f"state: {type(state).__name__} found, expected what the last predict"
                " returned, or None where episodes begin"
            )
        seen, inner, held = state
        expected = (n, past, rows.shape[1])
        seen = checked_memory(seen, expected if ndim == 2 else expected[1:])
        flags = checked_starts(starts, (n,))
        held = np.where(flags[:, None], nothing, np.reshape(held, nothing.shape))
        return (
            np.where(flags[:, None, None], present, np.reshape(seen, expected)),
            inner,
            held,
        )

    def check_fits(
        self, names: Sequence[str], scales: Sequence[float], where: str = "observations"
    ) -> None:
        """Refuse what shows other quantities first, or in other scales, than those it learned with.

        Arguments and errors as in `Controller.check_fits`.
        """
        named = f"{where}: not those that the agent learned with in {self.env_id}"
        check_names(names[: len(self.observation_names)], self.observation_names, named)
        check_scales(
            names,
            scales,
            self.observation_scales,
            where,
            f"policy '{self.name}' learned on another ship or task (model"
            f" '{self.model_name}', {self.env_id}); train one in this environment",
        )

    def check_fits_model(self, model: ShipModel) -> None:
        """Refuse a ship with other observation scales in the environment that it learned in.

        One that learned a task of a user's own is checked where it meets the task.
        """
        if "task" in self.env_options:
            return
        definition = read_definition(task_showing(self.observation_names))
        known = {
            "action": self.action,
            "roll": "roll" in self.observation_names,
            **self.env_options,
        }
        names = [
            name
            for name in SHOWING
            if name in known and name in Task.option_names(definition)
        ]
        task = Task.of(definition, **{name: known[name] for name in names})
        task.check_fits(model)
        shown = task.observed(model)
        names, scales = [one.name for one in shown], [one.scale for one in shown]
        self.check_fits(names, scales, f"model '{model.name}'")

    def save(self, path: str | Path) -> None:
        """Write NAME.json and, beside it, NAME.safetensors (fields in docs/policies.md)."""
        write_policy(*self.file_fields(), Path(path))

    def file_fields(self) -> tuple[dict[str, Any], Tensors]:
        """What stands in its JSON, and its weights by name."""
        network, tensors = network_fields(self.network)
        content = {
            "format": FORMAT,
            "kind": "learned",
            "observation_names": list(self.observation_names),
            "observation_scales": list(self.observation_scales),
            "action": self.action,
            "network": network,
            "frame_stack": self.frame_stack,
            "base": None if self.base is None else self.base.to_dict(),
            "authority": self.authority,
            "action_repeat": self.action_repeat,
            "rate_limit": self.rate_limit,
            "environment": {"id": self.env_id, "options": as_json(self.env_options)},
            "model": {"name": self.model_name, "sha256": self.model_sha256},
            "training": as_json(self.training),
        }
        return content, tensors


def check_part(agent: Any) -> None:
    """Refuse an impossible share of the rudder, frame stack, repeat or rate, of a policy or of its ships."""
    check_number(agent.authority, "authority", above=0.0, at_most=LARGEST_AUTHORITY)
    check_whole(agent.frame_stack, "frame_stack", at_least=1)
    check_whole(agent.action_repeat, "action_repeat", at_least=1)
    check_number(agent.rate_limit, "rate_limit", above=0.0, at_most=NO_LIMIT)
    if agent.base is None and agent.authority != 1.0:
        raise InputError(
            f"authority: {agent.authority:g} found without a base, expected 1, or a"
            " base"
        )


def toward(outputs: Any, before: Any, rate_limit: float) -> Any:
    """Outputs limited to [-1, 1], and to what can be reached in one control interval from those before."""
    within = np.clip(outputs, -1.0, 1.0)
    return np.clip(within, before - rate_limit, before + rate_limit)


def combined(proposed: Any, part: Any, authority: float) -> Any:
    """Action of a base and what a policy adds to it."""
    return np.clip(proposed + authority * part, -1.0, 1.0)


def network_fields(network: Network) -> tuple[dict[str, Any], Tensors]:
    """What a policy's JSON says of its network, and the weights by name."""
    tensors = Tensors()
    for i, (weight, bias) in enumerate(network.layers):
        tensors[f"layers.{i}.weight"] = np.ascontiguousarray(weight)
        tensors[f"layers.{i}.bias"] = np.ascontiguousarray(bias)
    return {
        "activation": network.activation,
        "output": network.output,
        "sizes": list(network.sizes),
    }, tensors


def order_numbers(action: ArrayLike) -> NDArray[np.int64]:
    """Numbers of discrete rudder orders, for environments with the action "rudder-discrete".

    `action`: as `LearnedPolicy.predict` hands them back, shape (..., 1). Returns the
    index of the nearest order, shape (...).
    """
    given = np.asarray(action, dtype=np.float32)
    numbers: NDArray[np.int64] = np.abs(given - ORDERS).argmin(axis=-1)
    return numbers
