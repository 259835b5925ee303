"""What trials show of their sensors and their sea: noise, and the period of waves."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from identification.samples.preprocess import noise_level
from shipgym import Trial
from shipgym.arrays import Floats
from shipgym.instruments.noise import SEA_TRIAL

PERIODS = (4.0, 20.0)  # s, of waves as they are met
PEAK = 6.0  # of the spectrum of yaw rate, over what surrounds it on both sides


def noise_and_waves(trials: Sequence[Trial], travel_time: float) -> dict[str, Any]:
    """Noise of heading and yaw rate as measured, and a clear period of waves.

    `noise`: standard deviations by channel, SI units, medians over the trials;
    `wave_period`: s, where there is one. `travel_time`: of one ship length, s.
    """
    logs = [trial.raw for trial in trials]
    noise = {}
    for name in ("psi", "r"):
        measured = [log for log in logs if name in log and name not in log.derived]
        levels = [noise_level(log.t, log[name]) for log in measured]
        if levels:
            noise[name] = float(np.median(levels))

    found: dict[str, Any] = {"noise": noise}
    turning = [log for log in logs if "r" in log]
    period = wave_period(turning, travel_time)
    if period is not None:
        found["wave_period"] = period
    return found


def wave_period(logs: Sequence[Trial], travel_time: float) -> float | None:
    """Period at which waves yaw the ship, s; None without a clear peak.

    In every log the spectrum of yaw rate has to be `PEAK` times as high there as at its
    lowest on either side, and as the noise of a sea trial's gyro: the ship's own yawing
    falls with frequency, and noise is level. Only `PERIODS` shorter than half the time
    to travel one ship length count: fast ships yaw so in a zigzag, in calm water too.
    """
    frequency = np.linspace(1.0 / 60.0, 0.5, 120)
    period = 1.0 / frequency
    is_own = period > 0.5 * travel_time
    is_inside = (period > PERIODS[0]) & (period < PERIODS[1])
    clear = np.where(is_inside & ~is_own, np.inf, 0.0)
    for log in logs:
        density, floor = _spectrum(log, frequency)
        for k in np.flatnonzero(clear):
            before = density[:k].min()
            after = density[k:].min()
            around = max(before, after, floor)
            clear[k] = min(clear[k], density[k] / around)

    highest = int(np.argmax(clear))
    if not logs or clear[highest] < PEAK:
        return None
    return float(period[highest])


def _spectrum(log: Trial, frequency: Floats) -> tuple[Floats, float]:
    """Density of the yaw rate at frequencies in Hz, (rad/s)^2/Hz, by Welch's method.

    And that of the noise of a sea trial's gyro.
    """
    from scipy.signal import welch

    t = log.t
    step = float(np.median(np.diff(t)))
    times = np.arange(t[0], t[-1], step)
    yaw_rate = np.interp(times, t, log["r"])

    piece = min(round(128.0 / step), len(times))  # 128 s
    at, density = welch(yaw_rate, 1.0 / step, nperseg=piece)
    floor = 2.0 * SEA_TRIAL["yaw_rate"] ** 2 * step
    return np.interp(frequency, at, density), floor
