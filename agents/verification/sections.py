"""Sections of the report on what the model promises: manoeuvres, IMO criteria, autopilots, ranking."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from agents.verification.figures import (
    BAND,
    CRITERIA,
    costs_figure,
    criteria_figure,
    manoeuvres_figure,
    steps_figure,
)
from shipgym.pages import (
    Html,
    badge,
    columns,
    figure,
    fixed,
    html,
    note,
    number,
    paragraph,
    percent,
    section,
    table,
)

if TYPE_CHECKING:
    from agents.verification.result import AutopilotResult, Pilot, Verification

SIGNALS = {
    "heading_error": ("heading error", "rad/rad"),
    "yaw_rate": ("yaw rate", "s"),
    "heading_error_integral": ("integral of heading error", "1/s"),
    "sway": ("sway speed", "rad s/m"),
    "rudder": ("rudder", "rad/rad"),
}


def manoeuvres_section(result: AutopilotResult, found: Verification) -> Html:
    """Standard manoeuvres and IMO criteria, with their spread over the models drawn."""
    length = result.model.particulars["length"]
    return section(
        "manoeuvres",
        "Manoeuvring indices and IMO criteria",
        paragraph(
            f"To see what the uncertainty of the coefficients means for the ship, {found.draws} models "
            f"were drawn from their covariance (seed {found.seed}) and put through the standard "
            "manoeuvres, each to both sides, from service speed in deep water. The probability of passing "
            "is the share of these models that keep the limit."
        ),
        draws_note(found),
        criteria_table(found),
        figure(
            criteria_figure(found.manoeuvres.criteria),
            "imo",
            "Each index of each model drawn as a share of its limit (dots; spread vertically only to be "
            "told apart), the identified model (dark line) and the limit of IMO resolution MSC.137(76) "
            "(dashed). Left of the limit passes.",
        ),
        figure(
            manoeuvres_figure(found.manoeuvres, length),
            "standard-manoeuvres",
            "Zigzag with 20° of rudder and heading, and turning circle with full rudder, of the "
            "identified model and of the models drawn. Angles in deg, time in s, positions in ship "
            f"lengths of {length:g} m.",
        ),
    )


def draws_note(found: Verification) -> Html:
    """How many draws were unstable, said even if none were."""
    unstable, course = int(found.manoeuvres.unstable.sum()), int(found.course_unstable.sum())
    text = f"Unstable draws: {unstable} of {found.draws} run away in a manoeuvre"
    text += "; what runs away counts as failed in the probabilities below. " if unstable else ". "
    text += f"{course} of {found.draws} do not hold a straight course by themselves, with the rudder held."
    return note(text, "warn" if unstable else "plain")


def criteria_table(found: Verification) -> Html:
    """One row for each criterion."""
    rows = []
    for name, spread in found.manoeuvres.criteria.items():
        low, high = (None, None) if spread.drawn is None else spread.drawn.quantiles(*BAND)
        rows.append(
            [
                Html(f"{CRITERIA[name]}<br><span class=sub>{html(spread.source)}</span>"),
                badge("passes", "good") if spread.passed else badge("fails", "bad"),
                fixed(spread.value, 2),
                Html(f"{fixed(low, 2)} to {fixed(high, 2)}"),
                Html(f"≤ {fixed(spread.limit, 1)}"),
                spread.unit,
                probability(spread.share_passed or 0.0),
            ]
        )
    return table(
        [
            "criterion",
            "identified model",
            "value",
            "5 to 95 % of draws",
            "limit",
            "unit",
            "probability of passing",
        ],
        rows,
        text_columns=2,
        caption="The worse of both sides. Stopping ability (5.3.4) is judged where the ship's equations "
        "hold for a shaft astern.",
    )


def probability(share: float) -> Html:
    """A probability of passing as a number and a bar."""
    kind = "good" if share >= 0.95 else "warn" if share >= 0.5 else "bad"
    return Html(
        f'{percent(share)}<span class="bar {kind}" aria-hidden="true">'
        f'<i style="width:{100.0 * share:.1f}%"></i></span>'
    )


def autopilots_section(result: AutopilotResult, found: Verification) -> Html:
    """Design, margins and step responses."""
    nomoto = found.nomoto
    designed = [pilot for pilot in _by_name(found) if pilot.design is not None]
    learned = [pilot for pilot in _by_name(found) if pilot.design is None]
    t = found.pilots[0].step[0]
    responses = {pilot.name: pilot.step[1:] for pilot in _by_name(found)}
    from agents.verification.result import STEP_DEG

    return section(
        "autopilots",
        "Autopilots",
        paragraph(
            f"{_names(designed)} are designed on the identified model, linearised about straight running. "
            f"{_learned(learned)}First-order form "
            f"(Nomoto): K = {number(nomoto.K, 3)} 1/s, T = {number(nomoto.T, 3)} s."
        ),
        columns(gains_table(designed), margins_table(designed)),
        figure(
            steps_figure(t, responses, STEP_DEG),
            "steps",
            f"Change of course by {STEP_DEG:g}°, starting straight ahead at service speed: heading and "
            "rudder in deg on the identified model (lines) and on 5 to 95 % of the stable models drawn "
            "(bands, where wider than the lines). Time in seconds.",
        ),
    )


def _by_name(found: Verification) -> list[Pilot]:
    """Pilots in an order that does not change with the ranking, for their colours."""
    return sorted(found.pilots, key=lambda pilot: pilot.name, reverse=True)


def _names(pilots: Sequence[Pilot]) -> str:
    return " and ".join(pilot.name for pilot in pilots)


def _learned(pilots: Sequence[Pilot]) -> str:
    """What is said of learned autopilots."""
    if not pilots:
        return ""
    verb = "was" if len(pilots) == 1 else "were"
    return f"{_names(pilots)} {verb} learned before, on another model, and flown as it is in its file. "


def gains_table(pilots: Sequence[Pilot]) -> Html:
    """Gains of designed autopilots by the signal that they act on."""
    designs = [pilot.design for pilot in pilots if pilot.design is not None]
    gains = [
        {signal: sign * design.gains[gain] for gain, (signal, sign) in design.feedback.items()}
        for design in designs
    ]
    rows = [
        [name, unit, *(number(gain.get(signal), 4) for gain in gains)]
        for signal, (name, unit) in SIGNALS.items()
        if any(signal in gain for gain in gains)
    ]
    neutral = [fixed(float(np.degrees(design.neutral_rudder)), 2) for design in designs]
    rows.append(["neutral rudder", "deg", *neutral])
    return table(
        ["gain on", "unit", *(pilot.name for pilot in pilots)],
        rows,
        text_columns=2,
        caption="Gains from deviations from straight running to the rudder order.",
    )


def margins_table(pilots: Sequence[Pilot]) -> Html:
    """Stability margins of designed autopilots."""
    margins = [pilot.design.margins for pilot in pilots if pilot.design is not None]
    rows = [
        ["gain margin, upwards", "factor", *(_or_infinite(m.gain_margin) for m in margins)],
        ["gain margin, downwards", "factor", *(number(m.lowest_gain, 3) for m in margins)],
        ["phase margin", "deg", *(_or_infinite(m.phase_margin_deg) for m in margins)],
        ["delay margin", "s", *(_or_infinite(m.delay_margin_s) for m in margins)],
        ["bandwidth", "rad/s", *(number(m.bandwidth_rad_s, 3) for m in margins)],
    ]
    return table(
        ["margin", "unit", *(pilot.name for pilot in pilots)],
        rows,
        text_columns=2,
        caption="Margins of the loop on the identified model, opened at the rudder.",
    )


def _or_infinite(value: float) -> Html:
    return Html("∞") if np.isposinf(value) else number(value, 3)


def ranking_section(found: Verification) -> Html:
    """Which autopilot steers best over the models drawn."""
    first, *others = found.pilots
    cheaper = [float(np.mean(first.flights.cost < other.flights.cost)) for other in others]
    comparison = "; ".join(
        f"{first.name} costs less than {other.name} on {percent(share)} of the models"
        for other, share in zip(others, cheaper, strict=True)
    )
    return section(
        "ranking",
        "Ranking",
        paragraph(
            "Each autopilot flew one episode of course keeping and course changes on each of the "
            f"{found.draws} models, the same episodes for all, unstable models included. The cost is that "
            "of the environment: heading error, rudder angle and rudder rate squared (van Amerongen), and "
            "losing control costs as much as the rest of the episode at the largest error. Lower is "
            "better.",
        ),
        paragraph(Html(comparison + ".") if comparison else ""),
        *(paragraph(f"No {name.upper()}: {reason}.") for name, reason in found.refused.items()),
        ranking_table(found),
        figure(
            costs_figure({pilot.name: pilot.flights.cost for pilot in _by_name(found)}),
            "costs",
            "Cost of the episode on each model drawn (dots), with quartiles. No unit: squares of angles "
            "by 30°, summed over the control intervals.",
        ),
    )


def ranking_table(found: Verification) -> Html:
    """One row for each autopilot, the best first."""
    rows: list[list[Any]] = []
    for place, pilot in enumerate(found.pilots, start=1):
        flights = pilot.flights
        lost = int(np.sum(flights.terminated))
        rows.append(
            [
                str(place),
                Html(f"<b>{html(pilot.name)}</b>"),
                badge("none", "good") if lost == 0 else badge(f"{lost} of {found.draws}", "bad"),
                number(float(np.mean(flights.cost)), 4),
                number(float(np.quantile(flights.cost, BAND[1])), 4),
                fixed(float(np.mean(flights.heading_rmse_deg)), 2),
                fixed(float(np.quantile(flights.heading_rmse_deg, BAND[1])), 2),
                fixed(float(np.mean(flights.rudder_travel_deg_min)), 1),
                percent(float(np.mean(flights.extrapolating))),
            ]
        )
    head = [
        "", "autopilot", "control lost", "cost, mean", "cost, 95 %", "heading rmse, deg", "95 %",
        "rudder travel, deg/min", "extrapolating",
    ]  # fmt: skip
    return table(
        head,
        rows,
        text_columns=3,
        caption=(
            "Means and 95 per cent quantiles over the models drawn. Extrapolating: share of the time "
            "outside the velocities and rudder angles of the fitted trials."
        ),
    )
