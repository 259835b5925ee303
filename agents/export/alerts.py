"""Alerts of the helm as sentences: ALR, and for bridge alert management ALF and ALC.

A central alert management system shows them and answers with ACN (IEC 61924-2).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import NamedTuple

from agents.export.nmea import sentences
from shipgym.trials.nmea import parse_sentence


class AlertKind(NamedTuple):
    """An alert that the helm may give."""

    number: int
    priority: str  # A alarm, W warning, C caution
    title: str


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
        longest = 40
        fields = [
            "AGALR",
            "",
            f"{self.kind.number:03d}",
            "V" if self.state == "N" else "A",
            "A" if self.state == "A" else "V",
            _plain(self.text, longest),
        ]
        return _line(fields)

    def alf(self) -> str:
        """The alert as one ALF, or two where its text says more than its title."""
        longest = 44
        text = _plain(self.text, longest)
        has_text = not text.startswith(self.kind.title)
        number = ["", str(self.identifier), "1", str(self.revision), "0"]
        first = [
            "AGALF",
            "2" if has_text else "1",
            "1",
            str(self.kind.number),
            datetime.now(UTC).strftime("%H%M%S.00"),
            "B",
            self.kind.priority,
            self.state,
            *number,
            self.kind.title,
        ]
        lines = _line(first)
        if has_text:
            nothing = [""] * 4
            second = ["AGALF", "2", "2", str(self.kind.number), *nothing, *number, text]
            lines += _line(second)
        return lines


def _line(fields: list[str]) -> str:
    return ",".join(fields) + "\n"


def _plain(text: str, longest: int) -> str:
    """The beginning of a text, without characters that mean something in a sentence."""
    reserved = ",*$!\\^~\r\n"
    blanks = str.maketrans(reserved, " " * len(reserved))
    return text.upper().translate(blanks)[:longest]


def _kind(name: str) -> AlertKind:
    """Number, priority and title of an alert; any other warning has number 9."""
    kinds = {
        "alarm": AlertKind(1, "A", "AUTOPILOT FAULT"),
        "off heading": AlertKind(2, "W", "OFF HEADING"),
        "off track": AlertKind(3, "W", "OFF TRACK"),
        "course change ahead": AlertKind(4, "C", "COURSE CHANGE"),
        "next leg waits to be confirmed": AlertKind(5, "W", "NEXT LEG"),
        "log cannot be written": AlertKind(6, "C", "LOG"),
    }
    title = _plain(name, longest=16)
    other = AlertKind(9, "W", title)
    return kinds.get(name, other)


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
                self.given[kind] = Alert(_kind(kind), text)
                continue
            was_silent = now - alert.silenced_at > silence_s
            if alert.state == "N":
                alert.text = text
                alert.change("V")
            elif alert.state == "S" and was_silent:
                alert.change("V")
        for kind, alert in self.given.items():
            if kind not in texts and alert.state != "N":
                alert.change("N")

    def hear(self, line: str, now: float) -> None:
        """Take a command: ACN, or the older ACK with the number of an ALR."""
        if line[3:6] not in ("ACN", "ACK"):
            return
        sentence = parse_sentence(line)
        if sentence.kind == "ACK":
            number = int(sentence.fields[0])
            self._command(10000 + number, "A", now)
            return
        _, _, identifier, _, command, flag = sentence.fields
        if flag == "C":
            self._command(int(identifier), command, now)

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
        repeat_s, list_s = 0.99, 30.0
        alerts = self.given.values()
        changed = [alert for alert in alerts if alert.is_new]
        active = [alert for alert in alerts if alert.state != "N"]
        text = self.answers
        self.answers = ""
        for alert in changed:
            alert.is_new = False
            text += alert.alf()

        is_due = now - self.repeated_at >= repeat_s
        if changed or is_due or now == self.repeated_at:
            self.repeated_at = now
            ended = [alert for alert in changed if alert.state == "N"]
            for alert in (*active, *ended):
                text += alert.alr()
        if now - self.listed_at >= list_s:
            self.listed_at = now
            text += _listed(active)
        return sentences(text)


def _listed(alerts: list[Alert]) -> str:
    """Alerts as ALC."""
    count = str(len(alerts))
    fields = ["AGALC", "01", "01", "00", count]
    for alert in alerts:
        identifier = str(alert.identifier)
        revision = str(alert.revision)
        fields += ["", identifier, "1", revision]
    return _line(fields)
