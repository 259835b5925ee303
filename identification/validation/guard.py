"""Models that run away: how they are noticed, and the fit again with a penalty.

A fit of zigzags extrapolates in hard turns, where terms that hardly mattered in the
data take over.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from identification.estimators.estimator import Estimators, FitTask
from identification.estimators.methods import Method, fit_held
from shipgym import Particulars, ShipModel, Trial, UnstableModelError
from shipgym.arrays import Floats
from shipgym.manoeuvres import turning_circle
from shipgym.manoeuvres.registry import FASTEST, QUICKEST_TURN
from shipgym.ships import Structure
from shipgym.ships.simulate import open_loop

RUDDERS_DEG = (
    35.0,
    10.0,
)  # of the trial manoeuvres; the first is cut to the rudder's limit
REVERSALS = (
    2.5,
    5.0,
    10.0,
    20.0,
)  # ship lengths sailed at service speed between those of the rudder
DURATION_LENGTHS = 50.0  # of a trial manoeuvre, at service speed
STEP = 0.02  # of the time to sail one ship length

#: A full ship's steady hard turn: speed by service speed, drift angle, yaw rate r L /
#: U, rudder. KVLCC2 of SIMMAN 2008 slows down to 0.37 at r L / U = 0.8 and a drift of
#: 20 degrees. The shaft turns somewhat slower under its load.
HARD_TURN = {
    "speed": 0.47,
    "drift": np.radians(20.5),
    "yaw_rate": 0.8,
    "rudder": np.radians(35.0),
    "shaft": 0.9,
    "heel": np.radians(5.0),
}

#: Strengths of the penalty tried in turn: rms error allowed in the regression, relative
#: to what the terms contribute in a hard turn.
STRENGTHS = tuple(float(strength) for strength in np.geomspace(1e-3, 1.0, 19))


def hard_turn_features(
    structure: Structure, particulars: Particulars, shaft_speed: float
) -> dict[str, Floats]:
    """Size of each term in a hard turn, by equation, arrays of shape (n_terms,), SI units."""
    speed = HARD_TURN["speed"] * particulars["speed"]
    state = {
        "u": speed * np.cos(HARD_TURN["drift"]),
        "v": -speed * np.sin(HARD_TURN["drift"]),
        "r": HARD_TURN["yaw_rate"] * speed / particulars["length"],
        "p": (
            HARD_TURN["heel"]
            * HARD_TURN["speed"]
            * particulars["speed"]
            / particulars["length"]
        ),
        "phi": HARD_TURN["heel"],
        "delta": HARD_TURN["rudder"],
        "n": HARD_TURN["shaft"] * shaft_speed,
    }
    channels = {name: np.array([state[name]]) for name in structure.required_channels}
    sizes = {
        q: np.abs(structure.features(q, channels, particulars, shaft_speed)[0])
        for q in structure.equations
    }
    if "q" in sizes:
        sizes["r"] = np.append(
            sizes["r"], sizes.pop("q") * particulars["length"] / speed
        )
    return sizes


def reasons_unstable(model: ShipModel, trials: Sequence[Trial]) -> list[str]:
    """Simulations in which a model runs away, in words; empty for a stable model.

    The trials that it was identified from, open loop; turning circles to both sides;
    and rudder reversed at intervals, from short to long, which excites what a zigzag of
    any other angle would. Stops after the first kind in which it does.
    """
    angles = sorted(
        {min(angle, model.steering.rudder_limit_deg) for angle in RUDDERS_DEG},
        reverse=True,
    )
    sides = [side for angle in angles for side in (angle, -angle)]
    predictions = (
        (
            f"trial {trial.name!r}, open loop",
            partial(open_loop, model, trial),
            float(trial["u"].min()),
        )
        for trial in trials
    )
    turn = partial(
        turning_circle,
        duration=DURATION_LENGTHS * model.travel_time,
        dt=STEP * model.travel_time,
    )
    turns = (
        (f"turning circle, {side:+.0f} deg", partial(turn, model, side), 0.0)
        for side in sides
    )
    reversals = (
        (
            f"rudder {side:+.0f} deg reversed every {gap:g} L/U",
            partial(_reversed, model, side, gap),
            0.0,
        )
        for side, gap in product(sides, REVERSALS)
    )
    for kind in (predictions, turns, reversals):
        tried = ((name, _runs_away(model, run, least)) for name, run, least in kind)
        if reasons := [f"{name}: {cause}" for name, cause in tried if cause]:
            return reasons
    return []


def _reversed(model: ShipModel, rudder_deg: float, interval: float) -> Trial:
    """Rudder hard over from side to side, at intervals in ship lengths."""
    steps = np.arange(round(DURATION_LENGTHS / STEP))
    commands = np.tile(model.service_command, (len(steps), 1))
    commands[:, 0] = np.where(
        steps // round(interval / STEP) % 2 == 0, 1.0, -1.0
    ) * np.radians(rudder_deg)
    return model.simulate(commands, STEP * model.travel_time)


def _runs_away(
    model: ShipModel, run: Callable[[], Trial], least_surge: float
) -> str | None:
    """What is wrong with a simulation, None if nothing; ships go astern only where they were seen to."""
    try:
        trial = run()
    except UnstableModelError as error:
        return f"ran away after {error.time_s:.0f} s"
    length, speed = model.particulars["length"], model.particulars["speed"]
    if trial["u"].min() < min(least_surge, 0.0) or trial["u"].max() > FASTEST * speed:
        return f"surge speed from {trial['u'].min():.3g} to {trial['u'].max():.3g} m/s"
    if np.abs(trial["v"]).max() > speed:
        return f"sway speed of {np.abs(trial['v']).max():.3g} m/s"
    if np.abs(trial["r"]).max() * length > QUICKEST_TURN * speed:
        return f"yaw rate of {np.degrees(np.abs(trial['r']).max()):.3g} deg/s"
    return None


@dataclass(frozen=True)
class GuardedFit:
    """A fit and what the guard did to it."""

    model: ShipModel  # with the identified coefficients
    estimators: Estimators
    stable: bool  # whether the model passed the guard
    #: for the provenance: `decision`, `strength` of the penalty, and why the fit
    #: without it was rejected
    report: dict[str, Any]


def guarded_fit(method: Method, task: FitTask, guarded: bool = True) -> GuardedFit:
    """Fit by a method; if the model runs away, with the weakest penalty under which it does not.

    Not stable, and without a penalty, where none helped or it is not `guarded`.
    """
    blank, trials = task.blank, task.trials
    estimators = method.fitted(task)
    model = with_coefficients(blank, estimators)
    if not (reasons := reasons_unstable(model, trials)):
        return GuardedFit(model, estimators, True, {"decision": "stable as fitted"})
    rejected = {"rejected": reasons}
    if not (guarded and method.regularised):
        return GuardedFit(
            model, estimators, False, {"decision": "runs away, not guarded", **rejected}
        )
    sizes = hard_turn_features(
        blank.table, blank.particulars, blank.service_shaft_speed
    )
    for strength in STRENGTHS:
        held = fit_held(task.samples, sizes, strength)
        candidate = with_coefficients(blank, held)
        if not reasons_unstable(candidate, trials):
            report = {
                "decision": "penalised by hard turn",
                "strength": strength,
                **rejected,
            }
            return GuardedFit(candidate, held, True, report)
    return GuardedFit(
        model,
        estimators,
        False,
        {"decision": "runs away under every penalty", **rejected},
    )


def with_coefficients(blank: ShipModel, estimators: Estimators) -> ShipModel:
    """The model with the hydrodynamic derivatives that follow from the fitted accelerations."""
    return blank.with_accelerations(
        {q: estimator.coef_ for q, estimator in estimators.items()}
    )
