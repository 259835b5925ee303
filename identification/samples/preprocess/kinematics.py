"""Positions, heading and velocities smoothed together, as derivatives of each other.

By a Kalman filter and smoother of linear motions whose accelerations are random walks.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from identification.samples.preprocess.noise import is_noisy, noise_level
from shipgym import InputError, Trial
from shipgym.arrays import Floats

HEADING = ("psi", "r")
PLANE = ("x", "y", "u", "v")


def smooth_kinematics(trial: Trial) -> Trial:
    """Smooth heading and yaw rate, then positions and velocities at that heading.

    Those that are recorded. Accelerations are random walks whose roughness is that of
    greatest likelihood; with the heading known, positions and velocities are linear in
    each other, so that two linear smoothers do. Raises InputError for a trial with
    neither psi nor r.
    """
    if not {"psi", "r"} & trial.channels.keys():
        raise InputError(
            f"trial {trial.name!r}: expected the heading psi or the yaw rate r to"
            " smooth the kinematics by, got neither; name its column, or choose"
            ' preprocessing = "spline"'
        )
    t = trial.t
    states = _recorded(trial, HEADING)
    if "psi" not in trial or is_noisy(t, states.values()):
        states = _smoothed(trial, list(states), heading_motion(t))
    moving = _recorded(trial, PLANE)
    has_motion = {"u", "v"} & moving.keys() or {"x", "y"} <= moving.keys()
    if has_motion and is_noisy(t, moving.values()):
        motion = plane_motion(t, states["psi"])
        states |= _smoothed(trial, list(moving), motion)
    return trial.with_channels(
        {name: values for name, values in states.items() if name in trial}
    )


def _recorded(trial: Trial, names: Sequence[str]) -> dict[str, Floats]:
    return {name: trial[name] for name in names if name in trial}


@dataclass(frozen=True, eq=False)
class Motion:
    """States that follow from accelerations that are random walks.

    Attributes
    ----------
    states : tuple of str
        Names of the states.
    guessed_by : tuple of str
        States whose range gives the first guess of the roughness, the first recorded.
    transitions : array of shape (n_samples - 1, n_states, n_states)
        From each sample to the next.
    process : array of shape (n_samples - 1, n_states, n_states)
        Covariance that a random walk of unit roughness adds in each step.
    start_variances : array of shape (n_states,)
        Variances of the first state.
    """

    states: tuple[str, ...]
    guessed_by: tuple[str, ...]
    transitions: Floats
    process: Floats
    start_variances: Floats


def heading_motion(t: Floats) -> Motion:
    """Heading and yaw rate, whose yaw acceleration is a random walk."""
    h = np.diff(t)
    psi, r, rdot = range(3)
    transitions = np.tile(np.eye(3), (len(h), 1, 1))
    transitions[:, psi, r] = h
    transitions[:, r, rdot] = h
    transitions[:, psi, rdot] = 0.5 * h**2

    # covariance of position, velocity and acceleration after a step h of a twice
    # integrated random walk: factors times powers of h
    factors = np.array(
        [
            [1 / 20, 1 / 8, 1 / 6],
            [1 / 8, 1 / 3, 1 / 2],
            [1 / 6, 1 / 2, 1.0],
        ]
    )
    powers = np.array([[5, 4, 3], [4, 3, 2], [3, 2, 1]])
    steps = h[:, None, None]
    return Motion(
        states=(*HEADING, "rdot"),
        guessed_by=("r", "psi"),
        transitions=transitions,
        process=factors * steps**powers,
        start_variances=np.array([1.0, 1e-2, 1.0]),
    )


def plane_motion(t: Floats, psi: Floats) -> Motion:
    """Position, surge and sway at a known heading, whose accelerations random-walk.

    The mean of the heading's cosine and sine holds over each step. The random walk acts
    on velocities and accelerations as on those of `heading_motion`.
    """
    walk = heading_motion(t).process[:, 1:, 1:]
    transitions = _plane_transitions(t, psi)
    process = np.zeros_like(transitions)
    both_axes = np.eye(2)
    process[:, 2:, 2:] = np.kron(walk, both_axes)
    return Motion(
        states=(*PLANE, "udot", "vdot"),
        guessed_by=("u", "x", "v"),
        transitions=transitions,
        process=process,
        start_variances=np.array([1e4, 1e4, 1e2, 1e2, 1.0, 1.0]),
    )


def _plane_transitions(t: Floats, psi: Floats) -> Floats:
    h = np.diff(t)
    cosine = _midpoints(np.cos(psi))
    sine = _midpoints(np.sin(psi))
    # steps north and east by a unit of velocity ahead and aside
    to_north = np.stack([cosine, -sine], axis=-1)
    to_east = np.stack([sine, cosine], axis=-1)
    rotation = np.stack([to_north, to_east], axis=-2)
    step = h[:, None, None]
    half_square = 0.5 * step**2

    position = slice(0, 2)
    velocity = slice(2, 4)
    acceleration = slice(4, 6)
    transitions = np.tile(np.eye(6), (len(h), 1, 1))
    transitions[:, position, velocity] = step * rotation
    transitions[:, position, acceleration] = half_square * rotation
    transitions[:, velocity, acceleration] = step * np.eye(2)
    return transitions


def _midpoints(values: Floats) -> Floats:
    """Means of each value and the next."""
    return 0.5 * (values[1:] + values[:-1])


def _smoothed(trial: Trial, names: Sequence[str], motion: Motion) -> dict[str, Floats]:
    """States of the motion by the recorded channels.

    The roughness is that of greatest likelihood on the first samples.
    """
    measured = np.column_stack([trial[name] for name in names])
    places = [motion.states.index(name) for name in names]
    noise = np.array([_least_noise(trial, name) for name in names])
    guess = _guessed_roughness(trial, motion)

    def filtered(decade: float, n_samples: int) -> _Filtered:
        roughness = guess * 10.0**decade
        return _filter(motion, roughness, measured[:n_samples], places, noise**2)

    longest = 500  # samples, which are enough
    decades = 4.0  # to either side of the first guess of the roughness
    best = minimize_scalar(
        lambda decade: -filtered(decade, longest).log_likelihood,
        bounds=(-decades, decades),
        method="bounded",
        options={"xatol": 0.1},
    )
    found = filtered(float(best.x), len(trial))
    return dict(zip(motion.states, _smoother(motion, found).T, strict=True))


class _Filtered(NamedTuple):
    """States by the measurements up to each sample, before and after its own.

    Shapes (n_samples, n_states), and of covariances (n_samples, n_states, n_states).
    """

    predicted: Floats
    predicted_covariances: Floats
    states: Floats
    covariances: Floats
    log_likelihood: float  # of the measurements, but for a constant


def _filter(
    motion: Motion,
    roughness: float,
    measured: Floats,
    places: Sequence[int],
    variances: Floats,
) -> _Filtered:
    """Kalman filter; measurements are taken in one at a time, in Joseph's form.

    `places`: of the channels measured, shape (n_samples, n_channels), among the states.
    """
    n_states = len(motion.states)
    found: list[tuple[Floats, Floats, Floats, Floats]] = []
    x = np.zeros(n_states)
    x[list(places)] = measured[0]
    P = np.diag(motion.start_variances)
    log_likelihood = 0.0
    for k, sample in enumerate(measured):
        if k > 0:
            F = motion.transitions[k - 1]
            x = F @ x
            P = F @ P @ F.T + roughness * motion.process[k - 1]
        predicted, predicted_covariance = x, P
        for place, variance, y in zip(places, variances, sample, strict=True):
            innovation = y - x[place]
            innovation_variance = P[place, place] + variance
            gain = P[:, place] / innovation_variance
            x = x + gain * innovation
            # Joseph's form keeps the matrix symmetric and positive
            left = np.eye(n_states)
            left[:, place] -= gain
            P = left @ P @ left.T + variance * np.outer(gain, gain)
            misfit = innovation**2 / innovation_variance
            log_likelihood -= 0.5 * (np.log(innovation_variance) + misfit)
        found.append((predicted, predicted_covariance, x, P))
    before, covariances_before, after, covariances_after = (
        np.array(column) for column in zip(*found, strict=True)
    )
    return _Filtered(
        predicted=before,
        predicted_covariances=covariances_before,
        states=after,
        covariances=covariances_after,
        log_likelihood=float(log_likelihood),
    )


def _smoother(motion: Motion, found: _Filtered) -> Floats:
    """States by all measurements, shape (n_samples, n_states).

    Source: Rauch, Tung & Striebel 1965, AIAA Journal 3(8).
    """
    states = found.states.copy()
    last = len(states) - 1
    for k in reversed(range(last)):
        following = k + 1
        moved = motion.transitions[k] @ found.covariances[k]
        before = found.predicted_covariances[following]
        gain = np.linalg.solve(before, moved).T
        surprise = states[following] - found.predicted[following]
        states[k] += gain @ surprise
    return states


def _guessed_roughness(trial: Trial, motion: Motion) -> float:
    """Roughness as if velocity changed by its range in a twentieth of the trial."""
    recorded = _recorded(trial, motion.guessed_by)
    first, *_ = recorded.values()
    size = float(np.ptp(first)) or 1.0
    usual_time = max(trial.duration / 20.0, 1e-9)
    return size**2 / usual_time**3


def _least_noise(trial: Trial, name: str) -> float:
    """Standard deviation of a channel's noise, at least that of its resolution."""
    values = trial[name]
    resolution = 1e-4 * float(np.ptp(values))
    level = noise_level(trial.t, values)
    return max(level, resolution, 1e-9)
