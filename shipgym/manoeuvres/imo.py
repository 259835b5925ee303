"""Assessment of a ship by the manoeuvring criteria of MSC.137(76)."""

from collections.abc import Iterable, Mapping

import numpy as np

from shipgym.checks import check_number
from shipgym.manoeuvres.criteria import (
    Assessment,
    Criterion,
    Side,
    outside_envelope,
    with_measured,
)
from shipgym.manoeuvres.imo_rules import (
    STOPPING,
    imo_manoeuvres,
    ship_rules,
    trial_in_words,
)
from shipgym.manoeuvres.intervals import IndexInterval, intervals_of, own_indices
from shipgym.manoeuvres.measured import measured_in_file
from shipgym.manoeuvres.quantiles import DRAWS
from shipgym.models.by_name import takes_name
from shipgym.models.ship_model import ShipModel


@takes_name
def imo_assessment(
    model: ShipModel, n_draws: int | None = None, seed: int | np.random.Generator = 0
) -> Assessment:
    """Assess a ship by the criteria of MSC.137(76).

    They are turning, initial turning, yaw checking, course keeping and stopping.

    Simulated from service speed in deep water: turning circles with 35 degrees of
    rudder, or the rudder's limit where that is less, and zigzags 10/10 and 20/20, each
    to both sides; a full astern stop where the ship's equations hold for a shaft
    astern. To show how certain each verdict is, `n_draws` models are drawn from the
    covariance of an identified ship, by default 200, and none for a ship without one.

    Returns the criteria `advance`, `tactical_diameter`, `initial_turning`,
    `overshoot_1_10_10`, `overshoot_2_10_10`, `overshoot_1_20_20` and `stopping`. Raises
    InputError for draws without covariance.
    """
    if n_draws is None:
        n_draws = 0 if model.covariance is None else DRAWS
    check_number(n_draws, "n_draws", at_least=0)
    draws: list[ShipModel] = []
    if n_draws > 0:
        draws = model.sample(int(n_draws), seed)
    return assess_draws(model, draws)


def assess_draws(model: ShipModel, draws: Iterable[ShipModel]) -> Assessment:
    """The criteria of a model and of models drawn."""
    needed = imo_manoeuvres(model)
    own = own_indices(model, needed)
    tests = {name: test.evaluate for name, test in needed.items()}
    return imo_criteria(model, intervals_of(own, draws, tests))


def imo_criteria(
    model: ShipModel, found: Mapping[str, Mapping[str, IndexInterval]]
) -> Assessment:
    """Criteria of a ship by name, from the indices of her standard manoeuvres.

    A manoeuvre that was not completed fails its criteria. Of an identified ship a
    criterion is decided only where the manoeuvre is within the envelope of her trials
    and the draws are on one side of the limit, or by what these trials measured, which
    the model file has.
    """
    outside = {
        name: outside_envelope(model, manoeuvre)
        for name, manoeuvre in imo_manoeuvres(model).items()
        if name in found
    }
    criteria = {}
    for criterion, rule in ship_rules(model).items():
        sides = []
        for name, is_outside in outside.items():
            if name.startswith(rule.manoeuvre):
                side = "port" if "port" in name else "starboard"
                sides.append(Side(side, found[name][rule.index], is_outside))
        trial = trial_in_words(model, rule.manoeuvre)
        criteria[criterion] = Criterion(rule, trial, tuple(sides))
    criteria["stopping"] = stopping_criterion(found.get(STOPPING.manoeuvre))
    return with_measured(criteria, measured_in_file(model))


def stopping_criterion(stop: Mapping[str, IndexInterval] | None) -> Criterion:
    """Full astern stopping test; no verdict for a ship that cannot go astern."""
    if stop is not None:
        side = Side(name="", drawn=stop[STOPPING.index])
        return Criterion(STOPPING, STOPPING.manoeuvre, (side,))
    remark = "not assessable: its equations do not hold for a shaft turning astern"
    return Criterion(STOPPING, remark=remark)
