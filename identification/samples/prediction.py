"""Predictions of recorded trials, open loop from the measured rudder.

And the state from which they start where the record derived its velocities.
"""

from dataclasses import dataclass

import numpy as np

from shipgym import ShipModel, Trial, UnstableModelError
from shipgym.arrays import Floats
from shipgym.models.simulate import open_loop

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

    Initial velocities that were derived are estimated (`with_start`). None if the model
    runs away.
    """
    try:
        return open_loop(model, with_start(model, trial))
    except UnstableModelError:
        return None


def with_start(model: ShipModel, trial: Trial) -> Trial:
    """The trial with the first velocities estimated, as far as they were derived.

    Surge speed, sway speed and yaw rate: at the end of a record a derivative is least
    certain, the more so as the rudder moves there. Instead the start is that from which
    the model comes nearest to the measured heading and track (velocities where there is
    no track) over the first 1.5 ship lengths (output error with the initial state among
    the unknowns, Maine & Iliff 1985, NASA RP-1138). A model of yaw alone is compared
    with the heading, and only its yaw rate is estimated. A trial whose velocities were
    measured stays as it is.
    """
    derived = [name for name in "uvr" if name in trial.derived]
    names = [name for name in derived if name in model.state_names]
    if is_yaw_alone(model):
        names = [name for name in names if name == "r"]
    if not names or "psi" not in trial:
        return trial

    length = model.particulars["length"]
    speed = model.particulars["speed"]
    lengths = 1.5  # sailed while the start is estimated
    end = trial.t[0] + lengths * length / speed
    window = trial.t <= end
    if np.sum(window) < 3:
        return trial

    opening = _opening(model, trial, window, names)
    try:
        start = opening.estimated_start()
    except UnstableModelError:
        return trial
    return _begun(trial, names, start)


@dataclass(frozen=True, eq=False)
class _Opening:
    """The first part of a trial, and how a simulation of it is compared with it."""

    model: ShipModel
    trial: Trial
    names: list[str]  # channels whose first samples are estimated
    channels: tuple[str, ...]  # those compared
    #: errors that count as one at least, shape (n_channels, 1)
    floors: Floats

    def estimated_start(self) -> Floats:
        """First samples from which the model comes nearest, shape (n_names,).

        Three rounds of Gauss-Newton: what is simulated is nearly linear in its start.
        The scales are renewed between them, which `scipy.optimize.least_squares` would
        take for fits of their own, of more simulations each and other last digits.
        """
        start = np.array([self.trial[name][0] for name in self.names])
        scales = self.floors
        for _ in range(3):
            start = start + self._correction(start, scales)
            left = self._errors(start)
            mean_squares = np.mean(left**2, axis=1, keepdims=True)
            rms = np.sqrt(mean_squares)
            scales = np.maximum(rms, self.floors)
        return start

    def _correction(self, start: Floats, scales: Floats) -> Floats:
        """Step of Gauss-Newton from a start, by forward differences."""
        speed = self.model.particulars["speed"]
        rate = speed / self.model.particulars["length"]
        units = np.array([rate if name == "r" else speed for name in self.names])
        step = 1e-4

        errors = self._errors(start)
        slopes = []
        for move in np.diag(step * units):
            moved = self._errors(start + move)
            change = (moved - errors) / scales
            slopes.append(change.ravel())
        jacobian = np.array(slopes).T / step
        residuals = (errors / scales).ravel()

        excess, *_ = np.linalg.lstsq(jacobian, residuals, rcond=1e-6)
        return np.asarray(-units * excess)

    def _errors(self, start: Floats) -> Floats:
        """Simulated less measured channels after the first sample.

        Shape (n_channels, n_samples - 1).
        """
        trial = self.trial
        begun = _begun(trial, self.names, start)
        run = open_loop(self.model, begun)
        errors = []
        for name in self.channels:
            error = run[name] - trial[name]
            errors.append(error[1:])
        return np.array(errors)


def _opening(
    model: ShipModel, trial: Trial, window: Floats, names: list[str]
) -> _Opening:
    """Heading, and track or velocities, in the first part of a trial."""
    heading = np.radians(0.1)
    floors = {"psi": heading}
    measured = trial.channels.keys() - trial.derived
    if is_yaw_alone(model):
        pass
    elif {"x", "y"} <= measured:
        position = 0.005 * model.particulars["length"]
        floors |= {"x": position, "y": position}
    else:
        velocity = 0.02 * model.particulars["speed"]
        floors |= {"u": velocity, "v": velocity}

    samples = {name: values[window] for name, values in trial.channels.items()}
    return _Opening(
        model=model,
        trial=Trial(trial.t[window], samples),
        names=names,
        channels=tuple(floors),
        floors=np.array(list(floors.values()))[:, None],
    )


def _begun(trial: Trial, names: list[str], start: Floats) -> Trial:
    """The trial with other first samples of some channels."""
    channels = {}
    for name, first in zip(names, start, strict=True):
        values = trial[name].copy()
        values[0] = first
        channels[name] = values
    return trial.with_channels(channels)
