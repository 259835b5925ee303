"""Instruments of a bridge: motion in waves, noise, a satellite receiver, a filter.

The filter is against the waves. The receiver's velocity over ground lags by
`RECEIVER_LAG` where instruments are noisy.

The notch filter (s^2 + 2 a w s + w^2) / (s^2 + 2 b w s + w^2) around the frequency of
encounter: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control,
11.1.2.
"""

from typing import NamedTuple

import numpy as np

from shipgym.engine.lane_records import Interval, Random, Readings
from shipgym.engine.mathematics import clip, pick, sin_cos
from shipgym.engine.motion import Motion, ground_velocity
from shipgym.engine.random import DRAW, mix, normal, rng_state
from shipgym.sea.open_sea import Sea

#: Random numbers of the instruments, apart from those of task and weather.
INSTRUMENTS_STREAM = np.uint64(0xE7037ED1A0B428DB)
#: Damping ratios a and b of the notch's numerator and denominator.
DEEP, WIDE = 0.1, 0.7
RECEIVER_LAG = 3.0  # s, time constant of the velocity over ground

HAS_NOISE, HAS_FILTER = True, True  # known when compiled


class Settings(NamedTuple):
    """Standard deviations of white noise."""

    heading: float = 0.0  # rad
    yaw_rate: float = 0.0  # rad/s
    speed: float = 0.0  # m/s, of surge and sway
    position: float = 0.0  # m
    ground: float = 0.0  # m/s, of the velocity over ground, north and east


class Notch(NamedTuple):
    """Memory of the notch filter: the last two signals, and the parts subtracted."""

    signal_1: float
    signal_2: float
    taken_1: float
    taken_2: float


class Noise(NamedTuple):
    """White noise of one sample."""

    psi: float
    r: float
    u: float
    v: float
    x: float
    y: float
    north: float
    east: float


class Memory(NamedTuple):
    """Additions of the instruments to the slow motion, and states of the filters."""

    x: float
    y: float
    psi: float
    u: float
    v: float
    r: float
    north: float  # m/s, velocity over ground after the lag of the receiver
    east: float
    ground_north: float  # the same with noise, less the true one
    ground_east: float
    heading: Notch
    rate: Notch


def measure(
    motion: Motion,
    sea: Sea,
    memory: Memory,
    frequency: float,
    interval: Interval,
    settings: Settings,
    random: Random,
) -> Memory:
    """Add first-order motion, noise and lag; subtract the filter's estimate of waves.

    See `shipgym.instruments.perfect` for the arguments.
    """
    noise = Noise(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    north, east = over_ground(motion, sea)
    lagged_north, lagged_east = north, east
    if HAS_NOISE:
        noise = drawn_noise(interval, settings, random)
        share = interval.dt / (interval.dt + RECEIVER_LAG)
        share = pick(interval.steps == 0.0, 1.0, share)
        lagged_north = memory.north + share * (north - memory.north)
        lagged_east = memory.east + share * (east - memory.east)
    psi = sea.psi_wave + noise.psi
    r = sea.r_wave + noise.r
    heading = memory.heading
    rate = memory.rate
    steepest = 2.8  # largest angle between samples that the filter is tuned to, rad
    if HAS_FILTER:
        turn = clip(frequency * interval.dt, 0.0, steepest)
        first = interval.steps == 0.0
        heading = notched(motion.psi + psi, turn, first, memory.heading)
        rate = notched(motion.r + r, turn, first, memory.rate)
        psi -= heading.taken_1
        r -= rate.taken_1
    return Memory(
        x=noise.x,
        y=noise.y,
        psi=psi,
        u=noise.u,
        v=noise.v,
        r=r,
        north=lagged_north,
        east=lagged_east,
        ground_north=lagged_north + noise.north - north,
        ground_east=lagged_east + noise.east - east,
        heading=heading,
        rate=rate,
    )


def drawn_noise(interval: Interval, settings: Settings, random: Random) -> Noise:
    """Noise of a sample, drawn by its number in the episode."""
    word = rng_state(random.key, random.episode) ^ INSTRUMENTS_STREAM
    word = mix(word + np.uint64(interval.steps) * DRAW[1])
    return Noise(
        psi=settings.heading * normal(word, DRAW[0]),
        r=settings.yaw_rate * normal(word, DRAW[1]),
        u=settings.speed * normal(word, DRAW[2]),
        v=settings.speed * normal(word, DRAW[3]),
        x=settings.position * normal(word, DRAW[4]),
        y=settings.position * normal(word, DRAW[5]),
        north=settings.ground * normal(word, DRAW[6]),
        east=settings.ground * normal(word, DRAW[7]),
    )


def over_ground(motion: Motion, sea: Sea) -> tuple[float, float]:
    """Velocity over ground to the north and to the east, m/s."""
    ahead, aside = ground_velocity(motion, sea.current_north, sea.current_east)
    sine, cosine = sin_cos(motion.psi)
    return cosine * ahead - sine * aside, sine * ahead + cosine * aside


def notched(signal: float, turn: float, first: bool, memory: Notch) -> Notch:
    """Memory of a notch filter after a sample, around `turn` rad a sample.

    `taken_1` is what it takes away.

    The notch is 1 less a band-pass, discretised bilinearly with its frequency kept. In
    the episode's first sample nothing is taken away.
    """
    sine, cosine = sin_cos(0.5 * turn)
    k = sine / cosine
    kk = k * k
    per = 1.0 / (1.0 + 2.0 * WIDE * k + kk)
    band = 2.0 * (WIDE - DEEP) * k * per * (signal - memory.signal_2)
    taken = (
        band
        - 2.0 * (kk - 1.0) * per * memory.taken_1
        - (1.0 - 2.0 * WIDE * k + kk) * per * memory.taken_2
    )
    return Notch(
        signal_1=signal,
        signal_2=pick(first, signal, memory.signal_1),
        taken_1=pick(first, 0.0, taken),
        taken_2=pick(first, 0.0, memory.taken_1),
    )


def readings(motion: Motion, sea: Sea, memory: Memory) -> Readings:
    """Readings: the ship's motion plus the additions of the instruments."""
    ahead, aside = ground_velocity(motion, sea.current_north, sea.current_east)
    if HAS_NOISE:
        sine, cosine = sin_cos(motion.psi)
        ahead += cosine * memory.ground_north + sine * memory.ground_east
        aside += cosine * memory.ground_east - sine * memory.ground_north
    return Readings(
        motion.x + memory.x,
        motion.y + memory.y,
        motion.psi + memory.psi,
        motion.u + memory.u,
        motion.v + memory.v,
        motion.r + memory.r,
        motion.p,
        motion.phi,
        motion.delta,
        motion.n,
        motion.psi,
        ahead,
        aside,
    )
