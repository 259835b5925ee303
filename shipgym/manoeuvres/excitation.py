"""Rudder and shaft sequences that excite a ship for identification, drawn by a seed.

Signals: Ljung 1999, System Identification, 13.3 (pseudo-random binary and multi-sine
signals).
"""

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_number
from shipgym.errors import InputError
from shipgym.manoeuvres.execution import number_of_steps
from shipgym.models.by_name import takes_name
from shipgym.models.ship_model import ShipModel
from shipgym.models.simulate import Seed, orders, simulate
from shipgym.sea.conditions import Weather
from shipgym.trials.trial import Trial


@takes_name
def prbs_rudder(
    model: ShipModel,
    amplitude_deg: float = 10.0,
    seed: Seed = 0,
    clock_s: float | None = None,
    duration: float = 600.0,
    dt: float = 0.1,
    water_depth: float = np.inf,
    weather: Weather | str | None = None,
) -> Trial:
    """Simulate a pseudo-random binary rudder.

    It is put from one side to the other at multiples of a clock period.

    Raises InputError for an amplitude beyond the rudder's limit, or a time that is not
    above 0. Raises UnstableModelError if the ship runs away.

    Parameters
    ----------
    model : ShipModel
        The ship, straight ahead at service speed.
    amplitude_deg : float
        Rudder angle to either side, degrees.
    seed : int or Generator
        Where in the sequence of maximal length (10 bits, 1023 clock periods) to start.
    clock_s : float, optional
        Clock period, s; by default half the time to travel one ship length.
    duration, dt : float
        s. The samples are dt apart.
    water_depth : float
        m, for ships whose equations cover shallow water.
    weather : Weather or str, optional
        A weather or the name of a sea state, with the same seed; by default calm.
    """
    from scipy.signal import max_len_seq

    amplitude = _rudder_angle(model, amplitude_deg, "amplitude_deg")
    times = _times(duration, dt)
    clock = _seconds(model, clock_s, 0.5)
    if clock_s is not None:
        check_number(clock, "clock_s", at_least=dt)

    n_bits = 10  # of the shift register
    rng = np.random.default_rng(seed)
    register = np.zeros(n_bits, dtype=np.int8)
    while not register.any():
        register = rng.integers(0, 2, n_bits, dtype=np.int8)
    bits, _ = max_len_seq(n_bits, state=register)

    sides = 2.0 * bits - 1.0
    ticks = times / clock * (1.0 + 1e-12)
    bit = ticks.astype(int) % len(bits)
    return simulate(
        model,
        orders(model, amplitude * sides[bit]),
        dt,
        water_depth=water_depth,
        kind="random",
        weather=weather,
        seed=seed,
    )


@takes_name
def shaft_speed_steps(
    model: ShipModel,
    lowest_ratio: float = 0.5,
    highest_ratio: float = 1.1,
    seed: Seed = 0,
    shortest_s: float | None = None,
    longest_s: float | None = None,
    rudder_deg: float = 0.0,
    duration: float = 1200.0,
    dt: float = 0.1,
    water_depth: float = np.inf,
    weather: Weather | str | None = None,
) -> Trial:
    """Simulate steps of the ordered shaft speed, of random speed and length.

    Both are evenly distributed: orders are `lowest_ratio` to `highest_ratio` of the
    shaft speed at service speed, ahead and at most 1.5, each held for `shortest_s` to
    `longest_s`, s, by default 5 to 15 times the time to travel one ship length; the
    rudder is held at `rudder_deg` meanwhile, degrees. The seed is that of the steps;
    otherwise as `prbs_rudder`. InputError too for a ship whose propeller is not in its
    equations.
    """
    service = shaft_of(model)
    check_number(
        lowest_ratio,
        "lowest_ratio",
        above=0.0,
        at_most=1.5,
        hint="part of the service shaft speed",
    )
    check_number(highest_ratio, "highest_ratio", above=lowest_ratio, at_most=1.5)
    limit = model.steering.rudder_limit_deg
    check_number(
        rudder_deg,
        "rudder_deg",
        at_least=-limit,
        at_most=limit,
        hint="the rudder's limit",
    )
    times = _times(duration, dt)
    shortest = _seconds(model, shortest_s, 5.0)
    longest = _seconds(model, longest_s, 15.0)
    ratios = random_levels(
        times, (lowest_ratio, highest_ratio), shortest, longest, seed
    )
    rudder = np.full(len(times), np.radians(rudder_deg))
    return simulate(
        model,
        orders(model, rudder, service * ratios),
        dt,
        water_depth=water_depth,
        kind="random",
        weather=weather,
        seed=seed,
    )


def shaft_of(model: ShipModel) -> float:
    """Shaft speed at service speed, 1/s; InputError for a ship without a shaft."""
    if "n" not in model.command_names:
        raise InputError(
            f"model {model.name!r}: expected one that is ordered a shaft speed, got"
            f" the commands {', '.join(model.command_names)}; its thrust is inside its"
            " surge coefficients: use a ship with a propeller, such as 'container' or"
            " 'tanker'"
        )
    return model.service_shaft_speed


def random_levels(
    times: Floats,
    levels: tuple[float, float],
    shortest: float,
    longest: float,
    seed: Seed,
) -> Floats:
    """Random levels held for random lengths, at times that begin with 0."""
    check_number(shortest, "shortest_s", above=0.0)
    check_number(longest, "longest_s", at_least=shortest, hint="shortest_s or more")
    rng = np.random.default_rng(seed)
    most = int(times[-1] / shortest) + 2
    durations = rng.uniform(shortest, longest, most)
    drawn: Floats = rng.uniform(*levels, most)
    ends = np.cumsum(durations)
    place = np.searchsorted(ends, times, side="right")
    return drawn[place]


def _rudder_angle(model: ShipModel, angle_deg: float, argument: str) -> float:
    """An angle within the rudder's limit, rad."""
    limit = model.steering.rudder_limit_deg
    angle = check_number(
        angle_deg, argument, above=0.0, at_most=limit, hint="the rudder's limit"
    )
    return float(np.radians(angle))


def _seconds(model: ShipModel, given: float | None, lengths: float) -> float:
    """The duration that was given, or the time to travel some ship lengths, s."""
    return lengths * model.travel_time if given is None else given


def _times(duration: float, dt: float) -> Floats:
    """Start of each step, s."""
    return dt * np.arange(number_of_steps(duration, dt), dtype=float)
