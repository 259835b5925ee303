"""MPC of the course: wheel-over, improved by simulating the design model.

Each ship length the ship is simulated from where she is observed, by wheel-over with
courses added to its own: straight between knots, drawn, and drawn again about the best
(cross-entropy method). The cheapest is steered until the next search, which begins with
its rest. Wheel-over itself is among them, so by the model no plan is worse. The current
is estimated: each observation shows the part of it across the course over ground.

Sources: Rubinstein & Kroese 2004, The Cross-Entropy Method; Bertsekas 2019,
Reinforcement Learning and Optimal Control, 2.4 (rollout: a base policy improved by
looking ahead); Williams, Aldrich & Theodorou 2017, Model predictive path integral
control, Journal of Guidance, Control, and Dynamics 40 (sampling on the model).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar, NamedTuple

import numpy as np

from agents.controllers.controller import ANY_NUMBER, POSITIVE, Bounds
from agents.controllers.guided import bend
from agents.controllers.law import (
    HelmMemory,
    Nothing,
    Number,
    PathSignals,
    Signals,
    linear_law,
    rotated,
    wrapped,
)
from agents.controllers.lq import LQ
from agents.controllers.memory import selected
from agents.controllers.wheel_over import WheelOver, WheelOverSettings
from agents.settings import Step, setting
from shipgym import ShipModel
from shipgym.arrays import Floats
from shipgym.engine.records import table_of
from shipgym.envs.engine import Engine
from shipgym.tasks.scales import STEPS_PER_LENGTH
from shipgym.tasks.steering import HEADING_SCALE
from shipgym.tasks.task import Task, course_keeping_task

KNOTS = 6  # of a plan
KNOT_STEPS = int(STEPS_PER_LENGTH)  # control intervals from one knot to the next
COARSE = 2  # control intervals in a step of the simulation
CANDIDATES, ELITES, ROUNDS = 16, 4, 2
DEEP = 1e6  # m, of water that is not shallow
FAR = 1e9


class BodyCurrent(NamedTuple):
    """Current in the ship's axes, each number of shape (n_ships,)."""

    ahead: Number  # m/s
    aside: Number  # m/s, to starboard


class PlanMemory(NamedTuple):
    """Memory of MPC, of each ship."""

    steps: Number  # control intervals since the last search
    current: BodyCurrent
    plan: table_of(KNOTS)  # type: ignore[valid-type]  # rad, added to the course at the knots


@dataclass(frozen=True)
class MPCSettings(WheelOverSettings):
    """Settings of MPC: those of wheel-over, and of the search of plans."""

    horizon_lengths: float = setting(
        "how far it looks ahead, in times to travel one ship length",
        6.0,
        above=0.0,
        at_most=40.0,
    )
    deviation_deg: float = setting(
        "standard deviation of the courses that are tried first, degrees",
        3.0,
        above=0.0,
        at_most=60.0,
        search=Step(0.5),
    )

    def design(self, model: ShipModel, task: Task) -> dict[str, Any]:
        """See `GuidanceSettings.design`, with the weights of the task.

        Of the rudder and of roll per rad^2, of the rudder rate per rad^2 in the time to
        travel one ship length, of rudder travel per rad in a control interval. What the
        task charges for reversals, grounding and extrapolation is left out.
        """
        travel_weight = getattr(task.settings, "rudder_travel_weight", 0.0)
        step = COARSE * task.interval(model)
        steps = round(self.horizon_lengths * model.travel_time / step)
        return {
            **self.to_dict(),
            "horizon_steps": float(max(1, steps)),
            "deviation": float(np.radians(self.deviation_deg)),
            "water_depth": min(task.water_depth, DEEP),
            "corridor": task.corridor * model.particulars["length"],  # half its width
            "rudder": task.rudder_weight / HEADING_SCALE**2,
            "rudder_rate": task.rudder_rate_weight / HEADING_SCALE**2,
            "rudder_travel": travel_weight / HEADING_SCALE,
            "roll": task.roll_weight / float(np.radians(task.roll_scale_deg)) ** 2,
        }


@dataclass(frozen=True, eq=False, kw_only=True)
class MPC(WheelOver):
    """Wheel-over whose course is improved by sampling on the design model `ship`."""

    kind = "mpc"
    settings_type = MPCSettings
    has_ship = True
    memory_record = PlanMemory
    leads = LQ
    reads = (*WheelOver.reads, "yaw_rate", "rudder")
    bounds: ClassVar[Mapping[str, Bounds]] = {
        **WheelOver.bounds,
        "horizon_steps": Bounds(1, 1000),
        "corridor": POSITIVE,
        "water_depth": POSITIVE,
        **dict.fromkeys(
            ("deviation", "rudder", "rudder_rate", "rudder_travel", "roll"), ANY_NUMBER
        ),
    }

    ship: ShipModel

    def to_dict(self) -> dict[str, Any]:
        """Content of the file, with the design model."""
        return {**super().to_dict(), "ship": self.ship.to_dict()}

    def course(
        self, seen: PathSignals, memory: PlanMemory
    ) -> tuple[Number, PlanMemory]:
        """See `Guided.course`: that of wheel-over and what the plan adds."""
        current = self.estimated_current(seen, memory.current)
        plans = self.planned(seen, current, memory)

        course, _ = self.law(seen, Nothing(), self.parameters)
        knots = memory.steps / KNOT_STEPS
        course = course + added(plans, knots)
        steps = (memory.steps + 1.0) % KNOT_STEPS
        return course, PlanMemory(steps, current, plans.T)

    def planned(
        self, seen: PathSignals, current: BodyCurrent, memory: PlanMemory
    ) -> Floats:
        """Plans in memory, improved where a search is due, rad, shape (n_ships, KNOTS).

        A search begins with the rest of the last plan.
        """
        plans: Floats = memory.plan.T.copy()
        due = np.flatnonzero(memory.steps == 0.0)
        if len(due):
            rest = np.zeros((len(due), KNOTS))
            rest[:, :-1] = plans[due, 1:]
            seen_due = selected(seen, due)
            current_due = selected(current, due)
            plans[due] = self.improved(seen_due, current_due, rest)
        return plans

    def estimated_current(self, seen: PathSignals, known: BodyCurrent) -> BodyCurrent:
        """Estimate the current by the last estimate, which turns with the ship.

        The observed course over ground corrects it.
        """
        swung = seen.yaw_rate * self.design["dt"]
        ahead, aside = rotated(known.ahead, known.aside, swung)
        # across the course over ground there is no velocity over ground
        _, across = rotated(seen.surge + ahead, seen.sway + aside, seen.drift)
        # share of the current's error that is taken over in an interval
        current_gain = 0.5
        error = current_gain * across
        return BodyCurrent(
            ahead=ahead + error * np.sin(seen.drift),
            aside=aside - error * np.cos(seen.drift),
        )

    def improved(
        self, seen: PathSignals, current: BodyCurrent, plans: Floats
    ) -> Floats:
        """Improve plans by the cross-entropy method, rad, shape (n_ships, KNOTS).

        The first knot stays as it is.
        """
        best = plans
        least = np.full(len(plans), np.inf)
        mean = plans
        deviation = np.full(plans.shape, self.design["deviation"])
        least_deviation = np.radians(0.5)  # of a knot
        for drawn in draws():
            scattered = mean[:, None] + deviation[:, None] * drawn
            candidates = with_known_plans(scattered, best)
            costs = self.simulated_costs(seen, current, candidates)
            elites = cheapest(candidates, costs)
            mean = elites.mean(axis=1)
            deviation = np.maximum(elites.std(axis=1), least_deviation)

            cost = costs.min(axis=1)
            cheaper = cost < least
            best = np.where(cheaper[:, None], elites[:, 0], best)
            least = np.minimum(least, cost)
        return best

    def simulated_costs(
        self, seen: PathSignals, current: BodyCurrent, plans: Floats
    ) -> Floats:
        """Costs of plans on the design model, shape (n_ships, n_plans).

        `plans`: rad, shape (n_ships, n_plans, KNOTS).
        """
        n_ships, n_plans, _ = plans.shape
        lanes = np.repeat(np.arange(n_ships), n_plans)
        plan = plans.reshape(-1, KNOTS)
        models = DesignModels(
            self,
            seen=selected(seen, lanes),
            current=selected(current, lanes),
        )
        cost = np.zeros(len(plan))
        for step in range(int(self.design["horizon_steps"])):
            own_course = models.wheel_over_course()
            knots = step * COARSE / KNOT_STEPS
            models.steer(own_course + added(plan, knots))
            add_step_cost(cost, self, models)

        is_known = np.isfinite(cost)
        cost = np.where(is_known, cost, np.inf)
        return cost.reshape(n_ships, n_plans)


def with_known_plans(drawn: Floats, best: Floats) -> Floats:
    """Plans drawn, with the best so far and wheel-over itself in place of two.

    All begin at the first knot of the best. `drawn`: rad, shape (n_ships, CANDIDATES,
    KNOTS); `best`: shape (n_ships, KNOTS).
    """
    candidates = drawn.copy()
    candidates[:, 0] = best
    wheel_over = CANDIDATES // 2
    candidates[:, wheel_over] = 0.0
    candidates[:, :, 0] = best[:, :1]
    return candidates


def cheapest(plans: Floats, costs: Floats) -> Floats:
    """Cheapest plans of each ship, shape (n_ships, ELITES, KNOTS), the best first."""
    order = np.argsort(costs, axis=1, kind="stable")
    elites = order[:, :ELITES, None]
    return np.take_along_axis(plans, elites, axis=1)


@lru_cache(maxsize=1)
def draws() -> Floats:
    """Deviations of plans from their mean, in standard deviations.

    The shape is (ROUNDS, CANDIDATES, KNOTS). They are always the same, each with its
    mirror image.
    """
    random = np.random.default_rng(0)
    half = random.standard_normal((ROUNDS, CANDIDATES // 2, KNOTS))
    return np.concatenate([half, -half], axis=1)


def added(plans: Floats, at: Any) -> Floats:
    """Course that plans add at a number of knots from their beginning, rad, shape (n,).

    `plans`: shape (n, KNOTS), straight between knots; `at`: one number, or one for each
    plan.
    """
    distance = np.abs(np.asarray(at)[..., None] - np.arange(KNOTS))
    share = np.maximum(1.0 - distance, 0.0)
    return np.asarray((plans * share).sum(axis=-1))


class DesignModels:
    """Design models from where ships are observed, in a steady current.

    LQ steers them to courses over ground. Their places are kept along and across the
    path, whose course is 0 where the ships observed it.

    Attributes
    ----------
    dt : float
        Step, s.
    along, cross_track : array of shape (n,)
        Places, m.
    progress : array of shape (n,)
        Along the path in the last step, m.
    moved : array of shape (n,)
        Way of the rudder in the last step, rad.
    """

    progress: Floats
    moved: Floats

    def __init__(self, guide: MPC, seen: PathSignals, current: BodyCurrent) -> None:
        self.guide = guide
        self.dt = COARSE * guide.design["dt"]
        self.turns = seen.turns
        self.north, self.east = rotated(
            current.ahead, current.aside, seen.heading_error
        )
        self.cross_track = seen.cross_track
        self.along = np.zeros_like(seen.cross_track)
        n = len(self.along)
        self.engine = _engine(guide.ship, n, self.dt, guide.design["water_depth"])
        self.engine.reset(np.zeros(n, dtype=np.int64))
        start = {
            "x": self.along,
            "y": self.along,
            "psi": -seen.heading_error,
            "u": seen.surge,
            "v": seen.sway,
            "r": seen.yaw_rate,
            "delta": seen.rudder,
        }
        for name, values in start.items():
            self.engine.write(name, values)

    def read(self, name: str) -> Floats:
        """A state of the models."""
        return self.engine.read(name)

    def path_course(self, ahead: Any) -> Floats:
        """Course of the path so far ahead of the ships, m; rad."""
        radius = self.guide.gains["path_radius"]
        course: Floats = bend(self.along + ahead, self.turns, radius)
        return course

    def wheel_over_course(self) -> Floats:
        """Course over ground that wheel-over steers, rad."""
        gains = self.guide.parameters
        back: Floats = np.arctan2(self.cross_track, gains.lookahead)
        return self.path_course(gains.turn_reach) - back

    def steer(self, course: Floats) -> None:
        """Take one step towards a course over ground."""
        before = {name: self.read(name) for name in ("x", "y", "delta")}
        crab = self.guide.gains["crab_share"] * self.drift()
        seen = self.signals(course - crab)
        feedback = self.guide.autopilot.linear_feedback
        order, _ = linear_law(seen, self.helm(), feedback)
        limit = self.guide.ship.steering.limit
        self.engine.command[0] = np.clip(order / limit, -1.0, 1.0)
        self.engine.advance()

        self.moved = np.abs(self.read("delta") - before["delta"])
        self.move(
            north=self.read("x") - before["x"] + self.north * self.dt,
            east=self.read("y") - before["y"] + self.east * self.dt,
        )

    def move(self, north: Floats, east: Floats) -> None:
        """Move along and across the path by a way over ground, m."""
        way = np.hypot(north, east)
        ahead, aside = rotated(north, east, self.path_course(0.5 * way))
        bent = self.path_course(way) - self.path_course(0.0)
        curvature = bent / np.maximum(way, 1e-9)
        # inside of an arc the same way goes by more of it
        shorter = np.maximum(1.0 - curvature * self.cross_track, 0.2)
        self.progress = ahead / shorter
        self.along = self.along + self.progress
        self.cross_track = self.cross_track + aside

    def helm(self) -> HelmMemory:
        """Memory of LQ, which knows the rudder by its model of the gear."""
        zero = np.zeros_like(self.along)
        return HelmMemory(*[zero] * len(HelmMemory._fields))

    def drift(self) -> Floats:
        """Angle from the velocity through the water to that over ground, rad."""
        surge = self.read("u")
        sway = self.read("v")
        ahead, aside = rotated(self.north, self.east, self.read("psi"))
        over_ground = np.arctan2(sway + aside, surge + ahead)
        return np.asarray(wrapped(over_ground - np.arctan2(sway, surge)))

    def signals(self, to_steer: Floats) -> Signals:
        """Signals for LQ, which steers a heading, rad."""
        rudder = self.read("delta")
        return Signals(
            sway=self.read("v"),
            yaw_rate=self.read("r"),
            heading_error=wrapped(to_steer - self.read("psi")),
            rudder=rudder,
            heading_error_integral=np.zeros_like(to_steer),
            surge=self.read("u"),
            last_order=rudder,
        )


def add_step_cost(cost: Floats, guide: MPC, models: DesignModels) -> None:
    """Add the cost of the last step to that of each ship so far."""
    weights = guide.design
    particulars = guide.ship.particulars
    full_way = particulars["speed"] * models.dt
    off_track = models.cross_track / weights["corridor"]
    share_of_way = models.progress / full_way
    rudder_rate = models.moved * particulars["length"] / full_way

    cost += off_track**2 - np.clip(share_of_way, -1.0, 1.0)
    cost += weights["rudder"] * models.read("delta") ** 2
    cost += weights["rudder_travel"] / COARSE * models.moved
    cost += weights["rudder_rate"] * rudder_rate**2
    if weights["roll"] > 0.0:
        cost += weights["roll"] * models.read("phi") ** 2


@lru_cache(maxsize=8)
def _engine(ship: ShipModel, n: int, dt: float, depth: float) -> Engine:
    """Design models side by side, in calm water, whose episodes do not end."""
    task = course_keeping_task(
        dt=dt,
        max_heading_error_deg=180.0,
        max_envelope_distance=FAR,
        episode_steps=10**6,
        water_depth=depth if depth < DEEP else np.inf,
    )
    return Engine(ship, n, task)
