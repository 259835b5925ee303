"""The newest readings of a ship's instruments, and when they are not to be trusted."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from math import cos, inf, radians, sin

from agents.deployment.nmea import NmeaReading
from shipgym.checks import check_number
from shipgym.tasks.guidance import wrapped
from shipgym.trials.nmea import NMEA_QUANTITIES


@dataclass(frozen=True)
class Limits:
    """Limits beyond which an autopilot warns or hands over, and its largest rudder.

    Attributes
    ----------
    silence_s : float
        Time without a valid reading of anything that it steers by.
    disagreement : float
        How far two instruments may differ, as a multiple of the tolerance that
        `shipgym/trials/nmea.toml` gives to a quantity.
    rudder_deg : float
        Difference between the rudder and where its order should have brought it.
    rudder_rate_deg_s : float
        Slowest rate of the steering gear; 2.3 deg/s is that of SOLAS II-1/29.
    persistence_s : float
        How long a disagreement may last.
    late_s : float
        How late a step may be; beyond, the computer cannot keep up.
    heading_noise_deg : float
        Standard deviation of the compass against the rate gyro.
    wave_yaw_deg : float
        Standard deviation of the heading in the roughest sea.
    course_deg : float
        Change of the angle between heading and course over ground.
    order_deg : float
        Largest rudder order, if it is less than the ship's limit.
    off_heading_deg, off_track_m : float
        Distance from the set-point and from the track at which it warns.
    early_s : float
        Time before a course change at which it is announced.
    """

    silence_s: float = 3.0
    disagreement: float = 1.0
    rudder_deg: float = 5.0
    rudder_rate_deg_s: float = 2.3
    persistence_s: float = 2.0
    late_s: float = 1.0
    heading_noise_deg: float = 0.5
    wave_yaw_deg: float = 1.0
    course_deg: float = 10.0
    order_deg: float = 90.0
    off_heading_deg: float = 10.0
    off_track_m: float = 200.0
    early_s: float = 60.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            check_number(value, name, above=0.0)


@dataclass
class HelmSensors:
    """The newest readings, and what is wrong with them.

    Attributes
    ----------
    limits : Limits
        When they are not to be trusted.
    newest : dict
        Value and time, s, of the newest reading by quantity and talker.
    since : dict
        When a fault was first seen, s.
    reachable : (float, float) or None
        Between which angles the rudder is, if the gear is no slower than allowed, rad.
    """

    limits: Limits
    newest: dict[str, dict[str, tuple[float, float]]] = field(default_factory=dict)
    since: dict[str, float] = field(default_factory=dict)
    reachable: tuple[float, float] | None = None

    def take(self, reading: NmeaReading, now: float) -> None:
        """Keep a reading; the first talker of a quantity is steered by."""
        talkers = self.newest.setdefault(reading.quantity, {})
        talkers[reading.talker] = (reading.value, now)

    def value(self, quantity: str, now: float) -> float | None:
        """Newest value of the first talker of a quantity; None if it is too old."""
        for value, time in self.newest.get(quantity, {}).values():
            return value if self._is_fresh(time, now) else None
        return None

    def numbers(self, needed: Iterable[str], now: float) -> dict[str, float | None]:
        """Values by quantity; speeds over ground if there is no log."""
        values = {quantity: self.value(quantity, now) for quantity in needed}
        course = self.value("course", now)
        speed = self.value("speed", now)
        heading = self.value("heading", now)
        if course is None or speed is None or heading is None:
            return values

        drift = course - heading
        over_ground = {
            "surge": speed * cos(drift),
            "sway": speed * sin(drift),
        }
        for quantity, value in over_ground.items():
            if quantity in values and quantity not in self.newest:
                values[quantity] = value
        return values

    def fault(self, order: float, step: float, now: float) -> str:
        """Describe a fault that has lasted too long; empty without one.

        A fault is that two talkers differ, or that the rudder does not follow its
        order, rad. `step`: time since the last call, s.
        """
        return self._disagreement(now) or self._rudder_fault(order, step, now)

    def _disagreement(self, now: float) -> str:
        """Describe two talkers of one quantity that differ."""
        angles = ("heading", "course", "leg", "to_steer", "rudder", "waypoint_bearing")
        for quantity in self.newest:
            fresh = self._fresh(quantity, now)
            if not fresh:
                continue
            first = next(iter(fresh))
            tolerance = NMEA_QUANTITIES[quantity].tolerance or inf
            tolerance *= self.limits.disagreement
            for talker, value in fresh.items():
                apart = value - fresh[first]
                if quantity in angles:
                    apart = float(wrapped(apart))
                differs = abs(apart) > tolerance
                if self._lasts(f"{quantity} {talker}", differs, now):
                    name = quantity.replace("_", " ")
                    return f"{name} of {first} and {talker} disagree"
        return ""

    def _fresh(self, quantity: str, now: float) -> dict[str, float]:
        """Newest values of a quantity by talker, without those that are too old."""
        fresh = {}
        for talker, (value, time) in self.newest[quantity].items():
            if self._is_fresh(time, now):
                fresh[talker] = value
        return fresh

    def _rudder_fault(self, order: float, step: float, now: float) -> str:
        """Compare the rudder with where its orders brought it, by a slow gear or not."""
        rudder = self.value("rudder", now) or 0.0
        low, high = self.reachable or (rudder, rudder)
        reach = radians(self.limits.rudder_rate_deg_s) * step
        low = min(low + reach, order)  # where the slowest gear has brought it
        high = max(high - reach, order)
        self.reachable = low, high

        off = max(low - rudder, rudder - high)
        tolerance = radians(self.limits.rudder_deg)
        if self._lasts("order", off > tolerance, now):
            return "the rudder does not follow its order"
        return ""

    def _is_fresh(self, time: float, now: float) -> bool:
        return now - time <= self.limits.silence_s

    def _lasts(self, what: str, is_wrong: bool, now: float) -> bool:
        """Note when a fault begins; True if it has lasted too long."""
        if not is_wrong:
            self.since.pop(what, None)
            return False
        begin = self.since.setdefault(what, now)
        lasted_s = now - begin
        return lasted_s > self.limits.persistence_s
