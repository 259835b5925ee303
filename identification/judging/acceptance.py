"""Limits of acceptance: the errors on held-out trials that a user allows."""

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

import numpy as np

from identification.judging.fit import Fit
from shipgym import InputError
from shipgym.checks import check_number, check_table, quoted


def indices_by_limit() -> dict[str, tuple[str, ...]]:
    """Limits by name, and the indices of a trial's metrics that each holds for."""
    return {
        "heading_deg": (),
        "overshoot_deg": ("overshoot_1_deg", "overshoot_2_deg"),
        "advance_lengths": ("advance_lengths",),
        "transfer_lengths": ("transfer_lengths",),
        "tactical_diameter_lengths": ("tactical_diameter_lengths",),
    }


def check_accept(accept: Any) -> None:
    """Refuse limits of acceptance that are no table of known names and numbers."""
    known = indices_by_limit()
    for name, limit in check_table(accept, "accept", known).items():
        check_number(limit, f"accept {name}", above=0.0)


def unaccepted(fit: Fit, accept: Mapping[str, float]) -> list[str]:
    """Why a model is not accepted, in words; empty where it is.

    `heading_deg` limits the root mean square error of the predicted heading, the others
    the error of an index, each on every held-out trial.

    Raises InputError for a limit of what no held-out trial has.
    """
    of_trials = fit.metrics["trials"]
    unseen = {
        name: metrics
        for name, metrics in of_trials.items()
        if metrics["use"] == "validate"
    }
    if not unseen:
        raise InputError(
            "accept: expected a held-out trial, on which the limits are judged, got"
            " none; mark one validate or name it by hold_out"
        )
    reasons = []
    for limit, most in accept.items():
        errors = {
            name: errors_of(metrics, limit)
            for name, metrics in unseen.items()
            if not metrics["diverged"]
        }
        is_known = any(errors.values())
        if not is_known and not any(one["diverged"] for one in unseen.values()):
            trials = quoted([PurePath(name).name for name in unseen])
            raise InputError(
                f"accept {limit}: expected held-out trials with this index, got"
                f" {trials}, which have none; hold out a manoeuvre that has it or leave"
                " the limit out"
            )
        for name, found in errors.items():
            for error in found:
                if error > most:
                    reasons.append(
                        f"{limit} is {error:.2g} on {PurePath(name).name}, more than"
                        f" {most:g}"
                    )
    for name, metrics in unseen.items():
        if metrics["diverged"]:
            reasons.append(f"it runs away on {PurePath(name).name}")
    return reasons


def errors_of(metrics: Mapping[str, Any], limit: str) -> list[float]:
    """Sizes of the errors on a trial that a limit holds for; none without the index."""
    if limit == "heading_deg":
        error = metrics["rmse"]["psi"]
        return [] if error is None else [float(np.degrees(error))]

    errors = []
    for index in indices_by_limit()[limit]:
        values = metrics[index] or {}
        measured = values.get("measured")
        if measured is None:
            continue
        predicted = values.get("predicted")
        is_reached = predicted is not None
        errors.append(abs(predicted - measured) if is_reached else np.inf)
    return errors
