import json
import re
from base64 import b64decode

import numpy as np
import pytest
from typer.testing import CliRunner

from agents.cli import app
from agents.rollouts import write_replay
from shipgym import Episode, InputError

STEPS, DT = 40, 5.0
END = STEPS * DT


def episode(**changes):
    """A ship of 100 m that goes north along a path at 5 m/s, 20 m off it, and turns."""
    t = DT * np.arange(STEPS + 1)
    rudder = np.radians(10.0) * np.sin(t / 20.0)
    states = {
        "x": 5.0 * t,
        "y": np.full_like(t, 20.0),
        "psi": 0.002 * t,
        "u": np.full_like(t, 5.0),
        "v": np.zeros_like(t),
        "r": np.full_like(t, 0.002),
        "delta": rudder,
        "delta_command": np.append(0.0, rudder[1:]),
        "set_point": np.full_like(t, 0.1),
        "wind_speed": np.full_like(t, 8.0),
        "wind_from": np.full_like(t, np.pi / 2),
        "current_north": np.zeros_like(t),
        "current_east": np.full_like(t, -0.5),
        "under_keel_clearance": np.full_like(t, 3.0),
    }
    known = {
        "environment": "shipgym/PathFollowing-v0",
        "model": "mariner",
        "dt": DT,
        "length": 100.0,
        "beam": 20.0,
        "rudder_limit": np.radians(35.0),
        "states": states,
        "actions": np.zeros((STEPS, 1)),
        "rewards": np.full(STEPS, -0.5),
        "info": {
            "cross_track": np.full_like(t, 20.0),
            "extrapolating": np.zeros_like(t),
        },
        "waypoints": [[0.0, 0.0], [1000.0, 0.0]],
        "corridor": 50.0,
        "seed": 2**80,
        "truncated": True,
    }
    return Episode(**(known | changes))


def plots_of(page):
    """Data and layout of the figures that the page draws, by their names."""
    read = json.JSONDecoder().raw_decode
    found = {}
    for start in re.finditer(r'Plotly.newPlot\("plot-(\w+)-figure",', page):
        data, end = read(page, start.end())
        layout, _ = read(page, end + 1)
        found[start[1]] = data, layout
    return found


def values(numbers):
    """Numbers of a figure, which plotly writes as bytes in base64."""
    if isinstance(numbers, dict):
        return np.frombuffer(b64decode(numbers["bdata"]), numbers["dtype"])
    return np.array(numbers)


@pytest.fixture
def shown(tmp_path):
    """The page of an episode."""

    def written(**changes):
        episode(**changes).save(tmp_path / "one.json")
        write_replay([tmp_path / "one.json"], tmp_path / "replay.html")
        return (tmp_path / "replay.html").read_text()

    return written


def histories(page):
    """First and last value of each line of the histories, by its panel."""
    found = {}
    data, layout = plots_of(page)["histories"]
    titles = [annotation["text"] for annotation in layout["annotations"]]
    for trace in data:
        title = titles[int(trace["yaxis"][1:] or 1) - 1]
        y = values(trace["y"])
        found.setdefault(title, []).append((y[0], y[-1]))
    return found


def test_a_page_shows_what_was_recorded_in_the_units_that_are_read(shown):
    n = np.linspace(1.0, 1.5, STEPS + 1)
    states = {**episode().states, "phi": episode().states["psi"], "n": n}
    page = shown(states=states, beam=None)
    found = {panel: lines[0] for panel, lines in histories(page).items()}
    turned = np.degrees(0.002 * END)
    expected = {
        "heading, deg": (0.0, turned),
        "rudder, deg": (0.0, 10.0 * np.sin(END / 20.0)),
        "rudder order, deg": (10.0 * np.sin(DT / 20.0), 10.0 * np.sin(END / 20.0)),
        "surge, m/s": (5.0, 5.0),
        "yaw rate, deg/s": (np.degrees(0.002), np.degrees(0.002)),
        "heel, deg": (0.0, turned),
        "shaft, rev/s": (1.0, 1.5),
        "wind, m/s": (8.0, 8.0),
        "cross-track error, m": (20.0, 20.0),
        "reward so far": (0.0, -0.5 * STEPS),
    }
    assert found.keys() == expected.keys()
    for panel, ends in expected.items():
        np.testing.assert_allclose(found[panel], ends, rtol=1e-5, atol=1e-6)
    assert histories(page)["heading, deg"][1][0] == pytest.approx(np.degrees(0.1))
    assert str(2**80) in page
    assert "time limit" in page


def test_the_ship_moves_through_the_frames_to_its_end(shown):
    known = episode()
    page = shown(
        states={name: values[:3] for name, values in known.states.items()},
        info={},
        rewards=known.rewards[:2],
        actions=known.actions[:2],
    )
    start = page.index('Plotly.addFrames("plot-chart-figure",')
    frames, _ = json.JSONDecoder().raw_decode(page, page.index("[", start))
    assert [frames[0]["name"], frames[-1]["name"]] == ["0.0", f"{2 * DT:.1f}"]
    for frame, heading, north in ((frames[0], 0.0, 0.0), (frames[-1], 0.02, 50.0)):
        (hull,) = frame["data"]
        bow = 20.0 + 50.0 * np.sin(heading), north + 50.0 * np.cos(heading)
        assert (hull["x"][0], hull["y"][0]) == pytest.approx(bow, abs=0.01)
    assert frames[0]["data"][0]["x"][2] == 30.0  # half a beam to starboard


def test_no_name_breaks_the_page(tmp_path):
    name = "</script><script>alert(1)//<!--<script>$data ${t}"
    plain = tmp_path / "plain.json"
    episode().save(plain)
    write_replay([plain], tmp_path / "plain.html")
    expected = (tmp_path / "plain.html").read_text().count("</script>")
    episode(model=name, environment=name).save(tmp_path / "one.json")
    write_replay([tmp_path / "one.json"], tmp_path / "replay.html")
    page = (tmp_path / "replay.html").read_text()
    assert page.count("</script>") == expected
    assert "<script>alert" not in page
    assert "default-src 'none'" in page  # it loads nothing


def shipgym(*arguments):
    return CliRunner().invoke(app, ["replay", *map(str, arguments)])


@pytest.fixture
def recorded(tmp_path):
    path = tmp_path / "episode-00000.json"
    episode().save(path)
    return path


def test_the_command_writes_the_page(recorded):
    other = recorded.with_name("container.json")
    episode(model="container", length=175.0).save(other)
    answer = shipgym(recorded, other, "--out", recorded.with_name("replay.html"))
    assert (answer.exit_code, answer.stderr) == (0, "")
    page = recorded.with_name("replay.html").read_text()
    rows = re.findall(r"<tr><td>(.*?)</td><td>.*?</td><td>(.*?)</td>", page)
    assert rows == [("episode-00000", "mariner"), ("container", "container")]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "there is no such recorded episode"),
        ("x,y\n1,2\n", "broken JSON"),
        ("[1, 2]", "expected a table"),
        ('{"name": "mariner", "format": 1}', "kind: expected 'episode', got None"),
        (
            '{"kind": "episode", "format": 9}',
            "expected format 3, which this version of shipgym reads, got 9",
        ),
    ],
)
def test_a_wrong_file_exits_with_2_one_message_and_no_page(recorded, text, said):
    wrong = recorded.with_name("wrong.json")
    if text is not None:
        wrong.write_text(text)
    answer = shipgym(recorded, wrong, "--out", recorded.with_name("replay.html"))
    assert answer.exit_code == 2
    assert answer.stderr.count("\n") == 1
    assert f"error: {wrong}" in answer.stderr
    assert said in answer.stderr
    assert not recorded.with_name("replay.html").exists()


def test_no_episode_is_an_error(tmp_path):
    assert shipgym("--out", tmp_path / "replay.html").exit_code == 2
    with pytest.raises(InputError, match="expected at least one"):
        write_replay([], tmp_path / "replay.html")
