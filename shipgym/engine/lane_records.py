"""Records that loops keep of a lane, besides those of ship, sea, sensors and task."""

from typing import Any, NamedTuple

CONSTRAINT = "constraint_"  # prefix of the names of constraints in `Engine.info`


class Rules(NamedTuple):
    """Settings of the engine."""

    dt: float  # s, control interval
    substeps: float  # of the integration in it
    time_limit: float  # control intervals
    cut_off: float  # control intervals after which an episode is truncated
    largest_distance: float  # from the data of the model at which an episode ends
    least_shaft: float  # least command of the shaft, part of service speed
    half_reward_cost: float  # that halves a bounded reward; 0 where it has no bounds
    perfect_step: float  # bounded reward of a step without cost
    loss_horizon: float  # control intervals that the end of an episode stands for


class Commands(NamedTuple):
    """Commands of a lane."""

    rudder_command: float  # part of the limit
    shaft_command: float  # part of the shaft speed at service speed
    rudder_before: float  # rad, rudder at the beginning of the interval


class EpisodeCounters(NamedTuple):
    """Progress of the episode of a lane."""

    steps: float  # control intervals so far
    ended: float  # 1 once the episode is over
    ran_away: float  # 1 if the ship left every physical range in the interval
    episode_cost: float  # sum of the costs so far


class Outcome(NamedTuple):
    """Result of an interval, in addition to the task's own quantities."""

    reward: float
    terminated: float  # 1 or 0
    truncated: float
    envelope_distance: float
    extrapolating: float  # 1 or 0
    end: float  # part of the reward: the rest of an episode that failed
    cost: float  # minus the sum of all parts


class SeaRandom(NamedTuple):
    """Generator of the random numbers of a lane's sea."""

    rng_state: Any  # uint64


class Point(NamedTuple):
    """Position of a ship in the coordinates of her table."""

    a: float
    b: float
    c: float
    d: float
    half: float  # half the squared distance from the origin


class Sums(NamedTuple):
    """Sums over the rows of the table, of surge, sway and yaw."""

    u: float
    v: float
    r: float


class SeaChannels(NamedTuple):
    """Channels of the sea that are recorded in addition to the state."""

    psi_wave: float  # rad, first-order motion in heading
    r_wave: float  # rad/s, in yaw rate
    current_north: float  # m/s
    current_east: float  # m/s
    wind_speed: float  # m/s
    wind_from: float  # rad


class Random(NamedTuple):
    """Key of the random numbers of one episode.

    Each number is a function of the key, the episode and its own number alone.
    """

    key: Any  # uint64
    episode: Any  # uint64


class Interval(NamedTuple):
    """Control interval that is over."""

    dt: float  # s
    steps: float  # control intervals so far
    rudder_before: float  # rad, rudder at its beginning
    rudder_command: float  # part of the limit
    shaft_command: float  # part of the shaft speed at service speed
    # distance from the training data (`Envelope.distance`)
    envelope_distance: float
    extrapolating: float  # 1 where the ship was outside that data


class Readings(NamedTuple):
    """The readings of the ship's instruments."""

    x: float  # m, north
    y: float  # m, east
    psi: float  # rad
    u: float  # m/s, through the water
    v: float  # m/s
    r: float  # rad/s
    p: float  # rad/s
    phi: float  # rad
    delta: float  # rad
    n: float  # 1/s
    track_psi: float  # rad, heading to which the velocity over ground is referred
    ahead: float  # m/s, over ground, ahead
    aside: float  # m/s, over ground, to starboard
