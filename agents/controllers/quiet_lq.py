"""LQ whose rudder is kept quiet: a low-pass and a dead-band on the order.

Source: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 13.2
(dead-band and filters of autopilots); van Amerongen 1982, Adaptive steering of ships,
chapter 5 (rudder calls in waves).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, NamedTuple, Self

import numpy as np

from agents.controllers.controller import Bounds
from agents.controllers.law import (
    Law,
    LinearFeedback,
    Nothing,
    Number,
    Signals,
    linear_law,
)
from agents.controllers.linear_loop import SIGNALS
from agents.controllers.lq import LQ, lq_design
from agents.controllers.margins import Compensator
from shipgym import ShipModel
from shipgym.checks import check_number
from shipgym.engine.records import Record
from shipgym.models.by_name import takes_name
from shipgym.tasks.scales import RUDDER_WEIGHT


class QuietFeedback(NamedTuple):
    """Parameters of `quiet_law`."""

    feedback: LinearFeedback
    rudder_update: float  # share of a new order in its low-pass
    rudder_band: float  # rad that an order is to differ from the last one


class QuietMemory(NamedTuple):
    """Memory of `quiet_law`."""

    smooth: Number  # rad, order after its low-pass
    order: Number  # rad, the last one
    started: Number  # 0 where an episode begins, else 1


def quiet_law(
    seen: Signals, memory: QuietMemory, p: QuietFeedback
) -> tuple[Number, QuietMemory]:
    """Order of the linear law, smoothed, and held while it hardly changes."""
    asked, _ = linear_law(seen, Nothing(), p.feedback)
    filtered = memory.smooth + p.rudder_update * (asked - memory.smooth)
    has_started = memory.started > 0.0
    smooth = np.where(has_started, filtered, asked)

    is_small = np.abs(smooth - memory.order) <= p.rudder_band
    order = np.where(has_started & is_small, memory.order, smooth)
    return order, QuietMemory(smooth, order, started=1.0)


@dataclass(frozen=True, eq=False)
class QuietLQ(LQ):
    """LQ with a low-pass and a dead-band on its order."""

    kind: ClassVar[str] = "quiet-lq"
    law: ClassVar[Law] = staticmethod(quiet_law)
    memory_record: ClassVar[Record] = QuietMemory
    gain_names: ClassVar[tuple[str, ...]] = (*SIGNALS, "rudder_update", "rudder_band")
    bounds: ClassVar[Mapping[str, Bounds]] = {
        **LQ.bounds,
        "rudder_update": Bounds(1e-6, 1.0),
        "rudder_band": Bounds(0.0, np.pi),
    }

    @classmethod
    @takes_name
    def from_model(
        cls,
        model: ShipModel,
        *,
        dt: float | None = None,
        integral_lengths: float = 20.0,
        rudder_weight: float = RUDDER_WEIGHT,
        rate_weight_s2: float | None = None,
        rudder_time: float = 0.0,
        rudder_band_deg: float = 0.0,
    ) -> Self:
        """Design LQ on a model, and filter its order.

        Raises InputError as `LQ.from_model`, and if the low-pass makes the loop
        unstable.

        Parameters
        ----------
        model : ShipModel
        dt, integral_lengths, rudder_weight, rate_weight_s2 : float, optional
            See `LQ.from_model`.
        rudder_time : float
            Time constant of the low-pass, in times to travel one ship length.
        rudder_band_deg : float
            By how much an order is to differ from the last one, degrees.
        """
        check_number(rudder_time, "rudder_time", at_least=0.0)
        check_number(rudder_band_deg, "rudder_band_deg", at_least=0.0, at_most=90.0)
        made = lq_design(
            model,
            dt=dt,
            integral_lengths=integral_lengths,
            rudder_weight=rudder_weight,
            rate_weight_s2=rate_weight_s2,
        )
        interval = made.ship.dt
        time_constant = rudder_time * model.travel_time
        gains = {
            **made.gains,
            "rudder_update": interval / (interval + time_constant),
            "rudder_band": float(np.radians(rudder_band_deg)),
        }
        return cls.designed(model, made.ship, gains, made.design)

    @cached_property
    def parameters(self) -> QuietFeedback:
        """Parameters of its law."""
        return QuietFeedback(
            self.linear_feedback,
            rudder_update=self.gains["rudder_update"],
            rudder_band=self.gains["rudder_band"],
        )

    def loop(self) -> Compensator:
        """Loop without the dead-band, which small motions would never leave."""
        without = replace(self, gains={**self.gains, "rudder_band": 0.0})
        return without._linearised()
