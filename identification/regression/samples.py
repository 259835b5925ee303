"""From sampled trials to a regression: the Euler, integral and spline sample structures.

For accelerations that are linear in unknown parameters, xdot = P(x, rudder) theta, each
row says x(t_k+w) - x(t_k) = (integral of P over the window) theta. Euler takes P at the
start of each step (ESSI of Cao 2015), the integral structure the trapezoid rule (ISSI
of Cao 2015), the spline structure Gauss quadrature on splines through the samples,
broken where the rudder has corners.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from identification.regression import preprocess
from identification.regression.integrals import (
    Channels,
    spline_integrals,
    step_integrals,
    twice_integrated,
)
from identification.regression.rudder import rebuild, straight
from shipgym import InputError, Particulars, SteeringGear, Trial
from shipgym.arrays import Floats, Integers, integral
from shipgym.checks import check_choice, check_whole
from shipgym.ships import GreyBox, Structure

SAMPLE_STRUCTURES = ("euler", "integral", "spline")
LONGEST_WINDOW = 1.0 / 3.0  # of the time to sail one ship length
LARGEST_STEPS = 5.0  # of the usual time step; a longer one is a gap,
SHORTEST_GAP = (
    0.15  # unless it is shorter than this part of the time to sail one ship length
)
NEIGHBOURS = 11  # steps whose median is the usual one
FEWEST_SAMPLES = 10  # between gaps; fewer are left out


@dataclass(frozen=True)
class Sampling:
    """How a trial becomes a regression.

    Parameters
    ----------
    rule : {"spline", "integral", "euler"}
        Gauss quadrature on splines through the samples, broken where the rudder starts
        or stops moving; trapezoid rule over each window (ISSI of Cao 2015); or value at
        the start of each step (ESSI of Cao 2015), biased at long steps.
    window : int or None, at least 1
        Sampling steps over which velocities are integrated. None: 1 without noise,
        otherwise chosen by the noise level.
    """

    rule: str = "spline"
    window: int | None = None

    def __post_init__(self) -> None:
        check_choice(self.rule, SAMPLE_STRUCTURES, "samples")
        if self.window is not None:
            check_whole(self.window, "window", at_least=1, hint="in sampling steps")


@dataclass(frozen=True, eq=False)
class Samples:
    """A regression for each equation of motion, all with the same rows.

    Attributes
    ----------
    features : dict of str to array of shape (n_rows, n_terms)
        Integrals of the terms over each row's window, by equation (`u`, `v`, `r`, `p`).
    targets : dict of str to array of shape (n_rows,)
        Change of the velocity over the window, less that by measured wind.
    start : array of shape (n_rows,)
        Time at which the window begins, s.
    duration : array of shape (n_rows,)
        Length of the window, s.
    trial : array of shape (n_rows,)
        Index of the trial.
    window : int
        Steps per window of the longest-windowed trial.
    """

    features: dict[str, Floats]
    targets: dict[str, Floats]
    start: Floats
    duration: Floats
    trial: Integers
    window: int

    def __len__(self) -> int:
        return len(self.start)

    def select(self, rows: NDArray[Any]) -> Self:
        """Some of the rows, by mask or index."""
        features, targets = (
            {q: one[rows] for q, one in of.items()}
            for of in (self.features, self.targets)
        )
        own = self.start[rows], self.duration[rows], self.trial[rows]
        return type(self)(features, targets, *own, self.window)


def build_samples(
    trials: Sequence[Trial],
    structure: Structure,
    particulars: Particulars,
    samples: str = "spline",
    window: int | None = None,
    gear: SteeringGear | None = None,
    smooth: bool | str = True,
    shaft_speed: float = 0.0,
) -> Samples:
    """Stack the regressions of all trials.

    A trial with gaps in time is taken for several (`between_gaps`): nothing is smoothed
    or integrated across a gap. Of a grey box the targets are what the reference ship's
    converted acceleration leaves.

    Raises InputError for a window or sample structure that does not exist, and for a
    trial of which gaps leave nothing.

    Parameters
    ----------
    trials : sequence of Trial
        With the channels the structure requires; their time steps may differ.
    structure : Structure
        Gives the terms.
    particulars : Particulars
        Length and service speed.
    samples : {"euler", "integral", "spline"}
        Sample structure.
    window : int, optional
        Sampling steps per row; windows overlap by half. By default 1 for data without
        noise, otherwise chosen by the noise level, up to a third of the time to sail
        one ship length.
    gear : SteeringGear, optional
        Helps to rebuild the rudder between samples (spline only).
    smooth : bool or str
        Whether channels with noise are smoothed before the terms are formed; by
        smoothing splines, or as named (`preprocess.PREPROCESSING`).
    shaft_speed : float
        At service speed, 1/s, for terms that refer to it.
    """
    Sampling(samples, window)
    sampling = _Sampling(
        structure, particulars, samples, window, gear, smooth, shaft_speed
    )
    parts = [
        part
        for index, trial in enumerate(trials)
        for part in sampling.parts(trial, index)
    ]
    return Samples(
        {
            q: np.concatenate([part.features[q] for part in parts])
            for q in structure.regressed
        },
        {
            q: np.concatenate([part.targets[q] for part in parts])
            for q in structure.regressed
        },
        np.concatenate([part.start for part in parts]),
        np.concatenate([part.duration for part in parts]),
        np.concatenate([part.trial for part in parts]),
        max(part.window for part in parts),
    )


@dataclass(frozen=True, eq=False)
class _Sampling:
    """How a trial becomes rows of the regression; arguments of `build_samples`, checked."""

    structure: Structure
    particulars: Particulars
    samples: str
    window: int | None
    gear: SteeringGear | None
    smooth: bool | str
    shaft_speed: float

    def parts(self, trial: Trial, index: int) -> list[Samples]:
        """The rows of a trial, of each piece between gaps."""
        if self.window is not None and self.window >= len(trial):
            raise InputError(
                f"trial {trial.name!r}: {len(trial)} samples found, expected more than"
                f" the window of {self.window} steps; give a smaller window"
            )
        fewest = FEWEST_SAMPLES if self.window is None else self.window + 1
        pieces = between_gaps(trial, self.particulars, fewest)
        window = self.window or default_window(max(pieces, key=len), self.particulars)
        return [
            self._part(piece, index, window) for piece in pieces if len(piece) > window
        ]

    def _part(self, trial: Trial, index: int, window: int) -> Samples:
        t, equations = trial.t, self.structure.equations
        channels = preprocess.smoothed_channels(
            trial, self.structure.required_channels, self.smooth
        )
        if self.samples == "spline":
            noisy = preprocess.is_noisy(
                t, (trial[name] for name in channels if name != "delta")
            )
            rudder = (
                straight(t, trial["delta"])
                if noisy
                else rebuild(t, trial["delta"], self.gear)
            )
            integrals, moments = spline_integrals(
                t, channels, equations, self._terms, rudder
            )
        else:
            integrals, moments = step_integrals(
                t, channels, equations, self._terms, self.samples == "euler"
            )
        if "q" in integrals:
            memory = twice_integrated(t, integrals.pop("q"), moments["q"])
            integrals["r"] = np.hstack([integrals["r"], memory])
        first = np.arange(0, len(t) - window, max(window // 2, 1))
        last = first + window
        features, targets = {}, {}
        for q, steps in integrals.items():
            summed = np.pad(np.cumsum(steps, axis=0), ((1, 0), (0, 0)))
            features[q] = steps if window == 1 else summed[last] - summed[first]
            targets[q] = channels[q][last] - channels[q][first]
            if f"wind_{q}dot" in trial:
                by_wind = integral(t, trial[f"wind_{q}dot"])
                targets[q] -= by_wind[last] - by_wind[first]
            if isinstance(self.structure, GreyBox):
                features[q], by_reference = features[q][:, :-1], features[q][:, -1]
                targets[q] -= by_reference
        part = Samples(
            features,
            targets,
            t[first],
            t[last] - t[first],
            np.full(len(first), index),
            window,
        )
        return without_memory(part) if "q" in equations else part

    def _terms(self, equation: str, channels: Channels) -> Floats:
        """The terms of an equation, of a grey box followed by the reference ship's acceleration."""
        terms = self.structure.features(
            equation, channels, self.particulars, self.shaft_speed
        )
        if not isinstance(self.structure, GreyBox):
            return terms
        known = self.structure.converted_accelerations(
            channels, self.particulars, self.shaft_speed
        )
        return np.column_stack([terms, known[equation]])


def between_gaps(
    trial: Trial, particulars: Particulars, fewest: int = FEWEST_SAMPLES
) -> list[Trial]:
    """Cut a trial where samples are missing; the trial itself if it has no gap.

    A gap is a time step of more than 5 usual ones, the median of the trial or of those
    around, and more than 0.15 of the time to sail one ship length. Pieces shorter than
    `fewest`, or 10, samples are left out; InputError where no piece is left.
    """
    steps = np.diff(trial.t)
    usual = np.maximum(
        np.median(steps), median_filter(steps, NEIGHBOURS, mode="mirror")
    )
    shortest = SHORTEST_GAP * particulars["length"] / particulars["speed"]
    gaps = (
        np.flatnonzero(
            steps > (1.0 + 1e-6) * np.maximum(LARGEST_STEPS * usual, shortest)
        )
        + 1
    )
    if not gaps.size:
        return [trial]
    fewest = max(fewest, FEWEST_SAMPLES)
    if not (
        rows := [
            slice(i, j)
            for i, j in pairwise([0, *gaps.tolist(), len(trial)])
            if j - i >= fewest
        ]
    ):
        longest = int(np.argmax(steps))
        raise InputError(
            f"trial {trial.name!r}: {gaps.size} gaps in time found (the longest from"
            f" {trial.t[longest]:g} to {trial.t[longest + 1]:g} s) and nowhere {fewest}"
            " samples between them, expected longer stretches without a gap; export it"
            ' with every sample, or leave it out (use = "skip")'
        )
    return [trial.part(piece) for piece in rows]


def default_window(trial: Trial, particulars: Particulars) -> int:
    """Sampling steps over which a trial's velocities change by much more than their noise; 1 without."""
    step = float(np.median(np.diff(trial.t)))
    longest = max(
        int(LONGEST_WINDOW * particulars["length"] / particulars["speed"] / step), 1
    )
    longest = min(longest, max(len(trial) // 20, 1))
    needed = 1
    for channel in "uvr":
        ratio = preprocess.noise_ratio(trial.t, trial[channel])
        while ratio > preprocess.NOISY and needed < longest:
            needed += 1
            ratio = preprocess.noise_ratio(trial.t, trial[channel], needed)
    return needed


def without_memory(part: Samples) -> Samples:
    """Rows of one trial from which the unknown memory of yaw is eliminated: one window less the next.

    Of rdot = (terms of `r`) + q, qdot = (terms of `q`) the memory q is not measured. At
    the start of a window it is the same constant in the mean yaw acceleration of two
    windows of one trial once the terms of `q`, integrated from the start of the trial,
    stand on the right; so their difference is free of it. That is the regression of the
    second-order equation weighted by two boxes convolved, a modulating function
    (Shinbrot 1957, On the analysis of linear and nonlinear systems, Trans. ASME 79): no
    derivative of a measured channel is formed. The rows returned are those with a
    window after theirs.
    """
    end = part.start + part.duration
    following = np.searchsorted(part.start, end - 1e-9 * part.duration)
    rows = np.flatnonzero(following < len(part))
    if not rows.size:
        raise InputError(
            f"window: a trial of {len(part)} windows found, expected at least two after"
            " each other for a structure with a memory of yaw; give a smaller window,"
            " or longer trials"
        )
    after, chosen = following[rows], part.select(rows)
    scale = 0.5 * (part.duration[rows] + part.duration[after])
    features, targets = (
        part.features["r"] / part.duration[:, None],
        part.targets["r"] / part.duration,
    )
    features = (features[after] - features[rows]) * scale[:, None]
    targets = (targets[after] - targets[rows]) * scale
    return replace(
        chosen,
        features=chosen.features | {"r": features},
        targets=chosen.targets | {"r": targets},
    )
