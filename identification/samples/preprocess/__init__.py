"""Preparation of a noisy record: channels that can be differentiated."""

from collections.abc import Sequence
from dataclasses import dataclass

from identification.samples.preprocess.noise import (
    NOISY,
    is_noisy,
    noise_level,
    noise_ratio,
)
from identification.samples.preprocess.repair import outliers, repaired
from identification.samples.preprocess.splines import smooth
from shipgym import Trial
from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_flag

#: What `identify` may do with noisy channels.
PREPROCESSING = ("spline", "none")


@dataclass(frozen=True)
class Preprocessing:
    """Smoothing of noisy channels before the regression.

    Parameters
    ----------
    smoothing : {"spline", "none"}
        Smoothing splines fitted to the noise level, or channels as recorded.
    repair : bool
        Whether outliers are replaced and dropouts of up to 10 steps filled first; the
        provenance counts them.
    """

    smoothing: str = "spline"
    repair: bool = False

    def __post_init__(self) -> None:
        check_choice(self.smoothing, PREPROCESSING, "preprocessing")
        check_flag(self.repair, "repair")


def smoothed_channels(
    trial: Trial,
    names: Sequence[str],
    smoothing: str = "spline",
) -> dict[str, Floats]:
    """Some channels of a trial, smoothed (`Preprocessing`).

    The rudder, which has corners, is left as it is.
    """
    check_choice(smoothing, PREPROCESSING, "preprocessing")
    kept = {"delta"}
    if smoothing == "none":
        kept = set(names)

    channels = {}
    for name in names:
        channels[name] = trial[name]
        if name not in kept:
            channels[name] = smooth(trial.t, trial[name])
    return channels


__all__ = [
    "NOISY",
    "PREPROCESSING",
    "Preprocessing",
    "is_noisy",
    "noise_level",
    "noise_ratio",
    "outliers",
    "repaired",
    "smooth",
    "smoothed_channels",
]
