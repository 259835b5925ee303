"""Figures of the pages draw the numbers that they are given."""

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
