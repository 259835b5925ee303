"""Common part of the classical autopilots: from observations to the rudder."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.controllers.helm import CORNERS, HelmSettings, wave_filter
from agents.controllers.interface import Fitting, model_hash
from agents.controllers.law import (
    Gains,
    Helm,
    HelmMemory,
    Law,
    LinearFeedback,
    Number,
    Signals,
    linear_law,
)
from agents.controllers.linear_loop import (
    SIGNALS,
    SampledShip,
    sample_ship,
)
from agents.controllers.margins import Compensator, Margins
from agents.controllers.memory import (
    checked_observation,
    from_columns,
    next_rows,
    recalled,
    to_rows,
)
from agents.settings import Settings
from shipgym import InputError, ShipModel
from shipgym.arrays import Flags, Floats, finite
from shipgym.engine.records import Record, leaves
from shipgym.files import write_json
from shipgym.models.linear import nomoto
from shipgym.tasks.scales import OBSERVATION_NAMES, observation_scales

Action = NDArray[np.float32]

FORMAT = 1  # of the controller file
SMALL = 1e-5  # rad, and other SI units, of motions about straight running
#: Fields that the file holds as they are.
PLAIN = (
    "kind",
    "observation_names",
    "observation_scales",
    "gains",
    "neutral_rudder",
    "neutral_sway",
    "design",
)
UNKNOWN_MARGINS = Margins(np.nan, np.nan, np.nan, np.nan)


class Bounds(NamedTuple):
    """Least and largest value of a number in a controller file."""

    least: float
    largest: float


#: Of gains and other numbers that no controller says more about, SI units.
ANY_NUMBER = Bounds(-1e9, 1e9)
POSITIVE = Bounds(1e-6, 1e9)


@dataclass(frozen=True, eq=False)
class Controller(Fitting):
    """Feedback of deviations from straight running to the commanded rudder.

    A controller keeps no state: what there is to remember of each ship is in the state
    that `predict` returns, so one controller may steer any number of episodes side by
    side.

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
    #: Settings of `from_model`, where a search may vary them.
    settings_type: ClassVar[type[Settings] | None] = None
    #: For each gain the signal it acts on and the sign with which it does.
    feedback: ClassVar[Mapping[str, tuple[str, float]]] = {}
    #: Names of its gains, where they are not those of `feedback` and `HELM`.
    gain_names: ClassVar[tuple[str, ...]] = ()
    #: What it observes of the environment.
    observes: ClassVar[tuple[str, ...]] = OBSERVATION_NAMES
    #: What it observes too where that is shown next.
    may_observe: ClassVar[tuple[str, ...]] = ()
    #: Its law (`agents.controllers.law`), and the record of what that remembers of each
    #: ship.
    law: ClassVar[Any] = staticmethod(linear_law)
    memory_record: ClassVar[Record] = HelmMemory
    #: What its law reads of `Signals` beside the heading error and its integral.
    reads: ClassVar[tuple[str, ...]] = ("yaw_rate", "sway", "surge")
    #: Whether it leads another controller, its `autopilot`, which the file holds too.
    has_autopilot: ClassVar[bool] = False
    #: Whether the file holds its design model too, its `ship`.
    has_ship: ClassVar[bool] = False
    #: Fields that are arrays, which the file holds too, and how many axes they have.
    arrays: ClassVar[Mapping[str, int]] = {}
    #: What it needs of `design`, with bounds; also bounds of gains that are not any
    #: number.
    bounds: ClassVar[Mapping[str, Bounds]] = {"dt": Bounds(1e-3, 1e4)}

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
        """Make the controller with these gains, and compute its margins.

        Raises InputError if the closed loop is unstable.

        Parameters
        ----------
        model : ShipModel
            What it was designed on.
        ship : SampledShip
            The same, linearised and sampled.
        gains : dict of str to float
            By the names of `feedback`; those of the helm (`HelmSettings.helm`) are by
            default without filters.
        design : dict of str to float
            How they were found; Nomoto's K and T are added.
        **more
            Further fields of the class.
        """
        scales = observation_scales(model).tolist()
        response = nomoto(model)
        answer = {"nomoto_K": response.K, "nomoto_T": response.T}
        made = cls(
            gains={**HelmSettings().helm(model, ship.dt), **gains},
            neutral_rudder=ship.about.rudder,
            neutral_sway=ship.about.sway,
            margins=UNKNOWN_MARGINS,
            observation_scales=tuple(scales),
            model_name=model.name,
            model_sha256=model_hash(model),
            design={"dt": ship.dt, **design, **answer},
            **more,
        )
        return made.filtering_waves(model)

    def filtering_waves(self, model: ShipModel) -> Self:
        """Complete a design: its margins, and the lowest corner of its wave filter.

        The corner is the lowest that leaves 6 dB and 30 degrees, so that most of the
        waves is kept from the rudder. Raises InputError if the closed loop is unstable.
        """
        if not np.any(self.gains.get("wave_period", 0.0)):
            return replace(self, margins=self.margins_on(model))
        for corner in CORNERS:
            made = replace(self, gains={**self.gains, "wave_corner": corner})
            try:
                made = replace(made, margins=made.margins_on(model))
            except InputError:
                if corner == CORNERS[-1]:
                    raise
                continue
            if made.margins.is_enough:
                break
        return made

    @property
    def name(self) -> str:
        """Short name: `pid`, `lq`."""
        return self.kind

    @property
    def rudder_limit(self) -> float:
        """Largest rudder angle, rad."""
        return self.observation_scales[self.observation_names.index("rudder")]

    @property
    def service_speed(self) -> float:
        """Speed that it was designed for, m/s."""
        return self.observation_scales[self.observation_names.index("surge")]

    @property
    def memory_size(self) -> int:
        """Count of the numbers that `predict` keeps of each ship in its state."""
        return len(leaves(self.memory_record))

    @property
    def memory_names(self) -> list[str]:
        """Names of the numbers that it keeps of each ship."""
        return [name.rpartition(".")[2] for name in leaves(self.memory_record)]

    @cached_property
    def parameters(self) -> Any:
        """Parameters of its law, a record."""
        return self.linear_feedback

    @property
    def linear_feedback(self) -> LinearFeedback:
        """Gains by the signals that they act on, the neutral point and the helm."""
        by_signal = dict.fromkeys(SIGNALS, 0.0)
        for gain, (signal, sign) in self.feedback.items():
            by_signal[signal] = sign * self.gains[gain]
        gains = self.gains
        helm = Helm(
            wave=wave_filter(
                gains["wave_period"],
                gains["wave_corner"],
                self.design["dt"],
            ),
            update=gains["rudder_update"],
            band=gains["rudder_band"],
            gear_share=gains["gear_share"],
            gear_step=gains["gear_step"],
            limit=self.rudder_limit,
        )
        return LinearFeedback(
            gains=Gains(**by_signal),
            neutral_rudder=self.neutral_rudder,
            neutral_sway=self.neutral_sway,
            service_speed=self.service_speed,
            schedule=gains["schedule"],
            helm=helm,
        )

    @property
    def needed_signals(self) -> tuple[str, ...]:
        """Signals of `reads` that have an effect."""
        if not self.is_closed_form() or self.law is not linear_law:
            return self.reads
        effects = {**self.parameters.gains._asdict(), "surge": self.gains["schedule"]}
        return tuple([name for name in self.reads if effects[name] != 0.0])

    @classmethod
    def is_closed_form(cls) -> bool:
        """Return True if it steers by its `law` alone, which can be translated to C."""
        return cls.steer is Controller.steer

    def steer(self, seen: Signals, memory: Any) -> tuple[Number, Any]:
        """Evaluate the law once.

        Parameters
        ----------
        seen : Signals
            SI units, each number an array of shape (n_ships,).
        memory : NamedTuple
            A `memory_record` of such arrays; zeros where an episode begins.

        Returns
        -------
        order : array of shape (n_ships,)
            Rudder, rad, not yet limited.
        memory : NamedTuple
            For the next interval.
        """
        law: Law = self.law
        return law(seen, memory, self.parameters)

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Action, Any]:
        """See `Policy.predict`.

        The state is an array of shape (memory_size,) or (n, memory_size). A controller
        that remembers nothing returns the state as given.
        """
        given = checked_observation(observation, self.observation_names)
        shape = given.shape[:-1]
        memory = self._memory_of(state, episode_start, shape)
        seen = self.signals(np.atleast_2d(given))
        order, after = self.steer(seen, memory)

        part = np.clip(order / self.rudder_limit, -1.0, 1.0)
        action = part.astype(np.float32).reshape(*shape, 1)
        if self.memory_size:
            n_ships = len(seen.heading_error)
            rows = next_rows(after, memory, n_ships)
            state = rows.reshape(*shape, self.memory_size)
        return action, state

    def after_order(self, state: Any, action: Action) -> Any:
        """State where another order than its own was given, as beside a policy.

        Its model of the gear follows that order then. `action`: shape (..., 1).
        """
        names = self.memory_names
        if "given" not in names:
            return state
        told = np.array(state)
        order = action[..., 0] * self.rudder_limit
        told[..., names.index("given")] = order - self.neutral_rudder
        return np.where(np.isfinite(told), told, state)

    def _memory_of(self, state: Any, episode_start: Any, shape: tuple[int, ...]) -> Any:
        """Record of what is remembered of ships of a shape, from a state."""
        size = self.memory_size
        kept = recalled(state if size else None, episode_start, shape, size)
        n_ships = math.prod(shape)
        columns = kept.reshape(n_ships, size).T
        return from_columns(self.memory_record, iter(columns))

    def signals(self, observations: Floats) -> Signals:
        """Signals by observations of shape (n_ships, n_observations), SI units."""
        known = self.observed(observations)
        error = np.arctan2(
            known["heading_error_sin"],
            known["heading_error_cos"],
        )
        return Signals(
            sway=known["sway"],
            yaw_rate=known["yaw_rate"],
            heading_error=error,
            rudder=known["rudder"],
            heading_error_integral=known["heading_error_integral"],
            surge=known["surge"],
            last_order=known["last_command"],
        )

    def observed(self, observations: Floats) -> dict[str, Floats]:
        """Observations by name in SI units, each of shape (n_ships,)."""
        first = observations[:, : len(self.observation_names)]
        columns = (first * self.observation_scales).T
        return dict(zip(self.observation_names, columns, strict=True))

    def loop(self) -> Compensator:
        """Linear controller for small motions, without limits, for the margins.

        It is the law about straight running, by central differences, once the episode
        has begun, without a dead-band, which small motions would never leave, and
        without the rate of the gear, which they never reach.
        """
        unlimited = {"rudder_band": 0.0, "gear_step": 1e6}
        gains = {**self.gains}
        gains |= {name: unlimited[name] for name in unlimited if name in gains}
        small_law = replace(self, gains=gains)
        n_signals = len(SIGNALS)
        remembered = np.array(self.memory_names) != "started"
        n_inputs = n_signals + int(remembered.sum())
        small = SMALL * np.eye(n_inputs)
        above = small_law._response(small, remembered)
        below = small_law._response(-small, remembered)

        slopes = (above - below).T / (2.0 * SMALL)
        order = slice(1)
        memory = slice(1, None)
        by_signals = slopes[:, :n_signals]
        by_memory = slopes[:, n_signals:]
        return Compensator(
            A=by_memory[memory],
            B=by_signals[memory],
            C=by_memory[order],
            D=by_signals[order],
        )

    def _response(self, deviations: Floats, remembered: Flags) -> Floats:
        """Order and memory of the law for small motions and memories.

        Parameters
        ----------
        deviations : array of shape (n_ships, n_signals + n_remembered)
            Of signals and memories from straight running.
        remembered : bool array of shape (memory_size,)
            The numbers of the memory that vary; the others are 1.

        Returns
        -------
        array of shape (n_ships, 1 + n_remembered)
        """
        n_ships = len(deviations)
        motions = Gains(*deviations.T[: len(SIGNALS)])
        zero = np.zeros(n_ships)
        seen = Signals(
            sway=self.neutral_sway + motions.sway,
            yaw_rate=motions.yaw_rate,
            heading_error=motions.heading_error,
            rudder=self.neutral_rudder + motions.rudder,
            heading_error_integral=motions.heading_error_integral,
            surge=zero + self.service_speed,
            last_order=zero,
        )
        kept = np.ones((len(remembered), n_ships))
        kept[remembered] = deviations.T[len(SIGNALS) :]
        memory = from_columns(self.memory_record, iter(kept))

        order, after = self.steer(seen, memory)
        rows = to_rows(after, n_ships)
        return np.column_stack([order, rows[:, remembered]])

    def margins_on(self, model: ShipModel) -> Margins:
        """Margins of the same controller on another ship.

        Raises InputError if the closed loop is unstable, or the model has no straight
        course.
        """
        name = f"{type(self).__name__} on model '{model.name}'"
        return self.loop().margins(sample_ship(model, self.design["dt"]), name)

    @property
    def remedy(self) -> str:
        """What to do where it does not fit."""
        return (
            f"controller '{self.name}' was designed on another ship or rudder limit"
            f" (model '{self.model_name}'); design one on this model with"
            f" {type(self).__name__}.from_model"
        )

    def save(self, path: str | Path) -> None:
        """Write the controller as a JSON file (fields: docs/deployment.md).

        Raises InputError if the folder does not exist or cannot be written.
        """
        write_json(self.to_dict(), Path(path))

    def to_dict(self) -> dict[str, Any]:
        """Content of the controller's file."""
        margins = asdict(self.margins)
        content = {
            "format": FORMAT,
            **{name: getattr(self, name) for name in PLAIN},
            "model": {"name": self.model_name, "sha256": self.model_sha256},
            "margins": {name: finite(value) for name, value in margins.items()},
        }
        if self.arrays:
            arrays = {name: getattr(self, name).tolist() for name in self.arrays}
            content["arrays"] = arrays
        return content
