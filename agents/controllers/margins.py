"""How robust a loop is: a linear controller around a sampled ship, its margins and its bandwidth."""

from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from agents.controllers.linear_loop import ERROR, INTEGRAL, RUDDER, SIGNALS, SampledShip
from shipgym import InputError
from shipgym.arrays import Floats

Complexes = NDArray[np.complex128]

FREQUENCIES = 500  # of the frequency response; splines lie between them
SLOWEST, FASTEST = 1e-4, 0.999  # of them, over the Nyquist frequency


@dataclass(frozen=True)
class Margins:
    """How much the rudder's effect on the ship may change before the loop is unstable.

    The loop is broken where the ship's motions are fed back; the rudder's own feedback,
    if there is one, belongs to the steering gear and stays closed.

    Attributes
    ----------
    gain_margin : float
        Factor by which the loop gain may be raised; infinite where there is no limit.
    phase_margin_deg : float
        Phase that may be lost, degrees.
    delay_margin_s : float
        Delay that may be added, s.
    bandwidth_rad_s : float
        Of the heading following its set-point, to -3 dB, rad/s.
    lowest_gain : float
        Factor down to which the loop gain may be lowered; 0 where there is no limit.
        The integral, and a ship unstable on its course, need some.
    """

    gain_margin: float
    phase_margin_deg: float
    delay_margin_s: float
    bandwidth_rad_s: float
    lowest_gain: float = 0.0


class Responses(NamedTuple):
    """Frequency responses of a loop, each of shape (n_frequencies,)."""

    broken: Complexes  # of the loop broken at the ship's motions
    following: Complexes  # from set-point to heading


@dataclass(frozen=True, eq=False)
class Compensator:
    """Linear controller with a memory: s[k + 1] = A s[k] + B y[k], order[k] = C s[k] + D y[k].

    Attributes
    ----------
    A : array of shape (n_memory, n_memory)
    B : array of shape (n_memory, 5)
    C : array of shape (1, n_memory)
    D : array of shape (1, 5)
        y in the order of `SIGNALS`, deviations in SI units.
    """

    A: Floats
    B: Floats
    C: Floats
    D: Floats

    @classmethod
    def static(cls, gains: Floats) -> Self:
        """Feedback without a memory, by gains of shape (5,)."""
        nothing = np.zeros((0, 0))
        return cls(nothing, np.zeros((0, len(SIGNALS))), np.zeros((1, 0)), gains[None])

    def closed_loop(self, ship: SampledShip) -> Floats:
        """Matrix of ship and memory from one control interval to the next, without an integral not used."""
        motions = [ship.A + ship.B @ self.D, ship.B @ self.C]
        whole = np.block([motions, [self.B, self.A]])

        feeds_integral_back = np.any(self.D[:, INTEGRAL]) or np.any(self.B[:, INTEGRAL])
        if feeds_integral_back:
            return whole
        kept = np.arange(len(whole)) != INTEGRAL
        return whole[np.ix_(kept, kept)]

    def margins(self, ship: SampledShip, name: str) -> Margins:
        """Stability margins and bandwidth with a ship.

        The margins follow from the frequency response of the sampled loop
        (`control.stability_margins`). `name` is that of the design. Raises InputError
        if the closed loop is unstable.
        """
        import control

        pole = largest_pole(self.closed_loop(ship))
        if pole >= 1.0:
            raise InputError(
                f"{name}: expected sampled poles below 1, got {pole:.4f}: the closed"
                " loop is unstable with these gains; choose a shorter control interval"
                " dt, and a lower frequency (PID) or a larger rate_weight_s2 (LQ) in"
                " from_model"
            )

        nyquist = np.pi / ship.dt
        omega = np.geomspace(SLOWEST * nyquist, FASTEST * nyquist, FREQUENCIES)
        response = self.responses(ship, omega)
        loop: Any = control.frd(response.broken, omega)
        found = control.stability_margins(loop, returnall=True)
        gains, phases, _, _, crossings, _ = (np.asarray(one, float) for one in found)

        delays = np.radians(phases % 360.0) / crossings
        return Margins(
            gain_margin=float(min(gains[gains > 1.0], default=np.inf)),
            phase_margin_deg=float(min(np.abs(phases), default=np.inf)),
            delay_margin_s=float(min(delays, default=np.inf)),
            bandwidth_rad_s=bandwidth(omega, np.abs(response.following)),
            lowest_gain=float(max(gains[gains < 1.0], default=0.0)),
        )

    def responses(self, ship: SampledShip, omega: Floats) -> Responses:
        """Frequency responses at frequencies in rad/s, shape (n_frequencies,)."""
        z = np.exp(1j * omega * ship.dt)
        motions = _transfer(ship.A, ship.B, z)[:, :, 0].T
        orders = (self.C @ _transfer(self.A, self.B, z) + self.D)[:, 0].T

        by_rudder = orders[RUDDER] * motions[RUDDER]
        by_motions = (orders * motions).sum(axis=0) - by_rudder
        set_point = orders[ERROR] + orders[INTEGRAL] * ship.dt / (z - 1.0)
        return Responses(
            broken=-by_motions / (1.0 - by_rudder),
            following=-motions[ERROR] * set_point / (1.0 - by_rudder - by_motions),
        )


def largest_pole(matrix: Floats) -> float:
    """Largest size of the eigenvalues of a sampled linear system; below 1 it is stable."""
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def check_stable(matrix: Floats, where: str) -> None:
    """Refuse a sampled linear system that grows by itself, with an InputError that begins with `where`."""
    pole = largest_pole(matrix)
    if not pole < 1.0:
        raise InputError(f"{where}: expected sampled poles below 1, got {pole:.4g}")


def bandwidth(omega: Floats, size: Floats) -> float:
    """Frequency at which a response first falls to -3 dB; the last one where it does not.

    `omega`: rad/s, rising; `size`: of the response there, both of shape (n,). Between
    two frequencies it is straight over their logarithm.
    """
    half_power = np.sqrt(0.5)
    below = np.flatnonzero(size < half_power)
    if len(below) == 0:
        return float(omega[-1])
    first = below[0]
    if first == 0:
        return float(omega[0])

    low, high = size[first], size[first - 1]
    share = (high - half_power) / (high - low)
    logarithm = np.log(omega[first - 1]) + share * np.log(
        omega[first] / omega[first - 1]
    )
    return float(np.exp(logarithm))


def _transfer(A: Floats, B: Floats, z: Complexes) -> Complexes:
    """(z I - A)^-1 B at all z, shape (n_z, ...) as B."""
    shifted = z[:, None, None] * np.eye(len(A)) - A
    inputs = np.broadcast_to(B.astype(np.complex128), (len(z), *B.shape))
    return np.linalg.solve(shifted, inputs).astype(np.complex128)
