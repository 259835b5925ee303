"""The regressors of Song 2020, equation 4-2, on the container ship in place of Yukun.

Yukun's trials, propeller and rudder are not published. The container ship sails the
same two zigzags; her thrust and rudder force are computed as the paper computes
Yukun's, her mass and added mass are known, and so are the five numbers of propeller and
rudder that the regression is to find (Son & Nomoto 1981).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.estimators.recursive import MultiInnovationLeastSquares
from identification.estimators.tuned import TunedLSSVM
from identification.pipeline import identify
from papers.row import Row
from shipgym.manoeuvres import zigzag, zigzag_indices
from shipgym.models import load_model
from shipgym.ships import container as own
from shipgym.ships.inertia import inertia
from shipgym.ships.terms import read_terms
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]
Fit = Callable[[Floats, Floats], Floats]

INTERVAL, DURATION = 0.5, 600.0  # s
OMEGA = 0.5  # between the printed bounds 0.1 and 1
OF_SPAN = 10.0  # aim: rms error of a predicted channel, % of its span
DEGREES = 1.0  # aim: error of an overshoot
EQUATIONS = ("u", "v", "r", "p")
CHANNELS = ("x", "y", "psi", "u", "v", "r", "p", "phi", "delta", "n")
STATE = ("x", "y", "psi", "u", "v", "r", "p", "phi")

#: Equation 4-2 without thrust and rudder, as Table 4-2 numbers them (its X_uuu, X_uuuu
#: are u^2, u^3).
HULL = {
    "u": "u^2, u^3, v^2, r^2, v r, u v^2, u v phi^2",
    "v": (
        "u v, u p, u^2 v, r^3, v r^2, v^2 r, u v p^2, u r p^2, |v| v, |r| v, |v| r,"
        " |r| r"
    ),
    "r": "u v, u p, u phi, u^2 r, u^2 v, v^3, r^3, v r^2, v^2 r, u r p^2, |r| v, |v| v",
    "p": "p, u v, u r, u^2 v, v^3, v^2 r, v r^2, u v phi^2, u r phi^2, |v| v",
}
#: Sway as the container ship's own hull has it.
OWN_SWAY = "v, r, phi, v^3, r^3, v^2 r, v r^2, v^2 phi, v phi^2, r^2 phi, r phi^2"

#: By number: its equation, what Table 4-2 prints of Yukun, what the container ship has.
PROPULSION = {
    "C_P = 1 - t": ("u", 1.3940, 1.0 - own.PUBLISHED.t),
    "C_Ru = 1 - t_R": ("u", 0.5816, own.PUBLISHED.c_RX),
    "C_Rv = 1 + a_H": ("v", 0.9274, 1.0 + own.PUBLISHED.a_H),
    "C_Rp = -(1 + a_H) z_R": (
        "p",
        -0.0882,
        -(1.0 + own.PUBLISHED.a_H) * own.PUBLISHED.z_R,
    ),
    "C_Rr = x_R + a_H x_H": (
        "r",
        -0.5867,
        own.PUBLISHED.x_R + own.PUBLISHED.a_H * own.PUBLISHED.x_H,
    ),
}
REMARKS = {
    "C_P = 1 - t": "printed: a thrust deduction of -0.39, which no ship has",
    "C_Rv = 1 + a_H": (
        "printed: a hull that takes force from the rudder; of this ship the list lacks"
        " the heel in sway"
    ),
}


@cache
def recorded(angle: float, heading: float) -> Trial:
    """A zigzag of the container ship as it is sampled."""
    run = zigzag(load_model("container"), angle, heading, duration=DURATION, dt=0.1)
    every = round(INTERVAL / 0.1)
    channels = {name: run[name][::every] for name in CHANNELS}
    name = f"zigzag {angle:g}/{heading:g}"
    return Trial(run.t[::every], channels, name=name, kind="zigzag", length=run.length)


def thrust_and_rudder(u: Any, v: Any, r: Any, delta: Any, n: Any) -> tuple[Any, Any]:
    """Rudder thrust and normal force, prime system, from velocities in SI units."""
    ship = own.PUBLISHED
    L = own.LENGTH
    D = own.DIAMETER
    U = np.hypot(u, v)
    u_ = u / U
    v_ = v / U
    r_ = r * L / U
    u_P = u_ * (1.0 - ship.wp + ship.tau * (v_ + ship.xp * r_) ** 2)
    J = u_P * U / (n * D)
    K_T = 0.527 - 0.455 * J
    thrust = 2.0 * D**4 / (L * L) * K_T * n * np.abs(n) / U**2

    v_R = (
        ship.gamma * v_
        + ship.c_Rr * r_
        + ship.c_Rrrr * r_**3
        + ship.c_Rrrv * r_**2 * v_
    )
    race = np.sqrt(1.0 + 8.0 * ship.kappa / np.pi * K_T / J**2)
    u_R = u_P * ship.epsilon * race
    aspect = own.ASPECT_RATIO
    lift = 6.13 * aspect / (aspect + 2.25) * own.RUDDER_AREA / (L * L)
    inflow = np.arctan2(v_R, u_R)
    normal = -lift * (u_R**2 + v_R**2) * np.sin(delta + inflow)
    return thrust, normal


def regressors(
    motion: Mapping[str, Any], hull: Mapping[str, str] = HULL
) -> dict[str, list[Any]]:
    """Terms of equation 4-2, prime system: rudder last, in surge after the thrust.

    The paper's F_N is positive for a positive rudder angle, the container ship's is its
    opposite.
    """
    U = np.hypot(motion["u"], motion["v"])
    length = {"u": 1.0, "v": 1.0, "r": own.LENGTH, "p": own.LENGTH}
    prime = {name: motion[name] * unit / U for name, unit in length.items()} | {
        "phi": motion["phi"]
    }
    prime |= {f"|{name}|": abs(prime[name]) for name in "vr"}
    thrust, normal = thrust_and_rudder(
        *(motion[name] for name in ("u", "v", "r", "delta", "n"))
    )
    along, aside = normal * np.sin(motion["delta"]), normal * np.cos(motion["delta"])
    propulsion = {"u": [thrust, along], "v": [aside], "r": [aside], "p": [aside]}
    return {
        equation: (
            [_product(prime, powers) for powers in _powers(text)] + propulsion[equation]
        )
        for equation, text in hull.items()
    }


@cache
def _powers(text: str) -> tuple[tuple[tuple[str, int], ...], ...]:
    return tuple(term.powers for term in read_terms(text))


def _product(values: Mapping[str, Any], powers: tuple[tuple[str, int], ...]) -> Any:
    product: Any = 1.0
    for symbol, power in powers:
        product = product * values[symbol] ** power
    return product


def known_forces(motion: Mapping[str, Any]) -> dict[str, Any]:
    """Known part of equation 4-5: centripetal forces and righting moment, prime."""
    L = own.LENGTH
    U = np.hypot(motion["u"], motion["v"])
    u = motion["u"] / U
    v = motion["v"] / U
    r = motion["r"] * L / U
    hull = own.PUBLISHED
    righting = own.WEIGHT / (0.5 * L * L) * hull.GM / L / U**2
    return {
        "u": (hull.m + hull.my) * v * r,
        "v": -(hull.m + hull.mx) * u * r,
        "r": 0.0 * r,
        "p": hull.mx * hull.lx * u * r - righting * motion["phi"],
    }


def inertia_matrix() -> Floats:
    """From accelerations in surge, sway, yaw and roll to prime forces.

    Angular accelerations are times length.
    """
    L = own.LENGTH
    prime_mass = 0.5 * 1025.0 * L**3
    lengths = np.array([1.0, 1.0, L, L])
    matrix = np.zeros((4, 4))
    matrix[:3] = inertia(load_model("container")) / prime_mass / lengths
    matrix[2] /= L
    matrix[3, :3] = matrix[:3, 3]
    matrix[3, 3] = own.PUBLISHED.Ix + own.PUBLISHED.Jx
    return matrix


def regression(
    trial: Trial, hull: Mapping[str, str] = HULL
) -> dict[str, tuple[Floats, Floats]]:
    """Equation 4-8: regressors and remaining forces, by central differences."""
    motion = {name: trial[name] for name in CHANNELS}
    speed = np.hypot(trial["u"], trial["v"])
    lengths = np.array([1.0, 1.0, own.LENGTH, own.LENGTH])
    rates = np.array([np.gradient(trial[name], trial.t) for name in EQUATIONS])
    forces = inertia_matrix() @ (rates * lengths[:, None] * own.LENGTH / speed**2)
    known, columns = known_forces(motion), regressors(motion, hull)
    return {
        q: (np.column_stack(columns[q]), forces[EQUATIONS.index(q)] - known[q])
        for q in hull
    }


def as_paper(X: Floats, y: Floats) -> Floats:
    """Inverse-free multi-innovation least squares with nonlinear innovation."""
    found: Floats = MultiInnovationLeastSquares(omega=OMEGA).fit(X, y).coef_
    return found


def tuned(X: Floats, y: Floats) -> Floats:
    """LS-SVM whose C is chosen on blocks of time held out."""
    found: Floats = TunedLSSVM(optimiser="grid", fit_intercept=False).fit(X, y).coef_
    return found


@cache
def fitted(fit: Fit) -> dict[str, Floats]:
    """Coefficients of each equation from the 10/20 zigzag."""
    return {q: fit(X, y) for q, (X, y) in regression(recorded(10, 20)).items()}


def predicted(theta: Mapping[str, Floats], trial: Trial) -> Trial:
    """Response of the identified equations to a trial's inputs from its first state."""
    from scipy.integrate import solve_ivp

    matrix = np.linalg.inv(inertia_matrix())
    lengths = np.array([1.0, 1.0, own.LENGTH, own.LENGTH]) * own.LENGTH

    def rates(t: float, state: Floats) -> list[float]:
        motion = dict(zip(STATE, state.tolist(), strict=True))
        for name in ("delta", "n"):
            motion[name] = float(np.interp(t, trial.t, trial[name]))
        columns = regressors(motion)
        known = known_forces(motion)
        forces = []
        for q in EQUATIONS:
            identified = float(theta[q] @ np.array(columns[q]))
            forces.append(identified + known[q])

        u = motion["u"]
        v = motion["v"]
        psi = motion["psi"]
        north = u * np.cos(psi) - v * np.sin(psi)
        east = u * np.sin(psi) + v * np.cos(psi)
        accelerations = (matrix @ forces) * (u * u + v * v) / lengths
        return [north, east, motion["r"], *accelerations.tolist(), motion["p"]]

    start = [trial[name][0] for name in STATE]
    found = solve_ivp(
        rates,
        (trial.t[0], trial.t[-1]),
        start,
        t_eval=trial.t,
        max_step=2.0,
        rtol=1e-5,
        atol=1e-8,
    )
    channels = dict(zip(STATE, found.y, strict=True)) | {
        "delta": trial["delta"],
        "n": trial["n"],
    }
    return Trial(trial.t, channels, name=trial.name, kind="zigzag", length=trial.length)


def off(found: Trial, truth: Trial, channel: str) -> float:
    """Root mean square error of a channel, % of its span."""
    return float(
        100.0
        * np.sqrt(np.mean((found[channel] - truth[channel]) ** 2))
        / np.ptp(truth[channel])
    )


def coefficient_rows() -> Iterator[Row]:
    """Table 4-2: propeller and rudder, the only numbers with a counterpart."""
    yield Row(
        "Table 4-2",
        "41 hull coefficients of Yukun",
        None,
        None,
        None,
        "",
        None,
        "not to be reproduced: her trials, propeller and rudder are not published. The"
        " container ship in her place; the regressors are the same",
    )
    for name, (equation, printed, true) in PROPULSION.items():
        place = -2 if name.startswith("C_P") else -1
        ours, best = (float(fitted(fit)[equation][place]) for fit in (as_paper, tuned))
        yield Row(
            "Table 4-2",
            name,
            printed,
            ours,
            best,
            f"{true:.4g}, the container ship's",
            None,
            REMARKS.get(name, ""),
        )
    X, y = regression(recorded(10, 20), {"v": OWN_SWAY})["v"]
    found, true = float(tuned(X, y)[-1]), 1.0 + own.PUBLISHED.a_H
    yield Row(
        "Table 4-2",
        "C_Rv = 1 + a_H, sway on the container ship's own terms",
        None,
        None,
        found,
        f"within 2 % of {true:.4g}",
        abs(found / true - 1.0) < 0.02,
        "so it is the list of equation 4-2 that is off for this ship, not the method",
    )


def prediction_rows() -> Iterator[Row]:
    """Figures 4.1 to 4.4: the zigzag that was fitted, and the 20/20 predicted."""
    for figures, truth in (
        ("4.1, 4.2", recorded(10, 20)),
        ("4.3, 4.4", recorded(20, 20)),
    ):
        ours, best = (predicted(fitted(fit), truth) for fit in (as_paper, tuned))
        for channel in STATE:
            least = off(best, truth, channel)
            yield Row(
                f"Figures {figures}",
                f"{truth.name}, {channel}: rms error, % of span",
                None,
                off(ours, truth, channel),
                least,
                f"below {OF_SPAN:g}",
                least < OF_SPAN,
                (
                    "fitted"
                    if truth.name == "zigzag 10/20"
                    else "predicted from the 10/20"
                ),
            )
    for number in (1, 2):
        true, theirs, least = (
            getattr(zigzag_indices(run, 20.0), f"overshoot_{number}_deg")
            for run in (truth, ours, best)
        )
        yield Row(
            "Figures 4.3, 4.4",
            f"zigzag 20/20, overshoot {number}: error, deg",
            None,
            abs(theirs - true),
            abs(least - true),
            f"below {DEGREES:g}",
            abs(least - true) < DEGREES,
        )


def polynomial_rows() -> Iterator[Row]:
    """The same by `identify` with `mmg4dof`, without data of propeller and rudder."""
    ship, truth = load_model("container"), recorded(20, 20)
    trials = [recorded(10, 20), truth.with_(use="validate")]
    found = identify(trials, "mmg4dof", particulars=ship.particulars).predictions[
        truth.name
    ]
    assert found is not None
    for channel in ("r", "psi", "phi"):
        error = off(found, truth, channel)
        yield Row(
            "Figures 4.3, 4.4",
            f"zigzag 20/20, {channel}, thrust and rudder unknown: rms error, % of span",
            None,
            None,
            error,
            f"below {OF_SPAN:g}",
            error < OF_SPAN,
            "polynomials of n and delta in place of thrust and rudder force",
        )


def container_rows() -> Iterator[Row]:
    """All rows of chapter 4."""
    yield from coefficient_rows()
    yield from prediction_rows()
    yield from polynomial_rows()
