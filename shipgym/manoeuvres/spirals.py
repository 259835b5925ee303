"""Spirals: the manoeuvres that show whether, and how far, a ship is unstable on a straight course.

Direct spiral of Dieudonne and reverse spiral of Bech as described in IMO MSC/Circ.1053
and ITTC 7.5-04-02-01.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Literal

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_number
from shipgym.errors import InputError
from shipgym.manoeuvres.execution import require, rudder
from shipgym.manoeuvres.registry import Manoeuvre
from shipgym.manoeuvres.settling import Voyage
from shipgym.sea.conditions import Weather
from shipgym.ships.linear import is_course_stable
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.simulate import Conditions, Seed
from shipgym.trials.trial import Trial

Method = Literal["direct", "reverse"]

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
STEADY_PART = 1.0 / 3.0  # of a measured plateau, its last part
DIRECT_CAPTION = "Each point a steady turn, with rudder angles there and back."
REVERSE_CAPTION = (
    "Each point a yaw rate held by a helmsman, with the mean rudder that it took."
)
SHORT_PLATEAU = 0.1  # of the longest plateau; shorter ones are the rudder on its way


@dataclass(frozen=True, eq=False)
class Spiral:
    """Steady turns at a sequence of rudder angles."""

    trial: Trial  # the manoeuvre
    # shape (n_points,); of each steady turn, in the order in which they were sailed;
    # deg and deg/s
    rudder_deg: Floats
    yaw_rate_deg_s: Floats
    # {"direct", "reverse"}; whether the rudder was set and the yaw rate observed, or
    # the other way round
    method: Method


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


def direct_spiral(
    model: ShipModel,
    rudder_deg: Sequence[float] = DIRECT_RUDDER_DEG,
    dt: float | None = None,
    water_depth: float = np.inf,
    weather: Weather | str | None = None,
    seed: Seed = 0,
) -> Spiral:
    """Simulate a direct spiral (Dieudonne): rudder angles there and back, each held until the turn is steady.

    The angles, degrees, go from one side to the other; they are sailed in this order
    and then back to the first. The loop is known to within their steps. Other arguments
    are as in `pull_out`. Raises InputError for angles that do not go from one side to
    the other, UnstableModelError if the ship runs away.
    """
    limit = model.steering.rudder_limit_deg
    angles = _one_way(rudder_deg, "rudder_deg", "deg", limit, "the rudder's limit")
    voyage = Voyage(model, dt, Conditions(water_depth, weather, seed))
    angles += angles[-2::-1]
    points = [
        voyage.settle(voyage.hold(np.radians(angle), model.service_shaft_speed))
        for angle in angles
    ]
    rates = np.degrees([rate for _, rate in points])
    return Spiral(voyage.trial("spiral"), np.array(angles), rates, "direct")


def reverse_spiral(
    model: ShipModel,
    yaw_rate_deg_s: Sequence[float] | None = None,
    dt: float | None = None,
    water_depth: float = np.inf,
    weather: Weather | str | None = None,
    seed: Seed = 0,
) -> Spiral:
    """Simulate a reverse spiral (Bech): a helmsman keeps a sequence of yaw rates, each until it is steady.

    It also finds the turns at which an unstable ship would not stay by itself. The
    helmsman is a proportional-integral controller, designed from the rudder's effect on
    the ship.

    The yaw rates, degrees per second, go from one side to the other, by default from
    0.2 to -0.2 times U0 / L; the rudder of each point is the mean of what the helmsman
    ordered. Otherwise as `direct_spiral`.
    """
    voyage = Voyage(model, dt, Conditions(water_depth, weather, seed))
    usual = [float(np.degrees(rate / voyage.length_time)) for rate in REVERSE_RATES]
    given = usual if yaw_rate_deg_s is None else yaw_rate_deg_s
    most = float(np.degrees(1.0 / voyage.length_time))
    rates = _one_way(
        given, "yaw_rate_deg_s", "deg/s", most, "one radian per ship length sailed"
    )
    helmsman = voyage.rate_helmsman()
    points = [voyage.settle(helmsman(np.radians(rate))) for rate in rates]
    angles = np.degrees([rudder for rudder, _ in points])
    return Spiral(voyage.trial("spiral"), angles, np.array(rates), "reverse")


def _one_way(
    values: Sequence[float], argument: str, unit: str, limit: float, what: str
) -> list[float]:
    """Values that go strictly from one side to the other, within a limit."""
    numbers = [
        check_number(
            value,
            f"{argument}[{i}]",
            at_least=-limit,
            at_most=limit,
            hint=f"{what} in {unit}",
        )
        for i, value in enumerate(values)
    ]
    steps = np.sign(np.diff(numbers))
    if (
        len(numbers) < 3
        or abs(steps.sum()) < len(steps)
        or numbers[0] * numbers[-1] >= 0.0
    ):
        raise InputError(
            f"{argument}: {numbers} found, expected at least 3 values in {unit} that"
            " rise or fall from one side to the other, such as 10, 5, 0, -5, -10"
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
    allowed = 1e-9 if "delta_command" in trial.channels else tolerance
    edges = [0]
    for i in range(1, len(delta)):
        if abs(delta[i] - delta[edges[-1]]) > allowed:
            edges.append(i)
    spans = list(pairwise([*edges, len(delta)]))
    durations = np.array([trial.t[last - 1] - trial.t[first] for first, last in spans])
    points = []
    for (first, last), duration in zip(spans, durations, strict=True):
        angle = float(delta[first:last].mean())
        wanted = rudder_deg is None or any(
            abs(angle - other) <= tolerance for other in rudder_deg
        )
        if wanted and duration >= SHORT_PLATEAU * durations.max() and duration > 0.0:
            steady = max(int((last - first) * STEADY_PART), 1)
            points.append((angle, float(rate[last - steady : last].mean())))
    if len(points) < 4:
        raise InputError(
            f"trial {trial.name!r}: {len(points)} steady turns found, expected at least"
            " 4 rudder angles, each held for a while"
        )
    angles, rates = np.array(points).T
    return Spiral(trial, angles, rates, "direct")


def spiral_indices(spiral: Spiral) -> SpiralIndices:
    """Width and height of the loop of a spiral, simulated or measured (`spiral_from_trial`).

    Raises InputError if the yaw rate never changes its side, or a direct spiral does
    not come back.
    """
    check_choice(spiral.method, ("direct", "reverse"), "spiral method")
    if spiral.yaw_rate_deg_s.min() >= 0.0 or spiral.yaw_rate_deg_s.max() <= 0.0:
        raise InputError(
            f"spiral: yaw rates from {spiral.yaw_rate_deg_s.min():.3g} to"
            f" {spiral.yaw_rate_deg_s.max():.3g} deg/s found, expected turns to both"
            " sides"
        )
    find = _direct_loop if spiral.method == "direct" else _reverse_loop
    return SpiralIndices(*find(spiral.rudder_deg, spiral.yaw_rate_deg_s))


def turning_point(angles: Floats) -> int:
    """Number of the point at which a direct spiral turns back: the later of its extreme rudder angles."""
    return int(max(np.argmin(angles), np.argmax(angles)))


def _direct_loop(angles: Floats, rates: Floats) -> tuple[float, float, float]:
    """Width, deg, height, deg/s, and middle, deg: each way changes side at another rudder."""
    turn = turning_point(angles)
    there = np.array([angles[: turn + 1], rates[: turn + 1]])
    back = np.array([angles[turn:], rates[turn:]])
    falling, rising = (there, back) if angles[turn] < angles[0] else (back, there)
    falling, rising = (
        falling[:, np.argsort(falling[0])],
        rising[:, np.argsort(rising[0])],
    )
    if min(falling.shape[1], rising.shape[1]) < 2:
        raise InputError(
            "spiral: rudder angles go one way only, expected a direct spiral there and"
            " back"
        )
    to_port, to_starboard = (
        _changes_side(falling, last=False),
        _changes_side(rising, last=True),
    )
    width = max(to_starboard - to_port, 0.0)
    middle = 0.5 * (to_starboard + to_port)
    height = float(np.interp(middle, *falling) - np.interp(middle, *rising))
    return width, max(height, 0.0), middle


def _changes_side(way: Floats, last: bool) -> float:
    """Rudder at which the yaw rate of one way goes through zero, deg; angles in row 0 rise."""
    angles, rates = way
    change = np.flatnonzero((rates[:-1] <= 0.0) & (rates[1:] > 0.0))
    if len(change) == 0:
        raise InputError(
            "spiral: one of its two ways stays on one side, expected turns to both"
            " sides"
        )
    k = int(change[-1] if last else change[0])
    return float(np.interp(0.0, rates[k : k + 2], angles[k : k + 2]))


def _reverse_loop(angles: Floats, rates: Floats) -> tuple[float, float, float]:
    """Width, deg, height, deg/s, and middle, deg, of the fold in the curve of rudder over yaw rate."""
    from scipy.interpolate import Akima1DInterpolator

    order = np.argsort(rates)
    grid = np.linspace(rates.min(), rates.max(), 4001)
    curve = np.asarray(Akima1DInterpolator(rates[order], angles[order])(grid))
    highest = np.maximum.accumulate(curve)
    low = int(np.argmax(highest - curve))
    width = float(highest[low] - curve[low])
    if width == 0.0:
        return 0.0, 0.0, float(np.interp(0.0, grid, curve))
    middle = 0.5 * (highest[low] + curve[low])
    inside = grid[np.flatnonzero(np.diff(np.sign(curve - middle)))]
    return width, float(np.ptp(inside)), float(middle)


def standard_spirals(
    model: ShipModel, water_depth: float = np.inf
) -> dict[str, Manoeuvre]:
    """A direct spiral, and a reverse one where the ship is unstable on a straight course."""
    angles = [a for a in DIRECT_RUDDER_DEG if abs(a) <= model.steering.rudder_limit_deg]
    direct = partial(direct_spiral, rudder_deg=angles, water_depth=water_depth)
    spirals = {
        "direct spiral": Manoeuvre(
            direct, spiral_indices, SpiralIndices, DIRECT_CAPTION
        )
    }
    with suppress(InputError):  # there may be no straight course at all
        if is_course_stable(model):
            return spirals
    reverse = partial(reverse_spiral, water_depth=water_depth)
    return spirals | {
        "reverse spiral": Manoeuvre(
            reverse, spiral_indices, SpiralIndices, REVERSE_CAPTION
        )
    }
