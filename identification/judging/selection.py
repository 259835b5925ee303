"""Which fit predicts what was left out best: likelihood of each, and the choice.

What a fit predicts of a trial that it did not know is compared with every channel that
was measured, piece by piece. The likelihood of a piece is that of normal errors of a
size of its own, at least the noise: a structure that is wrong misses the worst piece by
so much that the others would not count otherwise. Errors are taken to be correlated
over the time to sail one ship length.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Protocol

import numpy as np

from identification.arrays import root_mean_square
from identification.judging.extrapolation import largest_rudders
from identification.models.sailed import least_scales
from identification.samples.prediction import predict
from identification.samples.preprocess import noise_level
from shipgym import ShipModel, Trial
from shipgym.arrays import Floats, Integers
from shipgym.trials.resampling import usual_step

#: Of few coefficients, those with the bias of the rudder last; by the simulated motion
#: of whole trials, in which a small bias shows, too.
RESPONSES = ("nomoto", "norrbin", "nomoto-bias", "norrbin-bias")
#: Ship lengths of a piece of a trial at least.
PIECE = 5.0

#: Metrics of trials by their names, see `prediction.trial_metrics`.
Metrics = Mapping[str, Mapping[str, Any]]


class Fitted(Protocol):
    """A structure fitted to trials."""

    @property
    def problem(self) -> Any:
        """The problem that it was fitted to."""

    @property
    def model(self) -> ShipModel:
        """The model of all trials."""

    @property
    def free_coefficients(self) -> int:
        """Number of coefficients that the trials determine."""

    @property
    def stable(self) -> bool:
        """Whether it passed the guard."""

    def without(self, trials: Sequence[int]) -> ShipModel:
        """The model of the other trials, by their places."""


@dataclass(frozen=True)
class RankedFit:
    """How well a structure and a method predict what was left out."""

    structure: str  # of its model
    method: str  # its name
    coefficients: int  # their number
    stable: bool  # whether its model passed the guard, a hard turn among it
    ran_away: int  # predictions of trials left out that ran away
    #: logarithm of the likelihood of errors of the size of the noise over that of its
    #: own, mean over channels and pieces, for each ship length: 0 for perfect
    loss: float
    #: root mean square error, mean over the trials on which it did not run away
    heading_deg: float | None
    yaw_rate_deg_s: float | None
    scales: dict[str, float]  # errors by the noise, median of the pieces, by channel
    losses: dict[str, float]  # mean of each trial
    of_pieces: tuple[float, ...] = field(repr=False)  # losses

    @property
    def rank(self) -> tuple[bool, float]:
        """Sort key: first those that are stable, then by the loss."""
        return not self.stable, self.loss

    def plain(self) -> dict[str, Any]:
        """The fit for the provenance."""
        told = asdict(self)
        del told["of_pieces"]
        return told


def fit_name(structure: str, method: str) -> str:
    """A structure fitted by a method, in words."""
    return f"{structure} by {method}"


def rank_by_likelihood(structure: str, method: str, fit: Fitted) -> RankedFit:
    """Rank of a fit, by what it predicts of its own trials, each left out in turn."""
    trials = fit.problem.used
    runs = list[tuple[Trial, Trial | None]]()
    for group in _groups(trials):
        model = fit.without(group.tolist())
        runs += [(trials[place], predict(model, trials[place])) for place in group]

    windy = in_wind(trials)
    losses: dict[str, list[float]] = {trial.name: [] for trial in trials}
    sizes = list[dict[str, float]]()
    for trial, run in runs:
        errors = Errors(fit.model, trial, windy)
        for piece in errors.pieces():
            found = errors.sizes(run, piece)
            losses[trial.name].append(float(np.mean(np.log(list(found.values())))))
            sizes.append(found)
    of_pieces = [loss for found in losses.values() for loss in found]
    known = [(trial, run) for trial, run in runs if run is not None]
    scales = {
        name: float(np.median([one[name] for one in sizes if name in one]))
        for name in dict.fromkeys(name for one in sizes for name in one)
    }
    return RankedFit(
        structure=structure,
        method=method,
        coefficients=fit.free_coefficients,
        stable=fit.stable,
        ran_away=len(runs) - len(known),
        loss=float(np.mean(of_pieces)),
        heading_deg=_mean_error_deg("psi", known),
        yaw_rate_deg_s=_mean_error_deg("r", known),
        scales=scales,
        losses={name: float(np.mean(found)) for name, found in losses.items()},
        of_pieces=tuple(of_pieces),
    )


def _groups(trials: Sequence[Trial]) -> list[Integers]:
    """Places of the trials that are left out together: each, and the largest rudders.

    These are what a hard turn is to trials of less rudder.
    """
    groups = [np.array([place]) for place in range(len(trials))]
    largest = largest_rudders(trials)
    if largest.size:
        groups.append(largest)
    return groups


def _mean_error_deg(name: str, runs: Sequence[tuple[Trial, Trial]]) -> float | None:
    """Error of a channel in deg, mean over the trials that have it."""
    errors = [
        root_mean_square(run[name] - trial[name])
        for trial, run in runs
        if name in trial
    ]
    return float(np.degrees(np.mean(errors))) if errors else None


def in_wind(trials: Sequence[Trial]) -> bool:
    """Return True where wind was logged and its force is known."""
    return any("wind_rdot" in trial for trial in trials)


class Errors:
    """Errors of predictions of a trial by their noise.

    Compared are position, speed, heading and yaw rate, as far as they were measured: a
    yaw rate that is the derivative of the heading says nothing new. What a structure
    has no equation of stays as it began, and its whole change is an error.

    What is left of the moment of the wind makes heading and track of a gentle zigzag
    drift, and hardly matters in a turn: in wind the heading is compared by how far the
    ship turns in one ship length, and the position not at all.
    """

    def __init__(self, model: ShipModel, trial: Trial, windy: bool) -> None:
        self.trial = trial
        self.steps = max(round(model.travel_time / usual_step(trial.t)), 1)
        measured = trial.channels.keys() - trial.derived
        names = [name for name in ("psi", "r", "u") if name in trial]
        if "r" in trial.derived and "psi" in names:
            names.remove("r")
        if {"x", "y"} <= measured and not windy:
            names += ["x", "y"]
        self.lag = min(self.steps, len(trial) - 1) if windy else 0
        length = model.particulars["length"]
        least = dict(zip("uvr", least_scales(model, "uvr"), strict=True))
        least |= {"psi": np.radians(0.1), "x": 0.01 * length, "y": 0.01 * length}
        self.noises = {
            name: max(noise_level(trial.t, trial[name]), least[name]) for name in names
        }

    def pieces(self) -> list[slice]:
        """Samples of pieces of the trial of some ship lengths."""
        n_pieces = max(int(len(self.trial) / (PIECE * self.steps)), 1)
        edges = np.linspace(0, len(self.trial), n_pieces + 1).astype(int)
        return [slice(*edges[k : k + 2]) for k in range(n_pieces)]

    def sizes(self, run: Trial | None, piece: slice) -> dict[str, float]:
        """Root mean square errors in a piece by their noise, at least 1, by channel.

        A prediction that ran away is ten times as wrong as no change at all.
        """
        found = {}
        for name, noise in self.noises.items():
            values = self.trial[name]
            if run is None:
                error = 10.0 * max(float(np.std(values)), noise)
            else:
                error = root_mean_square(self._error(name, run[name] - values, piece))
            found[name] = max(error / noise, 1.0)
        return found

    def _error(self, name: str, error: Floats, piece: slice) -> Floats:
        if name != "psi" or not self.lag:
            return error[piece]
        change = error[self.lag :] - error[: -self.lag]
        within = change[piece]
        return within if len(within) else change


def simplest(ranked: Sequence[RankedFit]) -> RankedFit:
    """The fit of fewest coefficients whose loss differs from the first's by chance.

    By one standard error of their difference, piece by piece. 0.02 are nothing. None of
    those that are not stable while another is.
    """
    first = ranked[0]
    as_good = [fit for fit in ranked if _differs_by_chance(fit, first)]
    return min(as_good, key=lambda fit: (fit.coefficients, fit.loss), default=first)


def _differs_by_chance(fit: RankedFit, first: RankedFit) -> bool:
    """Tell whether a loss exceeds the first's by no more than chance."""
    if fit.stable != first.stable:
        return False
    differences = np.subtract(fit.of_pieces, first.of_pieces)
    by_chance = float(np.std(differences)) / np.sqrt(max(len(differences) - 1, 1))
    nothing = 0.02
    return bool(np.mean(differences) <= max(by_chance, nothing))
