"""Parts of a log that are trials: given stretches, or those between quiet rudders."""

from typing import Any

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_array
from shipgym.errors import InputError
from shipgym.trials.resampling import FEWEST_SAMPLES, Log, usual_step
from shipgym.trials.units import DEGREE

_SHORTEST = 30.0  # s, of a manoeuvre


def check_cut(cut: Any, where: str) -> None:
    """Refuse a cut that is neither "rudder" nor a list of pairs of numbers."""
    if cut != "rudder":
        check_array(cut, (None, 2), f'{where} cut (in seconds, if not "rudder")')


def cut_log(cut: Any, log: Log, where: str) -> list[slice]:
    """Samples of each part, in order of time; InputError for a part without samples."""
    stretches = cut
    if cut == "rudder":
        stretches = active_stretches(log.t, log.channels.get("delta"))
    if not stretches:
        raise InputError(
            f'{where} cut: expected with "rudder" manoeuvres, in which the rudder is'
            f" more than 3 deg from its usual place for over {_SHORTEST:g} s, got none;"
            " give the stretches, or read another log"
        )
    parts = []
    for first, last in stretches:
        begin = int(np.searchsorted(log.t, first))
        end = int(np.searchsorted(log.t, last, side="right"))
        if end - begin < FEWEST_SAMPLES:
            raise InputError(
                f"{where} cut: expected stretches of the log, which goes from"
                f" {log.t[0]:g} to {log.t[-1]:g} s, got {first} to {last}, which holds"
                " no trial"
            )
        parts.append(slice(begin, end))
    return parts


def kind_of(rudder: Floats, psi: Floats) -> str | None:
    """Manoeuvre of a part, by its rudder and heading, rad; None where they do not tell.

    In a turning circle the ship goes round by more than half a circle with the rudder
    held. In a zigzag the rudder is held to one side after the other and reversed each
    time that the heading has changed as much to that side.
    """
    size = np.abs(rudder)
    usual = np.percentile(size, 75)
    held = np.flatnonzero(size > 0.75 * usual)
    if usual < 3.0 * DEGREE:
        return None
    is_reversed = np.diff(np.sign(rudder[held])) != 0.0
    ends = [*held[:-1][is_reversed], held[-1]][:4]
    turned = np.sign(rudder[ends]) * (psi[ends] - psi[: held[0] + 1].mean())
    *reversals, _ = turned.tolist()
    if (
        size[: ends[0] + 1].max() > usual + 2.0 * DEGREE
    ):  # another manoeuvre goes before
        return None
    if turned[0] > np.pi:
        return "turning-circle"
    is_even = len(reversals) > 1 and np.ptp(reversals) < 0.3 * np.mean(reversals)
    return "zigzag" if is_even else None


def runs(t: Floats) -> list[list[float]]:
    """First and last time, s, of the parts of a log between long gaps."""
    is_gap = np.diff(t) > max(60.0, 20.0 * usual_step(t))
    parts = np.split(t, np.flatnonzero(is_gap) + 1)
    return [[float(one[0]), float(one[-1])] for one in parts if np.ptp(one) > _SHORTEST]


def active_stretches(t: Floats, delta: Floats | None) -> list[list[float]]:
    """Stretches from before a rudder leaves its usual place until it is quiet again.

    Time, s, and rudder, rad, of shape (n_samples,); none without a rudder.
    """
    if delta is None:
        return []
    largest_swing = 3.0 * DEGREE  # of a rudder that is at its usual place
    longest_pause = 60.0  # s, within a manoeuvre
    margin = 30.0  # s, before and after
    active = t[np.abs(delta - np.median(delta)) > largest_swing]
    ends = np.flatnonzero(np.diff(active) > longest_pause) + 1
    return [
        [float(one[0]) - margin, float(one[-1]) + margin]
        for one in np.split(active, ends)
        if one.size and np.ptp(one) > _SHORTEST
    ]
