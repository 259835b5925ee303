"""Logs of simulated trials by a ship's sensors: noise, resolution, outliers, drift."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from shipgym.arrays import Floats
from shipgym.engine.trajectories import SEA_CHANNELS
from shipgym.trials.trial import Trial
from shipgym.trials.units import CHANNELS, DEGREE


@dataclass(frozen=True)
class Sensor:
    """One sensor, in the SI unit of its channel. The default is a perfect one.

    A reading is the signal plus drift and white noise, now and then an outlier, rounded
    to the resolution.

    Attributes
    ----------
    noise : float
        Standard deviation of the white noise.
    resolution : float
        Step of the readings; 0 for none.
    drift : float
        Standard deviation of a first-order Gauss-Markov process.
    drift_time_s : float
        Its correlation time, s.
    outlier_probability : float
        Of each reading.
    outlier_size : float
        Standard deviation of what an outlier adds.
    """

    noise: float = 0.0
    resolution: float = 0.0
    drift: float = 0.0
    drift_time_s: float = 300.0
    outlier_probability: float = 0.0
    outlier_size: float = 0.0

    def read(
        self, times: Floats, t: Floats, signal: Floats, rng: np.random.Generator
    ) -> Floats:
        """Readings at `times` of a signal given at `t`, linear in between; all in s."""
        n = times.size
        reading: Floats = np.interp(times, t, signal)
        if self.drift:
            wander = _gauss_markov(times, self.drift_time_s, rng)
            reading += self.drift * wander
        noise = rng.standard_normal(n)
        reading += self.noise * noise

        chance = rng.random(n)
        is_outlier = chance < self.outlier_probability
        outlier = self.outlier_size * rng.standard_normal(n)
        reading += np.where(is_outlier, outlier, 0.0)
        if self.resolution:
            steps = np.round(reading / self.resolution)
            reading = steps * self.resolution
        return reading


def _gauss_markov(
    t: Floats, correlation_time_s: float, rng: np.random.Generator
) -> Floats:
    """First-order Gauss-Markov process of unit variance, stationary; times in s.

    Its autocorrelation is exp(-|lag| / correlation time), whatever the steps (Gelb
    1974, Applied Optimal Estimation, 3.8).
    """
    decay = np.exp(-np.diff(t) / correlation_time_s)
    spread = np.sqrt(1.0 - decay**2)
    # the first value has the stationary distribution
    process = rng.standard_normal(t.size)
    process[1:] *= spread
    for k in range(1, t.size):
        process[k] += decay[k - 1] * process[k - 1]
    return process


GNSS = Sensor(noise=0.3, drift=0.8, drift_time_s=300.0)

#: The sensors of a sea trial: satellite position, gyro compass, Doppler log, rate gyro,
#: inclinometer, rudder feedback and shaft pick-up. Orders are logged as they were
#: given.
SEA_TRIAL: Mapping[str, Sensor] = {
    "x": GNSS,
    "y": GNSS,
    "psi": Sensor(noise=0.1 * DEGREE),
    "u": Sensor(noise=0.03),
    "v": Sensor(noise=0.02),
    "r": Sensor(noise=0.02 * DEGREE),
    "p": Sensor(noise=0.02 * DEGREE),
    "phi": Sensor(noise=0.1 * DEGREE),
    "delta": Sensor(resolution=0.1 * DEGREE),
    "n": Sensor(resolution=0.1 / 60.0),
}


@dataclass(frozen=True)
class Sensors:
    """The sensors of a ship and her logger.

    Attributes
    ----------
    by_channel : mapping of str to Sensor
        Channels without a sensor are logged as they are. By default those of a sea
        trial (`SEA_TRIAL`).
    sampling_s : float or None
        Time between logged samples, s, on straight lines between those of the trial;
        None: as in the trial.
    """

    by_channel: Mapping[str, Sensor] = field(default_factory=lambda: SEA_TRIAL)
    sampling_s: float | None = None

    def measure(self, trial: Trial, seed: int = 0) -> Trial:
        """Log of a trial, the true motion, by these sensors.

        The same seed gives the same readings, channel by channel: a sensor more or less
        changes no other. Channels and name are the trial's. Heading, heel and their
        rates have the first-order motion in waves in them; the weather itself is not
        measured.
        """
        t = self._logged_times(trial)
        readings = {}
        for name, values in _measurable(trial).items():
            if name in ("delta_command", "n_command"):
                readings[name] = _orders_at(t, trial.t, values)
                continue
            sensor = self.by_channel.get(name, Sensor())
            # whichever other channels are drawn
            rng = np.random.default_rng([seed, CHANNELS.index(name)])
            readings[name] = sensor.read(t, trial.t, values, rng)
        return Trial(
            t,
            readings,
            name=trial.name,
            kind=trial.kind,
            use=trial.use,
            derived=trial.derived,
            length=trial.length,
            over_ground=trial.over_ground,
        )

    def _logged_times(self, trial: Trial) -> Floats:
        """Times at which the logger asks the sensors, s."""
        if self.sampling_s is None:
            return trial.t.copy()
        rounding = 1.0 + 1e-12
        longest = rounding * trial.duration
        steps = longest / self.sampling_s
        count = int(steps) + 1
        since_start = self.sampling_s * np.arange(count)
        times: Floats = trial.t[0] + since_start
        return times


def _measurable(trial: Trial) -> dict[str, Floats]:
    """Channels that can be measured: with motion in waves, without the weather."""
    measurable = {}
    for name, values in trial.channels.items():
        if name in SEA_CHANNELS:  # known of a simulation, to no instrument
            continue
        in_waves = f"{name}_wave"
        if in_waves in trial:
            values = values + trial[in_waves]
        measurable[name] = values
    return measurable


def _orders_at(times: Floats, t: Floats, orders: Floats) -> Floats:
    """Orders at some times, each held from its time t to the next; all in s."""
    last = np.searchsorted(t, times + 1e-9, side="right") - 1
    return np.asarray(orders[last])
