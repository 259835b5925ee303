"""The ship as a linear sampled loop: what the classical designs are computed on.

The state is (sway, yaw rate, heading error, rudder, integral of the heading error) as
deviations from straight running, SI units; the input is the commanded rudder, held over
each control interval. Sampling it so is exact for small motions: the zero-order hold,
the gear's lag and the environment's sum for the integral are in it. The rudder's limit
and rate are not.
"""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from shipgym import InputError, ShipModel
from shipgym.arrays import Floats
from shipgym.ships.linear import StraightRunning, linearise, nomoto_of, straight_running
from shipgym.tasks.steering import RATE_WEIGHT

Complexes = NDArray[np.complex128]

SIGNALS = ("sway", "yaw_rate", "heading_error", "rudder", "heading_error_integral")
SWAY, YAW_RATE, ERROR, RUDDER, INTEGRAL = range(5)
FREQUENCIES = 500  # of the frequency response; splines lie between them
SLOWEST = 1e-4  # its lowest frequency over the Nyquist frequency
FULL_RATE_ERROR = np.radians(
    7.0
)  # heading error that costs as much as the rudder moving at full rate


@dataclass(frozen=True)
class Margins:
    """How much the rudder's effect on the ship may change before the loop is unstable.

    The loop is opened where the ship's motions are fed back; the rudder's own feedback,
    if there is one, belongs to the steering gear and stays closed.
    """

    # factor by which the loop gain may be raised; infinite where there is no limit
    gain_margin: float
    phase_margin_deg: float  # phase that may be lost, degrees
    delay_margin_s: float  # delay that may be added, s
    bandwidth_rad_s: float  # of the heading following its set-point, to -3 dB, rad/s
    #: factor down to which the loop gain may be lowered; 0 where there is no limit. The
    #: integral, and a ship unstable on its course, need some
    lowest_gain: float = 0.0


@dataclass(frozen=True, eq=False)
class SampledShip:
    """Small motions about straight running, from one control interval to the next."""

    A: Floats  # shape (5, 5)
    # x[k + 1] = A x[k] + B order[k], x in the order of `SIGNALS`, shape (5, 1)
    B: Floats
    dt: float  # control interval, s
    about: StraightRunning  # the state about which motions are small


def rate_weight(model: ShipModel) -> float:
    """Weight of the rudder rate for linear designs, s^2, beside the squares of heading error and rudder.

    It is the environment's own, and as much again as makes the rudder's full rate cost
    like a heading error of `FULL_RATE_ERROR`. A linear design knows no largest rate;
    with a slow gear it would ask for far more and swing. The figure is measured: with
    it both designs cost at most 1.06 times the best gains of a direct search on stable
    and unstable ships whose gears need 0.3 to 6 ship lengths for 35 degrees.
    """
    return float(
        RATE_WEIGHT * model.travel_time**2
        + (FULL_RATE_ERROR / model.steering.rate) ** 2
    )


def sample_ship(
    model: ShipModel, dt: float, first_order: bool = False, speed: float | None = None
) -> SampledShip:
    """The linearised ship with its steering gear, sampled with the command held (zero-order hold).

    A gear without lag is taken to reach its order within the interval. Of a table with
    a memory of yaw the memory stands in the place of sway. `dt`: control interval, s;
    `first_order`: whether yaw is reduced to K / (1 + T s), without sway or memory;
    `speed`: surge speed at which the ship is linearised, m/s; by default that of
    straight running. Raises InputError if the model has no straight course.
    """
    about = straight_running(model, speed)
    steering, rudder = linearise(model, about)
    if first_order:
        form = nomoto_of(steering, rudder)
        steering = np.diag([-1.0 / model.travel_time, -1.0 / form.T])
        rudder = np.array([[0.0], [form.rudder_effect]])
    A, B = sampled_ships(
        np.column_stack([steering, rudder])[None], model.steering.time_constant, dt
    )
    return SampledShip(A[0], B[0][:, None], dt, about)


def sampled_ships(linear: Floats, lag: float, dt: float) -> tuple[Floats, Floats]:
    """Ships with their steering gear, the command held over a control interval (zero-order hold).

    `linear`: d/dt (v, r) per sway, yaw rate and rudder, SI units, shape (n, 2, 3);
    `lag`: of the steering gear, s; 0 for one that follows within the interval; `dt`:
    control interval, s. Returns `A`: shape (n, 5, 5); `B`: shape (n, 5).
    """
    from scipy.linalg import expm

    n = RUDDER + 1
    flow = np.zeros((len(linear), n + 1, n + 1))  # of state and command
    flow[:, :ERROR, :ERROR] = linear[:, :, :ERROR]
    flow[:, ERROR, YAW_RATE] = -1.0
    if lag > 0.0:
        flow[:, :ERROR, RUDDER] = linear[:, :, ERROR]
        flow[:, RUDDER, RUDDER], flow[:, RUDDER, n] = -1.0 / lag, 1.0 / lag
    else:
        flow[:, :ERROR, n] = linear[:, :, ERROR]
    held = expm(dt * flow)
    A, B = np.zeros((len(linear), n + 1, n + 1)), np.zeros((len(linear), n + 1))
    A[:, :n, :n], B[:, :n] = held[:, :n, :n], held[:, :n, n]
    if lag == 0.0:
        A[:, RUDDER], B[:, RUDDER] = 0.0, 1.0
    # the environment adds each new error to the integral
    A[:, INTEGRAL] = dt * A[:, ERROR]
    A[:, INTEGRAL, INTEGRAL], B[:, INTEGRAL] = 1.0, dt * B[:, ERROR]
    return A, B


@dataclass(frozen=True, eq=False)
class Compensator:
    """A linear controller with a memory: s[k + 1] = A s[k] + B y[k], order[k] = C s[k] + D y[k]."""

    A: Floats  # shape (n_memory, n_memory)
    B: Floats  # shape (n_memory, 5)
    C: Floats  # shape (1, n_memory)
    D: Floats  # y in the order of `SIGNALS`, deviations in SI units, shape (1, 5)

    @classmethod
    def static(cls, row: Floats) -> Self:
        """Feedback without a memory, of a row of shape (1, 5)."""
        return cls(np.zeros((0, 0)), np.zeros((0, len(SIGNALS))), np.zeros((1, 0)), row)

    def closed_loop(self, ship: SampledShip) -> Floats:
        """Matrix of ship and memory from one control interval to the next, without an integral not used."""
        whole = np.block(
            [[ship.A + ship.B @ self.D, ship.B @ self.C], [self.B, self.A]]
        )
        if np.any(self.D[:, INTEGRAL]) or np.any(self.B[:, INTEGRAL]):
            return whole
        kept = np.arange(len(whole)) != INTEGRAL
        return whole[np.ix_(kept, kept)]

    def margins(self, ship: SampledShip, name: str) -> Margins:
        """Stability margins and bandwidth with a ship.

        The margins follow from the frequency response of the sampled loop
        (`control.stability_margins`); `name`, of the design, is for the message. Raises
        InputError if the closed loop is unstable.
        """
        import control

        largest = float(np.abs(np.linalg.eigvals(self.closed_loop(ship))).max())
        if largest >= 1.0:
            raise InputError(
                f"{name}: the closed loop is unstable with these gains (largest sampled"
                f" pole {largest:.4f}, expected below 1); choose a shorter control"
                " interval dt, and a lower frequency (PID) or a larger rate_weight_s2"
                " (LQ) in from_model"
            )
        nyquist = np.pi / ship.dt
        omega = np.geomspace(SLOWEST * nyquist, 0.999 * nyquist, FREQUENCIES)
        opened, following = self._responses(ship, omega)
        found: Any = control.stability_margins(
            control.frd(opened, omega), returnall=True
        )
        gains, phases, _, _, crossings, _ = (
            np.asarray(values, dtype=float) for values in found
        )
        return Margins(
            gain_margin=float(min(gains[gains > 1.0], default=np.inf)),
            phase_margin_deg=float(min(np.abs(phases), default=np.inf)),
            delay_margin_s=float(
                min(np.radians(phases % 360.0) / crossings, default=np.inf)
            ),
            bandwidth_rad_s=_crossing(omega, np.abs(following)),
            lowest_gain=float(max(gains[gains < 1.0], default=0.0)),
        )

    def _responses(
        self, ship: SampledShip, omega: Floats
    ) -> tuple[Complexes, Complexes]:
        """Of the loop opened at the ship's motions, and of the heading to its set-point, each (n_omega,)."""
        z = np.exp(1j * omega * ship.dt)
        motions = _resolved(ship.A, ship.B, z)[:, :, 0].T
        orders = (self.C @ _resolved(self.A, self.B, z) + self.D)[:, 0].T
        of_rudder = orders[RUDDER] * motions[RUDDER]
        of_motions = (orders * motions).sum(axis=0) - of_rudder
        set_point = orders[ERROR] + orders[INTEGRAL] * ship.dt / (z - 1.0)
        following = -motions[ERROR] * set_point / (1.0 - of_rudder - of_motions)
        return -of_motions / (1.0 - of_rudder), following


def check_stable(matrix: Floats, where: str) -> None:
    """Refuse a sampled linear system that grows by itself, with an InputError that begins with `where`."""
    largest = float(np.abs(np.linalg.eigvals(matrix)).max())
    if not largest < 1.0:
        raise InputError(
            f"{where}: a sampled pole of size {largest:.4g} found, expected all below 1"
        )


def _crossing(omega: Floats, size: Floats) -> float:
    """Frequency at which a response first falls to -3 dB, between two samples; the last where it does not."""
    beyond = np.flatnonzero(size < np.sqrt(0.5))
    if len(beyond) == 0 or beyond[0] == 0:
        return float(omega[-1 if len(beyond) == 0 else 0])
    pair = slice(beyond[0] - 1, beyond[0] + 1)
    return float(np.exp(np.interp(-np.sqrt(0.5), -size[pair], np.log(omega[pair]))))


def _resolved(A: Floats, B: Floats, z: Complexes) -> Complexes:
    """(z I - A)^-1 B at all z, shape (n_z, ...) as B."""
    shifted = z[:, None, None] * np.eye(len(A)) - A
    found = np.linalg.solve(
        shifted, np.broadcast_to(B.astype(np.complex128), (len(z), *B.shape))
    )
    return found.astype(np.complex128)
