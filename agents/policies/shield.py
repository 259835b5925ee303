"""A safety shield: a policy whose rudder a fallback takes over where it leads the ship astray.

It uses observations alone. When it takes over and hands back stands in docs/policies.md
and in `Limits`; the limits to hand back lie inside those to take over, so that it does
not chatter. Changes of the course itself do not count as turning away, and before a
planned turn any heading up to the course beyond it is on course.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.controllers.controller import FORMAT, Action, Controller, Policy
from agents.controllers.lq import LQ
from agents.controllers.memory import (
    Flags,
    Floats,
    Records,
    begun,
    heading_error,
    records,
    size_of,
)
from agents.policies.policy import LearnedPolicy
from agents.policies.weights_file import Tensors, write_policy
from shipgym import InputError
from shipgym.checks import check_number
from shipgym.ships import Envelope, ShipModel
from shipgym.tasks.task import OBSERVATION_NAMES, control_interval

#: What is remembered of each ship; the last two since her episode began.
WATCH = np.dtype(
    [
        ("steered", "f8"),  # whether the fallback steers
        ("quiet", "f8"),
        (
            "outside",
            "f8",
        ),  # intervals in which she was fit to be handed back, and was not
        ("turned", "f8"),
        ("rate", "f8"),  # angle turned away from the course, and the last yaw rate
        ("count", "f8"),
        ("intervals", "f8"),  # how often it took over, and how long it steered
    ]
)
TURNS = (
    ("turn_distance", "turn_angle"),
    ("next_turn_distance", "next_turn_angle"),
)  # as tasks name them


@dataclass(frozen=True)
class Limits:
    """When the fallback takes over, and when it hands back."""

    #: distance from the training data (1 is its edge) beyond which it takes over, and
    #: within which it may hand back
    envelope_out: float = 1.5
    envelope_back: float = 1.1
    #: how long it must be beyond before it takes over, in times to travel one ship
    #: length: noise is shorter
    out_lengths: float = 0.25
    runaway_deg: float = 10.0  # how far the ship may turn away from her course, degrees
    back_deg: float = 5.0  # heading error within which it may hand back, degrees
    # how long both must hold before it does, in times to travel one ship length
    calm_lengths: float = 1.0
    # before a planned turn at which it may begin, ship lengths; 0: it is not known
    turn_lengths: float = 8.0

    def __post_init__(self) -> None:
        check_number(self.envelope_out, "limits.envelope_out", at_least=1.0)
        hint = "less than to take over"
        check_number(
            self.envelope_back,
            "limits.envelope_back",
            above=0.0,
            below=self.envelope_out,
            hint=hint,
        )
        check_number(self.runaway_deg, "limits.runaway_deg", above=0.0, at_most=180.0)
        check_number(
            self.back_deg,
            "limits.back_deg",
            above=0.0,
            below=self.runaway_deg,
            hint=hint,
        )
        for name in ("out_lengths", "calm_lengths", "turn_lengths"):
            check_number(getattr(self, name), f"limits.{name}", at_least=0.0)


class ShieldState(NamedTuple):
    """What a shield remembers."""

    #: their own states; both go on while the other steers
    policy: Any
    fallback: Any
    watch: Floats  # of each ship; `interventions` reads it, shape (n, 7) or (7,)


@dataclass(frozen=True, eq=False)
class Interventions:
    """How often and how long a fallback steered, since the episode of each ship began; shapes (n,) or ()."""

    count: NDArray[np.int64]  # how often it took over
    intervals: NDArray[np.int64]  # control intervals that it steered
    steering: Flags  # whether it steers now


def interventions(state: ShieldState) -> Interventions:
    """Read from the state that `Shielded.predict` returned how often and how long the fallback steered."""
    watch = records(state.watch, WATCH)
    count, intervals = (watch[name].astype(np.int64) for name in ("count", "intervals"))
    return Interventions(count, intervals, watch["steered"] != 0.0)


@dataclass(frozen=True, eq=False)
class Shielded:
    """A policy under a safety shield.

    Attributes
    ----------
    policy : Policy
        The policy that steers; any, also a learned one.
    fallback : Controller
        Takes over the rudder; the shaft stays with the policy.
    dt : float
        Control interval, s.
    envelope : Envelope or None
        Of the model.
    limits : Limits
        When the fallback takes over.
    """

    policy: Policy
    fallback: Controller
    dt: float
    envelope: Envelope | None = None
    limits: Limits = Limits()

    def __post_init__(self) -> None:
        check_number(self.dt, "dt", above=0.0)
        if not isinstance(self.fallback, Controller):
            raise InputError(
                f"fallback: {type(self.fallback).__name__} found, expected a controller"
                " of shipgym, such as LQ.from_model(model)"
            )
        names = getattr(self.policy, "observation_names", None)
        scales = getattr(self.policy, "observation_scales", None)
        if names is not None and scales is not None:
            self.fallback.check_fits(names, scales, "fallback")

    @classmethod
    def from_model(
        cls,
        model: ShipModel,
        policy: Policy,
        fallback: Controller | None = None,
        *,
        dt: float | None = None,
        limits: Limits | None = None,
    ) -> Self:
        """Put a policy under a shield with a model's envelope.

        Raises InputError if the fallback or the policy was made for another ship.

        Parameters
        ----------
        model : ShipModel
            The ship; if it has an envelope the shield knows it.
        policy : Policy
            The policy that steers.
        fallback : Controller, optional
            By default `LQ.from_model(model)`.
        dt : float, optional
            Control interval, s; by default that of the environment.
        limits : Limits, optional
            When the fallback takes over.
        """
        interval = (
            control_interval(model) if dt is None else check_number(dt, "dt", above=0.0)
        )
        rescue = LQ.from_model(model, dt=interval) if fallback is None else fallback
        shield = cls(policy, rescue, interval, model.envelope, limits or Limits())
        shield.check_fits_model(model)
        return shield

    @property
    def name(self) -> str:
        """Short name: that of the policy, and that it is shielded."""
        return f"{getattr(self.policy, 'name', type(self.policy).__name__)}-shielded"

    @property
    def observation_names(self) -> tuple[str, ...]:
        """What is observed: what the policy does, or the fallback if the policy does not say."""
        return tuple(
            getattr(self.policy, "observation_names", self.fallback.observation_names)
        )

    @property
    def observation_scales(self) -> tuple[float, ...]:
        """Physical value of each observation of 1, SI units."""
        return tuple(
            getattr(self.policy, "observation_scales", self.fallback.observation_scales)
        )

    def reset(self) -> None:
        """The state with which an episode begins: None, whatever the number of ships."""

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Action, ShieldState]:
        """See `Policy.predict`: the policy's commands, or those with the fallback's rudder."""
        given = np.asarray(observation)
        inner, outer, watch = (None, None, None) if state is None else state
        ours, outer = self.fallback.predict(given, outer, episode_start, deterministic)
        theirs, inner = self.policy.predict(given, inner, episode_start, deterministic)
        action = np.array(theirs, dtype=np.float32)
        watch, _ = begun(watch, episode_start, given.shape[:-1], size_of(WATCH))
        known = records(watch, WATCH)
        self._update(given, np.asarray(~np.isfinite(action).all(axis=-1)), known)
        action[..., 0] = np.where(known["steered"] != 0.0, ours[..., 0], action[..., 0])
        return np.where(np.isfinite(action), action, 0.0), ShieldState(
            inner, outer, watch
        )

    def _update(self, observation: NDArray[Any], broken: Flags, watch: Records) -> None:
        """Decide for each ship who steers, and count."""
        limits, n = self.limits, len(OBSERVATION_NAMES)
        si = (
            observation[..., :n].astype(np.float64)
            * self.fallback.observation_scales[:n]
        )
        seen = dict(zip(OBSERVATION_NAMES, np.moveaxis(si, -1, 0), strict=True))
        error = heading_error(seen)
        turn = self._planned_turn(observation)
        error = error - np.clip(error, np.minimum(-turn, 0.0), np.maximum(-turn, 0.0))
        near = np.abs(error) <= np.radians(limits.back_deg)
        turn = 0.5 * self.dt * (seen["yaw_rate"] + watch["rate"])
        watch["rate"] = seen["yaw_rate"]
        watch["turned"] = np.where(
            near, 0.0, np.maximum(watch["turned"] - np.sign(error) * turn, 0.0)
        )
        out = broken | (watch["turned"] >= np.radians(limits.runaway_deg))
        calm = near & ~broken
        if self.envelope is not None:
            distance = self.envelope.distance(
                seen["surge"], seen["sway"], seen["yaw_rate"], seen["rudder"]
            )
            beyond = distance > limits.envelope_out
            watch["outside"] = np.where(beyond, watch["outside"] + 1.0, 0.0)
            out |= beyond & (watch["outside"] >= self._intervals(limits.out_lengths))
            calm &= distance <= limits.envelope_back
        steered = watch["steered"] != 0.0
        watch["quiet"] = np.where(steered & calm, watch["quiet"] + 1.0, 0.0)
        over = watch["quiet"] >= self._intervals(limits.calm_lengths)
        now = (steered & ~over) | out
        watch["steered"] = now
        watch["count"] += now & ~steered
        watch["intervals"] += now

    def _planned_turn(self, observation: NDArray[Any]) -> Any:
        """Angle of a turn that may begin, rad; 0 where none is near or none is observed."""
        names, scales = self.observation_names, self.observation_scales
        which = next((one for one in TURNS if {*one} <= {*names}), None)
        if which is None:
            return 0.0
        at = [names.index(name) for name in which]
        distance, angle = (
            observation[..., k].astype(np.float64) * scales[k] for k in at
        )
        length = scales[names.index("surge")] / scales[names.index("yaw_rate")]
        return np.where(distance <= self.limits.turn_lengths * length, angle, 0.0)

    def _intervals(self, lengths: float) -> float:
        """Control intervals in times to travel one ship length; one at least."""
        length_time = (
            1.0 / self.fallback.observation_scales[OBSERVATION_NAMES.index("yaw_rate")]
        )
        return max(1.0, lengths * length_time / self.dt)

    def check_fits(
        self, names: Sequence[str], scales: Sequence[float], where: str = "observations"
    ) -> None:
        """Refuse what shows other quantities first, or in other scales, than policy and fallback know.

        Arguments and errors as in `Controller.check_fits`.
        """
        for one in (self.policy, self.fallback):
            if (check := getattr(one, "check_fits", None)) is not None:
                check(names, scales, where)

    def check_fits_model(self, model: ShipModel) -> None:
        """Refuse a ship that policy or fallback was not made for."""
        for one in (self.policy, self.fallback):
            if (check := getattr(one, "check_fits_model", None)) is not None:
                check(model)

    def save(self, path: str | Path) -> None:
        """Write policy and fallback as one file (fields in docs/policies.md)."""
        write_policy(*self.file_fields(), Path(path))

    def file_fields(self) -> tuple[dict[str, Any], Tensors]:
        """What stands in its JSON, and the weights of its policy by name."""
        if not isinstance(self.policy, Controller | LearnedPolicy | Shielded):
            raise InputError(
                f"policy: {type(self.policy).__name__} found, expected a learned policy"
                " or a controller of shipgym for a file"
            )
        policy, tensors = self.policy.file_fields()
        content = {
            "format": FORMAT,
            "kind": "shielded",
            "policy": policy,
            "fallback": self.fallback.to_dict(),
            "dt": self.dt,
            "envelope": None if self.envelope is None else self.envelope.to_dict(),
            "limits": asdict(self.limits),
        }
        return content, {f"policy.{name}": tensor for name, tensor in tensors.items()}
