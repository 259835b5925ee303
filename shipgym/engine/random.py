"""Random numbers in compiled loops: a counter-based generator, replayable and the same for any batch size.

The 64-bit finaliser of SplitMix64 (Steele, Lea & Flood 2014) over the words (key,
episode, draw).
"""

import numpy as np

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
MIX_2 = np.uint64(0x94D049BB133111EB)
S27, S30, S31, S11 = np.uint64(27), np.uint64(30), np.uint64(31), np.uint64(11)
TO_UNIT = 1.0 / 9007199254740992.0  # 2**-53
WEATHER_STREAM = np.uint64(
    0xA0761D6478BD642F
)  # apart from the draws of an episode's task
#: Steps from a state of the generator to each number drawn at it, and to the next
#: state.
DRAW = tuple(np.uint64((k * 0x9E3779B97F4A7C15) % 2**64) for k in range(16))
BEGIN_WORDS, EVOLVE_WORDS = (
    DRAW[15],
    DRAW[8],
)  # steps where weather begins, and where it goes on
S16, S32 = np.uint64(16), np.uint64(32)
QUARTERS, LOW_32 = np.uint64(0x0000FFFF0000FFFF), np.uint64(0xFFFFFFFF)


def mix(word: np.uint64) -> np.uint64:
    """Spread the bits of a word."""
    word = (word ^ (word >> S30)) * MIX_1
    word = (word ^ (word >> S27)) * MIX_2
    return word ^ (word >> S31)


def uniform(
    key: np.uint64, episode: np.uint64, draw: np.uint64, low: float, high: float
) -> float:
    """A number in [low, high), a function of the three words alone."""
    word = mix(mix(mix(key + GOLDEN) + episode * GOLDEN) + draw * GOLDEN)
    return low + (high - low) * (float(word >> S11) * TO_UNIT)


def stream(key: np.uint64, episode: np.uint64) -> np.uint64:
    """First state of the generator of an episode's weather; a step of it is one of `DRAW`."""
    return mix(mix(mix(key + GOLDEN) + episode * GOLDEN) ^ WEATHER_STREAM)


def normal(word: np.uint64, draw: np.uint64) -> float:
    """A normally distributed number of mean 0 and variance 1, without a branch.

    The sum of four uniform numbers of 16 bits, made normal by a polynomial (Teichroew's
    method: Knuth 1998, The Art of Computer Programming 2, 3.4.1). The coefficients were
    fitted to the normal quantile of that sum's distribution: distribution function
    within 1.5e-4, kurtosis 3.0001, range +-5.2.
    """
    bits = mix(word + draw)
    pairs = (bits & QUARTERS) + ((bits >> S16) & QUARTERS)
    total = np.int32((pairs & LOW_32) + (pairs >> S32))
    t = (float(total) - 131070.0) * (1.0 / 65536.0)
    z = t * t
    rest = 0.030027949208590633 + z * (-0.018156674707275382 + z * 0.005565249837221889)
    return t * (1.6670030710794617 + z * (0.04695799541224908 + z * rest))
