"""Spirals, which show whether, and how far, a ship is unstable on a straight course.

Direct spiral of Dieudonne and reverse spiral of Bech as described in IMO MSC/Circ.1053
and ITTC 7.5-04-02-01.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_number
from shipgym.errors import InputError
from shipgym.manoeuvres.execution import is_ordered, require, rudder
from shipgym.manoeuvres.registry import Manoeuvre
from shipgym.manoeuvres.settling import Voyage
from shipgym.sea.conditions import Weather
from shipgym.ships.linear import is_course_stable
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.simulate import Conditions, Seed
from shipgym.trials.trial import Trial

SpiralMethod = Literal["direct", "reverse"]

#: Rudder angles of the direct spiral, degrees, from starboard to port: in small steps
#: where the loop is.
DIRECT_RUDDER_DEG = (
    20.0,
    15.0,
    10.0,
    5.0,
    4.0,
    3.0,
    *(0.25 * k for k in range(8, -9, -1)),
    -3.0,
    -4.0,
    -5.0,
    -10.0,
    -15.0,
    -20.0,
)
#: Yaw rates of the reverse spiral by U0 / L, from starboard to port.
REVERSE_RATES = (0.2, 0.15, *(0.01 * k for k in range(12, -13, -1)), -0.15, -0.2)


@dataclass(frozen=True, eq=False)
class Spiral:
    """Steady turns at a sequence of rudder angles."""

    trial: Trial  # the manoeuvre
    # shape (n_points,); of each steady turn, in the order in which they were sailed;
    # deg and deg/s
    rudder_deg: Floats
    yaw_rate_deg_s: Floats
    # whether the rudder was set and the yaw rate observed, or the other way round
    method: SpiralMethod


@dataclass(frozen=True)
class SpiralIndices:
    """Indices of a spiral."""

    # range of rudder angles at which the ship turns to either side, degrees; 0 for a
    # ship that is stable on a straight course. A direct spiral knows it to within its
    # rudder steps
    loop_width_deg: float
    # difference of both yaw rates in the middle of the loop, degrees per second
    loop_height_deg_s: float
    # rudder in the middle of the loop, degrees; of a stable ship that with which she
    # sails straight
    loop_middle_deg: float


class _Curve(NamedTuple):
    """Yaw rate over rudder angle of the way there or back, by rising angle."""

    angles: Floats  # deg
    rates: Floats  # deg/s


def direct_spiral(
    model: ShipModel,
    rudder_deg: Sequence[float] = DIRECT_RUDDER_DEG,
    dt: float | None = None,
    water_depth: float = np.inf,
    weather: Weather | str | None = None,
    seed: Seed = 0,
) -> Spiral:
    """Simulate a direct spiral (Dieudonne).

    Rudder angles there and back, each held until the turn is steady.

    The angles, degrees, go from one side to the other; they are sailed in this order
    and then back to the first. The loop is known to within their steps. Other arguments
    are as in `pull_out`. Raises InputError for angles that do not go from one side to
    the other, UnstableModelError if the ship runs away.
    """
    limit = model.steering.rudder_limit_deg
    there = one_way(rudder_deg, "rudder_deg", "deg", limit, "the rudder's limit")
    angles = [*there, *there[-2::-1]]
    voyage = Voyage(model, dt, Conditions(water_depth, weather, seed))
    rates = []
    for angle in angles:
        leg = voyage.hold(np.radians(angle), model.service_shaft_speed)
        rates.append(voyage.settle(leg).yaw_rate)
    trial = voyage.trial("spiral")
    return Spiral(trial, np.array(angles), np.degrees(rates), "direct")


def reverse_spiral(
    model: ShipModel,
    yaw_rate_deg_s: Sequence[float] | None = None,
    dt: float | None = None,
    water_depth: float = np.inf,
    weather: Weather | str | None = None,
    seed: Seed = 0,
) -> Spiral:
    """Simulate a reverse spiral (Bech).

    A helmsman keeps a sequence of yaw rates, each until it is steady.

    It also finds the turns at which an unstable ship would not stay by itself. The
    helmsman is a proportional-integral controller, designed from the rudder's effect on
    the ship.

    The yaw rates, degrees per second, go from one side to the other, by default from
    0.2 to -0.2 times U0 / L; the rudder of each point is the mean of what the helmsman
    ordered. Otherwise as `direct_spiral`.
    """
    voyage = Voyage(model, dt, Conditions(water_depth, weather, seed))
    unit = voyage.length_time
    if yaw_rate_deg_s is None:
        yaw_rate_deg_s = [float(np.degrees(rate / unit)) for rate in REVERSE_RATES]
    most = float(np.degrees(1.0 / unit))
    what = "one radian per ship length sailed"
    rates = one_way(yaw_rate_deg_s, "yaw_rate_deg_s", "deg/s", most, what)

    helmsman = voyage.rate_helmsman()
    angles = []
    for rate in rates:
        steady = voyage.settle(helmsman(np.radians(rate)))
        angles.append(steady.rudder)
    trial = voyage.trial("spiral")
    return Spiral(trial, np.degrees(angles), np.array(rates), "reverse")


def one_way(
    values: Sequence[float], argument: str, unit: str, limit: float, what: str
) -> list[float]:
    """Values that go strictly from one side to the other, within a limit, checked.

    `what`: the limit in words.
    """
    numbers = []
    for i, value in enumerate(values):
        number = check_number(
            value,
            f"{argument}[{i}]",
            at_least=-limit,
            at_most=limit,
            hint=f"{what} in {unit}",
        )
        numbers.append(number)
    steps = np.diff(numbers)
    strictly = np.all(steps > 0.0) or np.all(steps < 0.0)
    if len(numbers) < 3 or not strictly or numbers[0] * numbers[-1] >= 0.0:
        raise InputError(
            f"{argument}: expected at least 3 values in {unit} that rise or fall from"
            f" one side to the other, such as 10, 5, 0, -5, -10, got {numbers}"
        )
    return numbers


def spiral_from_trial(
    trial: Trial, rudder_deg: Sequence[float] | None = None, tolerance_deg: float = 0.5
) -> Spiral:
    """The steady turns of a measured direct spiral.

    A turn lasts while the rudder stays within a tolerance, or its order unchanged where
    that was recorded; its yaw rate is the mean over the last third. The trial has r and
    delta (or delta_command). With `rudder_deg` only turns within the tolerance of these
    angles are kept, all in degrees. Raises InputError if a channel is missing, or there
    are fewer than four steady turns.
    """
    require(trial, ("r",), "a spiral")
    tolerance = check_number(tolerance_deg, "tolerance_deg", above=0.0)
    delta, rate = np.degrees(rudder(trial)), np.degrees(trial["r"])
    angles, rates = [], []
    for first, last in _plateaus(trial, delta, tolerance):
        angle = float(delta[first:last].mean())
        if rudder_deg is not None and not _near(angle, rudder_deg, tolerance):
            continue
        steady = max(int((last - first) * (1.0 / 3.0)), 1)
        angles.append(angle)
        rates.append(float(rate[last - steady : last].mean()))
    if len(angles) < 4:
        raise InputError(
            f"trial {trial.name!r}: expected at least 4 rudder angles, each held for a"
            f" while, got {len(angles)} steady turns"
        )
    return Spiral(trial, np.array(angles), np.array(rates), "direct")


def _plateaus(trial: Trial, delta: Floats, tolerance: float) -> list[tuple[int, int]]:
    """First samples of each stretch of a held rudder, deg, and of what comes after it.

    Without those shorter than a tenth of the longest, the rudder on its way.
    """
    allowed = 1e-9 if is_ordered(trial) else tolerance
    edges = [0]
    for i in range(1, len(delta)):
        if abs(delta[i] - delta[edges[-1]]) > allowed:
            edges.append(i)
    spans = list(pairwise([*edges, len(delta)]))
    durations = [trial.t[last - 1] - trial.t[first] for first, last in spans]
    shortest = 0.1 * max(durations)

    held = []
    for span, duration in zip(spans, durations, strict=True):
        if duration > 0.0 and duration >= shortest:
            held.append(span)
    return held


def _near(angle: float, wanted: Sequence[float], tolerance: float) -> bool:
    return any(abs(angle - other) <= tolerance for other in wanted)


def spiral_indices(spiral: Spiral) -> SpiralIndices:
    """Width and height of the loop of a spiral, simulated or from a trial.

    Raises InputError if the yaw rate never changes its side, or a direct spiral does
    not come back.
    """
    check_choice(spiral.method, ("direct", "reverse"), "spiral method")
    angles, rates = spiral.rudder_deg, spiral.yaw_rate_deg_s
    least, largest = rates.min(), rates.max()
    if least >= 0.0 or largest <= 0.0:
        raise InputError(
            "spiral: expected turns to both sides, got yaw rates from"
            f" {least:.3g} to {largest:.3g} deg/s"
        )
    if spiral.method == "direct":
        return _direct_loop(angles, rates)
    return _reverse_loop(angles, rates)


def turning_point(angles: Floats) -> int:
    """Index at which a direct spiral turns back: the later of its extreme angles."""
    return int(max(np.argmin(angles), np.argmax(angles)))


def _direct_loop(angles: Floats, rates: Floats) -> SpiralIndices:
    """The loop of a direct spiral: each way changes side at another rudder."""
    turn = turning_point(angles)
    there = _ordered(angles[: turn + 1], rates[: turn + 1])
    back = _ordered(angles[turn:], rates[turn:])
    if min(len(there.angles), len(back.angles)) < 2:
        raise InputError(
            "spiral: expected a direct spiral there and back, got rudder angles that go"
            " one way only"
        )
    falling, rising = there, back
    if angles[turn] >= angles[0]:
        falling, rising = back, there

    to_port = _change_of_side(falling, last=False)
    to_starboard = _change_of_side(rising, last=True)
    middle = 0.5 * (to_starboard + to_port)
    height = np.interp(middle, *falling) - np.interp(middle, *rising)
    return SpiralIndices(
        loop_width_deg=max(to_starboard - to_port, 0.0),
        loop_height_deg_s=max(float(height), 0.0),
        loop_middle_deg=middle,
    )


def _ordered(angles: Floats, rates: Floats) -> _Curve:
    order = np.argsort(angles)
    return _Curve(angles[order], rates[order])


def _change_of_side(way: _Curve, last: bool) -> float:
    """Rudder at which the yaw rate of one way goes through zero, deg."""
    angles, rates = way
    changes = np.flatnonzero((rates[:-1] <= 0.0) & (rates[1:] > 0.0))
    if len(changes) == 0:
        raise InputError(
            "spiral: expected turns to both sides, got one way that stays on one side"
        )
    k = int(changes[-1] if last else changes[0])
    around = slice(k, k + 2)
    return float(np.interp(0.0, rates[around], angles[around]))


def _reverse_loop(angles: Floats, rates: Floats) -> SpiralIndices:
    """The fold in the curve of rudder over yaw rate."""
    from scipy.interpolate import Akima1DInterpolator

    order = np.argsort(rates)
    grid = np.linspace(rates.min(), rates.max(), 4001)
    interpolator = Akima1DInterpolator(rates[order], angles[order])
    curve = np.asarray(interpolator(grid))
    highest = np.maximum.accumulate(curve)
    lowest = int(np.argmax(highest - curve))
    top, bottom = highest[lowest], curve[lowest]
    width = float(top - bottom)
    if width == 0.0:
        straight = float(np.interp(0.0, grid, curve))
        return SpiralIndices(0.0, 0.0, straight)

    middle = 0.5 * (top + bottom)
    crossings = np.flatnonzero(np.diff(np.sign(curve - middle)))
    height = float(np.ptp(grid[crossings]))
    return SpiralIndices(width, height, float(middle))


def standard_spirals(
    model: ShipModel, water_depth: float = np.inf
) -> dict[str, Manoeuvre]:
    """A direct spiral, and a reverse one where the ship is unstable going straight."""
    limit = model.steering.rudder_limit_deg
    angles = [angle for angle in DIRECT_RUDDER_DEG if abs(angle) <= limit]
    spirals = {
        "direct spiral": Manoeuvre(
            partial(direct_spiral, rudder_deg=angles, water_depth=water_depth),
            spiral_indices,
            SpiralIndices,
            "Each point a steady turn, with rudder angles there and back.",
        )
    }
    with suppress(InputError):  # there may be no straight course at all
        if is_course_stable(model):
            return spirals
    spirals["reverse spiral"] = Manoeuvre(
        partial(reverse_spiral, water_depth=water_depth),
        spiral_indices,
        SpiralIndices,
        "Each point a yaw rate held by a helmsman, with the mean rudder that it took.",
    )
    return spirals
