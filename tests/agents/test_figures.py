"""Figures of the pages draw the numbers that they are given."""

from types import SimpleNamespace

import numpy as np
import pytest

from agents.benchmarking.episode_figures import (
    MOST_SAMPLES,
    histories_figure,
    tracks_figure,
)
from agents.benchmarking.page_figures import (
    COLOURS,
    DASHES,
    costs_figure,
    looks,
    profile_figure,
    scores_figure,
)
from agents.benchmarking.results import BenchmarkResult
from agents.verification import figures
from agents.verification.index_uncertainty import ManoeuvreUncertainty
from shipgym import Trial
from shipgym.manoeuvres import Criterion, IndexInterval
from shipgym.plots import INK


def traces(figure, name):
    return [trace for trace in figure.data if trace.name == name]


def only(figure, name):
    (trace,) = traces(figure, name)
    return trace


def test_criteria_are_drawn_in_per_cent_of_their_limits():
    drawn = IndexInterval(3.6, np.array([3.6, 4.95, np.nan]), np.zeros(3, dtype=bool))
    figure = figures.criteria_figure(
        {
            "advance": Criterion(3.6, 4.5, True, "ship lengths", "5.3.1", drawn),
            "stopping": Criterion(None, 15.0, None, "ship lengths", "5.3.4"),
        }
    )
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


def test_tracks_are_drawn_in_ship_lengths_and_their_errors_along_the_path():
    kept = SimpleNamespace(
        waypoints=np.array([[0.0, 0.0], [300.0, 400.0]]),
        positions=np.array([[0.0, 10.0], [30.0, 50.0], [60.0, 90.0]]),
        cross_track=np.array([1.0, 2.0, 3.0]),
    )
    figure = figures.tracks_figure({"wheel-over": kept, "ilos": kept}, 100.0)
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
    assert [(box.name, list(box.x)) for box in boxes.data] == [
        ("pid", [1.0, 2.0]),
        ("lq", [0.5]),
    ]


SCORES = {
    "best-known": {"value": 1.125, "low": None, "high": None},
    "pid": {"value": 0.5, "low": 0.375, "high": 0.75},
    "lq": {"value": None, "low": None, "high": None},
}
MIDDLE = {"value": 0.625, "low": 0.5, "high": 0.75}
RELATIVE = {"best-known": 1.0, "pid": 1.5, "lq": None}


def results(scores=SCORES, relative=RELATIVE, costs=(), **summary):
    """Results with these totals, and in the task `calm` with these costs."""
    ranking = []
    for name, score in scores.items():
        total = {"name": name, "score": score, "relative_cost": relative[name]}
        ranking.append(total | {"score_iqm": MIDDLE})
    costs = dict(costs)
    content = {
        "suite": {"tasks": {"calm": {"on": "ship"}, "calm-far": {"on": "far"}}},
        "reference": {
            "calm": {"rule": 3.5, "bound": 3.0},
            "calm-far": {"rule": 9.0, "bound": 1.0},
        },
        "ranking": ranking,
        "controllers": scores,
        "tasks": {"calm": costs},
        "seeds": {"first": 0, "count": 2},
    }
    episodes = {
        "controller": np.repeat([*costs, ""], 2),
        "task": np.repeat("calm", 2 * len(costs) + 2),
        "cost": np.array([*costs.values(), (0.0, 0.0)]).ravel(),
    }
    return BenchmarkResult(content | summary, episodes)


def test_scores_are_drawn_with_their_intervals():
    """Geometric and interquartile mean of each, and lines at the rule and the bound."""
    figure = scores_figure(results())
    drawn = []
    for trace in figure.data:
        error = trace.error_x
        drawn.append((trace.name, trace.x[0], error.array[0], error.arrayminus[0]))
    assert drawn == [
        ("best-known", 1.125, 0.0, 0.0),
        ("best-known", 0.625, 0.125, 0.125),
        ("pid", 0.5, 0.25, 0.125),
        ("pid", 0.625, 0.125, 0.125),
    ]
    assert [trace.marker.symbol for trace in figure.data[2:]] == [
        "circle",
        "diamond-open",
    ]
    assert [shape.x0 for shape in figure.layout.shapes] == [
        1.0,
        pytest.approx(3.5 / 3.0),
    ]
    names = [annotation.text for annotation in figure.layout.annotations]
    assert names == ["rule", "bound"]
    assert figure.layout.xaxis.title.text.startswith("score")
    assert figure.layout.xaxis.range[0] == pytest.approx(0.4)


def test_relative_costs_are_drawn_where_there_are_no_scores():
    figure = scores_figure(results(reference={}))
    assert [trace.x[0] for trace in figure.data] == [1.0, 1.5]
    assert not figure.layout.shapes
    assert figure.layout.xaxis.title.text.startswith("cost relative")


@pytest.mark.parametrize(
    ("score", "summary", "place", "symbol"),
    [
        ((1.1, 7.0, 9.0), {}, 1.25, "triangle-right"),
        ((1.25, 7.0, 9.0), {"reference": {}}, 4.0, "triangle-right"),
    ],
)
def test_a_number_beyond_the_axis_stands_at_its_edge(score, summary, place, symbol):
    interval = dict(zip(("low", "value", "high"), score, strict=True))
    result = results({"pid": interval}, {"pid": 90.0}, **summary)
    mark = scores_figure(result).data[0]
    assert (mark.x[0], mark.marker.symbol) == (place, symbol)
    assert mark.customdata[0] == (90.0 if summary else interval["value"])


@pytest.mark.parametrize(
    ("costs", "kind"),
    [
        ((1.0, 19.0), "linear"),
        ((1.0, 20.5), "log"),
        ((0.003, 25.0), "log"),
        ((0.0, 900.0), "linear"),
    ],
)
def test_costs_have_a_logarithmic_axis_where_they_differ_much(costs, kind):
    figure = costs_figure(results(costs={"pid": costs}), "calm")
    (box,) = figure.data
    np.testing.assert_allclose(box.x, costs, rtol=1e-6)
    assert (box.name, figure.layout.xaxis.type) == ("pid", kind)


def test_a_task_that_nobody_could_run_has_no_costs():
    figure = costs_figure(results(), "calm")
    assert (len(figure.data), figure.layout.xaxis.type) == (0, "linear")


def test_profiles_are_shares_in_per_cent():
    profile = {"thresholds": [0.0, 0.5, 1.0], "shares": {"pid": [1.0, 0.5, 0.25]}}
    (curve,) = profile_figure(results(profile=profile)).data
    assert (curve.name, list(curve.x)) == ("pid", [0.0, 0.5, 1.0])
    assert list(curve.y) == [100.0, 50.0, 25.0]


def test_controllers_look_different():
    names = ["best-known", *(f"c{k}" for k in range(2 * len(COLOURS)))]
    styles = looks(names)
    assert styles["best-known"] == (INK, "solid")
    assert styles["c0"] == (COLOURS[0], DASHES[0])
    assert len(set(styles.values())) == len(names)


def episode(**changes):
    n = 1000
    states = {
        "x": np.linspace(0.0, 100.0, n + 1),
        "y": np.linspace(0.0, 50.0, n + 1),
        "psi": np.linspace(3.0, 3.3, n + 1),
        "delta": np.full(n + 1, np.radians(5.0)),
        "set_point": np.full(n + 1, -3.0),
    }
    content = {
        "n_steps": n,
        "dt": 0.5,
        "states": states,
        "info": {"cross_track": np.full(n + 1, 7.0)},
        "waypoints": np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 60.0]]),
        "corridor": 20.0,
    }
    content |= changes
    return SimpleNamespace(**content, path=content["waypoints"])  # without turns


def corridor_of(drawn):
    outline = only(tracks_figure({"pid": drawn}, ["pid"]), "corridor")
    return np.array([outline.x, outline.y], dtype=np.float64)


def test_tracks_are_drawn_east_to_the_right_above_the_path():
    figure = tracks_figure({"pid": episode()}, ["pid"])
    track = only(figure, "pid")
    assert len(track.x) == MOST_SAMPLES + 1
    assert (track.x[0], track.x[-1], track.y[0], track.y[-1]) == (0.0, 50.0, 0.0, 100.0)
    assert list(only(figure, "path").x) == [0.0, 0.0, 60.0]
    free = tracks_figure({"pid": episode(waypoints=None)}, ["pid"])
    assert [trace.name for trace in free.data] == ["pid"]


def test_a_corridor_is_a_strip_along_each_leg_and_a_disc_between_them():
    points = corridor_of(episode())
    ends = np.flatnonzero(np.isnan(points[0]))
    along, across, disc = np.split(points, ends[:-1] + 1, axis=1)
    np.testing.assert_allclose(
        along[:, :-1], [[20, 20, -20, -20], [0, 100, 100, 0]], atol=1e-5
    )
    np.testing.assert_allclose(
        across[:, :-1], [[0, 60, 60, 0], [80, 80, 120, 120]], atol=1e-5
    )
    radii = np.hypot(disc[0, :-1], disc[1, :-1] - 100.0)
    np.testing.assert_allclose(radii, 20.0, rtol=1e-5)

    # a waypoint that is there twice
    twice = np.array([[0.0, 0.0], [0.0, 0.0], [100.0, 0.0]])
    east, north = corridor_of(episode(waypoints=twice))
    extent = (np.nanmin(east), np.nanmax(east), np.nanmax(north))
    assert extent == pytest.approx((-20.0, 20.0, 100.0))

    # without a width it lies on the path
    east, north = corridor_of(episode(corridor=None))
    assert np.nanmax(np.abs(east) * np.abs(north - 100.0)) == 0.0


def test_histories_of_a_path_are_cross_track_errors_and_rudders():
    figure = histories_figure({"pid": episode()}, ["pid"])
    error, rudder = traces(figure, "pid")
    assert (error.x[-1], set(error.y)) == (500.0, {7.0})
    np.testing.assert_allclose(rudder.y, 5.0, rtol=1e-6)
    assert sorted(shape.y0 for shape in figure.layout.shapes) == [-20.0, 20.0]


def test_histories_of_a_course_are_headings_with_the_order_of_the_longest():
    whole = episode(waypoints=None)
    short = episode(waypoints=None, n_steps=500)
    figure = histories_figure({"short": short, "pid": whole}, ["pid", "short"])
    heading, _ = traces(figure, "pid")
    np.testing.assert_allclose(
        (heading.y[0], heading.y[-1]), np.degrees([3.0, 3.3]), rtol=1e-6
    )
    course = only(figure, "ordered course")
    beside_the_heading = np.degrees(2.0 * np.pi - 3.0)
    np.testing.assert_allclose(course.y, beside_the_heading, rtol=1e-6)
    assert course.x[-1] == 500.0
    assert not figure.layout.shapes
