import json
from itertools import pairwise

import numpy as np
import pytest

from shipgym import InputError, Trial, load_model
from shipgym.manoeuvres import (
    Spiral,
    prbs_rudder,
    standard_manoeuvres,
    turning_circle,
    turning_indices,
    zigzag,
)
from shipgym.plots import (
    excitation_figure,
    history_figure,
    manoeuvre_figure,
    path_figure,
    spiral_figure,
    turning_figure,
    zigzag_figure,
)
from shipgym.plots.style import (
    MEASURED,
    PALETTE,
    Panel,
    line_styles,
    panels,
    points,
    translucent,
)
from shipgym.plots.trials import CHANNEL_AXES, thinned

DERIVED = ("speed", "drift")  # channels that u and v give


def values(figure, axis, trace=0):
    return np.asarray(figure.data[trace][axis], dtype=float)


@pytest.fixture(scope="module")
def circle():
    return turning_circle(load_model("mariner"), duration=300.0, dt=1.0)


def test_angles_are_drawn_in_degrees_and_speeds_in_metres_per_second(circle):
    figure = history_figure({"predicted": circle}, ["psi", "u"])
    assert values(figure, "y", 0) == pytest.approx(np.degrees(circle["psi"]), rel=1e-6)
    assert values(figure, "y", 1) == pytest.approx(circle["u"], rel=1e-6)
    assert figure.layout.yaxis.title.text == "heading, deg"
    assert figure.layout.yaxis2.title.text == "surge, m/s"
    assert figure.layout.xaxis2.title.text == "time, s"


def test_measured_lines_are_dark_and_lines_share_one_entry_of_the_legend(circle):
    figure = history_figure(
        {"measured": circle, "predicted": circle}, ["psi", "r", "u"]
    )
    assert [trace.showlegend for trace in figure.data] == [
        True,
        True,
        False,
        False,
        False,
        False,
    ]
    assert {trace.line.color for trace in figure.data if trace.name == "measured"} == {
        "#1f2a37"
    }


def test_every_channel_is_drawn_in_its_unit():
    t = np.arange(4000.0)  # so many that not all are drawn
    channels = {
        name: 0.01 * (k + 1.0) + 1e-5 * t
        for k, name in enumerate(CHANNEL_AXES)
        if name not in DERIVED
    }
    figure = history_figure({"run": Trial(t, channels)}, [*CHANNEL_AXES])
    factors = [values(figure, "y", k)[0] / (0.01 * (k + 1.0)) for k in (0, 2)]
    assert factors == pytest.approx([1.0, np.degrees(1.0)], rel=1e-6)


def test_titles_of_axes_stand_below_the_last_row_and_beside_the_first_column():
    shown = [Panel([], f"x {k}", f"y {k}", f"panel {k}") for k in range(5)]
    figure = panels(shown, 400, 2, outer=True)
    below = [figure.layout[f"xaxis{k or ''}"].title.text for k in ("", 2, 3, 4, 5)]
    beside = [figure.layout[f"yaxis{k or ''}"].title.text for k in ("", 2, 3, 4, 5)]
    assert below == ["", "", "", "", "x 4"]
    assert beside == ["y 0", "", "y 2", "", "y 4"]


def test_a_channel_that_no_trial_has_is_left_out(circle):
    figure = history_figure({"predicted": circle}, ["psi", "n"])
    assert len(figure.data) == 1


def test_without_any_of_the_channels_there_is_no_figure(circle):
    with pytest.raises(InputError, match="any of the channels n, phi, got none"):
        history_figure({"predicted": circle}, ["n", "phi"])


def test_a_path_has_north_up_and_one_scale(circle):
    figure = path_figure({"turn": circle, "measured": circle})
    assert values(figure, "x") == pytest.approx(circle["y"], abs=1e-3)
    assert values(figure, "y") == pytest.approx(circle["x"], abs=1e-3)
    assert figure.layout.yaxis.scaleanchor == "x"


def test_a_trial_without_position_has_no_path():
    trial = Trial([0.0, 1.0, 2.0], {"psi": [0.0, 0.1, 0.2]})
    with pytest.raises(InputError, match="channels x and y"):
        path_figure({"run": trial})


def test_a_zigzag_is_drawn_as_the_change_of_heading_with_its_rudder():
    run = zigzag(load_model("mariner"), 20.0, 20.0, duration=200.0, dt=1.0)
    figure = zigzag_figure(run)
    assert values(figure, "y", 0)[0] == 0.0
    assert values(figure, "y", 1).max() == pytest.approx(20.0, abs=0.1)


def test_figures_hold_single_precision(circle):
    field = json.loads(path_figure({"turn": circle}).to_json())["data"][0]["x"]
    assert field["dtype"] == "f4"


def test_without_plotly_the_message_says_what_to_install(monkeypatch, circle):
    monkeypatch.setitem(__import__("sys").modules, "plotly.graph_objects", None)
    with pytest.raises(InputError, match=r"pip install 'shipgym\[report\]'"):
        path_figure({"turn": circle})


def test_a_turning_circle_is_drawn_with_its_indices():
    trial = turning_circle(load_model("mariner"), -35.0, dt=1.0)
    indices, figure = turning_indices(trial), turning_figure(trial)
    marks = {trace.name.rsplit(" ", 2)[0]: trace for trace in figure.data}
    assert np.ptp(np.asarray(marks["advance"].y, dtype=float)) == pytest.approx(
        indices.advance_lengths
    )
    assert np.ptp(np.asarray(marks["transfer"].x, dtype=float)) == pytest.approx(
        indices.transfer_lengths
    )
    diameter = np.asarray(marks["tactical diameter"].x, dtype=float)
    assert diameter.min() == pytest.approx(-indices.tactical_diameter_lengths)


def test_the_loop_of_a_spiral_is_marked_where_it_is():
    t = np.arange(3.0)
    trial = Trial(t, {"delta": t, "r": t})
    spiral = Spiral(
        trial,
        np.array([10, 3, 1, -5, 1, 3, 10.0]),
        np.array([1, 0.5, -0.5, -1, -0.7, 0.5, 1.0]),
        "direct",
    )
    wide = Spiral(
        trial,
        np.array([10, 1, -1, -10, 1, 5, 10.0]),
        np.array([1, 0.5, -0.5, -1, -0.7, 0.7, 1.0]),
        "direct",
    )
    assert [trace.name for trace in spiral_figure(spiral).data] == ["there", "and back"]
    loop = spiral_figure(wide).data[-1]
    assert loop.name == "loop, 3.00 deg wide"
    assert values(spiral_figure(wide), "x", 2) == pytest.approx([0.0, 3.0])


def test_every_manoeuvre_has_its_figure():
    ship = load_model("tanker")
    axes = {
        "zigzag 20/20, port first": "heading change and rudder, deg",
        "turning circle 35 deg to port": "ahead, ship lengths",
        "reverse spiral": "yaw rate, deg/s",
        "pull-out from port": "yaw rate, deg/s",
        "crash stop": "surge, m/s",
        "acceleration": "surge, m/s",
    }
    known = standard_manoeuvres(ship)
    for name, title in axes.items():
        figure = manoeuvre_figure(known[name].sail(ship))
        assert figure.layout.yaxis.title.text == title
    excited = excitation_figure(prbs_rudder(ship, duration=200))
    assert excited.layout.yaxis.title.text == "rudder order, deg"


def test_speed_and_drift_follow_from_surge_and_sway(circle):
    figure = history_figure({"turn": circle}, ["speed", "drift"])
    assert values(figure, "y", 0) == pytest.approx(
        np.hypot(circle["u"], circle["v"]), rel=1e-6
    )
    assert (
        values(figure, "y", 1)[-1] > 0.0
    )  # in a turn to starboard the ship moves to port of her heading


def test_a_turn_to_starboard_has_its_marks_to_starboard(circle):
    indices, figure = turning_indices(circle), turning_figure(circle)
    x = {
        trace.name.rsplit(" ", 2)[0]: np.asarray(trace.x, dtype=float)
        for trace in figure.data
    }
    assert x["advance"] == pytest.approx(np.full(2, indices.transfer_lengths))
    assert x["transfer"] == pytest.approx([0.0, indices.transfer_lengths])
    assert x["tactical diameter"] == pytest.approx(
        [0.0, indices.tactical_diameter_lengths]
    )


def test_a_turn_that_ends_early_is_drawn_without_marks(circle):
    short = turning_figure(circle.part(slice(0, 30)).with_(length=circle.length))
    assert [trace.name for trace in short.data] == ["path"]


def test_fifteen_hundred_samples_of_a_line_are_drawn_at_most():
    assert [thinned(range(n)).step for n in (3, 1500, 1501, 3000, 3001)] == [
        1,
        1,
        2,
        2,
        3,
    ]


def test_lines_beyond_the_palette_begin_with_it_again():
    labels = [f"run {k}" for k in range(len(PALETTE) + 1)]
    styles = line_styles([*labels[:1], "measured", *labels[1:]])
    assert [styles[label]["colour"] for label in labels] == [*PALETTE, PALETTE[0]]
    assert styles["measured"] == {"colour": MEASURED, "width": 1.5}
    assert {styles[label]["width"] for label in labels} == {2.0}
    assert translucent("#1d70b8", 0.25) == "rgba(29,112,184,0.25)"


def test_rows_of_panels_have_a_gap_between_them():
    """Of 0.36 of the height by the number of rows, of two rows at least."""
    for count in (2, 3, 4):
        figure = panels([Panel([])] * count, 400)
        ends = [
            figure.layout[f"yaxis{k or ''}"].domain for k in ("", *range(2, count + 1))
        ]
        gaps = [above[0] - below[1] for above, below in pairwise(ends)]
        assert gaps == pytest.approx([0.36 / count] * (count - 1))
    empty = panels([], 400)
    assert (len(empty.data), empty.layout.yaxis.domain) == (0, (0.0, 1.0))
    assert "yaxis2" not in empty.layout


def test_points_are_markers_of_seven_pixels():
    for size, drawn in ((), 7.0), ((9.0,), 9.0):
        found = points([0.0, 1.0], [2.0, 3.0], "measured", "#1f2a37", *size)
        assert (found.mode, found.marker.size, found.marker.color) == (
            "markers",
            drawn,
            "#1f2a37",
        )


def test_a_spiral_to_one_side_has_no_loop():
    t = np.arange(3.0)
    one_side = np.array([3.0, 2.0, 1.0]), np.array([0.9, 0.6, 0.3])
    for method, lines in (
        ("reverse", ["reverse spiral"]),
        ("direct", ["there", "and back"]),
    ):
        spiral = Spiral(Trial(t, {"delta": t, "r": t}), *one_side, method)
        assert [trace.name for trace in spiral_figure(spiral).data] == lines


def test_a_zigzag_that_never_reverses_has_no_switch_heading():
    t = np.arange(50.0)
    trial = Trial(t, {"psi": 0.001 * t, "delta": np.full(50, 0.1)}, kind="zigzag")
    assert [trace.name for trace in manoeuvre_figure(trial).data] == [
        "heading change",
        "rudder",
    ]


def test_a_pull_out_is_drawn_from_the_end_of_its_turn():
    """The rudder is amidships from where it is below half of what it was."""
    t = np.arange(60.0)
    delta = np.r_[np.full(20, 0.3), np.full(10, 0.16), np.full(10, 0.14), np.zeros(20)]
    trial = Trial(
        t, {"delta": delta, "r": 0.02 - 1e-4 * t}, name="starboard", kind="pull-out"
    )
    (drawn,) = manoeuvre_figure(trial).data
    assert np.asarray(drawn.x, dtype=float)[[0, 30]] == pytest.approx([-30.0, 0.0])
    assert np.asarray(drawn.y, dtype=float)[0] == pytest.approx(np.degrees(0.02))
    left = np.degrees(0.02 - 1e-4 * np.mean([57.0, 58.0, 59.0]))
    assert drawn.name == f"starboard: {left:.3f} deg/s left"


def test_a_ship_without_shaft_has_two_panels_of_speed():
    t = np.arange(20.0)
    channels = {"u": 5.0 - 0.1 * t, "v": 0.0 * t}
    trial = Trial(t, channels, kind="straight", length=10.0)
    assert len(manoeuvre_figure(trial).data) == 2
    figure = manoeuvre_figure(
        Trial(t, channels | {"n": 1.0 + t}, kind="straight", length=10.0)
    )
    assert [trace.name for trace in figure.data] == [
        "surge speed",
        "surge speed",
        "shaft",
    ]
    assert values(figure, "x", 0)[:2] == pytest.approx([0.0, 0.495])  # ship lengths
    assert values(figure, "y", 2) == pytest.approx(1.0 + t)


def test_orders_that_never_change_are_not_drawn():
    t = np.arange(20.0)
    still = dict.fromkeys(("delta_command", "n_command", "n"), np.ones(20))
    trial = Trial(
        t, still | {"delta": 0.01 * t, "psi": 0.0 * t, "r": 0.0 * t}, kind="random"
    )
    figure = manoeuvre_figure(trial)
    titles = [figure.layout[f"yaxis{k}"].title.text for k in ("", 2, 3)]
    assert (len(figure.data), titles) == (
        3,
        ["rudder, deg", "heading, deg", "yaw rate, deg/s"],
    )
    assert figure.layout.showlegend is False
