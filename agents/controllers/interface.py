"""Interface of all that steers, and the checks that it fits an environment."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from itertools import zip_longest
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from shipgym.errors import InputError
from shipgym.tasks.scales import OBSERVATION_NAMES, observation_scales

if TYPE_CHECKING:
    from shipgym import ShipModel
    from shipgym.tasks.task import Task


class Policy(Protocol):
    """Anything that steers: controllers of shipgym, of stable-baselines3, your own."""

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Any, Any]:
        """Return commands for one or many observations.

        The signature is that of stable-baselines3. Raises InputError if the observation
        has fewer entries or another number of dimensions, or the state is not one of as
        many ships.

        Parameters
        ----------
        observation : array-like of shape (n_observations,) or (n, n_observations)
            Of an environment. Controllers steer by the first of them, those that they
            were designed for: heading autopilots by the eight of course keeping, whose
            heading error is against the line-of-sight course where a path is followed.
        state : Any, optional
            What the last call returned; None where episodes begin.
        episode_start : bool or array-like of bool of shape (n,), optional
            Where an episode begins and the state is that of the one before.
        deterministic : bool
            Whether to command without chance. Controllers of this package always do.

        Returns
        -------
        action : float32 array of shape (n_commands,) or (n, n_commands)
            Parts of the limits in [-1, 1], the first of the rudder.
        state : Any
            For the next call: all that is remembered is in it.
        """


def after_order(policy: Policy, state: Any, action: Any) -> Any:
    """State of a policy beside which another order than its own was given.

    A policy without a method of this name does not look at its orders. `action`: shape
    (..., 1), parts of the rudder limit.
    """
    follow = getattr(policy, "after_order", None)
    return state if follow is None else follow(state, action)


class Fitting:
    """An agent that knows its observations, and refuses others."""

    observation_names: tuple[str, ...]
    observation_scales: tuple[float, ...]

    @property
    def remedy(self) -> str:
        """What to do where it does not fit."""
        raise NotImplementedError

    def check_fits(
        self, names: Sequence[str], scales: Sequence[float], where: str = "observations"
    ) -> None:
        """Refuse other quantities or scales than its own.

        Raises InputError, which names the first difference.

        Parameters
        ----------
        names, scales : sequence
            `observation_names` and `observation_scales` of an environment; it may show
            more than what is steered by.
        where : str
            Start of the message.
        """
        own = self.observation_names
        check_names(names[: len(own)], own, where)
        check_scales(names, scales, self.observation_scales, where, self.remedy)

    def check_fits_model(self, model: ShipModel) -> None:
        """Refuse a ship of another length, service speed or rudder limit."""
        names, own = self.observation_names, self.observation_scales
        scales = observation_scales(model).tolist()
        shown = dict(zip(names, own, strict=True))
        shown |= dict(zip(OBSERVATION_NAMES, scales, strict=True))
        found = [shown[name] for name in names]
        check_scales(names, found, own, f"model '{model.name}'", self.remedy)


def check_fits(policy: Any, task: Task, ship: ShipModel, where: str) -> None:
    """Refuse a policy made for other observations than a task shows of a ship.

    `policy`: without a method `check_fits` it steers by anything; `where`: start of the
    message. Raises InputError naming the first difference.
    """
    check = getattr(policy, "check_fits", None)
    if check is None:
        return
    shown = task.observed(ship)
    names = [quantity.name for quantity in shown]
    scales = [quantity.scale for quantity in shown]
    check(names, scales, where)


def read_commands(
    actions: Any, shape: tuple[int, ...]
) -> tuple[NDArray[np.float32], str]:
    """What a policy returned as numbers, else NaN, and what is wrong with it."""
    nothing = np.full(shape, np.nan, dtype=np.float32)
    try:
        with np.errstate(over="ignore"):
            values = np.array(actions, dtype=np.float32)
    except (TypeError, ValueError):
        return nothing, f"expected an array of numbers, got {type(actions).__name__}"
    if values.shape != shape:
        return nothing, f"expected actions of shape {shape}, got {values.shape}"
    return values, ""


def check_names(found: Sequence[str], expected: Sequence[str], where: str) -> None:
    """Refuse observations by other names or in another order.

    Raises InputError, which names the first difference.
    """
    pairs = zip_longest(found, expected, fillvalue="none")
    for i, (name, wanted) in enumerate(pairs):
        if name != wanted:
            raise InputError(
                f"{where}: observation {i}: expected '{wanted}', got '{name}'"
            )


def check_scales(
    names: Sequence[str],
    scales: Sequence[float],
    own: Sequence[float],
    where: str,
    remedy: str,
) -> None:
    """Refuse observations in other scales than an agent's own; InputError names one."""
    scale_tolerance = 1e-6  # relative difference of observation scales that is rounding
    for name, scale, wanted in zip(names, scales, own, strict=False):
        if abs(scale - wanted) > scale_tolerance * abs(wanted):
            raise InputError(
                f"{where}: scale of '{name}': expected {wanted:g}, got {scale:g}:"
                f" {remedy}"
            )


def model_hash(model: ShipModel) -> str:
    """SHA-256 of a model's structure, coefficients, particulars and steering gear."""
    content = [
        model.dynamics.to_dict(),
        model.coefficients,
        model.particulars.to_dict(),
        model.steering.to_dict(),
    ]
    text = json.dumps(content, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()
