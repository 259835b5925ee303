"""Adaptive autopilot: LQ redesigned, while the ship sails, for the steering that is identified.

Sources: Astrom & Wittenmark 1995, Adaptive Control, chapter 4 (self-tuning regulators,
certainty equivalence); van Amerongen 1982, Adaptive steering of ships; Song 2020,
chapter 4 (TMILS, `identification.estimators.recursive`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np

from agents.controllers.controller import Controller, Range
from agents.controllers.linear_loop import SIGNALS, sampled_ships
from agents.controllers.lq import LQ, lq_rows
from agents.controllers.memory import Flags, Floats, Records, deviations, records
from identification.estimators.recursive_kernels import least_squares
from shipgym import InputError, ShipModel
from shipgym.checks import check_number
from shipgym.ships.linear import LARGEST_RUDDER, linearise, straight_running
from shipgym.tasks.steering import RUDDER_WEIGHT
from shipgym.trials.sensors import SEA_TRIAL

# Sway and yaw acceleration each are explained by sway, yaw rate, rudder and what is
# always there, in the prime system with the instantaneous speed.
N_TERMS, N_EQUATIONS = 4, 2
SIZES = np.array([0.05, 0.2, 0.2, 0.02])  # of these in course keeping
UNEXPLAINED = 2e-3  # of prime accelerations, without noise
LARGEST_SWAY, LARGEST_TURN = (
    0.1,
    0.25,
)  # prime speeds beyond which steering is not linear
INNOVATIONS = 3
WIDEST = 5.0  # factor by which the rudder's effect may differ from that of the design

RESTLESS_LIMIT = (
    1.4  # times what the sensors' noise makes of the yaw rate's second difference
)


@dataclass(frozen=True, eq=False, kw_only=True)
class AdaptiveLQ(Controller):
    """LQ whose gains adapt to the ship: TMILS identifies linear steering, for which the gains are designed.

    It begins every episode with the design on the model; `gains` and `margins` are
    those. Turns too hard to be linear are not learned from, nor is anything while the
    yaw rate oscillates more than noise explains: in waves, unless they are filtered
    out. An estimate whose rudder effect is not believable, or whose gains would leave
    it or the model unstable, changes nothing.

    Attributes
    ----------
    prior : array of shape (2, 4)
        Prime coefficients of the model: sway and yaw acceleration per sway, yaw rate,
        rudder, and always.
    """

    kind: ClassVar[str] = "lq-adaptive"
    feedback: ClassVar[Mapping[str, tuple[str, float]]] = LQ.feedback
    arrays: ClassVar[Mapping[str, tuple[str | int, ...]]] = {
        "prior": (N_EQUATIONS, N_TERMS)
    }
    ranges: ClassVar[Mapping[str, Range]] = {
        **Controller.ranges,
        "length": Range(1e-2, 1e4),
        "speed": Range(1e-3, 1e3),
        "gear_lag": Range(0.0, 1e4),
        "sway_error": Range(1e-9, 1e6),
        "yaw_error": Range(1e-9, 1e6),
        "integral_time": Range(1e-6, 1e12),
        "rate_weight_s2": Range(1e-12, 1e12),
        "rudder_weight": Range(1e-12, 1e12, RUDDER_WEIGHT),
        "restless_limit": Range(1e-9, 1e6),
        "forgetting": Range(1e-300, 1.0),
        "redesign_steps": Range(1.0, 1e9),
    }

    record: ClassVar[np.dtype[Any]] = np.dtype(
        [
            (
                "theta",
                "f8",
                (N_EQUATIONS, N_TERMS),
            ),  # the estimate, scaled, and its covariance
            ("covariance", "f8", (N_EQUATIONS, N_TERMS, N_TERMS)),
            ("terms", "f8", (INNOVATIONS - 1, N_TERMS)),  # of the last intervals
            ("targets", "f8", (INNOVATIONS - 1, N_EQUATIONS)),
            ("gains", "f8", len(SIGNALS)),  # in use
            ("neutral", "f8", 2),  # rudder, sway
            ("last", "f8", 4),  # sway, yaw rate, rudder, speed
            ("step", "f8"),
            ("change", "f8"),
            ("restless", "f8"),  # steps; of the yaw rate; its mean square
        ]
    )

    prior: Floats

    def __post_init__(self) -> None:
        if self.prior[1, 2] == 0.0:
            raise InputError(
                "arrays.prior[1][2]: 0 found, expected the yaw acceleration per rudder"
            )

    @classmethod
    def from_model(
        cls,
        model: ShipModel,
        *,
        dt: float | None = None,
        integral_lengths: float = 20.0,
        rudder_weight: float = RUDDER_WEIGHT,
        rate_weight_s2: float | None = None,
        forgetting_lengths: float = 20.0,
        redesign_lengths: float = 1.0,
        noise: float = 1.0,
    ) -> Self:
        """Design on a model, from which the ship may differ.

        Raises InputError if the model has no sway or no straight course, or an argument
        is out of its range.

        Parameters
        ----------
        model : ShipModel
            With sway.
        dt, integral_lengths, rudder_weight, rate_weight_s2
            As in `LQ.from_model`, for the model and for what is identified.
        forgetting_lengths : float
            Time after which a sample counts 1/e, in times to travel one ship length. A
            sudden change of the ship is followed within about 10 such times of gentle
            course changes; a ship that only sails straight shows nothing to learn from,
            and nothing is forgotten beyond the model.
        redesign_lengths : float
            Between two designs, likewise.
        noise : float
            Of sway speed and yaw rate, in multiples of a sea trial's sensors
            (`SEA_TRIAL`). The noisier, the longer the model is believed.
        """
        check_number(forgetting_lengths, "forgetting_lengths", above=0.0)
        check_number(redesign_lengths, "redesign_lengths", above=0.0)
        check_number(noise, "noise", at_least=0.0)
        if not has_sway(model):
            raise InputError(
                f"model: {model.name!r} has no sway, expected one with surge, sway"
                " and yaw"
            )
        weights = {"integral_lengths": integral_lengths, "rudder_weight": rudder_weight}
        start = LQ.from_model(model, dt=dt, rate_weight_s2=rate_weight_s2, **weights)
        interval, time = start.design["dt"], model.travel_time
        length, speed = model.particulars["length"], straight_running(model).surge
        deviation = (
            np.sqrt(2.0)
            * noise
            / interval
            * np.array([SEA_TRIAL["v"].noise, SEA_TRIAL["r"].noise])
        )
        errors = np.hypot(UNEXPLAINED, deviation / units(length, speed)[:, 3])
        design = start.design | {
            "length": length,
            "speed": speed,
            "sway_error": float(errors[0]),
            "yaw_error": float(errors[1]),
            "gear_lag": model.steering.time_constant,
            "integral_time": integral_lengths * time,
            "restless_limit": (
                RESTLESS_LIMIT * np.sqrt(6.0) * max(noise, 1.0) * SEA_TRIAL["r"].noise
            ),
            "forgetting": float(np.exp(-interval / (forgetting_lengths * time))),
            "redesign_steps": float(max(1, round(redesign_lengths * time / interval))),
        }
        design.pop("integral_lengths")
        common = {one.name: getattr(start, one.name) for one in fields(start)}
        return cls(**common | {"design": design}, prior=prime_steering(model))

    def steer(
        self, seen: dict[str, Floats], memory: Floats, begins: Flags
    ) -> tuple[Floats, Floats]:
        """Learn from the last interval, redesign now and then, and feed back."""
        memory = memory.copy()
        kept = records(memory, self.record)
        kept[begins] = self._fresh()
        speed = np.maximum(
            np.hypot(seen["surge"], seen["sway"]), 0.1 * self.design["speed"]
        )
        now = np.stack([seen["sway"], seen["yaw_rate"], seen["rudder"], speed], axis=-1)
        self._learn(kept, now, begins, self._at_rest(kept, now, begins))
        kept["last"] = now
        kept["step"] += 1.0
        due = np.flatnonzero(kept["step"] % self.design["redesign_steps"] == 0.0)
        if len(due):
            kept[due] = self._redesigned(kept[due])
        rudder, sway = kept["neutral"].T
        order: Floats = rudder + np.einsum(
            "ij,ij->i", kept["gains"], deviations(seen, rudder, sway)
        )
        return order, memory

    @property
    def error_size(self) -> Floats:
        """Of prime accelerations that are not explained, shape (2,)."""
        return np.array([self.design["sway_error"], self.design["yaw_error"]])

    def _fresh(self) -> Records:
        """What is remembered when an episode begins: the design."""
        fresh = np.zeros(1, self.record)
        fresh["theta"] = self.prior * SIZES / self.error_size[:, None]
        fresh["covariance"] = self._doubt()[:, :, None] * np.eye(N_TERMS)
        fresh["gains"], fresh["neutral"] = (
            self.row,
            (self.neutral_rudder, self.neutral_sway),
        )
        fresh["restless"] = (
            10.0 * self.design["restless_limit"] ** 2
        )  # it must be seen to be calm
        return fresh

    def _doubt(self) -> Floats:
        """Variance of the model's scaled coefficients, shape (2, 4): each may be as wrong as it is large."""
        return np.asarray(
            np.maximum(np.abs(self.prior * SIZES / self.error_size[:, None]), 0.01) ** 2
        )

    def _at_rest(self, kept: Records, now: Floats, begins: Flags) -> Flags:
        """Whether the yaw rate's second difference, over the last ship lengths, is what noise explains."""
        change = np.where(begins, 0.0, now[:, 1] - kept["last"][:, 1])
        oscillation = (change - kept["change"]) ** 2
        share = 1.0 / self.design["redesign_steps"]
        kept["restless"] += share * (oscillation - kept["restless"])
        kept["change"] = change
        return kept["restless"] < self.design["restless_limit"] ** 2

    def _learn(self, kept: Records, now: Floats, begins: Flags, at_rest: Flags) -> None:
        """TMILS with the last interval's mean motion and accelerations; all ships side by side."""
        last, dt, length = kept["last"], self.design["dt"], self.design["length"]
        sway, turn, rudder, speed = (0.5 * (last + now)).T
        speed = np.where(begins, now[:, 3], speed)
        terms = np.stack(
            [sway / speed, turn * length / speed, rudder, np.ones_like(speed)], axis=-1
        )
        targets = (
            (now - last)[:, :2]
            / dt
            * np.stack([length / speed**2, (length / speed) ** 2], axis=-1)
        )
        gentle = np.abs(terms[:, :2]) < (LARGEST_SWAY, LARGEST_TURN)
        linear = gentle.all(axis=1) & ~begins & at_rest
        if not linear.any():
            return
        chosen = kept[linear]
        phi = np.concatenate(
            [chosen["terms"], (terms[linear] / SIZES)[:, None]], axis=1
        )
        y = np.concatenate(
            [chosen["targets"], (targets[linear] / self.error_size)[:, None]], axis=1
        )
        self._update(chosen, phi, y)
        chosen["terms"], chosen["targets"] = phi[:, 1:], y[:, 1:]
        kept[linear] = chosen

    def _update(self, chosen: Records, phi: Floats, y: Floats) -> None:
        """One step of TMILS for each ship and equation; estimates and covariances are changed in place."""
        signals = len(chosen) * N_EQUATIONS
        theta = np.ascontiguousarray(chosen["theta"]).reshape(signals, N_TERMS)
        covariance = np.ascontiguousarray(chosen["covariance"]).reshape(
            signals, N_TERMS, N_TERMS
        )
        features = np.ascontiguousarray(
            np.repeat(phi.transpose(1, 0, 2), N_EQUATIONS, axis=1)
        )
        targets = np.ascontiguousarray(
            y.transpose(1, 0, 2).reshape(INNOVATIONS, signals)
        )
        ceiling = np.ascontiguousarray(np.tile(self._doubt(), (len(chosen), 1)))
        forgetting, history = (
            float(self.design["forgetting"]),
            np.empty((1, signals, N_TERMS)),
        )
        least_squares()(
            features,
            targets,
            INNOVATIONS - 1,
            theta,
            covariance,
            ceiling,
            forgetting,
            INNOVATIONS,
            0.0,
            history,
            np.empty(N_TERMS),
        )
        chosen["theta"] = theta.reshape(chosen["theta"].shape)
        chosen["covariance"] = covariance.reshape(chosen["covariance"].shape)

    def coefficients(self, state: Floats) -> Floats:
        """Prime coefficients that are identified, as `prior`, of shape (2, 4) or (n, 2, 4).

        `state`: that `predict` returns, shape (memory_size,) or (n, memory_size).
        """
        theta = records(np.asarray(state), self.record)["theta"]
        return np.asarray(theta * self.error_size[:, None] / SIZES)

    def _redesigned(self, kept: Records) -> Records:
        """What is remembered, with new gains and a new neutral rudder where they can be believed."""
        new, design = kept.copy(), self.design
        prime = kept["theta"] * self.error_size[:, None] / SIZES
        share = prime[:, 1, 2] / self.prior[1, 2]
        linear = prime * units(design["length"], design["speed"])
        at_rest = linear[:, :, [0, 2]]
        solvable = (
            (share > 1.0 / WIDEST) & (share < WIDEST) & (np.linalg.det(at_rest) != 0.0)
        )
        which = np.flatnonzero(solvable)
        neutral = np.linalg.solve(at_rest[which], -linear[which, :, 3:])[
            :, ::-1, 0
        ]  # rudder, sway
        A, B = sampled_ships(linear[which, :, :3], design["gear_lag"], design["dt"])
        weights = (
            design["rate_weight_s2"],
            design["integral_time"],
            design["rudder_weight"],
        )
        rows = lq_rows(A, B, design["dt"], *weights)
        good = np.isfinite(rows).all(axis=1) & (np.abs(neutral[:, 0]) < LARGEST_RUDDER)
        which, neutral, rows, A, B = (
            which[good],
            neutral[good],
            rows[good],
            A[good],
            B[good],
        )
        good = _stable(A, B, rows) & _stable(*self._believed, rows)
        new["gains"][which[good]], new["neutral"][which[good]] = (
            rows[good],
            neutral[good],
        )
        return new

    @cached_property
    def _believed(self) -> tuple[Floats, Floats]:
        """The ship of the model, sampled."""
        linear = self.prior * units(self.design["length"], self.design["speed"])
        return sampled_ships(
            linear[None, :, :3], self.design["gear_lag"], self.design["dt"]
        )


def has_sway(model: ShipModel) -> bool:
    """Whether a ship's steering is that of sway and yaw, which is what is identified."""
    return "v" in model.state_names and "q" not in model.state_names


def _stable(A: Floats, B: Floats, rows: Floats) -> Flags:
    """Whether ships are held by feedback rows, shape (n,)."""
    poles = np.linalg.eigvals(A + B[:, :, None] * rows[:, None, :])
    return np.asarray(np.abs(poles).max(axis=1) < 1.0)


def prime_steering(model: ShipModel) -> Floats:
    """Prime coefficients of a model's linear steering about straight running, as `AdaptiveLQ.prior`."""
    about = straight_running(model)
    steering, rudder = linearise(model, about)
    found: Floats = np.column_stack([steering, rudder, np.zeros(N_EQUATIONS)])
    found /= units(model.particulars["length"], about.surge)
    found[:, 3] = -found[:, 0] * about.sway / about.surge - found[:, 2] * about.rudder
    return found


def units(length: float, speed: float) -> Floats:
    """SI value of prime coefficients of 1, in the order of `AdaptiveLQ.prior`, shape (2, 4)."""
    sway = np.array([speed / length, speed, speed**2 / length, speed**2 / length])
    return np.stack([sway, sway / length])
