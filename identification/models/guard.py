"""Models that run away: how they are noticed, and the fit again with a penalty.

A fit of zigzags extrapolates in hard turns, where terms that hardly mattered in the
data take over.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from identification.estimators.linear import Estimators
from identification.models.methods import Method, fit_held
from identification.samples.problem import Problem
from shipgym import Particulars, ShipModel, Trial, UnstableModelError
from shipgym.arrays import Floats
from shipgym.manoeuvres import turning_circle
from shipgym.manoeuvres.registry import check_physical
from shipgym.models.simulate import open_loop
from shipgym.ships import Structure

RUDDER_DEG = 35.0
SPEED_RATIO = 0.47  # speed in the turn, by the service speed


def hard_turn_features(
    structure: Structure, particulars: Particulars, shaft_speed: float
) -> dict[str, Floats]:
    """Size of each term in a hard turn, by equation, SI units, shape (n_terms,)."""
    turn = _hard_turn(particulars, shaft_speed)
    channels = {name: np.array([turn[name]]) for name in structure.required_channels}
    sizes = {}
    for q in structure.equations:
        features = structure.features(
            q,
            channels,
            particulars,
            shaft_speed,
        )
        sizes[q] = np.abs(features[0])

    if "q" in sizes:  # a memory of yaw is regressed with yaw, over the time of a length
        speed = SPEED_RATIO * particulars["speed"]
        memory = sizes.pop("q") * particulars["length"] / speed
        sizes["r"] = np.append(sizes["r"], memory)
    return sizes


def _hard_turn(particulars: Particulars, shaft_speed: float) -> dict[str, float]:
    """State and rudder in the steady turn, SI units."""
    length = particulars["length"]
    # KVLCC2 of SIMMAN 2008 slows down to 0.37 of her speed at r L / U = 0.8 and a drift
    # of 20 degrees. The shaft turns somewhat slower under its load.
    speed = SPEED_RATIO * particulars["speed"]
    drift = np.radians(20.5)
    heel = np.radians(5.0)
    yaw_rate = 0.8  # r L / U
    shaft_ratio = 0.9
    return {
        "u": speed * np.cos(drift),
        "v": -speed * np.sin(drift),
        "r": yaw_rate * speed / length,
        "p": heel * SPEED_RATIO * particulars["speed"] / length,
        "phi": heel,
        "delta": np.radians(RUDDER_DEG),
        "n": shaft_ratio * shaft_speed,
    }


DURATION_LENGTHS = 50.0  # of a trial manoeuvre, at service speed
STEP = 0.02  # of the time to sail one ship length


#: The ridge regression that takes the place of a method whose model runs away.
HELD = "hard-turn-ridge"
#: A simulation that a model has to survive: its name, how it is sailed, and the least
#: surge speed, m/s.
Simulation = tuple[str, Callable[[], Trial], float]


def reasons_unstable(model: ShipModel, trials: Sequence[Trial]) -> list[str]:
    """Simulations in which a model runs away, in words; empty for a stable model.

    The trials that it was identified from, open loop; turning circles to both sides;
    and rudder reversed at intervals, from short to long, which excites what a zigzag of
    any other angle would. Stops after the first kind in which it does.
    """
    for kind in (_recorded(model, trials), hard_turns(model), _reversals(model)):
        reasons = []
        for name, sail, least_surge in kind:
            cause = why_unphysical(model, sail, least_surge)
            if cause is not None:
                reasons.append(f"{name}: {cause}")
        if reasons:
            return reasons
    return []


def _recorded(model: ShipModel, trials: Sequence[Trial]) -> Iterator[Simulation]:
    for trial in trials:
        name = f"trial {trial.name!r}, open loop"
        yield name, partial(open_loop, model, trial), min(float(trial["u"].min()), 0.0)


def hard_turns(model: ShipModel) -> Iterator[Simulation]:
    """Turning circles to both sides, by much and by little rudder."""
    duration = DURATION_LENGTHS * model.travel_time
    dt = STEP * model.travel_time
    for angle in _angles_deg(model):
        sail = partial(
            turning_circle,
            model,
            angle,
            duration,
            dt,
        )
        yield f"turning circle, {angle:+.0f} deg", sail, 0.0


def _reversals(model: ShipModel) -> Iterator[Simulation]:
    for angle in _angles_deg(model):
        for lengths in (2.5, 5.0, 10.0, 20.0):
            name = f"rudder {angle:+.0f} deg reversed every {lengths:g} L/U"
            yield (
                name,
                partial(
                    reversed_rudder,
                    model,
                    angle,
                    lengths,
                ),
                0.0,
            )


def _angles_deg(model: ShipModel) -> list[float]:
    """Rudder angles of the manoeuvres, to both sides and within the rudder's limit."""
    limit = model.steering.rudder_limit_deg
    angles = dict.fromkeys([min(RUDDER_DEG, limit), min(10.0, limit)])
    return [side * angle for angle in angles for side in (1.0, -1.0)]


def reversed_rudder(model: ShipModel, rudder_deg: float, lengths: float) -> Trial:
    """Simulate a rudder put over from side to side, at intervals in ship lengths."""
    steps = np.arange(round(DURATION_LENGTHS / STEP))
    to_port = steps // round(lengths / STEP) % 2 == 1
    commands = np.tile(model.service_command, (len(steps), 1))
    angles = np.where(
        to_port,
        -rudder_deg,
        rudder_deg,
    )
    commands[:, 0] = np.radians(angles)
    return model.simulate(commands, STEP * model.travel_time)


def why_unphysical(
    model: ShipModel, sail: Callable[[], Trial], least_surge: float
) -> str | None:
    """Why a simulation is that of no ship; None where it may be.

    Ships go astern only where they were seen to, `least_surge`, m/s.
    """
    try:
        trial = sail()
        check_physical(model, trial)
    except UnstableModelError as error:
        return f"ran away after {error.time_s:.0f} s"
    slowest = trial["u"].min()
    if slowest < least_surge:
        return f"surge speed of {slowest:.3g} m/s"
    return None


class GuardedFit(NamedTuple):
    """A fit and what the guard did to it."""

    model: ShipModel  # with the identified coefficients
    estimators: Estimators
    stable: bool  # whether the model passed the guard
    #: for the provenance: `decision`, `strength` of the penalty, the method that it
    #: came `in_place_of`, and why the fit without it was rejected
    report: dict[str, Any]
    #: of one that was refined: for the provenance settings, cost and decision
    refinement: dict[str, Any] | None = None
    #: of the coefficients of the accelerations, shape (n_coefficients,
    #: n_coefficients); None where that follows from the regression
    covariance: Floats | None = None
    #: by trial: by how much stretches of time moved those coefficients, shape
    #: (n_stretches, n_coefficients)
    influences: Sequence[Floats] = ()

    @property
    def held_by(self) -> str | None:
        """The method that took the place of the one asked for; None where none did."""
        return HELD if "in_place_of" in self.report else None


def guarded_fit(method: Method, problem: Problem, guarded: bool = True) -> GuardedFit:
    """Fit by a method; if the model runs away, with a penalty.

    The penalty is the weakest under which the model does not run away. Not stable, and
    without a penalty, where none helped or it is not `guarded`.
    """
    estimators = method.fitted(problem)
    model = with_coefficients(problem.blank, estimators)
    reasons = reasons_unstable(model, problem.used)
    if not reasons:
        return GuardedFit(model, estimators, True, {"decision": "stable as fitted"})

    decision = "runs away, not guarded"
    if guarded and method.regularised:
        penalised = penalised_fit(method.name, estimators, problem, reasons)
        if penalised is not None:
            return penalised
        decision = "runs away under every penalty"
    report = {"decision": decision, "rejected": reasons}
    return GuardedFit(
        model,
        estimators,
        False,
        report,
    )


def penalised_fit(
    name: str, fitted: Estimators, problem: Problem, reasons: list[str]
) -> GuardedFit | None:
    """The fit with the weakest penalty on hard turns under which it does not run away.

    `name`: of the method whose estimators were `fitted` before, and keep their own
    penalty; `reasons`: why these run away. Strengths are rms errors allowed in the
    regression, relative to what the terms contribute in a hard turn.
    """
    blank = problem.blank
    sizes = hard_turn_features(
        blank.table,
        blank.particulars,
        blank.service_shaft_speed,
    )
    for strength in np.geomspace(1e-3, 1.0, 19).tolist():
        estimators = fit_held(fitted, problem.samples, sizes, strength)
        model = with_coefficients(blank, estimators)
        if not reasons_unstable(model, problem.used):
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
