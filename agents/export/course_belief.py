"""Course over ground against heading: a current is believed, a jump of it is not."""

from cmath import rect
from math import exp, radians

from agents.export.residuals import Lasting
from agents.export.ship_response import ShipResponse


class CourseCheck:
    """Current that heading, log and course over ground make, and its changes.

    The velocity over ground less that through the water is the current. It has to stay
    within `largest` and may change slowly; in speed made good at the ship's own speed
    this is an angle, `allowed`, between heading and course.
    """

    slowest = 2.0  # m/s, below which a course says nothing
    largest = 2.5  # m/s, of a current: 5 knots
    memory_s = 600.0  # in which a current may change
    #: Drift angle of a turning ship, in the angle that she turns in a ship length.
    drift = 0.45
    uncertain_drift = 0.5
    #: Times, in those to travel a ship length: in which drift follows the rate of turn,
    #: and in which a turn is forgotten.
    smoothing = 0.4
    forgetting = 2.0

    def __init__(
        self, ship: ShipResponse, allowed_deg: float, persistence_s: float
    ) -> None:
        self.ship = ship
        self.allowed = radians(allowed_deg)
        self.current: complex | None = None
        self.rate = 0.0  # smoothed, without that of waves, rad/s
        self.fastest = 0.0  # rate of the turn that is not yet forgotten, rad/s
        self.jumps = Lasting(persistence_s)
        self.strays = Lasting(persistence_s)

    def observe(
        self,
        heading: float,
        rate: float,
        over_ground: complex,
        speed: float,
        now: float,
        step: float,
    ) -> bool:
        """Return True if course and heading disagree for too long.

        Parameters
        ----------
        heading, rate : float
            rad and rad/s.
        over_ground : complex
            Velocity, north and east, m/s.
        speed : float
            Through the water, m/s.
        now, step : float
            Time, and that since the last call, s.
        """
        if min(speed, abs(over_ground)) < self.slowest:
            return False

        lengths = step * self.ship.turning
        self.rate += (rate - self.rate) * (1.0 - exp(-lengths / self.smoothing))
        kept = self.fastest * exp(-lengths / self.forgetting)
        self.fastest = max(kept, abs(self.rate))
        drift_angle = self.drift * self.rate / self.ship.turning
        current = over_ground - rect(speed, heading - drift_angle)
        if self.current is None:
            self.current = current
        change = current - self.current
        self.current += change * (1.0 - exp(-step / self.memory_s))

        allowed = self.allowed * speed
        # in a turn the course is behind by what a receiver smooths, and the drift angle
        # is only about known
        behind_s = 3.0 + self.uncertain_drift / self.ship.turning
        allowed += behind_s * self.fastest * speed
        jumps = abs(change) > allowed
        strays = abs(current) > self.largest + allowed
        jumped = self.jumps.observe(jumps, now)
        strayed = self.strays.observe(strays, now)
        return jumped or strayed
