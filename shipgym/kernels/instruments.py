"""What a ship's instruments show: first-order motion in waves, noise, and a filter against the waves."""

from __future__ import annotations

from typing import Any

import numpy as np

from .compiling import inlined, pick
from .layout import LANES, PSI, R, U, V
from .motion import clip
from .random import DRAW, mix, normal, stream
from .trigonometry import sin_cos
from .voyage_rows import (
    DT,
    ENDED,
    HEADING_FILTER,
    MISREAD_PSI,
    MISREAD_R,
    MISREAD_U,
    MISREAD_V,
    MISREAD_X,
    MISREAD_Y,
    NOISE_POSITION,
    NOISE_PSI,
    NOISE_R,
    NOISE_SPEED,
    RATE_FILTER,
    STEPS,
    TERMINATED,
    TRUNCATED,
)
from .weather import WEATHER, meeting
from .weather_rows import PSI_WAVE, R_WAVE

INSTRUMENTS_STREAM = np.uint64(0xE7037ED1A0B428DB)  # apart from the draws of task and weather
DEEP, WIDE = 0.1, 0.7  # damping ratios of the notch's numerator and denominator (Fossen 2011, 11.1.2)
STEEPEST = 2.8  # largest angle between samples that the filter is tuned to, rad


@inlined
def keeps_reading(state: Any, lane: int) -> bool:
    """Whether a ship's episode was over before the interval: then her readings stay."""
    return (state[ENDED + lane] != 0.0) & (state[TERMINATED + lane] + state[TRUNCATED + lane] == 0.0)


@inlined
def read_waves(state: Any, lane: int) -> None:
    """Compass and rate gyro turn with the first-order motion in waves."""
    stays = keeps_reading(state, lane)
    heading, rate = (state[PSI_WAVE + lane], state[R_WAVE + lane]) if WEATHER else (0.0, 0.0)
    state[MISREAD_PSI + lane] = pick(stays, state[MISREAD_PSI + lane], heading)
    state[MISREAD_R + lane] = pick(stays, state[MISREAD_R + lane], rate)


@inlined
def add_noise(state: Any, keys: Any, tile: int, settings: Any, lane: int) -> None:
    """White noise on heading, yaw rate, speeds and position."""
    stays = keeps_reading(state, lane)
    word = stream(keys[tile, 0, lane], keys[tile, 1, lane]) ^ INSTRUMENTS_STREAM
    word = mix(word + np.uint64(state[STEPS + lane]) * DRAW[1])
    heading = state[MISREAD_PSI + lane] + settings[NOISE_PSI] * normal(word, DRAW[0])
    rate = state[MISREAD_R + lane] + settings[NOISE_R] * normal(word, DRAW[1])
    speed, position = settings[NOISE_SPEED], settings[NOISE_POSITION]
    state[MISREAD_PSI + lane] = pick(stays, state[MISREAD_PSI + lane], heading)
    state[MISREAD_R + lane] = pick(stays, state[MISREAD_R + lane], rate)
    state[MISREAD_U + lane] = pick(stays, state[MISREAD_U + lane], speed * normal(word, DRAW[2]))
    state[MISREAD_V + lane] = pick(stays, state[MISREAD_V + lane], speed * normal(word, DRAW[3]))
    state[MISREAD_X + lane] = pick(stays, state[MISREAD_X + lane], position * normal(word, DRAW[4]))
    state[MISREAD_Y + lane] = pick(stays, state[MISREAD_Y + lane], position * normal(word, DRAW[5]))


@inlined
def filter_waves(state: Any, settings: Any, ship: Any, lane: int) -> None:
    """Take the frequency at which the ship meets the waves out of heading and yaw rate."""
    stays = keeps_reading(state, lane)
    frequency = meeting(state[PSI + lane], state[U + lane], state[V + lane], state, ship, lane)
    turn = clip(frequency * settings[DT], 0.0, STEEPEST)
    heading, rate = state[MISREAD_PSI + lane], state[MISREAD_R + lane]
    heading -= notched(state[PSI + lane] + heading, turn, stays, state, HEADING_FILTER, lane)
    rate -= notched(state[R + lane] + rate, turn, stays, state, RATE_FILTER, lane)
    state[MISREAD_PSI + lane] = pick(stays, state[MISREAD_PSI + lane], heading)
    state[MISREAD_R + lane] = pick(stays, state[MISREAD_R + lane], rate)


@inlined
def notched(signal: float, turn: float, stays: bool, state: Any, memory: int, lane: int) -> float:
    """What a notch filter takes away from a signal around `turn` rad a sample.

    The notch (s^2 + 2 a w s + w^2) / (s^2 + 2 b w s + w^2) is 1 less a band-pass, discretised bilinearly with
    its frequency kept. In the episode's first sample nothing is taken away.
    """
    sine, cosine = sin_cos(0.5 * turn)
    k = sine / cosine
    per = 1.0 / (1.0 + 2.0 * WIDE * k + k * k)
    x1, x2 = state[memory + lane], state[memory + LANES + lane]
    y1, y2 = state[memory + 2 * LANES + lane], state[memory + 3 * LANES + lane]
    first = state[STEPS + lane] == 0.0
    band = 2.0 * (WIDE - DEEP) * k * per * (signal - x2)
    taken = band - 2.0 * (k * k - 1.0) * per * y1 - (1.0 - 2.0 * WIDE * k + k * k) * per * y2
    taken = pick(first, 0.0, taken)
    state[memory + lane] = pick(stays, x1, signal)
    state[memory + LANES + lane] = pick(stays, x2, pick(first, signal, x1))
    state[memory + 2 * LANES + lane] = pick(stays, y1, taken)
    state[memory + 3 * LANES + lane] = pick(stays, y2, pick(first, 0.0, y1))
    return taken
