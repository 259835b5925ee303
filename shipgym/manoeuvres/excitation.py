"""A rudder sequence that excites a ship for identification, drawn by a seed.

Signal: Ljung 1999, System Identification, 13.3 (pseudo-random binary signals).
"""

import numpy as np

from shipgym.checks import check_number
from shipgym.manoeuvres.execution import number_of_steps
from shipgym.models.by_name import takes_name
from shipgym.models.ship_model import ShipModel
from shipgym.models.simulate import Seed, orders, simulate
from shipgym.trials.trial import Trial


@takes_name
def prbs_rudder(
    model: ShipModel,
    amplitude_deg: float = 10.0,
    seed: Seed = 0,
    duration: float = 600.0,
    dt: float = 0.1,
) -> Trial:
    """Simulate a pseudo-random binary rudder.

    It is put from one side to the other at multiples of half the time to travel one
    ship length.

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
    duration, dt : float
        s. The samples are dt apart.
    """
    from scipy.signal import max_len_seq

    limit = model.steering.rudder_limit_deg
    check_number(
        amplitude_deg,
        "amplitude_deg",
        above=0.0,
        at_most=limit,
        hint="the rudder's limit",
    )
    times = dt * np.arange(number_of_steps(duration, dt), dtype=float)
    clock = 0.5 * model.travel_time

    n_bits = 10  # of the shift register
    rng = np.random.default_rng(seed)
    register = np.zeros(n_bits, dtype=np.int8)
    while not register.any():
        register = rng.integers(0, 2, n_bits, dtype=np.int8)
    bits, _ = max_len_seq(n_bits, state=register)

    sides = 2.0 * bits - 1.0
    ticks = times / clock * (1.0 + 1e-12)
    bit = ticks.astype(int) % len(bits)
    rudder = np.radians(amplitude_deg) * sides[bit]
    return simulate(model, orders(model, rudder), dt, kind="random")
