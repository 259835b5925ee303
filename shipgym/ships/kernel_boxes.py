"""Reference ship corrected by radial basis functions that fade outside their data.

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
from typing import Any, NamedTuple, Self

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_arrays, check_flag
from shipgym.engine import stages
from shipgym.engine.compiled_ship import CompiledShip
from shipgym.engine.lane_records import Point, Sums
from shipgym.engine.mathematics import two_to
from shipgym.engine.motion import Accelerations, Motion, Ship, Triple, accelerations
from shipgym.engine.records import Record, row_of, table_of
from shipgym.errors import InputError
from shipgym.ships.grey_boxes import GreyBox
from shipgym.ships.manoeuvring_model import ManoeuvringModel
from shipgym.ships.particulars import Particulars
from shipgym.ships.terms import Term

RBF = "rbf"
SIZES = (32, 64, 100)  # centres of what is compiled; others have weight 0
#: Arrays of a kernel; None: the number of centres, of features.
SHAPES: dict[str, tuple[int | None, ...]] = {
    "offset": (4,),
    "scale": (4,),
    "centres": (None, 4),
    "basis": (None, None),
}
SLOWEST = 0.05  # of service speed; slower, v and r are divided by it
# numbers of a centre in the table: 4 coordinates, minus half the square of their
# distance from the origin, 3 weights
ROW = 8


@dataclass(frozen=True)
class KernelTerm(Term):
    """A feature of the kernel: a weighted sum of radial basis functions."""

    number: int

    @property
    def product(self) -> object:
        """Number of the feature: the functions are the kernel's."""
        return self.number


@dataclass(frozen=True, eq=False)
class Kernel:
    """Radial basis functions exp(-|x - centre|^2 / 2), and features built from them.

    x is v / U, r L / U, the rudder angle in rad and U / U0, less an offset, by a scale.

    Raises InputError for arrays that do not belong together, or too many centres.
    """

    offset: Floats  # of x, shape (4,)
    scale: Floats  # of x, shape (4,), the length of the functions in it
    centres: Floats  # shape (n_centres, 4)
    basis: Floats  # of the features in the functions, shape (n_centres, n_features)

    def __post_init__(self) -> None:
        n = len(self.centres)
        has_scale = np.all(self.scale > 0.0)
        has_rows = 0 < n <= SIZES[-1] and len(self.basis) == n
        if not (has_scale and has_rows):
            shapes = [getattr(self, name).shape for name in SHAPES]
            raise InputError(
                "kernel: expected a scale above 0, and 1 to"
                f" {SIZES[-1]} rows in centres and basis, got shapes {shapes}"
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
        return {name: getattr(self, name).tolist() for name in SHAPES}

    @classmethod
    def from_dict(cls, content: Any, where: str) -> Self:
        """Read what `to_dict` wrote; InputError, after `where`, for anything else."""
        return cls(**check_arrays(content, SHAPES, where))


def kernel_inputs(channels: Mapping[str, Any], particulars: Particulars) -> Floats:
    """Inputs v / U, r L / U, rudder angle and U / U0; shape (n_samples, 4)."""
    u = channels["u"]
    v = channels["v"]
    r = channels["r"]
    delta = channels["delta"]
    L = particulars["length"]
    U0 = particulars["speed"]
    U = np.maximum(np.hypot(u, v), SLOWEST * U0)
    inputs = [
        v / U,
        r * L / U,
        delta,
        U / U0,
    ]
    return np.stack(inputs, axis=-1)


def gaussians(x: Floats, centres: Floats) -> Floats:
    """exp(-|x - centre|^2 / 2), shape (n_samples, n_centres)."""
    # |x - c|^2 = |x|^2 - 2 x c + |c|^2
    xx = (x**2).sum(axis=1)
    cc = (centres**2).sum(axis=1)
    xc = x @ centres.T
    squares = xx[:, None] - 2.0 * xc + cc
    # rounding may leave one below 0
    squares = np.maximum(squares, 0.0)
    return np.asarray(np.exp(-0.5 * squares))


@dataclass(frozen=True)
class KernelBox(GreyBox):
    """Accelerations of a reference ship plus sums of a kernel's features."""

    kernel: Kernel = field(default=None, repr=False)  # type: ignore[assignment]

    def features(
        self,
        equation: str,
        channels: Mapping[str, Any],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> Floats:
        """Features of the kernel by U^2, shape (n_samples, n_features)."""
        u, v = channels["u"], channels["v"]
        UU = u * u + v * v
        features = self.kernel.features(channels, particulars)
        return np.asarray(UU[:, None] * features)

    def compiled(self, coefficients: Mapping[str, float], lag: bool) -> CompiledShip:
        """Functions to be compiled: the reference ship's and the sum over centres."""
        size = self.kernel.size
        functions = {
            "N_CENTRES": size,
            "term_accelerations": kernel_accelerations,
        }
        record = _kernel_record(size)
        return self.compiled_with(record, functions, lag, **STAGED, N_ROWS=size)

    def numbers(
        self,
        coefficients: Mapping[str, float],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> Floats:
        """Numbers of the functions: the reference ship's, scales, offset and centres.

        Coordinates are scaled so that the kernel is a power of 2.
        """
        kernel = self.kernel
        per_root_ln_2 = 1.0 / np.sqrt(np.log(2.0))
        centres = per_root_ln_2 * kernel.centres
        numbers = self.term_numbers(coefficients, particulars, shaft_speed)
        weights = numbers.reshape(3, -1)
        table = np.zeros((kernel.size, ROW))
        rows = table[: len(centres)]
        rows[:, :4] = centres
        # minus half the squared distance from the origin
        rows[:, 4] = -0.5 * (centres**2).sum(axis=1)
        rows[:, 5:] = kernel.basis @ weights.T
        return np.concatenate(
            [
                self.ship.ship_numbers(),
                per_root_ln_2 / kernel.scale,
                kernel.offset,
                table.ravel(),
            ]
        )

    def to_dict(self) -> dict[str, Any]:
        """Reference ship and kernel, as written in a model file."""
        table = super().to_dict()
        del table["equations"]
        return {**table, "kernel": self.kernel.to_dict()}

    @classmethod
    def read(
        cls, table: Mapping[str, Any], where: str, reference: ManoeuvringModel
    ) -> Self:
        """Read what `to_dict` wrote, given the reference; errors begin with `where`."""
        kernel = Kernel.from_dict(table["kernel"], f"{where}.kernel")
        shaft = check_flag(table.get("shaft", False), f"{where}.shaft")
        return cls(**_kernel_fields(table.get("name", ""), reference, shaft, kernel))


def kernel_box(box: GreyBox, kernel: Kernel) -> KernelBox:
    """Take the reference ship of a grey box with a kernel in place of its terms."""
    return KernelBox(**_kernel_fields(box.name, box.ship, box.shaft, kernel))


def _kernel_fields(
    name: str, reference: ManoeuvringModel, shaft: bool, kernel: Kernel
) -> dict[str, Any]:
    """Fields of a `KernelBox`, whose terms are the kernel's features everywhere."""
    terms: tuple[Term, ...] = ()
    for number in range(kernel.basis.shape[1]):
        terms += (KernelTerm(f"k{number + 1}", (), number),)
    source = (
        "Suykens, Van Gestel, De Brabanter, De Moor & Vandewalle 2002, Least squares"
        " support vector machines, chapter 6; Mei, Sun & Shi 2019"
    )
    return {
        "name": name,
        "source": source,
        "equations": {"u": terms, "v": terms, "r": terms},
        "normalisation": "prime",
        "quantity": "acceleration",
        "reference": reference,
        "shaft": shaft,
        "kernel": kernel,
    }


class KernelCoefficients(NamedTuple):
    """Record of scales, offsets and centres, for any number of these."""

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
    """Coordinates among the centres, and half the squared distance from the origin."""
    u, v = motion.u, motion.v
    slowest = SLOWEST * ship.speed
    U = max(sqrt(u * u + v * v), slowest)
    per_U = 1.0 / U
    v_ = v * per_U
    r_ = motion.r * ship.length * per_U
    U_ = U / ship.speed
    sway = c.per_v * (v_ - c.v)
    turn = c.per_r * (r_ - c.r)
    rudder = c.per_delta * (motion.delta - c.delta)
    speed = c.per_speed * (U_ - c.speed)
    square = sway * sway + turn * turn + rudder * rudder + speed * speed
    return Point(
        sway,
        turn,
        rudder,
        speed,
        half=0.5 * square,
    )


def add_centre(at: Point, sums: Sums, c: KernelCoefficients, number: int) -> Sums:
    """Add one centre: its weights by exp(-|x - centre|^2 / 2)."""
    row = ROW * number
    # -|x - centre|^2 / 2 = -|centre|^2 / 2 - |x|^2 / 2 + x centre
    exponent = (
        row_of(c.table, row + 4)
        - at.half
        + row_of(c.table, row) * at.a
        + row_of(c.table, row + 1) * at.b
        + row_of(c.table, row + 2) * at.c
        + row_of(c.table, row + 3) * at.d
    )
    value = two_to(exponent)
    return Sums(
        u=sums.u + value * row_of(c.table, row + 5),
        v=sums.v + value * row_of(c.table, row + 6),
        r=sums.r + value * row_of(c.table, row + 7),
    )


def sum_accelerations(motion: Motion, sums: Sums, ship: Ship) -> Triple:
    """Surge, sway and yaw acceleration of the sums, by U^2."""
    UU = motion.u * motion.u + motion.v * motion.v
    return UU * sums.u, UU * sums.v, UU * sums.r


def kernel_accelerations(
    motion: Motion, c: KernelCoefficients, ship: Ship
) -> Accelerations:
    """Accelerations that the kernel adds to those of one ship."""
    at = coordinates(motion, c, ship)
    sums = Sums(0.0, 0.0, 0.0)
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
