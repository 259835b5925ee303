"""Rudder and shaft sequences that excite a ship for identification, each replayed by its seed.

Signals: Ljung 1999, System Identification, 13.3 (pseudo-random binary and multi-sine
signals).
"""

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_number
from shipgym.errors import InputError
from shipgym.manoeuvres.execution import number_of_steps
from shipgym.sea.conditions import Weather
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.simulate import Seed, orders, simulate
from shipgym.trials.trial import Trial

CLOCK = 0.5  # of the binary sequence, L / U0
PERIODS = 20.0, 2.0  # longest and shortest of the multi-sine, L / U0
REGISTER = (
    10  # bits of the shift register: the sequence repeats after 1023 clock periods
)
TRIES = 32  # draws of phases from which the multi-sine of least crest is taken
RUDDER_STEPS = 0.5, 4.0  # shortest and longest of random rudder steps, L / U0
SHAFT_STEPS = 5.0, 15.0  # of shaft-speed steps, L / U0


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
    """Simulate a pseudo-random binary rudder: from one side to the other at multiples of a clock period.

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
    (clock,) = _durations(model, (clock_s,), (CLOCK,))
    if clock_s is not None:
        check_number(clock, "clock_s", at_least=dt)
    register = np.zeros(REGISTER, dtype=np.int8)
    while not register.any():
        register = np.random.default_rng(seed).integers(0, 2, REGISTER, dtype=np.int8)
    bits, _ = max_len_seq(REGISTER, state=register)
    tick = np.floor(times / clock * (1.0 + 1e-12)).astype(int)
    rudder = amplitude * (2.0 * bits[tick % len(bits)] - 1.0)
    return simulate(
        model, orders(model, rudder), dt, None, water_depth, "random", weather, seed
    )


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
    """Simulate a multi-sine rudder: all harmonics of 1 / duration in a band, of equal amplitude.

    The phases, of the seed, are the draw with the smallest crest among 32; the
    amplitude is the largest rudder angle, degrees. The band is from `longest_period_s`
    to `shortest_period_s`, s, by default 20 and 2 times the time to travel one ship
    length; InputError for one without a harmonic or beyond the samples. Otherwise as
    `prbs_rudder`.
    """
    amplitude = _rudder_angle(model, amplitude_deg, "amplitude_deg")
    times = _times(duration, dt)
    longest, shortest = _durations(
        model, (longest_period_s, shortest_period_s), PERIODS
    )
    check_number(shortest, "shortest_period_s", at_least=2.0 * dt, hint="two samples")
    check_number(
        longest,
        "longest_period_s",
        above=shortest,
        hint="the band goes from long to short",
    )
    period = len(times) * dt
    slack = 1e-9
    harmonics = np.arange(
        np.ceil(period / longest - slack), np.floor(period / shortest + slack) + 1.0
    )
    harmonics = harmonics[harmonics >= 1.0]
    if not len(harmonics):
        raise InputError(
            f"duration: {duration:g} s found, expected at least one whole period in the"
            f" band of {shortest:g} to {longest:g} s; sail longer or widen the band"
        )
    phases = np.random.default_rng(seed).uniform(
        0.0, 2.0 * np.pi, (TRIES, len(harmonics))
    )
    angle = 2.0 * np.pi * np.outer(harmonics, times / period)
    waves = np.cos(phases) @ np.cos(angle) - np.sin(phases) @ np.sin(angle)
    crests = np.abs(waves).max(axis=1)
    best = int(np.argmin(crests))
    rudder = amplitude * waves[best] / crests[best]
    return simulate(
        model, orders(model, rudder), dt, None, water_depth, "random", weather, seed
    )


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
    lengths = _durations(model, (shortest_s, longest_s), RUDDER_STEPS)
    rudder = _steps(times, (-largest, largest), lengths, seed)
    return simulate(
        model, orders(model, rudder), dt, None, water_depth, "random", weather, seed
    )


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
    """Simulate steps of the ordered shaft speed, of random speed and length, both evenly distributed.

    Orders are `lowest_ratio` to `highest_ratio` of the shaft speed at service speed,
    ahead and at most 1.5, each held for `shortest_s` to `longest_s`, s, by default 5 to
    15 times the time to travel one ship length; the rudder is held at `rudder_deg`
    meanwhile, degrees. The seed is that of the steps; otherwise as `prbs_rudder`.
    InputError too for a ship whose propeller is not in its equations.
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
    lengths = _durations(model, (shortest_s, longest_s), SHAFT_STEPS)
    shaft = service * _steps(times, (lowest_ratio, highest_ratio), lengths, seed)
    commands = orders(model, np.full(len(times), np.radians(rudder_deg)), shaft)
    return simulate(model, commands, dt, None, water_depth, "random", weather, seed)


def shaft_of(model: ShipModel) -> float:
    """Shaft speed at service speed, 1/s; InputError where the thrust is part of the hull's coefficients."""
    if "n" not in model.command_names:
        raise InputError(
            f"model {model.name!r}: no shaft speed among its commands"
            f" ({', '.join(model.command_names)}), its thrust is inside its surge"
            " coefficients; use a ship with a propeller, such as 'container' or"
            " 'tanker'"
        )
    return model.service_shaft_speed


def _steps(
    times: Floats, levels: tuple[float, float], lengths: tuple[float, ...], seed: Seed
) -> Floats:
    """Random levels of random lengths, both from a range; of the shape of the times, which begin with 0."""
    shortest, longest = lengths
    check_number(shortest, "shortest_s", above=0.0)
    check_number(longest, "longest_s", at_least=shortest, hint="shortest_s or more")
    rng = np.random.default_rng(seed)
    most = int(times[-1] / shortest) + 2
    ends = np.cumsum(rng.uniform(shortest, longest, most))
    drawn: Floats = rng.uniform(*levels, most)
    return drawn[np.searchsorted(ends, times, side="right")]


def _rudder_angle(model: ShipModel, angle_deg: float, argument: str) -> float:
    """An angle within the rudder's limit, rad."""
    limit = model.steering.rudder_limit_deg
    angle = check_number(
        angle_deg, argument, above=0.0, at_most=limit, hint="the rudder's limit"
    )
    return float(np.radians(angle))


def _durations(
    model: ShipModel, given: tuple[float | None, ...], usual: tuple[float, ...]
) -> tuple[float, ...]:
    """The given durations, or the usual ones in times to travel one ship length; s."""
    pairs = zip(given, usual, strict=True)
    return tuple(
        count * model.travel_time if own is None else own for own, count in pairs
    )


def _times(duration: float, dt: float) -> Floats:
    """Start of each step, s."""
    return dt * np.arange(number_of_steps(duration, dt), dtype=float)
