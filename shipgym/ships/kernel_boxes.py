"""A reference ship, and radial basis functions that correct her accelerations and fade outside their data.

Source: Suykens, Van Gestel, De Brabanter, De Moor & Vandewalle 2002, Least squares
support vector machines, chapter 6 (fixed-size LS-SVM: a kernel on a few centres,
Nystroem features), on what a reference ship leaves of the accelerations (RM-SVM, Mei,
Sun & Shi 2019). With a linear reference fitted to the same trials it is a kernel ship
of its own, a black box.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.engine import stages
from shipgym.engine.compiled_ship import CompiledShip
from shipgym.engine.lane_records import Point, Sums
from shipgym.engine.mathematics import two_to
from shipgym.engine.motion import Motion, Ship, accelerations
from shipgym.engine.records import Record, row_of, table_of
from shipgym.errors import InputError
from shipgym.ships.grey_boxes import GreyBox
from shipgym.ships.particulars import Particulars
from shipgym.ships.terms import Term

RBF = "rbf"
SIZES = (32, 64, 100)  # centres of what is compiled; others have weight 0
# numbers of a centre: coordinates, minus half their square, weights of surge, sway and
# yaw
ROW = 8
SLOWEST = 0.05  # of service speed; slower, v and r are divided by it
PER_ROOT_LN_2 = 1.0 / sqrt(
    np.log(2.0)
)  # of coordinates, so that the kernel is a power of 2

SOURCE = (
    "Suykens, Van Gestel, De Brabanter, De Moor & Vandewalle 2002, Least squares"
    " support vector machines, chapter 6; Mei, Sun & Shi 2019"
)


@dataclass(frozen=True)
class KernelTerm(Term):
    """A feature of the kernel: a weighted sum of radial basis functions."""

    number: int

    @property
    def product(self) -> object:
        """Its number: the functions are the kernel's."""
        return self.number


@dataclass(frozen=True, eq=False)
class Kernel:
    """Radial basis functions exp(-|x - centre|^2 / 2), and the features that are made of them.

    x is v / U, r L / U, the rudder angle in rad and U / U0, less an offset, by a scale.

    Raises InputError for arrays that do not belong together, or too many centres.
    """

    offset: Floats  # of x, shape (4,)
    scale: Floats  # of x, shape (4,), the length of the functions in it
    centres: Floats  # shape (n_centres, 4)
    basis: Floats  # of the features in the functions, shape (n_centres, n_features)

    def __post_init__(self) -> None:
        shapes = [
            np.shape(a) for a in (self.offset, self.scale, self.centres, self.basis)
        ]
        n = len(self.centres)
        whole = (
            shapes[:3] == [(4,), (4,), (n, 4)]
            and np.ndim(self.basis) == 2
            and len(self.basis) == n
        )
        if not whole or not 0 < n <= SIZES[-1] or not np.all(self.scale > 0.0):
            raise InputError(
                f"kernel: offset, scale, centres and basis of shapes {shapes} found,"
                " expected (4,), (4,) above 0, (n, 4) and (n, n_features) with n at"
                f" most {SIZES[-1]}"
            )

    @property
    def size(self) -> int:
        """Number of centres that is compiled."""
        return next(size for size in SIZES if size >= len(self.centres))

    def features(self, channels: Mapping[str, Any], particulars: Particulars) -> Floats:
        """Features of samples, shape (n_samples, n_features)."""
        x = (kernel_inputs(channels, particulars) - self.offset) / self.scale
        return gaussians(x, self.centres) @ self.basis

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, as a model file has them."""
        return {
            name: getattr(self, name).tolist()
            for name in ("offset", "scale", "centres", "basis")
        }


def kernel_inputs(channels: Mapping[str, Any], particulars: Particulars) -> Floats:
    """Inputs v / U, r L / U, rudder angle and U / U0 of samples, shape (n_samples, 4)."""
    u, v, r, delta = (
        np.asarray(channels[name], dtype=float) for name in ("u", "v", "r", "delta")
    )
    speed = particulars["speed"]
    U = np.maximum(np.hypot(u, v), SLOWEST * speed)
    return np.stack([v / U, r * particulars["length"] / U, delta, U / speed], axis=-1)


def gaussians(x: Floats, centres: Floats) -> Floats:
    """exp(-|x - centre|^2 / 2), shape (n_samples, n_centres)."""
    squares = (
        (x**2).sum(axis=1)[:, None] - 2.0 * x @ centres.T + (centres**2).sum(axis=1)
    )
    return np.asarray(np.exp(-0.5 * np.maximum(squares, 0.0)))


@dataclass(frozen=True)
class KernelBox(GreyBox):
    """A reference ship's accelerations and, by U^2 / L (U^2 / L^2 of yaw), sums of features of a kernel.

    Raises InputError for no kernel, and as `GreyBox`.
    """

    kernel: Kernel = field(default=None, repr=False)  # type: ignore[assignment]

    def __post_init__(self) -> None:
        if not isinstance(self.kernel, Kernel):
            raise InputError(
                f"structure '{self.name}': no kernel found, expected a Kernel"
            )
        super().__post_init__()

    def features(
        self,
        equation: str,
        channels: Mapping[str, Any],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> Floats:
        """As of `Structure`: the features of the kernel by U^2, shape (n_samples, n_features)."""
        u, v = (np.asarray(channels[name], dtype=float) for name in ("u", "v"))
        return np.asarray(
            (u * u + v * v)[:, None] * self.kernel.features(channels, particulars)
        )

    def compiled(self, coefficients: Mapping[str, float], lag: bool) -> CompiledShip:
        """What is compiled: the reference ship's functions and the sum over centres, read at run time."""
        size = self.kernel.size
        functions = {
            "N_CENTRES": size,
            "term_accelerations": kernel_accelerations,
        }
        return self._compiled(
            _kernel_record(size), functions, lag, **STAGED, N_ROWS=size
        )

    def numbers(
        self,
        coefficients: Mapping[str, float],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> Floats:
        """Numbers of the coefficients: the reference ship's, scales, offset and table of centres."""
        kernel = self.kernel
        weights = self.term_numbers(coefficients, particulars, shaft_speed)
        table = np.zeros((kernel.size, ROW))
        rows = table[: len(kernel.centres)]
        rows[:, :4] = PER_ROOT_LN_2 * kernel.centres
        rows[:, 4] = -0.5 * (rows[:, :4] ** 2).sum(axis=1)
        rows[:, 5:] = kernel.basis @ weights.reshape(3, -1).T
        per_scale = PER_ROOT_LN_2 / kernel.scale
        return np.concatenate(
            [self.ship.ship_numbers(), per_scale, kernel.offset, table.ravel()]
        )

    def to_dict(self) -> dict[str, Any]:
        """Reference ship and kernel, as they stand in a model file."""
        table = {k: v for k, v in super().to_dict().items() if k != "equations"}
        return {**table, "kernel": self.kernel.to_dict()}


def kernel_box(box: GreyBox, kernel: Kernel) -> KernelBox:
    """The reference ship of a grey box with a kernel in place of its terms."""
    terms = tuple(KernelTerm(f"k{i + 1}", (), i) for i in range(kernel.basis.shape[1]))
    table = dict.fromkeys("uvr", terms)
    return KernelBox(
        box.name,
        SOURCE,
        table,
        "prime",
        "acceleration",
        box.reference,
        box.shaft,
        kernel,
    )


class KernelCoefficients(NamedTuple):
    """Stands for the record of scales, offsets and centres."""

    per_v: float
    per_r: float
    per_delta: float
    per_speed: float
    v: float
    r: float
    delta: float
    speed: float
    table: Any


N_CENTRES = 0  # set when a loop is compiled


def coordinates(motion: Motion, c: KernelCoefficients, ship: Ship) -> Point:
    """Where a ship is among the centres."""
    U = max(sqrt(motion.u * motion.u + motion.v * motion.v), SLOWEST * ship.speed)
    per_U = 1.0 / U
    x = c.per_v * (motion.v * per_U - c.v)
    y = c.per_r * (motion.r * ship.length * per_U - c.r)
    z = c.per_delta * (motion.delta - c.delta)
    w = c.per_speed * (U / ship.speed - c.speed)
    return Point(x, y, z, w, 0.5 * (x * x + y * y + z * z + w * w))


def add_centre(at: Point, sums: Sums, c: KernelCoefficients, number: int) -> Sums:
    """The sums with what one centre adds."""
    i, t = ROW * number, c.table
    near = row_of(t, i + 4) - at.half + row_of(t, i) * at.a + row_of(t, i + 1) * at.b
    value = two_to(near + row_of(t, i + 2) * at.c + row_of(t, i + 3) * at.d)
    u, v, r = row_of(t, i + 5), row_of(t, i + 6), row_of(t, i + 7)
    return Sums(sums.u + value * u, sums.v + value * v, sums.r + value * r)


def sum_accelerations(
    motion: Motion, sums: Sums, ship: Ship
) -> tuple[float, float, float]:
    """Surge, sway and yaw of the sums."""
    square = motion.u * motion.u + motion.v * motion.v
    return square * sums.u, square * sums.v, square * sums.r


def kernel_accelerations(
    motion: Motion, c: KernelCoefficients, ship: Ship
) -> tuple[float, float, float, float, float]:
    """What the kernel adds, of one ship."""
    at, sums = coordinates(motion, c, ship), Sums(0.0, 0.0, 0.0)
    for number in range(N_CENTRES):
        sums = add_centre(at, sums, c, number)
    udot, vdot, rdot = sum_accelerations(motion, sums, ship)
    return udot, vdot, rdot, 0.0, 0.0


STAGED = {
    "sail_lanes": stages.sail_in_stages,
    "term_accelerations": accelerations,
    "point_of": coordinates,
    "add_row": add_centre,
    "sum_accelerations": sum_accelerations,
}


@cache
def _kernel_record(size: int) -> Record:
    fields = [(name, float) for name in KernelCoefficients._fields[:-1]]
    return NamedTuple("KernelCoefficients", [*fields, ("table", table_of(ROW * size))])  # type: ignore[return-value]
