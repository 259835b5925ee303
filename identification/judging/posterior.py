"""Posterior of the coefficients by sampling, draws of which the model keeps."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import emcee
import numpy as np

from identification.arrays import rounded
from identification.judging.model_error import FEWEST_TRIALS, model_error
from identification.judging.uncertainty import Uncertainty
from identification.models.sailed import (
    CoefficientPrior,
    Sailed,
    Segment,
    compared_channels,
    covariance_of,
    cut,
)
from identification.progress import counted
from identification.samples.prediction import with_start
from shipgym import InputError, ShipModel, Trial
from shipgym.arrays import Floats, Integers


class Mode(NamedTuple):
    """The most probable point, and the Gauss-Newton covariance there."""

    point: Floats
    covariance: Floats


@dataclass(frozen=True, eq=False)
class CoarsenedPosterior:
    """Prior times the likelihood of whole trials to a power."""

    trials: Sailed
    scales: Floats  # of the errors by channel
    power: float

    def errors(self, points: Floats) -> Floats:
        """Errors whose squares are twice minus the log likelihood by its power.

        Shape (n_rows, n_points); not finite where a ship is lost.
        """
        root = np.sqrt(self.power)
        with np.errstate(invalid="ignore", over="ignore"):
            errors = root * self.trials.errors(points) / self.scales[:, None]
        return np.asarray(errors.reshape(-1, len(points)))

    def log_density(self, points: Floats) -> Floats:
        """Logarithm of the density but for a constant, shape (n_points,)."""
        errors = self.errors(points)
        with np.errstate(invalid="ignore", over="ignore"):
            misfits = np.einsum("ij,ij->j", errors, errors)
        squares = misfits + np.sum(points**2, axis=1)
        return np.asarray(-0.5 * np.nan_to_num(squares, nan=np.inf))

    def mode(self, start: Floats, which: Integers | None = None) -> Mode:
        """The most probable point; `which` are places of the parts that count."""
        fit = self.trials.most_probable(
            start,
            self.scales,
            strength=1.0 / np.sqrt(self.power),
            tolerance=1e-4,
            which=which,
        )
        of_data = fit.jac[: -len(start)]
        return Mode(fit.x, covariance_of(np.sqrt(self.power) * of_data))

    def model(self, mode: Mode) -> ShipModel:
        """The model of a mode, with its covariance."""
        return self.trials.model(mode.point, mode.covariance)


#: From points, shape (n_points, n_parameters), to the logarithm of their density, shape
#: (n_points,); minus infinity where it is 0.
LogDensity = Callable[[Floats], Floats]


class Mixing(NamedTuple):
    """Diagnostics of walkers, each of the parameter that mixed worst."""

    steps: int  # after the warm-up
    #: by the scatter of the walkers' means, which is that of the points for walkers
    #: that never moved
    effective_samples: float
    drift: float  # of the mean from the first half to the second, standard deviations

    @property
    def is_enough(self) -> bool:
        """Whether the points can stand for the density."""
        return self.effective_samples > 150.0 and self.drift < 0.5


def sample(log_density: LogDensity, start: Floats, steps: int) -> Floats:
    """Points of a density from steps of walkers, after half as many to warm up.

    Shape (n_steps, n_walkers, n_parameters). `start` are the walkers, shape (n_walkers,
    n_parameters), at least twice as many as parameters. A quarter of the moves is
    differential evolution (ter Braak 2006, Statistics and Computing 16), the others are
    `autoregression` about the points of the last stage of the warm-up.
    """
    walkers, near = start, start
    state = np.random.RandomState(0).get_state()
    for share in (0.1, 0.15, 0.25, 1.0):
        n_steps = max(int(share * steps), 2)
        moves = [(emcee.moves.DEMove(), 0.25), (autoregression(near), 0.75)]
        sampler = emcee.EnsembleSampler(
            *start.shape, log_density, moves=moves, vectorize=True
        )
        last = emcee.State(
            walkers,
            random_state=state,
        )
        parts = [len(part) for part in np.array_split(range(n_steps), min(10, n_steps))]
        for n_part in counted("posterior", parts):
            last = sampler.run_mcmc(last, n_part)
        walkers, state = last.coords, last.random_state
        near = sampler.get_chain(discard=n_steps // 2, flat=True)
    found: Floats = sampler.get_chain()
    return found


def autoregression(points: Floats) -> Any:
    """Move that a normal distribution of the mean and scatter of points always takes.

    The preconditioned Crank-Nicolson proposal (Cotter et al. 2013, Statistical Science
    28, eq. 4.7) of random length; the distribution is a little wider than the points.
    """
    n_parameters = points.shape[1]
    mean = points.mean(axis=0)
    covariance = np.atleast_2d(np.cov(points.T))
    least = 1e-12 * np.trace(covariance) / n_parameters + 1e-300
    root = np.linalg.cholesky(1.2 * covariance + least * np.eye(n_parameters))

    def log_normal(at: Floats) -> Floats:
        standard = np.linalg.solve(root, (at - mean).T)
        return np.asarray(-0.5 * np.sum(standard**2, axis=0))

    def propose(walkers: Floats, rng: Any) -> tuple[Floats, Floats]:
        length = np.sqrt(rng.random_sample((len(walkers), 1)))
        kept = np.sqrt(1.0 - length**2) * (walkers - mean)
        moved = mean + kept + length * rng.standard_normal(walkers.shape) @ root.T
        return moved, log_normal(walkers) - log_normal(moved)

    return emcee.moves.MHMove(propose)


def mixing_of(points: Floats) -> Mixing:
    """Diagnostics of points, shape (n_steps, n_walkers, n_parameters)."""
    n_steps, n_walkers, _ = points.shape
    variance = np.maximum(
        points.var(axis=(0, 1)),
        np.finfo(float).tiny,
    )
    of_means = points.mean(axis=0).var(axis=0, ddof=1)
    half = n_steps // 2
    drift = points[half:].mean(axis=(0, 1)) - points[:half].mean(axis=(0, 1))
    return Mixing(
        steps=n_steps,
        effective_samples=n_walkers * float((variance / of_means).min()),
        drift=float((np.abs(drift) / np.sqrt(variance)).max()),
    )


def table_prior(model: ShipModel) -> CoefficientPrior:
    """Weak prior of a table: its estimate, three times as uncertain as estimated.

    Directions that the estimate leaves no uncertainty, such as those that a truncation
    dropped, stay as they are.
    """
    widening = 3.0
    mean = np.array(list(model.coefficients.values()))
    covariance = np.asarray(model.covariance)
    deviations = np.sqrt(np.diag(covariance))
    units = np.where(
        deviations > 0.0,
        deviations,
        1.0,
    )
    correlations = covariance / np.outer(units, units)
    values, vectors = np.linalg.eigh(correlations)
    kept = values > 1e-9 * values.max()
    root = units[:, None] * vectors[:, kept] * np.sqrt(values[kept])
    source = f"{widening:g} times the standard errors about the least-squares estimate"
    return CoefficientPrior(source, mean, widening * root)


def with_posterior(
    model: ShipModel,
    trials: Sequence[Trial],
    prior: CoefficientPrior,
    asked: Uncertainty,
) -> tuple[ShipModel, dict[str, Any]]:
    """The model with draws of its posterior, and a report for the provenance.

    `model`, with the covariance that it keeps where the walkers do not mix, was
    identified from `trials`. Raises InputError for too few trials.
    """
    if len(trials) < FEWEST_TRIALS:
        raise InputError(
            f"uncertainty: expected at least {FEWEST_TRIALS} trials to fit for a"
            f" posterior, so that one left out tells something, got {len(trials)}; add"
            " trials, or choose 'analytic'"
        )
    bare = replace(model, covariance=None, draws=None)
    channels = compared_channels(bare, trials)
    step = 0.2  # ship lengths, from sample to sample and of the integration
    whole_trials = 1e9  # lengths of a part at most
    parts = cut(trials, bare, channels, whole_trials, False, interval=step, coarse=True)
    parts = [_begun(part, bare, trials[part.trial]) for part in parts]
    whole = Sailed(bare, channels, prior, parts)
    start = _point_of(model, prior)
    scales = whole.scales(start)
    if not np.isfinite(scales).all():
        remark = (
            "posterior: not sampled, the model runs away in a trial; covariance kept"
        )
        return model, {"kept": False, "remarks": [remark]}

    by_scatter = CoarsenedPosterior(whole, scales, power=1.0)
    mode = by_scatter.mode(start)
    by_scatter = replace(by_scatter, scales=whole.scales(mode.point))
    posterior, error = coarsened(by_scatter, trials, start)

    chains = _chains(posterior, start, asked)
    mixing = mixing_of(chains)
    remarks = []
    if not mixing.is_enough:
        remarks.append(
            f"posterior: the walkers did not mix in {mixing.steps} steps"
            f" ({mixing.effective_samples:.0f} effective samples, drift"
            f" {mixing.drift:.2f}); the covariance is kept: try uncertainty.steps ="
            f" {4 * mixing.steps}"
        )
    else:
        points = chains.reshape(-1, prior.n_parameters)
        model = _with_draws(model, prior, points)
    return model, {
        "kept": mixing.is_enough,
        "prior": prior.source,
        "power": posterior.power,
        "left_out": error,
        **mixing._asdict(),
        "remarks": remarks,
    }


def _begun(part: Segment, model: ShipModel, trial: Trial) -> Segment:
    """A part of a trial that begins as the predictions of the trial do."""
    if part.inputs[0, 0] > trial.t[0]:
        return part
    begun = with_start(model, trial)
    start = part.start.copy()
    for column, name in enumerate(model.state_names):
        if name in ("psi", *"uvr"):
            start[column] = begun[name][0]
    return part._replace(
        start=start,
    )


def _point_of(model: ShipModel, prior: CoefficientPrior) -> Floats:
    """The point of a model's coefficients."""
    off = np.array(list(model.coefficients.values())) - prior.mean
    units = np.where(prior.deviations > 0.0, prior.deviations, 1.0)
    point, *_ = np.linalg.lstsq(
        prior.root / units[:, None],
        off / units,
        rcond=1e-12,
    )
    return np.asarray(point)


def coarsened(
    posterior: CoarsenedPosterior, trials: Sequence[Trial], start: Floats
) -> tuple[CoarsenedPosterior, dict[str, Any]]:
    """The posterior of the power at which trials left out have errors of size one.

    Errors are those of `model_error`, of modes and their Gauss-Newton covariances. Its
    last report is returned too.
    """
    of_parts = posterior.trials.of_trials
    error = {}
    slope = 0.5  # of the factor by the power, logarithms: of normal distributions
    earlier = None
    for _ in range(3):
        own = posterior.mode(start)
        left_out = []
        for trial in range(len(trials)):
            others = np.flatnonzero(of_parts != trial)
            mode = posterior.mode(own.point, others)
            left_out.append(posterior.model(mode))
        error = model_error(posterior.model(own), left_out, trials)
        factor = error["factor"]
        near_enough = 1.1
        if factor <= near_enough:
            break
        logs = float(np.log(posterior.power)), float(np.log(factor))
        if earlier is not None:
            by_secant = (logs[1] - earlier[1]) / (logs[0] - earlier[0])
            slope = min(max(by_secant, 0.1), 0.5)
        earlier = logs
        posterior = replace(posterior, power=float(np.exp(logs[0] - logs[1] / slope)))
    return posterior, error


def _chains(posterior: CoarsenedPosterior, start: Floats, asked: Uncertainty) -> Floats:
    """Points that walkers went through, shape (n_steps, n_walkers, n_parameters)."""
    mode = posterior.mode(start)
    axes = np.linalg.cholesky(mode.covariance)

    def points(coordinates: Floats) -> Floats:
        """Of nearly standard normal coordinates."""
        return mode.point + coordinates @ axes.T

    def log_density(coordinates: Floats) -> Floats:
        return posterior.log_density(points(coordinates))

    rng = np.random.default_rng(0)
    walkers = _walkers(log_density, len(start), rng)
    return points(sample(log_density, walkers, asked.steps))


def _with_draws(model: ShipModel, prior: CoefficientPrior, points: Floats) -> ShipModel:
    """The model with the covariance of points of the posterior, and some of them."""
    n_draws = 256
    rng = np.random.default_rng(0)
    chosen = rng.choice(len(points), n_draws, replace=False)
    chosen.sort()
    of_points = np.atleast_2d(np.cov(points.T))
    return replace(
        model,
        covariance=prior.covariance(of_points),
        draws=rounded(prior.coefficients(points[chosen])),
    )


def _walkers(
    log_density: LogDensity, n_parameters: int, rng: np.random.Generator
) -> Floats:
    """Walkers of a density that is nearly standard normal.

    They are chosen among five times as many normal points by what these weigh in the
    density (sampling importance resampling, Rubin 1988).
    """
    n_walkers = 128 * math.ceil(2 * n_parameters / 128)
    points = rng.standard_normal((5 * n_walkers, n_parameters))
    points[0] = 0.0  # the mode
    log_weights = log_density(points) + 0.5 * np.sum(
        points**2,
        axis=1,
    )
    # the largest of log weights and Gumbel numbers are a draw without replacement
    order = np.argsort(log_weights + rng.gumbel(size=len(points)))
    chosen = points[order[-n_walkers:]]
    chosen[~np.isfinite(log_density(chosen))] *= 0.01
    return chosen
