"""Current, wind and waves in the kernels; takes the place of `weather.py` when they are on.

The state u, v is that through the water. A current that is the same everywhere then only moves the frame;
where it varies in time, the ship is carried along like the water she displaces (Froude-Krylov force and
added mass; Fossen 2011, 8.3), so that u, v do not feel it either.

Wind and drift forces are worked out at the start of a step and held over it. Random processes are linear
filters of white noise, taken from step to step by their exact discrete form (Van Loan 1978, Computing
integrals involving the matrix exponential): their variances do not depend on the step.
"""

from __future__ import annotations

from math import fabs, pi, sqrt
from typing import Any

import numpy as np

from .accelerations import ROLL
from .compiling import inlined, pick, rare
from .layout import LANES
from .random import DRAW, S11, TO_UNIT, mix, normal
from .trigonometry import sin_cos
from .weather_rows import (
    CURRENT_DEVIATION,
    CURRENT_EAST,
    CURRENT_KEPT,
    CURRENT_NORTH,
    CURRENT_SHOCK,
    CURRENT_SPEED,
    CURRENT_TOWARDS,
    DRIFT,
    DRIFT_DEVIATION,
    DRIFT_KEPT,
    DRIFT_ROLL,
    DRIFT_SHOCK,
    DRIFT_SURGE,
    DRIFT_SWAY,
    DRIFT_YAW,
    GUST,
    GUST_DEVIATION,
    GUST_KEPT,
    GUST_SHOCK,
    HEADING_1,
    HEADING_2,
    HEADING_VARIANCE,
    MEAN_EAST,
    MEAN_NORTH,
    P_WAVE,
    PHI_WAVE,
    PSI_WAVE,
    PUSH_P,
    PUSH_R,
    PUSH_U,
    PUSH_V,
    R_WAVE,
    ROLL_1,
    ROLL_2,
    ROLL_VARIANCE,
    STILL_AIR,
    WAVE_DAMPING,
    WAVE_FREQUENCY,
    WAVE_NUMBER,
    WAVE_RINGING,
    WAVES_EAST,
    WAVES_FROM,
    WAVES_NORTH,
    WIND_EAST,
    WIND_FROM,
    WIND_NORTH,
    WIND_ROLL,
    WIND_SPEED,
    WIND_SURGE,
    WIND_SWAY,
    WIND_YAW,
)

WEATHER = True
SLOWEST_ENCOUNTER = 0.1  # of the wave frequency: in a following sea the filter keeps turning
LEAST = 1e-12

Multiples = tuple[float, float, float, float, float, float]


@inlined
def multiples(c: float, s: float) -> tuple[Multiples, Multiples]:
    """Cosines and sines of an angle's first six multiples (Chebyshev's recurrence)."""
    d = 2.0 * c
    c2, s2 = d * c - 1.0, d * s
    c3, s3 = d * c2 - c, d * s2 - s
    c4, s4 = d * c3 - c2, d * s3 - s2
    c5, s5 = d * c4 - c3, d * s4 - s3
    c6, s6 = d * c5 - c4, d * s5 - s4
    return (c, c2, c3, c4, c5, c6), (s, s2, s3, s4, s5, s6)


@inlined
def series(m: Multiples, row: int, ship: Any, lane: int) -> float:
    """Sum of six harmonics whose coefficients begin at a row."""
    return (
        ship[row + lane] * m[0]
        + ship[row + 1 * LANES + lane] * m[1]
        + ship[row + 2 * LANES + lane] * m[2]
        + ship[row + 3 * LANES + lane] * m[3]
        + ship[row + 4 * LANES + lane] * m[4]
        + ship[row + 5 * LANES + lane] * m[5]
    )


@inlined
def cosine_series(m: Multiples, row: int, ship: Any, lane: int) -> float:
    """Mean and six harmonics."""
    return ship[row + lane] + series(m, row + LANES, ship, lane)


@inlined
def feel(psi: float, u: float, v: float, sky: Any, ship: Any, lane: int) -> None:
    """Accelerations by wind and waves now (see `weather.py`)."""
    sine, cosine = sin_cos(psi)
    speed = ship[WIND_SPEED + lane] + sky[GUST + lane]
    # where the air comes from, as felt on board: against the wind and against her way over ground
    north = speed * sky[WIND_NORTH + lane] + sky[CURRENT_NORTH + lane]
    east = speed * sky[WIND_EAST + lane] + sky[CURRENT_EAST + lane]
    ahead = north * cosine + east * sine + u
    aside = east * cosine - north * sine + v
    square = ahead * ahead + aside * aside
    per_speed = 1.0 / sqrt(max(square, LEAST))
    cosines, sines = multiples(ahead * per_speed, aside * per_speed)
    a = square * cosine_series(cosines, WIND_SURGE, ship, lane) + u * fabs(u) * ship[STILL_AIR + lane]
    b = square * series(sines, WIND_SWAY, ship, lane)
    c = square * series(sines, WIND_YAW, ship, lane)
    d = square * series(sines, WIND_ROLL, ship, lane) if ROLL else 0.0

    bow, beam = from_bow(sine, cosine, sky, lane)
    cosines, sines = multiples(bow, beam)
    drift = 1.0 + sky[DRIFT + lane]
    sky[PUSH_U + lane] = a + drift * cosine_series(cosines, DRIFT_SURGE, ship, lane)
    sky[PUSH_V + lane] = b + drift * series(sines, DRIFT_SWAY, ship, lane)
    sky[PUSH_R + lane] = c + drift * series(sines, DRIFT_YAW, ship, lane)
    if ROLL:
        sky[PUSH_P + lane] = d + drift * series(sines, DRIFT_ROLL, ship, lane)


@inlined
def from_bow(sine: float, cosine: float, sky: Any, lane: int) -> tuple[float, float]:
    """Cosine and sine of the angle from the bow to where the waves come from, to starboard positive."""
    north, east = sky[WAVES_NORTH + lane], sky[WAVES_EAST + lane]
    return north * cosine + east * sine, east * cosine - north * sine


@inlined
def encounter(bow: float, beam: float, u: float, v: float, ship: Any, lane: int) -> float:
    """Frequency at which the ship meets the waves of the peak, rad/s (Fossen 2011, equation 8.106)."""
    frequency = ship[WAVE_FREQUENCY + lane]
    met = frequency + ship[WAVE_NUMBER + lane] * (u * bow + v * beam)
    return max(fabs(met), SLOWEST_ENCOUNTER * frequency)


@inlined
def meeting(psi: float, u: float, v: float, sky: Any, ship: Any, lane: int) -> float:
    """Frequency at which a ship meets the waves (see `weather.py`)."""
    sine, cosine = sin_cos(psi)
    bow, beam = from_bow(sine, cosine, sky, lane)
    return encounter(bow, beam, u, v, ship, lane)


@inlined
def decay(x: float) -> float:
    """exp(-x) for x >= 0, to 1e-7 up to 1."""
    y = 0.25 * min(x, 8.0)
    e = 1.0 - y * (
        1.0
        - y
        * (
            1.0 / 2.0
            - y * (1.0 / 6.0 - y * (1.0 / 24.0 - y * (1.0 / 120.0 - y * (1.0 / 720.0 - y * (1.0 / 5040.0)))))
        )
    )
    return e * e * e * e


@inlined
def ring(turn: float, ship: Any, lane: int) -> tuple[float, float, float, float, float, float]:
    """Exact step of a lightly damped oscillator driven by white noise, with both states of variance 1.

    z1' = w z2, z2' = -w z1 - 2 lambda w z2 + sqrt(4 lambda w) noise, over an angle w h of `turn`. Returns
    P11, P12 = -P21 and P22 of the transition P, and the factors of the noise, whose covariance is I - P P'.
    """
    damping, ringing = ship[WAVE_DAMPING + lane], ship[WAVE_RINGING + lane]
    kept = decay(damping * turn)
    sine, cosine = sin_cos(ringing * turn)
    swing, stay = kept * sine / ringing, kept * cosine
    p11, p22 = stay + damping * swing, stay - damping * swing
    first = 1.0 - p11 * p11 - swing * swing
    shared = swing * (p11 - p22)
    second = 1.0 - swing * swing - p22 * p22
    n22 = sqrt(max(second, LEAST))
    n12 = shared / n22
    n11 = sqrt(max(first - n12 * n12, 0.0))
    return p11, swing, p22, n11, n12, n22


@inlined
def show_waves(bow: float, beam: float, frequency: float, sky: Any, ship: Any, lane: int) -> None:
    """First-order motion of a ship at an angle to the waves.

    The angle is the oscillator's velocity, which is white noise through gain s / (s^2 + 2 lambda w s + w^2).
    Its own derivative has no finite variance, so the rate is the part of it that swings, -w times the
    displacement: of variance w^2 and a quarter of a period ahead, as in waves of one frequency.
    """
    cosines, _ = multiples(bow, beam)
    heading = sqrt(max(cosine_series(cosines, HEADING_VARIANCE, ship, lane), 0.0))
    sky[PSI_WAVE + lane] = heading * sky[HEADING_2 + lane]
    sky[R_WAVE + lane] = -heading * frequency * sky[HEADING_1 + lane]
    if ROLL:
        heel = sqrt(max(cosine_series(cosines, ROLL_VARIANCE, ship, lane), 0.0))
        sky[PHI_WAVE + lane] = heel * sky[ROLL_2 + lane]
        sky[P_WAVE + lane] = -heel * frequency * sky[ROLL_1 + lane]


@inlined
def evolve(
    psi: float, u: float, v: float, h: float, still: bool, sky: Any, words: Any, ship: Any, lane: int
) -> None:
    """Current, gusts, drift force and first-order motion after a step (see `weather.py`)."""
    word = words[lane]
    words[lane] = word + DRAW[8]
    kept, shock = ship[CURRENT_KEPT + lane], ship[CURRENT_SHOCK + lane]
    mean, now = sky[MEAN_NORTH + lane], sky[CURRENT_NORTH + lane]
    sky[CURRENT_NORTH + lane] = pick(still, now, mean + kept * (now - mean) + shock * normal(word, DRAW[0]))
    mean, now = sky[MEAN_EAST + lane], sky[CURRENT_EAST + lane]
    sky[CURRENT_EAST + lane] = pick(still, now, mean + kept * (now - mean) + shock * normal(word, DRAW[1]))
    now, shock = sky[GUST + lane], ship[GUST_SHOCK + lane]
    sky[GUST + lane] = pick(still, now, ship[GUST_KEPT + lane] * now + shock * normal(word, DRAW[2]))
    now, shock = sky[DRIFT + lane], ship[DRIFT_SHOCK + lane]
    sky[DRIFT + lane] = pick(still, now, ship[DRIFT_KEPT + lane] * now + shock * normal(word, DRAW[3]))

    sine, cosine = sin_cos(psi)
    bow, beam = from_bow(sine, cosine, sky, lane)
    frequency = encounter(bow, beam, u, v, ship, lane)
    p11, p12, p22, n11, n12, n22 = ring(frequency * h, ship, lane)
    z1, z2 = sky[HEADING_1 + lane], sky[HEADING_2 + lane]
    w1, w2 = normal(word, DRAW[4]), normal(word, DRAW[5])
    sky[HEADING_1 + lane] = pick(still, z1, p11 * z1 + p12 * z2 + n11 * w1 + n12 * w2)
    sky[HEADING_2 + lane] = pick(still, z2, p22 * z2 - p12 * z1 + n22 * w2)
    if ROLL:
        z3, z4 = sky[ROLL_1 + lane], sky[ROLL_2 + lane]
        w3, w4 = normal(word, DRAW[6]), normal(word, DRAW[7])
        sky[ROLL_1 + lane] = pick(still, z3, p11 * z3 + p12 * z4 + n11 * w3 + n12 * w4)
        sky[ROLL_2 + lane] = pick(still, z4, p22 * z4 - p12 * z3 + n22 * w4)
    show_waves(bow, beam, frequency, sky, ship, lane)


@inlined
def direction(given: float, word: np.uint64, draw: np.uint64) -> float:
    """A given direction, or one drawn from the full circle, rad."""
    drawn = 2.0 * pi * TO_UNIT * float(mix(word + draw) >> S11)
    return drawn if given != given else given


@rare
def begin_weather(psi: float, u: float, v: float, sky: Any, words: Any, ship: Any, lane: int) -> None:
    """Directions, and processes from their stationary distributions (see `weather.py`).

    Wind and waves without a direction come from the same one.
    """
    word = words[lane]
    words[lane] = word + DRAW[15]
    sine, cosine = sin_cos(direction(ship[CURRENT_TOWARDS + lane], word, DRAW[0]))
    sky[MEAN_NORTH + lane] = ship[CURRENT_SPEED + lane] * cosine
    sky[MEAN_EAST + lane] = ship[CURRENT_SPEED + lane] * sine
    sine, cosine = sin_cos(direction(ship[WIND_FROM + lane], word, DRAW[1]))
    sky[WIND_NORTH + lane], sky[WIND_EAST + lane] = cosine, sine
    sine, cosine = sin_cos(direction(ship[WAVES_FROM + lane], word, DRAW[1]))
    sky[WAVES_NORTH + lane], sky[WAVES_EAST + lane] = cosine, sine

    deviation = ship[CURRENT_DEVIATION + lane]
    sky[CURRENT_NORTH + lane] = sky[MEAN_NORTH + lane] + deviation * normal(word, DRAW[2])
    sky[CURRENT_EAST + lane] = sky[MEAN_EAST + lane] + deviation * normal(word, DRAW[3])
    sky[GUST + lane] = ship[GUST_DEVIATION + lane] * normal(word, DRAW[4])
    sky[DRIFT + lane] = ship[DRIFT_DEVIATION + lane] * normal(word, DRAW[5])
    sky[HEADING_1 + lane], sky[HEADING_2 + lane] = normal(word, DRAW[6]), normal(word, DRAW[7])
    sky[ROLL_1 + lane], sky[ROLL_2 + lane] = normal(word, DRAW[8]), normal(word, DRAW[9])

    sine, cosine = sin_cos(psi)
    bow, beam = from_bow(sine, cosine, sky, lane)
    show_waves(bow, beam, encounter(bow, beam, u, v, ship, lane), sky, ship, lane)
