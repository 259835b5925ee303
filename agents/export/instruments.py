"""One instrument of a quantity: its newest reading, and two that send as one."""

from dataclasses import dataclass
from math import inf

from shipgym.tasks.guidance import wrapped


def difference(quantity: str, value: float, other: float) -> float:
    """How far two values are apart, angles the shorter way round."""
    angles = ("heading", "course", "leg", "to_steer", "rudder", "waypoint_bearing")
    apart = value - other
    if quantity in angles:
        apart = float(wrapped(apart))
    return abs(apart)


@dataclass
class Instrument:
    """Newest reading of an instrument.

    Two instruments may send as one, with the same talker, sentence and address. Then
    readings jump to and fro between two values, faster than a ship moves. The value
    kept is that of the first, unless the other one stays for some time.

    Attributes
    ----------
    quantity : str
    value, time : float
        Newest reading, s.
    count : int
        How often it was heard.
    elsewhere : tuple of float or None
        Newest reading that was too far from the value, and its time.
    returns : int
        How often it came back from there.
    """

    quantity: str
    value: float
    time: float
    count: int = 1
    elsewhere: tuple[float, float] | None = None
    is_away: bool = False
    returns: int = 0

    def take(self, value: float, now: float, believable: float = inf) -> None:
        """Take a reading that may differ by so much from the last one."""
        hold_s, forget_s = 1.0, 6.0
        self.count += 1
        if self.elsewhere is not None and now - self.elsewhere[1] > forget_s:
            self.elsewhere = None
            self.returns = 0

        if difference(self.quantity, value, self.value) <= believable:
            self.returns += self.is_away
            self.is_away = False
            self.value, self.time = value, now
        elif now - self.time > hold_s:
            self.elsewhere = (self.value, self.time)
            self.value, self.time = value, now
        else:
            self.elsewhere = (value, now)
            self.is_away = True

    @property
    def is_two(self) -> bool:
        """True if two instruments send as one."""
        certain = 3
        return self.returns >= certain
