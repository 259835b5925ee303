"""Parts of the tests of a heading: sums that forget, persistence, and false alarms."""

from dataclasses import dataclass
from math import exp, inf, nan

#: Threshold of a residual, in its standard deviations in the roughest sea.
DEVIATIONS = 6.0


def false_alarms(deviations: float, period: float) -> float:
    """Rate at which a Gaussian residual leaves its thresholds by chance, 1/s.

    Rice's formula for both sides: 2 / period exp(-deviations^2 / 2). Six deviations are
    left every eight years at a period of 8 s.

    Source: Rice 1945, Mathematical analysis of random noise, Bell System Technical
    Journal 24, section 3.3.

    Parameters
    ----------
    deviations : float
        Threshold, in standard deviations.
    period : float
        Mean period between upcrossings of zero, s.
    """
    return 2.0 / period * exp(-0.5 * deviations**2)


@dataclass
class LeakySum:
    """Sum that forgets exponentially.

    Attributes
    ----------
    memory : float
        Time constant, s.
    """

    memory: float
    value: float = 0.0

    def add(self, amount: float, step: float) -> float:
        """Forget for a time, s, then add an amount; the sum."""
        self.value = self.value * exp(-step / self.memory) + amount
        return self.value


@dataclass
class Lasting:
    """Persistence of a fault: true when it has lasted longer than allowed."""

    allowed_s: float
    since: float = inf

    def observe(self, is_wrong: bool, now: float) -> bool:
        """Note whether there is a fault at a time, s."""
        if not is_wrong:
            self.since = inf
            return False
        self.since = min(self.since, now)
        return now - self.since > self.allowed_s


@dataclass
class Stillness:
    """Movement of a reference while a reading keeps its last digit.

    Attributes
    ----------
    longest_s : float
        Time after which it is counted from zero, for a reference that drifts.
    resolution : float
        Smallest change of the reading so far.
    """

    longest_s: float
    resolution: float = inf
    reading: float = nan
    begin: float = 0.0
    low: float = 0.0
    high: float = 0.0

    def observe(self, reading: float, reference: float, now: float) -> float:
        """Range of the reference since the reading changed last."""
        moved = abs(reading - self.reading)
        if moved > 0.0:
            self.resolution = min(self.resolution, moved)
        if moved != 0.0 or now - self.begin > self.longest_s:
            self.reading = reading
            self.begin = now
            self.low = reference
            self.high = reference
        self.low = min(self.low, reference)
        self.high = max(self.high, reference)
        return self.high - self.low
