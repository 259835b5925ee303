"""Logs without a rudder."""

from collections.abc import Iterator

from shipgym.trials.plausibility.finding import LogFinding
from shipgym.trials.resampling import Log


def check_has_rudder(log: Log) -> Iterator[LogFinding]:
    """Remark on a log without a rudder angle."""
    if "delta" not in log.channels:
        yield LogFinding(
            log.where,
            "no rudder angle in this log: without rudder nothing can be identified from"
            " it, it can only be looked at",
            "log the rudder too (in NMEA 0183 the sentence RSA)",
            is_remark=True,
        )
