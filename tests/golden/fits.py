"""Golden section `fits`: whole identifications of two short trials, by every structure, method and option."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from sklearn.linear_model import Ridge

from identification import IdentificationResult, MultiInnovationLeastSquares, identify
from identification.report.page import report_page
from identification.validation.warnings import (
    held_out_error,
    model_warnings,
    undetermined,
    why_unstable,
)
from shipgym import SteeringGear, Trial
from shipgym.manoeuvres import turning_circle
from tests.golden.made_up import (
    asked,
    mariner,
    noisy,
    packed,
    refused,
    trials,
    words_of,
)
from tests.golden.regression import clean_zigzag, logs
from tests.golden.store import Floats

#: Searches and refinements stop early, by what is simulated.
TOLERANCES = {"": 1e-5}
#: Parts of names of what depends on the run, or on the last bit of a sample.
LEFT_OUT = ("sha256", "software", "version", "settings")
GEAR = SteeringGear(38.0, 3.1, 0.0)

LINEAR = "linear-steering"
#: By case the identifications in it: trials, structure, and the other arguments of
#: `identify`.
ASKED: Mapping[str, Mapping[str, tuple[str, str, Mapping[str, Any]]]] = {
    "yaw alone": {
        "nomoto": ("with shaft", "nomoto", {}),
        "norrbin": (
            "noisy",
            "norrbin",
            {
                "window": 4,
                "samples": "euler",
                "method": "svr",
                "epsilon": 0.2,
                "C": 3.0,
            },
        ),
        "nomoto2": ("noisy", "nomoto2", {"window": 6, "samples": "integral"}),
    },
    "tables": {
        name: ("with shaft", name, {})
        for name in (LINEAR, "steering7", "abkowitz", "cubic")
    },
    "full table": {
        "full": ("noisy", "abkowitz-full", {"guarded": False, "method": "ridge"})
    },
    "clean": {
        "spline": ("clean", "abkowitz", {"steering": GEAR, "name": "mine"}),
        "weak": (
            "clean",
            "steering7",
            {"method": "ls-svm", "C": 7.0, "scale": False, "preprocessing": "none"},
        ),
    },
    "regularised": {
        "ridge": (
            "noisy",
            "steering7",
            {"method": "ridge", "alpha": 0.02, "robust": True},
        ),
        "rank": ("noisy", "steering7", {"rank": 3, "preprocessing": "savgol"}),
        "gcv": ("noisy", "steering7", {"selection": "gcv", "C": 1e4, "robust": True}),
    },
    "searched": {
        "free-running": (
            "noisy",
            "nomoto",
            {
                "method": "cv-lssvr",
                "objective": "free-running",
                "window": 5,
                "bounds": (1.0, 1e6),
                "optimiser": {"name": "grid", "points": 4, "refinements": 0},
            },
        ),
        "trials": (
            "noisy",
            LINEAR,
            {
                "method": "pso-lssvr",
                "folds": "trials",
                "seed": 3,
                "optimiser": {"name": "pso", "particles": 3, "rounds": 3},
            },
        ),
        "training": (
            "noisy",
            "steering7",
            {
                "method": "abc-lssvr",
                "objective": "training",
                "seed": 2,
                "optimiser": {"name": "abc", "sources": 3, "rounds": 2},
            },
        ),
    },
    "recursive": {
        "rls": (
            "noisy",
            LINEAR,
            {"method": "rls", "forgetting": 0.99, "start_samples": 9},
        ),
        "nisg": ("noisy", LINEAR, {"method": "nisg", "omega": 0.7}),
        "mils": ("noisy", LINEAR, {"method": "mils", "innovations": 3}),
        "object": ("noisy", LINEAR, {"method": MultiInnovationLeastSquares(C=1e5)}),
        "ridge": ("noisy", LINEAR, {"method": Ridge(1e-4)}),
    },
    "refined": {
        "offsets": (
            "noisy",
            LINEAR,
            {
                "method": "output-error",
                "rudder_offsets": True,
                "staggered": False,
                "segment_lengths": 2.3,
                "pull": 1e-3,
                "uncertainty": "bootstrap",
            },
        ),
        "measured": (
            "all",
            LINEAR,
            {"method": "output-error", "segment_start": "measured"},
        ),
        "others": (
            "noisy",
            "nomoto",
            {
                "method": "output-error",
                "extra_trials": (),
                "extra_weight": 0.3,
                "segment_lengths": 5.0,
                "anchor": "tanker",
                "anchor_weight": 0.02,
            },
        ),
        "unstable": ("noisy", "abkowitz", {"method": "output-error", "guarded": False}),
    },
    "priors": {
        "ship": ("noisy", LINEAR, {"prior": "tanker", "prior_strength": 0.03}),
        "clarke": (
            "noisy",
            LINEAR,
            {"prior": "clarke", "prior_folds": "largest-rudder"},
        ),
        "kijima": (
            "noisy",
            "steering7",
            {"prior": "kijima", "prior_strength": float("inf")},
        ),
        "chosen": ("noisy", LINEAR, {"prior": "auto", "method": "ls"}),
    },
    "grey boxes": {
        "rm-svm": (
            "with shaft",
            "grey-box",
            {"method": "rm-svm", "reference_model": "tanker"},
        ),
        "given": (
            "noisy",
            "grey-box",
            {
                "method": "rm-svm",
                "reference_model": "mariner",
                "C": 0.3,
                "objective": "correlation",
                "free_constant": True,
                "folds": "largest-rudder",
            },
        ),
        "ls-svm": (
            "noisy",
            "grey-box",
            {
                "method": "rm-svm",
                "regression": "ls-svm",
                "epsilon": 0.1,
                "reference_model": "auto",
                "C": 0.0,
            },
        ),
        "by ls": ("noisy", "grey-box", {"method": "ls", "reference_model": "kvlcc2"}),
    },
    "kernel": {
        "black box": (
            "clean",
            "abkowitz",
            {"kernel": "rbf", "centres": 6, "kernel_length": 1.3, "C": 40.0},
        ),
        "chosen": (
            "noisy",
            "abkowitz",
            {
                "kernel": "rbf",
                "centres": 6,
                "reference_model": "tanker",
                "kernel_length": 2.0,
                "method": "rm-svm",
                "folds": "largest-rudder",
            },
        ),
    },
    "mmg": {
        "formulas": ("with shaft", "mmg", {"prior_strength": 1.5}),
        "ship": ("with shaft", "mmg", {"reference_model": "kvlcc2"}),
    },
    "uncertainty": {
        "bootstrap": (
            "noisy",
            LINEAR,
            {"uncertainty": "bootstrap", "model_error": False},
        ),
        "three": ("all", LINEAR, {"repair": True, "preprocessing": "median"}),
        "three, ls": ("all", "abkowitz", {"method": "ls", "guarded": False}),
        "one": ("clean", LINEAR, {"uncertainty": "bootstrap", "method": "rls"}),
    },
    "sea": {
        "current": ("logs", LINEAR, {}),
        "given": (
            "logs",
            "linear",
            {"current": {"north": 0.3, "east": -0.4}, "wind": "constant"},
        ),
        "derived": ("derived", LINEAR, {"current": "none", "hold_out": ["logs/0"]}),
    },
    "wrong": {
        "port": ("to port", "nomoto", {}),
        "shaft": ("varying shaft", "linear", {}),
        "gradient": ("noisy", "abkowitz", {"method": "sg", "forgetting": 0.9}),
        "estimated": (
            "noisy",
            "abkowitz",
            {
                "particulars": {
                    "length": 160.9,
                    "beam": 23.2,
                    "draught": 7.5,
                    "block_coefficient": 0.6,
                }
            },
        ),
    },
}


@cache
def records(name: str) -> tuple[Trial, ...]:
    """Trials by what they are for."""
    one, two, held = trials()
    if name == "with shaft":
        return tuple(
            t.with_channels({"n": 1.3 + 0.01 * np.sin(t.t / 40.0)}) for t in trials()
        )
    if name == "varying shaft":
        return tuple(
            t.with_channels(
                {
                    "n": np.linspace(1.0, 1.4, len(t)),
                    "u": t["u"] * np.linspace(0.3, 1.1, len(t)),
                }
            )
            for t in (one, two)
        )
    if name == "clean":
        turn = turning_circle(mariner(), 25.0, 240.0, 1.0)
        return clean_zigzag(), noisy(
            turn, 7, every=2, noise=0.2, name="runs/turn", use="validate"
        )
    if name == "all":
        return one, two, held.with_(use="fit")
    if name == "to port":
        return tuple(t.with_channels({"delta": -t["delta"]}) for t in (one, held))
    if name == "derived":
        return tuple(
            Trial(
                t.t, t.channels, name=t.name, kind=t.kind, use="fit", derived=("u", "v")
            )
            for t in logs()
        )
    return logs() if name == "logs" else (one, two, held)


@cache
def fitted(case: str, name: str) -> IdentificationResult:
    """One of the identifications."""
    which, structure, options = ASKED[case][name]
    particulars = replace(mariner().particulars, rudder_area=14.9)
    given = {"particulars": particulars, "hold_out": (), **options}
    if "extra_trials" in options:
        given["extra_trials"] = [records("all")[2]]
    return identify(list(records(which)), structure, **asked(given))


#: Cases of which the warnings are kept: they linearise many ships drawn from the
#: covariance.
WARNED = ("tables", "refined", "sea", "wrong")
SHOWN = ("speed", "mass", "Y_vdot", "N_rdot", "xg")


@cache
def told(case: str, name: str) -> dict[str, Any]:
    """All numbers of a fit, and what is said of it."""
    fit = fitted(case, name)
    return {
        "coefficients": fit.coefficients,
        "errors": fit.standard_errors,
        "metrics": fit.metrics,
        "provenance": fit.model.provenance,
        "diagnostics": fit.diagnostics,
        "searches": fit.searches,
        "gear": fit.model.steering,
        "envelope": fit.model.envelope,
        "particulars": {name: fit.model.particulars[name] for name in SHOWN},
        "said": [*undetermined(fit), held_out_error(fit), why_unstable(fit) or ""],
        "warnings": model_warnings(fit) if case in WARNED else [],
    }


#: Fits whose summary, and those whose page, is kept in words.
SUMMARISED = {
    "tables": "abkowitz",
    "grey boxes": "rm-svm",
    "sea": "current",
    "kernel": "chosen",
    "recursive": "nisg",
}
PAGES = {"grey boxes": "rm-svm", "sea": "current"}


def page(case: str) -> str:
    """The page of a fit of a case."""
    return report_page(fitted(case, PAGES[case]))


def bare() -> list[str]:
    """What is said of a grey box that adds nothing to its reference ship."""
    fit = fitted("grey boxes", "given")
    model = replace(fit.model, coefficients=dict.fromkeys(fit.coefficients, 0.0))
    return model_warnings(replace(fit, model=model))


def refusals() -> list[str]:
    """What `identify` refuses, a line each."""
    one, two, held = trials()
    still = one.with_channels({"delta": np.full(len(one), 0.01)})
    twice = Trial(np.append(one.t[:-1], one.t[-2] + 1e-6), one.channels, name="twice")
    short, stopped = (
        one.part(slice(0, 12)),
        one.with_channels({"u": np.zeros(len(one)), "v": np.zeros(len(one))}),
    )
    no_v = Trial(one.t, {name: one[name] for name in ("u", "r", "delta")}, name="no v")
    length = {"length": 160.9, "speed": 7.7}
    wrong: dict[str, tuple[list[Any], dict[str, Any]]] = {
        "still": ([still], {}),
        "twice": ([twice], {}),
        "short": ([short], {"window": 1}),
        "none": ([held], {}),
        "channel": ([no_v], {}),
        "speed": ([no_v], {"structure": "cubic"}),
        "rest": ([stopped], {"particulars": {"length": 9.0}}),
        "nothing": ([one], {"particulars": None}),
        "little": ([one], {"particulars": length}),
        "steering": ([one], {"steering": 3.0}),
        "option": ([one], {"rang": 3}),
        "setting": ([one], {"alpha": 3.0}),
        "captive": ([one], {"structure": "pmm18"}),
        "reference": ([one], {"reference_model": "tanker"}),
        "no reference": ([one], {"structure": "grey-box"}),
        "svm": ([one], {"method": "rm-svm"}),
        "prior": (
            [one],
            {"structure": "grey-box", "reference_model": "tanker", "prior": "tanker"},
        ),
        "formula": ([one], {"structure": "nomoto", "prior": "clarke"}),
        "strength": ([one], {"prior": "tanker", "prior_strength": -1.0}),
        "folds": ([one, two], {"prior": "tanker", "prior_folds": "blocks"}),
        "kernel": ([one], {"kernel": "poly"}),
        "kernel method": ([one], {"kernel": "rbf", "method": "ls"}),
        "kernel regression": ([one], {"kernel": "rbf", "epsilon": 0.1}),
        "centres": ([one], {"kernel": "rbf", "centres": 1}),
        "mmg method": ([one], {"structure": "mmg", "method": "ls"}),
        "mmg setting": ([one], {"structure": "mmg", "C": 3.0}),
        "mmg prior": (
            [one],
            {"structure": "mmg", "prior": "yoshimura", "reference_model": "kvlcc2"},
        ),
        "mmg wind": (
            list(records("with shaft")),
            {"structure": "mmg", "wind": "constant"},
        ),
        "memory": (
            [clean_zigzag()],
            {"structure": "nomoto2", "method": "output-error"},
        ),
        "extra": (
            [one],
            {
                "structure": "cubic",
                "method": "output-error",
                "extra_trials": [no_v],
                "service_shaft_speed": 1.3,
            },
        ),
        "segments": ([one], {"method": "output-error", "segment_lengths": 0.01}),
        "uncertainty": ([one], {"uncertainty": "x"}),
        "start": ([one], {"method": "output-error", "segment_start": "x"}),
        "pull": ([one], {"method": "output-error", "pull": -1.0}),
        "largest": (
            [one, one.with_(name="again")],
            {"prior": "tanker", "prior_folds": "largest-rudder"},
        ),
        "rest, shaft": (
            [records("with shaft")[0].with_channels({"n": np.zeros(len(one))})],
            {"structure": "cubic"},
        ),
        "never": (
            [one.with_channels({"r": np.zeros(len(one))})],
            {"structure": "nomoto"},
        ),
    }
    usual = {"particulars": mariner().particulars}
    return [
        f"{name}: {refused(lambda t=given, o=options: identify(t, **asked({**usual, **o})))}"
        for name, (given, options) in wrong.items()
    ]


def cases() -> Iterable[str]:
    """Groups of identifications."""
    return ASKED


def record(case: str) -> dict[str, Floats]:
    """The numbers of a group."""
    return {
        f"{name}: {part}": packed(content, LEFT_OUT)
        for name in ASKED[case]
        for part, content in told(case, name).items()
    }


def texts(case: str) -> str:
    """The texts of a group."""
    lines = [
        line
        for name in ASKED[case]
        for line in words_of(told(case, name), name, LEFT_OUT)
    ]
    lines += [fitted(case, SUMMARISED[case]).summary()] if case in SUMMARISED else []
    return "\n".join(lines + (bare() if case == "grey boxes" else []))
