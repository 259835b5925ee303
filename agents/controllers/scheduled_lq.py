"""LQ autopilot whose gains follow the speed: a slower ship needs more rudder.

Source: Rugh & Shamma 2000, Research on gain scheduling, Automatica 36; for autopilots
van Amerongen 1982, Adaptive steering of ships, chapter 3 (the rudder's effect grows
with the square of the speed).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from agents.controllers.controller import Controller
from agents.controllers.linear_loop import SIGNALS, Compensator, sample_ship
from agents.controllers.lq import LQ, Weights, without_yaw_memory
from agents.controllers.memory import Flags, Floats, deviations
from shipgym import InputError, ShipModel
from shipgym.checks import check_number
from shipgym.tasks.steering import RUDDER_WEIGHT

SPEEDS = (0.6, 0.7, 0.8, 0.9, 1.0, 1.1)  # over service speed


@dataclass(frozen=True, eq=False, kw_only=True)
class ScheduledLQ(Controller):
    """LQ designed at several speeds, with gains and neutral rudder interpolated linearly between them.

    Below the lowest and above the highest speed those of the nearest are kept. `gains`
    and `margins` are those at service speed.

    Attributes
    ----------
    speeds : array of shape (n_speeds,)
        Surge speeds, m/s, rising.
    schedule : array of shape (n_speeds, 5)
        Gains at each, in the order of `linear_loop.SIGNALS`.
    neutral : array of shape (n_speeds, 2)
        Rudder, rad, and sway speed, m/s, of straight running at each.
    """

    kind: ClassVar[str] = "lq-scheduled"
    feedback: ClassVar[Mapping[str, tuple[str, float]]] = LQ.feedback
    arrays: ClassVar[Mapping[str, tuple[str | int, ...]]] = {
        "speeds": ("speeds",),
        "schedule": ("speeds", len(SIGNALS)),
        "neutral": ("speeds", 2),
    }

    speeds: Floats
    schedule: Floats
    neutral: Floats

    def __post_init__(self) -> None:
        rising(self.speeds.tolist(), "speeds")

    @classmethod
    def from_model(
        cls,
        model: ShipModel,
        *,
        dt: float | None = None,
        integral_lengths: float = 20.0,
        rudder_weight: float = RUDDER_WEIGHT,
        rate_weight_s2: float | None = None,
        speeds: Sequence[float] | None = None,
    ) -> Self:
        """Design on a model, about straight running at each speed.

        The shaft is taken to turn as at service speed: the ship has lost speed in a
        turn or in weather.

        In the `design` of what is returned, `least_gain_margin` and
        `least_phase_margin_deg` are those of the worst speed. Raises InputError if the
        model has no straight course at one of the speeds, or an argument is out of its
        range.

        Parameters
        ----------
        model, dt, integral_lengths, rudder_weight, rate_weight_s2
            As in `LQ.from_model`, at each speed.
        speeds : sequence of float, optional
            m/s, rising, at least two; by default 0.6 to 1.1 times service speed. They
            should not leave the range of speeds that the model was identified in.
        """
        weights = Weights.of(model, dt, integral_lengths, rudder_weight, rate_weight_s2)
        length, service = model.particulars["length"], model.particulars["speed"]
        listed = rising(
            [service * part for part in SPEEDS] if speeds is None else speeds, "speeds"
        )
        gains, neutral, margins = [], [], []
        for speed in listed.tolist():
            ship = sample_ship(model, weights.dt, speed=speed)
            found = weights.gains(
                without_yaw_memory(model, weights.dt, speed), length / speed
            )
            gains.append(np.array(list(found.values())))
            neutral.append((ship.about.rudder, ship.about.sway))
            name = f"ScheduledLQ on model '{model.name}' at {speed:g} m/s"
            margins.append(Compensator.static(gains[-1][None]).margins(ship, name))
        at_service = [
            float(np.interp(service, listed, column)) for column in np.array(gains).T
        ]
        worst = {
            "least_gain_margin": min(1e6, *(m.gain_margin for m in margins)),
            "least_phase_margin_deg": min(m.phase_margin_deg for m in margins),
        }
        schedule = {
            "speeds": listed,
            "schedule": np.array(gains),
            "neutral": np.array(neutral),
        }
        own = dict(zip(SIGNALS, at_service, strict=True))
        return cls.designed(
            model,
            sample_ship(model, weights.dt),
            own,
            weights.design | worst,
            **schedule,
        )

    def at(self, speed: Floats) -> tuple[Floats, Floats]:
        """Gains, shape (n, 5), and neutral rudder and sway, shape (n, 2), at surge speeds of shape (n,)."""
        gains, neutral = (
            np.stack(
                [np.interp(speed, self.speeds, column) for column in table.T], axis=-1
            )
            for table in (self.schedule, self.neutral)
        )
        return gains, neutral

    def steer(
        self, seen: dict[str, Floats], memory: Floats, begins: Flags
    ) -> tuple[Floats, Floats]:
        """Feedback with the gains of each ship's speed."""
        gains, neutral = self.at(seen["surge"])
        rudder, sway = neutral.T
        order: Floats = rudder + np.einsum(
            "ij,ij->i", gains, deviations(seen, rudder, sway)
        )
        return order, memory


def rising(values: Sequence[float], name: str, above: float | None = 0.0) -> Floats:
    """Numbers in rising order as an array; InputError names them if they are not, or one is too small."""
    listed = [
        check_number(one, f"{name}[{i}]", above=above) for i, one in enumerate(values)
    ]
    if len(listed) < 2 or np.any(np.diff(listed) <= 0.0):
        raise InputError(
            f"{name}: {list(values)} found, expected at least two in rising order, SI"
            " units"
        )
    return np.array(listed)
