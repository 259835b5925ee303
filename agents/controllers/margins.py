"""Margins and bandwidth of the loop of a linear controller around a sampled ship."""

from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from agents.controllers.linear_loop import ERROR, INTEGRAL, RUDDER, SIGNALS, SampledShip
from shipgym import InputError
from shipgym.arrays import Floats, Integers

Complexes = NDArray[np.complex128]

SLOWEST, FASTEST = 1e-4, 0.999  # of them, over the Nyquist frequency


@dataclass(frozen=True)
class Margins:
    """Largest changes of the rudder's effect on the ship that leave the loop stable.

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
    """Linear controller: s[k + 1] = A s[k] + B y[k], order[k] = C s[k] + D y[k].

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
        return cls(
            A=np.zeros((0, 0)),
            B=np.zeros((0, len(SIGNALS))),
            C=np.zeros((1, 0)),
            D=gains[None],
        )

    def closed_loop(self, ship: SampledShip) -> Floats:
        """Matrix of ship and memory from one control interval to the next.

        An integral that is not fed back is left out.
        """
        steered = ship.A + ship.B @ self.D
        by_memory = ship.B @ self.C
        whole = np.block(
            [
                [steered, by_memory],
                [self.B, self.A],
            ]
        )
        feeds_order = self.D[:, INTEGRAL].any()
        feeds_memory = self.B[:, INTEGRAL].any()
        is_fed_back = feeds_order or feeds_memory
        if is_fed_back:
            return whole
        without = np.delete(whole, INTEGRAL, axis=0)
        return np.delete(without, INTEGRAL, axis=1)

    def margins(self, ship: SampledShip, name: str) -> Margins:
        """Stability margins and bandwidth with a ship.

        The margins follow from the frequency response of the sampled loop
        (`control.stability_margins`). `name` is that of the design. Raises InputError
        if the closed loop is unstable.
        """
        import control

        self._check_closed_loop(ship, name)
        omega = frequencies_of(ship)
        response = self.responses(ship, omega)
        near = near_crossings(response.broken)
        loop: Any = control.frd(response.broken[near], omega[near])
        figures = control.stability_margins(loop, returnall=True)
        gains, phases, _, _, crossings, _ = map(np.asarray, figures)

        raised = gains[gains > 1.0]
        lowered = gains[gains < 1.0]
        delays = np.radians(phases % 360.0) / crossings
        size = np.abs(response.following)
        return Margins(
            gain_margin=least(raised),
            phase_margin_deg=least(np.abs(phases)),
            delay_margin_s=least(delays),
            bandwidth_rad_s=bandwidth(omega, size),
            lowest_gain=float(np.max(lowered, initial=0.0)),
        )

    def _check_closed_loop(self, ship: SampledShip, name: str) -> None:
        """Refuse gains with which a ship is unstable, with a remedy."""
        matrix = self.closed_loop(ship)
        pole = largest_pole(matrix)
        if pole >= 1.0:
            raise InputError(
                f"{name}: expected sampled poles below 1, got {pole:.4f}: the closed"
                " loop is unstable with these gains; choose a shorter control interval"
                " dt, and a lower frequency (PID) or a larger rate_weight_s2 (LQ) in"
                " from_model"
            )

    def responses(self, ship: SampledShip, omega: Floats) -> Responses:
        """Frequency responses at frequencies in rad/s, shape (n_frequencies,)."""
        z = np.exp(1j * omega * ship.dt)
        by_order = _transfer(ship.A, ship.B, z)
        motions = by_order[:, :, 0].T
        of_memory = self.C @ _transfer(self.A, self.B, z)
        orders = (of_memory + self.D)[:, 0].T

        fed_back = orders * motions
        by_rudder = fed_back[RUDDER]
        by_motions = fed_back.sum(axis=0) - by_rudder
        open_gear = 1.0 - by_rudder

        integral = ship.dt / (z - 1.0)  # of the set-point
        set_point = orders[ERROR] + orders[INTEGRAL] * integral
        to_heading = -motions[ERROR] * set_point
        closed = open_gear - by_motions
        return Responses(
            broken=-by_motions / open_gear,
            following=to_heading / closed,
        )


def frequencies_of(ship: SampledShip) -> Floats:
    """Frequencies of the responses with a ship, rad/s; splines lie between them."""
    n_frequencies = 500
    nyquist = np.pi / ship.dt
    return np.geomspace(SLOWEST * nyquist, FASTEST * nyquist, n_frequencies)


def near_crossings(response: Complexes) -> Integers:
    """Numbers of the frequencies about those at which margins are read.

    There a response, of shape (n_frequencies,), crosses the unit circle or the real
    axis. Splines through all frequencies take several times as long and say the same.
    """
    about, apart = 12, 12  # frequencies on each side of a crossing, and elsewhere
    outside = np.abs(response) > 1.0
    above = response.imag > 0.0
    crosses = np.diff(outside) | np.diff(above)
    places = np.flatnonzero(crosses)[:, None] + np.arange(-about, about + 2)
    elsewhere = np.arange(0, len(response), apart)  # a spline swings across a gap
    kept = np.append(elsewhere, places.clip(0, len(response) - 1))
    return np.unique(kept)


def least(values: Floats) -> float:
    """Smallest of some values; infinite without any."""
    return float(np.min(values, initial=np.inf))


def largest_pole(matrix: Floats) -> float:
    """Largest size of the eigenvalues of a sampled system; below 1 it is stable."""
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def check_stable(matrix: Floats, where: str) -> None:
    """Refuse a sampled linear system that grows by itself with an InputError."""
    pole = largest_pole(matrix)
    if not pole < 1.0:
        raise InputError(f"{where}: expected sampled poles below 1, got {pole:.4g}")


def bandwidth(omega: Floats, size: Floats) -> float:
    """Frequency at which a response first falls to -3 dB; the last one if it does not.

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

    low = size[first]
    high = size[first - 1]
    share = (high - half_power) / (high - low)

    first_below = omega[first]
    last_above = omega[first - 1]
    step = np.log(first_below / last_above)
    logarithm = np.log(last_above) + share * step
    return float(np.exp(logarithm))


def _transfer(A: Floats, B: Floats, z: Complexes) -> Complexes:
    """(z I - A)^-1 B at all z, shape (n_z, ...) as B."""
    diagonal = z[:, None, None] * np.eye(len(A))
    inputs = B.astype(np.complex128)[None]
    return np.linalg.solve(diagonal - A, inputs).astype(np.complex128)
