"""Naval vessel of 51.5 m, 4 degrees of freedom.

Surge, sway, yaw and roll; made for `scripts/certainty.py`.

Hull: Blanke & Christensen 1993, Rudder-roll damping autopilot robustness to
sway-yaw-roll couplings, 10th Ship Control Systems Symposium, Ottawa; from roll planar
motion tests of the Danish Maritime Institute, with the numbers of Perez & Blanke 2002,
Mathematical ship modeling for control applications, as the MSS toolbox has them
(`navalvessel`), but phi |uv| for the toolbox's phi |u phi| in yaw. There the forces of
rudder and propeller are inputs. Here two rudders of the published area, lift slope and
stall angle give the force, and two propellers a thrust that falls straight with the
advance ratio and balances the resistance at 8 m/s; their numbers other than the
diameter are ours. All in SI units.
"""

from math import degrees, fabs, pi
from typing import NamedTuple

from shipgym import Particulars, ShipEquations, SteeringGear
from shipgym.engine.motion import Motion, Ship

DENSITY, GRAVITY = 1014.0, 9.81
LENGTH, VOLUME, SPEED = 51.5, 357.0, 8.0  # m, m^3, m/s
MASS, GM = DENSITY * VOLUME, 1.1  # kg, m
X_G, Z_G = -3.38, -1.06  # m, from the origin of the tests, in the waterline; z down
I_XX, I_ZZ = 2.3763e6, 47.934e6  # kg m^2
RUDDERS, RUDDER_AREA, ASPECT_RATIO = 2.0, 1.5, 3.0  # -, m^2 each, -
LIFT_SLOPE, STALL, PARASITE_DRAG = (
    degrees(0.054),
    23.0 * pi / 180.0,
    0.006,
)  # 1/rad, rad, -
X_R, Z_R = (
    -20.41 + X_G,
    1.5,
)  # m; the published centre of gravity is 20.41 m forward of the rudder stock
PROPELLERS, DIAMETER, SERVICE_SHAFT_SPEED = 2.0, 1.6, 6.0  # -, m, 1/s
K_T_SLOPE = -0.45  # of the thrust coefficient by the advance ratio


class Coefficients(NamedTuple):
    """Of the hull, as published, in SI units; f is heel, an index "a" a modulus."""

    X_udot: float = -17400.0
    X_uau: float = -1960.0
    X_vr: float = 0.33 * MASS
    Y_vdot: float = -393000.0
    Y_pdot: float = -296000.0
    Y_rdot: float = -1400000.0
    Y_auv: float = -11800.0
    Y_ur: float = 131000.0
    Y_vav: float = -3700.0
    Y_var: float = -794000.0
    Y_rav: float = -182000.0
    Y_fauv: float = 10800.0
    Y_faur: float = 251000.0
    Y_fuu: float = -74.0
    K_vdot: float = 296000.0
    K_pdot: float = -774000.0
    K_auv: float = 9260.0
    K_ur: float = -102000.0
    K_vav: float = 29300.0
    K_var: float = 621000.0
    K_rav: float = 142000.0
    K_fauv: float = -8400.0
    K_faur: float = -196000.0
    K_fuu: float = -1180.0
    K_aup: float = -15500.0
    K_pap: float = -416000.0
    K_p: float = -500000.0
    K_fff: float = -0.325 * MASS * GRAVITY
    N_vdot: float = 538000.0
    N_rdot: float = -38.7e6
    N_auv: float = -92000.0
    N_aur: float = -4710000.0
    N_rar: float = -202000000.0
    N_rav: float = -15600000.0
    N_fauv: float = -214000.0
    N_fuar: float = -4980000.0
    N_fuau: float = -8000.0


PUBLISHED = Coefficients()
RESISTANCE = -PUBLISHED.X_uau * SPEED**2  # N, at service speed
THRUST = PROPELLERS * DENSITY * DIAMETER**4  # kg m, by the thrust coefficient and n^2
#: Thrust coefficient at rest, with which the thrust balances the resistance at service
#: speed.
K_T = RESISTANCE / (THRUST * SERVICE_SHAFT_SPEED**2) - K_T_SLOPE * SPEED / (
    SERVICE_SHAFT_SPEED * DIAMETER
)


def rudder_force(u: float, delta: float) -> tuple[float, float]:
    """Drag and lift of both rudders, N.

    Beyond the stall angle the lift grows no more.
    """
    pressure = 0.5 * DENSITY * RUDDERS * RUDDER_AREA * u * u
    lift = LIFT_SLOPE * min(max(delta, -STALL), STALL)
    return (
        pressure * (PARASITE_DRAG + lift * lift / (0.9 * pi * ASPECT_RATIO)),
        pressure * lift,
    )


def accelerations(
    motion: Motion, c: Coefficients, ship: Ship
) -> tuple[float, float, float, float, float]:
    """Accelerations in surge, sway, yaw and roll, body frame, origin midship."""
    u, v, r, p, f, n = motion.u, motion.v, motion.r, motion.p, motion.phi, motion.n
    au, av, ar = fabs(u), fabs(v), fabs(r)
    drag, lift = rudder_force(u, motion.delta)
    thrust = THRUST * (K_T * fabs(n) * n + (K_T_SLOPE / DIAMETER) * fabs(n) * u)

    X = (
        c.X_uau * u * au
        + c.X_vr * v * r
        + MASS * (v * r + X_G * r * r - Z_G * p * r)
        + thrust
        - drag
    )
    Y = (
        c.Y_auv * au * v
        + c.Y_ur * u * r
        + c.Y_vav * av * v
        + c.Y_var * ar * v
        + c.Y_rav * av * r
        + f * (c.Y_fauv * au * av + c.Y_faur * au * ar + c.Y_fuu * u * u)
        - MASS * u * r
        - lift
    )
    K = (
        c.K_auv * au * v
        + c.K_ur * u * r
        + c.K_vav * av * v
        + c.K_var * ar * v
        + c.K_rav * av * r
        + f * (c.K_fauv * au * av + c.K_faur * au * ar + c.K_fuu * u * u)
        + c.K_aup * au * p
        + c.K_pap * fabs(p) * p
        + c.K_p * p
        + c.K_fff * f * f * f
        - DENSITY * GRAVITY * GM * VOLUME * f
        + MASS * Z_G * u * r
        + Z_R * lift
    )
    N = (
        c.N_auv * au * v
        + c.N_aur * au * r
        + c.N_rar * ar * r
        + c.N_rav * av * r
        + f * (c.N_fauv * au * av + c.N_fuar * u * ar + c.N_fuau * u * au)
        - MASS * X_G * u * r
        - X_R * lift
    )

    # sway, roll and yaw: [[a, b, e], [d, k, 0], [g, 0, h]]
    a, b, e = MASS - c.Y_vdot, -(MASS * Z_G + c.Y_pdot), MASS * X_G - c.Y_rdot
    d, k = -(MASS * Z_G + c.K_vdot), I_XX - c.K_pdot
    g, h = MASS * X_G - c.N_vdot, I_ZZ - c.N_rdot
    vdot = (Y - b / k * K - e / h * N) / (a - b * d / k - e * g / h)
    return X / (MASS - c.X_udot), vdot, (N - g * vdot) / h, (K - d * vdot) / k, 0.0


TO_PRIME = 2.0 / (DENSITY * LENGTH**3)
SHIP = ShipEquations(
    "naval-vessel",
    "Blanke & Christensen 1993; Perez & Blanke 2002, Mathematical ship modeling for"
    " control applications",
    Coefficients,
    accelerations,
    Particulars(
        name="Naval vessel",
        length=LENGTH,
        beam=8.6,
        draught=2.3,
        mass=MASS,
        xg=X_G,
        yaw_gyradius=(I_ZZ / MASS - X_G**2) ** 0.5,
        block_coefficient=VOLUME / (LENGTH * 8.6 * 2.3),
        speed=SPEED,
        rudder_area=RUDDERS * RUDDER_AREA,
        rudders=RUDDERS,
        propeller_diameter=DIAMETER,
        propellers=PROPELLERS,
        metacentric_height=GM,
        water_density=DENSITY,
        X_udot=PUBLISHED.X_udot * TO_PRIME,
        Y_vdot=PUBLISHED.Y_vdot * TO_PRIME,
        Y_rdot=PUBLISHED.Y_rdot * TO_PRIME / LENGTH,
        N_vdot=PUBLISHED.N_vdot * TO_PRIME / LENGTH,
        N_rdot=PUBLISHED.N_rdot * TO_PRIME / LENGTH**2,
    ),
    SteeringGear(rudder_rate_deg_s=5.0, time_constant=0.5),
    service_shaft_speed=SERVICE_SHAFT_SPEED,
    rolls=True,
)
