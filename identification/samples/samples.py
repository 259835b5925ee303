"""Regressions of sampled trials: Euler, integral and spline sample structures.

For accelerations that are linear in unknown parameters, xdot = P(x, rudder) theta, each
row says x(t_k+w) - x(t_k) = (integral of P over the window) theta. Euler takes P at the
start of each step (ESSI of Cao 2015), the integral structure the trapezoid rule (ISSI
of Cao 2015), the spline structure Gauss quadrature on splines through the samples,
broken where the rudder has corners.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from identification.samples.integrals import (
    Channels,
    spline_integrals,
    step_integrals,
    twice_integrated,
)
from identification.samples.preprocess import (
    FEWEST_SAMPLES,
    NOISY,
    between_gaps,
    is_noisy,
    noise_ratio,
    smoothed_channels,
)
from identification.samples.rudder import rebuild, straight
from shipgym import InputError, Particulars, ShipModel, SteeringGear, Trial
from shipgym.arrays import Floats, Integers, integral
from shipgym.checks import check_choice, check_whole
from shipgym.models import converted_model
from shipgym.ships import GreyBox, Structure
from shipgym.trials.resampling import usual_step


@dataclass(frozen=True)
class Sampling:
    """Rule and window by which trials become a regression.

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
        sample_structures = ("euler", "integral", "spline")
        check_choice(self.rule, sample_structures, "samples")
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

    def by_equation(self) -> Iterator[tuple[str, Floats, Floats]]:
        """Name, features and targets of each equation."""
        for q, features in self.features.items():
            yield q, features, self.targets[q]

    def select(self, rows: NDArray[Any]) -> Self:
        """Some of the rows, by mask or index."""
        features = {q: values[rows] for q, values in self.features.items()}
        targets = {q: values[rows] for q, values in self.targets.items()}
        return replace(
            self,
            features=features,
            targets=targets,
            start=self.start[rows],
            duration=self.duration[rows],
            trial=self.trial[rows],
        )


def build_samples(
    trials: Sequence[Trial],
    structure: Structure,
    particulars: Particulars,
    samples: str = "spline",
    window: int | None = None,
    gear: SteeringGear | None = None,
    smoothing: str = "spline",
    shaft_speed: float = 0.0,
) -> Samples:
    """Stack the regressions of all trials.

    A trial with gaps in time is taken for several (`gaps.between_gaps`): nothing is
    smoothed or integrated across a gap. Of a grey box the targets are what the
    reference ship's converted acceleration leaves. Raises InputError for a window or
    sample structure that does not exist, and for a trial of which gaps leave nothing.

    Parameters
    ----------
    trials : sequence of Trial
        With the channels the structure requires; their time steps may differ.
    structure : Structure
        Gives the terms.
    particulars : Particulars
        Length and service speed.
    samples : {"spline", "integral", "euler"}
        Sample structure, as in `Sampling`.
    window : int, optional
        Sampling steps per row; windows overlap by half. By default 1 for data without
        noise, otherwise chosen by the noise level, up to a third of the time to sail
        one ship length.
    gear : SteeringGear, optional
        Helps to rebuild the rudder between samples (spline only).
    smoothing : str
        Smoothing of noisy channels before the terms are formed, as in `Preprocessing`.
    shaft_speed : float
        At service speed, 1/s, for terms that refer to it.
    """
    regression = _Regression(
        structure, particulars, Sampling(samples, window), gear, smoothing, shaft_speed
    )
    parts = []
    for index, trial in enumerate(trials):
        parts += regression.of_trial(trial, index)
    return _stacked(parts, structure.regressed)


def _stacked(parts: Sequence[Samples], equations: Iterable[str]) -> Samples:
    """The rows of all parts, one after the other."""

    def joined(name: str) -> Any:
        return np.concatenate([getattr(part, name) for part in parts])

    features, targets = {}, {}
    for q in equations:
        features[q] = np.concatenate([part.features[q] for part in parts])
        targets[q] = np.concatenate([part.targets[q] for part in parts])
    return Samples(
        features=features,
        targets=targets,
        start=joined("start"),
        duration=joined("duration"),
        trial=joined("trial"),
        window=max(part.window for part in parts),
    )


@dataclass(frozen=True, eq=False)
class _Regression:
    """Rows of the regression of a trial, by the arguments of `build_samples`."""

    structure: Structure
    particulars: Particulars
    sampling: Sampling
    gear: SteeringGear | None
    smoothing: str
    shaft_speed: float

    def of_trial(self, trial: Trial, index: int) -> list[Samples]:
        """The rows of each of its pieces between gaps."""
        window = self.sampling.window
        fewest = FEWEST_SAMPLES
        if window is not None:
            fewest = window + 1
            if len(trial) < fewest:
                raise InputError(
                    f"trial {trial.name!r}: expected more samples than the window of"
                    f" {window} steps, got {len(trial)}; give a smaller window"
                )
        pieces = between_gaps(trial, self.particulars, fewest)
        if window is None:
            longest = max(pieces, key=len)
            moving = [q for q in "uvr" if q in self.structure.equations]
            window = default_window(longest, self.particulars, moving)
        return [
            self._of_piece(piece, index, window)
            for piece in pieces
            if len(piece) > window
        ]

    def _of_piece(self, trial: Trial, index: int, window: int) -> Samples:
        """The rows of a trial without gaps."""
        t = trial.t
        structure = self.structure
        names = structure.required_channels
        channels = smoothed_channels(
            trial,
            names,
            self.smoothing,
        )
        windows = _Windows(len(t), window)
        features, targets = {}, {}
        for q, steps in self._terms_by_step(trial, channels).items():
            features[q] = windows.summed(steps)
            targets[q] = windows.changes(channels[q])
            if (wind := f"wind_{q}dot") in trial:
                targets[q] -= windows.changes(integral(t, trial[wind]))

        rows = Samples(
            features=features,
            targets=targets,
            start=t[windows.first],
            duration=windows.changes(t),
            trial=np.full(len(windows.first), index),
            window=window,
        )
        if isinstance(structure, GreyBox):
            return _without_reference(rows)
        return without_memory(rows) if "q" in structure.equations else rows

    def _terms_by_step(self, trial: Trial, channels: Channels) -> dict[str, Floats]:
        """Integrals of the terms over each step; the memory's follow those of `r`."""
        t, rule = trial.t, self.sampling.rule
        if rule == "spline":
            delta = trial["delta"]
            known = self.structure.channels | self.structure.equations.keys()
            recorded = [trial[name] for name in channels if name in known - {"delta"}]
            noisy = is_noisy(t, recorded)
            rudder = straight(t, delta) if noisy else rebuild(t, delta, self.gear)
            found = spline_integrals(t, channels, self._terms, rudder)
        else:
            found = step_integrals(t, channels, self._terms, rule)
        terms, moments = found
        if "q" in terms:
            memory = twice_integrated(t, terms.pop("q"), moments["q"])
            terms["r"] = np.hstack([terms["r"], memory])
        return terms

    @cached_property
    def _bare_reference(self) -> ShipModel:
        """Reference ship of a grey box, converted to the target."""
        assert isinstance(self.structure, GreyBox)
        gear = self.gear or SteeringGear()
        return converted_model(self.structure, self.particulars, gear, self.shaft_speed)

    def _terms(self, channels: Channels) -> dict[str, Floats]:
        """The terms by equation; last, of a grey box, the reference's acceleration."""
        structure = self.structure
        motion = (channels, self.particulars, self.shaft_speed)
        terms = {q: structure.features(q, *motion) for q in structure.equations}
        if isinstance(
            structure,
            GreyBox,
        ):
            known = self._bare_reference.rates(channels)
            terms = {q: np.column_stack([own, known[q]]) for q, own in terms.items()}
        return terms


class _Windows:
    """Windows of some steps, each half a window after the one before."""

    def __init__(self, n_samples: int, steps: int) -> None:
        half = max(steps // 2, 1)
        end = n_samples - steps
        self.steps = steps
        self.first = np.arange(
            0,
            end,
            half,
        )
        self.last = self.first + steps

    def changes(self, values: Floats) -> Floats:
        """Change of values, by sample, over each window."""
        return values[self.last] - values[self.first]

    def summed(self, rows: Floats) -> Floats:
        """Sum over each window of rows, one a step."""
        if self.steps == 1:
            return rows
        sums = np.cumsum(
            rows,
            axis=0,
        )
        from_start = np.pad(sums, ((1, 0), (0, 0)))
        return self.changes(from_start)


def _without_reference(rows: Samples) -> Samples:
    """Rows of a grey box, whose last feature, her reference's, goes to the targets."""
    return replace(
        rows,
        features={q: X[:, :-1] for q, X, _ in rows.by_equation()},
        targets={q: y - X[:, -1] for q, X, y in rows.by_equation()},
    )


def default_window(
    trial: Trial, particulars: Particulars, velocities: Iterable[str] = "uvr"
) -> int:
    """Sampling steps over which velocities change by much more than their noise.

    1 without noise; at most a third of the time to sail one ship length, and a
    twentieth of the trial.
    """
    one_length = particulars["length"] / particulars["speed"]
    longest_window = 1.0 / 3.0  # of the time to sail one ship length
    by_travel = int(longest_window * one_length / usual_step(trial.t))
    by_trial = len(trial) // 20
    longest = min(by_travel, by_trial)

    window = 1
    for channel in velocities:
        values = trial[channel]
        ratio = noise_ratio(trial.t, values)
        while ratio > NOISY and window < longest:
            window += 1
            ratio = noise_ratio(
                trial.t,
                values,
                window,
            )
    return window


def without_memory(rows: Samples) -> Samples:
    """Rows of one trial from which the unknown memory of yaw is eliminated.

    Of rdot = (terms of `r`) + q, qdot = (terms of `q`) the memory q is not measured. At
    the start of a window it is the same constant in the mean yaw acceleration of two
    windows of one trial once the terms of `q`, integrated from the start of the trial,
    stand on the right; so one window less the next is free of it. That is the
    regression of the second-order equation weighted by two boxes convolved, a
    modulating function (Shinbrot 1957, On the analysis of linear and nonlinear systems,
    Trans. ASME 79): no derivative of a measured channel is formed. The rows returned
    are those with a window after theirs.
    """
    end = rows.start + rows.duration
    next_window = np.searchsorted(rows.start, end - 1e-9 * rows.duration)
    first = np.flatnonzero(next_window < len(rows))
    if not first.size:
        raise InputError(
            "window: expected at least two windows after each other in every trial for"
            f" a structure with a memory of yaw, got {len(rows)}; give a smaller"
            " window, or longer trials"
        )

    second = next_window[first]
    duration = rows.duration
    both = 0.5 * (duration[first] + duration[second])

    def apart(values: Floats) -> Floats:
        """Means of a window less those of the one before, times a window."""
        means = (values.T / duration).T
        return np.asarray(((means[second] - means[first]).T * both).T)

    chosen = rows.select(first)
    return replace(
        chosen,
        features=chosen.features | {"r": apart(rows.features["r"])},
        targets=chosen.targets | {"r": apart(rows.targets["r"])},
    )
