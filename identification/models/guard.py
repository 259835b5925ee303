"""Models that run away: how they are noticed, and the fit again with a penalty.

A fit of zigzags extrapolates in hard turns, where terms that hardly mattered in the
data take over.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from identification.estimators.estimator import Estimators, FitTask
from identification.models.hard_turn import RUDDER_DEG, hard_turn_features
from identification.models.methods import Method, fit_held
from shipgym import ShipModel, Trial, UnstableModelError
from shipgym.manoeuvres import turning_circle
from shipgym.manoeuvres.registry import FASTEST, QUICKEST_TURN
from shipgym.models.simulate import open_loop

DURATION_LENGTHS = 50.0  # of a trial manoeuvre, at service speed
STEP = 0.02  # of the time to sail one ship length


#: The ridge regression that takes the place of a method whose model runs away.
HELD = "hard-turn-ridge"


class Simulation(NamedTuple):
    """A simulation that a model has to survive."""

    name: str
    sail: Callable[[], Trial]
    least_surge: float = 0.0  # ships go astern only where they were seen to, m/s


def reasons_unstable(model: ShipModel, trials: Sequence[Trial]) -> list[str]:
    """Simulations in which a model runs away, in words; empty for a stable model.

    The trials that it was identified from, open loop; turning circles to both sides;
    and rudder reversed at intervals, from short to long, which excites what a zigzag of
    any other angle would. Stops after the first kind in which it does.
    """
    recorded = _recorded(model, trials)
    turns = _turns(model)
    reversals = _reversals(model)
    for simulations in (recorded, turns, reversals):
        reasons = []
        for simulation in simulations:
            cause = why_unphysical(model, simulation)
            if cause is not None:
                reasons.append(f"{simulation.name}: {cause}")
        if reasons:
            return reasons
    return []


def _recorded(model: ShipModel, trials: Sequence[Trial]) -> Iterator[Simulation]:
    for trial in trials:
        yield Simulation(
            name=f"trial {trial.name!r}, open loop",
            sail=partial(open_loop, model, trial),
            least_surge=float(trial["u"].min()),
        )


def _turns(model: ShipModel) -> Iterator[Simulation]:
    duration = DURATION_LENGTHS * model.travel_time
    dt = STEP * model.travel_time
    for angle in _angles_deg(model):
        yield Simulation(
            name=f"turning circle, {angle:+.0f} deg",
            sail=partial(turning_circle, model, angle, duration, dt),
        )


def _reversals(model: ShipModel) -> Iterator[Simulation]:
    intervals = (2.5, 5.0, 10.0, 20.0)  # ship lengths
    for angle in _angles_deg(model):
        for lengths in intervals:
            yield Simulation(
                name=f"rudder {angle:+.0f} deg reversed every {lengths:g} L/U",
                sail=partial(
                    reversed_rudder,
                    model,
                    rudder_deg=angle,
                    lengths=lengths,
                ),
            )


def _angles_deg(model: ShipModel) -> list[float]:
    """Rudder angles of the manoeuvres, to both sides and within the rudder's limit."""
    limit = model.steering.rudder_limit_deg
    hard = min(RUDDER_DEG, limit)
    small = min(10.0, limit)
    angles = [hard, -hard]
    if small < hard:
        angles += [small, -small]
    return angles


def reversed_rudder(model: ShipModel, rudder_deg: float, lengths: float) -> Trial:
    """Simulate a rudder put over from side to side, at intervals in ship lengths."""
    n_steps = round(DURATION_LENGTHS / STEP)
    interval = round(lengths / STEP)
    n_reversals = np.arange(n_steps) // interval
    to_port = n_reversals % 2 == 1
    rudder = np.full(n_steps, np.radians(rudder_deg))
    rudder[to_port] *= -1.0

    ordered = 0
    commands = np.tile(model.service_command, (n_steps, 1))
    commands[:, ordered] = rudder
    dt = STEP * model.travel_time
    return model.simulate(commands, dt)


def why_unphysical(model: ShipModel, simulation: Simulation) -> str | None:
    """Why a simulation is that of no ship; None where it may be."""
    try:
        trial = simulation.sail()
    except UnstableModelError as error:
        return f"ran away after {error.time_s:.0f} s"

    length = model.particulars["length"]
    speed = model.particulars["speed"]
    surge = trial["u"]
    slowest = surge.min()
    fastest = surge.max()
    least_surge = min(simulation.least_surge, 0.0)
    if slowest < least_surge or fastest > FASTEST * speed:
        return f"surge speed from {slowest:.3g} to {fastest:.3g} m/s"

    sway = np.abs(trial["v"]).max()
    if sway > speed:
        return f"sway speed of {sway:.3g} m/s"

    yaw = np.abs(trial["r"]).max()
    if yaw * length > QUICKEST_TURN * speed:
        yaw_deg = np.degrees(yaw)
        return f"yaw rate of {yaw_deg:.3g} deg/s"
    return None


@dataclass(frozen=True)
class GuardedFit:
    """A fit and what the guard did to it."""

    model: ShipModel  # with the identified coefficients
    estimators: Estimators
    stable: bool  # whether the model passed the guard
    #: for the provenance: `decision`, `strength` of the penalty, the method that it
    #: came `in_place_of`, and why the fit without it was rejected
    report: dict[str, Any]

    @property
    def held_by(self) -> str | None:
        """The method that took the place of the one asked for; None where none did."""
        return HELD if "in_place_of" in self.report else None


def guarded_fit(method: Method, task: FitTask, guarded: bool = True) -> GuardedFit:
    """Fit by a method; if the model runs away, with a penalty.

    The penalty is the weakest under which the model does not run away. Not stable, and
    without a penalty, where none helped or it is not `guarded`.
    """
    estimators = method.fitted(task)
    model = with_coefficients(task.blank, estimators)
    reasons = reasons_unstable(model, task.trials)
    if not reasons:
        return GuardedFit(
            model=model,
            estimators=estimators,
            stable=True,
            report={"decision": "stable as fitted"},
        )

    decision = "runs away, not guarded"
    if guarded and method.regularised:
        penalised = penalised_fit(method.name, estimators, task, reasons)
        if penalised is not None:
            return penalised
        decision = "runs away under every penalty"
    return GuardedFit(
        model=model,
        estimators=estimators,
        stable=False,
        report={"decision": decision, "rejected": reasons},
    )


def penalised_fit(
    name: str, fitted: Estimators, task: FitTask, reasons: list[str]
) -> GuardedFit | None:
    """The fit with the weakest penalty on hard turns under which it does not run away.

    `name`: of the method whose estimators were `fitted` before, and keep their own
    penalty; `reasons`: why these run away. Strengths are rms errors allowed in the
    regression, relative to what the terms contribute in a hard turn.
    """
    blank = task.blank
    sizes = hard_turn_features(
        blank.table,
        blank.particulars,
        blank.service_shaft_speed,
    )
    for strength in np.geomspace(1e-3, 1.0, 19).tolist():
        estimators = fit_held(fitted, task.samples, sizes, strength)
        model = with_coefficients(blank, estimators)
        if not reasons_unstable(model, task.trials):
            report = {
                "decision": "penalised by hard turn",
                "strength": strength,
                "in_place_of": name,
                "rejected": reasons,
            }
            return GuardedFit(model, estimators, stable=True, report=report)
    return None


def with_coefficients(blank: ShipModel, estimators: Estimators) -> ShipModel:
    """The model whose derivatives follow from the fitted accelerations."""
    accelerations = {q: estimator.coef_ for q, estimator in estimators.items()}
    return blank.with_accelerations(accelerations)
