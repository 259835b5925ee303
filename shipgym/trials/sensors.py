"""Measurement errors of a ship's sensors: noise, resolution, outliers, gaps, delay and drift."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from types import MappingProxyType

import numpy as np

from shipgym.arrays import Flags, Floats
from shipgym.checks import check_number, check_whole
from shipgym.engine.trajectories import SEA_CHANNELS
from shipgym.errors import InputError
from shipgym.trials.trial import Trial
from shipgym.trials.units import CHANNELS, DEGREE, check_channel

FEWEST_SAMPLES = 3  # of a trial


@dataclass(frozen=True)
class Sensor:
    """One sensor, in the SI unit of its channel. The default is a perfect one.

    The reading at time t is the signal at t - latency_s, plus drift and white noise,
    now and then an outlier, rounded to the resolution. Raises InputError for a negative
    or infinite number, a probability above 1, or a drift without correlation time.

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
    latency_s : float
        Age of the signal at the time its reading is logged, s.
    """

    noise: float = 0.0
    resolution: float = 0.0
    drift: float = 0.0
    drift_time_s: float = 300.0
    outlier_probability: float = 0.0
    outlier_size: float = 0.0
    latency_s: float = 0.0

    def __post_init__(self) -> None:
        for item in fields(self):
            most = 1.0 if item.name == "outlier_probability" else None
            check_number(
                getattr(self, item.name),
                f"sensor {item.name}",
                at_least=0.0,
                at_most=most,
            )
        check_number(self.drift_time_s, "sensor drift_time_s", above=0.0)

    def read(
        self, times: Floats, t: Floats, signal: Floats, rng: np.random.Generator
    ) -> Floats:
        """Readings at some times of a signal known at times t, straight between them; all times in s."""
        reading: Floats = np.interp(times - self.latency_s, t, signal)
        if self.drift:
            reading += self.drift * gauss_markov(times, self.drift_time_s, rng)
        reading += self.noise * rng.standard_normal(len(times))
        wrong = rng.random(len(times)) < self.outlier_probability
        reading += self.outlier_size * np.where(
            wrong, rng.standard_normal(len(times)), 0.0
        )
        return (
            np.round(reading / self.resolution) * self.resolution
            if self.resolution
            else reading
        )


def gauss_markov(
    t: Floats, correlation_time_s: float, rng: np.random.Generator
) -> Floats:
    """First-order Gauss-Markov process of unit variance at times in s, stationary from the first sample on.

    Its autocorrelation is exp(-|lag| / correlation time), whatever the steps (Gelb
    1974, Applied Optimal Estimation, 3.8).
    """
    decay = np.exp(-np.diff(t) / correlation_time_s)
    shocks = rng.standard_normal(len(t))
    process = np.empty(len(t))
    process[0] = shocks[0]
    for i, kept in enumerate(decay):
        process[i + 1] = kept * process[i] + np.sqrt(1.0 - kept * kept) * shocks[i + 1]
    return process


GNSS = Sensor(noise=0.3, drift=0.8, drift_time_s=300.0)

#: The sensors of a sea trial: satellite position, gyro compass, Doppler log, rate gyro,
#: inclinometer, rudder feedback and shaft pick-up. Orders are logged as they were
#: given.
SEA_TRIAL: Mapping[str, Sensor] = MappingProxyType(
    {
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
)


@dataclass(frozen=True)
class Sensors:
    """The sensors of a ship and her logger; InputError for an unknown channel, or a number out of range.

    Attributes
    ----------
    by_channel : mapping of str to Sensor
        Channels without a sensor are logged as they are. By default those of a sea
        trial (`SEA_TRIAL`).
    sampling_s : float or None
        Time between logged samples, s, on straight lines between those of the trial;
        None: as in the trial.
    dropout_probability : float
        Of each sample to begin a gap in the log.
    dropout_samples : float
        Mean length of a gap, samples. A gap leaves the samples out of the measured
        trial.
    """

    by_channel: Mapping[str, Sensor] = field(default_factory=lambda: SEA_TRIAL)
    sampling_s: float | None = None
    dropout_probability: float = 0.0
    dropout_samples: float = 3.0

    def __post_init__(self) -> None:
        for channel, sensor in self.by_channel.items():
            check_channel(channel, "sensors", time=False)
            if not isinstance(sensor, Sensor):
                raise InputError(
                    f"sensors: {channel}: {sensor!r} found, expected a Sensor"
                )
        if self.sampling_s is not None:
            check_number(self.sampling_s, "sensors sampling_s", above=0.0)
        check_number(
            self.dropout_probability,
            "sensors dropout_probability",
            at_least=0.0,
            below=1.0,
        )
        check_number(self.dropout_samples, "sensors dropout_samples", at_least=1.0)
        object.__setattr__(self, "by_channel", MappingProxyType(dict(self.by_channel)))

    def measure(self, trial: Trial, seed: int = 0) -> Trial:
        """What the log of a trial, the true motion, would hold.

        The same seed gives the same readings, channel by channel: a sensor more or less
        changes no other. Channels and name are the trial's; samples in gaps are left
        out. Heading, heel and their rates have the first-order motion in waves in them;
        the weather itself is not measured. Raises InputError if the seed is not a whole
        number >= 0, or sampling and gaps leave fewer than three samples.
        """
        check_whole(seed, "seed", at_least=0)
        t = self._sampled(trial)
        readings = {}
        for name, values in on_board(trial).items():
            rng = np.random.default_rng([seed, CHANNELS.index(name)])
            sensor, signal = self.by_channel.get(name, PERFECT), (t, trial.t, values)
            readings[name] = (
                orders_at(*signal) if name in ORDERS else sensor.read(*signal, rng)
            )
        kept = self._logged(
            len(t), np.random.default_rng([seed, CHANNELS.index(WEATHER[0])])
        )
        if kept.sum() < FEWEST_SAMPLES:
            raise InputError(
                f"trial {trial.name!r}: {kept.sum()} of {len(t)} samples outside the"
                f" gaps, expected at least {FEWEST_SAMPLES}; give a smaller"
                " dropout_probability"
            )
        facts = ("name", "kind", "use", "derived", "length", "over_ground")
        logged = {name: values[kept] for name, values in readings.items()}
        return Trial(t[kept], logged, **{fact: getattr(trial, fact) for fact in facts})

    def _sampled(self, trial: Trial) -> Floats:
        """Times of the logger, s."""
        if self.sampling_s is None:
            return trial.t.copy()
        count = int(np.floor(trial.duration / self.sampling_s * (1.0 + 1e-12))) + 1
        if count < FEWEST_SAMPLES:
            raise InputError(
                f"sensors sampling_s: {self.sampling_s:g} s found, expected at most"
                f" half of the {trial.duration:g} s of trial {trial.name!r}"
            )
        return np.asarray(trial.t[0] + self.sampling_s * np.arange(count))

    def _logged(self, count: int, rng: np.random.Generator) -> Flags:
        """Which samples are not in a gap."""
        logged = np.ones(count, dtype=bool)
        starts = np.flatnonzero(rng.random(count) < self.dropout_probability)
        lengths = rng.geometric(1.0 / self.dropout_samples, len(starts))
        for start, length in zip(starts, lengths, strict=True):
            logged[start : start + length] = False
        return logged


PERFECT = Sensor()
ORDERS = ("delta_command", "n_command")
WEATHER = SEA_CHANNELS  # known of a simulation, to no instrument


def on_board(trial: Trial) -> dict[str, Floats]:
    """What there is to measure: first-order motion in waves added, the weather left out."""
    channels = trial.channels
    return {
        name: (
            values + channels[f"{name}_wave"] if f"{name}_wave" in channels else values
        )
        for name, values in channels.items()
        if name not in WEATHER
    }


def orders_at(times: Floats, t: Floats, orders: Floats) -> Floats:
    """Orders, each given at a time t and held until the next, at other times; all in s."""
    return np.asarray(orders[np.searchsorted(t, times + 1e-9, side="right") - 1])
