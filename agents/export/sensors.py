"""The newest readings of a ship's instruments, and when they are not to be trusted."""

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from math import cos, inf, radians, sin

from agents.export.instruments import Instrument, difference
from agents.export.nmea import NmeaReading, NmeaSource
from shipgym.checks import check_number
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

    A source is a talker, a sentence and an address. Of each quantity at most
    `most_sources` are kept.

    Attributes
    ----------
    limits : Limits
        When they are not to be trusted.
    newest : dict
        Instruments by quantity and source; the first is steered by.
    since : dict
        When a fault was first seen, s.
    expected : float or None
        Where the rudder should be by now, if the gear is as slow as allowed, rad.
    reachable : (float, float) or None
        Between which angles it is, if the gear is no slower than that, rad.
    turning : float
        Largest rate of turn of the last seconds, rad/s.
    """

    limits: Limits
    newest: dict[str, dict[NmeaSource, Instrument]] = field(default_factory=dict)
    since: dict[str, float] = field(default_factory=dict)
    expected: float | None = None
    reachable: tuple[float, float] | None = None
    turning: float = 0.0
    most_sources: int = 16

    def take(self, reading: NmeaReading, now: float) -> None:
        """Keep a reading; the first source of a quantity is steered by."""
        quantity = reading.quantity
        sources = self.newest.setdefault(quantity, {})
        instrument = sources.get(reading.source)
        if instrument is None:
            if len(sources) >= self.most_sources:
                _forget_oldest(sources)
            sources[reading.source] = Instrument(quantity, reading.value, now)
        else:
            seconds = now - instrument.time
            believable = self._believable(quantity, seconds)
            instrument.take(reading.value, now, believable)
        if quantity == "yaw_rate":
            self._note_turning(abs(reading.value))

    def _note_turning(self, rate: float) -> None:
        """Keep the largest rate of turn, which fades within some readings."""
        fading = 0.9
        self.turning = max(rate, fading * self.turning)

    def _believable(self, quantity: str, seconds: float) -> float:
        """Largest change of a quantity in some seconds; rudders may jump."""
        moves_fast = quantity in ("rudder", "yaw_rate", "sway")
        tolerance = NMEA_QUANTITIES[quantity].tolerance
        if tolerance is None or moves_fast:
            return inf
        tolerance *= self.limits.disagreement
        if quantity in ("heading", "course"):
            slowest = radians(3.0)
            tolerance += max(self.turning, slowest) * seconds
        return tolerance

    def renew(self, now: float) -> None:
        """Forget sources that are silent, and where the rudder was expected.

        True headings come before magnetic ones.
        """
        self.expected = None
        self.since.pop("order", None)
        for quantity, sources in list(self.newest.items()):
            spoke = self._fresh(quantity, now)
            order = sorted(spoke, key=lambda source: source.is_magnetic)
            sources.clear()
            for source in order:
                sources[source] = spoke[source]
            if not sources:
                del self.newest[quantity]

    def value(self, quantity: str, now: float) -> float | None:
        """Newest value of the first source of a quantity; None if it is too old."""
        sources = self.newest.get(quantity)
        if not sources:
            return None
        first = next(iter(sources))
        instrument = self._on_any_port(first, sources, now)
        return instrument.value if self._is_fresh(instrument.time, now) else None

    def _on_any_port(
        self, first: NmeaSource, sources: dict[NmeaSource, Instrument], now: float
    ) -> Instrument:
        """The first instrument, which may have gone on from another port of its host.

        Some programs send each datagram from a new port.
        """
        patience_s = 1.0
        instrument = sources[first]
        if now - instrument.time > patience_s:
            for source, other in sources.items():
                is_same = source.host == first.host
                if is_same and other.time > instrument.time:
                    instrument = other
        return instrument

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

    def fault(
        self,
        order: float,
        step: float,
        now: float,
        read: Collection[str] | None = None,
    ) -> str:
        """Describe a fault that has lasted too long; empty without one.

        A fault is that two sources of a quantity differ, or that the rudder does not
        follow its order, rad. `step`: time since the last call, s; `read`: quantities
        that are steered by, by default all.
        """
        disagreement = self._disagreement(now, read)
        self._expect_rudder(order, step, now)
        if disagreement or (read is not None and "rudder" not in read):
            return disagreement
        return self._rudder_fault(order, now)

    def _disagreement(self, now: float, read: Collection[str] | None) -> str:
        """Describe two sources of one quantity that differ."""
        for quantity in self.newest:
            if read is not None and quantity not in read:
                continue
            name = quantity.replace("_", " ")
            for source, instrument in self._fresh(quantity, now).items():
                if instrument.is_two:
                    return f"two instruments send as {source}, each its own {name}"
            first, other = self._apart(quantity, now)
            if self.lasts(quantity, other is not None, now):
                return f"{name} of {first} and {other} disagree"
        return ""

    def _apart(
        self, quantity: str, now: float
    ) -> tuple[NmeaSource | None, NmeaSource | None]:
        """The first source and one that differs from it, or no such."""
        fresh = self._fresh(quantity, now)
        is_unsure = quantity == "course" and not self._has_way(now)
        if not fresh or is_unsure:
            return None, None

        tolerance = NMEA_QUANTITIES[quantity].tolerance or inf
        tolerance *= self.limits.disagreement
        first, *others = fresh
        reference = fresh[first]
        for source in others:
            instrument = fresh[source]
            allowed = tolerance
            if quantity in ("heading", "course"):
                seconds = abs(instrument.time - reference.time)
                allowed += self.turning * seconds
            apart = difference(quantity, instrument.value, reference.value)
            if instrument.count > 1 and apart > allowed:
                return first, source
        return None, None

    def _has_way(self, now: float) -> bool:
        """True if the ship is fast enough for her course over ground to be known."""
        slow = 0.5  # m/s
        speed = self.value("speed", now)
        return speed is None or speed > slow

    def fresh(self, quantity: str, now: float) -> dict[NmeaSource, float]:
        """Newest values of a quantity by source, without those that are too old."""
        instruments = self._fresh(quantity, now)
        return {source: instrument.value for source, instrument in instruments.items()}

    def _fresh(self, quantity: str, now: float) -> dict[NmeaSource, Instrument]:
        """Instruments of a quantity, without those that are silent."""
        fresh = {}
        for source, instrument in self.newest.get(quantity, {}).items():
            if self._is_fresh(instrument.time, now):
                fresh[source] = instrument
        return fresh

    def _expect_rudder(self, order: float, step: float, now: float) -> None:
        """Move the expected rudder to its order as fast as a slow gear."""
        if self.expected is None or self.reachable is None:
            self.expected = self.value("rudder", now) or 0.0
            self.reachable = self.expected, self.expected
        reach = radians(self.limits.rudder_rate_deg_s) * step
        to_go = order - self.expected
        self.expected += min(max(to_go, -reach), reach)

        low, high = self.reachable
        low = min(low + reach, order)
        high = max(high - reach, order)
        self.reachable = low, high

    def _rudder_fault(self, order: float, now: float) -> str:
        """Compare the rudder with where its orders brought it, slowly or fast."""
        if self.reachable is None:
            return ""
        rudder = self.value("rudder", now) or 0.0
        low, high = self.reachable
        off = max(low - rudder, rudder - high)
        tolerance = radians(self.limits.rudder_deg)
        is_off = off > tolerance
        if self.lasts("order", is_off, now):
            return "the rudder does not follow its order"
        return ""

    def _is_fresh(self, time: float, now: float) -> bool:
        return now - time <= self.limits.silence_s

    def lasts(self, what: str, is_wrong: bool, now: float) -> bool:
        """Note when a fault begins; True if it has lasted too long."""
        if not is_wrong:
            self.since.pop(what, None)
            return False
        begin = self.since.setdefault(what, now)
        lasted_s = now - begin
        return lasted_s > self.limits.persistence_s


def _forget_oldest(sources: dict[NmeaSource, Instrument]) -> None:
    """Forget the source that was heard longest ago, but not the first."""
    _, *others = sources
    oldest = min(others, key=lambda source: sources[source].time)
    del sources[oldest]
