"""Golden section `regression`: from trials to regressions, the sea taken out,
records filtered and repaired."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

import shipgym
from identification import build_samples, identify_forces
from identification.regression.current import estimate_current
from identification.regression.forces import force_regression, force_variances
from identification.regression.gaps import between_gaps
from identification.regression.gear_response import estimate_gear
from identification.regression.grey_box import (
    bare_metrics,
    chosen_box,
    explained_samples,
)
from identification.regression.integrals import broken_spline
from identification.regression.preprocess import (
    FILTERS,
    PREPROCESSING,
    is_noisy,
    noise_level,
    noise_ratio,
    outliers,
    repaired,
    savitzky_golay,
    smoothed_channels,
)
from identification.regression.preprocess.kalman import LinearSystem
from identification.regression.problem import held_out
from identification.regression.rudder import estimated_gear, rebuild
from identification.regression.samples import default_window
from identification.regression.still_water import in_still_water
from identification.regression.velocities import through_water
from identification.regression.wind import (
    constant_wind,
    measured_wind,
    with_constant_wind,
)
from shipgym import Particulars, ShipModel, SteeringGear, Trial
from shipgym.manoeuvres import turning_circle, zigzag
from shipgym.manoeuvres.towing_tank import (
    Tank,
    pure_surge,
    pure_sway,
    pure_yaw,
    static_drift,
    yaw_with_drift,
)
from shipgym.ships import get_structure, grey_box
from shipgym.trials.navigation import rotate_to_body
from tests.golden.made_up import Parts, mariner, noisy, refused, sampled, trials

TOLERANCES = {"": 1e-6, "still water: ": 1e-5}
SHIP = Particulars(
    length=28.9, beam=9.6, draught=2.7, mass=417e3, speed=5.0, xg=-0.5, yaw_gyradius=7.2
)
BULKER = Particulars(
    length=160.9,
    beam=23.2,
    draught=7.5,
    block_coefficient=0.6,
    speed=7.7,
    frontal_area=400.0,
    lateral_area=1900.0,
)


def parts(samples: Any) -> dict[str, Any]:
    """Some rows of a regression."""
    rows = {
        f"{q} {k}": sampled(column, 5)
        for q, X in samples.features.items()
        for k, column in enumerate(X.T)
    }
    rows |= {q: sampled(target) for q, target in samples.targets.items()}
    return rows | {
        "start": sampled(samples.start),
        "duration": sampled(samples.duration),
        "window": samples.window,
        "trial": float(samples.trial.sum()),
        "rows": len(samples),
    }


def record_samples() -> dict[str, Any]:
    """Every sample structure, windows, gaps, wind, memory, a reference ship."""
    one, two = (
        trial.with_channels({"n": 1.3 + 0.01 * np.sin(trial.t / 40.0)})
        for trial in trials()[:2]
    )
    ship, gear = mariner().particulars, SteeringGear(35.0, 2.3, 0.4)
    clean = clean_zigzag()
    windy = one.with_channels(
        {
            f"wind_{q}dot": size * np.sin(one.t / 17.0)
            for q, size in (("u", 1e-3), ("v", 3e-3), ("r", 2e-5))
        }
    )
    gap = two.part(slice(0, None)).with_(use="fit")
    kept = np.abs(gap.t - 101.0) > 14.0
    gap = Trial(
        gap.t[kept], {name: row[kept] for name, row in gap.channels.items()}, name="gap"
    )
    uneven = Trial(one.t + 0.2 * np.sin(one.t), one.channels, name="uneven")
    asked: dict[str, tuple[Any, ...]] = {
        "euler": ([clean], "abkowitz", {"samples": "euler"}),
        "integral": ([one], "steering7", {"samples": "integral"}),
        "spline": ([clean], "linear-steering", {}),
        "gear": ([clean], "linear-steering", {"gear": gear, "window": 3}),
        "noisy": ([one, two], "cubic", {"shaft_speed": 1.3}),
        "window": ([one], "abkowitz", {"window": 7, "smoothing": "none"}),
        "median": ([one], "nomoto", {"window": 4, "smoothing": "median"}),
        "windy": ([windy], "linear", {"window": 5}),
        "memory": ([one, two], "nomoto2", {"samples": "integral", "window": 6}),
        "memory, spline": ([clean], "nomoto2", {}),
        "gap": ([one, gap], "norrbin", {}),
        "uneven": ([uneven], "nomoto", {"samples": "euler", "smoothing": "savgol"}),
    }
    found: dict[str, Any] = {}
    for name, (records, structure, options) in asked.items():
        found[name] = parts(
            build_samples(records, get_structure(structure), ship, **options)
        )
    box = grey_box("container")
    rolling = one.with_channels(
        {"p": 0.001 * np.cos(one.t / 9.0), "phi": 0.01 * np.sin(one.t / 9.0)}
    )
    found["reference"] = parts(
        build_samples([rolling], box, ship, window=5, shaft_speed=1.3)
    )
    found["pieces"] = [[len(piece), piece.t[0]] for piece in between_gaps(gap, ship)]
    found["windows"] = [default_window(t, ship) for t in (one, two, clean, uneven)]
    whole = build_samples([one], get_structure("nomoto"), ship, window=9)
    found["selected"] = parts(whole.select(np.arange(len(whole)) % 3 == 1))
    short = one.part(slice(0, 14))
    holes = Trial(
        np.cumsum(np.where(np.arange(30) % 8 == 7, 90.0, 1.0)),
        {k: v[:30] for k, v in one.channels.items()},
    )
    nomoto = get_structure("nomoto2")
    found["refused"] = [
        refused(lambda: build_samples([one], nomoto, ship, samples="best")),
        refused(lambda: build_samples([one], nomoto, ship, window=0)),
        refused(lambda: build_samples([short], nomoto, ship, window=14)),
        refused(lambda: build_samples([short], nomoto, ship, window=12)),
        refused(lambda: between_gaps(holes, ship)),
        refused(lambda: between_gaps(holes, ship, 12)),
    ]
    itself = shipgym.load_model("kvlcc2")
    own = zigzag(itself, 20.0, 10.0, duration=60.0, dt=0.5)
    own = own.with_channels({"n": own["n_command"]})
    samples, estimators = explained_samples(
        [own], itself, samples="integral", window=5, smoothing="none"
    )
    found["explained"] = parts(samples) | {
        q: [e.coef_, e.covariance_] for q, e in estimators.items()
    }
    spline = broken_spline(
        clean.t[:3], clean["u"][:3], rebuild(clean.t, clean["delta"])
    )
    found["three samples"] = spline(clean.t[:2] + 0.3)
    found["held out"] = [t.use == "validate" for t in held_out(trials(), ["runs/0"])]
    found["not held out"] = [
        refused(lambda: held_out(trials(), ["x"])),
        refused(lambda: held_out([one, one], [])),
        refused(lambda: held_out(one, [])),
        refused(lambda: held_out([one, "two"], [])),
    ]
    return found


@cache
def clean_zigzag() -> Trial:
    """A short zigzag without noise, every half second."""
    run = zigzag(mariner(), 15.0, 10.0, duration=150.0, dt=0.5)
    return run.with_(name="clean")


def record_rudder() -> dict[str, Any]:
    """The rudder between its samples, and the gear that it is moved by."""
    found: dict[str, Any] = {}
    for rate, lag in ((2.5, 0.0), (4.0, 0.7), (3.0, 2.3)):
        geared = replace(mariner(), steering=SteeringGear(32.0, rate, lag))
        run = zigzag(geared, 15.0, 10.0, duration=120.0, dt=0.1)
        t, delta = run.t[::5], run["delta"][::5]
        between = rebuild(t, delta)
        names = ("rate", "time_constant", "follows_gear", "corners", "smoothness")
        case = {name: getattr(between, name) for name in names}
        finite = {
            name: getattr(between, name) for name in ("before", "after", "switch")
        }
        case |= {
            name: sampled(np.where(np.isfinite(row), row, 9.0), 60)
            for name, row in finite.items()
        }
        case["angle"] = sampled(between(np.linspace(t[0], t[-1], 300)), 80)
        case["gear"] = [*estimate_gear(t, delta)]
        case["given"] = rebuild(
            t, delta, SteeringGear(35.0, rate, lag + 0.01)
        ).time_constant
        coarse = Trial(t, {name: run[name][::5] for name in ("u", "v", "r", "delta")})
        estimated = estimated_gear([coarse])
        case["estimated"] = [
            estimated.rudder_limit_deg,
            estimated.rudder_rate_deg_s,
            estimated.time_constant,
        ]
        found[f"{rate:g} deg/s, {lag:g} s"] = case
    one, two, _ = trials()
    gear = estimated_gear([one, two, two.with_channels({"delta": 4.1 * two["delta"]})])
    found["noisy gear"] = [
        gear.rudder_limit_deg,
        gear.rudder_rate_deg_s,
        gear.time_constant,
    ]
    noisy_one = rebuild(one.t, one["delta"])
    found["noisy"] = [noisy_one.follows_gear, noisy_one(one.t[:9] + 0.3)]
    found["still"] = [
        *estimate_gear(np.arange(9.0), np.full(9, 0.2)),
        rebuild(np.arange(9.0), np.full(9, 0.2))(3.3),
    ]
    found["three"] = rebuild(np.arange(3.0), np.array([0.0, 0.1, 0.1])).follows_gear
    return found


def record_preprocessing() -> dict[str, Any]:
    """Noise, filters, smoothers and repairs."""
    short = trials()[1].part(slice(10, 75))
    uneven = Trial(
        short.t + 0.2 * np.sin(short.t), short.channels, name="uneven"
    ).with_(over_ground=False)
    found: dict[str, Any] = {}
    channels = ("psi", "u", "v", "r", "delta", "n")
    for name in PREPROCESSING:
        for what, trial in {"even": short, "uneven": uneven}.items():
            given = smoothed_channels(
                trial.with_channels({"n": 1.2 + trial["u"] / 70.0}), channels, name
            )
            found[f"{name}, {what}"] = {
                channel: sampled(row, 20) for channel, row in given.items()
            }
    found["yes and no"] = [
        smoothed_channels(short, ("r",), name)["r"][:7] for name in ("spline", "none")
    ]
    some = {
        "r alone": ("r", "u"),
        "psi alone": ("psi", "x", "y"),
        "no place": ("psi", "r", "u", "v"),
        "v": ("r", "v"),
    }
    for what, names in some.items():
        part = Trial(short.t, {name: short[name] for name in names})
        found[f"rts, {what}"] = {
            k: sampled(v) for k, v in smoothed_channels(part, names, "rts").items()
        }
    steady = clean_zigzag().part(slice(0, 60))
    found["rts, clean"] = {
        k: sampled(v)
        for k, v in smoothed_channels(steady, ("psi", "r", "u", "v"), "rts").items()
    }
    half = steady.with_channels({"u": steady["u"] + 0.1 * np.sin(91.0 * steady.t)})
    found["rts, half clean"] = {
        k: sampled(v)
        for k, v in smoothed_channels(half, ("psi", "r", "u", "v"), "rts").items()
    }
    for name, one_filter in FILTERS.items():
        found[f"few samples, {name}"] = one_filter(short.t[:4], short["r"][:4])
    found["savgol, widths"] = [
        savitzky_golay(short.t, short["r"], width)[:20] for width in (5, 11)
    ]
    found["savgol, short"] = [
        savitzky_golay(short.t[:n], short["r"][:n]) for n in (24, 26)
    ]
    found["savgol, clean"] = savitzky_golay(steady.t, steady["r"])[20:40]
    found["noise"] = [
        [
            noise_level(t.t, t[c]),
            noise_ratio(t.t, t[c]),
            noise_ratio(t.t, t[c], 4),
            is_noisy(t.t, [t[c]]),
        ]
        for t in (short, uneven, steady)
        for c in ("u", "psi", "delta")
    ]
    found["no noise"] = [
        noise_level([0.0, 1.0, 2.0, 4.0], np.arange(4.0)),
        noise_ratio(np.arange(9.0), np.ones(9)),
    ]
    found |= _repairs(short)
    random = np.random.default_rng(5)
    F = np.tile([[1.0, 0.7], [-0.1, 0.95]], (7, 1, 1))
    Q, H = (
        np.tile([[0.02, 0.005], [0.005, 0.03]], (7, 1, 1)),
        np.array([[1.0, 0.2], [0.0, 1.0]]),
    )
    measured = random.uniform(-1.0, 1.0, (8, 2))
    measured[3, 1] = np.nan
    system = LinearSystem(
        F,
        Q,
        H,
        np.array([0.1, 0.3]),
        np.array([0.4, -0.7]),
        np.array([2.0, 0.5]),
    )
    filtered = system.filtered(measured)
    found["smoother"] = [
        system.smoothed(measured),
        filtered.log_likelihood,
        filtered.states,
        filtered.log_likelihood,
    ]
    found["refused"] = [
        refused(lambda: smoothed_channels(short, ("u",), "best")),
        refused(
            lambda: smoothed_channels(Trial(short.t, {"u": short["u"]}), ("u",), "rts")
        ),
    ]
    return found


def _repairs(short: Trial) -> dict[str, Any]:
    """Spikes, spikes at the ends, dropouts and gaps."""
    r, delta, wide = short["r"].copy(), short["delta"].copy(), short["r"].copy()
    r[[0, 20, 41, 42]] += [0.011, -0.009, 0.008, 0.008]
    delta[[30, 64]] += [0.4, -0.5]
    kept = np.ones(len(short), dtype=bool)
    kept[[12, 13, 14, 50]] = False
    later = np.where(short.t > short.t[33], 25.0, 0.0)
    bad = short.with_channels({"r": r, "delta": delta, "n": np.full(len(short), 1.3)})
    holed = Trial(
        (bad.t + later)[kept], {name: row[kept] for name, row in bad.channels.items()}
    )
    found: dict[str, Any] = {}
    for name, trial in {"spikes": bad, "holes": holed, "sound": short}.items():
        mended = repaired(trial)
        found[f"repaired, {name}"] = [
            mended.t,
            mended["r"],
            mended["delta"],
            dict(mended.repaired),
        ]
    found["repaired, low"] = dict(repaired(bad, 3.0).repaired)
    found["outliers"] = [
        outliers(bad.t, values, 5.0, step)
        for values in (r, delta)
        for step in (True, False)
    ]
    found["outliers, few"] = outliers(np.arange(5.0), [0.0, 0.0, 9.0, 0.0, 0.0])
    ends, seconds = np.sin(np.arange(24) / 15.0), 2.0 * np.arange(24)
    ends[[0, -1]] += [0.9, -1.1]
    gap = seconds + 5.0 * (np.arange(24) == 23)
    found["outliers, ends"] = [
        outliers(seconds, ends, 6.0, False),
        outliers(gap, ends, 6.0, False),
        outliers(seconds[:20], ends[4:], 6.0, False),
    ]
    wide[::4] += 0.02 * np.sign(np.sin(np.arange(len(wide[::4])) * 2.1))
    found["repair refused"] = [
        refused(lambda: repaired(short.with_channels({"r": wide}), 0.3)),
        refused(lambda: repaired(short, 0.0)),
    ]
    return found


@cache
def logs() -> tuple[Trial, ...]:
    """A turn and two zigzags with velocities over ground, in a current of 0.3 m/s north and 0.4 m/s west."""
    runs = [
        turning_circle(mariner(), 30.0, 420.0, 1.0),
        zigzag(mariner(), 20, 20, True, 240.0, 1.0),
        zigzag(mariner(), 15, 10, False, 240.0, 1.0),
    ]
    found = []
    for k, run in enumerate(runs):
        one = noisy(
            run,
            20 + k,
            every=2,
            noise=0.3,
            name=f"logs/{k}",
            use="validate" if k == 2 else "fit",
        )
        found.append(over_ground(one, 0.3, -0.4))
    return tuple(found)


def over_ground(trial: Trial, north: float, east: float) -> Trial:
    """The trial as recorded by satellites in a current."""
    ahead, aside = rotate_to_body(
        np.full(len(trial), north), np.full(len(trial), east), trial["psi"]
    )
    passed = trial.t - trial.t[0]
    moved = {
        "u": trial["u"] + ahead,
        "v": trial["v"] + aside,
        "x": trial["x"] + north * passed,
    }
    return trial.with_channels(moved | {"y": trial["y"] + east * passed}).with_(
        over_ground=True
    )


def told(trial: Trial) -> dict[str, Any]:
    """Some samples of the channels that current and wind change."""
    names = [
        name
        for name in trial.channels
        if name[:4] in ("x", "y", "u", "v", "curr", "wind")
    ]
    return {name: sampled(trial[name], 6) for name in names} | {
        "ground": trial.over_ground
    }


def record_still_water() -> dict[str, Any]:
    """Currents that are estimated, given or logged."""
    ship = mariner().particulars
    turn, first, held = logs()
    found: dict[str, Any] = {}
    pair = [turn.part(slice(0, 150)), first]
    for name, options in {"shared": (True, None), "each": (False, None)}.items():
        estimate = estimate_current(pair, ship.length, ship["speed"], *options)
        found[name] = [estimate.mean, estimate.covariance, estimate.coefficients]
    known = estimate_current(
        [held], ship.length, ship["speed"], True, np.asarray(estimate.coefficients)
    )
    found["known"] = [known.mean, known.covariance]
    u = through_water(turn, 0.3, -0.4)["u"]  # by a log
    logged = turn.with_channels(
        {
            "u": u,
            "n": np.linspace(1.4, 1.3, len(turn)),
            "wind_udot": 1e-3 * np.cos(turn.t / 30.0),
            "wind_vdot": -2e-3 * np.cos(turn.t / 50.0),
            "wind_rdot": np.zeros(len(turn)),
            "wind_speed": np.full(len(turn), 7.0),
        }
    )
    logged = Trial(
        logged.t, logged.channels, derived=["v"], name="log", over_ground=True
    )
    estimate = estimate_current([logged], ship.length, ship["speed"], True)
    found["speed log"] = [estimate.mean, estimate.covariance, estimate.coefficients]
    columns = first.with_(over_ground=False).with_channels(
        {
            "current_north": np.full(len(first), 0.2),
            "current_east": 0.1 + 0.002 * first.t,
        }
    )
    given = {"north": 0.2, "east": -0.3}
    asked: dict[str, tuple[Any, dict[str, Any]]] = {
        "auto": (logs(), {}),
        "given": ((first, held), {"current": given}),
        "columns": ((columns,), {}),
        "log given": ((logged, turn.with_(use="skip")), {"current": given}),
        "none": ((first,), {"current": "none"}),
    }
    for name, (records, options) in asked.items():
        out, report = in_still_water(records, ship, **options)
        found[name] = {"trials": [told(trial) for trial in out], **report}
    one_way = over_ground(trials()[1], 0.1, 0.05)
    fast = {"north": 7.0, "east": 8.0}
    _, doubtful = in_still_water([one_way], ship)
    found["doubtful"] = doubtful
    found["own speed"] = in_still_water([first], {"length": 160.9}, given)[1]
    found["nothing"] = len(in_still_water([first], None)[1])
    found["refused"] = [
        refused(lambda: in_still_water([one_way], ship, "trial")),
        refused(lambda: in_still_water([first], ship, fast)),
        refused(lambda: in_still_water([first], ship, "tide")),
        refused(lambda: in_still_water([first], ship, {"north": 0.1})),
        refused(lambda: in_still_water([columns], ship, {"north": 0.3, "east": -0.5})),
    ]
    found["through the water"] = told(through_water(logged, 0.1, 0.003 * logged.t))
    return found


def record_wind() -> dict[str, Any]:
    """Wind that is logged, and constant accelerations."""
    _, one, two = logs()
    windy = one.with_channels(
        {"wind_speed": 9.0 + np.sin(one.t / 20.0), "wind_from": 0.7 + one.t / 200.0}
    )
    through = windy.with_(over_ground=False).with_channels(
        {
            "current_north": np.full(len(one), 0.5),
            "current_east": np.full(len(one), -0.2),
        }
    )
    table = {
        "angles_deg": [0.0, 90.0, 180.0],
        "CX": [0.7, 0.1, -0.6],
        "CY": [0.0, -0.8, 0.0],
        "CN": [0.0, -0.05, 0.0],
    }
    found: dict[str, Any] = {}
    options: dict[str, Any] = {
        "table": {"coefficients": table},
        "auto": "auto",
        "relative": {"relative": True},
        "named": {"coefficients": "blendermann"},
    }
    for name, option in options.items():
        found[name] = [
            told(measured_wind(trial, BULKER, option))
            for trial in (windy, through, one)
        ]
    for name, option in {
        "none": "none",
        "auto": "auto",
        "table": {"relative": False},
    }.items():
        out, report = in_still_water([windy, two], BULKER, "none", option)
        found[f"still, {name}"] = {"trials": [told(trial) for trial in out], **report}
    unknown = Particulars(length=160.9, speed=7.7)
    found["not known"] = in_still_water([windy], unknown, "none")[1]
    ship = mariner().particulars
    pair = [one.with_(over_ground=False), two.with_(over_ground=False)]
    for name in ("linear-steering", "linear", "nomoto"):
        samples = build_samples(pair, get_structure(name), ship, window=5)
        constants = constant_wind(pair, samples, name)
        found[f"constant, {name}"] = {
            "found": constants,
            "trial": told(with_constant_wind(pair[1], constants)),
        }
    found["no constant"] = with_constant_wind(pair[0], {}) is pair[0]
    found["refused"] = [
        refused(lambda: measured_wind(windy, BULKER, {"relativ": True})),
        refused(lambda: measured_wind(windy, BULKER, {"relative": 1})),
        refused(lambda: measured_wind(windy, unknown, "blendermann")),
        refused(lambda: in_still_water([windy], unknown, "none", "blendermann")),
        refused(lambda: in_still_water([one], BULKER, "none", "blendermann")),
        refused(lambda: constant_wind(pair, samples, "mmg")),
    ]
    return found


def record_forces() -> dict[str, Any]:
    """Captive tests: the regression over three forces, and the models identified from it."""
    truth = captive_ship()
    found: dict[str, Any] = {}
    for inertia in (True, False):
        tank = Tank(noise=0.02, model_inertia=inertia)
        runs = [
            pure_surge(truth, 0.5, tank=tank),
            pure_sway(truth, 0.7, tank=tank),
            pure_yaw(truth, 4.0, tank=tank),
            yaw_with_drift(truth, 4.0, 6.0, tank=tank),
            static_drift(truth, [-9.0, 4.0, 13.0], tank=tank),
        ]
        runs = [run.part(slice(0, 90)).with_(name=str(k)) for k, run in enumerate(runs)]
        made = force_regression(runs, get_structure("pmm18"), SHIP, inertia)
        found[f"regression, {inertia}"] = {
            "features": [sampled(column, 6) for column in made.features.T],
            "targets": sampled(made.targets, 20),
            "places": [
                sampled(made.equation * 1.0),
                sampled(made.trial * 1.0),
                len(made),
            ],
            "scales": made.scales()[::90],
        }
        for method, structure, rank in (
            ("ls", "pmm18", None),
            ("tls-svm", "pmm38", None),
            ("tls-svm", "pmm18", 7),
        ):
            model = identify_forces(
                runs, structure, SHIP, method=method, rank=rank, model_inertia=inertia
            )
            errors = np.sqrt(np.diag(model.covariance))
            told = {
                key: value
                for key, value in model.provenance.items()
                if key in ("rank", "r_squared")
            }
            found[f"{structure} by {method} {rank}, {inertia}"] = [
                model.coefficients,
                errors,
                told,
            ]
    found["variances"] = force_variances(
        np.array([0, 0, 1, 1, 1, 2]),
        np.array([0.3, -0.2, 1.0, 2.0, -0.7, 0.1]),
        np.array([0.1, 0.3, 0.2, 0.5, 0.1, 0.9]),
    )
    named = identify_forces(
        runs,
        "pmm18",
        SHIP,
        name="mine",
        steering=SteeringGear(33.0, 2.0, 0.0),
        model_inertia=False,
    )
    found["steering"] = named.steering.rudder_limit_deg
    at_rest = runs[0].with_channels(
        {"u": np.zeros(len(runs[0])), "v": np.zeros(len(runs[0]))}
    )
    jumping = runs[0].with_channels({"u": 4.0 + np.arange(len(runs[0])) // 3})
    table = get_structure("pmm18")
    lacking = Trial(
        runs[0].t, {name: runs[0][name] for name in ("u", "v", "X")}, name="lacking"
    )
    found["refused"] = [
        refused(lambda: force_regression([], table, SHIP)),
        refused(lambda: force_regression([lacking], table, SHIP)),
        refused(lambda: force_regression([at_rest], table, SHIP)),
        refused(lambda: force_regression([jumping], table, SHIP)),
        refused(lambda: identify_forces(runs, "pmm18", SHIP, method="best")),
        refused(lambda: identify_forces(runs, "pmm18", SHIP, method="ls", rank=3)),
        refused(lambda: identify_forces(runs, "pmm18")),
        refused(lambda: identify_forces(runs, "abkowitz", SHIP)),
    ]
    return found


@cache
def captive_ship() -> ShipModel:
    """A ship with made-up shares of forces."""
    names = get_structure("pmm18").coefficient_names
    values = dict(
        zip(
            names,
            (0.003 * np.sin(1.0 + 2.3 * np.arange(len(names)))).tolist(),
            strict=True,
        )
    )
    values |= {
        "X_udot": -0.0006,
        "Y_vdot": -0.009,
        "N_rdot": -0.0005,
        "Y_v|v|": -0.03,
        "Y_uuv": -0.014,
    }
    kept = {name: value for name, value in values.items() if name in names}
    return ShipModel("captive", "pmm18", SHIP.completed(), SteeringGear(), kept)


def record_references() -> dict[str, Any]:
    """The grey box of a ship, named or chosen, and how she alone predicts."""
    one, two, _ = trials()
    found: dict[str, Any] = {}
    particulars = mariner().particulars
    for name in ("tanker", "auto"):
        box, alike = chosen_box(name, particulars, [one, two])
        found[name] = [box.shaft, len(box.ship.name), alike]
    shaft, _ = chosen_box(
        "tanker", particulars, [one.with_channels({"n": np.full(len(one), 1.3)})]
    )
    found["shaft"] = [shaft.shaft, chosen_box("mariner", particulars, [])[0].shaft]
    blank = dict.fromkeys(box.coefficient_names, 0.01)
    model = replace(
        mariner(),
        structure=box.name,
        coefficients=blank,
        dynamics=box,
        covariance=None,
    )
    found["bare"] = bare_metrics(model, [one.part(slice(0, 60))])
    found["refused"] = [
        refused(lambda: chosen_box(None, particulars, [one])),
        refused(lambda: chosen_box("auto", Particulars(length=7.0, speed=1.0), [one])),
        refused(
            lambda: chosen_box(
                "auto",
                Particulars(
                    length=20.0,
                    beam=9.0,
                    draught=0.9,
                    block_coefficient=0.9,
                    speed=14.0,
                ),
                [one],
            )
        ),
    ]
    return found


PARTS = Parts(
    {
        "samples": record_samples,
        "rudder": record_rudder,
        "preprocessing": record_preprocessing,
        "still water": record_still_water,
        "wind": record_wind,
        "forces": record_forces,
        "references": record_references,
    }
)
