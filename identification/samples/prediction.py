"""Predictions of recorded trials, open loop from the measured rudder.

And the state from which they start where its first sample is not exact.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from identification.samples.preprocess import is_noisy, noise_level, outliers
from shipgym import ShipModel, Trial, UnstableModelError
from shipgym.arrays import Floats
from shipgym.models.simulate import first_state, open_loop, open_loop_states

COMPARED = ("u", "v", "r", "psi")


def predicted_channels(model: ShipModel) -> tuple[str, ...]:
    """Channels of `COMPARED` that a model's equations predict.

    A velocity without an equation keeps its first value, so its error says nothing
    about the coefficients. The heading is the integral of the yaw rate.
    """
    equations = set(getattr(model.dynamics, "equations", "uvr"))
    if "r" in equations:
        equations.add("psi")
    return tuple(name for name in COMPARED if name in equations)


def predicts_track(model: ShipModel) -> bool:
    """Return True if speed and drift are predicted, as a track needs."""
    return {"u", "v"}.issubset(predicted_channels(model))


def is_yaw_alone(model: ShipModel) -> bool:
    """Return True where nothing but yaw rate and heading is predicted."""
    return predicted_channels(model) == ("r", "psi")


def predict(model: ShipModel, trial: Trial) -> Trial | None:
    """Simulate a trial from its initial state and measured rudder.

    The initial state is estimated where it was not measured exactly (`with_start`).
    None if the model runs away.
    """
    try:
        return open_loop(model, with_start(model, trial))
    except UnstableModelError:
        return None


def with_start(model: ShipModel, trial: Trial) -> Trial:
    """The trial with the first samples estimated, as far as they are not exact.

    One sample of velocity, heading or position has all of the noise, and at the end of
    a record a derivative is least certain, the more so as the rudder moves there.
    Instead the start is that from which the model comes nearest to heading, measured
    yaw rate, and track (velocities where there is no track) over the first 1.5 ship
    lengths (output error with the initial state among the unknowns, Maine & Iliff 1985,
    NASA RP-1138). A model of yaw alone is compared with heading and yaw rate. What was
    measured without noise stays as it is.
    """
    opening = _opening_of(trial, model.travel_time)
    states = ("psi", "r") if is_yaw_alone(model) else ("psi", *"uvr", *"xy")
    names = [name for name in opening.inexact if name in states]
    if not names or "psi" not in trial:
        return trial
    try:
        state = _Start(
            model,
            opening,
            names,
        ).estimated()
    except UnstableModelError:
        return trial
    begun = {}
    for name in names:
        values = trial[name].copy()
        values[0] = state[model.state_names.index(name)]
        begun[name] = values
    return trial.with_channels(begun)


class _Opening(NamedTuple):
    """The first part of a trial, by which its start is estimated."""

    trial: Trial  # without outliers
    inexact: dict[str, float]  # errors of first samples with noise, or derived
    measured: set[str]  # channels that were not derived


@lru_cache(maxsize=64)  # every model drawn sails the same trials
def _opening_of(trial: Trial, travel_time: float) -> _Opening:
    """The first part of a trial; `travel_time` to sail one ship length, s."""
    lengths = 1.5  # sailed while the start is estimated
    sound = trial.t <= trial.t[0] + lengths * travel_time
    inexact = {}
    for name in ("psi", *"uvr", *"xy"):
        if name not in trial:
            continue
        wrong = outliers(
            trial.t,
            trial[name],
            may_step=False,
        )
        if name in trial.derived or wrong[0] or is_noisy(trial.t, [trial[name]]):
            inexact[name] = math.inf if wrong[0] else _first_error(trial, name)
        if name not in trial.derived:
            sound[1:] &= ~wrong[1:]
    if np.count_nonzero(sound) < 3:  # of a boat that is logged slowly
        return _Opening(trial, {}, set())
    channels = {name: values[sound] for name, values in trial.channels.items()}
    measured = set(trial.channels) - trial.derived
    return _Opening(Trial(trial.t[sound], channels), inexact, measured)


def _first_error(trial: Trial, name: str) -> float:
    """Standard error of the first sample of a channel, SI units.

    That of a derivative is large at the end of a record. A sample far from the parabola
    through those that follow is wrong: it says nothing.
    """
    values = trial[name]
    if name in trial.derived:
        return 0.1 * float(np.ptp(values))
    noise = noise_level(trial.t, values)
    n_next = 8
    if len(values) <= n_next:
        return noise
    t = trial.t[1 : n_next + 1] - trial.t[0]
    parabola = np.polyfit(t, values[1 : n_next + 1], deg=2)
    # within five errors of the sample and of the parabola there
    is_sound = abs(float(values[0] - parabola[-1])) < 10.0 * noise
    return noise if is_sound else math.inf


class _Start:
    """The first state of a trial, as a model explains what follows it best."""

    def __init__(self, model: ShipModel, opening: _Opening, names: list[str]) -> None:
        self.model = model
        self.trial = opening.trial
        self.spreads = np.array([max(opening.inexact[name], 1e-9) for name in names])
        least = _least_errors(
            model,
            opening.measured,
        )
        #: errors that count as one at least
        self.floors = np.array(list(least.values()))
        self.measured = np.column_stack([self.trial[name] for name in least])
        place = model.state_names.index
        self.compared = [place(name) for name in least]
        self.places = [place(name) for name in names]
        #: a small change of each state that is estimated, shape (n_names, n_state)
        self.moves = np.zeros((len(names), len(model.state_names)))
        self.moves[range(len(names)), self.places] = _small_changes(model, names)

    def estimated(self) -> Floats:
        """State from which the model comes nearest, shape (n_state,).

        Three rounds of Gauss-Newton: what is simulated is nearly linear in its start.
        The first samples count by their errors, what follows by the errors that are
        left, of which neighbours say the same (`_independent`). These scales are
        renewed between the rounds, which `scipy.optimize.least_squares` would take for
        fits of their own, of more simulations each and other last digits.
        """
        logged = first_state(self.model, self.trial)
        start = logged
        scales = self.floors
        prior = np.diag(self.moves.sum(axis=1) / self.spreads)
        for _ in range(3):
            errors, *moved = self._errors(np.vstack([start, start + self.moves]))
            changes = [((other - errors) / scales).ravel() for other in moved]
            residuals = (errors / scales).ravel()
            by_start = np.vstack([np.array(changes).T, prior])
            beyond = (start - logged)[self.places] / self.spreads
            targets = np.concatenate([residuals, beyond])
            excess, *_ = np.linalg.lstsq(
                by_start,
                targets,
                rcond=1e-6,
            )
            start = start - excess @ self.moves
            left = errors - np.tensordot(
                excess,
                np.array(moved) - errors,
                axes=1,
            )
            sizes = np.maximum(np.sqrt(np.mean(left**2, axis=0)), self.floors)
            scales = sizes * np.sqrt(len(left) / _independent(left))
        return start

    def _errors(self, starts: Floats) -> Floats:
        """Simulated less measured channels after the first sample.

        Shape (n_starts, n_samples - 1, n_channels).
        """
        states = open_loop_states(self.model, self.trial, starts)
        errors = states[:, :, self.compared] - self.measured
        return np.asarray(errors[:, 1:])


def _small_changes(model: ShipModel, names: list[str]) -> list[float]:
    """Changes of states that matter little, SI units."""
    length, speed = model.particulars["length"], model.particulars["speed"]
    scale_of = {"psi": 1.0, "r": speed / length, "x": length, "y": length}
    return [1e-4 * scale_of.get(name, speed) for name in names]


def _independent(errors: Floats) -> Floats:
    """Number of independent errors of each channel, by those of neighbours.

    `errors`: shape (n_samples, n_channels).
    """
    squares = (
        np.sum(
            errors**2,
            axis=0,
        )
        + 1e-30
    )
    together = (
        np.sum(
            errors[1:] * errors[:-1],
            axis=0,
        )
        / squares
    )
    correlation = np.clip(together, 0.0, 0.999)
    share = (1.0 - correlation) / (1.0 + correlation)
    return np.asarray(np.maximum(len(errors) * share, 1.0))


def _least_errors(model: ShipModel, measured: set[str]) -> dict[str, float]:
    """Channels by which a start is estimated, and their least errors, SI units."""
    length, speed = model.particulars["length"], model.particulars["speed"]
    least = {"psi": np.radians(0.1)}
    if "r" in measured:
        least["r"] = 0.02 * speed / length
    if is_yaw_alone(model):
        return least
    if {"x", "y"} <= measured:
        return least | dict.fromkeys("xy", 0.005 * length)
    return least | dict.fromkeys("uv", 0.02 * speed)
