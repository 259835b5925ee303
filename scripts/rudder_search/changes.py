"""Changes of a sequence of rudder commands that are tried in place of it."""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.ndimage import gaussian_filter1d

from rudder_search.lanes import Commands
from shipgym.arrays import Floats


def local_shapes(n_steps: int, spacing: float) -> Commands:
    """Second derivatives of quartic B-splines, peaks 1, shape (n_shapes, n_steps).

    Heading follows the integral of the rudder, and distance off the track that of the
    heading. Both integrals of these shapes vanish, so that a change of the rudder moves
    the ship aside for a while and leaves the rest of the episode nearly as it was.
    """
    n_intervals = 5
    first = np.arange(1 - n_intervals, int(n_steps / spacing) + 1)
    places = np.arange(n_steps) / spacing - first[:, None]
    return _shape(places, derivative=2).astype(np.float32)


def _shape(places: Floats, derivative: int) -> Floats:
    """Derivative of a B-spline with knots at the integers, its peak 1."""
    n_knots = 4 + derivative
    spline = BSpline.basis_element(np.arange(n_knots), extrapolate=False)
    curve = spline.derivative(derivative) if derivative else spline
    peak = np.nanmax(np.abs(curve(np.linspace(0.0, n_knots - 1.0, 241))))
    shape: Floats = np.nan_to_num(curve(places)) / peak
    return shape


class RandomChanges:
    """Random changes, of any width from a few intervals to a tenth of the episode.

    Parameters
    ----------
    random : numpy.random.Generator
        All that they depend on.
    others : array of shape (n_others, n_steps)
        Sequences of other controllers in the same episode.
    n_sailed : int
        Intervals of the episode that matter.
    """

    def __init__(
        self,
        random: np.random.Generator,
        others: Commands,
        n_sailed: int,
    ) -> None:
        self.random = random
        self.others = others
        self.n_sailed = n_sailed
        self.steps = np.arange(others.shape[1], dtype=np.float64)

    def of(self, commands: Commands, n_changed: int) -> Commands:
        """Changed copies of commands, shape (n_changed, n_steps)."""
        kinds = (self.bump, self.bump, self.bump, self.shift, self.smooth, self.cross)
        numbers = self.random.integers(len(kinds), size=n_changed)
        changed = [kinds[number](commands) for number in numbers]
        return np.clip(changed, -1.0, 1.0).astype(np.float32)

    def bump(self, commands: Commands) -> Floats:
        """Add a bump, one that gives back its course, or its place too."""
        height = self.random.normal() * self._between(0.003, 1.0)
        width = self._between(4.0, 100.0)
        derivative = int(self.random.integers(3))
        begin = self.random.uniform(-2.0 * width, self.n_sailed)
        places = (self.steps - begin) / width
        return commands + height * _shape(places, derivative)

    def shift(self, commands: Commands) -> Floats:
        """Move a part of the commands in time."""
        by = self.random.normal() * self._between(0.5, 20.0)
        shifted = np.interp(self.steps - by, self.steps, commands)
        return self._blend(commands, shifted)

    def smooth(self, commands: Commands) -> Floats:
        """Take the saw teeth out of a part of the commands."""
        width = self._between(1.0, 20.0)
        return self._blend(commands, gaussian_filter1d(commands, width))

    def cross(self, commands: Commands) -> Floats:
        """Take a part of another controller's commands."""
        number = self.random.integers(len(self.others))
        return self._blend(commands, self.others[number])

    def _blend(self, commands: Commands, other: NDArray[np.floating]) -> Floats:
        """Go over to other commands around a random place, and back."""
        middle = self.random.uniform(0.0, self.n_sailed)
        width = self._between(8.0, 150.0)
        share = np.exp(-0.5 * ((self.steps - middle) / width) ** 4)
        blended: Floats = commands + share * (other - commands)
        return blended

    def _between(self, low: float, high: float) -> float:
        """Draw a number of no preferred magnitude."""
        exponent = self.random.uniform(np.log(low), np.log(high))
        return float(np.exp(exponent))
