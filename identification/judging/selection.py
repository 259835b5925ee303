"""Which fit predicts what was left out best: likelihood of each, and the choice.

What a fit predicts of a trial that it did not know is compared with every channel that
was measured, piece by piece. The likelihood of a piece is that of normal errors of a
size of its own, at least the noise: a structure that is wrong misses the worst piece by
so much that the others would not count otherwise. Errors are taken to be correlated
over the time to sail one ship length.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from identification.arrays import root_mean_square
from identification.judging.hard_turn import hardest
from identification.models.guard import hard_turns, why_unphysical
from identification.models.sailed import least_scales
from identification.samples.prediction import predict
from identification.samples.preprocess import noise_level
from shipgym import ShipModel, Trial
from shipgym.trials.resampling import usual_step

#: Of few coefficients, those with the bias of the rudder last; by the simulated motion
#: of whole trials, in which a small bias shows, too.
RESPONSES = ("nomoto", "norrbin", "nomoto-bias", "norrbin-bias")
#: Ship lengths of a piece of a trial at least.
PIECE = 5.0


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
    scales: dict[str, float]  # errors by the noise, median of the pieces, by channel
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


def rank_by_likelihood(structure: str, method: str, fit: Any) -> RankedFit:
    """Rank of a fit, by what it predicts of its own trials, each left out in turn.

    It is one of the pipeline: of regression or of simulation.
    """
    trials = fit.problem.used
    groups = [np.array([place]) for place in range(len(trials))]
    largest = hardest(trials)  # what a hard turn is to trials of less rudder
    if largest.size:
        groups.append(largest)
    windy = any("wind_rdot" in trial for trial in trials)
    of_pieces = []
    sizes: dict[str, list[float]] = {}
    headings = []
    ran_away = 0
    for group in groups:
        model = fit.without(group.tolist())
        for trial in [trials[place] for place in group]:
            run = predict(model, trial)
            found = piece_errors(fit.model, trial, run, windy)
            of_pieces += np.mean(np.log([*found.values()]), axis=0).tolist()
            for name, own in found.items():
                sizes.setdefault(name, []).extend(own)
            if run is None:
                ran_away += 1
            elif "psi" in trial:
                headings.append(root_mean_square(run["psi"] - trial["psi"]))
    return RankedFit(
        structure=structure,
        method=method,
        coefficients=fit.free_coefficients,
        stable=fit.stable,
        ran_away=ran_away,
        loss=float(np.mean(of_pieces)),
        heading_deg=float(np.degrees(np.mean(headings))) if headings else None,
        scales={name: float(np.median(own)) for name, own in sizes.items()},
        of_pieces=tuple(of_pieces),
    )


def piece_errors(
    model: ShipModel, trial: Trial, run: Trial | None, windy: bool
) -> dict[str, list[float]]:
    """Errors of a prediction by the noise, at least 1, by channel and piece of a trial.

    Compared are position, speed, heading and yaw rate, as far as they were measured: a
    yaw rate that is the derivative of the heading says nothing new. What a structure
    has no equation of stays as it began, and its whole change is an error. A prediction
    that ran away is ten times as wrong as no change at all.

    What is left of the moment of the wind makes heading and track of a gentle zigzag
    drift, and hardly matters in a turn: in wind the heading is compared by how far the
    ship turns in one ship length, and the position not at all.
    """
    steps = max(round(model.travel_time / usual_step(trial.t)), 1)
    n_pieces = max(int(len(trial) / (PIECE * steps)), 1)
    length = model.particulars["length"]
    least = dict(zip("uvr", least_scales(model, "uvr"), strict=True))
    least |= {"psi": np.radians(0.1), "x": 0.01 * length, "y": 0.01 * length}
    measured = trial.channels.keys() - trial.derived
    names = [name for name in ("psi", "u") if name in trial]
    if "r" in trial and not ("r" in trial.derived and "psi" in trial):
        names.append("r")
    if {"x", "y"} <= measured and not windy:
        names += ["x", "y"]
    found = {}
    for name in names:
        values = trial[name]
        noise = max(noise_level(trial.t, values), least[name])
        error = np.full(len(trial), 10.0 * max(float(np.std(values)), noise))
        if run is not None:
            error = run[name] - values
            if windy and name == "psi" and steps < len(trial):
                error = error[steps:] - error[:-steps]
        pieces = np.array_split(error, n_pieces)
        found[name] = [max(root_mean_square(own) / noise, 1.0) for own in pieces]
    return found


def share_that_runs_away(model: ShipModel) -> float:
    """Share of the ships drawn from a model that run away in a hard turn."""
    if model.covariance is None:
        return 0.0
    draws = model.sample(40, 0)
    lost = 0
    for draw in draws:
        causes = (
            why_unphysical(draw, sail, least) for _, sail, least in hard_turns(draw)
        )
        lost += any(causes)
    return lost / len(draws)


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
    differences = np.subtract(
        fit.of_pieces,
        first.of_pieces,
    )
    freedom = max(len(differences) - 1, 1)
    by_chance = float(np.std(differences)) / np.sqrt(freedom)
    nothing = 0.02
    return bool(np.mean(differences) <= max(by_chance, nothing))
