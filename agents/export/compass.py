"""Magnetic bearings made true by the variation that is heard or declared."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from agents.export.nmea import NmeaReading


@dataclass
class Compass:
    """The variation, and the magnetic bearings that lack one.

    Attributes
    ----------
    declared : float or None
        Variation that counts whatever is heard, rad, positive to the east.
    heard : float or None
        Variation of the newest RMC or HDG that had one; it has no age, because it
        changes by a degree in many miles.
    lacking : dict
        When a magnetic bearing was heard that could not be made true, s, by the name of
        the true one.
    """

    declared: float | None = None
    heard: float | None = None
    lacking: dict[str, float] = field(default_factory=dict)

    def true(self, readings: Sequence[NmeaReading], now: float) -> list[NmeaReading]:
        """Readings of one sentence with its magnetic bearings made true."""
        true_names = {
            "compass_heading": "heading",
            "magnetic_leg": "leg",
            "magnetic_to_steer": "to_steer",
            "magnetic_commanded": "commanded",
            "magnetic_course": "course",
            "magnetic_waypoint_bearing": "waypoint_bearing",
        }
        values = {reading.quantity: reading.value for reading in readings}
        if "variation" in values:
            self.heard = values["variation"]
        variation = self.heard if self.declared is None else self.declared

        found = []
        for reading in readings:
            true = true_names.get(reading.quantity)
            if true is None:
                found.append(reading)
            elif variation is None:
                self.lacking[true] = now
            elif true not in values:
                bearing = reading.value + variation
                if reading.quantity == "compass_heading":
                    bearing += values.get("deviation", 0.0)
                found.append(reading._replace(quantity=true, value=bearing))
        return found

    def lacks(self, quantity: str, now: float, silence_s: float) -> bool:
        """True if only a magnetic bearing was heard of it, and no variation."""
        time = self.lacking.get(quantity)
        return time is not None and now - time <= silence_s
