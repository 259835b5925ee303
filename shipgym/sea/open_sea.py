"""Current, wind and waves around one ship: the state of the sea, what it does to her, how it goes on.

The ship's u, v are through the water. A current that is the same everywhere then only
moves the frame; where it varies in time, the ship is carried along like the water she
displaces (Froude-Krylov force and added mass; Fossen 2011, 8.3), so that u, v do not
feel it either.

Wind and drift forces are worked out at the start of a step and held over it. Random
processes are linear filters of white noise, taken from step to step by their exact
discrete form (Van Loan 1978, Computing integrals involving the matrix exponential):
their variances do not depend on the step.

Forces are Fourier series over an angle, already divided by the ship's inertia.
"""

from math import fabs, pi, sqrt
from typing import Any, NamedTuple

from shipgym.engine.mathematics import sin_cos
from shipgym.engine.motion import HAS_ROLL, HAS_SEA, Motion, Push
from shipgym.engine.random import DRAW, S11, TO_UNIT, mix, normal
from shipgym.engine.record_code import loader, storer
from shipgym.engine.records import LANES, Layout

SLOWEST_ENCOUNTER = (
    0.1  # of the wave frequency: in a following sea the filter keeps turning
)
LEAST = 1e-12


class Sines(NamedTuple):
    """A series of sines: the amplitudes of six harmonics."""

    first: float
    second: float
    third: float
    fourth: float
    fifth: float
    sixth: float


class Cosines(NamedTuple):
    """A series of cosines: its mean, and the amplitudes of six harmonics."""

    mean: float
    first: float
    second: float
    third: float
    fourth: float
    fifth: float
    sixth: float


class Filter(NamedTuple):
    """A first-order random process in its discrete form."""

    kept: float  # part of the value that is left after a step
    shock: float  # standard deviation of what is added in a step
    deviation: float  # standard deviation of the process


class SeaParameters(NamedTuple):
    """The sea that a ship meets; a direction that is not a number is drawn for each episode."""

    current_speed: float  # m/s
    current_towards: float  # rad
    current: Filter  # m/s
    wind_speed: float  # m/s
    wind_from: float  # rad
    gust: Filter  # m/s
    waves_from: float  # rad
    wave_frequency: float  # rad/s
    wave_number: float  # rad/m
    wave_damping: float  # lambda
    wave_ringing: float  # sqrt(1 - lambda^2)
    drift: Filter  # parts of the mean drift force
    still_air: float  # 1/m, surge deceleration by speed^2 that the model has of itself
    # accelerations by (relative wind)^2, over the angle of the relative wind
    wind_surge: Cosines
    wind_sway: Sines
    wind_yaw: Sines
    wind_roll: Sines
    # accelerations by the mean drift force, variances of the first-order motion, over
    # the angle of the waves
    drift_surge: Cosines
    drift_sway: Sines
    drift_yaw: Sines
    drift_roll: Sines
    heading_variance: Cosines
    roll_variance: Cosines


class Sea(NamedTuple):
    """The state of the sea around a ship."""

    mean_north: float  # m/s, mean current
    mean_east: float
    wind_north: float  # where wind and waves come from, unit vectors
    wind_east: float
    waves_north: float
    waves_east: float
    current_north: float  # m/s
    current_east: float
    gust: float  # m/s
    drift: float  # part of the mean drift force
    heading_1: float  # oscillators of unit variance: displacement and velocity
    heading_2: float
    roll_1: float
    roll_2: float
    psi_wave: float  # first-order motion, rad, rad/s
    r_wave: float
    phi_wave: float
    p_wave: float


def sine_series(cosine: float, sine: float, a: Sines) -> float:
    """Sum of the sines of an angle's multiples, by the angle's cosine and sine (Chebyshev's recurrence)."""
    d = 2.0 * cosine
    s2 = d * sine
    s3 = d * s2 - sine
    s4 = d * s3 - s2
    s5 = d * s4 - s3
    s6 = d * s5 - s4
    return (
        a.first * sine
        + a.second * s2
        + a.third * s3
        + a.fourth * s4
        + a.fifth * s5
        + a.sixth * s6
    )


def cosine_series(cosine: float, a: Cosines) -> float:
    """Mean and sum of the cosines of an angle's multiples."""
    d = 2.0 * cosine
    c2 = d * cosine - 1.0
    c3 = d * c2 - cosine
    c4 = d * c3 - c2
    c5 = d * c4 - c3
    c6 = d * c5 - c4
    return a.mean + (
        a.first * cosine
        + a.second * c2
        + a.third * c3
        + a.fourth * c4
        + a.fifth * c5
        + a.sixth * c6
    )


def push(motion: Motion, sea: Sea, p: SeaParameters) -> Push:
    """Accelerations by wind and waves now, and the current; none in calm water."""
    if not HAS_SEA:
        return Push(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    u, v = motion.u, motion.v
    sine, cosine = sin_cos(motion.psi)
    speed = p.wind_speed + sea.gust
    # where the air comes from, as felt on board: against the wind and against her way
    # over ground
    north = speed * sea.wind_north + sea.current_north
    east = speed * sea.wind_east + sea.current_east
    ahead = north * cosine + east * sine + u
    aside = east * cosine - north * sine + v
    square = ahead * ahead + aside * aside
    per_speed = 1.0 / sqrt(max(square, LEAST))
    c, s = ahead * per_speed, aside * per_speed
    bow, beam = from_bow(sine, cosine, sea)
    drift = 1.0 + sea.drift
    surge = square * cosine_series(c, p.wind_surge) + u * fabs(u) * p.still_air
    sway = square * sine_series(c, s, p.wind_sway)
    yaw = square * sine_series(c, s, p.wind_yaw)
    roll = 0.0
    if HAS_ROLL:
        roll = square * sine_series(c, s, p.wind_roll) + drift * sine_series(
            bow, beam, p.drift_roll
        )
    return Push(
        surge + drift * cosine_series(bow, p.drift_surge),
        sway + drift * sine_series(bow, beam, p.drift_sway),
        yaw + drift * sine_series(bow, beam, p.drift_yaw),
        roll,
        sea.current_north,
        sea.current_east,
    )


def from_bow(sine: float, cosine: float, sea: Sea) -> tuple[float, float]:
    """Cosine and sine of the angle from the bow to where the waves come from, to starboard positive."""
    north, east = sea.waves_north, sea.waves_east
    return north * cosine + east * sine, east * cosine - north * sine


def encounter(bow: float, beam: float, u: float, v: float, p: SeaParameters) -> float:
    """Frequency at which the ship meets the waves of the peak, rad/s (Fossen 2011, equation 8.106)."""
    met = p.wave_frequency + p.wave_number * (u * bow + v * beam)
    return max(fabs(met), SLOWEST_ENCOUNTER * p.wave_frequency)


def encounter_frequency(motion: Motion, sea: Sea, p: SeaParameters) -> float:
    """Frequency at which a ship meets the waves, rad/s; 0 in calm water."""
    if not HAS_SEA:
        return 0.0
    sine, cosine = sin_cos(motion.psi)
    bow, beam = from_bow(sine, cosine, sea)
    return encounter(bow, beam, motion.u, motion.v, p)


def decay(x: float) -> float:
    """exp(-x) for x >= 0, to 1e-7 up to 1."""
    y = 0.25 * min(x, 8.0)
    e = 1.0 / 720.0 - y * (1.0 / 5040.0)
    e = 1.0 / 6.0 - y * (1.0 / 24.0 - y * (1.0 / 120.0 - y * e))
    e = 1.0 - y * (1.0 - y * (1.0 / 2.0 - y * e))
    return e * e * e * e


def ring(
    turn: float, p: SeaParameters
) -> tuple[float, float, float, float, float, float]:
    """Exact step of a lightly damped oscillator driven by white noise, with both states of variance 1.

    z1' = w z2, z2' = -w z1 - 2 lambda w z2 + sqrt(4 lambda w) noise, over an angle w h
    of `turn`. Returns P11, P12 = -P21 and P22 of the transition P, and the factors of
    the noise, whose covariance is I - P P'.
    """
    kept = decay(p.wave_damping * turn)
    sine, cosine = sin_cos(p.wave_ringing * turn)
    swing, stay = kept * sine / p.wave_ringing, kept * cosine
    p11, p22 = stay + p.wave_damping * swing, stay - p.wave_damping * swing
    first = 1.0 - p11 * p11 - swing * swing
    shared = swing * (p11 - p22)
    second = 1.0 - swing * swing - p22 * p22
    n22 = sqrt(max(second, LEAST))
    n12 = shared / n22
    n11 = sqrt(max(first - n12 * n12, 0.0))
    return p11, swing, p22, n11, n12, n22


def oscillated(
    z1: float, z2: float, w1: float, w2: float, step: Any
) -> tuple[float, float]:
    """An oscillator after a step of `ring` with two numbers of noise."""
    p11, p12, p22, n11, n12, n22 = step
    return p11 * z1 + p12 * z2 + n11 * w1 + n12 * w2, p22 * z2 - p12 * z1 + n22 * w2


def with_waves(
    bow: float, beam: float, frequency: float, sea: Sea, p: SeaParameters
) -> Sea:
    """The sea with the first-order motion of a ship at an angle to the waves.

    The angle is the oscillator's velocity, which is white noise through gain s / (s^2 +
    2 lambda w s + w^2). Its own derivative has no finite variance, so the rate is the
    part of it that swings, -w times the displacement: of variance w^2 and a quarter of
    a period ahead, as in waves of one frequency.
    """
    heading = sqrt(max(cosine_series(bow, p.heading_variance), 0.0))
    heel = sqrt(max(cosine_series(bow, p.roll_variance), 0.0)) if HAS_ROLL else 0.0
    return Sea(
        sea.mean_north,
        sea.mean_east,
        sea.wind_north,
        sea.wind_east,
        sea.waves_north,
        sea.waves_east,
        sea.current_north,
        sea.current_east,
        sea.gust,
        sea.drift,
        sea.heading_1,
        sea.heading_2,
        sea.roll_1,
        sea.roll_2,
        psi_wave=heading * sea.heading_2,
        r_wave=-heading * frequency * sea.heading_1,
        phi_wave=heel * sea.roll_2 if HAS_ROLL else 0.0,
        p_wave=-heel * frequency * sea.roll_1 if HAS_ROLL else 0.0,
    )


def wandered(now: float, mean: float, filter: Filter, noise: float) -> float:
    """A first-order process after a step."""
    return mean + filter.kept * (now - mean) + filter.shock * noise


def evolve(motion: Motion, h: float, sea: Sea, word: Any, p: SeaParameters) -> Sea:
    """Current, gusts, drift force and first-order motion after a step of h seconds (as of the filters).

    `motion` is the ship at the end of the step, `sea` that at its beginning, `word`
    (uint64) the state of its random numbers, which then goes on by `EVOLVE_WORDS`.
    """
    sine, cosine = sin_cos(motion.psi)
    bow, beam = from_bow(sine, cosine, sea)
    frequency = encounter(bow, beam, motion.u, motion.v, p)
    step = ring(frequency * h, p)
    heading_1, heading_2 = oscillated(
        sea.heading_1, sea.heading_2, normal(word, DRAW[4]), normal(word, DRAW[5]), step
    )
    roll_1, roll_2 = 0.0, 0.0
    if HAS_ROLL:
        roll_1, roll_2 = oscillated(
            sea.roll_1, sea.roll_2, normal(word, DRAW[6]), normal(word, DRAW[7]), step
        )
    after = Sea(
        sea.mean_north,
        sea.mean_east,
        sea.wind_north,
        sea.wind_east,
        sea.waves_north,
        sea.waves_east,
        wandered(sea.current_north, sea.mean_north, p.current, normal(word, DRAW[0])),
        wandered(sea.current_east, sea.mean_east, p.current, normal(word, DRAW[1])),
        p.gust.kept * sea.gust + p.gust.shock * normal(word, DRAW[2]),
        p.drift.kept * sea.drift + p.drift.shock * normal(word, DRAW[3]),
        heading_1,
        heading_2,
        roll_1,
        roll_2,
        0.0,
        0.0,
        0.0,
        0.0,
    )
    return with_waves(bow, beam, frequency, after, p)


def direction(given: float, word: Any, draw: Any) -> float:
    """A given direction, or one drawn from the full circle, rad."""
    drawn = 2.0 * pi * TO_UNIT * float(mix(word + draw) >> S11)
    return drawn if given != given else given


def begin_sea(motion: Motion, word: Any, p: SeaParameters) -> Sea:
    """Directions, and processes from their stationary distributions, as if the weather had always been there.

    Wind and waves without a direction come from the same one. `word` then goes on by
    `BEGIN_WORDS`.
    """
    towards_east, towards_north = sin_cos(direction(p.current_towards, word, DRAW[0]))
    mean_north, mean_east = (
        p.current_speed * towards_north,
        p.current_speed * towards_east,
    )
    wind_east, wind_north = sin_cos(direction(p.wind_from, word, DRAW[1]))
    waves_east, waves_north = sin_cos(direction(p.waves_from, word, DRAW[1]))
    sea = Sea(
        mean_north,
        mean_east,
        wind_north,
        wind_east,
        waves_north,
        waves_east,
        mean_north + p.current.deviation * normal(word, DRAW[2]),
        mean_east + p.current.deviation * normal(word, DRAW[3]),
        p.gust.deviation * normal(word, DRAW[4]),
        p.drift.deviation * normal(word, DRAW[5]),
        normal(word, DRAW[6]),
        normal(word, DRAW[7]),
        normal(word, DRAW[8]),
        normal(word, DRAW[9]),
        0.0,
        0.0,
        0.0,
        0.0,
    )
    sine, cosine = sin_cos(motion.psi)
    bow, beam = from_bow(sine, cosine, sea)
    return with_waves(bow, beam, encounter(bow, beam, motion.u, motion.v, p), sea, p)


def sea_records(windy: bool) -> tuple[Any, Any]:
    """State and parameters of the sea for a `Layout`.

    Calm water takes no rows, and is read as zeros.
    """
    return (Sea, SeaParameters) if windy else ((Sea, ()), (SeaParameters, ()))


def sea_functions(windy: bool) -> dict[str, Any]:
    """Return the functions of the sea that fill hooks, by name."""
    return {
        "HAS_SEA": windy,
        "push": push,
        "evolve": evolve,
        "begin_sea": begin_sea,
        "encounter_frequency": encounter_frequency,
    }


def sea_hooks(windy: bool, lanes: int = LANES) -> dict[str, Any]:
    """Return `sea_functions`, and those that load state and parameters, a vector for all.

    `lanes` are those of a tile of states, 64, or 1 where they are vectors.
    """
    sea, parameters = sea_records(windy)
    state_rows = Layout(sea=sea)["sea"]
    parameter_rows = Layout(parameters=parameters)["parameters"]
    return {
        **sea_functions(windy),
        "load_sea": loader(state_rows, lanes),
        "store_sea": storer(state_rows, lanes),
        "load_sea_parameters": loader(parameter_rows, 1),
    }
