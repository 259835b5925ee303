"""Sentences, cards and rows of tables that the report shows of a verification."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from agents.controllers.controller import Controller
from agents.verification.figures import criterion_name
from agents.verification.result import (
    Verification,
    pilot_metrics,
    track_metrics,
)
from identification.report.view import Card
from shipgym.manoeuvres import Criterion
from shipgym.pages import NONE, fixed, number, percent


@dataclass(frozen=True)
class GainRow:
    """Gains on one signal: the name and value of each design's, None where it has none.

    With the sign that they have in the file.
    """

    signal: str
    unit: str
    gains: list[tuple[str, float] | None]


@dataclass(frozen=True)
class MarginRow:
    """One margin of each design."""

    name: str
    unit: str
    values: list[str]


@dataclass(frozen=True)
class CriterionRow:
    """A criterion and its verdict."""

    name: str
    notes: str  # paragraph, and remarks
    passed: bool | None  # None where it is not decided
    measured: float | None
    measured_error: str  # with the side, in words
    value: float | None
    interval: str
    lost: str  # draws without a value, in words
    limit: float
    unit: str
    probability: float | None  # of passing


@dataclass(frozen=True, eq=False)
class VerificationView:
    """Contents of the report about a verification, but for its figures."""

    draws: int
    seed: int
    length: float  # of the ship, m
    headline: str
    certain: bool  # nothing missed or open, no model drawn lost
    cards: list[Card]
    unstable: int  # draws that run away in a manoeuvre
    unstable_note: str
    course_unstable: int  # draws that keep no straight course
    criteria: list[CriterionRow]
    introduction: str  # of the autopilots
    designs: list[str]  # names of those with margins
    linear: list[str]  # names of those with gains on signals
    gains: list[GainRow]
    neutral_rudders: list[float]  # of the latter, rad
    margins: list[MarginRow]
    best: str
    pilots: dict[str, dict[str, Any]]  # metrics by name, the best first
    cheaper: dict[str, float]  # share of the models on which the best costs less
    refused: dict[str, str]
    retuned: dict[str, str]
    tuned: dict[str, str]
    tracks: dict[str, dict[str, Any]]


def verification_view(found: Verification, length: float) -> VerificationView:
    """Contents of the report about a verification; `length`: of the ship, m."""
    manoeuvres = found.manoeuvres
    criteria = manoeuvres.criteria
    designed = {}
    for pilot in found.by_name:
        if pilot.design is not None:
            designed[pilot.name] = pilot.design
    linear = {name: design for name, design in designed.items() if design.feedback}
    pilots = {pilot.name: pilot_metrics(pilot) for pilot in found.pilots}
    return VerificationView(
        draws=found.draws,
        seed=found.seed,
        length=length,
        headline=headline(found),
        certain=is_certain(found),
        cards=[_criteria_card(criteria), _best_card(found, pilots)],
        unstable=int(manoeuvres.unstable.sum()),
        unstable_note=_unstable_note(found),
        course_unstable=int(found.course_unstable.sum()),
        criteria=[_criterion_row(name, one) for name, one in criteria.items()],
        introduction=_introduction(found, designed),
        designs=list(designed),
        linear=list(linear),
        gains=_gain_rows(list(linear.values())),
        neutral_rudders=[design.neutral_rudder for design in linear.values()],
        margins=_margin_rows(list(designed.values())),
        best=found.pilots[0].name,
        pilots=pilots,
        cheaper=_cheaper(found),
        refused=found.refused,
        retuned=found.retuned,
        tuned=found.tuned,
        tracks={track.key.upper(): track_metrics(track) for track in found.tracks},
    )


def is_certain(found: Verification) -> bool:
    """Return True if all criteria are met and no model drawn is lost.

    One is lost that runs away in a manoeuvre, or of which the best autopilot loses
    control.
    """
    for criterion in found.manoeuvres.criteria.values():
        if not criterion.passed:
            return False
    lost = found.pilots[0].episodes.terminated
    return not found.manoeuvres.unstable.any() and not lost.any()


def headline(found: Verification) -> str:
    """The verdict in two or three sentences."""
    sentences = _criteria_sentences(found.manoeuvres.criteria)
    unstable = int(found.manoeuvres.unstable.sum())
    if unstable:
        sentences.append(
            f"{unstable} of {found.draws} models drawn run away in a manoeuvre."
        )
    best = found.pilots[0]
    terminated = best.episodes.terminated
    lost = int(np.sum(terminated))
    control = f"loses control of {lost} of" if lost else "keeps control of all"
    sentences.append(
        f"{best.name} steers best and {control} {found.draws} models drawn."
    )
    if found.left_out:
        sentences.append(
            f"{found.left_out} of the models run away whatever steers them, in the"
            " trials themselves or straight ahead, and do not count."
        )
    return " ".join(sentences)


def _criteria_sentences(criteria: Mapping[str, Criterion]) -> list[str]:
    """The verdict on the IMO criteria, and those that are not decided."""
    missed: list[str] = []
    undecided: list[str] = []
    for name, criterion in criteria.items():
        words = criterion_name(name, criterion).lower()
        if criterion.passed is False:
            missed.append(words)
        if not criterion.decided:
            undecided.append(words)

    if missed:
        verdict = f"but misses the IMO criterion of {', '.join(missed)}"
    elif undecided:
        verdict = "and misses no IMO criterion that these trials decide"
    else:
        verdict = "and meets all IMO criteria"
    sentences = [f"The model is stable {verdict}."]
    if undecided:
        sentences.append(f"Not decided by these trials: {', '.join(undecided)}.")
    return sentences


def _unstable_note(found: Verification) -> str:
    unstable = int(found.manoeuvres.unstable.sum())
    off_course = int(found.course_unstable.sum())
    note = f"Unstable draws: {unstable} of {found.draws} run away in a manoeuvre"
    if unstable:
        note += "; draws that run away are not included in the intervals"
    return (
        f"{note}. {off_course} of {found.draws} do not stay on a straight course with"
        " the rudder fixed."
    )


def _criteria_card(criteria: Mapping[str, Criterion]) -> Card:
    passed = [criterion.passed for criterion in criteria.values()]
    verdicts = Counter(passed)
    met = verdicts[True]
    missed = verdicts[False]
    undecided = verdicts[None]
    return Card(
        label="IMO criteria",
        value=f"{met} of {len(criteria)}",
        detail=f"met; {missed} missed, {undecided} not decided by these trials",
    )


def _best_card(found: Verification, metrics: Mapping[str, dict[str, Any]]) -> Card:
    best = found.pilots[0]
    own = metrics[best.name]
    cost = number(own["cost_mean"])
    rmse_deg = number(own["heading_rmse_deg_mean"], 2)
    detail = f"heading rmse {rmse_deg}°"
    if best.design is not None:
        margin_deg = number(best.design.margins.phase_margin_deg, 2)
        detail = f"phase margin {margin_deg}°, {detail}"
    return Card(
        label="Best autopilot",
        value=best.name,
        detail=f"mean cost {cost}; {detail}",
    )


def _criterion_row(name: str, criterion: Criterion) -> CriterionRow:
    drawn = criterion.drawn
    interval = NONE
    if criterion.interval is not None:
        low, high = criterion.interval
        upper = "no upper bound" if high is None else fixed(high)
        interval = f"{fixed(low)} to {upper}"
    notes = criterion.source
    if criterion.note:
        notes += f"; {criterion.note}"
    return CriterionRow(
        name=criterion_name(name, criterion),
        notes=notes,
        passed=criterion.passed,
        measured=criterion.measured,
        measured_error=_measured_error(criterion),
        value=criterion.value,
        interval=interval,
        lost="" if drawn is None else drawn.lost_in_words,
        limit=criterion.limit,
        unit=criterion.unit,
        probability=criterion.probability,
    )


def _measured_error(criterion: Criterion) -> str:
    """Standard error of the measured index and its side; empty without one."""
    if criterion.measured_error is None:
        return ""
    return f"± {fixed(criterion.measured_error)}, {criterion.side}"


def _introduction(found: Verification, designed: Mapping[str, Controller]) -> str:
    """Sentences on how the autopilots were made, and on the first-order model."""
    names = ", ".join(designed)
    sentences = [
        f"{names} are designed on the identified model, linearised about straight"
        " running."
    ]
    learned = [pilot.name for pilot in found.by_name if pilot.design is None]
    if learned:
        names = " and ".join(learned)
        verb = "was" if len(learned) == 1 else "were"
        sentences.append(
            f"{names} {verb} trained earlier, on another model, and used unchanged."
        )
    nomoto = found.nomoto
    K = number(nomoto.K)
    T = number(nomoto.T)
    sentences.append(f"First-order form (Nomoto): K = {K} 1/s, T = {T} s.")
    return " ".join(sentences)


def _gain_rows(designs: Sequence[Controller]) -> list[GainRow]:
    """A row for each signal that a design feeds back."""
    by_signal = []
    for design in designs:
        own = {}
        for gain, (signal, _) in design.feedback.items():
            own[signal] = gain, design.gains[gain]
        by_signal.append(own)
    rows = []
    # What a controller feeds back: name, and unit of the gain on it.
    signals = {
        "heading_error": ("heading error", "rad/rad"),
        "yaw_rate": ("yaw rate", "s"),
        "heading_error_integral": ("integral of heading error", "1/s"),
        "sway": ("sway speed", "rad s/m"),
        "rudder": ("rudder", "rad/rad"),
    }
    for signal, (name, unit) in signals.items():
        gains = [own.get(signal) for own in by_signal]
        if any(gains):
            row = GainRow(name, unit, gains)
            rows.append(row)
    return rows


def _margin_rows(designs: Sequence[Controller]) -> list[MarginRow]:
    rows = []
    # Name and unit of each margin.
    margins_shown = {
        "gain_margin": ("gain margin, upwards", "factor"),
        "lowest_gain": ("gain margin, downwards", "factor"),
        "phase_margin_deg": ("phase margin", "deg"),
        "delay_margin_s": ("delay margin", "s"),
        "bandwidth_rad_s": ("bandwidth", "rad/s"),
    }
    for field, (name, unit) in margins_shown.items():
        shown = []
        for design in designs:
            value = getattr(design.margins, field)
            text = "∞" if value == np.inf else number(value)
            shown.append(text)
        row = MarginRow(name, unit, shown)
        rows.append(row)
    return rows


def _cheaper(found: Verification) -> dict[str, float]:
    """Share of the models on which the best autopilot costs less than others."""
    best, *others = found.pilots
    shares = {}
    for other in others:
        less = best.episodes.cost < other.episodes.cost
        shares[other.name] = float(np.mean(less))
    return shares


def cheaper_sentence(view: VerificationView) -> str:
    """Sentence on how often the best autopilot costs less than others; may be empty."""
    parts = []
    for other, share in view.cheaper.items():
        often = percent(share)
        parts.append(f"{view.best} costs less than {other} on {often} of the models")
    sentence = "; ".join(parts)
    return f"{sentence}." if sentence else ""
