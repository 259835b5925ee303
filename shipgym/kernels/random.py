"""Random numbers in kernels: a counter-based generator, replayable and the same for any batch size.

The 64-bit finaliser of SplitMix64 (Steele, Lea & Flood 2014) over the words (key, episode, draw).
"""

from __future__ import annotations

import numpy as np

from .compiling import inlined

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
MIX_2 = np.uint64(0x94D049BB133111EB)
S27, S30, S31, S11 = np.uint64(27), np.uint64(30), np.uint64(31), np.uint64(11)
TO_UNIT = 1.0 / 9007199254740992.0  # 2**-53


@inlined
def mix(word: np.uint64) -> np.uint64:
    """Spread the bits of a word."""
    word = (word ^ (word >> S30)) * MIX_1
    word = (word ^ (word >> S27)) * MIX_2
    return word ^ (word >> S31)


@inlined
def uniform(key: np.uint64, episode: np.uint64, draw: np.uint64, low: float, high: float) -> float:
    """A number in [low, high), a function of the three words alone."""
    word = mix(mix(mix(key + GOLDEN) + episode * GOLDEN) + draw * GOLDEN)
    return low + (high - low) * (float(word >> S11) * TO_UNIT)
