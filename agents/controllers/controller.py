"""The classical autopilots' common part: from what the environment shows to the rudder.

A controller is a list of gains on deviations from straight running. By itself it keeps
no state: the integral of the heading error, with its anti-windup, is part of the
observation.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.controllers.linear_loop import (
    SIGNALS,
    Compensator,
    Margins,
    SampledShip,
    sample_ship,
)
from agents.controllers.memory import (
    Flags,
    Floats,
    begun,
    checked_observation,
    deviations,
    size_of,
)
from shipgym import InputError, ShipModel
from shipgym.arrays import finite
from shipgym.files import write_json
from shipgym.tasks.task import OBSERVATION_NAMES, observation_scales

Action = NDArray[np.float32]

FORMAT = 1  # of the controller file
SMALL = 1e-5  # rad, and other SI units, of motions about straight running
SCALE_TOLERANCE = 1e-6  # relative difference of observation scales that is rounding


class Range(NamedTuple):
    """Least and largest value of a number, and what it is where an older file lacks it."""

    least: float
    largest: float
    default: float | None = None


#: Of gains and other numbers that no controller says more about, and of observation
#: scales; SI units.
NUMBERS, SCALES = Range(-1e9, 1e9), Range(1e-9, 1e9)


class Policy(Protocol):
    """Anything that steers: controllers of shipgym, agents of stable-baselines3, your own."""

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Any, Any]:
        """Commands for one or many observations, with the signature of stable-baselines3.

        Raises InputError if the observation has fewer entries or another number of
        dimensions, or the state is not one of as many ships.

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


@dataclass(frozen=True, eq=False)
class Controller:
    """Feedback of deviations from straight running to the commanded rudder.

    Attributes
    ----------
    gains : dict of str to float
        By the names in `feedback`, SI units: rad of rudder per rad, rad/s, rad s or
        m/s.
    neutral_rudder : float
        Rudder at which the ship runs straight, rad.
    neutral_sway : float
        Sway speed in straight running, m/s.
    margins : Margins
        Of the loop with the model it was designed on.
    observation_scales : tuple of float
        Physical value of each observation of 1, SI units; the rudder's is also the
        action's.
    model_name, model_sha256 : str
        The model it was designed on, and a hash of its structure and numbers.
    design : dict of str to float
        How it was designed: settings and intermediate results.
    observation_names : tuple of str
        What it observes.
    """

    kind: ClassVar[str] = ""
    #: For each gain the signal it acts on and the sign with which it does.
    feedback: ClassVar[Mapping[str, tuple[str, float]]] = {}
    #: What it observes, and names of its gains where not those of `feedback`.
    observes: ClassVar[tuple[str, ...]] = OBSERVATION_NAMES
    gain_names: ClassVar[tuple[str, ...]] = ()
    #: What it reads of the ship beside her heading, where that does not follow from
    #: `feedback`.
    reads: ClassVar[tuple[str, ...]] = ("yaw_rate", "sway", "surge", "rudder")
    #: Numbers that it remembers of each ship, by name
    #: (`agents.controllers.memory.records`).
    record: ClassVar[np.dtype[Any]] = np.dtype([])
    #: Whether it leads another controller, its `autopilot`, which the file holds too.
    has_autopilot: ClassVar[bool] = False
    has_ship: ClassVar[bool] = (
        False  # whether the file holds its design model, its `ship`, too
    )
    #: Arrays that the file holds beside the gains: names of fields, and their axes: a
    #: length, or its name.
    arrays: ClassVar[Mapping[str, tuple[str | int, ...]]] = {}
    #: What it needs of `design`, with its range; also ranges of gains that are not any
    #: number.
    ranges: ClassVar[Mapping[str, Range]] = {"dt": Range(1e-3, 1e4)}

    gains: dict[str, float]
    neutral_rudder: float
    neutral_sway: float
    margins: Margins
    observation_scales: tuple[float, ...]
    model_name: str
    model_sha256: str
    design: dict[str, float] = field(default_factory=dict)
    observation_names: tuple[str, ...] = OBSERVATION_NAMES

    @classmethod
    def designed(
        cls,
        model: ShipModel,
        ship: SampledShip,
        gains: dict[str, float],
        design: dict[str, float],
        **more: Any,
    ) -> Self:
        """The controller with these gains, its margins computed.

        `model`: that it was designed on; `ship`: the same, linearised and sampled;
        `gains`: by the names of `feedback`; `design`: how they were found; `more`:
        further fields of the class. Raises InputError if the closed loop is unstable.
        """
        unknown, scales = (
            Margins(np.nan, np.nan, np.nan, np.nan),
            tuple(observation_scales(model).tolist()),
        )
        found = cls(
            gains=gains,
            neutral_rudder=ship.about.rudder,
            neutral_sway=ship.about.sway,
            margins=unknown,
            observation_scales=scales,
            model_name=model.name,
            model_sha256=model_hash(model),
            design={"dt": ship.dt, **design},
            **more,
        )
        return replace(found, margins=found._margins(ship, model))

    def _margins(self, ship: SampledShip, model: ShipModel) -> Margins:
        return self.loop().margins(
            ship, f"{type(self).__name__} on model '{model.name}'"
        )

    def loop(self) -> Compensator:
        """The controller for small motions, without limits: what its margins are computed from."""
        return Compensator.static(self.row[None])

    def linearised(self) -> Compensator:
        """Its law about straight running, by central differences: `loop` where the law is linear there."""
        n, size = len(SIGNALS), self.memory_size
        small = SMALL * np.concatenate([np.eye(n + size), -np.eye(n + size)])
        sway, rate, error, rudder, integral = small[:, :n].T
        seen = {
            "heading_error_sin": np.sin(error),
            "heading_error_cos": np.cos(error),
            "yaw_rate": rate,
            "sway": self.neutral_sway + sway,
            "rudder": self.neutral_rudder + rudder,
            "heading_error_integral": integral,
        }
        order, kept = self.steer(
            seen, small[:, n:], np.zeros(len(small), dtype=np.bool_)
        )
        above, below = np.split(np.column_stack([order, kept]), 2)
        slopes = (above - below).T / (2.0 * SMALL)
        return Compensator(
            slopes[1:, n:], slopes[1:, :n], slopes[:1, n:], slopes[:1, :n]
        )

    @property
    def row(self) -> Floats:
        """Feedback of the deviations in the order of `linear_loop.SIGNALS`, shape (5,).

        With gains of n ships at once, as arrays of shape (n,), it is of shape (5, n).
        """
        by_signal = {
            signal: sign * self.gains[gain]
            for gain, (signal, sign) in self.feedback.items()
        }
        nothing = 0.0 * next(iter(by_signal.values()), 0.0)  # of each ship
        return np.array([by_signal.get(signal, nothing) for signal in SIGNALS])

    def margins_on(self, model: ShipModel) -> Margins:
        """Margins and bandwidth of the same controller on another ship.

        Raises InputError if the closed loop is unstable, or the model has no straight
        course.
        """
        return self._margins(sample_ship(model, self.design["dt"]), model)

    def reset(self) -> None:
        """The state with which an episode begins: None, whatever the number of ships.

        What there is to remember is in the state that `predict` returns, so one
        controller may steer any number of episodes side by side.
        """

    @property
    def name(self) -> str:
        """Short name: `pid`, `lq`."""
        return self.kind

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Action, Any]:
        """See `Policy.predict`; the state is an array of shape (memory_size,) or (n, memory_size).

        A controller that remembers nothing returns the state as given.
        """
        n, size = len(self.observation_names), self.memory_size
        given = checked_observation(observation, self.observation_names)
        shape, rows = (
            given.shape[:-1],
            np.atleast_2d(given)[:, :n] * self.observation_scales,
        )
        memory, begins = begun(state if size else None, episode_start, shape, size)
        seen = dict(zip(self.observation_names, rows.T, strict=True))
        order, kept = self.steer(
            seen, memory.reshape(len(rows), size), begins.reshape(-1)
        )
        action = np.clip(order / self.rudder_limit, -1.0, 1.0)[:, None].astype(
            np.float32
        )
        return action.reshape(*shape, 1), kept.reshape(*shape, size) if size else state

    @property
    def rudder_limit(self) -> float:
        """Largest rudder angle, rad."""
        return self.observation_scales[self.observation_names.index("rudder")]

    @property
    def memory_size(self) -> int:
        """How many numbers it remembers of each ship: in the state, never in the controller itself."""
        return size_of(self.record)

    def steer(
        self, seen: dict[str, Floats], memory: Floats, begins: Flags
    ) -> tuple[Floats, Floats]:
        """Commanded rudder and what is remembered next.

        `seen`: what is observed by name, SI units, each of shape (n,); `memory`: zeros
        where an episode begins, shape (n, memory_size); `begins`: whether it does,
        shape (n,). Returns `order`: rad, not yet limited, shape (n,); `memory`: shape
        (n, memory_size).
        """
        found = deviations(seen, self.neutral_rudder, self.neutral_sway)
        rows = np.broadcast_to(self.row.T, found.shape)
        return self.neutral_rudder + np.einsum("ij,ij->i", found, rows), memory

    def check_fits(
        self, names: Sequence[str], scales: Sequence[float], where: str = "observations"
    ) -> None:
        """Refuse to steer what shows other quantities first, or in other scales, than those designed for.

        `names`, `scales`: `observation_names` and `observation_scales` of an
        environment; it may show more than what is steered by; `where`: start of the
        message. Raises InputError naming the first difference.
        """
        meant = (
            f"controller '{self.name}' was designed for {{}} (model"
            f" '{self.model_name}'): another ship or rudder limit; design a controller"
            f" on this model with {type(self).__name__}.from_model"
        )
        check_names(names[: len(self.observation_names)], self.observation_names, where)
        check_scales(names, scales, self.observation_scales, where, meant)

    def check_fits_model(self, model: ShipModel) -> None:
        """Refuse a ship with other observation scales (length, service speed, rudder limit)."""
        self.check_fits(
            OBSERVATION_NAMES,
            observation_scales(model).tolist(),
            f"model '{model.name}'",
        )

    def save(self, path: str | Path) -> None:
        """Write the controller as a JSON file, whose fields are listed in docs/deployment.md.

        Raises InputError if the folder does not exist or cannot be written.
        """
        write_json(self.to_dict(), Path(path))

    def file_fields(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """What stands in its JSON, and its weights by name: it has none."""
        return self.to_dict(), {}

    def to_dict(self) -> dict[str, Any]:
        """What the controller's file holds."""
        margins = asdict(self.margins)
        arrays = {name: getattr(self, name).tolist() for name in self.arrays}
        return {
            "format": FORMAT,
            "kind": self.kind,
            "observation_names": list(self.observation_names),
            "observation_scales": list(self.observation_scales),
            "gains": self.gains,
            "neutral_rudder": self.neutral_rudder,
            "neutral_sway": self.neutral_sway,
            "model": {"name": self.model_name, "sha256": self.model_sha256},
            "margins": {name: finite(value) for name, value in margins.items()},
            "design": self.design,
            **({"arrays": arrays} if arrays else {}),
        }


def check_names(found: Sequence[str], expected: Sequence[str], where: str) -> None:
    """Refuse observations by other names or in another order, naming the first difference."""
    for i, (one, other) in enumerate(zip(found, expected, strict=False)):
        if one != other:
            raise InputError(f"{where}: observation {i} is '{one}', expected '{other}'")
    if len(found) != len(expected):
        difference = [
            name
            for name in (*found, *expected)
            if (name in found) != (name in expected)
        ]
        raise InputError(
            f"{where}: {len(found)} observations found, expected {len(expected)}; "
            f"in one and not in the other: {', '.join(difference)}"
        )


def check_scales(
    names: Sequence[str],
    scales: Sequence[float],
    own: Sequence[float],
    where: str,
    meant: str,
) -> None:
    """Refuse observations in other scales than an agent's own; `meant` says more, with {} for its scale."""
    for name, one, other in zip(names, scales, own, strict=False):
        if abs(one - other) > SCALE_TOLERANCE * abs(other):
            said = meant.replace("{}", f"{other:g}")
            raise InputError(f"{where}: the scale of '{name}' is {one:g}, but {said}")


def model_hash(model: ShipModel) -> str:
    """SHA-256 of a model's structure, coefficients, particulars and steering gear."""
    ship, gear = model.particulars.to_dict(), model.steering.to_dict()
    content = [model.dynamics.to_dict(), model.coefficients, ship, gear]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
