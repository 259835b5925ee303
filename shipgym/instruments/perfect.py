"""Instruments without error, in calm water."""

from typing import NamedTuple

from shipgym.engine.motion import Motion, ground_velocity
from shipgym.sea.open_sea import Sea
from shipgym.tasks.contract import Interval, Random, Readings


class Settings(NamedTuple):
    """There are none."""

    unused: float = 0.0


class Memory(NamedTuple):
    """There is none."""

    unused: float


def measure(
    motion: Motion,
    sea: Sea,
    memory: Memory,
    frequency: float,
    interval: Interval,
    settings: Settings,
    random: Random,
) -> Memory:
    """What is remembered from sample to sample.

    Parameters
    ----------
    motion : Motion
        The ship.
    sea : Sea
        Around her.
    memory : Memory
        Of the sample before; zeros at the beginning of an episode.
    frequency : float
        At which she meets the waves, rad/s.
    interval : Interval
        That is over.
    settings : Settings
        Of the sensor set.
    random : Random
        Of the episode.
    """
    return memory


def readings(motion: Motion, sea: Sea, memory: Memory) -> Readings:
    """What is shown."""
    ahead, aside = ground_velocity(motion, sea.current_north, sea.current_east)
    return Readings(
        motion.x,
        motion.y,
        motion.psi,
        motion.u,
        motion.v,
        motion.r,
        motion.p,
        motion.phi,
        motion.delta,
        motion.n,
        motion.psi,
        ahead,
        aside,
    )
