"""MPC of the course: wheel-over with its course varied as a search on the design model finds best.

Each ship length she is simulated from where she is observed, by wheel-over with courses
added to its own: straight between knots, drawn, and drawn again about the best
(cross-entropy method). The cheapest is steered until the next search, which begins with
its rest. Wheel-over itself is among them, so by the model no plan is worse. The current
is estimated: of it each observation shows the part across her way over ground.

Sources: Rubinstein & Kroese 2004, The Cross-Entropy Method; Bertsekas 2019,
Reinforcement Learning and Optimal Control, 2.4 (rollout: a base policy improved by
looking ahead); Williams, Aldrich & Theodorou 2017, Model predictive path integral
control, Journal of Guidance, Control, and Dynamics 40 (sampling on the model).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from agents.controllers.controller import Policy, Range
from agents.controllers.lq import LQ
from agents.controllers.memory import Floats
from agents.controllers.wheel_over import WheelOver
from shipgym import InputError, ShipModel
from shipgym.checks import check_number
from shipgym.envs.engine import Engine
from shipgym.tasks.guidance import wrapped
from shipgym.tasks.steering import HEADING_SCALE
from shipgym.tasks.task import (
    STEPS_PER_LENGTH,
    Task,
    course_keeping_task,
    path_following_task,
)

KNOTS, KNOT_STEPS = (
    6,
    int(STEPS_PER_LENGTH),
)  # of a plan, and control intervals from one to the next
COARSE = 2  # control intervals in a step of the search
CANDIDATES, ELITES, ROUNDS = 16, 4, 2
_HALF = np.random.default_rng(0).standard_normal((ROUNDS, CANDIDATES // 2, KNOTS))
DRAWS = np.concatenate(
    [_HALF, -_HALF], axis=1
)  # always the same, each with its mirror image
LEAST_DEVIATION = np.radians(0.5)  # of a knot
STREAM_GAIN = 0.5  # share of the current seen anew in each interval that is taken over
DEEP, FAR = 1e6, 1e9  # m: of water that is not shallow; of a turn that lies behind


@dataclass(frozen=True, eq=False, kw_only=True)
class MPC(WheelOver):
    """Wheel-over whose course is improved by sampling on the design model, its `ship`."""

    kind: ClassVar[str] = "mpc"
    has_ship: ClassVar[bool] = True
    remembers: ClassVar[int] = (
        3 + KNOTS
    )  # intervals since the last search, current, plan
    ranges: ClassVar[Mapping[str, Range]] = {
        **WheelOver.ranges,
        "corridor": Range(1e-6, FAR),
        "horizon_steps": Range(1, 1000),
        **dict.fromkeys(("deviation", "acceptance", "water_depth"), Range(0.0, FAR)),
        **dict.fromkeys(
            ("rudder", "rudder_rate", "rudder_travel", "roll"), Range(0.0, FAR)
        ),
    }

    reads: ClassVar[tuple[str, ...]] = (*WheelOver.reads, "yaw_rate", "rudder")

    ship: ShipModel

    def __post_init__(self) -> None:
        if not isinstance(self.autopilot, LQ):
            raise InputError(
                f"autopilot: {type(self.autopilot).__name__} found, expected LQ"
            )

    @classmethod
    def from_model(
        cls,
        model: ShipModel,
        *,
        autopilot: Policy | None = None,
        task: Task | None = None,
        horizon_lengths: float = 6.0,
        deviation_deg: float = 3.0,
        **settings: Any,
    ) -> Self:
        """Lead LQ along the paths of a task.

        Parameters
        ----------
        model : ShipModel
            The design model, which is simulated in the current observed.
        autopilot : LQ, optional
            By default `LQ.from_model(model)`.
        task : Task, optional
            Also its weights are used; by default the environment's own.
        horizon_lengths : float
            How far it looks ahead, in times to travel one ship length.
        deviation_deg : float
            Standard deviation of the courses that are tried first.
        **settings
            Those of `WheelOver.from_model`, with its errors.
        """
        check_number(horizon_lengths, "horizon_lengths", above=0.0, at_most=40.0)
        check_number(deviation_deg, "deviation_deg", above=0.0, at_most=60.0)
        asked, length = task or path_following_task(), model.particulars["length"]
        guide = super().from_model(model, autopilot=autopilot, task=asked, **settings)
        steps = (
            horizon_lengths
            * length
            / model.particulars["speed"]
            / (COARSE * guide.design["dt"])
        )
        costs = {
            "corridor": asked.corridor * length,
            "horizon_steps": float(max(1, round(steps))),
            "deviation": float(np.radians(deviation_deg)),
            "acceptance": length * float(getattr(asked.settings, "acceptance", 0.0)),
            "water_depth": min(asked.water_depth, DEEP),
            "rudder": asked.rudder_weight / HEADING_SCALE**2,
            "rudder_rate": asked.rudder_rate_weight / HEADING_SCALE**2,
            "rudder_travel": (
                getattr(asked.settings, "rudder_travel_weight", 0.0) / HEADING_SCALE
            ),
            "roll": asked.roll_weight / float(np.radians(asked.roll_scale_deg)) ** 2,
        }
        return replace(guide, design={**guide.design, **costs})

    def to_dict(self) -> dict[str, Any]:
        """What the file holds, the design model too."""
        return {**super().to_dict(), "ship": self.ship.to_dict()}

    def course(
        self, seen: Mapping[str, Floats], memory: Floats
    ) -> tuple[Floats, Floats]:
        """See `Guided.course`: that of wheel-over and what the plan adds."""
        count, plan = memory[..., 0], np.atleast_2d(memory[..., 3:]).copy()
        stream, due = self._stream(seen, memory[..., 1:3]), np.flatnonzero(count == 0.0)
        if len(due):
            rows = {name: np.atleast_1d(values)[due] for name, values in seen.items()}
            rest = np.concatenate([plan[due, 1:], np.zeros((len(due), 1))], axis=1)
            plan[due] = self._planned(rows, np.atleast_2d(stream)[due].T, rest)
        plan = plan.reshape(memory[..., 3:].shape)
        wanted, _ = super().course(seen, memory)
        step = ((count + 1.0) % KNOT_STEPS)[..., None]
        return wanted + _added(plan, count / KNOT_STEPS), np.concatenate(
            [step, stream, plan], axis=-1
        )

    def _stream(self, seen: Mapping[str, Floats], known: Floats) -> Floats:
        """Current ahead and to starboard, m/s, shape (n, 2): the known one turns with her and is bettered."""
        way = self.over_ground(seen)
        ahead, aside = _turned(
            known[..., 0], known[..., 1], seen["yaw_rate"] * self.design["dt"]
        )
        _, wrong = _turned(seen["surge"] + ahead, seen["sway"] + aside, way)
        wrong = STREAM_GAIN * wrong
        return np.stack(
            [ahead + wrong * np.sin(way), aside - wrong * np.cos(way)], axis=-1
        )

    def _planned(
        self, seen: Mapping[str, Floats], stream: Floats, best: Floats
    ) -> Floats:
        """Plans bettered by the cross-entropy method, rad, shape (n, knots); the first knot stays."""
        rows, mean = np.arange(len(best)), best
        deviation, least = (
            np.full(best.shape, self.design["deviation"]),
            np.full(len(best), np.inf),
        )
        for drawn in DRAWS:
            plans = mean[:, None] + deviation[:, None] * drawn
            plans[:, 0], plans[:, CANDIDATES // 2], plans[:, :, 0] = (
                best,
                0.0,
                best[:, :1],
            )
            costs = self._costs(seen, stream, plans)
            order = np.argsort(costs, axis=1, kind="stable")
            found, first = costs[rows, order[:, 0]], plans[rows, order[:, 0]]
            best, least = (
                np.where((found < least)[:, None], first, best),
                np.minimum(found, least),
            )
            elites = np.take_along_axis(plans, order[:, :ELITES, None], axis=1)
            mean, deviation = (
                elites.mean(axis=1),
                np.maximum(elites.std(axis=1), LEAST_DEVIATION),
            )
        return best

    def _costs(
        self, seen: Mapping[str, Floats], stream: Floats, plans: Floats
    ) -> Floats:
        """Costs of plans on the design model, as the task has them, shape (n, candidates)."""
        each, plan, of = plans.shape[1], plans.reshape(-1, KNOTS), self.design
        lanes = {name: np.repeat(values, each) for name, values in seen.items()}
        turns = [lanes[name] for name in self.turns_ahead]
        ship = _Simulated(
            self, lanes, self.heading(lanes, turns), np.repeat(stream, each, axis=1)
        )
        path = Ahead(turns, self.gains["path_radius"], of["acceptance"])
        place, cost, full = (
            path.fix(ship.x, ship.y),
            np.zeros(len(plan)),
            ship.speed * ship.dt,
        )
        for step in range(int(of["horizon_steps"])):
            course = place.course + self.course_along(place.cross, place.turns)
            before, rudder = place.way, ship.rudder
            ship.steer(course + _added(plan, step * COARSE / KNOT_STEPS))
            place, moved = path.fix(ship.x, ship.y), np.abs(ship.rudder - rudder)
            cost += (place.cross / of["corridor"]) ** 2 - np.clip(
                (place.way - before) / full, -1.0, 1.0
            )
            cost += of["rudder"] * ship.rudder**2 + of["rudder_travel"] / COARSE * moved
            cost += (
                of["rudder_rate"]
                * (moved * self.ship.particulars["length"] / full) ** 2
            )
            if of["roll"] > 0.0:
                cost += of["roll"] * ship.engine.read("phi") ** 2
        return np.where(np.isfinite(cost), cost, np.inf).reshape(plans.shape[:2])


@lru_cache(maxsize=8)
def _engine(ship: ShipModel, n: int, dt: float, depth: float) -> Engine:
    """Design models side by side, in calm water."""
    shallow = {"water_depth": depth} if depth < DEEP else {}
    limits = {
        "max_heading_error_deg": 180.0,
        "max_envelope_distance": FAR,
        "episode_steps": 10**6,
    }
    return Engine(ship, n, course_keeping_task(dt=dt, **limits, **shallow))


def _added(plan: Floats, at: Any) -> Floats:
    """Course that plans add at a number of knots from their beginning: straight between knots."""
    shares = np.maximum(1.0 - np.abs(np.asarray(at)[..., None] - np.arange(KNOTS)), 0.0)
    return np.asarray((plan * shares).sum(axis=-1))


def _turned(ahead: Any, aside: Any, angle: Any) -> tuple[Any, Any]:
    """A vector in axes turned to starboard by an angle."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return ahead * cosine + aside * sine, aside * cosine - ahead * sine


class _Simulated:
    """Design models from where ships are observed, steered by LQ to courses over ground."""

    def __init__(
        self, guide: MPC, seen: Mapping[str, Floats], psi: Floats, stream: Floats
    ) -> None:
        self.guide, self.dt, self.time = guide, COARSE * guide.design["dt"], 0.0
        self.speed = guide.ship.particulars["speed"]
        self.engine = _engine(
            guide.ship, len(psi), self.dt, guide.design["water_depth"]
        )
        self.engine.reset(np.zeros(len(psi), dtype=np.int64))
        begin = {
            "x": 0.0 * psi,
            "y": seen["cross_track"],
            "psi": psi,
            "u": seen["surge"],
            "v": seen["sway"],
        }
        for name, values in {
            **begin,
            "r": seen["yaw_rate"],
            "delta": seen["rudder"],
        }.items():
            self.engine.write(name, values)
        self.north, self.east = _turned(stream[0], stream[1], -psi)
        self.read()

    def read(self) -> None:
        """Where the ships are, drifted by the current."""
        names = ("x", "y", "psi", "u", "v", "r", "delta")
        x, y, self.psi, self.u, self.v, self.r, self.rudder = (
            self.engine.read(name) for name in names
        )
        self.x, self.y = x + self.north * self.time, y + self.east * self.time

    def steer(self, course: Floats) -> None:
        """One step towards a course over ground."""
        guide, u, v, (ahead, aside) = (
            self.guide,
            self.u,
            self.v,
            _turned(self.north, self.east, self.psi),
        )
        gains = guide.autopilot.gains  # type: ignore[attr-defined]
        drift = np.arctan2(u * aside - v * ahead, u * (u + ahead) + v * (v + aside))
        error = wrapped(course - guide.gains["crab_share"] * drift - self.psi)
        order = guide.neutral_rudder + gains["rudder"] * (
            self.rudder - guide.neutral_rudder
        )
        order += gains["heading_error"] * error + gains["yaw_rate"] * self.r
        order += gains["sway"] * (v - guide.neutral_sway)
        self.engine.command[0] = np.clip(order / guide.ship.steering.limit, -1.0, 1.0)
        self.engine.advance()
        self.time += self.dt
        self.read()


class Place(NamedTuple):
    """Where ships are on their path."""

    way: Floats  # m, along it
    cross: Floats  # m, to starboard of it
    course: Floats  # rad, its course there
    turns: list[Floats]  # distance and angle of each turn to come, m and rad


class Ahead:
    """The path from beside each ship on, its course there 0: legs with corners, or with arcs of a radius, m.

    `turns`: distance and angle of each, m and rad; `acceptance`: m before a corner
    where the next leg begins.
    """

    def __init__(
        self, turns: Sequence[Floats], radius: float, acceptance: float
    ) -> None:
        self.turns = list(zip(turns[::2], turns[1::2], strict=True))
        self.radius, self.acceptance = radius, acceptance
        self.passed = [np.zeros(len(turns[0]), dtype=np.bool_) for _ in self.turns]

    def fix(self, x: Floats, y: Floats) -> Place:
        """Where ships have come since the last fix; x and y along and beside where they began, m."""
        radius, arcs = self.radius, self.radius > 0.0
        way, cross, course, left = x, y, np.zeros_like(x), []
        behind, leg, reached = course, course, np.ones(len(x), dtype=np.bool_)
        for k, (distance, turn) in enumerate(self.turns):
            side, angle, past = (
                np.where(turn < 0.0, -1.0, 1.0),
                np.abs(turn),
                x - distance,
            )
            swept = (
                np.arctan2(past, np.maximum(radius - side * y, 0.1 * radius))
                if arcs
                else 0.0 * x
            )
            over = (past > 0.0) & (swept >= angle) if arcs else past >= -self.acceptance
            self.passed[k] = gone = self.passed[k] | (reached & over & (turn != 0.0))
            bent = np.where(reached & ~gone & (past > 0.0) & (angle > 0.0), swept, 0.0)
            way = np.where(bent > 0.0, behind + distance + radius * bent, way)
            cross = np.where(
                bent > 0.0, side * (radius - np.hypot(past, radius - side * y)), cross
            )
            course = np.where(bent > 0.0, leg + side * bent, course)
            left += [
                np.where(gone, FAR, np.maximum(-past, 0.0) if arcs else -past),
                np.where(gone, 0.0, side * (angle - bent)),
            ]
            north, east = (
                past - radius * np.sin(angle),
                y - side * radius * (1.0 - np.cos(angle)),
            )
            along, beside = _turned(north, east, turn)
            behind, leg = (
                behind + distance + radius * angle,
                np.where(gone, leg + turn, leg),
            )
            x, y, reached = (
                np.where(gone, along, x),
                np.where(gone, beside, y),
                reached & gone,
            )
            way = np.where(gone, behind + (x if arcs else np.maximum(x, 0.0)), way)
            cross, course = np.where(gone, y, cross), np.where(gone, leg, course)
        return Place(way, cross, course, left)
