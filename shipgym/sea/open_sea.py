"""Current, wind and waves around one ship: state, forces and evolution.

The ship's u, v are through the water. A current that is the same everywhere then only
moves the frame; where it varies in time, the ship is carried along like the water she
displaces (Froude-Krylov force and added mass; Fossen 2011, 8.3), so that u, v do not
feel it either.

Wind and drift forces are computed at the start of a step and held over it. Random
processes are those of `filters`. Forces are Fourier series over an angle (`series`),
already divided by the ship's inertia.
"""

from math import fabs, pi, sqrt
from typing import Any, NamedTuple

from shipgym.engine.compiled_ship import CompiledSea
from shipgym.engine.mathematics import sin_cos
from shipgym.engine.motion import CALM, HAS_ROLL, HAS_SEA, Motion, Push
from shipgym.engine.random import DRAW, S11, TO_UNIT, mix, normal
from shipgym.engine.record_code import changer
from shipgym.sea.filters import (
    Filter,
    Oscillator,
    first_order_step,
    oscillator_step,
    stepped,
)
from shipgym.sea.series import Cosines, Sines, sum_of_cosines, sum_of_sines


class Response(NamedTuple):
    """Accelerations of a ship, series over where wind or waves come from."""

    surge: Cosines
    sway: Sines
    yaw: Sines
    roll: Sines


class SeaParameters(NamedTuple):
    """The sea of a ship; a direction that is NaN is drawn for each episode."""

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
    by_wind: Response  # by (relative wind)^2, over the angle of the relative wind
    # to the mean drift force, and variances of the first-order motion, over the angle
    # of the waves
    by_waves: Response
    heading_variance: Cosines
    roll_variance: Cosines  # (rad/s2)^2, of the acceleration by the slope of the waves


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
    # oscillators of unit variance
    heading_displacement: float
    heading_velocity: float
    roll_displacement: float
    roll_velocity: float
    psi_wave: float  # first-order motion, rad, rad/s
    r_wave: float


#: (sea, current, gust, drift, the oscillators and the first-order motion)
moved = changer(Sea, *Sea._fields[Sea._fields.index("current_north") :])


class FromBow(NamedTuple):
    """Angle from the bow to where wind or waves come from, to starboard positive."""

    cosine: float
    sine: float


def from_bow(sine: float, cosine: float, north: float, east: float) -> FromBow:
    """Angle from the bow to a direction, by sine and cosine of the ship's heading."""
    return FromBow(north * cosine + east * sine, east * cosine - north * sine)


def relative_wind(
    motion: Motion, sine: float, cosine: float, sea: Sea, p: SeaParameters
) -> tuple[float, FromBow]:
    """Squared speed, m2/s2, and angle of the wind as it is felt on board."""
    speed = p.wind_speed + sea.gust
    north = speed * sea.wind_north + sea.current_north
    east = speed * sea.wind_east + sea.current_east
    from_ahead = north * cosine + east * sine
    from_aside = east * cosine - north * sine
    ahead = from_ahead + motion.u
    aside = from_aside + motion.v

    squared = ahead * ahead + aside * aside
    slowest_wind = 1e-6  # m/s, below which the relative wind has no direction
    least = slowest_wind * slowest_wind
    per_speed = 1.0 / sqrt(max(squared, least))
    angle = FromBow(cosine=ahead * per_speed, sine=aside * per_speed)
    return squared, angle


def push(motion: Motion, sea: Sea, p: SeaParameters) -> Push:
    """Accelerations by wind and waves now, and the current; none in calm water."""
    if not HAS_SEA:
        return CALM
    sine, cosine = sin_cos(motion.psi)
    squared, angle = relative_wind(motion, sine, cosine, sea, p)
    surge, sway, yaw, roll = response_to(angle, squared, p.by_wind)
    # the model's own surge has the resistance of still air already
    still_air = motion.u * fabs(motion.u) * p.still_air
    waves = from_bow(sine, cosine, sea.waves_north, sea.waves_east)
    ahead, aside, turn, heel = response_to(waves, 1.0 + sea.drift, p.by_waves)
    return Push(
        surge + still_air + ahead,
        sway + aside,
        yaw + turn,
        roll + heel + by_wave_slope(waves, sea, p),
        sea.current_north,
        sea.current_east,
    )


def response_to(
    angle: FromBow, size: float, series: Response
) -> tuple[float, float, float, float]:
    """Accelerations in surge, sway, yaw and roll at an angle, times a size."""
    cosine, sine = angle
    roll = 0.0
    if HAS_ROLL:
        roll = size * sum_of_sines(cosine, sine, series.roll)
    return (
        size * sum_of_cosines(cosine, sine, series.surge),
        size * sum_of_sines(cosine, sine, series.sway),
        size * sum_of_sines(cosine, sine, series.yaw),
        roll,
    )


def by_wave_slope(waves: FromBow, sea: Sea, p: SeaParameters) -> float:
    """Acceleration in roll by the slope of the waves that the ship meets, rad/s2."""
    if not HAS_ROLL:
        return 0.0
    variance = sum_of_cosines(waves.cosine, waves.sine, p.roll_variance)
    return sqrt(max(variance, 0.0)) * sea.roll_velocity


def waves_from_bow(motion: Motion, sea: Sea) -> FromBow:
    """Angle from the bow to where the waves come from."""
    sine, cosine = sin_cos(motion.psi)
    return from_bow(sine, cosine, sea.waves_north, sea.waves_east)


def encounter(waves: FromBow, u: float, v: float, p: SeaParameters) -> float:
    """Frequency at which a ship meets the peak's waves, rad/s; Fossen 2011, (8.106)."""
    ahead = u * waves.cosine + v * waves.sine
    met = p.wave_frequency + p.wave_number * ahead
    # Lowest frequency of encounter by that of the waves: in a following sea the filter
    # keeps turning.
    slowest_encounter = 0.1
    lowest = slowest_encounter * p.wave_frequency
    return max(fabs(met), lowest)


def encounter_frequency(motion: Motion, sea: Sea, p: SeaParameters) -> float:
    """Frequency at which a ship meets the waves, rad/s; 0 in calm water."""
    if not HAS_SEA:
        return 0.0
    waves = waves_from_bow(motion, sea)
    return encounter(waves, motion.u, motion.v, p)


def first_order_motion(
    waves: FromBow,
    frequency: float,
    heading: Oscillator,
    p: SeaParameters,
) -> tuple[float, float]:
    """Heading, rad, and its rate by waves met at an angle and a frequency, rad/s.

    The heading is the oscillator's velocity, which is white noise through gain s /
    (s^2 + 2 lambda w s + w^2). Its own derivative has no finite variance, so the rate
    is the part of it that swings, -w times the displacement: of variance w^2 and a
    quarter of a period ahead, as in waves of one frequency.
    """
    variance = sum_of_cosines(waves.cosine, waves.sine, p.heading_variance)
    yaw = sqrt(max(variance, 0.0))
    return yaw * heading.velocity, -yaw * frequency * heading.displacement


def evolve(motion: Motion, h: float, sea: Sea, word: Any, p: SeaParameters) -> Sea:
    """Sea after a step of h seconds, which are those of the filters.

    `motion` is the ship at the end of the step, `sea` that at its beginning, `word`
    (uint64) the state of its random numbers, which then goes on by `EVOLVE_WORDS`.
    """
    waves = waves_from_bow(motion, sea)
    frequency = encounter(waves, motion.u, motion.v, p)

    step = oscillator_step(frequency * h, p.wave_damping, p.wave_ringing)
    heading = Oscillator(sea.heading_displacement, sea.heading_velocity)
    heading = stepped(heading, normal(word, DRAW[4]), normal(word, DRAW[5]), step)
    roll = Oscillator(0.0, 0.0)
    if HAS_ROLL:
        roll = Oscillator(sea.roll_displacement, sea.roll_velocity)
        roll = stepped(roll, normal(word, DRAW[6]), normal(word, DRAW[7]), step)
    psi, rate = first_order_motion(waves, frequency, heading, p)

    north = first_order_step(
        sea.current_north, sea.mean_north, p.current, normal(word, DRAW[0])
    )
    east = first_order_step(
        sea.current_east, sea.mean_east, p.current, normal(word, DRAW[1])
    )
    return moved(
        sea,
        north,
        east,
        first_order_step(sea.gust, 0.0, p.gust, normal(word, DRAW[2])),
        first_order_step(sea.drift, 0.0, p.drift, normal(word, DRAW[3])),
        heading.displacement,
        heading.velocity,
        roll.displacement,
        roll.velocity,
        psi,
        rate,
    )


def direction(given: float, word: Any, draw: Any) -> float:
    """Return a direction, rad, or one drawn from the full circle where it is NaN."""
    drawn = 2.0 * pi * TO_UNIT * float(mix(word + draw) >> S11)
    return drawn if given != given else given


def begin_sea(motion: Motion, word: Any, p: SeaParameters) -> Sea:
    """Draw directions, and processes from their stationary distributions.

    The weather begins as if it had always been there. Wind and waves without a
    direction come from the same one. `word` then goes on by `BEGIN_WORDS`.
    """
    current_towards = direction(p.current_towards, word, DRAW[0])
    towards_east, towards_north = sin_cos(current_towards)
    mean_north = p.current_speed * towards_north
    mean_east = p.current_speed * towards_east
    north = p.current.deviation * normal(word, DRAW[2])
    east = p.current.deviation * normal(word, DRAW[3])

    # wind and waves of open direction come from the same one
    wind_from = direction(p.wind_from, word, DRAW[1])
    waves_from = direction(p.waves_from, word, DRAW[1])
    wind_east, wind_north = sin_cos(wind_from)
    waves_east, waves_north = sin_cos(waves_from)

    heading = Oscillator(
        displacement=normal(word, DRAW[6]),
        velocity=normal(word, DRAW[7]),
    )
    roll = Oscillator(
        displacement=normal(word, DRAW[8]),
        velocity=normal(word, DRAW[9]),
    )
    sine, cosine = sin_cos(motion.psi)
    waves = from_bow(sine, cosine, waves_north, waves_east)
    frequency = encounter(waves, motion.u, motion.v, p)
    psi, rate = first_order_motion(waves, frequency, heading, p)
    return Sea(
        mean_north=mean_north,
        mean_east=mean_east,
        wind_north=wind_north,
        wind_east=wind_east,
        waves_north=waves_north,
        waves_east=waves_east,
        current_north=mean_north + north,
        current_east=mean_east + east,
        gust=p.gust.deviation * normal(word, DRAW[4]),
        drift=p.drift.deviation * normal(word, DRAW[5]),
        heading_displacement=heading.displacement,
        heading_velocity=heading.velocity,
        roll_displacement=roll.displacement,
        roll_velocity=roll.velocity,
        psi_wave=psi,
        r_wave=rate,
    )


_FUNCTIONS = {
    "push": push,
    "evolve": evolve,
    "begin_sea": begin_sea,
    "encounter_frequency": encounter_frequency,
}
OPEN_SEA = CompiledSea(Sea, SeaParameters, {"HAS_SEA": True, **_FUNCTIONS})
#: Its records take no rows and are read as zeros.
CALM_SEA = CompiledSea((Sea, ()), (SeaParameters, ()), {"HAS_SEA": False, **_FUNCTIONS})
