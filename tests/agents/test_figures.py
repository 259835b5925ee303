"""Figures of the pages draw the numbers that they are given."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from agents.benchmarking import page_figures
from agents.verification import figures
from agents.verification.index_uncertainty import ManoeuvreUncertainty
from shipgym import Trial
from shipgym.manoeuvres import Criterion, IndexInterval
from tests.golden.texts import flat, same_text


def traces(figure, name):
    return [trace for trace in figure.data if trace.name == name]


def only(figure, name):
    (trace,) = traces(figure, name)
    return trace


def same_figure(name, figure):
    return same_text(
        f"figures/{name}", "\n".join(flat(json.loads(figure.to_json()), "figure"))
    )


def test_criteria_are_drawn_in_per_cent_of_their_limits():
    drawn = IndexInterval(3.6, np.array([3.6, 4.95, np.nan]), np.zeros(3, dtype=bool))
    figure = figures.criteria_figure(
        {
            "advance": Criterion(3.6, 4.5, True, "ship lengths", "5.3.1", drawn),
            "stopping": Criterion(None, 15.0, None, "ship lengths", "5.3.4"),
        }
    )
    assert same_figure("criteria", figure)
    first, second = traces(figure, "models drawn")
    np.testing.assert_allclose(first.x, [80.0, 110.0], rtol=1e-6)
    assert np.abs(np.array(first.y)).max() < 0.25
    assert len(second.x) == 0
    model = only(figure, "identified model")
    np.testing.assert_allclose(model.x, [80.0, 80.0])
    np.testing.assert_allclose(np.mean(model.y), 0.0, atol=1e-12)
    assert list(only(figure, "IMO limit").x) == [100.0, 100.0]
    assert list(figure.layout.yaxis.range) == [1.5, -0.5]
    assert list(figure.layout.yaxis.ticktext) == [
        figures.CRITERIA[name] for name in ("advance", "stopping")
    ]


def test_tracks_are_drawn_east_to_the_right_in_ship_lengths_and_their_errors_along_the_way():
    kept = SimpleNamespace(
        waypoints=np.array([[0.0, 0.0], [300.0, 400.0]]),
        positions=np.array([[0.0, 10.0], [30.0, 50.0], [60.0, 90.0]]),
        cross_track=np.array([1.0, 2.0, 3.0]),
    )
    figure = figures.tracks_figure({"wheel-over": kept, "ilos": kept}, 100.0)
    assert same_figure("tracks", figure)
    planned = only(figure, "waypoints")
    np.testing.assert_allclose((planned.x, planned.y), ([0.0, 4.0], [0.0, 3.0]))
    track, error = traces(figure, "ilos")
    np.testing.assert_allclose(
        (track.x, track.y), ([0.1, 0.5, 0.9], [0.0, 0.3, 0.6]), rtol=1e-6
    )
    np.testing.assert_allclose(
        (error.x, error.y), ([0.0, 0.5, 1.0], [1.0, 2.0, 3.0]), rtol=1e-6
    )


def test_manoeuvres_are_drawn_in_degrees_and_ship_lengths():
    t = np.arange(4.0)
    zigzag = Trial(t, {"psi": np.radians(t), "delta": np.radians(-2.0 * t)})
    circle = Trial(t, {"x": 50.0 * t, "y": 100.0 * t})
    headings = np.radians(np.stack([t + k for k in range(21)]))
    paths = (np.stack([10.0 * t, 20.0 * t], axis=-1),)
    found = ManoeuvreUncertainty(
        {}, np.zeros(21, dtype=bool), zigzag, headings, circle, paths
    )
    figure = figures.manoeuvres_figure(found, 50.0)
    assert same_figure("manoeuvres", figure)
    np.testing.assert_allclose(only(figure, "rudder").y, -2.0 * t, rtol=1e-6)
    heading, track = traces(figure, "identified model")
    np.testing.assert_allclose(heading.y, t, rtol=1e-6)
    np.testing.assert_allclose((track.x, track.y), (2.0 * t, t), rtol=1e-6)
    single = only(figure, "single draws")
    np.testing.assert_allclose(
        (single.x, single.y), ([0, 0.4, 0.8, 1.2, np.nan], [0, 0.2, 0.4, 0.6, np.nan])
    )
    band = only(figure, "95 % of draws")
    np.testing.assert_allclose(band.x, [0, 1, 2, 3, 3, 2, 1, 0])
    np.testing.assert_allclose(
        band.y, [19.5, 20.5, 21.5, 22.5, 3.5, 2.5, 1.5, 0.5], rtol=1e-6
    )


def test_steps_and_costs_are_those_of_each_autopilot():
    t = np.arange(3.0)
    heading = np.radians([[0.0, 10.0, 20.0], [0.0, 12.0, 22.0], [0.0, 8.0, 18.0]])
    figure = figures.steps_figure(
        t, {"pid": (heading, -heading), "lq": (heading[:1], heading[:1])}, 20.0
    )
    assert same_figure("steps", figure)
    above, below = [trace for trace in traces(figure, "pid") if trace.fill is None]
    np.testing.assert_allclose(above.y, [0.0, 10.0, 20.0], rtol=1e-6)
    np.testing.assert_allclose(below.y, [0.0, -10.0, -20.0], rtol=1e-6)
    bands = [
        trace for trace in traces(figure, "pid") if trace.fill is not None
    ]  # of the two draws
    np.testing.assert_allclose(bands[0].y, [0.0, 11.9, 21.9, 18.1, 8.1, 0.0], rtol=1e-6)
    np.testing.assert_allclose(
        bands[1].y, [0.0, -8.1, -18.1, -21.9, -11.9, 0.0], rtol=1e-6
    )
    assert len(traces(figure, "lq")) == 2
    course = only(figure, "set course")
    assert (list(course.x), list(course.y)) == ([0.0, 2.0], [20.0, 20.0])
    boxes = figures.costs_figure({"pid": np.array([1.0, 2.0]), "lq": np.array([0.5])})
    assert same_figure("costs over draws", boxes)
    assert [(box.name, list(box.x)) for box in boxes.data] == [
        ("pid", [1.0, 2.0]),
        ("lq", [0.5]),
    ]


def result(**summary):
    costs = {"pid": np.array([[1.0, 2.0]]), "best-known": np.array([[0.5, 25.0]])}
    entries = [
        {
            "name": "best-known",
            "score": {"value": 1.0, "low": None, "high": None},
            "relative_cost": 1.0,
        },
        {
            "name": "pid",
            "score": {"value": 0.25, "low": 0.125, "high": 0.5},
            "relative_cost": 1.5,
        },
        {
            "name": "lq",
            "score": {"value": None, "low": None, "high": None},
            "relative_cost": None,
        },
    ]
    return SimpleNamespace(
        ranking=["best-known", "pid", "lq"],
        summary={"reference": "x", "ranking": entries, "tasks": {"calm": costs}}
        | summary,
        figures=lambda name, task: costs[name],
    )


def test_scores_are_drawn_with_their_intervals():
    figure = page_figures.scores_figure(result())
    assert same_figure("scores", figure)
    assert [trace.name for trace in figure.data] == ["best-known", "pid"]
    pid = only(figure, "pid")
    assert (pid.x[0], pid.error_x.array[0], pid.error_x.arrayminus[0]) == (
        0.25,
        0.25,
        0.125,
    )
    best = only(figure, "best-known")
    assert (best.x[0], best.error_x.array[0], best.error_x.arrayminus[0]) == (
        1.0,
        0.0,
        0.0,
    )
    assert sorted(shape.x0 for shape in figure.layout.shapes) == [0.0, 1.0]
    assert figure.layout.xaxis.title.text.startswith("score")
    unscored = page_figures.scores_figure(result(reference=None))
    assert [trace.x[0] for trace in unscored.data] == [1.0, 1.5]
    assert not unscored.layout.shapes
    assert unscored.layout.xaxis.title.text.startswith("cost relative")


def test_one_that_failed_stands_at_the_edge_and_does_not_flatten_the_scale():
    lost = {
        "name": "pid",
        "score": {"value": -240.0, "low": -300.0, "high": -1.0},
        "relative_cost": 90.0,
    }
    figure = page_figures.scores_figure(result(ranking=[lost]))
    (mark,) = figure.data
    assert (mark.x[0], mark.marker.symbol, mark.customdata[0]) == (
        -1.5,
        "triangle-left",
        -240.0,
    )
    (mark,) = page_figures.scores_figure(result(ranking=[lost], reference=None)).data
    assert (mark.x[0], mark.marker.symbol) == (4.0, "triangle-right")
    better = {
        "name": "pid",
        "score": {"value": 7.0, "low": 1.25, "high": 9.0},
        "relative_cost": 0.0625,
    }
    (mark,) = page_figures.scores_figure(result(ranking=[better])).data
    assert (mark.x[0], mark.marker.symbol, mark.error_x.arrayminus[0]) == (
        1.5,
        "triangle-right",
        0.25,
    )
    (mark,) = page_figures.scores_figure(result(ranking=[better], reference=None)).data
    assert (mark.x[0], mark.marker.symbol) == (0.0625, "circle")


def test_costs_have_a_logarithmic_axis_where_they_differ_much():
    figure = page_figures.costs_figure(result(), "calm")
    assert same_figure("costs of a task", figure)
    boxes = [(box.name, list(box.x)) for box in figure.data]
    assert boxes == [("best-known", [0.5, 25.0]), ("pid", [1.0, 2.0])]
    assert figure.layout.xaxis.type == "log"
    marks = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0]
    np.testing.assert_allclose(figure.layout.xaxis.tickvals, marks)
    near = result()
    near.figures = lambda name, task: np.array([[1.0, 19.0]])
    assert page_figures.costs_figure(near, "calm").layout.xaxis.type == "linear"
    near.figures = lambda name, task: np.zeros((0, 2))
    assert page_figures.costs_figure(near, "calm").layout.xaxis.type == "linear"
    near.figures = lambda name, task: np.array([[0.003, 25.0]])
    assert page_figures.costs_figure(near, "calm").layout.xaxis.type == "log"
    near.figures = lambda name, task: np.array([[1.0, 20.5]])
    assert page_figures.costs_figure(near, "calm").layout.xaxis.type == "log"
    near.figures = lambda name, task: np.array([[0.0, 900.0]])
    assert page_figures.costs_figure(near, "calm").layout.xaxis.type == "linear"


def test_profiles_are_shares_in_per_cent_and_styles_differ():
    profile = {"thresholds": [0.0, 0.5, 1.0], "shares": {"pid": [1.0, 0.5, 0.25]}}
    figure = page_figures.profile_figure(profile, ["pid", "lq"])
    assert same_figure("profile", figure)
    (curve,) = figure.data
    assert (curve.name, list(curve.x), list(curve.y)) == (
        "pid",
        [0.0, 0.5, 1.0],
        [100.0, 50.0, 25.0],
    )
    names = ["best-known", *(f"c{k}" for k in range(2 * len(page_figures.COLOURS)))]
    styles = page_figures.styles(names)
    assert styles["best-known"] == (page_figures.INK, "solid")
    assert len(set(styles.values())) == len(names)
    assert styles["c0"] == (page_figures.COLOURS[0], page_figures.DASHES[0])


def episode(**changes):
    n = 1000
    states = {
        "x": np.linspace(0.0, 100.0, n + 1),
        "y": np.linspace(0.0, 50.0, n + 1),
        "psi": np.linspace(3.0, 3.3, n + 1),
        "delta": np.full(n + 1, np.radians(5.0)),
        "set_point": np.full(n + 1, -3.0),
    }
    given = {
        "n_steps": n,
        "dt": 0.5,
        "states": states,
        "info": {"cross_track": np.full(n + 1, 7.0)},
        "waypoints": np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 60.0]]),
        "corridor": 20.0,
    }
    given |= changes
    return SimpleNamespace(**given, path=given["waypoints"])  # a path without turns


def test_tracks_are_drawn_with_the_corridor_beside_them():
    figure = page_figures.tracks_figure({"pid": episode()}, ["pid"])
    assert same_figure("tracks in a corridor", figure)
    track = only(figure, "pid")
    assert len(track.x) == page_figures.SAMPLES + 1
    assert (track.x[0], track.x[-1], track.y[0], track.y[-1]) == (0.0, 50.0, 0.0, 100.0)
    assert list(only(figure, "path").x) == [0.0, 0.0, 60.0]
    shape = only(
        figure, "corridor"
    )  # two strips and the disc between them, parted by NaN
    points = np.array([shape.x, shape.y])
    ends = np.flatnonzero(np.isnan(points[0]))
    along, across, disc = (
        points[:, first:end]
        for first, end in zip([0, *ends[:-1] + 1], ends, strict=True)
    )
    np.testing.assert_allclose(along, [[20, 20, -20, -20], [0, 100, 100, 0]], atol=1e-5)
    np.testing.assert_allclose(across, [[0, 60, 60, 0], [80, 80, 120, 120]], atol=1e-5)
    np.testing.assert_allclose(np.hypot(disc[0], disc[1] - 100.0), 20.0, rtol=1e-5)
    twice = np.array(
        [[0.0, 0.0], [0.0, 0.0], [100.0, 0.0]]
    )  # a waypoint that is there twice
    shape = only(
        page_figures.tracks_figure({"pid": episode(waypoints=twice)}, ["pid"]),
        "corridor",
    )
    assert (
        np.nanmin(shape.x),
        np.nanmax(shape.x),
        np.nanmax(shape.y),
    ) == pytest.approx((-20.0, 20.0, 100.0))
    narrow = only(
        page_figures.tracks_figure({"pid": episode(corridor=None)}, ["pid"]), "corridor"
    )
    assert (
        np.nanmax(np.abs(narrow.x) * np.abs(np.array(narrow.y) - 100.0)) == 0.0
    )  # it lies on the path
    free = page_figures.tracks_figure({"pid": episode(waypoints=None)}, ["pid"])
    assert [trace.name for trace in free.data] == ["pid"]


def test_histories_are_cross_track_errors_or_headings_and_rudders():
    figure = page_figures.histories_figure({"pid": episode()}, ["pid"])
    assert same_figure("histories of a path", figure)
    error, rudder = traces(figure, "pid")
    assert (error.x[-1], set(error.y)) == (500.0, {7.0})
    np.testing.assert_allclose(rudder.y, 5.0, rtol=1e-6)
    assert sorted(shape.y0 for shape in figure.layout.shapes) == [-20.0, 20.0]
    figure = page_figures.histories_figure({"pid": episode(waypoints=None)}, ["pid"])
    assert same_figure("histories of a course", figure)
    heading, _ = traces(figure, "pid")
    assert (heading.y[0], heading.y[-1]) == pytest.approx(tuple(np.degrees([3.0, 3.3])))
    course = only(figure, "ordered course")
    np.testing.assert_allclose(
        course.y, np.degrees(2.0 * np.pi - 3.0), rtol=1e-6
    )  # beside the heading
    assert course.x[-1] == 500.0
    short = episode(waypoints=None, n_steps=500)
    figure = page_figures.histories_figure(
        {"short": short, "pid": episode(waypoints=None)}, ["pid", "short"]
    )
    assert only(figure, "ordered course").x[-1] == 500.0  # up to the end of the longest
    assert not figure.layout.shapes
