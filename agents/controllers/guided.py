"""Guidance along a path over any heading autopilot.

The path-following environment shows the heading error against its own line-of-sight
course. Guidance works out another course and hands the heading error against that to
the autopilot. A guidance law is a law (`agents.controllers.law`) that reads
`PathSignals` and returns the course to steer against the direction of the path beside
the ship, rad.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.controllers.controller import POSITIVE, Action, Bounds, Controller
from agents.controllers.law import (
    Law,
    Nothing,
    Number,
    PathSignals,
    Turns,
    clipped,
    gathered,
    wrapped,
)
from agents.controllers.lq import LQ
from agents.controllers.margins import Compensator
from agents.controllers.memory import (
    checked_observation,
    from_columns,
    next_rows,
    on_course,
    recalled,
)
from agents.settings import Settings, Step, setting
from shipgym import InputError, ShipModel
from shipgym.arrays import Floats
from shipgym.models.by_name import takes_name
from shipgym.tasks.scales import OBSERVATION_NAMES
from shipgym.tasks.task import Task, path_following_task

Observations = NDArray[np.float32]

N_HEADING = len(OBSERVATION_NAMES)  # observations of a heading autopilot
COURSE_ERROR = ("course_error_sin", "course_error_cos")
#: Observations of the turns ahead, in the order of `Turns`.
TURNS = (
    "next_turn_distance",
    "next_turn_angle",
    "second_turn_distance",
    "second_turn_angle",
)


class GuidanceMemory(NamedTuple):
    """Memory of guidance, each number of shape (n_ships,)."""

    law: Any  # of the guidance law
    integral: Number  # rad s, of the heading error
    started: Number  # 0 where an episode begins, else 1


@dataclass(frozen=True)
class GuidanceSettings(Settings):
    """Settings of all guidance."""

    lookahead_lengths: float | None = setting(
        "lookahead, ship lengths; by default that of the task. Longer turns gentler,"
        " shorter comes back sooner",
        None,
        above=0.0,
        search=Step(0.5),
    )

    def completed(
        self, model: ShipModel, task: Task, autopilot: Controller | None = None
    ) -> Self:
        """Fill in what follows from a model, a task and the autopilot that is led."""
        if self.lookahead_lengths is not None:
            return self
        return replace(self, lookahead_lengths=task.lookahead)

    def design(self, model: ShipModel, task: Task) -> dict[str, Any]:
        """How the gains were found, for the file; of whole settings."""
        return self.to_dict()


@dataclass(frozen=True, eq=False, kw_only=True)
class Guided(Controller):
    """A heading autopilot that is led along a path.

    The state that `predict` takes and returns is a pair: what the guidance remembers of
    each ship, and the autopilot's own state.
    """

    observes: ClassVar[tuple[str, ...]] = (*OBSERVATION_NAMES, "cross_track")
    gain_names: ClassVar[tuple[str, ...]] = ("lookahead", "task_lookahead")
    #: What its law reads of `PathSignals` beside the heading error.
    reads: ClassVar[tuple[str, ...]] = ("cross_track",)
    has_autopilot = True
    settings_type = GuidanceSettings
    leads: ClassVar[type[Controller]] = Controller
    #: Record of what its law reads of its gains and its design.
    parameters_record: ClassVar[Any] = Nothing
    bounds: ClassVar[Mapping[str, Bounds]] = {
        **Controller.bounds,
        **dict.fromkeys(("lookahead", "task_lookahead"), POSITIVE),
    }

    autopilot: Controller  # steers by the first eight observations

    def __post_init__(self) -> None:
        self.check_leads(self.autopilot)

    @cached_property
    def parameters(self) -> Any:
        """See `Controller.parameters`."""
        known = {**self.design, **self.gains}
        record = self.parameters_record
        return record(*[known[name] for name in record._fields])

    @classmethod
    @takes_name
    def from_model(
        cls,
        model: ShipModel,
        *,
        autopilot: Controller | None = None,
        task: Task | None = None,
        **settings: Any,
    ) -> Self:
        """Lead an autopilot along the paths of a task.

        Raises InputError if a setting is out of its range, the autopilot keeps no
        heading or was designed for another ship, or the task has no path or does not
        show what guidance observes.

        Parameters
        ----------
        model : ShipModel
            The ship; MPC simulates her in the current observed.
        autopilot : Controller, optional
            Any that keeps a heading, of `PreviewLQ` and `MPC` an LQ; by default
            `LQ.from_model(model)`.
        task : Task, optional
            Its path, lookahead and control interval are used, and by `MPC` its weights;
            by default the environment's own.
        **settings
            Fields of the class's `settings_type`.
        """
        asked = with_path(task)
        dt = asked.interval(model)
        pilot = LQ.from_model(model, dt=dt) if autopilot is None else autopilot
        cls.check_leads(pilot)
        pilot.check_fits_model(model)

        own: Any = cls.settings_type(**settings)
        own = own.completed(model, asked, pilot)
        scales = cls.observed_in(asked, model)
        gains = own.gains(model, asked, pilot)
        task_lookahead = asked.lookahead * model.particulars["length"]
        design_model = {"ship": model} if cls.has_ship else {}
        return cls(
            gains={**gains, "task_lookahead": task_lookahead},
            neutral_rudder=pilot.neutral_rudder,
            neutral_sway=pilot.neutral_sway,
            margins=pilot.margins,
            observation_scales=tuple(scales.values()),
            observation_names=tuple(scales),
            model_name=pilot.model_name,
            model_sha256=pilot.model_sha256,
            design={"dt": dt, **own.design(model, asked)},
            autopilot=pilot,
            **design_model,
        )

    @classmethod
    def check_leads(cls, autopilot: Any) -> None:
        """Refuse an autopilot that it cannot lead."""
        if not isinstance(autopilot, cls.leads) or autopilot.has_autopilot:
            other = "LQ" if cls.leads is LQ else "a controller that keeps a heading"
            raise InputError(
                f"autopilot: expected {other}, got {type(autopilot).__name__}"
            )

    @classmethod
    def observed_in(cls, task: Task, model: ShipModel) -> dict[str, float]:
        """Scales of what it observes; InputError for what a task does not show."""
        shown = {quantity.name: quantity.scale for quantity in task.observed(model)}
        names = cls.observes
        following = tuple(shown)[len(names) : len(names) + len(cls.may_observe)]
        if following == cls.may_observe:
            names += following
        for name in names:
            if name not in shown:
                raise InputError(
                    f"task: expected one that shows '{name}', got '{task.name}'"
                )
        return {name: shown[name] for name in names}

    @classmethod
    def is_closed_form(cls) -> bool:
        """Return True if it guides by its `law` alone."""
        return cls.course is Guided.course

    def course(self, seen: PathSignals, memory: Any) -> tuple[Number, Any]:
        """Evaluate the guidance law once.

        Parameters
        ----------
        seen : PathSignals
            SI units, each number an array of shape (n_ships,).
        memory : NamedTuple
            A `memory_record` of such arrays; zeros where an episode begins.

        Returns
        -------
        course : array of shape (n_ships,)
            To steer, against the direction of the path beside the ship, rad.
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
        """See `Policy.predict`; the state is a pair, of guidance and of the autopilot.

        The observation is that of the path-following environment.
        """
        given = checked_observation(observation, self.observation_names)
        rows = np.atleast_2d(given)
        shape = given.shape[:-1]
        own, inner = (None, None) if state is None else state
        memory = self._recalled(own, episode_start, shape)

        rows_shown, after = self._guided(rows, memory)
        shown = rows_shown.reshape(*shape, N_HEADING)
        starts = None if inner is None else memory.started == 0.0
        action, inner = self.autopilot.predict(shown, inner, starts, deterministic)

        own = next_rows(after, memory, len(rows)).reshape(*shape, -1)
        return action, (own, inner)

    def after_order(self, state: Any, action: Action) -> Any:
        """See `Controller.after_order`."""
        own, inner = state
        return own, self.autopilot.after_order(inner, action)

    def _guided(
        self, rows: Floats, memory: GuidanceMemory
    ) -> tuple[Observations, GuidanceMemory]:
        """Observations for the autopilot, of course keeping, and the next memory."""
        seen = self.path_signals(rows)
        course, law = self.course(seen, memory.law)
        error = wrapped(seen.heading_error + course)
        reach = self.observation_scales[N_HEADING - 1]
        integral = gathered(
            memory.integral,
            error,
            started=memory.started,
            dt=self.design["dt"],
            reach=reach,
        )
        shown = on_course(rows[:, :N_HEADING], error, integral, reach)
        after = GuidanceMemory(law, integral, started=np.ones(len(rows)))
        return shown, after

    def _recalled(
        self, own: Any, episode_start: Any, shape: tuple[int, ...]
    ) -> GuidanceMemory:
        """Memory of ships of a shape, zeros where an episode begins."""
        size = self.memory_size + 2  # the integral and whether it started
        kept = recalled(own, episode_start, shape, size)
        columns = iter(kept.reshape(-1, size).T)
        return GuidanceMemory(
            law=from_columns(self.memory_record, columns),
            integral=next(columns),
            started=next(columns),
        )

    def path_signals(self, observations: Floats) -> PathSignals:
        """Signals by observations of shape (n_ships, n_observations), SI units."""
        known = self.observed(observations)
        zero = np.zeros(len(observations))
        error = np.arctan2(
            known["heading_error_sin"],
            known["heading_error_cos"],
        )
        course_error = np.arctan2(  # 0 where it is not shown
            known.get("course_error_sin", zero),
            known.get("course_error_cos", zero),
        )
        turns = Turns(*[known.get(name, zero) for name in TURNS])
        seen = PathSignals(
            heading_error=error,
            cross_track=known["cross_track"],
            drift=error - course_error,
            sway=known["sway"],
            surge=known["surge"],
            yaw_rate=known["yaw_rate"],
            rudder=known["rudder"],
            roll=known.get("roll", zero),
            roll_rate=known.get("roll_rate", zero),
            turns=turns,
        )
        # line of sight to the course of the path half of the lookahead ahead
        radius = self.gains.get("path_radius", 1.0)  # of no effect without turns
        lookahead = self.gains["task_lookahead"]
        ahead = bend(0.5 * lookahead, turns, radius)
        shown = ahead - np.arctan2(seen.cross_track, lookahead)
        return seen._replace(heading_error=wrapped(error - shown))

    def loop(self) -> Compensator:
        """Loop of the heading autopilot: guidance is slower by far."""
        return self.autopilot.loop()

    def to_dict(self) -> dict[str, Any]:
        """Content of the file, of guidance and autopilot."""
        return {**super().to_dict(), "autopilot": self.autopilot.to_dict()}


def with_path(task: Task | None) -> Task:
    """Task of guidance, by default the environment's; InputError without a path."""
    if task is None:
        return path_following_task()
    if not task.follows_path:
        raise InputError(f"task: expected one with a path, got '{task.name}'")
    return task


def bend(distance: float, turns: Turns, radius: float) -> Number:
    """Change of the path's course over a distance ahead, rad.

    The turns are arcs of one radius, m.
    """
    first = arc_turned(distance - turns.next_distance, turns.next_angle, radius)
    second = arc_turned(distance - turns.second_distance, turns.second_angle, radius)
    return first + second


def arc_turned(along_arc: Number, angle: Number, radius: float) -> Number:
    """Change of course at a distance, m, along an arc of an angle, rad.

    It is 0 before the arc, and the whole angle behind it.
    """
    turned = clipped(along_arc / radius, 0.0, np.abs(angle))
    return np.sign(angle) * turned
