"""Figures of the pages draw the numbers that they are given."""

from types import SimpleNamespace

import numpy as np

from agents.verification import figures
from agents.verification.index_uncertainty import ManoeuvreUncertainty
from shipgym import Trial
from shipgym.manoeuvres import Criterion, IndexInterval


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


def test_steps_are_those_of_each_autopilot():
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
