"""From a noisy record to channels that can be differentiated: noise, filters, smoothers, repair."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from identification.regression.preprocess.filters import median, savitzky_golay, smooth
from identification.regression.preprocess.kinematics import smooth_kinematics
from identification.regression.preprocess.noise import (
    NOISY,
    is_noisy,
    noise_level,
    noise_ratio,
)
from identification.regression.preprocess.repair import outliers, repaired
from shipgym import Trial
from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_flag

#: Filters of single channels by name.
FILTERS: dict[str, Callable[[Floats, Floats], Floats]] = {
    "spline": smooth,
    "savgol": savitzky_golay,
    "median": median,
}

#: What `identify` may do with noisy channels.
PREPROCESSING = (*FILTERS, "rts", "none")


@dataclass(frozen=True)
class Preprocessing:
    """How noisy channels are smoothed before the regression.

    Parameters
    ----------
    smoothing : {"spline", "savgol", "median", "rts", "none"}
        Smoothing splines fitted to the noise level; Savitzky-Golay filter; running
        median; Kalman filter and Rauch-Tung-Striebel smoother, with position and
        heading; or channels as recorded.
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
    trial: Trial, names: Sequence[str], preprocessing: str | bool = True
) -> dict[str, Floats]:
    """Some channels of a trial, smoothed; the rudder, which has corners, is left as it is.

    By one of `PREPROCESSING`: smoothing spline, also for True, Savitzky-Golay filter,
    running median, Kalman smoother of the kinematics (the shaft speed by a spline), or
    nothing, also for False.
    """
    if isinstance(preprocessing, bool):
        preprocessing = "spline" if preprocessing else "none"
    check_choice(preprocessing, PREPROCESSING, "preprocessing")
    if preprocessing == "none":
        return {name: trial[name] for name in names}
    source = smooth_kinematics(trial) if preprocessing == "rts" else trial
    one = FILTERS.get(preprocessing, smooth)
    done = (
        "delta",
        *(("x", "y", "psi", "u", "v", "r") if preprocessing == "rts" else ()),
    )
    return {
        name: source[name] if name in done else one(source.t, source[name])
        for name in names
    }


__all__ = [
    "FILTERS",
    "NOISY",
    "PREPROCESSING",
    "Preprocessing",
    "is_noisy",
    "median",
    "noise_level",
    "noise_ratio",
    "outliers",
    "repaired",
    "savitzky_golay",
    "smooth",
    "smooth_kinematics",
    "smoothed_channels",
]
