"""Many ships through a step stage by stage, for ships with a sum over a table.

A loop over the rows of a table inside the loop over lanes would keep that one from
being vectorised. So each stage of the Runge-Kutta step is finished in all lanes of a
tile before the next one, and the loop over rows has that over lanes inside. Records
between the loops lie with the results of the tile.
"""

from shipgym.engine.hooks import (
    add_row,
    load_coefficients,
    load_commands,
    load_motion,
    load_point,
    load_slope,
    load_slopes,
    load_sums,
    point_of,
    store_point,
    store_slope,
    store_slopes,
    store_sums,
    sum_accelerations,
)
from shipgym.engine.lane_records import Point, Sums
from shipgym.engine.mathematics import clip
from shipgym.engine.motion import (
    NO_RATES,
    Held,
    Motion,
    Rates,
    Ship,
    add_rates,
    end_of_step,
    rates,
    stage,
    start_of_step,
)
from shipgym.engine.record_code import changer
from shipgym.engine.sailing import end_substep, push_of, ship_of
from shipgym.engine.specialise import called
from shipgym.engine.tiles import FIRST_LANE, GROUP, SHARED_SHIP, Tile

N_ROWS = 0  # of the table that is summed over, a multiple of 4; set by the ship


#: Part of the step at which a stage lies, and its weight.
STAGES = ((0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0))
NO_SUMS = Sums(0.0, 0.0, 0.0)
with_accelerations = changer(Rates, "u", "v", "r")
#: Records between the loops, by the names of `shipgym.engine.hooks`.
BETWEEN_STAGES = {"point": Point, "sums": Sums, "slope": Rates, "slopes": Rates}


@called
def sail_in_stages(tile: Tile, h: float, groups: int) -> None:
    """Move ships by h seconds: the hook `sail_lanes` of a ship with a table."""
    for lane in range(groups * GROUP):
        store_slope(tile.result, lane, NO_RATES)
        store_slopes(tile.result, lane, NO_RATES)
    for part, weight in STAGES:
        begin_stage(tile, part * h, groups)
        sum_rows(tile, groups)
        end_stage(tile, part * h, weight, groups)
    shared = ship_of(tile, FIRST_LANE)
    for lane in range(groups * GROUP):
        ship, _ = shared if SHARED_SHIP else ship_of(tile, lane)
        start, held = start_of(tile, lane, ship)
        before = load_motion(tile.state, lane)
        slopes = load_slopes(tile.result, lane)
        after = end_of_step(before, start, slopes, held, h, ship)
        end_substep(tile, lane, after, h, ship)


def start_of(tile: Tile, lane: int, ship: Ship) -> tuple[Motion, Held]:
    """State at the start of the step, and the inputs held over it."""
    motion = load_motion(tile.state, lane)
    commands = load_commands(tile.state, lane)
    limit = ship.rudder_limit
    rudder = commands.rudder_command * limit
    shaft = commands.shaft_command * ship.shaft
    held = Held(
        order=clip(rudder, -limit, limit),
        shaft=shaft,
        push=push_of(tile, lane),
    )
    return start_of_step(motion, shaft), held


def state_at_stage(tile: Tile, lane: int, reach: float, ship: Ship) -> Motion:
    """State `reach` seconds along the rates at the stage before."""
    start, held = start_of(tile, lane, ship)
    return stage(start, load_slope(tile.result, lane), reach, held.order, ship)


def begin_stage(tile: Tile, reach: float, groups: int) -> None:
    """Find the positions of ships at a stage, in the coordinates of their tables."""
    shared = ship_of(tile, FIRST_LANE)
    for lane in range(groups * GROUP):
        ship, coefficients = shared if SHARED_SHIP else ship_of(tile, lane)
        motion = state_at_stage(tile, lane, reach, ship)
        point = point_of(motion, coefficients.terms, ship)
        store_point(tile.result, lane, point)
        store_sums(tile.result, lane, NO_SUMS)


def sum_rows(tile: Tile, groups: int) -> None:
    """Sum over the rows of the tables, four at once, to store sums less often."""
    _, shared = ship_of(tile, FIRST_LANE)
    for row in range(0, N_ROWS, 4):
        for lane in range(groups * GROUP):
            terms = shared.terms
            if not SHARED_SHIP:
                terms = load_coefficients(tile.ships, lane).terms
            point = load_point(tile.result, lane)
            sums = load_sums(tile.result, lane)
            sums = add_row(point, sums, terms, row)
            sums = add_row(point, sums, terms, row + 1)
            sums = add_row(point, sums, terms, row + 2)
            sums = add_row(point, sums, terms, row + 3)
            store_sums(tile.result, lane, sums)


def end_stage(tile: Tile, reach: float, weight: float, groups: int) -> None:
    """Compute the rates at a stage, and add them to those of the step."""
    shared = ship_of(tile, FIRST_LANE)
    for lane in range(groups * GROUP):
        ship, coefficients = shared if SHARED_SHIP else ship_of(tile, lane)
        _, held = start_of(tile, lane, ship)
        motion = state_at_stage(tile, lane, reach, ship)

        slope = rates(motion, held, coefficients, ship)
        sums = load_sums(tile.result, lane)
        udot, vdot, rdot = sum_accelerations(motion, sums, ship)
        slope = with_accelerations(
            slope, slope.u + udot, slope.v + vdot, slope.r + rdot
        )
        slopes = load_slopes(tile.result, lane)
        store_slope(tile.result, lane, slope)
        store_slopes(tile.result, lane, add_rates(slopes, weight, slope))
