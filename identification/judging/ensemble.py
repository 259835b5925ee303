"""Sampling of a probability density by an ensemble of walkers, without gradients.

Each half of the walkers moves by the other half, all of them at once: a density that
takes many points in one call is evaluated for half the walkers at a time.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from identification.progress import counted
from shipgym.arrays import Floats, Integers

#: From points, shape (n_points, n_parameters), to the logarithm of their density, shape
#: (n_points,); minus infinity where it is 0.
LogDensity = Callable[[Floats], Floats]


@dataclass(frozen=True, eq=False)
class Chains:
    """Points that the walkers went through after the warm-up."""

    points: Floats  # shape (n_steps, n_walkers, n_parameters)
    acceptance: float  # share of the moves that were taken

    @property
    def flat(self) -> Floats:
        """All points, shape (n_steps * n_walkers, n_parameters)."""
        return self.points.reshape(-1, self.points.shape[2])


@dataclass(frozen=True, eq=False)
class Proposal:
    """Points to move to, and the logarithms that detailed balance adds for each."""

    points: Floats  # shape (n_walkers, n_parameters)
    log_factors: Floats  # shape (n_walkers,)


@dataclass(frozen=True, eq=False)
class Normal:
    """Normal distribution that a walker's move leaves as it is."""

    mean: Floats
    root: Floats  # square root of the covariance, shape (n_parameters, n_parameters)

    @classmethod
    def of(cls, points: Floats) -> "Normal":
        """The distribution with mean and covariance of points, a little wider."""
        n_parameters = points.shape[1]
        covariance = np.atleast_2d(np.cov(points.T))
        least = 1e-12 * np.trace(covariance) / n_parameters + 1e-300
        widened = 1.2 * covariance + least * np.eye(n_parameters)
        return cls(points.mean(axis=0), np.linalg.cholesky(widened))

    def log_density(self, points: Floats) -> Floats:
        """Logarithm of the density but for a constant, shape (n_points,)."""
        standard = np.linalg.solve(self.root, (points - self.mean).T)
        return np.asarray(-0.5 * np.sum(standard**2, axis=0))


def stretch(walkers: Floats, others: Floats, rng: np.random.Generator) -> Proposal:
    """Stretch move (Goodman & Weare 2010, Comm. App. Math. Comp. Sci. 5, eq. 7)."""
    n_walkers, n_parameters = walkers.shape
    largest = 2.0
    share = np.asarray(rng.random(n_walkers))
    # density 1 / sqrt(z) between 1 / largest and largest
    z: Floats = (1.0 + share * (largest - 1.0)) ** 2 / largest
    partners = others[rng.integers(len(others), size=n_walkers)]
    points = partners + z[:, None] * (walkers - partners)
    return Proposal(points, (n_parameters - 1) * np.log(z))


def evolve(walkers: Floats, others: Floats, rng: np.random.Generator) -> Proposal:
    """Differential evolution (ter Braak 2006, Statistics and Computing 16, eq. 2).

    A tenth of the moves is by the whole difference of two others, which leads from one
    mode to another.
    """
    n_walkers, n_parameters = walkers.shape
    pairs = _pairs(len(others), n_walkers, rng)
    difference = others[pairs[:, 0]] - others[pairs[:, 1]]
    usual = 2.38 / np.sqrt(2.0 * n_parameters)
    whole = rng.random(n_walkers) < 0.1
    gamma = np.where(whole, 1.0, usual)
    jitter = 1.0 + 1e-2 * rng.standard_normal(n_walkers)
    step = (gamma * jitter)[:, None] * difference
    return Proposal(walkers + step, np.zeros(n_walkers))


def _pairs(count: int, n: int, rng: np.random.Generator) -> Integers:
    """Pairs of different numbers below a count, shape (n, 2)."""
    first = rng.integers(count, size=n)
    later = rng.integers(1, count, size=n)
    return np.column_stack([first, (first + later) % count])


def autoregress(
    walkers: Floats, reference: Normal, longest: float, rng: np.random.Generator
) -> Proposal:
    """Move that a normal distribution near the density would always take.

    The preconditioned Crank-Nicolson proposal (Cotter et al. 2013, Statistical Science
    28, eq. 4.7), of random length, 1 at most: then it forgets where it came from.
    """
    n_walkers = len(walkers)
    length = longest * np.sqrt(rng.random((n_walkers, 1)))
    normal = rng.standard_normal(walkers.shape) @ reference.root.T
    kept = np.sqrt(1.0 - length**2) * (walkers - reference.mean)
    points = reference.mean + kept + length * normal
    change = reference.log_density(walkers) - reference.log_density(points)
    return Proposal(points, change)


@dataclass(eq=False)
class Ensemble:
    """Walkers and the density that they sample.

    The normal distribution of the third kind of move is that of the walkers at the
    start, and renewed by `adapt`; its length is tuned until `is_tuned`.
    """

    log_density: LogDensity
    walkers: Floats  # an even number, at least twice that of parameters
    rng: np.random.Generator
    values: Floats = field(init=False)  # logarithm of the density at each walker
    reference: Normal = field(init=False)
    longest: float = 1.0  # length of that move
    is_tuned: bool = False
    moves: int = 0
    taken: int = 0

    def __post_init__(self) -> None:
        self.values = self.log_density(self.walkers)
        self.reference = Normal.of(self.walkers)

    def adapt(self, points: Floats) -> None:
        """Take the normal distribution from points; ends what was counted so far."""
        self.reference = Normal.of(points)
        self.moves = 0
        self.taken = 0

    def step(self) -> None:
        """Move the first half of the walkers by the second, then the second."""
        n_walkers = len(self.walkers)
        half = n_walkers // 2
        first = np.arange(half)
        second = np.arange(half, n_walkers)
        self._move(first, second)
        self._move(second, first)

    def _move(self, own: Integers, others: Integers) -> None:
        walkers = self.walkers[own]
        kind = self.rng.integers(16)
        if kind == 0:
            proposal = stretch(walkers, self.walkers[others], self.rng)
        elif kind < 4:
            proposal = evolve(walkers, self.walkers[others], self.rng)
        else:
            proposal = autoregress(walkers, self.reference, self.longest, self.rng)
        values = self.log_density(proposal.points)
        with np.errstate(invalid="ignore"):  # from one impossible point to another
            gain = values - self.values[own] + proposal.log_factors
        taken = np.log(self.rng.random(len(own))) < gain
        self.walkers[own[taken]] = proposal.points[taken]
        self.values[own[taken]] = values[taken]
        self.moves += len(own)
        self.taken += int(taken.sum())
        if kind >= 4 and not self.is_tuned:
            self._tune(float(taken.mean()))

    def _tune(self, acceptance: float) -> None:
        """Lengthen moves that are taken more often than they need be."""
        usual = 0.3
        gain = 0.2
        shortest = 0.01
        change = gain * (acceptance - usual)
        longer = self.longest * math.exp(change)
        longer = max(longer, shortest)
        self.longest = min(longer, 1.0)


def sample_ensemble(
    log_density: LogDensity,
    start: Floats,
    steps: int,
    warm_up: int,
    seed: int = 0,
) -> Chains:
    """Points of a density from steps of an ensemble after a warm-up.

    `start` are the walkers, shape (n_walkers, n_parameters), an even number and at
    least twice that of parameters. In the warm-up the normal distribution of a move is
    renewed three times.
    """
    rng = np.random.default_rng(seed)
    ensemble = Ensemble(
        log_density,
        walkers=start.copy(),
        rng=rng,
    )
    n_parameters = start.shape[1]
    for share in (0.2, 0.3, 0.5):
        n_steps = max(int(share * warm_up), 2)
        begun = _points(ensemble, n_steps)
        later = begun[n_steps // 2 :]
        points = later.reshape(-1, n_parameters)
        ensemble.adapt(points)
    ensemble.is_tuned = True

    reports = 10
    bounds = np.linspace(0, steps, reports + 1).astype(int)
    counts = np.diff(bounds)
    parts = []
    for n_steps in counted("posterior", counts.tolist()):
        part = _points(ensemble, n_steps)
        parts.append(part)
    acceptance = ensemble.taken / max(ensemble.moves, 1)
    return Chains(
        points=np.concatenate(parts),
        acceptance=acceptance,
    )


def _points(ensemble: Ensemble, steps: int) -> Floats:
    """Walkers after each of some steps, shape (steps, n_walkers, n_parameters)."""
    points = np.empty((steps, *ensemble.walkers.shape))
    for k in range(steps):
        ensemble.step()
        points[k] = ensemble.walkers
    return points
