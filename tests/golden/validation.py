"""Golden section `validation`: what is known of a ship beforehand, what speaks against a model,
what is next."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from types import SimpleNamespace
from typing import Any

import numpy as np

import shipgym
from identification import (
    Options,
    advise,
    backward_elimination,
    build_samples,
    compare_methods,
    cross_validate,
    forward_selection,
    identify_reduced,
    sensitivity,
)
from identification.design.experiment import standard_candidates
from identification.design.sensitivity import table_of, zigzag_sensitivity
from identification.estimators.estimator import FitTask
from identification.estimators.methods import get_method, make_method
from identification.report.comparison import comparison_page
from identification.simulation_error import (
    formulas,
    hull_formulas,
    mmg_prior,
    similarity,
)
from identification.simulation_error.posterior import held_out_groups
from identification.simulation_error.prior import (
    reference_prior,
    virtual_trials,
)
from identification.simulation_error.prior_knowledge import PriorKnowledge
from identification.simulation_error.pulled import with_prior
from identification.simulation_error.segments import cut
from identification.simulation_error.shooting import (
    about_mean,
    averaged,
    channel_units,
)
from identification.uncertainty.bootstrap import (
    bootstrap_covariance,
    influence_covariance,
    moving_blocks,
)
from identification.uncertainty.covariance import joint_covariance, newey_west
from identification.uncertainty.model_error import model_error, scale_of, without_trial
from identification.uncertainty.uncertainty import Uncertainty
from identification.validation import diagnostics, guard, warnings
from identification.validation.closed_loop import closed_loop
from identification.validation.folds import held_out_rows, of_largest_rudder, pieces
from identification.validation.hard_turn import hard_turn_features
from identification.validation.prediction import predict, trial_metrics
from identification.validation.ranking import RankedFit, in_turn
from identification.validation.selection import methods_of, reference_of, select
from identification.validation.start import with_start
from shipgym import Particulars, ShipModel, Trial, UnstableModelError
from shipgym.manoeuvres import turning_circle, zigzag
from shipgym.ships import get_structure
from tests.golden.fits import LINEAR, fitted
from tests.golden.made_up import Parts, mariner, refused, regression, sampled, trials
from tests.golden.regression import clean_zigzag

TOLERANCES = {"": 1e-5}
LEFT_OUT = ("sha256", "software", "version")
WITHOUT_ERROR = Uncertainty(model_error=False)
FERRY = Particulars(
    length=120.0,
    beam=21.0,
    draught=5.6,
    block_coefficient=0.58,
    speed=9.5,
    propellers=2.0,
    rudders=2.0,
    xg=-1.7,
    propeller_pitch_ratio=1.1,
    Y_vdot=-0.007,
)
TANKER = Particulars(
    length=312.0,
    beam=57.0,
    draught=20.3,
    block_coefficient=0.815,
    speed=8.1,
    rudder_area=108.0,
)
BARGE = Particulars(
    length=60.0,
    beam=20.0,
    draught=2.2,
    block_coefficient=0.93,
    speed=4.0,
    rudder_area=7.0,
)


def record_formulas() -> dict[str, Any]:
    """Derivatives and coefficients from main dimensions, and how like ships are."""
    found: dict[str, Any] = {}
    for name, ship in {"ferry": FERRY, "tanker": TANKER, "barge": BARGE}.items():
        whole = mmg_prior.completed(ship)
        found[name] = {
            "particulars": [
                whole[part]
                for part in ("rudder_area", "propeller_diameter", "rudder_aspect_ratio")
            ],
            "similar": [
                similarity.similarity_vector(ship, printed) for printed in (False, True)
            ],
        }
        for source in ("yoshimura", "kijima"):
            prior = mmg_prior.mmg_prior(source, ship)
            found[name][source] = [prior.mean, prior.deviation, prior.remarks]
    area = replace(FERRY.completed(), rudder_area=13.0)
    for formula in ("clarke", "kijima"):
        found[formula] = formulas.FORMULAS[formula](area)
        for structure in ("linear-steering", "steering7", "abkowitz"):
            made = formulas.formula_coefficients(
                formula, get_structure(structure), area
            )
            found[f"{formula}, {structure}"] = {q: [*both] for q, both in made.items()}
    for source in ("kvlcc2", "auto"):
        prior = mmg_prior.mmg_prior(source, TANKER)
        found[f"mmg, {source}"] = [
            prior.mean,
            prior.deviation,
            prior.similarity,
            prior.remarks,
        ]
    unlike = mmg_prior.mmg_prior("kvlcc2", FERRY)
    found["mmg, unlike"] = [unlike.remarks, unlike.similarity]
    known = Particulars(
        length=100.0, speed=8.0, beam=15.0, draught=6.0, block_coefficient=0.7
    )
    found["one hull"] = similarity.select_reference(TANKER, ("p", "phi"))[1]
    found["chosen"] = [
        similarity.select_reference(one, seen)[0]
        for one in (TANKER, known)
        for seen in (None, ("u",))
    ]
    rows = {
        "a": [0.5, 6.0, 2.5, np.nan, 0.02],
        "b": [0.8, 5.5, 3.0, 4.0, 0.015],
        "c": [0.6, 7.7, 2.2, 5.0, 0.018],
    }
    found["correlations"] = similarity.correlations([0.7, 6.3, 2.8, 4.4, 0.017], rows)
    found["refused"] = [
        refused(lambda: mmg_prior.mmg_prior("clarke", TANKER)),
        refused(lambda: mmg_prior.mmg_prior("mariner", TANKER)),
        refused(lambda: mmg_prior.mmg_prior("auto", FERRY)),
        refused(lambda: hull_formulas.formula_coefficients("x", TANKER)),
        refused(
            lambda: similarity.correlations(
                [1.0, np.nan, np.nan], {"a": [1.0, 2.0, 3.0]}
            )
        ),
        refused(lambda: similarity.select_reference(TANKER, ("u",), ("container",))),
        refused(
            lambda: formulas.clarke_derivatives(Particulars(length=9.0, speed=1.0))
        ),
    ]
    return found


def record_priors() -> dict[str, Any]:
    """Priors of reference ships, and how far coefficients are pulled to them."""
    ship, one, two = mariner(), *trials()[:2]
    found: dict[str, Any] = {}
    blank = replace(fitted("tables", LINEAR).model, covariance=None)
    prior = reference_prior("mariner", blank)
    found["reference"] = [
        prior.centre,
        {q: np.abs(root) for q, root in prior.roots.items()},
        prior.known,
    ]
    runs = virtual_trials(
        replace(ship, steering=replace(ship.steering, rudder_limit_deg=25.0))
    )
    found["virtual"] = [
        [len(run), run.t[-1], run["r"].mean(), np.abs(run["delta"]).max(), run["n"][0]]
        for run in runs
    ]
    samples = build_samples([one, two], blank.table, ship.particulars, window=9)
    target = replace(blank, particulars=replace(ship.particulars, rudder_area=14.9))
    given: dict[str, tuple[Any, ...]] = {
        "weak": ("clarke", 0.003, "trials", [one, two]),
        "none": ("clarke", 0.0, "trials", [one, two]),
        "chosen": ("kijima", None, "trials", [one, two]),
        "blocks": ("clarke", None, "trials", [one]),
        "largest": ("clarke", None, "largest-rudder", [one, two]),
        "all": ("kijima", np.inf, "trials", [one, two]),
    }
    for name, (source, strength, folds, records) in given.items():
        rows = samples.select(samples.trial < len(records))
        task = FitTask(rows, target, records)
        ridge = get_method(make_method("ridge", {"alpha": 1e-4}))
        knowledge = PriorKnowledge(source, strength, folds)
        fits = with_prior(ridge, knowledge, target).fitted(task)
        found[name] = {
            q: [one.coef_, one.covariance_, one.prior_] for q, one in fits.items()
        }
    return found


def record_guard() -> dict[str, Any]:
    """Models that run away, and the state in which a prediction starts."""
    ship, one, two = mariner(), *trials()[:2]
    found: dict[str, Any] = {}
    for structure in ("abkowitz", "cubic", "nomoto2", "mmg4dof", "steering7"):
        sizes = hard_turn_features(get_structure(structure), ship.particulars, 1.3)
        found[structure] = sizes
    linear = fitted("tables", LINEAR).model
    changes: dict[str, dict[str, float]] = {
        "turns": {"c_d": 9.0},
        "drifts": {"b_d": -4.0},
        "grows": {"c_r": 8.0},
        "slow": {"c_r": 1.5, "c_v": 2.0},
    }
    for name, change in changes.items():
        wild = linear.with_coefficients(
            np.array(list((linear.coefficients | change).values()))
        )
        found[f"reasons, {name}"] = guard.reasons_unstable(
            wild, [one.part(slice(0, 90))]
        )
    for name, u in {"astern": -3.0, "fast": 99.0}.items():
        run = clean_zigzag().with_channels(
            {"u": np.linspace(5.0, u, len(clean_zigzag()))}
        )
        found[f"runs, {name}"] = guard.why_unphysical(
            ship, guard.Simulation("run", lambda r=run: r)
        )
    found["reversed"] = sampled(guard.reversed_rudder(linear, 10.0, 5.0)["psi"])
    derived = Trial(one.t, one.channels, derived=("u", "v", "r"), name="derived")
    no_track = Trial(
        one.t,
        {k: v for k, v in one.channels.items() if k not in "xy"},
        derived=("v",),
        name="blind",
    )
    for name, trial in {"derived": derived, "no track": no_track, "known": one}.items():
        begun = with_start(
            ship, trial.with_channels({"v": trial["v"] + 0.3 * (trial.t == 0.0)})
        )
        found[f"start, {name}"] = [begun[c][:2] for c in "uvr"]
    for name, trial in {"zigzag": one, "other": two, "clean": clean_zigzag()}.items():
        run = closed_loop(linear, trial)
        found[f"closed loop, {name}"] = [
            run.t[[3, -1]],
            sampled(run["psi"]),
            sampled(run["delta_command"]),
        ]
        found[f"metrics, {name}"] = trial_metrics(linear, trial, predict(linear, trial))
    turn = turning_circle(ship, 30.0, 500.0, 2.0)
    found["turn"] = trial_metrics(linear, turn, predict(linear, turn))
    found["lost"] = trial_metrics(linear, one, None)
    wild = linear.with_coefficients(
        np.array(list((linear.coefficients | {"c_r": 30.0}).values()))
    )
    found["never"] = [predict(wild, one) is None, closed_loop(wild, one) is None]
    gone = replace(
        fitted("tables", LINEAR), predictions=dict.fromkeys(("runs/0", "runs/1"))
    )
    found["why"] = [
        warnings.why_unstable(gone),
        warnings.why_lost(linear, False),
        warnings.why_lost(wild, True),
    ]
    diverged = {
        name: {**m, "diverged": True} for name, m in gone.metrics["trials"].items()
    }
    found["diverged"] = warnings.held_out_error(
        replace(gone, metrics={"trials": diverged})
    )
    headless = {
        name: {
            **m,
            "rmse": {"psi": None},
            "overshoot_1_deg": None,
            "overshoot_2_deg": None,
        }
        for name, m in gone.metrics["trials"].items()
    }
    found["headless"] = warnings.held_out_error(
        replace(gone, metrics={"trials": headless})
    )
    return found


def record_diagnostics() -> dict[str, Any]:
    """Correlations, inflation, folds, blocks and their covariance."""
    X, _ = regression()
    random = np.random.default_rng(9)
    series = np.cumsum(random.uniform(-1.0, 1.1, 40))
    scaled, condition = diagnostics.scaled_features(
        np.column_stack([X, 1.9 * X[:, 0], np.zeros(len(X))])
    )
    one, two, held = trials()
    wide = [one, two, held.with_channels({"delta": 1.3 * held["delta"]})]
    samples = build_samples(
        wide, get_structure("linear-steering"), mariner().particulars, window=8
    )
    estimators = get_method("tls-svm").fitted(FitTask(samples, mariner(), wide))
    found: dict[str, Any] = {
        "autocorrelation": [
            diagnostics.autocorrelation(series, 7),
            diagnostics.autocorrelation(series[:4], 7),
        ],
        "constant": [
            *diagnostics.autocorrelation(np.ones(9), 3),
            *diagnostics.cross_correlation(np.ones(5), np.ones(5), np.arange(3)),
        ],
        "cross": diagnostics.cross_correlation(
            series, np.sin(series), np.arange(-45, 46, 6)
        ),
        "inflation": [diagnostics.variance_inflation(scaled[:, :6]), condition],
        "pairs": diagnostics.collinear_pairs(scaled[:, :7], [*"abcdefg"]),
        "apart": [
            len(diagnostics.without_overlap(replace(samples, window=w)))
            for w in (1, 2, 3, 8)
        ],
        "diagnosed": diagnostics.diagnose(
            estimators, samples, get_structure("linear-steering")
        ),
        "largest": of_largest_rudder(wide, "folds"),
        "pieces": [[len(part), part.t[0], part.name] for part in pieces(one)],
        "covariance": [
            joint_covariance(estimators, samples),
            joint_covariance(estimators, samples, 40.0),
        ],
        "bootstrap": bootstrap_covariance(estimators, samples, 40.0, 7, 3),
        "newey west": [
            newey_west(X[:, :3], 0),
            newey_west(X[:, :3], 4),
            newey_west(X[:3, :2], 9),
        ],
        "blocks": moving_blocks(
            [np.arange(7), np.arange(7, 12)], [3, 9], np.random.default_rng(1)
        ),
        "influences": influence_covariance([X[:20, :3], X[20:, :3]], 4, 9, 2),
        "scale": [
            scale_of([(4.0, 1.0, 0.3), (1.0, 2.0, 0.1)]),
            scale_of([(1.0, 2.0, 3.0)]),
            scale_of([(9.0, 1e-9, 0.1)]),
        ],
        "groups": [
            held_out_groups([SimpleNamespace(trial=k) for k in which])
            for which in ((0, 1, 2, 6, 6), (3,) * 7)
        ],
        "mean": [
            about_mean(np.array([0.1, 0.5, -0.3])),
            averaged(X[:6, :2], np.array([0, 4]), np.array([4, 2])),
        ],
        "units": channel_units(mariner(), ("u", "r", "psi", "v")),
    }
    for folds in ("trials", "largest-rudder"):
        found[f"held out, {folds}"] = [
            [rows.sum(), t.name] for rows, t in held_out_rows(wide, samples, folds)
        ]
    alone = samples.select(samples.trial == 0)
    found["held out, pieces"] = [
        [rows.sum(), t.name] for rows, t in held_out_rows([one], alone, "trials")
    ]
    left, kept = without_trial(estimators, samples, 1)
    found["without"] = {q: [m.coef_, m.inverse_moment_] for q, m in left.items()} | {
        "rows": len(kept)
    }
    model = fitted("uncertainty", "three").model
    found["model error"] = [
        model_error(model, [model] * 3, [one, two, held]),
        model_error(model, [model], [one]),
    ]
    bare = [
        Trial(t.t, {k: t[k] for k in ("psi", "u", "v", "r", "delta")}, name=t.name)
        for t in (one, two, held)
    ]
    found["model error, bare"] = model_error(model, [model] * 3, bare)
    for name, (lengths, staggered, interval) in {
        "short": (2.3, True, 0.0),
        "long": (99.0, False, 0.2),
    }.items():
        segments = cut(
            [one, two], mariner(), ("u", "v", "r", "psi"), lengths, staggered, interval
        )
        found[f"segments, {name}"] = [
            [
                s.trial,
                len(s.inputs),
                len(s.measured),
                *s.times[[0, -1]],
                *s.start,
                s.inputs[:, 1].sum(),
            ]
            for s in segments
        ]
    return found


def record_selection() -> dict[str, Any]:
    """The structure that predicts best, by made-up errors; methods compared on the trials held out."""
    errors = {
        "nomoto": 0.5,
        "norrbin": 0.31,
        "nomoto2": 0.304,
        "abkowitz": 0.3,
        "cubic": 0.35,
        "grey-box": 0.8,
        "mmg": None,
    }

    def identified(parts: Sequence[Trial], options: Options) -> Any:
        name = options.structure
        if name not in errors:
            refused_by = shipgym.InputError(f"{name} knows no shaft")
            raise refused_by
        scatter = {
            trial.name: 0.004 * np.sin(7.0 * k + len(name))
            for k, trial in enumerate(parts)
        }
        error = errors[name]
        rmse = {
            t.name: (
                None
                if error is None
                else error + scatter[t.name] + 0.02 * (options.method == "ls")
            )
            for t in parts
        }
        metrics = {
            t.name: {
                "use": "validate",
                "diverged": error is None,
                "rmse": {
                    c: None if error is None else rmse[t.name] * np.std(t[c])
                    for c in ("u", "v", "r", "psi")
                },
            }
            for t in parts
        }
        model = SimpleNamespace(
            provenance={"structure": name, "method": options.method}
        )
        return SimpleNamespace(
            metrics={"trials": metrics},
            model=model,
            coefficients=range(3 * len(name)),
            stable=name != "grey-box",
        )

    found: dict[str, Any] = {}
    given = {
        "usual": Options(structure="auto"),
        "ls": Options(structure="auto", method="ls"),
        "ship": Options(structure="auto", reference_model="tanker"),
    }
    for name, options in given.items():
        chosen, told = select(identified, trials(), options)
        found[name] = [chosen.structure, chosen.method, chosen.reference_model, told]
    found["pieces"] = select(identified, trials()[:1], given["usual"])[1]
    errors = {"mmg": None}
    found["lost"] = select(identified, trials(), given["usual"])[1]
    errors = {}
    found["refused"] = [refused(lambda: select(identified, trials(), given["usual"]))]
    found["methods"] = [
        [*methods_of(s, "tls-svm"), reference_of(s, None), reference_of(s, "tanker")]
        for s in ("nomoto", "grey-box", "mmg")
    ]
    turns = in_turn(
        lambda held: SimpleNamespace(metrics={"trials": {n: len(held) for n in held}}),
        trials(),
        2,
    )
    found["in turn"] = [
        turns[0],
        len(turns[1]),
        *(len(in_turn(identified_none, trials(), n)[1]) for n in (0, 9)),
    ]
    one = RankedFit("a", "b", 3, True, 0, 0.3, 1.0, 0.1, {})
    ranks = [
        one,
        replace(one, ran_away=1),
        replace(one, stable=False),
        replace(one, error=None),
        replace(one, error=0.2),
    ]
    found["ranks"] = [sorted(range(5), key=lambda k: ranks[k].rank)]
    return found


def identified_none(held: Sequence[str]) -> Any:
    """What an identification would have said of trials held out."""
    return SimpleNamespace(metrics={"trials": dict.fromkeys(held, 0)})


@cache
def compared() -> Any:
    """Methods on the trials held out."""
    arguments = {
        "structure": "linear-steering",
        "particulars": mariner().particulars,
        "settings": {"forgetting": 0.98, "rank": 3},
    }
    return compare_methods(
        list(trials()), ["ls", "tls-svm", "nisg", "rm-svm"], **arguments
    )


def record_comparison() -> dict[str, Any]:
    """Methods and structures compared, and trials held out in turn."""
    known = {"particulars": mariner().particulars}
    fit = [trial.with_(use="fit") for trial in trials()]
    several = compare_methods(
        fit,
        ["tls-svm"],
        ["nomoto", "linear", "mmg"],
        **known,
        uncertainty=WITHOUT_ERROR,
    )
    turns = cross_validate(fit, 2, structure="nomoto", **known)
    one, two = fit[:2]
    return {
        "methods": compared().to_dict(),
        "several": several.to_dict(),
        "best": several.best.coefficients,
        "in turn": turns,
        "refused": [
            refused(lambda: compare_methods([one], ["ls"], **known)),
            refused(lambda: compare_methods([one, two], [], **known)),
            refused(
                lambda: compare_methods(
                    [one, two], ["ls"], settings={"omega": 0.3}, **known
                )
            ),
            refused(lambda: compare_methods([one, two], ["rm-svm"], **known)),
            refused(lambda: cross_validate([one], **known)),
            refused(lambda: cross_validate([one, two], 3, **known)),
        ],
    }


def page() -> str:
    """The page of the comparison, one error beyond what its figure shows."""
    ranking = compared()
    last = ranking.ranked[-1]
    beyond = replace(last, error=2.7, errors=dict.fromkeys(last.errors, 2.7))
    return comparison_page(replace(ranking, ranked=(*ranking.ranked[:-1], beyond)))


def record_design() -> dict[str, Any]:
    """Which manoeuvre to run next, and which terms a model needs."""
    model, (one, two, _) = fitted("tables", LINEAR).model, trials()
    candidates: dict[str, Callable[[ShipModel], Trial]] = {
        "gentle": partial(
            zigzag,
            rudder_deg=5.0,
            heading_deg=3.0,
            duration=90.0,
            dt=1.0,
            must_reverse=False,
        ),
        "turn": partial(turning_circle, rudder_deg=30.0, duration=120.0, dt=1.0),
        "wild": run_away,
    }
    found: dict[str, Any] = {}
    asked: dict[str, dict[str, Any]] = {
        "c": {"number": 2},
        "D": {"criterion": "D", "number": 2},
        "E": {"criterion": "E"},
        "c_r": {"coefficient": "c_r"},
    }
    for name, options in asked.items():
        advice = advise(model, [one, two], candidates, **options)
        found[f"advice, {name}"] = [advice.to_dict(), str(advice)]
    silent = model.with_coefficients(
        np.where(np.arange(6) == 1, 0.0, list(model.coefficients.values()))
    )
    found["advice, silent"] = advise(silent, [one], candidates).to_dict()
    standard = standard_candidates(
        replace(model, steering=replace(model.steering, rudder_limit_deg=15.0))
    )
    run = standard["binary rudder 10"](model)
    found["standard"] = [[*standard], run.t[[1, -1]], np.abs(run["delta"]).max()]
    X, y = regression()
    names = [*"abcdef"]
    wide = X[:, [0, 1, 2, 3, 5]]
    reductions = {
        "backward": backward_elimination(X, y, names, 0.02, 0.15),
        "preferred": backward_elimination(X, y, names, 0.3, 0.0, ["e"]),
        "forward": forward_selection(X, y, names, 0.01),
        "two": forward_selection(wide, y, names[:5], 0.2, 2),
    }
    found |= {
        name: [made, str(made), made.terms, made.coefficients]
        for name, made in reductions.items()
    }
    both = np.column_stack([wide, 2.0 * wide[:, 0]])
    # f is twice a: which of the two is taken is a matter of rounding
    found["twice"] = [
        name.replace("f", "a") for name in forward_selection(both, y, names).terms
    ]
    short = partial(
        zigzag,
        rudder_deg=15.0,
        heading_deg=5.0,
        duration=60.0,
        dt=2.0,
        must_reverse=False,
    )
    found["sensitivity"] = sensitivity(model, short, 0.02)
    grown = model.with_coefficients(
        np.array(list((model.coefficients | {"c_r": 30.0}).values()))
    )
    found["no sensitivity"] = zigzag_sensitivity(grown)
    for direction in ("backward", "forward"):
        reduced = identify_reduced(
            [one, two],
            direction,
            0.01,
            structure="steering7",
            particulars=mariner().particulars,
            uncertainty=WITHOUT_ERROR,
        )
        found[f"reduced, {direction}"] = (
            reduced.to_dict()
            if direction == "backward"
            else [r.terms for r in reduced.reductions.values()]
        )
    found["refused"] = [
        refused(call)
        for call in (
            lambda: advise(model, [one], candidates, "F"),
            lambda: advise(model, [one], candidates, coefficient="x"),
            lambda: advise(model, [one], candidates, number=0),
            lambda: advise(model, [], candidates),
            lambda: advise(model, [one], {"wild": run_away}),
            lambda: backward_elimination(X, y[:3], names),
            lambda: backward_elimination(X[:9], y[:9], names),
            lambda: forward_selection(X * 0.0, y, names),
            lambda: forward_selection(X, y * np.nan, names),
            lambda: forward_selection(X, y * 0.0, names),
            lambda: sensitivity(model, short, 1.0),
            lambda: table_of(shipgym.load_model("kvlcc2")),
            lambda: forward_selection(X, y, names, -1.0),
            lambda: identify_reduced(
                [one], structure="nomoto2", particulars=mariner().particulars
            ),
        )
    ]
    return found


def run_away(_: ShipModel) -> Trial:
    """A manoeuvre that no ship survives."""
    raise UnstableModelError("gone", 3.0, {})


PARTS = Parts(
    {
        "formulas": record_formulas,
        "priors": record_priors,
        "guard": record_guard,
        "diagnostics": record_diagnostics,
        "selection": record_selection,
        "comparison": record_comparison,
        "design": record_design,
    },
    left_out=LEFT_OUT,
)
