"""A virtual towing tank: captive tests of any ship model, its motion prescribed and its forces measured.

Each test returns a Trial with the motion and the forces X, Y (N) and N (N m); a number
out of range is an InputError. The tests are those of the planar motion mechanism
(Gertler 1967, The DTMB planar-motion-mechanism system; ITTC 7.5-02-06-02).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shipgym.arrays import Floats, integral
from shipgym.checks import check_number
from shipgym.errors import InputError
from shipgym.ships.inertia import inertia, rigid_inertia
from shipgym.ships.ship_model import ShipModel
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
    """How a captive test is run and measured; InputError for a number out of range."""

    speed: float | None = None  # of the carriage, m/s; None: the ship's service speed
    rudder_deg: float = 0.0  # held, degrees
    shaft_speed: float | None = (
        None  # held, 1/s; None: that at service speed. For ships with a shaft
    )
    cycles: int = 3  # periods of an oscillation that are recorded
    samples: int = 200  # in each period, and at each angle of a static test
    # standard deviation of white noise on each force, in parts of its root mean square
    # over the test
    noise: float = 0.0
    seed: int = 0  # of the noise
    # whether the inertia of the ship herself (mass times acceleration, centripetal
    # terms included) stays in the forces, as the balance of a planar motion mechanism
    # feels it; else those of the water alone
    model_inertia: bool = True
    water_depth: float = np.inf  # m, for ships that know shallow water

    def __post_init__(self) -> None:
        if self.speed is not None:
            check_number(self.speed, "tank speed", above=0.0)
        if self.shaft_speed is not None:
            check_number(self.shaft_speed, "tank shaft_speed", above=0.0, hint="ahead")
        check_number(self.rudder_deg, "tank rudder_deg", at_least=-90.0, at_most=90.0)
        for name, least in (("cycles", 1), ("samples", 8), ("noise", 0.0), ("seed", 0)):
            check_number(getattr(self, name), f"tank {name}", at_least=least)

    def carriage_speed(self, model: ShipModel) -> float:
        """Speed of the carriage, m/s."""
        return float(model.particulars["speed"] if self.speed is None else self.speed)


def static_drift(
    model: ShipModel,
    drift_deg: Sequence[float],
    hold_s: float = 1.0,
    tank: Tank | None = None,
) -> Trial:
    """Tow a ship steadily at one drift angle after the other: forces X, Y (N) and N (N m).

    Drift angles at midship are in degrees, positive with the bow to starboard of the
    course: v = -U sin(drift). Each is recorded for `hold_s` seconds, in `tank.samples`
    rows. Raises InputError for no angle, or a number out of range.
    """
    tank = tank or Tank()
    angles = [
        check_number(angle, f"drift_deg[{i}]", at_least=-180.0, at_most=180.0)
        for i, angle in enumerate(drift_deg)
    ]
    if not angles:
        raise InputError("drift_deg: no angle found, expected at least one")
    check_number(hold_s, "hold_s", above=0.0)
    drift = np.repeat(np.radians(angles), tank.samples)
    t = hold_s / tank.samples * np.arange(len(drift), dtype=float)
    speed, none = tank.carriage_speed(model), np.zeros(len(t))
    velocity = np.stack([speed * np.cos(drift), -speed * np.sin(drift), none], axis=-1)
    return _tow(model, tank, t, velocity, np.zeros_like(velocity), "static drift")


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
        model, tank, period_s, (speed, 0.0, 0.0), (amplitude, 0.0, 0.0), "pure surge"
    )


def pure_sway(
    model: ShipModel,
    amplitude: float,
    period_s: float | None = None,
    tank: Tank | None = None,
) -> Trial:
    """Oscillate a ship in sway, her heading along the tank; amplitude in m/s, otherwise as `pure_surge`."""
    tank = tank or Tank()
    check_number(amplitude, "amplitude", above=0.0)
    speed = tank.carriage_speed(model)
    return _oscillate(
        model, tank, period_s, (speed, 0.0, 0.0), (0.0, amplitude, 0.0), "pure sway"
    )


def pure_yaw(
    model: ShipModel,
    amplitude_deg_s: float,
    period_s: float | None = None,
    tank: Tank | None = None,
) -> Trial:
    """Oscillate a ship in yaw, always along her path, without sway; otherwise as `pure_surge`."""
    return yaw_with_drift(model, amplitude_deg_s, 0.0, period_s, tank)


def yaw_with_drift(
    model: ShipModel,
    amplitude_deg_s: float,
    drift_deg: float,
    period_s: float | None = None,
    tank: Tank | None = None,
) -> Trial:
    """Oscillate a ship in yaw at a drift angle at midship, v = -U sin(drift); otherwise as `pure_surge`."""
    tank = tank or Tank()
    rate = float(
        np.radians(check_number(amplitude_deg_s, "amplitude_deg_s", above=0.0))
    )
    drift = float(
        np.radians(check_number(drift_deg, "drift_deg", at_least=-90.0, at_most=90.0))
    )
    speed = tank.carriage_speed(model)
    mean = (speed * np.cos(drift), -speed * np.sin(drift), 0.0)
    name = "pure yaw" if drift == 0.0 else "yaw with drift"
    return _oscillate(model, tank, period_s, mean, (0.0, 0.0, rate), name)


def _oscillate(
    model: ShipModel,
    tank: Tank,
    period_s: float | None,
    mean: tuple[float, float, float],
    amplitude: tuple[float, float, float],
    name: str,
) -> Trial:
    """Velocities (u, v, r) that swing about their mean as a cosine."""
    usual = 10.0 * model.particulars["length"] / tank.carriage_speed(model)
    period = check_number(
        usual if period_s is None else period_s, "period_s", above=0.0
    )
    t = period / tank.samples * np.arange(tank.cycles * tank.samples + 1, dtype=float)
    frequency = 2.0 * np.pi / period
    velocity = np.array(mean) + np.outer(np.cos(frequency * t), amplitude)
    acceleration = -frequency * np.outer(np.sin(frequency * t), amplitude)
    return _tow(model, tank, t, velocity, acceleration, name)


def _tow(
    model: ShipModel,
    tank: Tank,
    t: Floats,
    velocity: Floats,
    acceleration: Floats,
    name: str,
) -> Trial:
    """The measured motion and forces: inertia times (the ship's own acceleration - the prescribed one).

    Time, and prescribed velocities and accelerations (u, v, r) of shape (n_samples, 3).
    """
    most = model.steering.rudder_limit_deg
    check_number(
        tank.rudder_deg,
        "tank rudder_deg",
        at_least=-most,
        at_most=most,
        hint="the rudder's limit",
    )
    if tank.shaft_speed is not None and "n" not in model.command_names:
        raise InputError(
            f"tank shaft_speed: {tank.shaft_speed:g} found, but {model.name!r} has no"
            " shaft; leave it"
        )
    shaft = model.service_shaft_speed if tank.shaft_speed is None else tank.shaft_speed
    psi = integral(t, velocity[:, 2])
    columns = {"psi": psi, **dict(zip("uvr", velocity.T, strict=True))}
    columns |= {
        "delta": np.full(len(t), np.radians(tank.rudder_deg)),
        "n": np.full(len(t), shaft),
    }
    rates = model.rates(columns, tank.water_depth)
    own = np.stack([rates.get(axis, np.zeros(len(t))) for axis in "uvrp"], axis=-1)
    own[:, :3] -= acceleration
    forces = own @ inertia(model, tank.water_depth).T
    if not tank.model_inertia:
        forces += rigid_body_forces(rigid_inertia(model), velocity.T, acceleration.T).T
    noise = tank.noise * np.sqrt((forces**2).mean(axis=0))
    forces += noise * np.random.default_rng(tank.seed).standard_normal(forces.shape)
    north, east = rotate_to_body(columns["u"], columns["v"], -psi)
    if "n" not in model.command_names:
        del columns["n"]
    channels = {"x": integral(t, north), "y": integral(t, east), **columns}
    channels |= zip("XYN", forces.T, strict=True)
    title = f"{model.name}, {name}"
    return Trial(
        t, channels, name=title, kind="captive", length=model.particulars["length"]
    )


def rigid_body_forces(
    rigid: Sequence[float],
    velocity: Sequence[Floats] | Floats,
    acceleration: Sequence[Floats] | Floats,
) -> Floats:
    """Forces X, Y and moment N that accelerate a ship without water, about midship (Fossen 2011, 3.3).

    All in SI units, or all in the prime system: `rigid` is mass, its static moment and
    the yaw inertia; forces, and velocity and acceleration in surge, sway and yaw, have
    the shape (3, n_samples).
    """
    m, static, yaw = rigid
    (u, v, r), (udot, vdot, rdot) = velocity, acceleration
    ahead, aside = udot - v * r, vdot + u * r
    return np.array(
        [
            m * ahead - static * r * r,
            m * aside + static * rdot,
            yaw * rdot + static * aside,
        ]
    )
