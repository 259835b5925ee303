"""Late yaw rate and rudder in a log, and a rudder of the wrong sign."""

import math
from typing import NamedTuple

import numpy as np

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
        """What was found, in words."""
        comparison = _COMPARISONS[self.channel]
        side = "late" if self.delay > 0.0 else "early"
        return (
            f"{comparison.name} is {abs(self.delay):.2f} s {side} against"
            f" {comparison.target} (standard error {self.error:.2f} s)"
        )

    @property
    def is_small(self) -> bool:
        """Whether it is left on one clock where nobody decided."""
        return abs(self.delay) <= _COMPARISONS[self.channel].refused_s


def find_late_channels(log: Log) -> list[LateChannel]:
    """Yaw rate and rudder where a log shows that they are late.

    Raises InputError for a rudder of the wrong sign, which is judged by a yaw rate only
    where this does not contradict the heading.
    """
    significant = 2.5  # standard errors
    rate = _rate_offset(log)
    late = []
    for channel, offset in (("r", rate), ("delta", _rudder_offset(log, rate))):
        if offset is None:
            continue
        error = math.hypot(offset.error, _COMPARISONS[channel].dynamics_s)
        is_significant = abs(offset.late) >= significant * error
        if is_significant and offset.certainty >= CERTAIN:
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
    """How late the yaw rate is against the heading, where a log tells it."""
    psi, r = log.channels.get("psi"), log.channels.get("r")
    if psi is None or r is None or not reverses(r):
        return None
    return clock_offset(log.t, psi, r, {})


def _rudder_offset(log: Log, rate: ClockOffset | None) -> ClockOffset | None:
    """Delay of the rudder against the yaw rate, on the clock of the heading.

    None where the log does not show it.

    InputError for a rudder of the wrong sign.
    """
    t, channels = log.t, log.channels
    delta = channels.get("delta")
    if delta is None or not {"psi", "r"} & channels.keys():
        return None
    if not reverses(delta, least=2.0 * DEGREE):
        check_circle(log)
        return None

    if "r" in channels:
        delay = 0.0 if rate is None else rate.late
        r = np.interp(t + delay, t, channels["r"])
    else:
        r = time_derivative(t, channels["psi"])
    rudder = rudder_clock_offset(t, r, delta)
    if _is_against(rudder) and not _is_against(rate):
        without_history = clock_offset(t, r, delta, {"r": r})
        if _is_against(without_history):
            raise _wrong_sign(log, "a yaw acceleration that follows the rudder")
    return rudder


def _is_against(offset: ClockOffset | None) -> bool:
    """Tell whether a channel surely acts with the opposite sign."""
    return offset is not None and offset.gain < 0.0 and offset.certainty > CERTAIN


def check_circle(log: Log) -> None:
    """Refuse a rudder held to one side while the ship turns to the other."""
    if "psi" not in log.channels:
        return
    psi, delta = log.channels["psi"], log.channels["delta"]
    rudder = np.median(delta)
    side = np.sign(rudder)
    is_laid = abs(rudder) > 8.0 * DEGREE
    stays_there = np.quantile(side * delta, 0.1) > 0.0
    turned = side * (psi[-1] - psi[0])
    if is_laid and stays_there and turned < -60.0 * DEGREE:
        raise _wrong_sign(log, "a ship that turns away from the rudder,")


def _wrong_sign(log: Log, found: str) -> InputError:
    return implausible(
        log.where,
        f"expected a positive rudder to turn the bow to starboard, got {found} with the"
        " opposite sign",
        'write rudder_positive = "port" in [conventions], or take it out if it stands'
        " there",
        Proposal("rudder_positive", "port"),
    )
