"""Alerts of the helm as sentences: ALR, and for bridge alert management ALF and ALC.

A central alert management system shows them and answers with ACN (IEC 61924-2).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import NamedTuple

from agents.deployment.nmea import sentences
from shipgym.trials.nmea import parse_sentence


class AlertKind(NamedTuple):
    """An alert that the helm may give."""

    number: int
    priority: str  # A alarm, W warning, C caution
    title: str


KINDS = {
    "alarm": AlertKind(1, "A", "AUTOPILOT FAULT"),
    "off heading": AlertKind(2, "W", "OFF HEADING"),
    "off track": AlertKind(3, "W", "OFF TRACK"),
    "course change ahead": AlertKind(4, "C", "COURSE CHANGE"),
    "next leg waits to be confirmed": AlertKind(5, "W", "NEXT LEG"),
    "log cannot be written": AlertKind(6, "C", "LOG"),
}


@dataclass
class Alert:
    """An alert and what has become of it."""

    kind: AlertKind
    text: str
    state: str = "V"  # V not acknowledged, A acknowledged, S silenced, N normal
    revision: int = 1
    silenced_at: float = 0.0  # s
    is_new: bool = True  # not yet sent as it is

    def change(self, state: str) -> None:
        """Take on another state."""
        most = 99
        self.state = state
        self.revision = self.revision % most + 1
        self.is_new = True

    @property
    def identifier(self) -> int:
        """Its number among those of manufacturers."""
        return 10000 + self.kind.number

    def alr(self) -> str:
        """The alert as ALR, which has 40 characters of text."""
        condition = "V" if self.state == "N" else "A"
        acknowledged = "A" if self.state == "A" else "V"
        text = _plain(self.text)[:40]
        return f"AGALR,,{self.kind.number:03d},{condition},{acknowledged},{text}\n"

    def alf(self) -> str:
        """The alert as one ALF, or two where its text says more than its title."""
        number = f"{self.identifier},1,{self.revision},0"
        text = _plain(self.text)[:44]
        total = 1 if text.startswith(self.kind.title) else 2
        message = self.kind.number
        now = datetime.now(UTC).strftime("%H%M%S.%f")[:9]
        priority = self.kind.priority
        first = f"AGALF,{total},1,{message},{now},B,{priority},{self.state},,{number}"
        lines = f"{first},{self.kind.title}\n"
        if total > 1:
            lines += f"AGALF,2,2,{message},,,,,,{number},{text}\n"
        return lines


def _plain(text: str) -> str:
    """A text without characters that mean something in a sentence."""
    kept = [" " if letter in ",*$!\\^~\r\n" else letter for letter in text.upper()]
    return "".join(kept)


class Alerts:
    """Alerts that are given, by their kind."""

    def __init__(self) -> None:
        self.given: dict[str, Alert] = {}
        self.answers = ""  # to commands that are refused
        self.repeated_at = float("-inf")  # s
        self.listed_at = float("-inf")

    def update(self, texts: Mapping[str, str], now: float) -> None:
        """Give alerts by kind with their texts; those that are gone become normal."""
        silence_s = 30.0
        for kind, text in texts.items():
            alert = self.given.get(kind)
            if alert is None:
                self.given[kind] = Alert(KINDS[kind], text)
            elif alert.state == "N":
                alert.text = text
                alert.change("V")
            elif alert.state == "S" and now - alert.silenced_at > silence_s:
                alert.change("V")
        for kind, alert in self.given.items():
            if kind not in texts and alert.state != "N":
                alert.change("N")

    def hear(self, line: str, now: float) -> None:
        """Take a command: ACN, or the older ACK with the number of an ALR."""
        if line[3:6] not in ("ACN", "ACK"):
            return
        sentence = parse_sentence(line)
        fields = sentence.fields
        if sentence.kind == "ACK":
            self._command(10000 + int(fields[0]), "A", now)
        elif fields[5] == "C" and fields[2].isdecimal():
            self._command(int(fields[2]), fields[4], now)

    def _command(self, identifier: int, command: str, now: float) -> None:
        """Acknowledge, silence or repeat an alert; refuse anything else."""
        for alert in self.given.values():
            if alert.identifier != identifier:
                continue
            if command == "Q":
                alert.is_new = True
            elif command == "A" and alert.state in "VS":
                alert.change("A")
            elif command == "S" and alert.state == "V":
                alert.silenced_at = now
                alert.change("S")
            else:
                self.answers = f"AGARC,,,{identifier},1,{command}\n"

    def sentences(self, now: float) -> str:
        """ALF of what has changed, ALR once a second, the list ALC twice a minute."""
        changed = [alert for alert in self.given.values() if alert.is_new]
        active = [alert for alert in self.given.values() if alert.state != "N"]
        text = self.answers
        self.answers = ""
        for alert in changed:
            alert.is_new = False
            text += alert.alf()

        repeat_s, list_s = 0.99, 30.0
        is_due = now == self.repeated_at or now - self.repeated_at >= repeat_s
        if changed or is_due:
            self.repeated_at = now
            for alert in {id(one): one for one in (*changed, *active)}.values():
                text += alert.alr()
        if now - self.listed_at >= list_s:
            self.listed_at = now
            entries = [f",,{one.identifier},1,{one.revision}" for one in active]
            text += f"AGALC,01,01,00,{len(active)}{''.join(entries)}\n"
        return sentences(text)
