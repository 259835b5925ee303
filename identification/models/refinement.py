"""The settings of a refinement by simulation error (`refine`)."""

from dataclasses import dataclass
from typing import ClassVar

from shipgym.checks import bounded, keep_numbers

WHOLE = 1e6  # ship lengths, more than any trial has


@dataclass(frozen=True, eq=False)
class Refinement:
    """Refinement of truncated LS-SVM by the errors of the simulated motion.

    That is the output-error method.

    Parameters
    ----------
    segment_lengths : float, from 0.1
        Length of a segment: the time to sail that many ship lengths at service speed.
        The state at its start is fitted too, which leaves no bias by noise. A second
        set of segments begins half a segment later.
    pull : float, at least 0
        Strength of the pull toward the start: relative cost of a coefficient whose term
        changes by the whole acceleration (root mean squares over the trials).
    """

    name: ClassVar[str] = "output-error"
    options: ClassVar[tuple[str, ...]] = ("segment_lengths", "pull")

    segment_lengths: float = bounded(3.4, at_least=0.1, at_most=WHOLE)
    pull: float = bounded(1e-6, at_least=0.0)

    def __post_init__(self) -> None:
        keep_numbers(self)


def whole_trials() -> Refinement:
    """Output error of whole trials, each a single segment."""
    return Refinement(segment_lengths=WHOLE)
