"""Positions, heading and velocities smoothed together, as derivatives of each other."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from identification.samples.preprocess.kalman import LinearSystem
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
        motion = heading_motion(t)
        states = _smoothed(trial, list(states), motion)

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
class RandomWalkMotion:
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


def heading_motion(t: Floats) -> RandomWalkMotion:
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
    return RandomWalkMotion(
        states=(*HEADING, "rdot"),
        guessed_by=("r", "psi"),
        transitions=transitions,
        process=factors * steps**powers,
        start_variances=np.array([1.0, 1e-2, 1.0]),
    )


def plane_motion(t: Floats, psi: Floats) -> RandomWalkMotion:
    """Position, surge and sway at a known heading, whose accelerations random-walk.

    The mean of the heading's cosine and sine holds over each step. The random walk acts
    on velocities and accelerations as on those of `heading_motion`.
    """
    _, _, u, v, udot, vdot = range(6)
    transitions = _plane_transitions(t, psi)
    process = np.zeros_like(transitions)
    walk = heading_motion(t).process[:, 1:, 1:]
    steps = range(len(walk))
    for axis in ([u, udot], [v, vdot]):
        block = np.ix_(steps, axis, axis)
        process[block] = walk
    return RandomWalkMotion(
        states=(*PLANE, "udot", "vdot"),
        guessed_by=("u", "x", "v"),
        transitions=transitions,
        process=process,
        start_variances=np.array([1e4, 1e4, 1e2, 1e2, 1.0, 1.0]),
    )


def _plane_transitions(t: Floats, psi: Floats) -> Floats:
    h = np.diff(t)
    x, y, u, v, udot, vdot = range(6)
    half_square = 0.5 * h**2
    cosine = _midpoints(np.cos(psi))
    sine = _midpoints(np.sin(psi))
    transitions = np.tile(np.eye(6), (len(h), 1, 1))
    parts = [
        (x, u, udot, cosine),
        (x, v, vdot, -sine),
        (y, u, udot, sine),
        (y, v, vdot, cosine),
    ]
    for position, velocity, acceleration, part in parts:
        transitions[:, position, velocity] = h * part
        transitions[:, position, acceleration] = half_square * part
    transitions[:, u, udot] = h
    transitions[:, v, vdot] = h
    return transitions


def _midpoints(values: Floats) -> Floats:
    """Means of each value and the next."""
    return 0.5 * (values[1:] + values[:-1])


def _smoothed(
    trial: Trial, names: Sequence[str], motion: RandomWalkMotion
) -> dict[str, Floats]:
    """States of the motion by the recorded channels.

    The roughness is that of greatest likelihood on the first samples.
    """
    measured = np.column_stack([trial[name] for name in names])
    unit = _unit_system(trial, names, motion)
    guess = _guessed_roughness(trial, motion)

    def system(decade: float, n_samples: int) -> LinearSystem:
        steps = slice(n_samples - 1)
        roughness = guess * 10.0**decade
        return replace(
            unit,
            transitions=unit.transitions[steps],
            process=roughness * unit.process[steps],
        )

    longest = 500  # samples, which are enough

    def unlikelihood(decade: float) -> float:
        first = measured[:longest]
        filtered = system(decade, len(first)).filtered(first)
        return -filtered.log_likelihood

    decades = 4.0  # to either side of the first guess of the roughness
    best = minimize_scalar(
        unlikelihood,
        bounds=(-decades, decades),
        method="bounded",
        options={"xatol": 0.1},
    )
    states = system(float(best.x), len(trial)).smoothed(measured)
    return dict(zip(motion.states, states.T, strict=True))


def _unit_system(
    trial: Trial, names: Sequence[str], motion: RandomWalkMotion
) -> LinearSystem:
    """The motion of unit roughness, of which the named channels are measured."""
    recorded = [motion.states.index(name) for name in names]
    n_states = len(motion.states)
    start = np.zeros(n_states)
    start[recorded] = [trial[name][0] for name in names]
    noise = np.array([_least_noise(trial, name) for name in names])
    return LinearSystem(
        transitions=motion.transitions,
        process=motion.process,
        observation=np.eye(n_states)[recorded],
        variances=noise**2,
        start=start,
        start_variances=motion.start_variances,
    )


def _guessed_roughness(trial: Trial, motion: RandomWalkMotion) -> float:
    """Roughness as if velocity changed by its range in a twentieth of the trial."""
    recorded = _recorded(trial, motion.guessed_by)
    first, *_ = recorded.values()
    size = float(np.ptp(first)) or 1.0
    usual_time = max(trial.duration / 20.0, 1e-9)
    return size**2 / usual_time**3


def _least_noise(trial: Trial, name: str) -> float:
    """Standard deviation of a channel's noise, at least that of its resolution."""
    # of the range of a channel: resolution, and channels without noise
    least_noise = 1e-4
    values = trial[name]
    resolution = least_noise * float(np.ptp(values))
    level = noise_level(trial.t, values)
    return max(level, resolution, 1e-9)
