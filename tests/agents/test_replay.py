import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from agents.cli import app
from agents.rollouts.replay_page import names, replay_page, write_replay
from agents.rollouts.replay_series import outcome, quantities, rounded, series
from shipgym import Episode, InputError

STEPS, DT = 40, 5.0


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


def test_series_are_in_the_units_that_are_read():
    shown = series(episode())
    assert shown["speed"] == pytest.approx(5.0)
    assert shown["yaw_rate"] == pytest.approx(np.degrees(0.002))
    assert shown["heading_error"][0] == pytest.approx(np.degrees(0.1))
    assert shown["course_order"] == pytest.approx(np.degrees(0.1))
    assert shown["reward_so_far"][[0, 1, -1]].tolist() == [0.0, -0.5, -0.5 * STEPS]
    assert shown["rudder_order"][0] == shown["delta"][1]
    assert shown["current_speed"] == pytest.approx(0.5)
    assert shown["current_towards"] == pytest.approx(270.0)
    assert shown["wind_from"] == pytest.approx(90.0)


def test_shaft_speed_is_that_of_the_ship_else_what_is_ordered():
    n = np.linspace(1.0, 1.5, STEPS + 1)
    known = episode()
    ordered = replace(known, commands={**known.commands, "n": n[1:]})
    assert "shaft_speed" not in series(known)
    assert series(ordered)["shaft_speed"] == pytest.approx(
        60.0 * np.append(n[1:], n[-1])
    )
    turned = replace(ordered, states={**known.states, "n": 2.0 * n})
    assert series(turned)["shaft_speed"] == pytest.approx(120.0 * n)


def test_numbers_keep_seven_digits():
    values = np.array([0.0, -1234.56789, 1.0 / 3.0, 2e-7, 1e5 / 3.0])
    assert rounded(values) == [0.0, -1234.568, 0.3333333, 2e-7, 33333.33]
    assert rounded(np.array([123456789.4, 6e-10, 4e-10])) == [123456789.0, 1e-9, 0.0]


def test_angles_are_read_to_a_tenth_of_a_degree_and_speeds_to_a_centimetre_per_second():
    known = episode()
    states = {**known.states, "phi": known.states["psi"], "n": known.states["u"]}
    shown = quantities(
        data_of(replay_page({"first": replace(known, states=states)}))["runs"]
    )
    assert [(one["label"], one["unit"], one["decimals"]) for one in shown] == [
        ("heading", "deg", 1),
        ("cross-track error", "m", 1),
        ("heading error", "deg", 1),
        ("rudder", "deg", 1),
        ("speed through water", "m/s", 2),
        ("yaw rate", "deg/s", 2),
        ("heel", "deg", 1),
        ("shaft speed", "1/min", 1),
        ("reward so far", "", 2),
    ]
    assert series(replace(known, states=states))["heel"][-1] == pytest.approx(
        np.degrees(0.002 * STEPS * DT)
    )


def test_headings_start_within_a_turn_and_speeds_are_of_any_direction():
    known = episode().states
    for first, shown in (
        (-0.1, 360.0 - np.degrees(0.1)),
        (7.0, np.degrees(7.0 - 2.0 * np.pi)),
        (0.0, 0.0),
    ):
        heading = series(episode(states={**known, "psi": known["psi"] + first}))["psi"]
        assert heading[0] == pytest.approx(shown)
        assert heading[-1] - heading[0] == pytest.approx(np.degrees(0.002 * STEPS * DT))
    states = {**known, "u": -known["u"], "v": np.full_like(known["u"], 12.0)}
    assert series(episode(states=states))["speed"] == pytest.approx(13.0)
    del states["v"]
    assert series(episode(states=states))["speed"] == pytest.approx(5.0)  # astern
    del states["u"]
    assert "speed" not in series(episode(states=states))


def test_wind_and_current_are_told_from_0_to_360_degrees():
    known = episode().states
    none, half = np.zeros(STEPS + 1), np.full(STEPS + 1, 0.5)
    for (north, east), towards in zip(
        ((half, none), (none, half), (-half, none)), (0, 90, 180), strict=True
    ):
        states = {
            **known,
            "wind_from": -half * np.pi,
            "current_north": north,
            "current_east": east,
        }
        shown = series(episode(states=states))
        assert shown["current_towards"] == pytest.approx(towards)
        assert shown["current_speed"] == pytest.approx(0.5)
        assert shown["wind_from"] == pytest.approx(270.0)
    shown = series(
        episode(states={**known, "current_north": none, "current_east": none})
    )
    assert "current_speed" not in shown
    states = {
        name: values
        for name, values in known.items()
        if name not in ("wind_from", "current_east")
    }
    assert not {"wind_speed", "current_speed"} & series(episode(states=states)).keys()


def test_the_error_is_the_short_way_round():
    known = episode().states
    heading = np.linspace(3.0, 3.5, STEPS + 1)  # through south
    wrapped = np.where(heading > np.pi, heading - 2.0 * np.pi, heading)
    shown = series(
        episode(states={**known, "psi": wrapped, "set_point": np.full(STEPS + 1, -3.0)})
    )
    assert shown["psi"] == pytest.approx(np.degrees(heading))
    assert np.abs(shown["heading_error"]).max() < 30.0


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        ({"truncated": True}, "time limit"),
        ({"truncated": False}, "cut off"),
        ({"terminated": True, "success": True}, "success"),
        ({"terminated": True, "success": False}, "terminated"),
        ({"truncated": True, "success": False}, "time limit, no success"),
    ],
)
def test_how_an_episode_ended_is_told(flags, words):
    assert outcome(episode(**flags)) == words


def test_a_page_holds_all_of_an_episode_that_is_shown():
    (run,) = data_of(replay_page({"first": episode()}))["runs"]
    assert run["seed"] == str(
        2**80
    )  # a number of that size would lose its end in a browser
    assert run["waypoints"] == [[0.0, 0.0], [1000.0, 0.0]]
    assert list(run["parts"]) == ["reward_cross_track", "reward_rudder"]
    assert run["other"].keys() >= {"under_keel_clearance", "u", "v", "extrapolating"}
    assert "cross_track" not in run["other"]
    assert run["total"] == -0.5 * STEPS
    assert run["beam"] == 20.0
    assert (run["rudderLimit"], run["corridor"], run["dt"]) == (
        pytest.approx(35.0),
        50.0,
        DT,
    )
    assert (run["rewards"][:2], run["parts"]["reward_rudder"][:2]) == (
        [0.0, -0.5],
        [0.0, -0.1],
    )


def test_a_ship_of_unknown_beam_is_drawn_as_slender_as_ships_are():
    (run,) = data_of(replay_page({"first": episode(beam=None)}))["runs"]
    assert run["length"] / run["beam"] == pytest.approx(6.5)


def test_what_no_run_has_is_not_shown():
    shown = {
        each["label"]
        for each in data_of(replay_page({"first": episode()}))["quantities"]
    }
    assert "cross-track error" in shown
    assert not shown & {"heel", "shaft speed"}


def test_the_wind_of_a_calm_day_is_not_shown():
    calm = {
        name: values for name, values in episode().states.items() if "wind" not in name
    }
    calm |= {"wind_speed": np.zeros(STEPS + 1), "wind_from": np.zeros(STEPS + 1)}
    assert "wind_speed" not in series(episode(states=calm))


@pytest.mark.parametrize(
    "name", ["</script><script>alert(1)//", "<!--<script>", "$data ${t}"]
)
def test_no_name_breaks_the_page(name):
    page = replay_page({name: episode(model=name, environment=name)})
    assert page.count("</script>") == 3
    assert data_of(page)["runs"][0]["name"] == name
    assert name not in re.search(r"<title>(.*?)</title>", page)[1] or "<" not in name


def test_runs_are_called_by_what_tells_their_files_apart():
    paths = [Path("a/lq/episode-00000.json"), Path("a/pid/episode-00000.json")]
    assert names(paths) == ["lq/episode-00000", "pid/episode-00000"]
    assert names([Path("a/one.json"), Path("b/two.json")]) == ["one", "two"]
    assert names([Path("a/one.json")] * 2) == ["one", "one (2)"]
    assert names([Path("/one.json"), Path("/a/one.json")]) == ["/one", "a/one"]


def test_the_page_loads_nothing():
    page = replay_page({"first": episode()})
    assert "default-src 'none'" in page
    assert re.findall(r'(?:src|href)="([^"]*)"', page) == ["data:,"]
    assert "http" not in page.replace("http://www.w3.org/2000/svg", "").replace(
        "http-equiv", ""
    )


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
            "expected format 1, which this version of shipgym reads, got 9",
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
    with pytest.raises(InputError, match="expected at least one"):
        replay_page({})


def test_an_episode_of_one_step_has_a_page():
    known = episode()
    short = replace(
        known,
        states={name: values[:2] for name, values in known.states.items()},
        commands={},
        reward_parts={},
        info={},
        actions=known.actions[:1],
        rewards=known.rewards[:1],
    )
    assert data_of(replay_page({"short": short}))["runs"][0]["steps"] == 1
