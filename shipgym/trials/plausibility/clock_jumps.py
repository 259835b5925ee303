"""Clocks that were set forward while the ship went on."""

import numpy as np

from shipgym.arrays import Floats


def without_clock_jumps(t: Floats, x: Floats, y: Floats) -> tuple[Floats, list[str]]:
    """Times without the seconds by which the clock was set forward, and notes of them.

    Over such a gap a ship with way on has moved no farther than between any two rows;
    in a gap of the recording she sails on. `x` and `y` are positions in m.
    """
    if t.size < 20 or not np.isfinite(t + x + y).all():
        return t, []
    steps = np.diff(t)
    moved = np.hypot(np.diff(x), np.diff(y))
    usual = float(np.median(steps))
    shifts = np.zeros_like(t)
    notes = []
    longest_usual = max(5.0 * usual, 5.0)
    for row in np.flatnonzero(steps > longest_usual):
        first = max(int(row) - 10, 0)
        last = min(int(row) + 11, steps.size)
        before = np.arange(first, int(row))
        after = np.arange(int(row) + 1, last)
        around = np.concatenate([before, after])
        usual_moves = moved[around]
        speeds = usual_moves / steps[around]
        speed = float(np.median(speeds))
        as_usual = moved[row] < 2.0 * usual_moves.max()
        with np.errstate(over="ignore"):
            is_far_too_short = moved[row] < 0.2 * speed * steps[row]
        if speed < 1.0 or not as_usual or not is_far_too_short:
            continue
        surplus = float(steps[row]) - usual
        shifts[row + 1 :] += surplus
        notes.append(
            f"the clock was set forward by {surplus:.3g} s after {t[row]:.6g} s, as the"
            f" ship moved by {moved[row]:.2g} m meanwhile; that time is taken out"
        )
    return t - shifts, notes
