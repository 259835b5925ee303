"""A virtual towing tank: captive tests of any ship model.

The motion is prescribed and the forces are measured: each test returns a Trial with
the motion and the forces X, Y (N) and N (N m); a number out of range is an InputError.
The tests are those of the planar motion mechanism (Gertler 1967, The DTMB
planar-motion-mechanism system; ITTC 7.5-02-06-02).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shipgym.arrays import Floats, integral
from shipgym.checks import check_number
from shipgym.errors import InputError
from shipgym.models.by_name import takes_name
from shipgym.models.ship_model import ShipModel
from shipgym.ships.inertia import inertia, rigid_inertia
from shipgym.trials.navigation import rotate_to_body
from shipgym.trials.trial import Trial

__all__ = [
    "Tank",
    "inertia",
    "pure_surge",
    "pure_sway",
    "pure_yaw",
    "rigid_inertia",
    "static_drift",
    "yaw_with_drift",
]


@dataclass(frozen=True)
class Tank:
    """Settings of a captive test; InputError for a number out of range."""

    speed: float | None = None  # of the carriage, m/s; None: the ship's service speed
    rudder_deg: float = 0.0  # held, degrees
    #: held, 1/s, for ships with a shaft; None: that at service speed
    shaft_speed: float | None = None
    cycles: int = 3  # periods of an oscillation that are recorded
    samples: int = 200  # in each period, and at each angle of a static test
    #: standard deviation of white noise on each force, in parts of its root mean square
    #: over the test
    noise: float = 0.0
    seed: int = 0  # of the noise
    #: whether the inertia of the ship herself (mass times acceleration, centripetal
    #: terms included) stays in the forces, as the balance of a planar motion mechanism
    #: feels it; else those of the water alone
    model_inertia: bool = True
    water_depth: float = np.inf  # m, for ships that know shallow water

    def __post_init__(self) -> None:
        if self.speed is not None:
            check_number(self.speed, "tank speed", above=0.0)
        if self.shaft_speed is not None:
            check_number(self.shaft_speed, "tank shaft_speed", above=0.0, hint="ahead")
        check_number(self.rudder_deg, "tank rudder_deg", at_least=-90.0, at_most=90.0)
        check_number(self.cycles, "tank cycles", at_least=1)
        check_number(self.samples, "tank samples", at_least=8)
        check_number(self.noise, "tank noise", at_least=0.0)
        check_number(self.seed, "tank seed", at_least=0)

    def carriage_speed(self, model: ShipModel) -> float:
        """Speed of the carriage, m/s."""
        if self.speed is None:
            return float(model.particulars["speed"])
        return float(self.speed)

    def held_commands(self, model: ShipModel) -> tuple[float, float]:
        """Rudder, rad, and shaft speed, 1/s; InputError for what the ship has not."""
        limit = model.steering.rudder_limit_deg
        check_number(
            self.rudder_deg,
            "tank rudder_deg",
            at_least=-limit,
            at_most=limit,
            hint="the rudder's limit",
        )
        rudder = float(np.radians(self.rudder_deg))
        if self.shaft_speed is None:
            return rudder, model.service_shaft_speed
        if "n" not in model.command_names:
            raise InputError(
                f"tank shaft_speed: expected none, as {model.name!r} has no shaft, got"
                f" {self.shaft_speed:g}; leave it out"
            )
        return rudder, self.shaft_speed


@takes_name
def static_drift(
    model: ShipModel,
    drift_deg: Sequence[float],
    hold_s: float = 1.0,
    tank: Tank | None = None,
) -> Trial:
    """Tow a ship steadily at one drift angle after the other.

    Drift angles at midship are in degrees, positive with the bow to starboard of the
    course: v = -U sin(drift). Each is recorded for `hold_s` seconds, in `tank.samples`
    rows. Raises InputError for no angle, or a number out of range.
    """
    tank = tank or Tank()
    for i, angle in enumerate(drift_deg):
        check_number(angle, f"drift_deg[{i}]", at_least=-180.0, at_most=180.0)
    if not len(drift_deg):
        raise InputError("drift_deg: expected at least one angle, got none")
    check_number(hold_s, "hold_s", above=0.0)

    drift = np.repeat(np.radians(drift_deg), tank.samples)
    speed = tank.carriage_speed(model)
    velocity = np.zeros((len(drift), 3))
    velocity[:, 0] = speed * np.cos(drift)
    velocity[:, 1] = -speed * np.sin(drift)
    step = hold_s / tank.samples
    return _tow(
        model,
        tank,
        t=step * np.arange(len(drift), dtype=float),
        velocity=velocity,
        acceleration=np.zeros_like(velocity),
        name="static drift",
    )


@takes_name
def pure_surge(
    model: ShipModel,
    amplitude: float,
    period_s: float | None = None,
    tank: Tank | None = None,
) -> Trial:
    """Oscillate a ship in surge about the speed of the carriage.

    The amplitude of the surge speed, m/s, is less than the speed of the carriage; the
    period, s, is by default 10 times the time to travel one ship length.
    """
    tank = tank or Tank()
    speed = tank.carriage_speed(model)
    check_number(
        amplitude,
        "amplitude",
        above=0.0,
        below=speed,
        hint="less than the carriage's speed",
    )
    return _oscillate(
        model,
        tank,
        period_s,
        mean=(speed, 0.0, 0.0),
        amplitude=(amplitude, 0.0, 0.0),
        name="pure surge",
    )


@takes_name
def pure_sway(
    model: ShipModel,
    amplitude: float,
    period_s: float | None = None,
    tank: Tank | None = None,
) -> Trial:
    """Oscillate a ship in sway, her heading along the tank.

    The amplitude is that of the sway speed, m/s; otherwise as `pure_surge`.
    """
    tank = tank or Tank()
    check_number(amplitude, "amplitude", above=0.0)
    speed = tank.carriage_speed(model)
    return _oscillate(
        model,
        tank,
        period_s,
        mean=(speed, 0.0, 0.0),
        amplitude=(0.0, amplitude, 0.0),
        name="pure sway",
    )


@takes_name
def pure_yaw(
    model: ShipModel,
    amplitude_deg_s: float,
    period_s: float | None = None,
    tank: Tank | None = None,
) -> Trial:
    """Oscillate a ship in yaw, always along her path, without sway.

    Otherwise as `pure_surge`.
    """
    return yaw_with_drift(model, amplitude_deg_s, 0.0, period_s, tank)


@takes_name
def yaw_with_drift(
    model: ShipModel,
    amplitude_deg_s: float,
    drift_deg: float,
    period_s: float | None = None,
    tank: Tank | None = None,
) -> Trial:
    """Oscillate a ship in yaw at a drift angle at midship, v = -U sin(drift).

    Otherwise as `pure_surge`.
    """
    tank = tank or Tank()
    check_number(amplitude_deg_s, "amplitude_deg_s", above=0.0)
    check_number(drift_deg, "drift_deg", at_least=-90.0, at_most=90.0)
    rate = float(np.radians(amplitude_deg_s))
    drift = float(np.radians(drift_deg))

    speed = tank.carriage_speed(model)
    u = speed * np.cos(drift)
    v = -speed * np.sin(drift)
    return _oscillate(
        model,
        tank,
        period_s,
        mean=(u, v, 0.0),
        amplitude=(0.0, 0.0, rate),
        name="pure yaw" if drift == 0.0 else "yaw with drift",
    )


def _oscillate(
    model: ShipModel,
    tank: Tank,
    period_s: float | None,
    mean: tuple[float, float, float],
    amplitude: tuple[float, float, float],
    name: str,
) -> Trial:
    """Velocities (u, v, r) that swing about their mean as a cosine."""
    if period_s is None:
        period_s = 10.0 * model.particulars["length"] / tank.carriage_speed(model)
    period = check_number(period_s, "period_s", above=0.0)
    n_steps = tank.cycles * tank.samples
    t = period / tank.samples * np.arange(n_steps + 1, dtype=float)

    frequency = 2.0 * np.pi / period
    cosine = np.cos(frequency * t)
    sine = np.sin(frequency * t)
    return _tow(
        model,
        tank,
        t=t,
        velocity=np.array(mean) + np.outer(cosine, amplitude),
        acceleration=-frequency * np.outer(sine, amplitude),
        name=name,
    )


def _tow(
    model: ShipModel,
    tank: Tank,
    t: Floats,
    velocity: Floats,
    acceleration: Floats,
    name: str,
) -> Trial:
    """Tow a ship along a prescribed motion: the trial with motion and measured forces.

    Time, and prescribed velocities and accelerations (u, v, r) of shape (n_samples, 3).
    """
    rudder, shaft = tank.held_commands(model)
    u, v, r = velocity.T
    psi = integral(t, r)
    columns = {
        "psi": psi,
        "u": u,
        "v": v,
        "r": r,
        "delta": np.full(len(t), rudder),
        "n": np.full(len(t), shaft),
    }
    forces = _forces_on_ship(model, tank, columns, acceleration)
    if not tank.model_inertia:
        rigid = rigid_inertia(model)
        forces += rigid_body_forces(rigid, velocity.T, acceleration.T).T

    north, east = rotate_to_body(u, v, -psi)
    if "n" not in model.command_names:
        del columns["n"]
    channels = {
        "x": integral(t, north),
        "y": integral(t, east),
        **columns,
    }
    channels |= zip("XYN", _measured(forces, tank).T, strict=True)
    return Trial(
        t,
        channels,
        name=f"{model.name}, {name}",
        kind="captive",
        length=model.particulars["length"],
    )


def _forces_on_ship(
    model: ShipModel, tank: Tank, columns: dict[str, Floats], acceleration: Floats
) -> Floats:
    """Forces X, Y and N on a balance, shape (n_samples, 3).

    These are the inertia times what the free ship would accelerate beyond what is
    prescribed.
    """
    rates = model.rates(columns, tank.water_depth)
    beyond = np.zeros((len(acceleration), 4))
    for column, axis in enumerate("uvrp"):
        if axis in rates:
            beyond[:, column] = rates[axis]
    beyond[:, :3] -= acceleration
    mass = inertia(model, tank.water_depth)
    return np.asarray(beyond @ mass.T)


def _measured(forces: Floats, tank: Tank) -> Floats:
    """Forces with the noise of the balance."""
    rng = np.random.default_rng(tank.seed)
    root_mean_square = np.sqrt((forces**2).mean(axis=0))
    noise = tank.noise * root_mean_square
    return np.asarray(forces + noise * rng.standard_normal(forces.shape))


def rigid_body_forces(
    rigid: Sequence[float],
    velocity: Sequence[Floats] | Floats,
    acceleration: Sequence[Floats] | Floats,
) -> Floats:
    """Forces X, Y and moment N that accelerate a ship without water, about midship.

    Fossen 2011, 3.3. All in SI units or all in the prime system: `rigid` is mass, its
    static moment and the yaw inertia; forces, and velocity and acceleration in surge,
    sway and yaw, have the shape (3, n_samples).
    """
    m, static, yaw = rigid
    u, v, r = velocity
    udot, vdot, rdot = acceleration
    ahead = udot - v * r
    aside = vdot + u * r
    return np.array(
        [
            m * ahead - static * r * r,
            m * aside + static * rdot,
            yaw * rdot + static * aside,
        ]
    )
