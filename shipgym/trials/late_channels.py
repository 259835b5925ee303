"""Late yaw rate and rudder in a log, and a rudder of the wrong sign."""

import math
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.clock_offsets import (
    ClockOffset,
    clock_offset,
    reverses,
    rudder_clock_offset,
)
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.plausibility.refusal import Proposal, implausible
from shipgym.trials.resampling import Log
from shipgym.trials.units import DEGREE

CERTAIN = 5.0  # standard errors by which a channel must explain the other


class _Comparison(NamedTuple):
    """A channel and what it is compared with."""

    name: str
    target: str
    dynamics_s: float  # by which ships of other dynamics seem late: a standard error
    refused_s: float  # delay on one clock that is refused


_COMPARISONS = {
    "r": _Comparison("the yaw rate", "the heading", 0.25, 1.0),
    "delta": _Comparison("the rudder", "the yaw acceleration", 1.0, 2.0),
}


class LateChannel(NamedTuple):
    """A channel that is believed to be late, or early where the delay is negative."""

    channel: str
    delay: float  # s
    error: float  # standard error, ships of other dynamics included, s

    @property
    def evidence(self) -> str:
        """Delay found, in words."""
        comparison = _COMPARISONS[self.channel]
        size = abs(self.delay)
        side = "late" if self.delay > 0.0 else "early"
        return (
            f"{comparison.name} is {size:.2f} s {side} against"
            f" {comparison.target} (standard error {self.error:.2f} s)"
        )

    @property
    def is_small(self) -> bool:
        """True if the delay is left uncorrected on one clock by default."""
        comparison = _COMPARISONS[self.channel]
        return abs(self.delay) <= comparison.refused_s


def find_late_channels(log: Log) -> list[LateChannel]:
    """Yaw rate and rudder where a log shows that they are late.

    Raises InputError for a rudder of the wrong sign, which is judged by a yaw rate only
    where this does not contradict the heading.
    """
    significant = 2.5  # standard errors
    rate = _rate_offset(log)
    rudder = _rudder_offset(log, rate)
    late = []
    for channel, offset in {"r": rate, "delta": rudder}.items():
        if offset is None or offset.certainty < CERTAIN:
            continue
        comparison = _COMPARISONS[channel]
        error = math.hypot(offset.error, comparison.dynamics_s)
        if abs(offset.late) >= significant * error:
            late.append(LateChannel(channel, offset.late, error))
    return late


def is_corrected(
    late: LateChannel, choice: str | None, where: str, *, is_one_clock: bool
) -> bool:
    """Decide whether a late channel is corrected, by `choice`, "correct" or "keep".

    Without one, large delays of channels on one clock are an InputError, which begins
    with `where`, small ones are left, and those of channels with clocks of their own
    are corrected.
    """
    if choice is not None or not is_one_clock:
        return choice != "keep"
    if late.is_small:
        return False
    raise InputError(
        f"{where}: expected one clock, got one of which {late.evidence}; to have it"
        ' corrected write clock_offsets = "correct" in [sensors] of the ship file, or'
        ' "keep" if it is so'
    )


def _rate_offset(log: Log) -> ClockOffset | None:
    """Delay of the yaw rate against the heading; None where a log does not show it."""
    if not log.has("psi", "r"):
        return None
    psi = log.channels["psi"]
    r = log.channels["r"]
    if not reverses(r):
        return None
    return clock_offset(log.t, target=psi, late=r, others={})


def _rudder_offset(log: Log, rate: ClockOffset | None) -> ClockOffset | None:
    """Delay of the rudder against the yaw rate, on the clock of the heading.

    None where the log does not show it.

    InputError for a rudder of the wrong sign.
    """
    has_motion = log.has("psi") or log.has("r")
    if not log.has("delta") or not has_motion:
        return None
    delta = log.channels["delta"]
    if not reverses(delta, least=2.0 * DEGREE):
        check_circle(log)
        return None

    r = _rate_on_heading_clock(log, rate)
    rudder = rudder_clock_offset(log.t, r, delta)
    if _is_against(rudder) and not _is_against(rate):
        without_history = clock_offset(log.t, r, delta, {"r": r})
        if _is_against(without_history):
            raise _wrong_sign(log, "a yaw acceleration that follows the rudder")
    return rudder


def _rate_on_heading_clock(log: Log, rate: ClockOffset | None) -> Floats:
    """Yaw rate with its own delay taken out, rad/s."""
    if not log.has("r"):
        psi = log.channels["psi"]
        return time_derivative(log.t, psi)
    r = log.channels["r"]
    if rate is None:
        return r
    on_time = log.t + rate.late
    return np.interp(on_time, log.t, r)


def _is_against(offset: ClockOffset | None) -> bool:
    """Return whether a channel surely acts with the opposite sign."""
    return offset is not None and offset.gain < 0.0 and offset.certainty > CERTAIN


def check_circle(log: Log) -> None:
    """Refuse a rudder held to one side while the ship turns to the other."""
    if not log.has("psi"):
        return
    psi = log.channels["psi"]
    delta = log.channels["delta"]
    rudder = np.median(delta)
    side = np.sign(rudder)
    is_laid = abs(rudder) > 8.0 * DEGREE
    stays_there = np.quantile(side * delta, 0.1) > 0.0
    turned = psi[-1] - psi[0]
    turns_away = side * turned < -60.0 * DEGREE
    if is_laid and stays_there and turns_away:
        raise _wrong_sign(log, "a ship that turns away from the rudder,")


def _wrong_sign(log: Log, found: str) -> InputError:
    """Error of a rudder that is positive to port."""
    return implausible(
        log.where,
        f"expected a positive rudder to turn the bow to starboard, got {found} with the"
        " opposite sign",
        'write rudder_positive = "port" in [conventions], or take it out if it stands'
        " there",
        Proposal("rudder_positive", "port"),
    )
