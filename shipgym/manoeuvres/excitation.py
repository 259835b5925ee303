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
def multi_sine_rudder(
    model: ShipModel,
    amplitude_deg: float = 10.0,
    seed: Seed = 0,
    longest_period_s: float | None = None,
    shortest_period_s: float | None = None,
    duration: float = 600.0,
    dt: float = 0.1,
    water_depth: float = np.inf,
    weather: Weather | str | None = None,
) -> Trial:
    """Simulate a multi-sine rudder, of harmonics of equal amplitude.

    These are all multiples of 1 / duration in a band from `longest_period_s` to
    `shortest_period_s`, s, by default 20 and 2 times the time to travel one ship
    length; InputError for one without a harmonic or beyond the samples. The phases, of
    the seed, are the draw with the smallest crest among 32; the amplitude is the
    largest rudder angle, degrees. Otherwise as `prbs_rudder`.
    """
    amplitude = _rudder_angle(model, amplitude_deg, "amplitude_deg")
    times = _times(duration, dt)
    longest = _seconds(model, longest_period_s, 20.0)
    shortest = _seconds(model, shortest_period_s, 2.0)
    check_number(shortest, "shortest_period_s", at_least=2.0 * dt, hint="two samples")
    check_number(
        longest,
        "longest_period_s",
        above=shortest,
        hint="the band goes from long to short",
    )
    whole = len(times) * dt
    slack = 1e-9
    lowest = max(np.ceil(whole / longest - slack), 1.0)
    highest = np.floor(whole / shortest + slack)
    harmonics = np.arange(lowest, highest + 1.0)
    if not len(harmonics):
        raise InputError(
            "duration: expected at least one whole period in the band of"
            f" {shortest:g} to {longest:g} s, got {duration:g} s; sail longer or widen"
            " the band"
        )

    rudder = amplitude * _least_crest(harmonics, times / whole, seed)
    return simulate(
        model,
        orders(model, rudder),
        dt,
        water_depth=water_depth,
        kind="random",
        weather=weather,
        seed=seed,
    )


def _least_crest(harmonics: Floats, turns: Floats, seed: Seed) -> Floats:
    """Sum of harmonics with its largest value 1, over parts of the longest period."""
    rng = np.random.default_rng(seed)
    circle = 2.0 * np.pi
    phases = rng.uniform(0.0, circle, (32, len(harmonics)))
    angles = circle * np.outer(harmonics, turns)

    # cos(angle + phase), summed over the harmonics
    in_phase = np.cos(phases) @ np.cos(angles)
    out_of_phase = np.sin(phases) @ np.sin(angles)
    waves = in_phase - out_of_phase
    crests = np.abs(waves).max(axis=1)
    best = int(np.argmin(crests))
    return np.asarray(waves[best] / crests[best])


@takes_name
def random_rudder_steps(
    model: ShipModel,
    largest_deg: float = 20.0,
    seed: Seed = 0,
    shortest_s: float | None = None,
    longest_s: float | None = None,
    duration: float = 600.0,
    dt: float = 0.1,
    water_depth: float = np.inf,
    weather: Weather | str | None = None,
) -> Trial:
    """Simulate rudder steps of random angle and length, both evenly distributed.

    Angles are up to `largest_deg` to either side, degrees, each held for `shortest_s`
    to `longest_s`, s, by default 0.5 to 4 times the time to travel one ship length. The
    seed is that of the steps; otherwise as `prbs_rudder`.
    """
    largest = _rudder_angle(model, largest_deg, "largest_deg")
    times = _times(duration, dt)
    shortest = _seconds(model, shortest_s, 0.5)
    longest = _seconds(model, longest_s, 4.0)
    rudder = random_levels(times, (-largest, largest), shortest, longest, seed)
    return simulate(
        model,
        orders(model, rudder),
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
