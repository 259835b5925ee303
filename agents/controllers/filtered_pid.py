"""PID autopilot with what ships carry around it: reference filter, anti-windup and wave filter.

Source: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 10.2.1
(third-order reference model), 11.1.2 (notch filter), 12.2.6 (heading autopilot with
feedforward); Astrom & Hagglund 2006, Advanced PID Control, 3.5 (back-calculation).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from agents.controllers.controller import Controller, Range
from agents.controllers.linear_loop import (
    ERROR,
    SIGNALS,
    YAW_RATE,
    Compensator,
    sample_ship,
)
from agents.controllers.memory import Flags, Floats, Records, heading_error, records
from agents.controllers.pid import PID
from shipgym import ShipModel
from shipgym.checks import check_number
from shipgym.tasks.guidance import wrapped

DEEP, WIDE = (
    0.1,
    0.7,
)  # damping ratios of the notch's numerator and denominator (Fossen 2011, 11.1.2)
# gain below which the integral is not worth limiting: the rudder does not see it
LEAST_INTEGRAL = 1e-12
FROM_NONE = Range(0.0, 1e6)  # of rates and frequencies; 0 leaves a filter out


@dataclass(frozen=True, eq=False, kw_only=True)
class FilteredPID(Controller):
    """PID with a reference filter, anti-windup, and a notch filter for waves.

    order = neutral + proportional * (reference - heading) + derivative * (reference's
    rate - yaw rate) + integral of that error. The integral is its own, not the
    environment's: what the rudder's limit cuts off is taken back from it
    (back-calculation).
    """

    kind: ClassVar[str] = "pid-filtered"
    feedback: ClassVar[Mapping[str, tuple[str, float]]] = PID.feedback
    reads: ClassVar[tuple[str, ...]] = ("yaw_rate",)
    ranges: ClassVar[Mapping[str, Range]] = {
        **Controller.ranges,
        "reference_frequency": FROM_NONE,
        "largest_turn_rate": FROM_NONE,
        "tracking_rate": FROM_NONE,
        "wave_frequency": FROM_NONE,
    }
    record: ClassVar[np.dtype[Any]] = np.dtype(
        [
            ("error", "f8"),
            ("rate", "f8"),  # measured last
            ("lead", "f8"),
            ("turn", "f8"),
            ("turn_rate", "f8"),  # of the reference over the course
            ("gathered", "f8"),  # integral of the error
            ("heading_notch", "f8", 4),
            ("rate_notch", "f8", 4),
        ]
    )

    @classmethod
    def from_model(
        cls,
        model: ShipModel,
        *,
        dt: float | None = None,
        frequency: float | None = None,
        damping: float | None = None,
        integral_lengths: float = 20.0,
        reference_share: float = 3.0,
        largest_turn_rate_deg_s: float | None = None,
        tracking_lengths: float = 2.0,
        wave_period: float | None = None,
    ) -> Self:
        """Design on a model: PID's gains, and the filters around them.

        Raises InputError if the model has no straight course, an argument is out of its
        range, or the loop is unstable.

        Parameters
        ----------
        model, dt, frequency, damping, integral_lengths
            As in `PID.from_model`.
        reference_share : float
            Natural frequency of the reference model over that of the loop. Less turns
            slower and with less rudder; infinite leaves the reference filter out.
        largest_turn_rate_deg_s : float, optional
            Of the reference, degrees per second; by default none.
        tracking_lengths : float
            Time in which the integral gives back what the limit cuts off, in times to
            travel one ship length; infinite leaves the anti-windup out.
        wave_period : float, optional
            Of the first-order motion as it is met, s: heading and yaw rate go through a
            notch there.
        """
        plain = PID.from_model(
            model,
            dt=dt,
            frequency=frequency,
            damping=damping,
            integral_lengths=integral_lengths,
        )
        interval = plain.design["dt"]
        frequency_share = _rate(reference_share, "reference_share")
        tracking = _rate(tracking_lengths, "tracking_lengths") * model.travel_time
        turn_rate = 0.0  # no limit
        if largest_turn_rate_deg_s is not None:
            turn_rate = check_number(
                largest_turn_rate_deg_s, "largest_turn_rate_deg_s", above=0.0
            )
        if wave_period is not None:
            check_number(
                wave_period,
                "wave_period",
                above=2.0 * interval,
                hint="two control intervals, in s",
            )
        design = plain.design | {
            "reference_frequency": frequency_share * plain.design["frequency"],
            "largest_turn_rate": float(np.radians(turn_rate)),
            "tracking_rate": 1.0 / tracking if tracking else 0.0,
            "wave_frequency": 0.0 if wave_period is None else 2.0 * np.pi / wave_period,
        }
        return cls.designed(model, sample_ship(model, interval), plain.gains, design)

    def steer(
        self, seen: dict[str, Floats], memory: Floats, begins: Flags
    ) -> tuple[Floats, Floats]:
        """One control interval of filters and feedback."""
        dt, gains, memory = self.design["dt"], self.gains, memory.copy()
        kept = records(memory, self.record)
        error, rate = heading_error(seen), seen["yaw_rate"]
        # a change of the heading error that is not the ship's own turning is one of the
        # course
        turned = 0.5 * dt * (rate + kept["rate"])
        course_change = np.where(begins, 0.0, wrapped(error - kept["error"] + turned))
        kept["error"], kept["rate"] = error, rate
        kept["lead"][begins] = -error[begins]  # the reference sets out from the heading
        lead, turn = self._reference(kept, course_change)
        quiet_error, quiet_rate = error, rate
        if self.design["wave_frequency"]:
            quiet_error = wrapped(
                error
                - self._notched(error, course_change, kept["heading_notch"], begins)
            )
            quiet_rate = rate - self._notched(
                rate, np.zeros_like(rate), kept["rate_notch"], begins
            )
        off = wrapped(quiet_error + lead)
        gathered = kept["gathered"] + np.where(begins, 0.0, dt * off)
        order = (
            self.neutral_rudder
            + gains["proportional"] * off
            + gains["derivative"] * (turn - quiet_rate)
        )
        order = order + gains["integral"] * gathered
        cut = np.clip(order, -self.rudder_limit, self.rudder_limit) - order
        if self.design["tracking_rate"] and gains["integral"] > LEAST_INTEGRAL:
            gathered = (
                gathered + dt * self.design["tracking_rate"] * cut / gains["integral"]
            )
        kept["gathered"] = gathered
        return order, memory

    def _reference(self, kept: Records, course_change: Floats) -> tuple[Floats, Floats]:
        """Lead of the reference over the course, and the reference's turn rate, an interval later.

        A third-order reference model (w / (s + w)) w^2 / (s^2 + 2 w s + w^2) with the
        course as input, which is written for the lead, reference minus course: only
        that is known.
        """
        frequency, dt = self.design["reference_frequency"], self.design["dt"]
        if frequency == 0.0:
            return np.zeros_like(course_change), np.zeros_like(course_change)
        lead = wrapped(kept["lead"] - course_change)
        turn, turn_rate = kept["turn"], kept["turn_rate"]
        jerk = (
            -3.0 * frequency * turn_rate
            - 3.0 * frequency**2 * turn
            - frequency**3 * lead
        )
        turn_rate = turn_rate + dt * jerk
        turn = turn + dt * turn_rate
        if largest := self.design["largest_turn_rate"]:
            turn = np.clip(turn, -largest, largest)
        lead = wrapped(lead + dt * turn)
        kept["lead"], kept["turn"], kept["turn_rate"] = lead, turn, turn_rate
        return lead, turn

    def _notched(
        self, signal: Floats, shift: Floats, kept: Floats, begins: Flags
    ) -> Floats:
        """What the notch takes away from a signal whose past is shifted with the course; 0 at the start.

        `kept`: the last two signals and what was taken away from them, shape (n, 4),
        changed in place.
        """
        x1, x2 = (np.where(begins, signal, past + shift) for past in kept[:, :2].T)
        signal = x1 + wrapped(signal - x1)
        band, once, twice = notch_band(
            self.design["wave_frequency"] * self.design["dt"]
        )
        taken: Floats = band * (signal - x2) - once * kept[:, 2] - twice * kept[:, 3]
        kept[:] = np.stack([signal, x1, taken, kept[:, 2]], axis=-1)
        return taken

    def loop(self) -> Compensator:
        """Integral, and the notch where there is one; the reference is outside of the loop."""
        dt, gains, frequency = (
            self.design["dt"],
            self.gains,
            self.design["wave_frequency"],
        )
        measure = np.zeros((2, len(SIGNALS)))
        measure[0, ERROR] = measure[1, YAW_RATE] = 1.0
        row = np.array(
            [gains["proportional"] + gains["integral"] * dt, -gains["derivative"]]
        )
        none = np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((2, 0)), np.eye(2)
        a, b, c, d = _two_notches(frequency * dt) if frequency else none
        n = len(a)
        A = np.zeros((n + 1, n + 1))
        A[:n, :n], A[n, n], A[n, :n] = a, 1.0, dt * c[0]
        B = np.vstack([b @ measure, dt * d[:1] @ measure])
        return Compensator(
            A, B, np.append(row @ c, gains["integral"])[None], (row @ d @ measure)[None]
        )


def _rate(value: float, name: str) -> float:
    """A positive number; 0 for an infinite one, which leaves its part out."""
    return 0.0 if np.isposinf(value) else check_number(value, name, above=0.0)


def notch_band(turn: float) -> tuple[float, float, float]:
    """Band-pass that a notch takes away, discretised bilinearly at `turn` rad an interval.

    Returns `band, once, twice`: taken[k] = band (signal[k] - signal[k - 2]) - once
    taken[k - 1] - twice taken[k - 2].
    """
    k = np.tan(0.5 * turn)
    per = 1.0 / (1.0 + 2.0 * WIDE * k + k * k)
    band = 2.0 * (WIDE - DEEP) * k * per
    return band, 2.0 * (k * k - 1.0) * per, (1.0 - 2.0 * WIDE * k + k * k) * per


def _two_notches(turn: float) -> tuple[Floats, Floats, Floats, Floats]:
    """State space of the notch on error and yaw rate side by side."""
    import control  # here, because it takes a second to import
    from scipy.linalg import block_diag

    band, once, twice = notch_band(turn)
    notch = control.tf2ss([1.0 - band, once, twice + band], [1.0, once, twice], True)
    a, b, c, d = (
        np.asarray(block_diag(one, one)) for one in (notch.A, notch.B, notch.C, notch.D)
    )
    return a, b, c, d
