"""The steering gear of a ship, estimated from recorded rudder angles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.regression.preprocess import is_noisy
from identification.regression.rudder import rebuild
from shipgym.ships.steering import SteeringGear
from shipgym.trials.trial import Trial

USUAL_LIMIT_DEG = 35.0
MOVING = 0.5  # of the fastest move: faster ones are taken for the gear's own rate
FAST_QUANTILE = 0.995  # of the rates of records with noise


def estimated_gear(trials: Sequence[Trial]) -> SteeringGear:
    """Limit, rate and lag of a steering gear from the rudder angles of trials.

    The limit is 35 degrees or the largest angle recorded. Rate and lag are those that explain records
    without noise exactly; records with noise give the median rate of the fast moves, and no lag.

    Parameters
    ----------
    trials : sequence of Trial
        With `delta`.
    """
    limit = max(USUAL_LIMIT_DEG, *(float(np.degrees(np.abs(trial["delta"]).max())) for trial in trials))
    clean = [t for t in trials if not is_noisy(t.t, (t[channel] for channel in "uvr"))]
    exact = [rudder for trial in clean if (rudder := rebuild(trial.t, trial["delta"])).follows_gear]
    if exact:
        rate = float(np.median([rudder.rate for rudder in exact]))
        lag = float(np.median([rudder.time_constant for rudder in exact]))
    else:
        rates = np.concatenate([np.abs(np.diff(trial["delta"])) / np.diff(trial.t) for trial in trials])
        fastest = float(np.quantile(rates[rates > 0.0], FAST_QUANTILE))
        rate, lag = float(np.median(rates[rates >= MOVING * fastest])), 0.0
    return SteeringGear(min(limit, 90.0), float(np.degrees(rate)), lag)
