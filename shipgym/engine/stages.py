"""Many ships through a step stage by stage, for ships part of whose accelerations is a sum over a table.

A loop over the rows of a table inside the loop over lanes would keep that one from
being vectorised. So each stage of the Runge-Kutta step is finished in all lanes of a
tile before the next one, and the loop over rows has that over lanes inside. What stands
between the loops lies in the room for results.
"""

from typing import Any, NamedTuple

from shipgym.engine.episodes import GROUP, Tile, end_of_step
from shipgym.engine.mathematics import clip
from shipgym.engine.motion import HAS_SHAFT, Motion, Rates, arrival, rates, stage, way
from shipgym.engine.places import (
    common_sea,
    common_ship,
    load_course,
    load_motion,
    load_passed,
    load_point,
    load_sea,
    load_slope,
    load_sums,
    point_of,
    push,
    row_sums,
    sea_at,
    ship_at,
    store_motion,
    store_passed,
    store_point,
    store_slope,
    store_sums,
    sum_accelerations,
)

N_ROWS = 0  # part: of the table that is summed over, a multiple of
ROWS_AT_ONCE = 4  # written out, so that sums are loaded and stored less often


class Point(NamedTuple):
    """Where a ship is in the coordinates of her table."""

    a: float
    b: float
    c: float
    d: float
    half: float  # half the squared distance from the origin


class Sums(NamedTuple):
    """Sums over the rows of the table, of surge, sway and yaw."""

    u: float
    v: float
    r: float


class Passed(NamedTuple):
    """Runge and Kutta's sums of the stages so far."""

    total: Rates
    ahead: float
    aside: float


def sail_lanes(tile: Tile, h: float, groups: int) -> None:
    """Move ships by h seconds, as `shipgym.engine.episodes.sail_lanes`."""
    result, none = tile.result, Rates(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for lane in range(groups * GROUP):
        store_slope(result, lane, none)
        store_passed(result, lane, Passed(none, 0.0, 0.0))
    for number in range(4):
        part = 0.0 if number == 0 else (1.0 if number == 3 else 0.5)
        prepare(tile, part * h, groups)
        common = common_ship(tile.ships)
        for row in range(0, N_ROWS, ROWS_AT_ONCE):
            for lane in range(groups * GROUP):
                _, coefficients = ship_at(common, tile.ships, lane)
                at, sums, terms = (
                    load_point(result, lane),
                    load_sums(result, lane),
                    coefficients.terms,
                )
                sums = row_sums(at, row_sums(at, sums, terms, row), terms, row + 1)
                sums = row_sums(at, row_sums(at, sums, terms, row + 2), terms, row + 3)
                store_sums(result, lane, sums)
        conclude(tile, part * h, 2.0 if number == 1 or number == 2 else 1.0, groups)
    arrive(tile, h, groups)


def start_of(
    tile: Tile, common: Any, lane: int
) -> tuple[Motion, float, float, Any, Any]:
    """State at the beginning of the step, heading as zero; orders to rudder and shaft; the ship."""
    ship, coefficients = ship_at(common, tile.ships, lane)
    m, course = load_motion(tile.state, lane), load_course(tile.state, lane)
    order = clip(
        course.rudder_command * ship.rudder_limit, -ship.rudder_limit, ship.rudder_limit
    )
    shaft = course.shaft_command * ship.shaft
    n = m.n if HAS_SHAFT else shaft
    return (
        Motion(0.0, 0.0, 0.0, m.u, m.v, m.r, m.p, m.phi, m.q, m.delta, n),
        order,
        shaft,
        ship,
        coefficients,
    )


def prepare(tile: Tile, h: float, groups: int) -> None:
    """Where the ships are at a stage, h seconds along the slope of the one before."""
    result, common = tile.result, common_ship(tile.ships)
    for lane in range(groups * GROUP):
        start, order, _, ship, coefficients = start_of(tile, common, lane)
        at = stage(start, load_slope(result, lane), h, order, ship)
        store_point(result, lane, point_of(at, coefficients.terms, ship))
        store_sums(result, lane, Sums(0.0, 0.0, 0.0))


def conclude(tile: Tile, h: float, weight: float, groups: int) -> None:
    """The slope at a stage, and what it adds to the step."""
    result, common, sea_common = (
        tile.result,
        common_ship(tile.ships),
        common_sea(tile.ships),
    )
    for lane in range(groups * GROUP):
        start, order, shaft, ship, coefficients = start_of(tile, common, lane)
        at = stage(start, load_slope(result, lane), h, order, ship)
        pushed = push(
            load_motion(tile.state, lane),
            load_sea(tile.state, lane),
            sea_at(sea_common, tile.ships, lane),
        )
        k = rates(at, order, shaft, pushed, coefficients, ship)
        udot, vdot, rdot = sum_accelerations(at, load_sums(result, lane), ship)
        k = Rates(
            k.psi, k.u + udot, k.v + vdot, k.r + rdot, k.p, k.phi, k.q, k.delta, k.n
        )
        passed, (ahead, aside) = load_passed(result, lane), way(at)
        store_slope(result, lane, k)
        total = added(passed.total, weight, k)
        store_passed(
            result,
            lane,
            Passed(total, passed.ahead + weight * ahead, passed.aside + weight * aside),
        )


def added(total: Rates, w: float, k: Rates) -> Rates:
    """Rates and others times a weight."""
    return Rates(
        total.psi + w * k.psi,
        total.u + w * k.u,
        total.v + w * k.v,
        total.r + w * k.r,
        total.p + w * k.p,
        total.phi + w * k.phi,
        total.q + w * k.q,
        total.delta + w * k.delta,
        total.n + w * k.n,
    )


def arrive(tile: Tile, h: float, groups: int) -> None:
    """Ships at the end of the step."""
    common, sea_common = common_ship(tile.ships), common_sea(tile.ships)
    for lane in range(groups * GROUP):
        start, order, _, ship, _ = start_of(tile, common, lane)
        passed, before = load_passed(tile.result, lane), load_motion(tile.state, lane)
        p = sea_at(sea_common, tile.ships, lane)
        pushed = push(before, load_sea(tile.state, lane), p)
        after = arrival(
            before,
            start,
            passed.total,
            passed.ahead,
            passed.aside,
            order,
            h,
            pushed,
            ship,
        )
        store_motion(tile.state, lane, end_of_step(tile, lane, after, h, ship, p))


#: What stands between the loops, by the names of `shipgym.engine.places`.
ROOM = {"point": Point, "sums": Sums, "slope": Rates, "passed": Passed}
