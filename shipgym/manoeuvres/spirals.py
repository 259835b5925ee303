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
from shipgym.models.by_name import takes_name
from shipgym.models.linear import is_course_stable
from shipgym.models.ship_model import ShipModel
from shipgym.models.simulate import Conditions, Seed
from shipgym.sea.conditions import Weather
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


@takes_name
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
        steady = voyage.settle(leg)
        rates.append(steady.yaw_rate)
    return Spiral(
        trial=voyage.trial("spiral"),
        rudder_deg=np.array(angles),
        yaw_rate_deg_s=np.degrees(rates),
        method="direct",
    )


@takes_name
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
    length_time = voyage.length_time
    # Yaw rates of the reverse spiral by U0 / L, from starboard to port.
    reverse_rates = (0.2, 0.15, *(0.01 * k for k in range(12, -13, -1)), -0.15, -0.2)
    if yaw_rate_deg_s is None:
        defaults = np.array(reverse_rates) / length_time
        yaw_rate_deg_s = np.degrees(defaults).tolist()
    rates = one_way(
        yaw_rate_deg_s,
        "yaw_rate_deg_s",
        "deg/s",
        limit=float(np.degrees(1.0 / length_time)),
        what="one radian per ship length sailed",
    )

    helmsman = voyage.rate_helmsman()
    angles = []
    for rate in rates:
        leg = helmsman(np.radians(rate))
        steady = voyage.settle(leg)
        angles.append(steady.rudder)
    return Spiral(
        trial=voyage.trial("spiral"),
        rudder_deg=np.degrees(angles),
        yaw_rate_deg_s=np.array(rates),
        method="reverse",
    )


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
    enough = len(numbers) >= 3
    if not enough or not strictly or numbers[0] * numbers[-1] >= 0.0:
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
    delta = np.degrees(rudder(trial))
    rate = np.degrees(trial["r"])
    angles = []
    rates = []
    for first, last in _plateaus(trial, delta, tolerance):
        angle = float(delta[first:last].mean())
        if rudder_deg is not None and not _near(angle, rudder_deg, tolerance):
            continue
        third = max((last - first) // 3, 1)
        steady = rate[last - third : last]
        angles.append(angle)
        rates.append(float(steady.mean()))
    if len(angles) < 4:
        raise InputError(
            f"trial {trial.name!r}: expected at least 4 rudder angles, each held for a"
            f" while, got {len(angles)} steady turns"
        )
    return Spiral(
        trial=trial,
        rudder_deg=np.array(angles),
        yaw_rate_deg_s=np.array(rates),
        method="direct",
    )


def _plateaus(trial: Trial, delta: Floats, tolerance: float) -> list[tuple[int, int]]:
    """First samples of each stretch of a held rudder, deg, and of what comes after it.

    Without those shorter than a tenth of the longest, the rudder on its way.
    """
    allowed = 1e-9 if is_ordered(trial) else tolerance
    edges = [0]
    for i, angle in enumerate(delta):
        held = delta[edges[-1]]
        if abs(angle - held) > allowed:
            edges.append(i)
    edges.append(len(delta))

    t = trial.t
    durations = {}
    for first, after in pairwise(edges):
        durations[first, after] = t[after - 1] - t[first]
    shortest = 0.1 * max(durations.values())
    return [
        span
        for span, duration in durations.items()
        if duration > 0.0 and duration >= shortest
    ]


def _near(angle: float, wanted: Sequence[float], tolerance: float) -> bool:
    return any(abs(angle - other) <= tolerance for other in wanted)


def spiral_indices(spiral: Spiral) -> SpiralIndices:
    """Width and height of the loop of a spiral, simulated or from a trial.

    Raises InputError if the yaw rate never changes its side, or a direct spiral does
    not come back.
    """
    check_choice(spiral.method, ("direct", "reverse"), "spiral method")
    angles = spiral.rudder_deg
    rates = spiral.yaw_rate_deg_s
    least = rates.min()
    largest = rates.max()
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
    falling = there
    rising = back
    begins_upwards = angles[turn] >= angles[0]
    if begins_upwards:
        falling = back
        rising = there

    to_port = _change_of_side(falling, last=False)
    to_starboard = _change_of_side(rising, last=True)
    width = to_starboard - to_port
    middle = 0.5 * (to_starboard + to_port)
    upper = np.interp(middle, falling.angles, falling.rates)
    lower = np.interp(middle, rising.angles, rising.rates)
    height = float(upper - lower)
    return SpiralIndices(
        loop_width_deg=max(width, 0.0),
        loop_height_deg_s=max(height, 0.0),
        loop_middle_deg=middle,
    )


def _ordered(angles: Floats, rates: Floats) -> _Curve:
    order = np.argsort(angles)
    return _Curve(angles[order], rates[order])


def _change_of_side(way: _Curve, last: bool) -> float:
    """Rudder at which the yaw rate of one way goes through zero, deg."""
    to_starboard = way.rates > 0.0
    changes = np.flatnonzero(~to_starboard[:-1] & to_starboard[1:])
    if not changes.size:
        raise InputError(
            "spiral: expected turns to both sides, got one way that stays on one side"
        )
    k = int(changes[-1] if last else changes[0])
    around = slice(k, k + 2)
    angle = np.interp(0.0, way.rates[around], way.angles[around])
    return float(angle)


def _reverse_loop(angles: Floats, rates: Floats) -> SpiralIndices:
    """The fold in the curve of rudder over yaw rate."""
    from scipy.interpolate import Akima1DInterpolator

    order = np.argsort(rates)
    interpolator = Akima1DInterpolator(rates[order], angles[order])
    grid = np.linspace(rates.min(), rates.max(), 4001)
    curve = np.asarray(interpolator(grid))

    # where the curve has fallen most from what it had reached
    highest = np.maximum.accumulate(curve)
    fold = int(np.argmax(highest - curve))
    top = float(highest[fold])
    bottom = float(curve[fold])
    if top == bottom:
        return SpiralIndices(
            loop_width_deg=0.0,
            loop_height_deg_s=0.0,
            loop_middle_deg=float(np.interp(0.0, grid, curve)),
        )

    middle = 0.5 * (top + bottom)
    sides = np.sign(curve - middle)
    crossings = np.flatnonzero(np.diff(sides))
    return SpiralIndices(
        loop_width_deg=top - bottom,
        loop_height_deg_s=float(np.ptp(grid[crossings])),
        loop_middle_deg=middle,
    )


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
