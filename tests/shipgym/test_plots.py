import sys

import numpy as np
import pytest
from matplotlib.figure import Figure

from shipgym import InputError, Trial, load_model
from shipgym.manoeuvres import turning_circle
from shipgym.plots import (
    CHANNEL_AXES,
    history_figure,
    manoeuvre_figure,
    path_figure,
)

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


def test_without_plotly_the_message_says_what_to_install(monkeypatch, circle):
    monkeypatch.setitem(sys.modules, "plotly.subplots", None)
    with pytest.raises(InputError, match=r"pip install 'shipgym\[report\]'"):
        path_figure({"turn": circle})


def test_a_manoeuvre_is_drawn_over_time(circle):
    figure = manoeuvre_figure(circle)
    assert figure.layout.yaxis.title.text == "heading, deg"
    assert figure.layout.yaxis5.title.text == "drift angle, deg"


def test_a_trial_is_drawn_on_the_axes_of_a_user(circle, monkeypatch):
    ax = Figure().subplots()
    assert circle.plot("psi", ax, label="turn") is ax
    (line,) = ax.lines
    assert line.get_ydata() == pytest.approx(np.degrees(circle["psi"]))
    assert (ax.get_ylabel(), line.get_label()) == ("heading, deg", "turn")
    track = circle.plot("path", Figure().subplots()).lines[0]
    assert track.get_xdata() == pytest.approx(circle["y"])
    with pytest.raises(InputError, match=r"channel: .*got 'pssi'. Did you mean 'psi'"):
        circle.plot("pssi", ax)
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    with pytest.raises(InputError, match=r"pip install 'shipgym\[report\]'"):
        circle.plot("psi")
