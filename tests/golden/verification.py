"""Golden section `verification`: draws, tracks, standards, refusals and what a report says of them.

The models drawn are made by hand: another processor could draw others in the last
digit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, replace
from functools import cache
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np
from agents.jobs import HERE

from agents import LQ, PID, WheelOver
from agents.verification import chain, steered
from agents.verification import standards as asked
from agents.verification.figures import (
    costs_figure,
    criteria_figure,
    manoeuvres_figure,
    steps_figure,
    tracks_figure,
)
from agents.verification.index_uncertainty import (
    SailedDraws,
    nominal_runs,
    uncertainty_of,
)
from agents.verification.monte_carlo import do_draws, draw_jobs, keeps_course
from agents.verification.refusal import (
    lost_control,
    refused_designs,
    rudder_effect,
    simpler_structures,
    why_refused,
)
from agents.verification.result import Verification, verification_metrics
from agents.verification.tracks import Track, keep_track, track_task
from agents.verification.verify import design_autopilots, verify
from agents.verification.view import headline, verification_view
from shipgym import InputError, ShipFile, ShipModel, load_model
from tests.golden.chains import SHIP_FILE
from tests.golden.store import Floats, numbers_in, vector

#: Commands are in single precision.
TOLERANCES = {"": 1e-5}
STEP_DEG = 20.0
#: Progress of the verification.
TOLD: list[tuple[str, int, int]] = []


@cache
def model() -> ShipModel:
    """A ship that was identified."""
    return load_model("mariner-tls-svm")


def made_up(size: float = 0.03, count: int = 2) -> list[ShipModel]:
    """Ships that differ from her, in place of those that would be drawn."""
    return [
        replace(
            model(),
            name=f"draw {k}",
            coefficients={
                name: value * (1.0 + size * np.sin(7.0 * k + i))
                for i, (name, value) in enumerate(model().coefficients.items())
            },
        )
        for k in range(1, count + 1)
    ]


@cache
def verified() -> Verification:
    """What is found of her, with two ships in place of the draws."""
    guests = [PID.from_model(model(), damping=1.3)]
    with patch.object(ShipModel, "sample", lambda self, n, seed: made_up(count=n)):
        return verify(
            model(),
            2,
            3,
            lambda *one: TOLD.append(one),
            HERE,
            guests,
            ("pid", "lq", "wheel-over"),
        )


def viewed() -> Any:
    """What the template shows of it."""
    return verification_view(verified(), float(model().particulars["length"]))


@cache
def track() -> Track:
    """The track under wheel-over that turns a little late."""
    guide = WheelOver.from_model(model(), task=track_task(model()), reach_lengths=1.2)
    return keep_track(guide, [model(), *made_up(0.05)])


def cases() -> list[str]:
    """Parts of a verification."""
    return [
        "draws",
        "track",
        "heading control",
        "seas",
        "track control",
        "metrics",
        "figures",
        "refusals",
    ]


def record(case: str) -> dict[str, Floats]:
    """The values of a case."""
    found: dict[str, Floats] = globals()[f"of_{case.replace(' ', '_')}"]()
    return found


def of_draws() -> dict[str, Floats]:
    """Manoeuvres, stability and episodes of ships that differ much, one of which runs away."""
    wild = made_up(0.05, 3)
    wild[1] = replace(
        wild[1],
        coefficients={name: -value for name, value in wild[1].coefficients.items()},
    )
    (job,) = draw_jobs([PID.from_model(model())], model(), wild, 11)
    part = do_draws(job)
    sailed = SailedDraws(**part["sailed"])
    told = uncertainty_of(model(), nominal_runs(model()), sailed)
    found = {
        f"episodes {name}": vector(values)
        for name, values in part["episodes"][0].items()
    }
    found |= numbers_in(
        {name: one.to_dict() for name, one in told.criteria.items()}, "criteria"
    )
    found |= {
        "lost": vector(part["sailed"]["lost"]),
        "course unstable": vector(part["course_unstable"]),
        "unstable": vector(told.unstable),
        "headings": vector(told.zigzag_headings[:, ::17]),
        "paths": vector([path[::29] for path in told.circle_paths]),
        "circle": vector(told.circle["x"][::29]),
        "zigzag": vector(told.zigzag["psi"][::17]),
        "keeps": vector([keeps_course(load_model(n)) for n in ("mariner", "tanker")]),
    }
    return found


def of_track() -> dict[str, Floats]:
    """How ships keep to the track in the current."""
    one = track()
    return {
        "waypoints": vector(one.waypoints),
        "positions": vector(one.positions[::25]),
        "largest": one.largest,
        "cross track": one.cross_track[::25],
        "rms": one.rms,
        "arrived": vector(one.arrived),
        "current": vector(
            [
                track_task(model()).weather.current.speed,
                track_task(model()).weather.current.towards_deg,
            ]
        ),
    }


def of_heading_control() -> dict[str, Floats]:
    """Values of heading control and of turns at a set rate, under PID that overshoots."""
    pilot = PID.from_model(model(), damping=0.5)
    with patch.object(steered, "LENGTHS", 17.0):
        return numbers_in(
            asked.heading_control(model(), pilot) | asked.rate_of_turn(model())
        )


def of_seas() -> dict[str, Floats]:
    """Values of heading control in a seaway."""
    with patch.object(steered, "LENGTHS", 11.0):
        return numbers_in(
            asked.heading_control_in_waves(model(), LQ.from_model(model()))
        )


def of_track_control() -> dict[str, Floats]:
    """Values of track control."""
    return numbers_in(asked.track_control(model(), track()))


def of_metrics() -> dict[str, Floats]:
    """The metrics of a verification, and what its page is given."""
    view = viewed()
    passed = [row.passed for row in view.criteria]
    shown = {
        "unstable": view.unstable,
        "course_unstable": view.course_unstable,
        "met": passed.count(True),
        "missed": passed.count(False),
        "pilots": view.pilots,
        "cheaper": view.cheaper,
    }
    with patch.object(steered, "LENGTHS", 6.0):
        rows = asked.standards(model(), LQ.from_model(model()), [])
    limits = {
        row.name: [
            row.limit,
            float(row.least),
            -1.0 if row.passed is None else float(row.passed),
        ]
        for row in rows
    }
    return (
        numbers_in(verification_metrics(verified()))
        | numbers_in(shown, "view")
        | numbers_in(limits, "limits")
    )


def of_figures() -> dict[str, Floats]:
    """What the figures draw, thinned."""
    one, length = verified(), model().particulars["length"]
    steps = {
        pilot.name: (pilot.step.heading, pilot.step.rudder) for pilot in one.pilots
    }
    drawn = {
        "criteria": criteria_figure(one.manoeuvres.criteria),
        "manoeuvres": manoeuvres_figure(one.manoeuvres, length),
        "steps": steps_figure(one.pilots[0].step[0], steps, STEP_DEG),
        "tracks": tracks_figure({"A": one.tracks[0], "B": track()}, length),
        "costs": costs_figure(
            {pilot.name: pilot.episodes.cost for pilot in one.pilots}
        ),
    }
    found = {}
    for name, figure in drawn.items():
        for k, trace in enumerate(figure.data):
            for axis in "xy":
                values = np.asarray([] if trace[axis] is None else trace[axis], float)
                found[f"{name} {k} {axis}"] = vector(
                    [len(values), *values[:: max(1, len(values) // 9)]]
                )
            found[f"{name} {k} width"] = vector(
                [np.nan if (w := getattr(trace.line, "width", None)) is None else w]
            )
        sizes = [figure.layout.height, figure.layout.margin.l]
        found[f"{name} layout"] = vector(
            [np.nan if one is None else one for one in sizes]
        )
        found |= numbers_in(
            figure.layout.to_plotly_json(), f"{name} layout", left_out=("template",)
        )
    return found


def fits() -> dict[str, Any]:
    """Her trials with models that contradict them, or do not."""
    trials = ShipFile.load(SHIP_FILE).trials()
    found = {"as in the trials": model()}
    for name, factors in {
        "other side": {"N_d": -1.0, "Y_d": -1.0},
        "sway": {"Y_v": -1.0, "N_d": -1.0},
    }.items():
        changed = {
            one: value * factors.get(one, 1.0)
            for one, value in model().coefficients.items()
        }
        found[name] = replace(
            model(),
            coefficients=changed,
            covariance=1e-4 * np.asarray(model().covariance),
        )
    return {
        name: SimpleNamespace(model=one, trials=trials) for name, one in found.items()
    }


def of_refusals() -> dict[str, Floats]:
    """What the trials say of the rudder."""
    fit = fits()["as in the trials"]
    fitted: Sequence[Any] = [trial for trial in fit.trials if trial.use == "fit"]
    return {
        "all": vector(rudder_effect(fitted, model())),
        "each": vector([rudder_effect([one], model()) for one in fitted]),
        "nomoto": vector(astuple(verified().nomoto)),
    }


def said() -> str:
    """Verdicts and refusals in words."""
    view = viewed()
    ranking = [
        {
            "structure": name,
            "coefficients": count,
            "stable": name != "c",
            "ran_away": name == "d",
        }
        for name, count in (
            ("a", 9),
            ("b", 7),
            ("c", 3),
            ("d", 2),
            ("b", 7),
            ("e", 4),
            ("f", 1),
        )
    ]
    lines = [
        headline(verified()),
        *(f"{name}: {why_refused(fit)}" for name, fit in fits().items()),
    ]
    lines += [str(lost_control(np.arange(41) < lost)) for lost in (2, 3)]
    gains = [(row.signal, row.unit, row.gains) for row in view.gains]
    lines += [str(simpler_structures(ranking, "a")), str(gains)]
    lines.append(f"criteria: {', '.join(row.name for row in view.criteria)}")
    for name in ("designs", "linear"):
        lines.append(f"{name}: {', '.join(getattr(view, name))}")
    lines.append(view.introduction)
    for name in ("best", "certain", "draws", "seed"):
        lines.append(f"{name}: {getattr(view, name)}")
    return "\n".join([*lines, *_decided()])


def _decided() -> list[str]:
    """Progress, and what becomes of designs that lose control or cannot be made, and of guests."""
    found, fit = verified(), fits()["as in the trials"]
    ranking = [
        {"structure": name, "coefficients": count, "stable": True, "ran_away": 0}
        for name, count in (("abkowitz", 40), ("nomoto", 4))
    ]
    fit.metrics = {"selection": {"ranking": ranking}}
    fit.model = replace(fit.model, provenance={"structure": "abkowitz"})
    lines = [str(one) for one in TOLD]
    for lost in (("pid", "pid-2"), ("pid", "lq", "pid-2")):
        worse = [
            replace(
                one,
                episodes=replace(one.episodes, terminated=np.full(2, one.key in lost)),
            )
            for one in found.pilots
        ]
        refusals = refused_designs(replace(found, pilots=tuple(worse)), fit)
        refused = {**found.refused, **refusals.by_design}
        lines += [f"lost {lost}: {refusals.of_all}", str(refused)]
    designed = design_autopilots(
        model(), ["lq", "lq", "turn-rate", "los", "wheel-over"]
    )
    guides = designed.guides
    kinds = [one.kind for one in designed.controllers]
    lines += [f"{kinds} {[one.kind for one in guides]} {designed.refused}"]
    for call in (
        lambda: design_autopilots(model(), ["los"]),
        lambda: chain.check_guest(guides[0], model(), "agent 'los'"),
        lambda: chain.check_guest(
            PID.from_model(load_model("kvlcc2")), model(), "agent 'pid'"
        ),
    ):
        try:
            lines.append(str(call()))
        except InputError as error:
            lines.append(str(error))
    result = chain.examined(SimpleNamespace(), _identified(fit), [], verified)
    return [
        *lines,
        (
            f"{result.stable} {result.instability} {result.refusal}"
            f" {sorted(result.metrics)}"
        ),
    ]


def _identified(fit: Any) -> Any:
    """A fit with what the chain asks of it."""
    return SimpleNamespace(**vars(fit), diagnostics={}, predictions={}, stable=True)
