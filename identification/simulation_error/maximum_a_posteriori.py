"""The coefficients of the MMG form that trials and prior make most probable, by simulation error in segments.

The cost is that of the simulated states in segments back to back, each started from the smoothed measurement,
by their own scatter, plus the squared distance from the prior (Maine & Iliff 1985, NASA RP-1138, 2.5, output
error with prior). How much narrower the prior is made, the trials decide, each predicted from the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from identification.simulation_error.mmg_prior import MMGPrior
from identification.simulation_error.segments import Segment, averaged, compared_channels, cut
from shipgym.engine.loops import ship_loop
from shipgym.engine.motion import Ship
from shipgym.engine.records import LANES
from shipgym.ships import ShipModel
from shipgym.ships.mmg import IDENTIFIED
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]

SEGMENT_LENGTHS = 1.7  # ship lengths at service speed
CORRELATED = 1.0  # ship lengths, over which errors are one error
FLOORS = {"u": 0.0017, "v": 0.0017, "r": 0.0021, "psi": np.radians(0.1)}  # by U0, U0, U0 / L, 1
STRENGTHS = (1.0, 2.0, 3.0)  # of the prior: its deviations divided by it
MARGIN = 0.1  # by which the error held out may exceed the least for a stronger prior
ROUNDS = 3  # of fits, between which the scales of the residuals are renewed
STEP = 1e-4  # of finite differences, standard deviations of the prior
MOST_GROUPS, PIECES = 5, 3  # groups of trials held out; pieces of a single trial
LARGEST = 1e3  # residual of a ship that runs away, in scales


@dataclass(frozen=True, eq=False)
class Estimate:
    """What a fit found."""

    z: Floats  # coefficients in standard deviations of the prior from its mean, shape (41,)
    scales: Floats  # of the residuals by channel
    covariance: Floats  # of z, Gauss-Newton
    evaluations: int


@dataclass(frozen=True, eq=False)
class Posterior:
    """The model of greatest probability and its covariance."""

    model: ShipModel
    report: dict[str, Any]  # for the provenance


def maximum_a_posteriori(
    blank: ShipModel, trials: Sequence[Trial], prior: MMGPrior, strength: float | None = None
) -> Posterior:
    """Fit the MMG form to trials.

    Parameters
    ----------
    blank : ShipModel
        Of structure `mmg`, complete but for its coefficients.
    trials : sequence of Trial
        With u, v, r, delta, n, and psi where known.
    prior : MMGPrior
        Before the trials.
    strength : float, optional
        Of the prior, by which its standard deviations are divided; by default the strongest of 1, 2, 3 whose
        error, each trial predicted from the others, is within a tenth of the least.
    """
    problem = _Problem(blank, trials, prior)
    everything = np.arange(len(problem.segments))
    estimates: dict[float, Estimate] = {}
    errors: dict[float, float] = {}
    factors: dict[float, float] = {}
    start, evaluations = np.zeros(len(IDENTIFIED)), 0
    for value in STRENGTHS if strength is None else (strength,):
        found = problem.solve(start, everything, value)
        estimates[value], start = found, found.z
        errors[value], factors[value] = problem.held_out(found, value, estimates[min(estimates)].scales)
        evaluations += found.evaluations
    least = min(errors.values())
    chosen = max(value for value, error in errors.items() if error <= (1.0 + MARGIN) * least)
    best = estimates[chosen]
    report = {
        "prior": prior.source,
        "prior_strength": chosen,
        "errors_held_out": {f"{value:g}": error for value, error in errors.items()},
        "covariance_factor": factors[chosen],
        "segments": len(problem.segments),
        "evaluations": evaluations,
        "residual_rms": dict(zip(problem.channels, best.scales.tolist(), strict=True)),
        "deviations_from_prior": dict(zip(IDENTIFIED, best.z.round(3).tolist(), strict=True)),
    }
    covariance = np.zeros((len(prior.mean),) * 2)
    inner = slice(len(IDENTIFIED))
    covariance[inner, inner] = factors[chosen] * best.covariance * np.outer(prior.deviation, prior.deviation)
    return Posterior(replace(problem.model(best.z), covariance=covariance), report)


class _Problem:
    """Segments, and what ships of given coefficients do in them."""

    def __init__(self, blank: ShipModel, trials: Sequence[Trial], prior: MMGPrior) -> None:
        self.blank, self.prior = replace(blank, coefficients=prior.mean), prior
        self.mean = np.array([prior.mean[name] for name in IDENTIFIED])
        self.numbers = self.blank.ship_numbers()
        self.loop = ship_loop(self.blank.vessel, "segments")
        self.channels = compared_channels(blank, trials)
        self.columns = [blank.state_names.index(name) for name in self.channels]
        ship = blank.particulars
        self.travel = ship["length"] / ship["speed"]
        units = {"u": ship["speed"], "v": ship["speed"], "r": 1.0 / self.travel, "psi": 1.0}
        self.floors = np.array([FLOORS[name] * units[name] for name in self.channels])
        self.segments = cut(trials, self.blank, self.channels, SEGMENT_LENGTHS, False)
        self.groups = _groups(self.segments)

    def model(self, z: Floats) -> ShipModel:
        """The model of some coefficients."""
        values = dict(zip(IDENTIFIED, (self.mean + z * self.prior.deviation).tolist(), strict=True))
        return replace(self.blank, coefficients=self.prior.mean | values)

    def at(self, z: Floats, which: Sequence[int] | Floats) -> tuple[Floats, Floats]:
        """Errors of the simulated channels, averaged over blocks, and their slopes, of some segments.

        Each times the root of the share that its block has of the time over which errors are one error;
        shapes (n_blocks, n_channels) and (n_blocks, n_channels, 41).
        """
        first = len(Ship._fields)
        ships = np.repeat(self.numbers, LANES).reshape(-1, LANES)
        n = len(IDENTIFIED)
        ships[first : first + n] = (self.mean + z * self.prior.deviation)[:, None]
        ships[first + np.arange(n), 1 + np.arange(n)] += STEP * self.prior.deviation
        found = [self._sailed(self.segments[int(k)], ships.ravel()) for k in which]
        return np.concatenate([e for e, _ in found]), np.concatenate([s for _, s in found])

    def _sailed(self, segment: Segment, ships: Floats) -> tuple[Floats, Floats]:
        n = len(IDENTIFIED)
        state = np.repeat(segment.start, LANES)
        out = np.empty((len(segment.measured), len(state)))
        self.loop(state, ships, np.zeros(LANES), segment.inputs, segment.samples, out)
        lanes = out.reshape(len(out), -1, LANES)[:, self.columns, : n + 1]
        counts = np.diff(segment.blocks, append=len(segment.measured))
        means = averaged(lanes - segment.measured[:, :, None], segment.blocks, counts)
        ends = np.append(segment.times[1:], segment.inputs[-1, 0])
        share = np.minimum((ends - segment.times) / (CORRELATED * self.travel), 1.0)
        means = means * np.sqrt(share)[:, None, None]
        with np.errstate(invalid="ignore", over="ignore"):  # of ships that run away
            slopes = (means[:, :, 1:] - means[:, :, :1]) / STEP
        return means[:, :, 0], np.nan_to_num(slopes, posinf=0.0, neginf=0.0)

    def scales(self, errors: Floats, which: Sequence[int] | Floats) -> Floats:
        """Root mean square of the errors by channel, not below the floors."""
        shares = sum(self._weight(self.segments[int(k)]) for k in which)
        with np.errstate(invalid="ignore", over="ignore"):
            rms = np.sqrt(np.sum(errors**2, axis=0) / shares)
        return np.maximum(np.where(np.isfinite(rms), rms, 1e2 * self.floors), self.floors)

    def _weight(self, segment: Segment) -> float:
        return float(segment.inputs[-1, 0] - segment.times[0]) / (CORRELATED * self.travel)

    def solve(
        self, start: Floats, which: Sequence[int] | Floats, strength: float, scales: Floats | None = None
    ) -> Estimate:
        """Fit some segments; without given `scales` these are renewed and the fit repeated."""
        z, evaluations, rounds = start, 0, 1 if scales is not None else ROUNDS
        given = scales
        pull = strength * np.eye(len(z))
        for _ in range(rounds):
            scales = self.scales(self.at(z, which)[0], which) if given is None else given
            shots = _Shots(self, which, scales, pull)
            found = least_squares(
                shots.residuals, z, shots.jacobian, method="trf", ftol=1e-4, xtol=1e-4, max_nfev=30
            )
            z, evaluations = found.x, evaluations + found.nfev
        jacobian = shots.jacobian(z)
        assert scales is not None
        return Estimate(z, scales, np.linalg.inv(jacobian.T @ jacobian), evaluations)

    def held_out(self, whole: Estimate, strength: float, scales: Floats) -> tuple[float, float]:
        """Error of each group of segments by a fit of the others, and the factor on the covariance.

        The error is in the scales given; the factor makes the errors held out, by those that the covariance
        of the others' fit and the scatter of the residuals lead to expect, one on average; at least 1.
        """
        errors, excess, expected = [], 0.0, 0.0
        for group in np.unique(self.groups):
            rest, held = (np.flatnonzero(self.groups != group), np.flatnonzero(self.groups == group))
            fit = self.solve(whole.z, rest, strength, whole.scales)
            error, slopes = self.at(fit.z, held)
            error = np.clip(np.nan_to_num(error / scales, nan=LARGEST), -LARGEST, LARGEST)
            ratio = scales / whole.scales
            slopes = slopes / whole.scales[:, None]
            weight = sum(self._weight(self.segments[k]) for k in held)
            errors.append(np.sum(error**2) / (weight * len(scales)))
            excess += float(np.sum((error * ratio) ** 2)) - weight * len(scales)
            expected += float(np.einsum("bci,ij,bcj->", slopes, fit.covariance, slopes))
        return float(np.sqrt(np.mean(errors))), max(excess / max(expected, 1e-12), 1.0)


@dataclass(eq=False)
class _Shots:
    """The least-squares problem of some segments; the last simulation is kept."""

    problem: _Problem
    which: Sequence[int] | Floats
    scales: Floats
    pull: Floats
    kept: tuple[bytes, Floats, Floats] | None = None

    def at(self, z: Floats) -> tuple[Floats, Floats]:
        key = z.tobytes()
        if self.kept is None or self.kept[0] != key:
            errors, slopes = self.problem.at(z, self.which)
            scaled = np.clip(np.nan_to_num(errors / self.scales, nan=LARGEST), -LARGEST, LARGEST)
            slopes = slopes / self.scales[:, None]
            self.kept = key, scaled.ravel(), slopes.reshape(scaled.size, -1)
        return self.kept[1], self.kept[2]

    def residuals(self, z: Floats) -> Floats:
        return np.concatenate([self.at(z)[0], self.pull @ z])

    def jacobian(self, z: Floats) -> Floats:
        return np.vstack([self.at(z)[1], self.pull])


def _groups(segments: Sequence[Segment]) -> NDArray[np.int64]:
    """Which segments are held out together: of a trial, of every fifth one, or a third of a single one."""
    trial = np.array([segment.trial for segment in segments])
    if trial.max() == trial.min():
        return np.arange(len(trial)) * PIECES // len(trial)
    return trial % MOST_GROUPS
