"""Refusals of trials that cannot identify a structure: channels, samples, motion."""

from collections.abc import Sequence

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from identification.samples import preprocess
from identification.samples.samples import Samples
from shipgym import InputError, Trial
from shipgym.ships import Structure


def check_trials(trials: Sequence[Trial], structure: Structure) -> None:
    """Refuse trials from which a structure cannot be identified.

    There are none, one lacks a channel, or no rudder ever moves.
    """
    if structure.captive:
        raise InputError(
            "structure: expected one for free-running trials, got"
            f" '{structure.name}', whose added masses only captive tests tell; choose"
            " another, such as 'abkowitz'"
        )
    if not trials:
        raise InputError(
            'trials: expected at least one that is marked use = "fit", got none; mark'
            " the trials to identify from"
        )
    for trial in trials:
        _check_channels(trial, structure)
    if structure.has_rudder and all(map(is_still, trials)):
        angle = np.degrees(np.median(trials[0]["delta"]))
        raise InputError(
            f"trial {trials[0].name!r}: expected a rudder that moves, got one that"
            f" stays at {angle:.2f} deg throughout; nothing is excited and these"
            " coefficients cannot be identified: add a trial in which the rudder moves,"
            " such as a zigzag"
        )


def _check_channels(trial: Trial, structure: Structure) -> None:
    needed = structure.required_channels
    for channel in needed:
        if channel in trial:
            continue
        hint = ""
        if channel == "u":
            hint = "; nomoto, norrbin and nomoto2 take the speed of [ship]"
        raise InputError(
            f"trial {trial.name!r}: channel {channel!r} is missing, structure"
            f" {structure.name!r} needs {', '.join(needed)}; name its column, or"
            f' leave the trial out (use = "skip"){hint}'
        )


def is_still(trial: Trial) -> bool:
    """Tell whether a rudder does nothing but scatter.

    Its running median over five samples, in which shorter excursions are outliers,
    moves by less than half a degree, or six times the noise up to 3 degrees.
    """
    delta = trial["delta"]
    windows = sliding_window_view(delta, min(5, len(delta)))
    moved = np.degrees(
        np.ptp(
            np.median(
                windows,
                axis=1,
            )
        )
    )
    scatter = np.degrees(6.0 * preprocess.noise_level(trial.t, delta))
    return bool(moved < max(0.5, min(scatter, 3.0)))


def check_samples(
    samples: Samples, trials: Sequence[Trial], structure: Structure
) -> None:
    """Refuse too few rows for the terms, and a motion that never changes."""
    motions = {"u": "surge speed", "v": "sway speed", "r": "yaw rate", "p": "roll rate"}
    for q, change in samples.targets.items():
        if not np.any(change):
            motion = motions.get(q, q)
            first = trials[0].name
            n_trials = len(trials)
            raise InputError(
                f"trial {first!r}: expected the {motion} to be"
                f" excited and measured, got a channel {q!r} that never changes, in"
                f" none of the {n_trials} trials to fit; leave the column out if it"
                " was not measured, or choose a structure without that equation"
            )
    terms = max(len(structure.regression_names(q)) for q in structure.regressed)
    if len(samples) <= terms:
        shortest = min(trials, key=len)
        raise InputError(
            f"trial {shortest.name!r}: expected several times as many samples as the"
            f" {terms} coefficients of an equation, got {len(shortest)}, in all"
            f" {len(samples)} rows; add trials, longer or sampled more often"
        )
