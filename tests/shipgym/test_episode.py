import json
import re
from dataclasses import replace

import numpy as np
import pytest

from shipgym import Episode, InputError

STEPS = 4


def states(**more):
    names = ("x", "y", "psi", "u", "v", "r", "delta")
    known = {
        name: np.linspace(0.1, 1.0 / 3.0, STEPS + 1) + k for k, name in enumerate(names)
    }
    known["delta"] -= 6.0  # radians of a rudder
    return known | more


NUMBERS = ("dt", "length", "beam", "rudder_limit", "corridor", "turn_radius")
EPISODE = Episode(
    environment="shipgym/PathFollowing-v0",
    model="mariner",
    dt=0.5,
    length=160.93,
    beam=23.17,
    rudder_limit=0.7,
    states=states(
        set_point=np.zeros(STEPS + 1),
        delta_command=np.array([0.0, 0.1, -0.1, 0.2, 0.3]),
    ),
    actions=np.array([[0.1], [-0.1], [0.2], [0.3]]),
    rewards=-np.ones(STEPS),
    info={"cross_track": np.linspace(0.0, 1.0, STEPS + 1)},
    waypoints=np.array([[0.0, 0.0], [1000.0, 1.0 / 3.0]]),
    corridor=60.0,
    turn_radius=300.0,
    arguments={"model": "mariner", "sea": {"wind": None}},
    seed=2**100,
    number=3,
    truncated=True,
    success=True,
)


def test_what_is_read_is_what_was_written_to_the_last_digit(tmp_path):
    EPISODE.save(tmp_path / "episode.json")
    read = Episode.load(tmp_path / "episode.json")
    for name in ("states", "info"):
        written, found = getattr(EPISODE, name), getattr(read, name)
        assert list(written) == list(found)
        assert all(np.array_equal(written[key], found[key]) for key in written)
    for name in ("actions", "rewards", "waypoints", "t"):
        assert np.array_equal(getattr(EPISODE, name), getattr(read, name))
    for name in (*NUMBERS, "environment", "model", "arguments"):
        assert getattr(EPISODE, name) == getattr(read, name)
    for name in ("seed", "number", "terminated", "truncated", "success"):
        assert getattr(EPISODE, name) == getattr(read, name)
    assert [path.name for path in tmp_path.iterdir()] == ["episode.json"]


def test_orders_of_a_trial_stand_where_they_begin_to_hold():
    trial = EPISODE.to_trial()
    assert trial.t.tolist() == [0.0, 0.5, 1.0, 1.5, 2.0]
    assert trial["delta_command"].tolist() == [0.1, -0.1, 0.2, 0.3, 0.3]
    assert "set_point" not in trial
    assert trial.length == 160.93


def test_the_heading_of_a_trial_goes_through_south_without_a_jump():
    psi = np.array([3.1, 3.14, -3.1, -3.0, -2.9])
    turned = replace(EPISODE, states=states(psi=psi)).to_trial()["psi"]
    assert np.abs(np.diff(turned)).max() < 0.11


def test_a_shaft_that_turns_as_ordered_is_part_of_the_trial():
    turning = states(n_command=np.full(STEPS + 1, 1.5))
    episode = replace(EPISODE, states=turning)
    assert episode.to_trial()["n"].tolist() == [1.5] * (STEPS + 1)
    turning["n"] = np.linspace(0.0, 1.0, STEPS + 1)
    lagging = replace(EPISODE, states=turning)
    assert lagging.to_trial()["n"][0] == 0.0


def test_an_episode_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        EPISODE.states["x"][0] = 1.0


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("format", 1, "expected format 3, which this version of shipgym reads, got 1"),
        ("kind", "model", "kind: expected 'episode', got 'model'"),
        ("dt", 0, "dt: expected a number > 0"),
        ("seed", -1, "seed: expected an integer of at least 0"),
        ("beam", 500.0, "beam: expected a number > 0 and <= 160.93"),
        ("beem", 1.0, "unknown key 'beem'. Did you mean 'beam'?"),
        ("waypoints", [[0.0, 0.0]], "waypoints: expected at least 2 rows"),
        ("states", {"x": [0.0, 1.0]}, "states.x: expected shape (5,), got (2,)"),
        ("states", {"x": [0.0] * 5}, "states: expected 'x', 'y', 'psi', 'delta'"),
        ("info", {"cost": 0.1}, "info.cost: expected shape (5,), got ()"),
        ("rewards", [], "rewards: expected at least one step, got none"),
        ("success", "yes", "success: expected a boolean"),
        ("turn_radius", 4e4, "waypoints"),
    ],
)
def test_a_wrong_field_is_named_with_its_file(tmp_path, name, value, said):
    path = tmp_path / "episode.json"
    corner = [[0.0, 0.0], [1000.0, 0.0], [1000.0, 1000.0]]
    replace(EPISODE, waypoints=corner).save(path)
    content = json.loads(path.read_text())
    path.write_text(json.dumps(content | {name: value}))
    with pytest.raises(
        InputError, match=f"^{re.escape(f'{path}: ')}.*{re.escape(said)}"
    ):
        Episode.load(path)


def test_a_missing_field_and_a_file_cut_short_are_told(tmp_path):
    path = tmp_path / "episode.json"
    EPISODE.save(path)
    whole = path.read_text()
    content = json.loads(whole)
    del content["states"]
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match="'states' is missing"):
        Episode.load(path)
    path.write_text(whole[:200])
    with pytest.raises(InputError, match="cut short"):
        Episode.load(path)
    with pytest.raises(InputError, match="there is no such recorded episode"):
        Episode.load(tmp_path / "absent.json")


def test_a_trial_is_named_by_what_begins_its_episode_again():
    trial = EPISODE.to_trial()
    assert trial.name == f"shipgym/PathFollowing-v0 seed {2**100} episode 3"
    assert (trial.use, EPISODE.to_trial(use="validate").use) == ("fit", "validate")
    assert EPISODE.to_trial("first", "skip").name == "first"


def test_the_path_of_an_episode_is_drawn_with_its_turns():
    corner = [[0.0, 0.0], [1000.0, 0.0], [1000.0, 1000.0]]
    episode = replace(EPISODE, waypoints=corner, turn_radius=300.0)
    assert np.hypot(*(episode.path - [1000.0, 0.0]).T).min() == pytest.approx(
        300.0 * (np.sqrt(2.0) - 1.0), abs=1.0
    )
    assert replace(EPISODE, waypoints=corner, turn_radius=None).path.tolist() == corner
    assert replace(EPISODE, waypoints=None, turn_radius=None).path is None


def test_what_need_not_be_known_may_be_left_out():
    unknown = dict.fromkeys(
        ("waypoints", "corridor", "turn_radius", "beam", "seed", "success")
    )
    bare = replace(EPISODE, **unknown, states=states())
    assert (bare.n_steps, bare.number, bare.rudder_limit) == (STEPS, 3, 0.7)
    assert replace(bare, rudder_limit=np.pi / 2.0, beam=160.93, number=0).number == 0
    assert "delta_command" not in bare.to_trial()
