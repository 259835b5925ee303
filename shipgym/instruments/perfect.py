"""Instruments without error, in calm water."""

from typing import NamedTuple

from shipgym.engine.lane_records import Interval, Random, Readings
from shipgym.engine.motion import Motion, ground_velocity
from shipgym.sea.open_sea import Sea


class Settings(NamedTuple):
    """Settings of the sensor set: none."""

    unused: float = 0.0


class Memory(NamedTuple):
    """Memory from sample to sample: none."""

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
    """Take a sample: the memory of the instruments after it.

    Parameters
    ----------
    motion : Motion
        Motion of the ship.
    sea : Sea
        Current, wind and waves around her.
    memory : Memory
        Memory after the sample before; zeros at the beginning of an episode.
    frequency : float
        Frequency at which she meets the waves, rad/s.
    interval : Interval
        The control interval that ends with the sample.
    settings : Settings
        Settings of the sensor set.
    random : Random
        Key of the episode's random numbers.
    """
    return memory


def readings(motion: Motion, sea: Sea, memory: Memory) -> Readings:
    """Readings for the task: the motion itself."""
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
