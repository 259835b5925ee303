"""The steering gear: how the rudder follows its order."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self

from shipgym.checks import bounded, keep_numbers, placed, read_fields


@dataclass(frozen=True)
class SteeringGear:
    """Limits and lag of the steering gear.

    With a time constant of zero the rudder moves towards its order at the full rate (a
    ramp); otherwise

        d(delta)/dt = clip((clip(order, -limit, limit) - delta) / time_constant, -rate,
        rate).

    In simulations the lag is at least 0.45 of a step (`frequency`).

    Raises InputError for a value out of these bounds.

    Parameters
    ----------
    rudder_limit_deg : float
        Largest rudder order, degrees, above 0 and at most 90. 35 is usual.
    rudder_rate_deg_s : float
        Largest rudder rate, degrees per second, above 0. SOLAS II-1 asks for 65 degrees
        in 28 s.
    time_constant : float
        Lag, s; 0 for a gear of constant rate.
    """

    rudder_limit_deg: float = bounded(35.0, above=0.0, at_most=90.0)
    rudder_rate_deg_s: float = bounded(2.5, above=0.0)
    time_constant: float = bounded(0.0, at_least=0.0)

    def __post_init__(self) -> None:
        keep_numbers(self)

    @classmethod
    def from_mapping(
        cls, mapping: Mapping[str, Any], where: str = "steering gear"
    ) -> Self:
        """Make a steering gear from the keys of the ship file's ``[steering]``.

        Raises InputError, beginning with `where`, for an unknown key or a value out of
        bounds.
        """
        with placed(where, " "):
            return read_fields(cls, mapping, where)

    def to_dict(self) -> dict[str, float]:
        """Return the three values by name, as :meth:`from_mapping` takes them."""
        return asdict(self)

    @property
    def limit(self) -> float:
        """Largest rudder order, rad."""
        return math.radians(self.rudder_limit_deg)

    @property
    def rate(self) -> float:
        """Largest rudder rate, rad/s."""
        return math.radians(self.rudder_rate_deg_s)

    @property
    def remark(self) -> str:
        """For which gear indices and margins hold, and what another one changes."""
        return (
            f"for a steering gear of {self.rudder_rate_deg_s:.3g} deg/s with a lag of"
            f" {self.time_constant:.3g} s, as in [steering], without dead time: a dead"
            " time adds about that time x yaw rate to an overshoot, and, as a longer"
            " lag, costs margin"
        )

    def frequency(self, step: float = 0.0) -> float:
        """Inverse of the time constant, 1/s, in steps of some seconds; 0 without lag.

        A lag shorter than 0.45 of a step is taken as that: the Runge-Kutta method does
        not follow it, and is unstable where it is shorter than 0.36 of a step (Hairer &
        Wanner 1996, IV.2).
        """
        if self.time_constant == 0.0:
            return 0.0
        shortest = 0.45 * step
        return 1.0 / max(self.time_constant, shortest)
