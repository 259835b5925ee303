"""Search of the commands of one episode: quasi-Newton steps and random changes.

A visit works on one width of changes, coarse to fine from visit to visit. Differences
along local shapes give the gradient, BFGS the direction; steps of many lengths and
random changes are tried side by side, and what costs least is kept.

Sources: Nocedal & Wright 2006, Numerical Optimization, 6.1 (BFGS) and 8.1 (finite
differences).
"""

from dataclasses import dataclass, replace

import numpy as np

from rudder_search.changes import RandomChanges, local_shapes
from rudder_search.lanes import Commands, Lanes
from shipgym.arrays import Floats

N_LANES = 256


@dataclass(frozen=True)
class Found:
    """Where the search of an episode stands.

    Attributes
    ----------
    best : array of shape (n_steps,)
        Commands of the least cost.
    cost : float
        Of these.
    course : array of shape (n_steps,)
        Commands from which the search goes on, of the least smooth cost.
    visits : int
        How often the search has worked on it.
    """

    best: Commands
    cost: float
    course: Commands
    visits: int = 0


class Search:
    """Search of episodes of a task.

    Parameters
    ----------
    lanes : Lanes
        Of `N_LANES` ships.
    seed : int
        Of the random changes.
    """

    spacings = (128, 90, 64, 45, 32, 22, 16, 11)  # of shapes, control intervals
    n_iterations = 5  # of a visit

    def __init__(self, lanes: Lanes, seed: int = 0) -> None:
        self.lanes = lanes
        self.seed = seed

    def visit(self, found: Found, episode: int, others: Commands) -> Found:
        """Return what another visit finds; it costs no more.

        The same for the same arguments. `episode` is the seed of the episode, `others`
        are commands of controllers in it, shape (n_others, n_steps).
        """
        visit = _Visit(self, found, episode, others)
        for _ in range(self.n_iterations):
            visit.improve()
        return replace(visit.found, visits=found.visits + 1)


class _Visit:
    """Iterations on one width of changes."""

    def __init__(
        self,
        search: Search,
        found: Found,
        episode: int,
        others: Commands,
    ) -> None:
        self.lanes = search.lanes
        self.found = found
        self.episode = episode
        self.random = np.random.default_rng([search.seed, episode, found.visits])
        self.smooth_cost = np.inf

        padded = np.zeros((N_LANES, self.lanes.n_steps), dtype=np.float32)
        padded[:] = found.course
        self.try_out(padded)
        commanded = np.any(others != 0.0, axis=0)
        n_sailed = int(np.flatnonzero(commanded).max(initial=0)) + 1
        self.changes = RandomChanges(self.random, others, n_sailed)

        spacing = search.spacings[found.visits % len(search.spacings)]
        shapes = local_shapes(self.lanes.n_steps, spacing)
        matters = np.abs(shapes[:, :n_sailed]).max(axis=1) > 0.1
        self.shapes = self._drawn(shapes[matters])
        self.reach = 0.02 * np.exp(0.7 * self.random.normal())
        self.inverse: Floats | None = None
        self.gradient = np.zeros(len(self.shapes))
        self.moved = np.zeros(len(self.shapes))

    def _drawn(self, shapes: Commands) -> Commands:
        """Neighbouring shapes, as many as can be tried at once."""
        most = N_LANES // 2 - 8
        n_first = max(len(shapes) - most, 0)
        first = int(self.random.integers(n_first + 1))
        return shapes[first : first + most]

    def improve(self) -> None:
        """Take the best of differences, steps along directions and random changes."""
        n = len(self.shapes)
        before = self.smooth_cost
        aside = np.float32(self.reach) * np.concatenate([self.shapes, -self.shapes])
        start = self.found.course
        differing = self._filled(start + aside)
        smooth = self.try_out(differing)

        ahead, back = smooth[:n], smooth[n : 2 * n]
        gradient = (ahead - back) / (2.0 * self.reach)
        curvature = np.abs(ahead + back - 2.0 * before) / self.reach**2
        steps = self._steps(gradient, curvature)
        moves = steps.astype(np.float32) @ self.shapes
        along = self.try_out(self._filled(start + moves))

        best = int(np.argmin(along[: len(steps)]))
        self.moved = np.zeros(n)
        if along[best] <= self.smooth_cost and along[best] < before:
            self.moved = steps[best]
        if self.smooth_cost >= before:
            self.reach = max(0.5 * self.reach, 1e-3)

    def _steps(self, gradient: Floats, curvature: Floats) -> Floats:
        """Steps of several lengths along two directions, shape (n_steps, n_shapes)."""
        usual = np.median(curvature) + 1e-12
        scale = 1.0 / np.maximum(curvature, 0.1 * usual)
        if self.inverse is None or not self.moved.any():
            self.inverse = np.diag(scale)
        else:
            change = gradient - self.gradient
            self.inverse = bfgs(self.inverse, self.moved, change)
        self.gradient = gradient

        lengths = np.geomspace(2.0, 1e-3, 16)
        steps = []
        for direction in (-self.inverse @ gradient, -scale * gradient):
            largest = np.abs(direction).max() + 1e-12
            bounded = direction * min(1.0, 0.5 / largest)
            steps.append(lengths[:, None] * bounded)
        return np.concatenate(steps)

    def _filled(self, candidates: Commands) -> Commands:
        """Candidates within the rudder's limits, then random ones up to `N_LANES`."""
        n_random = N_LANES - len(candidates)
        drawn = self.changes.of(self.found.course, n_random)
        inside = np.clip(candidates, -1.0, 1.0).astype(np.float32)
        return np.concatenate([inside, drawn])

    def try_out(self, candidates: Commands) -> Floats:
        """Smooth costs of candidates; what is better than what was found is kept."""
        outcome = self.lanes.sail(self.episode, candidates)
        cheapest = int(np.argmin(outcome.costs))
        smoothest = int(np.argmin(outcome.smooth))
        found = self.found
        if outcome.costs[cheapest] < found.cost:
            cost = float(outcome.costs[cheapest])
            found = replace(found, best=candidates[cheapest].copy(), cost=cost)
        if outcome.smooth[smoothest] < self.smooth_cost:
            self.smooth_cost = float(outcome.smooth[smoothest])
            found = replace(found, course=candidates[smoothest].copy())
        self.found = found
        return outcome.smooth


def bfgs(inverse: Floats, moved: Floats, change: Floats) -> Floats:
    """Update an inverse Hessian; Nocedal & Wright 2006, eq. 6.17.

    `moved` is the last step, `change` that of the gradient; a step along which the
    curvature is not positive leaves the matrix as it is.
    """
    curvature = float(moved @ change)
    if curvature <= 1e-10 * np.linalg.norm(moved) * np.linalg.norm(change):
        return inverse
    rho = 1.0 / curvature
    left = np.eye(len(moved)) - rho * np.outer(moved, change)
    updated: Floats = left @ inverse @ left.T + rho * np.outer(moved, moved)
    return updated
