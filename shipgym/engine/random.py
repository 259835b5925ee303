"""Random numbers in compiled loops, replayable and the same for any number of ships.

A counter-based generator: the 64-bit finaliser of SplitMix64 (Steele, Lea & Flood 2014)
over the words (key, episode, draw). The random numbers of weather go on from a state
instead, by a step of `DRAW` each.
"""

import numpy as np

from shipgym.engine.record_code import polynomial

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
MIX_2 = np.uint64(0x94D049BB133111EB)
TO_UNIT = 1.0 / 9007199254740992.0  # 2**-53
# weather has random numbers apart from those of an episode's task
WEATHER = np.uint64(0xA0761D6478BD642F)
# and so have its normally distributed numbers
NORMAL = np.uint64(0x589965CC75374CC3)

# from a state of the generator to each number drawn at it
DRAW = tuple(np.uint64((k * 0x9E3779B97F4A7C15) % 2**64) for k in range(16))
BEGIN_WORDS = DRAW[15]  # to the next state, from that where weather begins
EVOLVE_WORDS = DRAW[8]  # and from that of a step

# shifts and masks, typed as the words are
S11 = np.uint64(11)
S16 = np.uint64(16)
S27 = np.uint64(27)
S30 = np.uint64(30)
S31 = np.uint64(31)
S32 = np.uint64(32)
QUARTERS = np.uint64(0x0000FFFF0000FFFF)
LOW_32 = np.uint64(0xFFFFFFFF)

normal_series = polynomial(
    "normal_series",
    1.6670030710794617,
    0.04695799541224908,
    0.030027949208590633,
    -0.018156674707275382,
    0.005565249837221889,
)


def mix(word: np.uint64) -> np.uint64:
    """Spread the bits of a word."""
    word = (word ^ (word >> S30)) * MIX_1
    word = (word ^ (word >> S27)) * MIX_2
    return word ^ (word >> S31)


def episode_word(key: np.uint64, episode: np.uint64) -> np.uint64:
    """Mix key and number of an episode."""
    return mix(mix(key + GOLDEN) + episode * GOLDEN)


def uniform(
    key: np.uint64,
    episode: np.uint64,
    draw: np.uint64,
    low: float,
    high: float,
) -> float:
    """Return a number in [low, high), a function of the three words alone."""
    word = mix(episode_word(key, episode) + draw * GOLDEN)
    part = float(word >> S11) * TO_UNIT
    return low + (high - low) * part


def rng_state(key: np.uint64, episode: np.uint64) -> np.uint64:
    """First state of the generator of an episode's weather."""
    return mix(episode_word(key, episode) ^ WEATHER)


def normal(word: np.uint64, draw: np.uint64) -> float:
    """Return a normally distributed number of mean 0 and variance 1, without a branch.

    The sum of four uniform numbers of 16 bits, made normal by a polynomial (Teichroew's
    method: Knuth 1998, The Art of Computer Programming 2, 3.4.1). The coefficients were
    fitted to the normal quantile of that sum's distribution: distribution function
    within 1.5e-4, kurtosis 3.0001, range +-5.2.
    """
    bits = mix(word + draw)
    even = bits & QUARTERS
    odd = (bits >> S16) & QUARTERS
    pairs = even + odd
    total = np.int32((pairs & LOW_32) + (pairs >> S32))
    t = (float(total) - 131070.0) * (1.0 / 65536.0)
    return t * normal_series(t * t)
