import json
import re

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
        "commands": {"delta": rudder[1:]},
        "reward_parts": {
            "reward_cross_track": np.full(STEPS, -0.4),
            "reward_rudder": np.full(STEPS, -0.1),
        },
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


def data_of(page):
    """What the page holds for its script."""
    return json.loads(
        re.search(
            r'<script type="application/json"[^>]*>(.*?)</script>', page, re.DOTALL
        )[1]
    )


@pytest.fixture
def shown(tmp_path):
    """What the page of an episode holds for its script."""

    def written(**changes):
        episode(**changes).save(tmp_path / "one.json")
        write_replay([tmp_path / "one.json"], tmp_path / "replay.html")
        return data_of((tmp_path / "replay.html").read_text())

    return written


def test_a_page_holds_what_is_shown_of_an_episode_in_the_units_that_are_read(shown):
    n = np.linspace(1.0, 1.5, STEPS + 1)
    states = {**episode().states, "phi": episode().states["psi"], "n": n}
    data = shown(states=states, beam=None)
    (run,) = data["runs"]
    assert run["seed"] == str(2**80)  # a number would lose its end in a browser
    assert run["waypoints"] == [[0.0, 0.0], [1000.0, 0.0]]
    assert run["total"] == -0.5 * STEPS
    assert run["length"] / run["beam"] == pytest.approx(6.5)  # as slender as ships are
    assert (run["corridor"], run["dt"], run["outcome"]) == (50.0, DT, "time limit")
    assert run["rewards"][:2] == [0.0, -0.5]
    assert run["parts"]["reward_rudder"][:2] == [0.0, -0.1]
    series = run["series"]
    expected = {
        "speed": 5.0,
        "cross_track_error": 20.0,
        "yaw_rate": np.degrees(0.002),
        "heading_error": np.degrees(0.1),
        "course_order": np.degrees(0.1),
        "reward_so_far": 0.0,
        "shaft_speed": 60.0,
        "wind_from": 90.0,
        "current_speed": 0.5,
        "current_towards": 270.0,
    }
    first = {name: series[name][0] for name in expected}
    assert first == pytest.approx(expected)
    assert series["rudder_order"][0] == series["delta"][1]
    assert series["heel"][-1] == pytest.approx(np.degrees(0.002 * END))
    assert series["psi"][1] == 0.5729578  # seven digits
    assert [one["label"] for one in data["quantities"]] == [
        "heading",
        "cross-track error",
        "heading error",
        "rudder",
        "speed through water",
        "yaw rate",
        "heel",
        "shaft speed",
        "wind speed",
        "wind from",
        "current speed",
        "current towards",
        "reward so far",
    ]


def test_what_was_not_recorded_or_is_calm_is_not_shown(shown):
    calm = {**episode().states, "wind_speed": np.zeros(STEPS + 1)}
    for name in ("u", "current_east"):
        del calm[name]
    (run,) = shown(states=calm)["runs"]
    assert not run["series"].keys() & {"speed", "wind_speed", "current_speed", "heel"}


@pytest.mark.parametrize("first", [-0.1, 7.0, 0.0, 3.0])
def test_headings_start_within_a_turn_and_go_on_without_a_jump(shown, first):
    known = episode().states
    heading = known["psi"] + first
    wrapped = np.arctan2(np.sin(heading), np.cos(heading))
    order = np.full(STEPS + 1, first)
    (run,) = shown(states={**known, "psi": wrapped, "set_point": order})["runs"]
    found = run["series"]["psi"]
    assert found[0] == pytest.approx(np.degrees(first) % 360.0, abs=1e-4)
    assert found[-1] - found[0] == pytest.approx(np.degrees(0.002 * END), abs=1e-3)
    # the error is the short way round
    assert run["series"]["heading_error"][-1] == pytest.approx(
        -np.degrees(0.002 * END), abs=1e-3
    )


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        ({"truncated": False}, "cut off"),
        ({"terminated": True, "success": True}, "success"),
        ({"terminated": True, "success": False}, "terminated"),
        ({"truncated": True, "success": False}, "time limit, no success"),
    ],
)
def test_how_an_episode_ended_is_told(shown, flags, words):
    assert shown(**flags)["runs"][0]["outcome"] == words


def test_an_episode_of_one_step_has_a_page(shown):
    known = episode()
    (run,) = shown(
        states={name: values[:2] for name, values in known.states.items()},
        commands={},
        reward_parts={},
        info={},
        rewards=known.rewards[:1],
        actions=known.actions[:1],
    )["runs"]
    assert run["steps"] == 1


@pytest.mark.parametrize(
    "name", ["</script><script>alert(1)//", "<!--<script>", "$data ${t}"]
)
def test_no_name_breaks_the_page(tmp_path, name):
    episode(model=name, environment=name).save(tmp_path / "one.json")
    write_replay([tmp_path / "one.json"], tmp_path / "replay.html")
    page = (tmp_path / "replay.html").read_text()
    assert page.count("</script>") == 3
    assert data_of(page)["runs"][0]["model"] == name
    assert name not in re.search(r"<title>(.*?)</title>", page)[1] or "<" not in name
    assert "default-src 'none'" in page  # it loads nothing
    assert re.findall(r'(?:src|href)="([^"]*)"', page) == ["data:,"]


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
    runs = data_of(recorded.with_name("replay.html").read_text())["runs"]
    assert [(run["name"], run["model"]) for run in runs] == [
        ("episode-00000", "mariner"),
        ("container", "container"),
    ]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "there is no such recorded episode"),
        ("x,y\n1,2\n", "broken JSON"),
        ("[1, 2]", "expected a table"),
        ('{"name": "mariner", "format": 1}', "kind: expected 'episode', got None"),
        (
            '{"kind": "episode", "format": 9}',
            "expected format 2, which this version of shipgym reads, got 9",
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


@pytest.mark.parametrize(
    ("out", "said"),
    [
        ("replay.png", "expected a file that ends in .html"),
        ("none/replay.html", "does not exist"),
        (".html", ".html"),
    ],
)
def test_a_page_that_cannot_be_written_exits_with_2(recorded, out, said):
    answer = shipgym(recorded, "--out", recorded.parent / out)
    assert answer.exit_code == 2
    assert said in answer.stderr


def test_no_episode_is_an_error(tmp_path):
    assert shipgym("--out", tmp_path / "replay.html").exit_code == 2
    with pytest.raises(InputError, match="expected at least one"):
        write_replay([], tmp_path / "replay.html")


def test_runs_are_called_by_what_tells_their_files_apart(tmp_path):
    paths = [tmp_path / name / "episode-00000.json" for name in ("lq", "pid")]
    for path in paths:
        path.parent.mkdir()
        episode().save(path)
    write_replay(paths, tmp_path / "replay.html")
    runs = data_of((tmp_path / "replay.html").read_text())["runs"]
    assert [run["name"] for run in runs] == ["lq/episode-00000", "pid/episode-00000"]
