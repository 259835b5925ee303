"""Positions, heading and velocities smoothed together, so that each is the derivative of the other."""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from identification.regression.preprocess.noise import is_noisy, noise_level
from shipgym import InputError, Trial
from shipgym.arrays import Floats

HEADING = ("psi", "r")
PLANE = ("x", "y", "u", "v")
LONGEST_SEARCH = 500  # samples, from which the roughness of the motion is found
DECADES = 4.0  # to either side of the first guess of the roughness
LEAST_NOISE = 1e-4  # of the range of a channel: resolution, and channels without noise


def smooth_kinematics(trial: Trial) -> Trial:
    """Smooth heading and yaw rate, then positions and velocities at that heading, as far as recorded.

    Accelerations are random walks whose roughness is that of greatest likelihood; with
    the heading known, positions and velocities are linear in each other, so that two
    linear smoothers do. Raises InputError for a trial with neither psi nor r.
    """
    if not {"psi", "r"} & trial.channels.keys():
        raise InputError(
            f"trial {trial.name!r}: neither psi nor r found, expected the heading or"
            " the yaw rate to smooth the kinematics by; name its column, or choose"
            ' preprocessing = "spline"'
        )
    heading = _smooth_heading(trial)
    found: dict[str, Floats] = dict(heading)
    if {"u", "v"} & trial.channels.keys() or {"x", "y"} <= trial.channels.keys():
        found |= _smooth_plane(trial, heading["psi"])
    return trial.with_channels({name: found[name] for name in found if name in trial})


def _smooth_heading(trial: Trial) -> dict[str, Floats]:
    """Heading (from 0 where it is not recorded) and yaw rate."""
    names = [name for name in HEADING if name in trial]
    if "psi" in names and not is_noisy(trial.t, (trial[name] for name in names)):
        return {name: trial[name] for name in names}
    h = np.diff(trial.t)
    given = (*HEADING, "rdot"), _integrators(h), _random_walk(h), (1.0, 1e-2, 1.0)
    states = _smooth_states(trial, names, "r" if "r" in trial else "psi", *given)
    return {name: states[name] for name in HEADING}


def _smooth_plane(trial: Trial, psi: Floats) -> dict[str, Floats]:
    """Position, surge and sway at a known heading."""
    names = [name for name in PLANE if name in trial]
    if not is_noisy(trial.t, (trial[name] for name in names)):
        return {name: trial[name] for name in names}
    h = np.diff(trial.t)
    walk, process = _random_walk(h), np.zeros((len(h), 6, 6))
    for first in (2, 3):
        axes = np.array([first, first + 2])
        process[:, axes[:, None], axes] = walk[:, 1:, 1:]
    given = (
        (*PLANE, "udot", "vdot"),
        _plane_transitions(h, psi),
        process,
        (1e4, 1e4, 1e2, 1e2, 1.0, 1.0),
    )
    return _smooth_states(
        trial, names, next(name for name in ("u", "x", "v") if name in trial), *given
    )


def _smooth_states(
    trial: Trial,
    names: Sequence[str],
    guessed_by: str,
    columns: tuple[str, ...],
    transitions: Floats,
    process: Floats,
    start_variances: tuple[float, ...],
) -> dict[str, Floats]:
    """States by column, integrals of a random walk of the acceleration, with arguments of `smooth_linear`.

    `process` is that by unit of roughness, which is the one of greatest likelihood on
    the first samples.
    """
    observation = np.eye(len(columns))[[columns.index(name) for name in names]]
    start = np.array([trial[name][0] if name in names else 0.0 for name in columns])
    measured = np.column_stack([trial[name] for name in names])
    noise = [
        [noise_level(trial.t, trial[c]), LEAST_NOISE * np.ptp(trial[c]), 1e-9]
        for c in names
    ]
    variances = np.max(noise, axis=1) ** 2
    # variance by time of the acceleration's random walk, from how much a velocity
    # changes
    size = float(np.ptp(trial[guessed_by])) or 1.0
    guess = size**2 / max(trial.duration / 20.0, 1e-9) ** 3

    def run(decade: float, rows: int, quick: bool) -> tuple[Floats, float]:
        return smooth_linear(
            transitions[: rows - 1],
            guess * 10.0**decade * process[: rows - 1],
            observation,
            variances,
            measured[:rows],
            start,
            np.array(start_variances),
            quick,
        )

    best = minimize_scalar(
        lambda decade: -run(decade, min(len(trial), LONGEST_SEARCH), True)[1],
        bounds=(-DECADES, DECADES),
        method="bounded",
        options={"xatol": 0.1},
    )
    return dict(zip(columns, run(float(best.x), len(trial), False)[0].T, strict=True))


def _integrators(h: Floats) -> Floats:
    """Transitions of position, speed and acceleration, shape (n, 3, 3)."""
    found = np.tile(np.eye(3), (len(h), 1, 1))
    found[:, 0, 1] = found[:, 1, 2] = h
    found[:, 0, 2] = 0.5 * h**2
    return found


def _random_walk(h: Floats) -> Floats:
    """Covariance of position, speed and acceleration after a random walk of the acceleration."""
    powers = np.array([[5, 4, 3], [4, 3, 2], [3, 2, 1]])
    factors = np.array(
        [[1 / 20, 1 / 8, 1 / 6], [1 / 8, 1 / 3, 1 / 2], [1 / 6, 1 / 2, 1.0]]
    )
    return np.asarray(factors * h[:, None, None] ** powers)


def _plane_transitions(h: Floats, psi: Floats) -> Floats:
    """Transitions of x, y, u, v and their accelerations; mean heading over each step."""
    found = np.tile(np.eye(6), (len(h), 1, 1))
    cosine, sine = (
        0.5 * (values[1:] + values[:-1]) for values in (np.cos(psi), np.sin(psi))
    )
    for axis, parts in enumerate(((cosine, -sine), (sine, cosine))):
        for k, part in enumerate(parts):
            found[:, axis, 2 + k] = h * part
            found[:, axis, 4 + k] = 0.5 * h**2 * part
    found[:, 2, 4] = found[:, 3, 5] = h
    return found


def smooth_linear(
    transitions: Floats,
    process: Floats,
    observation: Floats,
    variances: Floats,
    measured: Floats,
    start: Floats,
    start_variances: Floats,
    only_likelihood: bool = False,
) -> tuple[Floats, float]:
    """Smooth x_k+1 = F_k x_k + w_k, y_k = H x_k + e_k (Rauch, Tung & Striebel 1965, AIAA Journal 3(8)).

    Measurements are taken in one at a time, in Joseph's form, so that nothing is
    inverted. `transitions` and `process`, the covariance of w, have shape (n_samples -
    1, n_states, n_states), `observation` (n_channels, n_states) and `measured`
    (n_samples, n_channels); what is not finite is missing. Returns the states, the
    filtered ones with `only_likelihood`, and the measurements' log-likelihood but for a
    constant.
    """
    n, size = len(measured), len(start)
    ahead, filtered = np.empty((2, n, size)), np.empty((2, n, size, size))
    x, p, likelihood, identity = (
        start.copy(),
        np.diag(start_variances),
        0.0,
        np.eye(size),
    )
    for k in range(n):
        if k:
            x = transitions[k - 1] @ x
            p = transitions[k - 1] @ p @ transitions[k - 1].T + process[k - 1]
        ahead[0, k], filtered[0, k] = x, p
        for h, variance, y in zip(observation, variances, measured[k], strict=True):
            if not np.isfinite(y):
                continue
            ph = p @ h
            innovation_variance = float(h @ ph) + variance
            error, gain = y - float(h @ x), ph / innovation_variance
            x = x + gain * error
            left = identity - np.outer(gain, h)
            p = left @ p @ left.T + variance * np.outer(gain, gain)
            likelihood -= 0.5 * (
                np.log(innovation_variance) + error * error / innovation_variance
            )
        ahead[1, k], filtered[1, k] = x, p
    states = ahead[1]
    if not only_likelihood:
        for k in range(n - 2, -1, -1):
            gain = np.linalg.solve(
                filtered[0, k + 1], transitions[k] @ filtered[1, k]
            ).T
            states[k] += gain @ (states[k + 1] - ahead[0, k + 1])
    return states, likelihood
