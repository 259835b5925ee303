"""Rate-of-turn autopilot: PI control of the yaw rate, with feed-forward.

The feed-forward is the rudder of the steady turn at that rate. An ordered rate of turn
is steered as it is. Without one it keeps a heading: the rate is in proportion to the
heading error, and no larger than the rate at which courses are changed.

Source: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 12.2
(pole placement, reference feed-forward); Bech 1968, The reverse spiral test (rudder as
a function of the rate of turn).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple, Self

import numpy as np

from agents.controllers.controller import ANY_NUMBER, Bounds, Controller
from agents.controllers.law import Law, Number, Signals
from agents.controllers.linear_loop import checked_interval, sample_ship
from shipgym import InputError, ShipModel
from shipgym.arrays import Floats
from shipgym.checks import check_number
from shipgym.engine.records import Record
from shipgym.models.by_name import takes_name
from shipgym.models.linear import Nomoto, linearise, nomoto_of, steady_turn_rudder

GRID = np.arange(0.02, 0.81, 0.02)  # rates of the feed-forward, times length over speed
# share of the rudder limit beyond which no steady turn is tabulated
LARGEST_RUDDER = 0.6
# of the pair of poles: damping ratio, frequency times lag, and times length over speed
DAMPING, PER_LAG, PER_LENGTH = 0.9, 0.3, 2.0


class TurnRateGains(NamedTuple):
    """Parameters of `turn_rate_law`."""

    rates: Floats  # rad/s, of steady turns, rising
    rudders: Floats  # rad, which keep them
    proportional: float  # rad per rad/s
    integral: float  # rad per rad
    heading_time: float  # s
    rate: float  # rad/s, at which courses are changed
    smoothing: float  # share of the way to the wanted rate that is taken in an interval
    dt: float  # s
    rudder_limit: float  # rad


class TurnRateMemory(NamedTuple):
    """Memory of `turn_rate_law`."""

    integral: Number  # rad, part of the rudder
    followed: Number  # rad/s, the rate that follows the wanted one smoothly
    started: Number  # 0 where an episode begins, else 1


def turn_rate_law(
    seen: Signals, memory: TurnRateMemory, p: TurnRateGains
) -> tuple[Number, TurnRateMemory]:
    """Steer the ordered rate of turn, or, if it is 0, one for the heading error."""
    wanted = wanted_rate(seen, p)
    before = np.where(memory.started > 0.0, memory.followed, seen.yaw_rate)
    followed = before + p.smoothing * (wanted - before)

    off = followed - seen.yaw_rate
    steady = np.interp(followed, p.rates, p.rudders)
    order = steady + p.proportional * off + memory.integral

    is_free = np.abs(order) < p.rudder_limit  # else the integral would wind up
    more = np.where(is_free, p.integral * p.dt * off, 0.0)
    memory = TurnRateMemory(
        integral=memory.integral + more,
        followed=followed,
        started=1.0,
    )
    return order, memory


def wanted_rate(seen: Signals, p: TurnRateGains) -> Number:
    """Rate of turn that is ordered, or that comes to the heading, rad/s."""
    uncut = seen.heading_error / p.heading_time
    to_heading = np.clip(uncut, -p.rate, p.rate)
    return np.where(seen.rate_of_turn == 0.0, to_heading, seen.rate_of_turn)


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
    law: ClassVar[Law] = staticmethod(turn_rate_law)
    memory_record: ClassVar[Record] = TurnRateMemory
    reads: ClassVar[tuple[str, ...]] = ("yaw_rate", "rate_of_turn")
    bounds: ClassVar[Mapping[str, Bounds]] = {
        **Controller.bounds,
        "heading_time": Bounds(1e-9, ANY_NUMBER.largest),
        "rate": Bounds(1e-9, ANY_NUMBER.largest),
        "frequency": Bounds(1e-9, ANY_NUMBER.largest),
    }
    arrays: ClassVar[Mapping[str, tuple[str | int, ...]]] = {
        "rates": ("rates",),
        "rudders": ("rates",),
    }

    rates: Floats
    rudders: Floats

    def __post_init__(self) -> None:
        check_rising(self.rates.tolist(), "rates")

    @classmethod
    @takes_name
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
        interval = checked_interval(model, dt)
        ship = sample_ship(model, interval)
        form = nomoto_of(*linearise(model, ship.about))
        if frequency is None:
            frequency = rate_frequency(model, interval)
        check_number(frequency, "frequency", above=0.0)

        turns = steady_turns(model, ship.about.rudder)
        if rate_deg_min is None:
            rate = course_rate(model, turns, ship.about.rudder)
        else:
            rate = checked_rate(rate_deg_min, turns)

        slower = 4.0  # time of the heading over that of the rate
        gains = {
            **rate_gains(form, frequency),
            "heading_time": slower / frequency,
            "rate": rate,
        }
        return cls.designed(
            model,
            ship,
            gains,
            {"frequency": frequency},
            rates=turns.rates,
            rudders=turns.rudders,
        )

    @cached_property
    def parameters(self) -> TurnRateGains:
        """Parameters of its law."""
        step = self.design["dt"] * self.design["frequency"]
        return TurnRateGains(
            rates=self.rates,
            rudders=self.rudders,
            proportional=self.gains["proportional"],
            integral=self.gains["integral"],
            heading_time=self.gains["heading_time"],
            rate=self.gains["rate"],
            smoothing=step / (1.0 + step),
            dt=self.design["dt"],
            rudder_limit=self.rudder_limit,
        )


def rate_frequency(model: ShipModel, interval: float) -> float:
    """Frequency of the yaw rate's poles that lag and length allow, rad/s."""
    lag = model.steering.time_constant + 0.5 * interval
    return float(min(PER_LAG / lag, PER_LENGTH / model.travel_time))


def rate_gains(form: Nomoto, frequency: float) -> dict[str, float]:
    """PI gains that place the poles of the yaw rate on Nomoto's first-order form.

    s^2 + (1 / T + K / T Kp) s + K / T Ki = s^2 + 2 damping frequency s + frequency^2;
    a ship that is damped by herself keeps some proportional gain.
    """
    missing = 2.0 * DAMPING * frequency - 1.0 / form.T
    damping = max(missing, frequency)
    effect = form.rudder_effect
    return {"proportional": damping / effect, "integral": frequency**2 / effect}


class SteadyTurns(NamedTuple):
    """Steady turns to both sides, by rising rates."""

    rates: Floats  # rad/s, shape (n,)
    rudders: Floats  # rad, shape (n,)

    @property
    def largest_rate(self) -> float:
        """Largest rate that is reached to either side, rad/s."""
        return float(min(self.rates.max(), -self.rates.min()))


def steady_turns(model: ShipModel, neutral: float) -> SteadyTurns:
    """Tabulate the steady turns of a model; `neutral`: rudder without a turn, rad.

    Raises InputError if the model has none to one of the sides.
    """
    straight = (0.0, neutral)
    for slowed in (True, False):  # some models know no loss of speed
        to_port = _turns_to_one_side(model, -1.0, slowed)
        to_starboard = _turns_to_one_side(model, 1.0, slowed)
        if to_port and to_starboard:
            to_port.reverse()
            rates, rudders = np.array([*to_port, straight, *to_starboard]).T
            return SteadyTurns(rates, rudders)
    raise InputError(
        f"model {model.name!r}: expected steady turns to either side, got none"
    )


def _turns_to_one_side(
    model: ShipModel, side: float, slowed: bool
) -> list[tuple[float, float]]:
    """Rates, rad/s, and rudders, rad, of steady turns from the slowest on."""
    rates = side * GRID / model.travel_time
    largest = LARGEST_RUDDER * model.steering.limit
    turns = []
    for rate in rates.tolist():
        rudder = steady_turn_rudder(model, rate, slowed)
        if rudder is None or abs(rudder) > largest:
            break
        turns.append((rate, rudder))
    return turns


def course_rate(model: ShipModel, turns: SteadyTurns, neutral: float) -> float:
    """Rate, rad/s, of a steady turn by which courses are changed."""
    part_of_limit = 0.3  # of the rudder
    largest = part_of_limit * model.steering.limit
    off_neutral = np.abs(turns.rudders - neutral)
    reached = off_neutral <= largest
    gentle = SteadyTurns(
        rates=turns.rates[reached],
        rudders=turns.rudders[reached],
    )
    slowest = float(GRID[0])
    least_rate = slowest / model.travel_time
    return max(gentle.largest_rate, least_rate)


def checked_rate(rate_deg_min: float, turns: SteadyTurns) -> float:
    """Rate of course changes, rad/s; InputError for one that no turn reaches."""
    largest = 60.0 * float(np.degrees(turns.largest_rate))
    check_number(rate_deg_min, "rate_deg_min", above=0.0, at_most=largest)
    return float(np.radians(rate_deg_min)) / 60.0


def check_rising(values: Sequence[float], name: str) -> None:
    """Refuse numbers that are not in rising order; InputError names them."""
    for i, value in enumerate(values):
        check_number(value, f"{name}[{i}]")
    rises = np.diff(values)
    if len(values) < 2 or np.any(rises <= 0.0):
        raise InputError(
            f"{name}: expected at least two numbers in rising order, SI units, got"
            f" {list(values)}"
        )
