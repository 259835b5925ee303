"""Golden section `indices`: every manoeuvre on short runs, what is read of measured ones, and verdicts."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial
from importlib import import_module
from typing import Any

import numpy as np

from shipgym.errors import InputError, UnstableModelError
from shipgym.manoeuvres import (
    excitation,
    execution,
    imo,
    imo_rules,
    intervals,
    pull_outs,
    registry,
    settling,
    spirals,
    standard,
    turning,
    verdicts,
    zigzags,
)
from shipgym.manoeuvres.intervals import IndexInterval
from shipgym.ships.catalogue import load_model
from shipgym.ships.envelope import Envelope
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.simulate import Conditions
from shipgym.ships.steering import SteeringGear
from shipgym.trials.trial import Trial
from tests.golden.answers import Questions, refused

Answers = dict[str, Any]
stopping = import_module(
    "shipgym.manoeuvres.stopping"
)  # its name is that of a function in the package
AROUND = (0.8, 0.9, 0.97, 1.03, 1.1, 1.2)  # a limit


@cache
def model(name: str) -> ShipModel:
    """A shipped model."""
    return load_model(name)


def measured(trial: Trial, keep: slice = slice(None), **changed: Any) -> Trial:
    """A simulated trial as if measured: without orders, some channels changed or, by None, left out."""
    channels = (
        dict(trial.channels) | {"delta_command": None, "n_command": None} | changed
    )
    kept = {
        name: np.asarray(values)[keep]
        for name, values in channels.items()
        if values is not None
    }
    return Trial(
        trial.t[keep], kept, name="measured", kind=trial.kind, length=trial.length
    )


def excited() -> Answers:
    """Rudder and shaft sequences by seed, with usual and other settings."""
    ship, other = model("mariner"), model("container")
    steps = partial(
        excitation.random_levels, np.arange(0.0, 90.0, 0.7), (-0.2, 0.5), 3.0, 11.0
    )
    return {
        "binary": lambda: excitation.prbs_rudder(ship, duration=120.0, dt=1.5),
        "binary, own": lambda: excitation.prbs_rudder(
            other, 7.0, 3, 13.0, 90.0, 1.5, weather="moderate"
        ),
        "sines": lambda: excitation.multi_sine_rudder(ship, duration=300.0, dt=2.0),
        "sines, own": lambda: excitation.multi_sine_rudder(
            other, 7.0, 3, 70.0, 20.0, 210.0, 1.5
        ),
        "steps": lambda: excitation.random_rudder_steps(ship, duration=150.0, dt=1.5),
        "steps, own": lambda: excitation.random_rudder_steps(
            other, 9.0, 5, 7.0, 19.0, 100.0, 1.5
        ),
        "shaft": lambda: excitation.shaft_speed_steps(other, duration=400.0, dt=2.0),
        "shaft, own": lambda: excitation.shaft_speed_steps(
            other, 0.6, 0.9, 7, 30.0, 70.0, 4.0, 300.0, 2.0
        ),
        "tanker": lambda: excitation.shaft_speed_steps(
            model("tanker"), duration=300.0, dt=2.0, water_depth=30.0
        ),
        "drawn": [lambda: steps(4), lambda: steps(np.random.default_rng(4))],
        "amplitude": [lambda a=a: excitation.prbs_rudder(ship, a) for a in (0.0, 40.1)],
        "amplitudes": [
            lambda: excitation.multi_sine_rudder(ship, 41.0),
            lambda: excitation.random_rudder_steps(ship, -3.0),
        ],
        "clock": [
            lambda c=c: excitation.prbs_rudder(ship, clock_s=c, duration=5.0, dt=1.0)
            for c in (0.9, 0.0)
        ],
        "band": [
            lambda: excitation.multi_sine_rudder(
                ship, shortest_period_s=0.1, duration=30.0
            ),
            lambda: excitation.multi_sine_rudder(
                ship, longest_period_s=30.0, duration=30.0
            ),
            lambda: excitation.multi_sine_rudder(ship, 5.0, 0, 29.0, 25.0, 20.0),
            lambda: excitation.multi_sine_rudder(ship, 5.0, 0, 40.0, 29.0, 50.0),
        ],
        "lengths": [
            lambda a=a: excitation.random_rudder_steps(ship, 5.0, 0, *a)
            for a in ((0.0, 3.0), (5.0, 4.0))
        ],
        "ratios": [
            lambda a=a: excitation.shaft_speed_steps(other, *a)
            for a in ((0.0, 1.0), (1.6, 1.7), (0.7, 0.6), (0.5, 1.6))
        ],
        "held rudder": lambda: excitation.shaft_speed_steps(other, rudder_deg=36.0),
        "no shaft": lambda: excitation.shaft_speed_steps(ship),
        "times": [
            lambda a=a: excitation.prbs_rudder(ship, duration=a[0], dt=a[1])
            for a in ((0.0, 1.0), (9.0, 0.0), (9.0, 7.0))
        ],
        "shaft of": [excitation.shaft_of(other), excitation.shaft_of(model("kvlcc2"))],
    }


def zigzagged() -> Answers:
    """Zigzags, as simulated and as measured."""
    ship, other = model("mariner"), model("container")
    zigzag, indices = zigzags.zigzag, zigzags.zigzag_indices
    long, port = (
        zigzag(ship, 15.0, 10.0, duration=420.0, dt=1.5),
        zigzag(other, 20.0, 17.0, True, 300.0, 1.5),
    )
    step, deep = (
        zigzag(ship, 15.0, 10.0, duration=200.0, dt=1.5, switch="step"),
        zigzag(model("tanker"), 10.0, 7.0, duration=900.0, dt=2.0, water_depth=35.0),
    )
    rough, short = (
        zigzag(ship, 20.0, 10.0, duration=150.0, dt=1.5, weather="rough", seed=3),
        zigzag(ship, 15.0, 10.0, duration=60.0, dt=1.5),
    )
    never = zigzag(ship, 5.0, 60.0, duration=40.0, dt=2.0, must_reverse=False)
    approach = np.r_[np.zeros(11), long["delta"][:-11]]
    shifted = {
        name: np.r_[np.full(11, long[name][0]), long[name][:-11]]
        for name in ("psi", "u", "v", "r")
    }
    sailed = {
        "long": long,
        "port": port,
        "step": step,
        "deep": deep,
        "rough": rough,
        "short": short,
        "never": never,
        "measured": measured(long),
        "measured port": measured(port),
        "after an approach": measured(long, delta=approach, **shifted),
        "early end": measured(long, slice(0, 60)),
    }
    return {
        "trials": sailed,
        "indices": {name: lambda one=one: indices(one) for name, one in sailed.items()},
        "switched": {
            name: lambda one=one: zigzags.switch_heading_deg(one)
            for name, one in sailed.items()
        },
        "reversals": {
            name: lambda one=one: [*execution.reversals(one)]
            for name, one in sailed.items()
        },
        "executed": {
            name: lambda one=one: execution.execute_time(one)
            for name, one in sailed.items()
        },
        "other length": lambda: indices(long, 100.0),
        "other heading": lambda: indices(long, heading_deg=8.5),
        "switch of headings": [
            lambda k=k: zigzags.switch_heading_deg(measured(long, psi=k * long["psi"]))
            for k in (0.1, 0.47, 0.96, 1.0, 1.15, 1.22, 1.3, 1.45)
        ],
        "without a length": lambda: indices(Trial(long.t, long.channels)),
        "without rudder": lambda: indices(measured(long, delta=None)),
        "without speed": lambda: indices(measured(long, u=None)),
        "refused": [
            lambda k=k: zigzag(ship, **k)
            for k in (
                {"rudder_deg": 0.0},
                {"rudder_deg": 91.0},
                {"heading_deg": 0.0},
                {"heading_deg": 181.0},
                {"duration": 0.1},
                {"dt": 0.0},
                {"switch": "outside"},
                {"rudder_deg": 5.0, "heading_deg": 60.0, "duration": 40.0, "dt": 2.0},
            )
        ],
        "port refused": lambda: zigzag(ship, 5.0, 60.0, True, 40.0, 2.0),
        "shallow": lambda: zigzag(ship, water_depth=20.0),
        "departure": [
            lambda d=d, f=f: execution.departure(
                np.arange(float(len(d))), np.array(d), max(d), f
            )
            for d, f in (
                ([0.0] * 5, 0.0),
                ([0.0, 0.0, 0.4, 1.0, 1.0], 0.0),
                ([0.0, 0.0, 0.4, 1.0, 1.0], 0.7),
                ([0.0] * 7 + [0.1, 0.3, 0.6, 1.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0], 2.0),
                ([0.0, 0.1, 0.8, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0], 1.2),
            )
        ],
        "reached": [
            execution.reached(
                np.array([0.0, 1.0, 3.0]), one, np.array([5.0, 7.0, 13.0])
            )
            for one in (-1.0, 0.0, 0.5, 2.2, 3.0, 3.1)
        ],
        "turning rudder": [
            lambda a=a: execution.turning_rudder(a, 35.0, "the limit")
            for a in (0.0, -20.0, 36.0)
        ],
    }


def turned() -> Answers:
    """Turning circles and pull-outs, as simulated and as measured."""
    ship, other = model("mariner"), model("container")
    circle, indices = turning.turning_circle, turning.turning_indices
    port, half = circle(ship, -25.0, 700.0, 2.0), circle(ship, 30.0, 100.0, 2.0)
    sailed = {
        "port": port,
        "starboard": circle(other, 30.0, 600.0, 2.0),
        "half": half,
        "three quarters": circle(ship, 30.0, 240.0, 2.0),
        "shallow": circle(model("tanker"), 20.0, 1500.0, 2.0, 30.0),
        "rough": circle(ship, -35.0, 100.0, 2.0, weather="rough", seed=2),
        "measured": measured(port),
        "late": measured(port, slice(3, None)),
        "turned": measured(port, psi=port["psi"] + 2.0),
    }
    out = {
        "starboard": pull_outs.pull_out(ship, 15.0, dt=2.0),
        "port": pull_outs.pull_out(other, -10.0, 2.0),
        "tanker": pull_outs.pull_out(model("tanker"), 12.0, 2.0, 30.0),
    }
    pulled = pull_outs.pull_out_indices
    rates = np.r_[np.zeros(5), np.linspace(0.0, 0.02, 30), np.linspace(0.02, 0.003, 40)]
    made = {"r": rates, "delta": np.r_[np.zeros(5), np.full(30, 0.2), np.zeros(40)]}
    t = np.arange(75.0)

    def held(turn: int, rest: int) -> Any:
        return pulled(
            Trial(
                np.arange(float(turn + rest)),
                {
                    "r": 0.01 * np.ones(turn + rest),
                    "delta": np.r_[np.full(turn, -0.3), np.zeros(rest)],
                },
            )
        )

    return {
        "trials": sailed,
        "indices": {name: lambda one=one: indices(one) for name, one in sailed.items()},
        "length": lambda: indices(port, 150.0),
        "track": lambda: [*turning.track_from_order(port, 150.0)],
        "refused": [
            lambda k=k: circle(ship, **k)
            for k in (
                {"rudder_deg": 0.0},
                {"rudder_deg": 91.0},
                {"rudder_deg": -91.0},
                {"dt": -1.0},
            )
        ],
        "without x": lambda: indices(measured(port, x=None)),
        "without length": lambda: indices(Trial(port.t, port.channels)),
        "full": [
            turning.full_rudder_deg(one)
            for one in (ship, replace(ship, steering=SteeringGear(20.0)), other)
        ],
        "circles": lambda: list(
            turning.standard_circles(replace(ship, steering=SteeringGear(21.0)))
        ),
        "pull-outs": out,
        "pulled": {name: lambda one=one: pulled(one) for name, one in out.items()},
        "made": lambda: pulled(Trial(t, made)),
        "ordered": lambda: pulled(
            Trial(t, made | {"delta_command": np.r_[np.full(30, -0.1), np.zeros(45)]})
        ),
        "samples": [
            lambda a=a: held(*a) for a in ((9, 30), (10, 30), (30, 9), (30, 10))
        ],
        "no rate": lambda: pulled(Trial(t, {"delta": made["delta"]})),
        "limit": [lambda a=a: pull_outs.pull_out(ship, a) for a in (41.0, 0.0)],
        "step": lambda: pull_outs.pull_out(ship, 10.0, 50.0),
        "standard": lambda: list(pull_outs.standard_pull_outs(ship)),
        "few": [
            execution.number_of_steps(7.4, 2.0),
            execution.number_of_steps(5.0, 2.0),
        ],
    }


def spiralled() -> Answers:
    """Direct and reverse spirals of few points, and loops that are read of points."""
    ship, unstable = model("mariner"), model("tanker")
    direct, reverse = (
        spirals.direct_spiral(ship, (15.0, 3.0, -3.0, -15.0), 2.0),
        spirals.reverse_spiral(unstable, (0.15, 0.05, -0.05, -0.15), 2.0),
    )
    loop = spirals.direct_spiral(unstable, (-10.0, -1.0, 1.0, 10.0), 2.0, 35.0)
    read, found = spirals.spiral_indices, spirals.spiral_from_trial

    def points(angles: list[float], rates: list[float], method: str = "direct") -> Any:
        return read(
            spirals.Spiral(direct.trial, np.array(angles), np.array(rates), method)
        )  # type: ignore[arg-type]

    there_and_back = [
        20.0,
        10.0,
        2.0,
        0.0,
        -3.0,
        -12.0,
        -20.0,
        -12.0,
        -3.0,
        0.0,
        2.0,
        10.0,
        20.0,
    ]
    rates = [1.0, 0.7, 0.5, 0.4, 0.2, -0.6, -0.9, -0.7, -0.4, -0.3, 0.1, 0.8, 1.1]
    drifting = direct.trial["delta"] + 0.002 * np.sin(np.arange(len(direct.trial)))
    return {
        "direct": direct,
        "reverse": reverse,
        "loop": loop,
        "indices": [lambda one=one: read(one) for one in (direct, reverse)],
        "usual rates": lambda: spirals.one_way(
            [180.0 / np.pi * a / ship.travel_time for a in spirals.REVERSE_RATES],
            "a",
            "b",
            9.0,
            "c",
        ),
        "points": lambda: points(there_and_back, rates),
        "mirrored": lambda: points([-a for a in there_and_back], [-a for a in rates]),
        "narrow": lambda: points(
            there_and_back,
            [1.0, 0.7, 0.3, 0.1, -0.2, -0.6, -0.9, -0.7, -0.1, 0.1, 0.2, 0.8, 1.1],
        ),
        "reversed": lambda: points(
            [3.0, 1.0, -0.7, 0.2, 1.1, -0.5, -3.0],
            [0.5, 0.3, 0.2, 0.05, -0.1, -0.3, -0.5],
            "reverse",
        ),
        "no fold": lambda: points(
            [3.0, 1.0, 0.3, -2.0], [0.5, 0.2, -0.1, -0.4], "reverse"
        ),
        "one side": lambda: points(there_and_back, [abs(a) for a in rates]),
        "one way": lambda: points([10.0, 0.0, -10.0], [1.0, 0.2, -1.0]),
        "no change": lambda: points(
            [20.0, 0.0, -20.0, 0.0, 20.0], [1.0, 0.5, 0.1, -0.2, -1.0]
        ),
        "method": lambda: points([1.0], [1.0], "sideways"),
        "from trial": lambda: found(direct.trial),
        "measured": lambda: found(measured(direct.trial, delta=drifting)),
        "wide": lambda: found(measured(direct.trial), tolerance_deg=4.0),
        "some angles": lambda: found(direct.trial, (15.0, 3.2, -3.0, -15.0, 8.0)),
        "few": lambda: found(direct.trial, (15.0,)),
        "tolerance": lambda: found(direct.trial, None, 0.0),
        "no rate": lambda: found(measured(direct.trial, r=None)),
        "turning point": [
            spirals.turning_point(np.array(a))
            for a in (there_and_back, [-3.0, 1.0, 4.0, 0.0, -3.0])
        ],
        "refused": [
            lambda a=a: spirals.direct_spiral(ship, a)
            for a in (
                (10.0, -10.0),
                (10.0, 0.0, 5.0),
                (10.0, 5.0, 1.0),
                (45.0, 0.0, -10.0),
                (10.0, 10.0, -5.0),
            )
        ],
        "fast": lambda: spirals.reverse_spiral(ship, (9.0, 0.0, -9.0)),
        "step": lambda: spirals.reverse_spiral(ship, (0.1, 0.0, -0.1), 90.0),
        "standard": [
            lambda one=one: list(spirals.standard_spirals(one))
            for one in (ship, unstable)
        ],
        "effect": [
            settling.rudder_effect(one, np.inf)
            for one in (ship, model("container"), unstable)
        ],
        "angles": (
            spirals.standard_spirals(replace(ship, steering=SteeringGear(12.0)))[
                "direct spiral"
            ].sail.keywords["rudder_deg"]
        ),
    }


def stopped() -> Answers:
    """Stops and accelerations."""
    ship, tanker = model("container"), model("tanker")
    stop, read, faster = (
        stopping.stopping,
        stopping.stopping_indices,
        stopping.acceleration,
    )
    sailed = {
        "inertia": stop(ship, speed_ratio=0.4, dt=2.0),
        "slower": stop(ship, 0.6, 0.7, 2.0),
        "crash": stopping.crash_stop(tanker),
        "shallow": stop(tanker, -0.5, 0.2, 2.0, 30.0),
        "kvlcc2": stop(model("kvlcc2"), 0.3, 0.6, 5.0),
    }
    speeds = {
        "usual": faster(ship, dt=2.0),
        "slow start": faster(ship, 0.6, 200.0, 2.0),
        "tanker": faster(tanker, 0.5, 600.0, 2.0, 30.0),
    }
    gained = stopping.acceleration_indices
    crash = sailed["crash"]
    return {
        "stops": sailed,
        "stopped": {name: lambda one=one: read(one) for name, one in sailed.items()},
        "at": [lambda k=k: read(crash, k, 300.0) for k in (0.5, 0.1, 0.0)],
        "at 1": lambda: read(crash, 1.0),
        "not so slow": lambda: read(sailed["slower"], 0.5),
        "without x": lambda: read(measured(crash, x=None)),
        "accelerations": speeds,
        "gained": {name: lambda one=one: gained(one) for name, one in speeds.items()},
        "half": lambda: gained(speeds["usual"], 0.5, 100.0),
        "part": lambda: gained(speeds["usual"], 1.0),
        "slows": lambda: gained(crash),
        "without u": lambda: gained(measured(crash, u=None)),
        "refused": [
            lambda a=a: stop(ship, *a)
            for a in ((1.4,), (-0.1,), (0.0, 1.0), (0.0, 0.0), (-2.1,))
        ],
        "astern": lambda: stop(tanker, -2.1),
        "no shaft": lambda: stop(model("mariner")),
        "never": lambda: stop(ship, 1.1, 0.3, 2.0),
        "crash refused": lambda: stopping.crash_stop(ship),
        "starts": [lambda a=a: faster(ship, *a) for a in ((0.0,), (1.0,), (0.5, 1.0))],
        "no propeller": lambda: faster(model("mariner")),
        "goes astern": [
            stopping.goes_astern(model(name))
            for name in ("tanker", "container", "mariner")
        ],
        "standard": [
            lambda name=name: list(stopping.standard_stops(model(name)))
            for name in ("tanker", "container", "mariner")
        ],
    }


def interval(value: float | None, *values: float, lost: int = 0) -> IndexInterval:
    """An index and its draws, the last ones lost."""
    drawn = np.r_[np.array(values, dtype=float), np.full(lost, np.nan)]
    away = np.arange(drawn.size) >= drawn.size - lost // 2
    return IndexInterval(value, drawn, away)


def judged() -> Answers:
    """Criteria from made-up indices, intervals, measured trials and limits."""
    ship = replace(model("mariner-tls-svm"), envelope=None)
    tanker = model("tanker")
    names = list(imo_rules.imo_manoeuvres(ship))
    lengths = np.linspace(2.4, 2.6, 40)
    zigzag = {
        "overshoot_1_deg": interval(9.0, *np.linspace(8.0, 9.5, 40)),
        "overshoot_2_deg": interval(30.0, *np.linspace(20.0, 40.0, 40)),
        "initial_turning_lengths": interval(1.7, *lengths[3:], lost=3),
        "period_s": interval(200.0, *lengths),
    }
    circle = {
        "advance_lengths": interval(3.2, *lengths),
        "tactical_diameter_lengths": interval(5.5, *(lengths + 3.0)),
        "transfer_lengths": interval(2.0, *lengths),
    }
    found = {
        name: dict(zigzag if name.startswith("zigzag") else circle) for name in names
    }
    found[names[0]]["advance_lengths"] = interval(None, *lengths)
    found["zigzag 20/20, port first"]["overshoot_1_deg"] = interval(
        26.0, *np.linspace(25.5, 27.0, 40)
    )
    plain_criteria = imo.imo_criteria(ship, found)
    stop = {"track_reach_lengths": interval(14.0, 13.0, 14.5, 16.0)}
    boxed = replace(
        ship,
        envelope=Envelope(
            *(np.array(a) for a in ([7.0] * 4, [8.0] * 4, [7.5, 0.0, 0.0, 0.0])),
            np.diag([1.0, 2.0, 90.0, 3.0]),
        ),
    )
    circling = turning.turning_circle(model("mariner"), 35.0, 400.0, 2.0)
    zigzagging = zigzags.zigzag(model("mariner"), 10.0, 10.0, duration=420.0, dt=1.5)
    wide = zigzags.zigzag(model("mariner"), 20.0, 20.0, duration=420.0, dt=1.5)
    runs = [circling, zigzagging, wide]

    def by(trial: Trial, **changed: Any) -> Any:
        return verdicts.measured_indices(
            ship, Trial(trial.t, trial.channels | changed, kind=trial.kind)
        )

    def sure(share: float) -> Any:
        draws = interval(2.0, *np.where(np.arange(200) < share * 200, 2.0, 3.0))
        rule = imo_rules.Rule("turn", "a_lengths", "5.3", 2.5)
        criterion = verdicts.criterion_of(rule, [{"a_lengths": draws}])
        return verdicts.decided_by_model(criterion, "turn", False)

    def outside(scale: float) -> bool:
        narrow = replace(boxed.envelope, shape=np.diag([1e-3, 1e-3, 1e-3, scale]))
        return verdicts.outside_envelope(
            replace(ship, envelope=narrow),
            imo_rules.imo_manoeuvres(ship)["zigzag 10/10, starboard first"],
        )

    return {
        "criteria": {
            name: [
                lambda one=one: one.to_dict(),
                one.interval,
                one.share_passed,
                one.probability,
            ]
            for name, one in plain_criteria.items()
        },
        "tanker": (
            lambda: imo.imo_criteria(
                tanker,
                {
                    **{
                        name: found.get(name, stop)
                        for name in imo_rules.imo_manoeuvres(tanker)
                    }
                },
            )["stopping"].to_dict()
        ),
        "container": lambda: imo.stopping_criterion(model("container"), None).to_dict(),
        "measured": {
            name: lambda one=one: one.to_dict()
            for name, one in verdicts.with_measured(plain_criteria, ship, runs).items()
        },
        "probabilities": [
            one.probability
            for one in verdicts.with_measured(plain_criteria, ship, runs).values()
        ],
        "trials": [lambda one=one: by(one) for one in runs],
        "fast": [
            by(circling, u=k * circling["u"]) == {} for k in (0.88, 0.92, 1.08, 1.12)
        ],
        "angles": [
            len(by(wide, delta_command=wide["delta_command"] * k))
            for k in (0.93, 0.96, 1.04, 1.06)
        ],
        "other kind": lambda: verdicts.measured_indices(
            ship, circling.with_(kind="spiral")
        ),
        "no position": lambda: verdicts.measured_indices(
            ship, measured(circling, x=None)
        ),
        "no speed": lambda: verdicts.measured_indices(ship, measured(circling, u=None)),
        "limits": [
            imo_rules.overshoot_limits_deg(one)
            for one in (5.0, 9.0, 10.5, 20.0, 28.0, 29.0, 30.5, 40.0)
        ],
        "words": [
            imo_rules.trial_in_words(ship, one)
            for one in ("turning circle", "zigzag 10/10")
        ],
        "limited": imo_rules.trial_in_words(
            replace(ship, steering=SteeringGear(25.0)), "turning circle"
        ),
        "sure": [lambda k=k: sure(k) for k in (0.0, 0.02, 0.03, 0.5, 0.97, 0.98, 1.0)],
        "beyond": lambda: verdicts.decided_by_model(
            plain_criteria["advance"], "35 deg turn", True
        ),
        "outside": [outside(k) for k in (1.0, 5.6, 6.3, 6.9, 20.0)],
        "unboxed": [
            verdicts.outside_envelope(
                one, imo_rules.imo_manoeuvres(tanker)["crash stop"]
            )
            for one in (ship, boxed)
        ],
        "assessed": lambda: {
            name: one.to_dict()
            for name, one in imo.assess_draws(
                ship,
                [
                    ship.with_coefficients(
                        k * np.array(list(ship.coefficients.values()))
                    )
                    for k in (1.0, 1.01)
                ],
            ).items()
        },
        "draws": lambda: imo.imo_assessment(model("mariner"), 3),
        "negative": lambda: imo.imo_assessment(ship, -1),
    }


def spread() -> Answers:
    """Intervals over draws, families of manoeuvres, and what is physical."""
    ship = model("mariner-tls-svm")
    values = {
        "a": interval(3.0, *np.linspace(1.0, 5.0, 41)),
        "lost": interval(3.0, 1.0, 2.0, 4.0, 7.0, lost=5),
        "none": interval(None, lost=3),
        "alone": interval(2.5),
        "small": interval(1.23456e-3, 1e-3, 2e-3),
    }
    circle = partial(turning.turning_circle, rudder_deg=30.0, duration=300.0, dt=2.0)

    def evaluate(one: ShipModel) -> Any:
        if one.coefficients["X_u"] > 0.0:
            raise UnstableModelError("runs away", 1.0, {})
        if one.coefficients["Y_v"] > 0.0:
            raise InputError("nothing")
        return turning.turning_indices(circle(one))

    def changed(**factors: float) -> ShipModel:
        return replace(
            ship,
            covariance=None,
            coefficients={
                k: v * factors.get(k, 1.0) for k, v in ship.coefficients.items()
            },
        )

    draws = [ship, changed(X_u=-1.0), changed(Y_v=-1.0), changed(N_d=1.1)]
    done: list[int] = []
    own = {"circle": intervals.attempt(evaluate, ship)[0]}
    length, speed = ship.particulars["length"], ship.particulars["speed"]
    t = np.arange(4.0)

    def physical(name: str, size: float) -> None:
        registry.check_physical(
            ship,
            Trial(
                t,
                {"u": 0.0 * t, "v": 0.0 * t, "r": 0.0 * t}
                | {name: np.array([0.0, 0.3, 1.0, -0.5]) * size},
            ),
        )

    certain = replace(
        ship,
        covariance=1e-24 * np.diag(np.array(list(ship.coefficients.values())) ** 2),
    )
    return {
        "intervals": {
            name: [
                lambda one=one: one.to_dict(),
                one.interval,
                one.quantiles(0.1, 0.5),
                str(one),
                one.lost_in_words,
                one.n_ran_away,
                one.n_never_reached,
            ]
            for name, one in values.items()
        },
        "worst": (
            lambda: intervals.worst(
                [values["a"], interval(7.0, *np.linspace(0.0, 6.0, 41))]
            ).to_dict()
        ),
        "worst of none": (
            lambda: intervals.worst(
                [values["lost"], interval(None, 9.0, 0.0, 1.0, 2.0, lost=5)]
            ).to_dict()
        ),
        "of": lambda: intervals.intervals_of(
            own, draws, {"circle": evaluate}, done.append
        )["circle"],
        "done": lambda: done,
        "attempts": [lambda one=one: intervals.attempt(evaluate, one) for one in draws],
        "index": lambda: {
            name: one.value
            for name, one in intervals.index_intervals(certain, evaluate, 2).items()
        },
        "draws": lambda: intervals.index_intervals(ship, evaluate, 1),
        "name": lambda: intervals.index_intervals(ship, "zigzag"),
        "no covariance": lambda: intervals.index_intervals(
            model("mariner"), evaluate, 2
        ),
        "families": {
            name: {
                family: list(ones)
                for family, ones in registry.families_of(model(name)).items()
            }
            for name in ("mariner", "container", "tanker", "kvlcc2")
        },
        "titles": {name: one.title for name, one in standard.FAMILIES.items()},
        "captions": {
            name: one.caption
            for name, one in registry.standard_manoeuvres(model("tanker")).items()
        },
        "none": {
            name: one.no_indices
            for name, one in registry.standard_manoeuvres(model("tanker"), 40.0).items()
        },
        "settings": {
            name: getattr(one.sail, "keywords", {})
            for name, one in registry.standard_manoeuvres(model("tanker"), 40.0).items()
        },
        "shallow": lambda: registry.standard_manoeuvres(ship, 20.0),
        "too shallow": lambda: registry.standard_manoeuvres(model("tanker"), 18.0),
        "time": registry.standard_time(ship),
        "physical": {
            name: refused(partial(physical, name), [k * most for k in AROUND])
            for name, most in (
                ("u", 1.5 * speed),
                ("v", speed),
                ("r", 3.0 * speed / length),
            )
        },
        "words": lambda: physical("r", 1.0),
        "twice": lambda: registry.register_manoeuvre(
            "zigzags", zigzags.standard_zigzags
        ),
        "unnamed": lambda: registry.register_manoeuvre(" ", zigzags.standard_zigzags),
    }


def settled() -> Answers:
    """Legs that last until the motion is steady, and a helmsman who holds a yaw rate."""
    ship = model("mariner")
    voyage = settling.Voyage(ship, 2.0, Conditions())
    first = [*voyage.settle(voyage.hold(0.1, 0.0))]
    at_rate = voyage.rate_helmsman()
    second = [*voyage.settle(at_rate(-0.004))]
    after = voyage.trial("random")
    usual = settling.Voyage(
        model("container"), None, Conditions(), model("container").service_state * 0.7
    )
    states, commands = usual.go(usual.hold(-0.2, 1.1), 30)
    rough = settling.Voyage(ship, 2.0, Conditions(weather="rough", seed=3))
    rough.go(rough.hold(0.1, 0.0), 20)
    away = replace(
        ship,
        coefficients={
            k: v * (-1.0 if k in ("N_d", "Y_d") else 1.0)
            for k, v in ship.coefficients.items()
        },
    )
    return {
        "means": [first, second],
        "trial": after,
        "part": voyage.trial(last=40),
        "lengths": [len(after), usual.dt, voyage.dt, voyage.length_time],
        "state": voyage.state,
        "states": states,
        "commands": commands,
        "rough": rough.trial(),
        "step": [
            lambda dt=dt: settling.Voyage(ship, dt, Conditions()).dt
            for dt in (0.0, 20.0, 21.0)
        ],
        "wrong rudder": lambda: settling.rudder_effect(away, np.inf),
        "shallow": settling.rudder_effect(model("tanker"), 30.0),
    }


QUESTIONS = Questions(
    {
        "excited": excited,
        "zigzagged": zigzagged,
        "turned": turned,
        "spiralled": spiralled,
        "stopped": stopped,
        "judged": judged,
        "spread": spread,
        "settled": settled,
    }
)
