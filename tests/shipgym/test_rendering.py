"""Pictures: the ship to scale on her chart, and what the episode has besides."""

import warnings

import gymnasium
import numpy as np
import pygame
import pytest

from shipgym.envs.rendering import CORRIDOR, HULL, WAKE
from shipgym.sea import Current, Weather, Wind
from shipgym.tasks.shapes import rgb

COURSE, PATH = "shipgym/CourseKeeping-v0", "shipgym/PathFollowing-v0"
LENGTH, BEAM = 160.93, 23.17  # of the Mariner
METRES = 14.0 * LENGTH / 600
ORDER, RUDDER, LINE = rgb("warning"), rgb("danger"), rgb("safe")
TROUBLED = Weather(
    current=Current(0.8, towards_deg=90.0), wind=Wind(9.0, from_deg=200.0)
)


def make(name, **options):
    return gymnasium.make(
        name, **{"model": "mariner", "render_mode": "rgb_array", **options}
    )


def sailed(env, steps=60, rudder=0.1):
    env.reset(seed=1)
    for _ in range(steps):
        env.step(np.full(1, rudder, dtype=np.float32))
    return env.render()


def where(picture, colour):
    """Metres north and east of the ship at which a colour is on the chart."""
    chart = picture[200:400, 200:400]  # without read-outs
    rows, columns = np.nonzero(np.all(chart == colour, axis=-1))
    return METRES * (300 - (rows + 200)), METRES * (columns + 200 - 300)


def shows(picture, colour):
    return bool(np.all(picture == colour, axis=-1).any())


def test_the_ship_is_to_scale_and_heads_where_she_heads():
    env = make(COURSE)
    picture = sailed(env, 0)
    assert picture.shape == (600, 600, 3)
    assert picture.dtype == np.uint8
    north, east = where(picture, HULL)
    heading = env.unwrapped.physical_state()["psi"]
    ahead = north * np.cos(heading) + east * np.sin(heading)
    aside = east * np.cos(heading) - north * np.sin(heading)
    assert np.ptp(ahead) == pytest.approx(0.97 * LENGTH, abs=5 * METRES)
    assert np.ptp(aside) == pytest.approx(BEAM, abs=3 * METRES)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_rudder_to_starboard_shows_to_starboard(side):
    env = make(COURSE, course_change_deg=0.0)
    north, east = where(sailed(env, 20, side), RUDDER)
    heading = env.unwrapped.physical_state()["psi"]
    assert side * np.mean(east * np.cos(heading) - north * np.sin(heading)) > METRES


@pytest.mark.parametrize(
    ("name", "options", "shown", "absent"),
    [
        (COURSE, {}, [HULL, ORDER, WAKE, RUDDER], [LINE, CORRIDOR]),
        (PATH, {"sea": TROUBLED}, [LINE, CORRIDOR, WAKE], []),
    ],
)
def test_environments_show_what_there_is(name, options, shown, absent):
    picture = sailed(make(name, **options))
    assert [shows(picture, one) for one in shown + absent] == [
        *[True] * len(shown),
        *[False] * len(absent),
    ]


def test_a_picture_follows_from_seed_and_actions_and_changes_nothing():
    env, silent = make(PATH), make(PATH, render_mode=None)
    first = sailed(env)
    np.testing.assert_array_equal(sailed(env), first)  # the wake begins anew
    with warnings.catch_warnings(action="ignore"):
        assert sailed(silent) is None
    action = np.full(1, -0.5, dtype=np.float32)
    np.testing.assert_array_equal(env.step(action)[0], silent.step(action)[0])


def test_a_window_opens_and_closes_without_a_screen(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    with warnings.catch_warnings(
        action="ignore"
    ):  # Gymnasium's wrapper says it is used
        env = make(COURSE, render_mode="human")
    env.reset(seed=0)
    env.step(np.zeros(1, dtype=np.float32))
    assert pygame.display.get_init()
    env.close()
    env.close()
    assert not pygame.display.get_init()


def test_rows_of_a_vector_environment_have_their_own_pictures():
    ships = gymnasium.make_vec(COURSE, num_envs=2, render_mode="rgb_array")
    ships.reset(seed=1)
    ships.step(np.zeros((2, 1), dtype=np.float32))
    first, second = ships.render()
    assert first.shape == second.shape == (600, 600, 3)
    assert not np.array_equal(first, second)


def test_videos_are_recorded(tmp_path):
    folder = tmp_path / "videos"
    env = gymnasium.wrappers.RecordVideo(make(COURSE, episode_steps=5), str(folder))
    with warnings.catch_warnings(action="ignore"):  # of what moviepy imports
        sailed(env, 5)
        env.close()
    assert [path.suffix for path in folder.iterdir()] == [".mp4"]
