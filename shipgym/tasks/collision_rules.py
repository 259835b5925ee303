"""Rules 13 to 17 of COLREG in encounters with other ships, counted where broken.

An encounter is of the kind that it has when a risk of collision first exists, and of no
other until the closest point is past (rule 13 d).
"""

from math import fabs, pi
from typing import NamedTuple

from shipgym.engine.mathematics import pick, wrap
from shipgym.engine.motion import Motion, Ship
from shipgym.tasks.other_ships import SAFE
from shipgym.tasks.traffic import (
    CLEAR,
    GIVE_WAY,
    HEAD_ON,
    OVERTAKEN,
    OVERTAKING,
    STAND_ON,
    Approach,
    encounter,
)

RELIEVED = 6.0  # a stand-on ship who has altered her course; she is judged no more
RISK_TIME = 12.0  # times in which own ship travels her length
ALTERED = 0.26  # rad, 15 degrees, from which on an alteration shows


class Watch(NamedTuple):
    """An encounter with another ship as it is judged."""

    kind: float  # of `shipgym.tasks.traffic`, or `RELIEVED`
    own_course: float  # rad, when it began
    tcpa: float  # s, an interval ago


class Broken(NamedTuple):
    """Which rules an interval has broken: 1 or 0 each."""

    rule_13: float  # an overtaking ship passes within the least distance
    rule_14: float  # head-on, the other passes to starboard
    rule_15: float  # crossing ahead of a ship to give way to
    rule_16: float  # no early and substantial action to keep clear
    rule_17: float  # a stand-on ship alters her course early


def no_watch(heading: float) -> Watch:
    """Watch of a ship who is not yet met."""
    return Watch(CLEAR, heading, 0.0)


def watched(
    before: Watch,
    near: Approach,
    motion: Motion,
    least: float,
    ship: Ship,
) -> tuple[Watch, Broken]:
    """Judge an interval of an encounter; `least` is the least distance, m."""
    risk_time = RISK_TIME * ship.length / ship.speed
    met = encounter(near, SAFE * ship.length, risk_time)
    begins = (before.kind == CLEAR) & (met != CLEAR)
    watch = Watch(
        kind=pick(begins, met, before.kind),
        own_course=pick(begins, motion.psi, before.own_course),
        tcpa=before.tcpa,
    )
    broken = broken_in(watch, near, motion, least, risk_time)
    kind = pick(broken.rule_17 > 0.0, RELIEVED, watch.kind)
    after = Watch(
        kind=pick(near.tcpa > 0.0, kind, CLEAR),
        own_course=watch.own_course,
        tcpa=near.tcpa,
    )
    return after, broken


def broken_in(
    watch: Watch,
    near: Approach,
    motion: Motion,
    least: float,
    risk_time: float,
) -> Broken:
    """Rules that an interval has broken; until half the risk time, s, it is early."""
    kind = watch.kind
    early = 0.5 * risk_time
    was_early = watch.tcpa > early
    is_early = near.tcpa > early
    passes = (watch.tcpa > 0.0) & (near.tcpa <= 0.0)
    close_ahead = near.dcpa < least
    waited = was_early & (not is_early) & close_ahead
    gives_way = (kind == OVERTAKING) | (kind == GIVE_WAY) | (kind == HEAD_ON)
    stands_on = (kind == STAND_ON) | (kind == OVERTAKEN)
    altered = fabs(wrap(motion.psi - watch.own_course)) > ALTERED
    to_starboard = near.bearing > 0.0
    ahead_of_her = fabs(near.aspect) < 0.5 * pi
    too_close = near.distance < least
    return Broken(
        rule_13=one_if(passes & (kind == OVERTAKING) & too_close),
        rule_14=one_if(passes & (kind == HEAD_ON) & to_starboard),
        rule_15=one_if(passes & (kind == GIVE_WAY) & ahead_of_her),
        rule_16=one_if(waited & gives_way),
        rule_17=one_if(stands_on & altered & is_early),
    )


def one_if(condition: bool) -> float:
    """1 where a condition holds, else 0."""
    return pick(condition, 1.0, 0.0)


def together(one: Broken, two: Broken) -> Broken:
    """How often two intervals, or encounters, have broken each rule."""
    return Broken(
        rule_13=one.rule_13 + two.rule_13,
        rule_14=one.rule_14 + two.rule_14,
        rule_15=one.rule_15 + two.rule_15,
        rule_16=one.rule_16 + two.rule_16,
        rule_17=one.rule_17 + two.rule_17,
    )
