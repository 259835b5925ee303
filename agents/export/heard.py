"""The sentences that came of late, and why they do not give a number that is needed."""

from collections.abc import Iterable

from shipgym.trials.nmea import (
    NMEA_QUANTITIES,
    NMEA_SENTENCES,
    Sentence,
    parse_sentence,
    steering_numbers,
)


class HeardSentences:
    """The newest sentence of each kind and source, in bounded memory."""

    most = 64  # kinds and sources
    recent_s = 3.0  # older ones are silent
    longest_s = 3600.0

    def __init__(self) -> None:
        self.newest: dict[tuple[str, str], tuple[str, float]] = {}

    def take(self, line: str, source: str, now: float) -> None:
        """Keep a line that came from a source at a time, s."""
        begin = line.find("$")
        sentence = line[begin:]
        talker_and_kind = sentence[1:6]
        kind = talker_and_kind[2:]
        is_plain = talker_and_kind.isascii() and talker_and_kind.isalnum()
        if kind not in NMEA_SENTENCES or not is_plain:
            return
        key = talker_and_kind, source
        self.newest.pop(key, None)  # the oldest stands first
        self.newest[key] = sentence, now
        if len(self.newest) > self.most:
            oldest = next(iter(self.newest))
            del self.newest[oldest]

    def instead_of(self, quantities: Iterable[str], now: float) -> list[str]:
        """Recent sentences that could give one of these, and why they do not."""
        wanted = set(quantities)
        found = {}
        for (address, _), (line, time) in self.newest.items():
            age_s = now - time
            reason = _why_not(line, address[2:], wanted)
            if reason == "" and self.recent_s < age_s < self.longest_s:
                reason = f"silent for {age_s:.0f} s"
            if reason and (age_s < self.recent_s or reason.startswith("silent")):
                found[f"{address}: {reason}"] = True
        return sorted(found, key=lambda text: ": silent for " in text)


def _why_not(line: str, name: str, wanted: set[str]) -> str | None:
    """Reason why a sentence gives none of the quantities; empty if it gives one.

    None for a kind that has nothing to do with them.
    """
    kind = NMEA_SENTENCES[name]
    is_magnetic = "heading" in wanted and "compass_heading" in kind.fields
    concerned = wanted & kind.fields.keys()
    if not concerned and not is_magnetic:
        return None
    try:
        sentence = parse_sentence(line)
        numbers = steering_numbers(sentence)
        if concerned & numbers.keys():
            return ""
        if kind.log_only:
            return "of a kind that is not steered by"
        if is_magnetic:
            return "only magnetic headings, no variation"
        return _refused(sentence, sorted(concerned)[0])
    except (ValueError, IndexError, KeyError):
        return "damaged, or without a checksum"


def _refused(sentence: Sentence, quantity: str) -> str:
    """Reason why a sound sentence gives no number."""
    kind = NMEA_SENTENCES[sentence.kind]
    place = kind.fields[quantity]
    for at, letters in kind.valid.items():
        letter = sentence.fields[at]
        if letter not in letters:
            return f"status {letter or 'empty'}"
    for at, letters in kind.mode.items():
        letter = sentence.fields[at] if at < len(sentence.fields) else ""
        if letter and letter not in letters:
            return f"mode {letter}"
    for at, letters in place.letters.items():
        letter = sentence.fields[at]
        if letter == "M" and "T" in letters:
            return "only magnetic bearings"
        if letter not in letters:
            return f"marked {letter or 'by nothing'}"
    if not sentence.fields[place.at]:
        return "an empty field"
    largest = NMEA_QUANTITIES[quantity].largest
    return f"not valid, or beyond {largest:g}"
