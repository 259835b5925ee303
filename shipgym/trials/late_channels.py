"""Late yaw rate and rudder in a log, and a rudder of the wrong sign."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats, integral
from shipgym.errors import InputError
from shipgym.trials.clock_offsets import (
    LONGEST_DELAY_S,
    ClockOffset,
    clock_offset,
    cycle_time,
    reverses,
    rudder_clock_offset,
)
from shipgym.trials.plausibility.refusal import Proposal, implausible
from shipgym.trials.resampling import Log
from shipgym.trials.units import DEGREE

CERTAIN = 6.0  # standard errors by which a channel must explain the other


class _Comparison(NamedTuple):
    """A channel and what it is compared with."""

    name: str
    target: str
    refused_s: float  # delay on one clock, less its error, that is refused


_COMPARISONS = {
    "r": _Comparison("the yaw rate", "the heading", 1.0),
    "delta": _Comparison("the rudder", "the yaw acceleration", 1.5),
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
        return abs(self.delay) - self.error <= comparison.refused_s


def find_late_channels(log: Log) -> list[LateChannel]:
    """Yaw rate and rudder where a log shows that they are late.

    Raises InputError for a rudder of the wrong sign, which is judged by a yaw rate only
    where this does not contradict the heading.
    """
    found = _suspects(log)
    if not found:
        return []
    believed = []
    for suspect in found:
        delays = _delays_with_more_noise(log, suspect.channel)
        if _holds(suspect, delays):
            believed.append(suspect)
    return believed


def _suspects(log: Log) -> list[LateChannel]:
    """Channels that one log, as it stands, shows late by more than its errors."""
    rate = _rate_offset(log)
    rudder = _rudder_offset(log, rate)
    late = []
    if rate is not None and rate.certainty >= CERTAIN:
        late.append(_late("r", rate, dynamics_s=0.25))

    # where the yaw rate is the derivative of a heading with noise
    certain_derived = 10.0
    needed = CERTAIN if log.has("r") else certain_derived
    if rudder is not None and rudder.certainty >= needed:
        suspect = _late_rudder(log, rudder)
        if suspect is not None:
            late.append(suspect)

    significant = 2.5  # standard errors
    return [one for one in late if abs(one.delay) >= significant * one.error]


def _late_rudder(log: Log, offset: ClockOffset) -> LateChannel | None:
    """Delay of the rudder; None where it is long against the rudder's cycle."""
    delta = log.channels["delta"]
    cycle = cycle_time(log.t, delta)
    # by which slow ships of other dynamics seem late
    dynamics_s = max(1.0, cycle / 300.0)

    # an early rudder looks like that of a ship which answers slowly
    cycles = 1.0 / 18.0 if offset.late > 0.0 else 1.0 / 30.0
    longest = min(cycles * cycle, 0.9 * LONGEST_DELAY_S)
    if abs(offset.late) > longest:
        return None
    return _late("delta", offset, dynamics_s)


def _late(channel: str, offset: ClockOffset, dynamics_s: float) -> LateChannel:
    """Delay of a channel; `dynamics_s` is a standard error by the ship's dynamics."""
    error = math.hypot(offset.error, dynamics_s)
    return LateChannel(channel, offset.late, error)


def _holds(suspect: LateChannel, delays: Floats) -> bool:
    """Return whether the delay is still there with more noise, and none of its making.

    What noise does to a delay it does again when as much is added (simulation
    extrapolation: Cook & Stefanski 1994), so the delay without noise is the first one
    less the change.
    """
    is_found = np.isfinite(delays)
    if is_found.mean() < 0.75:
        return False
    found = delays[is_found]
    middle = float(np.median(found))
    spread = float(np.std(found))
    change = middle - suspect.delay
    noise = math.hypot(change, spread)
    size = abs(suspect.delay)
    return noise < 0.4 * size


def _delays_with_more_noise(log: Log, channel: str) -> Floats:
    """Delays of a channel in copies of a log with its own noise added once more, s.

    NaN where a copy shows none.
    """
    n_copies = 8
    random = np.random.default_rng(0)
    names = [name for name in ("psi", "r", "delta") if log.has(name)]
    delays = np.full(n_copies, np.nan)
    for copy in range(n_copies):
        channels = dict(log.channels)
        for name in names:
            values = log.channels[name]
            noise = white_noise(values) * random.standard_normal(values.size)
            channels[name] = values + noise
        noisy = replace(log, channels=channels)
        offset = _offset_of(noisy, channel)
        if offset is not None:
            delays[copy] = offset.late
    return delays


def _offset_of(log: Log, channel: str) -> ClockOffset | None:
    """Delay of one channel; None too where the rudder seems to have the wrong sign."""
    rate = _rate_offset(log)
    if channel == "r":
        return rate
    try:
        return _rudder_offset(log, rate)
    except InputError:
        return None


def white_noise(values: Floats) -> float:
    """Standard deviation of white noise on a smooth signal, by fourth differences."""
    differences = np.diff(values, n=4)
    magnitude = np.median(np.abs(differences))
    of_differences = 1.4826 * magnitude  # if they are normally distributed
    gain = math.sqrt(70.0)  # 1 + 16 + 36 + 16 + 1
    return float(of_differences / gain)


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

    if log.has("r"):
        r = _rate_on_heading_clock(log, rate)
    else:
        # the same mean for both, so that one follows the other as before
        r = _window_mean(log.t, log.channels["psi"])
        delta = _window_mean(log.t, integral(log.t, delta))
    rudder = rudder_clock_offset(log.t, r, delta)
    if _is_against(rudder) and not _is_against(rate):
        without_history = clock_offset(log.t, r, delta, {"r": r})
        if _is_against(without_history):
            raise _wrong_sign(log, "a yaw acceleration that follows the rudder")
    return rudder


def _window_mean(t: Floats, total: Floats) -> Floats:
    """Mean over windows of 5 s of what adds up to a total, about each sample."""
    length = 5.0  # s
    half = 0.5 * length
    begin = t - half
    end = t + half
    before = np.interp(begin, t, total)
    after = np.interp(end, t, total)
    added = after - before
    mean: Floats = added / length
    return mean


def _rate_on_heading_clock(log: Log, rate: ClockOffset | None) -> Floats:
    """Yaw rate with its own delay taken out, rad/s."""
    r = log.channels["r"]
    if rate is None:
        return r
    t = log.t
    on_time = t + rate.late
    return np.interp(on_time, t, r)


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
