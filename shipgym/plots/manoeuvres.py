"""Figures of the standard manoeuvres, each with what its indices are read from."""

from collections.abc import Callable
from typing import Any

import numpy as np

from shipgym.errors import InputError
from shipgym.manoeuvres.execution import distance_sailed, rudder, ship_length
from shipgym.manoeuvres.pull_outs import pull_out_indices
from shipgym.manoeuvres.spirals import Spiral, spiral_indices, turning_point
from shipgym.manoeuvres.turning import track_from_order, turning_indices
from shipgym.manoeuvres.zigzags import switch_heading_deg
from shipgym.plots.style import (
    LIMIT,
    MEASURED,
    MODEL,
    MUTED,
    PALETTE,
    Figure,
    Panel,
    axis,
    line,
    panels,
)
from shipgym.plots.trials import AXES, history_figure, quantity, thinned
from shipgym.trials.trial import Trial

ORDERS = ("delta_command", "delta", "n_command", "n")


def zigzag_figure(trial: Trial, height: int = 320) -> Figure:
    """A zigzag in the usual form: heading change and rudder over time, with the switch headings.

    Of a trial with psi and delta; height in pixels.
    """
    heading = np.degrees(trial["psi"] - trial["psi"][0])
    hover, dotted = (
        {"hovertemplate": "%{y:.2f} deg"},
        {"line_dash": "dot", "hoverinfo": "skip"},
    )
    lines = [
        line(trial.t, heading, "heading change", MODEL, 2.0, **hover),
        line(trial.t, np.degrees(trial["delta"]), "rudder", MUTED, 1.4, **hover),
    ]
    if (switch := switch_heading_deg(trial)) is not None:
        ends = trial.t[[0, -1]]
        lines += [
            line(ends, [at] * 2, "switch heading", LIMIT, 1.1, **dotted)
            for at in (switch, -switch)
        ]
    return panels(
        [Panel(lines, "time, s", axis("heading change and rudder, deg", zero=True))],
        height,
    )


def turning_figure(
    trial: Trial, length: float | None = None, height: int = 480
) -> Figure:
    """A turning circle seen from above, with advance, transfer and tactical diameter marked.

    In ship lengths, from the position and along the heading at which the rudder was
    ordered. The trial has x, y, psi, u, v, r and delta (or delta_command); `length` is
    that between perpendiculars, m, by default the trial's own. Raises InputError if a
    channel or the length is missing.
    """
    indices, lpp = turning_indices(trial, length), ship_length(trial, length)
    ahead, aside, turned = track_from_order(trial, lpp)
    side = 1.0 if turned[-1] >= 0.0 else -1.0
    lines = [line(aside, ahead, "path", MODEL, 2.0)]
    advance, transfer = indices.advance_lengths, indices.transfer_lengths
    if advance is not None and transfer is not None:
        far = side * transfer
        lines += [
            _dimension(
                [far, far], [0.0, advance], f"advance {advance:.2f} L", PALETTE[1]
            ),
            _dimension(
                [0.0, far], [advance, advance], f"transfer {transfer:.2f} L", PALETTE[2]
            ),
        ]
    if (diameter := indices.tactical_diameter_lengths) is not None:
        level, name = (
            float(np.interp(np.pi, side * turned, ahead)),
            f"tactical diameter {diameter:.2f} L",
        )
        lines.append(
            _dimension([0.0, side * diameter], [level, level], name, PALETTE[3])
        )
    ahead_axis = axis("ahead, ship lengths", zero=True, scaleanchor="x", scaleratio=1)
    seen = Panel(lines, axis("to starboard, ship lengths", zero=True), ahead_axis)
    return panels([seen], height, hovermode="closest")


def _dimension(x: list[float], y: list[float], name: str, colour: str) -> Any:
    """A measured length as a line with bars at both ends."""
    across = "line-ew" if x[0] == x[1] else "line-ns"
    mark = {"symbol": across, "size": 11, "line": {"width": 1.6, "color": colour}}
    return line(x, y, name, colour, 1.5, "lines+markers", marker=mark, hoverinfo="name")


def spiral_figure(spiral: Spiral, height: int = 420) -> Figure:
    """Yaw rate over rudder angle of a spiral, with the width of its loop; a direct one in two lines."""
    angles, rates = spiral.rudder_deg, spiral.yaw_rate_deg_s
    points = {"marker": {"size": 5}, "hovertemplate": "%{x:.2f} deg, %{y:.3f} deg/s"}
    ways = {"reverse spiral": (slice(None), MODEL)}
    if spiral.method == "direct":
        turn = turning_point(angles)
        ways = {
            "there": (slice(0, turn + 1), MODEL),
            "and back": (slice(turn, None), PALETTE[1]),
        }
    lines = [
        line(angles[part], rates[part], name, colour, 1.6, "lines+markers", **points)
        for name, (part, colour) in ways.items()
    ]
    try:
        indices = spiral_indices(spiral)
        width, middle = indices.loop_width_deg, indices.loop_middle_deg
    except InputError:  # turns to one side only have no loop to mark
        width = middle = 0.0
    step = float(np.abs(np.diff(angles)).min()) if spiral.method == "direct" else 0.0
    if width > step:
        ends, name = (
            [middle - width / 2, middle + width / 2],
            f"loop, {width:.2f} deg wide",
        )
        lines.append(line(ends, [0.0, 0.0], name, LIMIT, 2.6, hoverinfo="name"))
    axes = axis("rudder, deg", zero=True), axis("yaw rate, deg/s", zero=True)
    return panels([Panel(lines, *axes)], height, hovermode="closest")


def pull_out_figure(trials: dict[str, Trial], height: int = 340) -> Figure:
    """Yaw rate of pull-outs over the time since the rudder was put amidships; those of a stable ship meet.

    The trials, usually one from each side, by the label of their line. InputError if
    one has no pull-out.
    """
    lines = []
    for (name, trial), colour in zip(trials.items(), PALETTE, strict=False):
        left = pull_out_indices(trial).residual_rate_deg_s
        angle = np.abs(rudder(trial))
        release = trial.t[int(np.flatnonzero(angle > 0.5 * angle.max())[-1]) + 1]
        part = thinned(trial)
        residual = f"{name}: {left:.3f} deg/s left"
        lines.append(
            line(
                trial.t[part] - release, np.degrees(trial["r"][part]), residual, colour
            )
        )
    time_axis = axis("time since the rudder was put amidships, s", zero=True)
    return panels([Panel(lines, time_axis, axis("yaw rate, deg/s", zero=True))], height)


def speed_figure(
    trial: Trial, length: float | None = None, height: int = 380
) -> Figure:
    """A stop or an acceleration: surge speed and shaft over time, and speed over the distance sailed.

    The trial has u and v, and n where the ship has a shaft; `length` as in
    `turning_figure`.
    """
    sailed = distance_sailed(trial) / ship_length(trial, length)
    part = thinned(trial)
    t, u, shaft = trial.t[part], trial["u"][part], quantity(trial, "n")
    speed_axis, plain = axis(AXES["u"][0], zero=True), axis(zero=True)
    shown = [
        Panel(
            [line(sailed[part], u, "surge speed", MODEL)],
            "distance sailed, ship lengths",
            speed_axis,
        ),
        Panel([line(t, u, "surge speed", MODEL)], "time, s", plain),
    ]
    if shaft is not None:
        turned = line(t, shaft[part], "shaft", MEASURED)
        shown.append(Panel([turned], "time, s", axis(AXES["n"][0], zero=True)))
    return panels(
        shown,
        height,
        len(shown),
        grid={"horizontal_spacing": 0.09},
        hovermode="closest",
    )


def excitation_figure(trial: Trial) -> Figure:
    """A manoeuvre for identification, such as `prbs_rudder`: orders above the ship's response."""
    orders = [
        name for name in ORDERS if name in trial.channels and np.ptp(trial[name]) > 0.0
    ]
    figure = history_figure(
        {"simulated": trial}, (*orders, "psi", "r", "speed", "drift")
    )
    figure.update_layout(showlegend=False)
    return figure


def manoeuvre_figure(sailed: Trial | Spiral) -> Figure:
    """The figure that suits a measured or simulated manoeuvre by its kind; else time histories.

    Raises InputError if a channel or the ship's length is missing.
    """
    if isinstance(sailed, Spiral):
        return spiral_figure(sailed)
    if sailed.kind == "pull-out":
        return pull_out_figure({sailed.name: sailed})
    known: dict[str | None, Callable[[Trial], Figure]] = {
        "zigzag": zigzag_figure,
        "turning-circle": turning_figure,
        "straight": speed_figure,
        "random": excitation_figure,
    }
    if sailed.kind in known:
        return known[sailed.kind](sailed)
    return history_figure(
        {sailed.name: sailed}, ("psi", "delta", "r", "speed", "drift")
    )
