"""Convert steering dynamics: state space, Nomoto's forms, prime system, and back.

    any ShipModel  ->  steering_state_space (A, B), state_space, nomoto
    (A, B)  ->  nomoto_of, linear_steering_ship
    Nomoto's forms  ->  nomoto1_ship, nomoto2_ship
    prime system  <->  SI: prime_matrices, si_matrices
    another length and speed: scale_model

Of a ship with surge or roll the linear forms keep sway and yaw; from a linear form
comes back a ship that keeps her speed. From Nomoto's form sway cannot come back: two
ships that drift differently may turn the same way.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.checks import check_number, unexpected
from shipgym.errors import InputError
from shipgym.models.linear import (
    Nomoto,
    StraightRunning,
    linearise,
    nomoto,
    nomoto_of,
    steering_state_space,
    straight_running,
)
from shipgym.models.ship_model import ShipModel
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from shipgym.ships.structures import get_structure

if TYPE_CHECKING:
    from control import StateSpace, TransferFunction

Known = Particulars | Mapping[str, Any]

__all__ = [
    "Nomoto",
    "StraightRunning",
    "linear_steering_ship",
    "linearise",
    "nomoto",
    "nomoto1_ship",
    "nomoto2_ship",
    "nomoto_of",
    "prime_matrices",
    "si_matrices",
    "state_space",
    "steering_state_space",
    "straight_running",
    "transfer_function",
]


def state_space(
    model: ShipModel,
    heading: bool = False,
    gear: bool = False,
    speed: float | None = None,
) -> "StateSpace":
    """A ship's steering about straight running as a linear system.

    States are v (q in a table with a memory of yaw), r, and psi and delta where
    `heading` and `gear` ask for them: deviations from straight running in SI units,
    rudder positive to starboard. The input is `delta`, or with the gear's lag (without
    its limit and rate) `delta_command`; the outputs are the states. The speed, m/s, is
    the service speed by default. Raises InputError if the model has no straight course,
    or its gear no lag to make a state of.
    """
    import control  # here, because it takes a second to import

    A, B = steering_state_space(model, speed)
    names = ["q" if "q" in model.state_names else "v", "r"]
    if heading:  # psidot = r
        A = np.pad(A, (0, 1))
        A[-1, 1] = 1.0
        B = np.pad(B, ((0, 1), (0, 0)))
        names.append("psi")
    if gear:  # deltadot = (order - delta) / lag
        lag = model.steering.time_constant
        if not lag > 0.0:
            raise InputError(
                f"steering of {model.name!r}: expected a time_constant above 0, got no"
                " lag: a ramp of constant rate is not linear; leave gear=False"
            )
        A = np.pad(A, (0, 1))
        A[:-1, -1:] = B
        A[-1, -1] = -1.0 / lag
        B = np.zeros((len(A), 1))
        B[-1] = 1.0 / lag
        names.append("delta")

    n_states = len(names)
    return control.ss(
        A,
        B,
        np.eye(n_states),
        np.zeros((n_states, 1)),
        name=model.name.replace(".", "-"),
        states=names,
        outputs=names,
        inputs=["delta_command" if gear else "delta"],
    )


def transfer_function(form: Nomoto, order: int = 2) -> "TransferFunction":
    """Nomoto's transfer function from rudder to yaw rate, both in rad.

    Order 2 is K (1 + T3 s) / ((1 + T1 s) (1 + T2 s)), order 1 is K / (1 + T s). Raises
    InputError for another order, or a form of second order whose poles are a complex
    pair.
    """
    import control

    if order not in (1, 2):
        raise unexpected("order", "2 or 1", order)
    numerator = [form.K]
    denominator = [form.T, 1.0]
    if order == 2:
        _need_time_constants(form)
        numerator = [form.K * form.T3, form.K]
        product = np.polymul([form.T1, 1.0], [form.T2, 1.0])
        denominator = product.tolist()
    return control.tf(
        numerator,
        denominator,
        inputs=["delta"],
        outputs=["r"],
    )


def nomoto1_ship(
    K: float,
    T: float,
    particulars: Known,
    steering: SteeringGear | None = None,
    name: str = "nomoto",
) -> ShipModel:
    """Model of structure `nomoto` from Nomoto's first-order form, T rdot + r = K delta.

    K is in 1/s, positive to starboard, T in s; both are negative for a ship unstable on
    her course. She keeps the service speed of the particulars. Raises InputError for a
    number that is not finite or is zero, or a rudder that turns to the wrong side (K /
    T < 0).
    """
    if not check_number(K, "K") * check_number(T, "T") > 0.0:
        raise InputError(
            "K and T: expected both positive (a stable ship) or both negative, because"
            f" a positive rudder turns to starboard, got {K:g} and {T:g}"
        )
    return ShipModel(
        name=name,
        structure="nomoto",
        particulars=_ship(particulars),
        steering=steering or SteeringGear(),
        coefficients={"c_r": -1.0 / T, "c_d": K / T},
    )


def nomoto2_ship(
    form: Nomoto,
    particulars: Known,
    steering: SteeringGear | None = None,
    name: str = "nomoto2",
) -> ShipModel:
    """Model of structure `nomoto2` from Nomoto's second-order form; T is not used.

    Raises InputError for time constants that are zero or a complex pair.
    """
    _need_time_constants(form)
    product = form.T1 * form.T2
    if product == 0.0 or form.K == 0.0:
        raise unexpected("nomoto", "K, T1 and T2 other than 0", form)
    coefficients = {
        "c_r": -(form.T1 + form.T2) / product,
        "c_d": form.K * form.T3 / product,
        "e_r": -1.0 / product,
        "e_d": form.K / product,
    }
    return ShipModel(
        name=name,
        structure="nomoto2",
        particulars=_ship(particulars),
        steering=steering or SteeringGear(),
        coefficients=coefficients,
    )


def linear_steering_ship(
    A: ArrayLike,
    B: ArrayLike,
    particulars: Known,
    steering: SteeringGear | None = None,
    name: str = "linear-steering",
) -> ShipModel:
    """Model of structure `linear-steering` from d/dt (v, r) = A (v, r) + B delta.

    A has shape (2, 2) and B (2, 1), SI units, delta positive to starboard, as
    `steering_state_space` gives them; at another speed her derivatives follow by the
    prime system. Raises InputError for other shapes or values that are not finite.
    """
    ship = _ship(particulars)
    length = ship.require("length")
    speed = ship.require("speed")
    a, b = prime_matrices(A, B, length, speed)
    structure = get_structure("linear-steering")
    values = np.hstack([a, b]).ravel().tolist()
    coefficients = dict(zip(structure.coefficient_names, values, strict=True))
    return ShipModel(
        name=name,
        structure=structure.name,
        particulars=ship,
        steering=steering or SteeringGear(),
        coefficients=coefficients,
    )


def _ship(particulars: Known) -> Particulars:
    """Particulars, read from a mapping if they are one, as `identify` accepts them."""
    if isinstance(particulars, Particulars):
        return particulars
    return Particulars.from_mapping(particulars)


def prime_matrices(
    A: ArrayLike, B: ArrayLike, length: float, speed: float
) -> tuple[Floats, Floats]:
    """Linear steering in the prime system: v by U, r by U / L, time by L / U.

    A of shape (2, 2) and B of shape (2, 1) in SI units, length in m, speed in m/s.
    Raises InputError for matrices of another shape, or a length or speed that is not
    positive.
    """
    a, b = _checked(A, B)
    unit_a, unit_b = _units(length, speed)
    return a / unit_a, b / unit_b


def si_matrices(
    A: ArrayLike, B: ArrayLike, length: float, speed: float
) -> tuple[Floats, Floats]:
    """Steering dynamics of the prime system in SI, inverse of `prime_matrices`."""
    a, b = _checked(A, B)
    unit_a, unit_b = _units(length, speed)
    return a * unit_a, b * unit_b


def _checked(A: ArrayLike, B: ArrayLike) -> tuple[Floats, Floats]:
    """The matrices as arrays of shape (2, 2) and (2, 1)."""
    return _matrix("A", A, (2, 2)), _matrix("B", B, (2, 1))


def _matrix(name: str, given: ArrayLike, shape: tuple[int, int]) -> Floats:
    matrix = np.asarray(given, dtype=float)
    if matrix.shape != shape or not np.all(np.isfinite(matrix)):
        raise unexpected(
            name,
            f"finite numbers of shape {shape}",
            matrix.tolist(),
        )
    return matrix


def _units(length: float, speed: float) -> tuple[Floats, Floats]:
    """Units of the entries of A and B in the prime system."""
    check_number(length, "length", above=0.0, hint="in m")
    check_number(speed, "speed", above=0.0, hint="in m/s")
    turn_rate = speed / length
    states = np.array([speed, turn_rate])  # of v and r
    rates = turn_rate * states[:, None]
    return rates / states, rates


def _need_time_constants(form: Nomoto) -> None:
    if not np.all(np.isfinite([form.K, form.T1, form.T2, form.T3])):
        remedy = "poles that are a complex pair have no two; use state_space"
        raise unexpected("nomoto", "time constants", form, remedy)
