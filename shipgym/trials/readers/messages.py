"""Messages of a bus or a recorder, whatever their form, by channel and source."""

import re
from collections import defaultdict
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

#: A raw frame of NMEA 2000 in a line: as canboat, candump and the gateways of Yacht
#: Devices and Actisense write it.
RAW_FRAME = re.compile(
    r"\d{4}-\d\d-\d\d[^,\s]+,\d,\d{5,6},|can\d+\s+[0-9A-F]{8}(?:#|\s+\[)"
    r"|\d\d:\d\d:\d\d\.\d+ [RT] [0-9A-F]{8}\s|A\d+\.\d+ [0-9A-F]{5} [0-9A-F]{5}\s"
)


_TAG = re.compile(r"[\\,]c:(\d{9,14}(?:\.\d+)?)")
_CLOCK = re.compile(
    r"(?<!\d)(\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4})?[-T ,;_Z]*"
    r"(\d\d?:\d\d:\d\d(?:[.,]\d+)?)"
    r" ?(Z|UTC|[+-]\d\d:?\d\d)?"
)
#: Seconds or fractions of them since 1970, or seconds with decimals since some start.
_NUMBER = re.compile(r"(?<![\w.:/-])A?(\d{9,19}(?:\.\d+)?|\d+\.\d+)(?![\w.:/])")


def stamp_text(before: str) -> str:
    r"""The time in what a recorder wrote before a message; empty where there is none.

    Examples are ``2021-05-03 09:59:50.123``, ``[12:00:01]``, ``1620035990123;A;``,
    ``(1620035990.123) can0`` and ``\s:gyro,c:1620035990*3F\``.
    """
    tag = _TAG.search(before)
    if tag is not None:
        return tag[1]
    clock = _CLOCK.search(before)
    if clock is None:
        number = _NUMBER.search(before)
        return "" if number is None else number[1]
    date, time, zone = clock.groups("")
    if date[:4].isdigit():
        date = re.sub("[/.]", "-", date)
    zone = "" if zone in ("Z", "UTC") or not date else zone
    return f"{date} {time.replace(',', '.')}{zone}".strip()


class Value(NamedTuple):
    """One value of a channel, or one time."""

    line: int
    time: float  # s since 1970 or of the day; nan where the message has none
    value: float


BySource = dict[str, list[Value]]  # by sender and kind, such as HEHDT


def _by_source() -> BySource:
    return defaultdict(list)


@dataclass
class Heard:
    """Contents of the messages of a log.

    Attributes
    ----------
    times : dict
        Times that messages give, by source.
    channels : dict
        Values by channel and source, in SI units, positions in degrees. Channels of
        their own are ``psi_magnetic`` (a heading by compass) and ``variation``.
    stamps : dict of int to str
        Time before a line, by line.
    order : list of tuple
        Line and source of each message.
    count : int
        Messages of known kinds.
    damaged : list of int
        Lines of messages that could not be read.
    notes : list of str
        What was left out or assumed.
    """

    times: BySource = field(default_factory=_by_source)
    channels: dict[str, BySource] = field(
        default_factory=lambda: defaultdict(_by_source)
    )
    stamps: dict[int, str] = field(default_factory=dict)
    order: list[tuple[int, str]] = field(default_factory=list)
    count: int = 0
    damaged: list[int] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def hear(
        self,
        line: int,
        source: str,
        values: dict[str, float],
        time: float = np.nan,
    ) -> None:
        """Add what a source said in a line, with the time that it gave, if any.

        A heading by compass gets its deviation, and is true if the variation is known.
        The port one of two rudders is a source of its own.
        """
        if "port" in values:
            self.hear(line, f"{source} port", {"delta": values.pop("port")}, time)
        deviation = values.pop("deviation", 0.0)
        if "psi_magnetic" in values:
            values["psi_magnetic"] += deviation
            if "variation" in values:
                magnetic = values.pop("psi_magnetic")
                values.setdefault("psi", magnetic + values["variation"])
        self.count += 1
        self.order.append((line, source))
        if np.isfinite(time):
            self.times[source].append(Value(line, time, time))
        for channel, value in values.items():
            self.channels[channel][source].append(Value(line, time, value))

    def damage(self, line: int) -> None:
        """Count a message that cannot be read."""
        self.count += 1
        self.damaged.append(line)

    def stamp(self, line: int, before: str) -> None:
        """Add the time that a recorder wrote before a message, if there is one."""
        text = stamp_text(before)
        if text:
            self.stamps[line] = text
