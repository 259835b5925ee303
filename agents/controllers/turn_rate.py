"""Rate-of-turn autopilot: proportional-integral control of the yaw rate with feed-forward from steady turns.

An ordered rate of turn is steered as it is. Without one it keeps a heading: the rate is
in proportion to the heading error, and no larger than the rate at which courses are
changed.

Source: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 12.2
(pole placement, reference feed-forward); Bech 1968, The reverse spiral test (rudder as
a function of the rate of turn).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from agents.controllers.controller import NUMBERS, Controller, Range
from agents.controllers.linear_loop import Compensator, sample_ship
from agents.controllers.memory import Flags, Floats, heading_error, records
from shipgym import InputError, ShipModel
from shipgym.checks import check_number
from shipgym.ships.linear import linearise, nomoto_of, steady_turn_rudder
from shipgym.tasks.task import control_interval

GRID = np.arange(
    0.02, 0.81, 0.02
)  # rates of the feed-forward, prime: times speed over length
LARGEST_RUDDER = (
    0.6  # share of the rudder limit beyond which no steady turn is tabulated
)
# the same of the rate at which courses are changed, as `wheel_over.TURN_RUDDER`
COURSE_RUDDER = 0.3
DAMPING, PER_LAG, PER_LENGTH = (
    0.9,
    0.3,
    2.0,
)  # of the pair of poles; its frequency times lag, length time
SLOWER = 4.0  # time of the heading over that of the rate


@dataclass(frozen=True, eq=False, kw_only=True)
class TurnRate(Controller):
    """Steers a rate of turn, and a heading by means of it.

    order = rudder of the steady turn + proportional * (wanted rate - yaw rate) + its
    integral.

    Attributes
    ----------
    rates, rudders : array of shape (n,)
        Steady yaw rates, rad/s, rising, and the rudder that keeps each, rad; straight
        lines between them.
    """

    kind: ClassVar[str] = "turn-rate"
    gain_names: ClassVar[tuple[str, ...]] = (
        "proportional",
        "integral",
        "heading_time",
        "rate",
    )
    ranges: ClassVar[Mapping[str, Range]] = {
        **Controller.ranges,
        **dict.fromkeys(
            ("heading_time", "rate", "frequency"), Range(1e-9, NUMBERS.largest)
        ),
    }
    reads: ClassVar[tuple[str, ...]] = ("yaw_rate", "rate_of_turn")
    arrays: ClassVar[Mapping[str, tuple[str | int, ...]]] = {
        "rates": ("rates",),
        "rudders": ("rates",),
    }

    #: Integral part of the rudder, rad, and the rate that follows the wanted one
    #: smoothly, rad/s.
    record: ClassVar[np.dtype[Any]] = np.dtype([("gathered", "f8"), ("followed", "f8")])

    rates: Floats
    rudders: Floats

    def __post_init__(self) -> None:
        rising(self.rates.tolist(), "rates")

    @classmethod
    def from_model(
        cls,
        model: ShipModel,
        *,
        dt: float | None = None,
        frequency: float | None = None,
        rate_deg_min: float | None = None,
    ) -> Self:
        """Design on a model, about straight running.

        Raises InputError if the model has no straight course or no steady turns, an
        argument is out of its range, or the closed loop is unstable.

        Parameters
        ----------
        model, dt
            As in `LQ.from_model`.
        frequency : float, optional
            Natural frequency of the pair of poles of the yaw rate, rad/s; by default as
            the lag of the steering gear and the ship's length allow.
        rate_deg_min : float, optional
            Rate at which courses are changed, degrees per minute; by default that of a
            steady turn with three tenths of the rudder's limit.
        """
        interval = (
            control_interval(model) if dt is None else check_number(dt, "dt", above=0.0)
        )
        ship, time = sample_ship(model, interval), model.travel_time
        form = nomoto_of(*linearise(model, ship.about))
        lag = model.steering.time_constant + 0.5 * interval
        wanted = min(PER_LAG / lag, PER_LENGTH / time)
        if frequency is not None:
            wanted = check_number(frequency, "frequency", above=0.0)
        rates, rudders = steady_turns(model, ship.about.rudder)
        reached = (
            np.abs(rudders - ship.about.rudder) <= COURSE_RUDDER * model.steering.limit
        )
        rate = float(
            max(min(rates[reached].max(), -rates[reached].min()), GRID[0] / time)
        )
        if rate_deg_min is not None:
            most = float(np.degrees(min(rates.max(), -rates.min()))) * 60.0
            rate = (
                np.radians(
                    check_number(rate_deg_min, "rate_deg_min", above=0.0, at_most=most)
                )
                / 60.0
            )
        gains = {
            "proportional": (
                max(2.0 * DAMPING * wanted - 1.0 / form.T, wanted) / form.rudder_effect
            ),
            "integral": wanted**2 / form.rudder_effect,
            "heading_time": SLOWER / wanted,
            "rate": float(rate),
        }
        design = {"frequency": wanted, "nomoto_K": form.K, "nomoto_T": form.T}
        return cls.designed(model, ship, gains, design, rates=rates, rudders=rudders)

    @property
    def smoothing(self) -> float:
        """Share of the way to the wanted rate that is taken in an interval."""
        step = self.design["dt"] * self.design["frequency"]
        return step / (1.0 + step)

    def steer(
        self, seen: dict[str, Floats], memory: Floats, begins: Flags
    ) -> tuple[Floats, Floats]:
        """Rudder for the ordered rate of turn, `rate_of_turn` in rad/s, or, where it is 0, the heading."""
        gains, rate, kept = self.gains, seen["yaw_rate"], records(memory, self.record)
        to_heading = np.clip(
            heading_error(seen) / gains["heading_time"], -gains["rate"], gains["rate"]
        )
        ordered = seen.get("rate_of_turn", np.zeros_like(to_heading))
        wanted = np.where(ordered == 0.0, to_heading, ordered)
        before = np.where(begins, rate, kept["followed"])
        followed = before + self.smoothing * (wanted - before)
        off = followed - rate
        order = (
            np.interp(followed, self.rates, self.rudders)
            + gains["proportional"] * off
            + kept["gathered"]
        )
        more = gains["integral"] * self.design["dt"] * off
        gathered = np.where(np.abs(order) < self.rudder_limit, more, 0.0)
        return order, np.column_stack([kept["gathered"] + gathered, followed])

    def loop(self) -> Compensator:
        """Small changes of a heading."""
        return self.linearised()


def steady_turns(model: ShipModel, neutral: float) -> tuple[Floats, Floats]:
    """Yaw rates of steady turns to both sides, rad/s, and their rudder angles, rad; `neutral`: without turn.

    Raises InputError if the model has none to one of the sides.
    """
    for slowed in (True, False):  # some models know no loss of speed
        found = {0.0: neutral}
        for side in (-1.0, 1.0):
            for rate in side * GRID / model.travel_time:
                rudder = steady_turn_rudder(model, float(rate), slowed)
                if (
                    rudder is None
                    or abs(rudder) > LARGEST_RUDDER * model.steering.limit
                ):
                    break
                found[float(rate)] = rudder
        if min(found) < 0.0 < max(found):
            return np.array(sorted(found)), np.array(
                [found[rate] for rate in sorted(found)]
            )
    raise InputError(
        f"model {model.name!r}: no steady turn found, expected one to either side"
    )


def rising(values: Sequence[float], name: str) -> Floats:
    """Numbers in rising order as an array; InputError names them if they are not."""
    listed = [check_number(one, f"{name}[{i}]") for i, one in enumerate(values)]
    if len(listed) < 2 or np.any(np.diff(listed) <= 0.0):
        raise InputError(
            f"{name}: {list(values)} found, expected at least two in rising order, SI"
            " units"
        )
    return np.array(listed)
