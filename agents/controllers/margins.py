"""Margins of the loop of a linear controller around a sampled ship."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.controllers.linear_loop import INTEGRAL, SIGNALS, SampledShip
from shipgym import InputError
from shipgym.arrays import Floats

Complexes = NDArray[np.complex128]

SLOWEST = 1e-4  # of the frequencies, over the Nyquist frequency
N_FREQUENCIES = 1500


@dataclass(frozen=True)
class Margins:
    """Largest changes at any one place of the loop that leave it stable.

    The loop is broken where the order leaves the autopilot, and at each measurement
    that it feeds back, heading with its integral; the others stay closed.

    Attributes
    ----------
    gain_margin : float
        Factor by which a gain may be raised; infinite where there is no limit.
    phase_margin_deg : float
        Phase that may be lost, degrees.
    delay_margin_s : float
        Delay that may be added, s.
    lowest_gain : float
        Factor down to which the gain of the order may be lowered; 0 where there is no
        limit. The integral, and a ship unstable on its course, need some.
    """

    gain_margin: float
    phase_margin_deg: float
    delay_margin_s: float
    lowest_gain: float = 0.0

    @property
    def is_enough(self) -> bool:
        """True for 6 dB and 30 degrees."""
        return self.gain_margin >= 2.0 and self.phase_margin_deg >= 30.0


class Compensator(NamedTuple):
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
        if self.D[:, INTEGRAL].any() or self.B[:, INTEGRAL].any():
            return whole
        without = np.delete(whole, INTEGRAL, axis=0)
        return np.delete(without, INTEGRAL, axis=1)

    def margins(self, ship: SampledShip, name: str) -> Margins:
        """Stability margins with a ship, by frequency responses.

        `name` is that of the design. Raises InputError if the closed loop is unstable.
        """
        remedy = (
            ": the closed loop is unstable with these gains; choose a shorter control"
            " interval dt, and a lower frequency (PID) or a larger rate_weight_s2 (LQ)"
            " in from_model"
        )
        check_stable(self.closed_loop(ship), name, remedy)
        omega = frequencies_of(ship)
        broken = self.responses(ship, omega)
        found = [crossings(omega, one) for one in broken.values()]
        gains, phases, delays = map(
            np.concatenate,
            zip(*found, strict=True),
        )
        at_order, _, _ = found[0]
        return Margins(
            gain_margin=least(gains[gains > 1.0]),
            phase_margin_deg=least(np.abs(phases)),
            delay_margin_s=least(delays),
            lowest_gain=float(np.max(at_order[at_order < 1.0], initial=0.0)),
        )

    def responses(self, ship: SampledShip, omega: Floats) -> dict[str, Complexes]:
        """Frequency responses of the broken loop, by the place where it is broken.

        The first is the order. `omega` in rad/s, shape (n_frequencies,) as each.
        """
        z = np.exp(1j * omega * ship.dt)
        motions = _transfer(ship.A, ship.B, z)[:, :, 0].T
        of_memory = self.C @ _transfer(self.A, self.B, z)
        orders = (of_memory + self.D)[:, 0].T
        fed_back = dict(zip(SIGNALS, orders * motions, strict=True))
        heading = fed_back.pop("heading_error_integral") + fed_back["heading_error"]
        fed_back["heading_error"] = heading
        whole = np.sum(list(fed_back.values()), axis=0)

        broken = {"order": -whole}
        for signal, own in fed_back.items():
            if own.any():
                broken[signal] = -own / (1.0 - (whole - own))
        return broken


def frequencies_of(ship: SampledShip) -> Floats:
    """Frequencies of the responses with a ship, rad/s, up to Nyquist's."""
    return np.geomspace(SLOWEST, 1.0, N_FREQUENCIES) * np.pi / ship.dt


def crossings(omega: Floats, response: Complexes) -> tuple[Floats, Floats, Floats]:
    """Gains, phases, deg, and delays, s, with which a broken loop passes -1.

    By crossings of the negative real axis and of the unit circle, on straight lines.

    `omega`: rad/s; `response`: at these frequencies, the last of which is Nyquist's,
    where it is real.
    """
    real = _on_the_axis(response)
    size = np.log(np.abs(response))
    place, share = _changes_of_sign(size)
    before = response[place]
    turned = share * np.angle(response[place + 1] / before)
    phases = np.degrees(np.angle(-before) + turned)
    phases = (phases + 180.0) % 360.0 - 180.0
    growth = omega[place + 1] / omega[place]
    at = omega[place] * growth**share
    delays = np.radians(phases % 360.0) / at
    return -1.0 / real[real < 0.0], phases, delays


def _on_the_axis(response: Complexes) -> Floats:
    """Where a response is real, on straight lines, and at its end."""
    place, share = _changes_of_sign(response.imag)
    before = response.real[place]
    after = response.real[place + 1]
    real = before + share * (after - before)
    return np.append(real, response.real[-1])


def _changes_of_sign(values: Floats) -> tuple[Any, Floats]:
    """Places before which values change their sign, and the share of the way to it."""
    place = np.flatnonzero(np.diff(values > 0.0))
    before = values[place]
    return place, before / (before - values[place + 1])


def least(values: Floats) -> float:
    """Smallest of some values; infinite without any."""
    return float(np.min(values, initial=np.inf))


def largest_pole(matrix: Floats) -> float:
    """Largest size of the eigenvalues of a sampled system; below 1 it is stable."""
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def check_stable(matrix: Floats, where: str, remedy: str = "") -> None:
    """Refuse a sampled linear system that grows by itself with an InputError."""
    pole = largest_pole(matrix)
    if not pole < 1.0:
        raise InputError(
            f"{where}: expected sampled poles below 1, got {pole:.4f}{remedy}"
        )


def _transfer(A: Floats, B: Floats, z: Complexes) -> Complexes:
    """(z I - A)^-1 B at all z, shape (n_z, ...) as B."""
    diagonal = z[:, None, None] * np.eye(len(A))
    inputs = B.astype(np.complex128)[None]
    return np.linalg.solve(diagonal - A, inputs).astype(np.complex128)
