"""Bumpless transfer from the helmsman to an autopilot."""

from math import exp, radians


class Transfer:
    """Bumpless transfer: from the rudder of the helmsman to that of the law.

    The order begins at the rudder as it is. The difference to what the law would order
    then fades as two equal lags in series do, without a jump of its rate, and the order
    moves no faster than the slowest gear of SOLAS II-1/29.

    Source: Astrom & Hagglund 2006, Advanced PID Control, section 13.5.

    Parameters
    ----------
    rudder : float
        Where it is, rad.
    lag : float
        s.
    """

    fastest = radians(2.3)  # rad/s
    lags = 8.0  # in which it ends

    def __init__(self, rudder: float, lag: float) -> None:
        self.last = rudder
        self.lag = lag
        self.elapsed = 0.0  # s
        self.off: float | None = None  # rad, of the rudder from the law's first order

    @property
    def has_ended(self) -> bool:
        """True when the order is that of the law."""
        return self.elapsed > self.lags * self.lag

    def order(self, of_law: float, dt: float) -> float:
        """Order in this interval, rad; `dt`: its length, s."""
        if self.off is None:
            self.off = self.last - of_law
        lags = self.elapsed / self.lag
        wanted = of_law + self.off * (1.0 + lags) * exp(-lags)

        reach = self.fastest * dt
        moved = min(max(wanted - self.last, -reach), reach)
        self.last += moved
        self.elapsed += dt
        return self.last
