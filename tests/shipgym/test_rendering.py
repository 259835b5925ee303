import warnings
from dataclasses import replace
from types import SimpleNamespace

import gymnasium
import numpy as np
import pygame
import pytest

from shipgym import InputError
from shipgym.envs.artist import scene
from shipgym.envs.engine import Engine
from shipgym.envs.rendering import COLOURS, SIZE, Renderer, Scene
from shipgym.models import load_model
from shipgym.sea import Current, Weather, Wind
from shipgym.tasks.guidance import track

LENGTH, BEAM = 160.0, 40.0
SHIP = Scene(5000.0, -300.0, 0.0, 0.0, LENGTH, BEAM, np.radians(35.0), np.zeros((0, 2)))
CHART = slice(150, 520)  # rows without read-outs, compass and gauge
METRES = 14.0 * LENGTH / SIZE
PLACES = (
    (200.0, -300.0),
    (182.8, -182.8),
)  # m north and east of a ship, on a leg and on an arc


@pytest.fixture(scope="module")
def renderer():
    return Renderer("rgb_array")


def where(picture, colour):
    """Rows and columns of a colour on the chart, from the middle: metres north and
    east."""
    rows, columns = np.nonzero(np.all(picture[CHART] == colour, axis=-1))
    return METRES * (SIZE / 2 - (rows + CHART.start)), METRES * (columns - SIZE / 2)


def test_the_ship_is_to_scale_and_north_is_up(renderer):
    picture = renderer.draw(SHIP)
    assert picture.shape == (SIZE, SIZE, 3)
    assert picture.dtype == np.uint8
    north, east = where(picture, COLOURS.hull)
    hull = np.abs(east) > METRES  # without the line ahead
    assert np.ptp(north[hull]) == pytest.approx(0.95 * LENGTH, abs=6 * METRES)
    assert np.ptp(east) == pytest.approx(BEAM, abs=2.5 * METRES)
    _, east = where(renderer.draw(replace(SHIP, heading=np.pi / 2)), COLOURS.hull)
    assert east.max() == pytest.approx(1.1 * LENGTH, abs=3 * METRES)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_rudder_to_starboard_shows_to_starboard(renderer, side):
    _, east = where(renderer.draw(replace(SHIP, rudder=side * 0.5)), COLOURS.rudder)
    assert side * east.mean() > METRES


def test_a_path_lies_where_it_is(renderer):
    path = np.array(
        [[4000.0, -100.0], [6000.0, -100.0]]
    )  # 200 m to starboard of the ship
    north, east = where(
        renderer.draw(replace(SHIP, waypoints=path, corridor=50.0)), COLOURS.path
    )
    assert east.mean() == pytest.approx(200.0, abs=2 * METRES)
    assert np.ptp(north) > 1000.0


def test_the_same_scene_gives_the_same_picture(renderer):
    assert np.array_equal(renderer.draw(SHIP), Renderer("rgb_array").draw(SHIP))


def test_an_unknown_mode_is_refused():
    with pytest.raises(
        InputError,
        match=r"render_mode: expected one of 'human', 'rgb_array', got 'ansi'\.",
    ):
        Renderer("ansi")


COURSE_KEEPING, PATH_FOLLOWING = "shipgym/CourseKeeping-v0", "shipgym/PathFollowing-v0"
TROUBLED = Weather(
    current=Current(0.8, towards_deg=90.0), wind=Wind(9.0, from_deg=200.0)
)


def make(name, **options):
    return gymnasium.make(
        name, **{"model": "mariner", "render_mode": "rgb_array", **options}
    )


def sailed(env, steps=60):
    env.reset(seed=1)
    for _ in range(steps):
        env.step(np.full(1, 0.1, dtype=np.float32))
    return env.render()


def shows(picture, colour):
    return bool(np.all(picture == colour, axis=-1).any())


@pytest.mark.parametrize(("beam", "drawn"), [(23.17, 23.17), (None, 0.15 * 160.93)])
def test_a_ship_without_a_known_beam_is_drawn_like_most(beam, drawn):
    ship = load_model("mariner")
    ship = replace(ship, particulars=replace(ship.particulars, beam=beam))
    shown = scene(Engine(ship, 1), 0, np.zeros((0, 2)))
    assert (shown.length, shown.beam) == pytest.approx((160.93, drawn))


@pytest.mark.parametrize(
    ("name", "options", "shown", "absent"),
    [
        (
            COURSE_KEEPING,
            {},
            (COLOURS.hull, COLOURS.order, COLOURS.wake, COLOURS.rudder),
            (COLOURS.path, COLOURS.corridor, COLOURS.wind, COLOURS.current),
        ),
        (
            COURSE_KEEPING,
            {"sea": "moderate"},
            (COLOURS.hull, COLOURS.order, COLOURS.wind),
            (COLOURS.path, COLOURS.current),
        ),
        (
            PATH_FOLLOWING,
            {},
            (COLOURS.hull, COLOURS.order, COLOURS.path, COLOURS.corridor),
            (COLOURS.wind, COLOURS.current),
        ),
        (
            PATH_FOLLOWING,
            {"sea": TROUBLED},
            (COLOURS.hull, COLOURS.path, COLOURS.wind, COLOURS.current),
            (),
        ),
        (
            PATH_FOLLOWING,
            {"model": "kvlcc2"},
            (COLOURS.hull, COLOURS.path, COLOURS.corridor),
            (COLOURS.wind,),
        ),
    ],
)
def test_environments_show_what_there_is(name, options, shown, absent):
    picture = sailed(make(name, **options))
    assert picture.shape == (SIZE, SIZE, 3)
    assert picture.dtype == np.uint8
    assert [shows(picture, colour) for colour in shown] == [True] * len(shown)
    assert [shows(picture, colour) for colour in absent] == [False] * len(absent)


def test_a_picture_follows_from_seed_and_actions_and_the_wake_begins_anew():
    env = make(PATH_FOLLOWING)
    first, again = sailed(env), sailed(env)
    np.testing.assert_array_equal(first, again)
    env.reset(seed=2)
    assert not shows(env.render(), COLOURS.wake)


def test_rendering_changes_nothing_of_the_voyage():
    shown, blind = (
        make(COURSE_KEEPING, render_mode=mode) for mode in ("rgb_array", None)
    )
    sailed(shown)
    with pytest.warns(UserWarning, match="expected a render_mode"):
        assert sailed(blind) is None
    assert shown.unwrapped.physical_state() == blind.unwrapped.physical_state()


def test_a_window_opens_and_closes_without_a_screen(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = make(PATH_FOLLOWING, render_mode="human")
    env.reset(seed=0)
    for _ in range(3):
        env.step(np.zeros(1, dtype=np.float32))
    assert env.render() is None
    assert pygame.display.get_init()
    env.close()
    env.close()
    assert not pygame.display.get_init()


def test_rows_of_a_vector_environment_have_their_own_pictures():
    rows = gymnasium.make_vec(
        PATH_FOLLOWING, 3, model="mariner", render_mode="rgb_array"
    )
    rows.reset(seed=1)
    single = make(PATH_FOLLOWING)
    single.reset(seed=2)
    for _ in range(20):
        rows.step(np.full((3, 1), 0.1, dtype=np.float32))
        single.step(np.full(1, 0.1, dtype=np.float32))
    pictures = rows.render()
    assert len(pictures) == 3
    np.testing.assert_array_equal(pictures[1], single.render())
    assert not np.array_equal(pictures[0], pictures[1])


def test_videos_are_recorded(tmp_path):
    pytest.importorskip("moviepy", reason="RecordVideo writes its files with moviepy")
    env = gymnasium.wrappers.RecordVideo(
        make(COURSE_KEEPING, episode_steps=5), str(tmp_path / "videos")
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of what moviepy imports
        env.reset(seed=0)
        for _ in range(5):
            env.step(np.zeros(1, dtype=np.float32))
        env.close()
    assert [path.suffix for path in (tmp_path / "videos").iterdir()] == [".mp4"]


def test_the_turns_of_a_planned_path_are_arcs_that_touch_both_legs(renderer):
    corner = np.array(
        [[4000.0, 0.0], [5200.0, 0.0], [5200.0, 1200.0]]
    )  # 90 deg to starboard
    points = track(corner, 400.0)
    inside = np.hypot(
        points[:, 0] - 4800.0, points[:, 1] - 400.0
    )  # from the centre of the turn
    arc = inside < 401.0
    np.testing.assert_allclose(inside[arc], 400.0)
    np.testing.assert_allclose(
        points[arc][[0, -1]], [[4800.0, 0.0], [5200.0, 400.0]], atol=1e-9
    )
    np.testing.assert_allclose(track(corner * [1, -1], 400.0), points * [1, -1])
    assert track(corner, None) is corner
    scene = replace(SHIP, x=4900.0, y=300.0, waypoints=corner)
    for radius, seen in (
        (None, (200.0, -300.0)),
        (400.0, (182.8, -182.8)),
    ):  # of the leg, of the arc
        north, east = where(
            renderer.draw(replace(scene, turn_radius=radius)), COLOURS.path
        )
        near = {
            place: (np.hypot(north - place[0], east - place[1]) < 4 * METRES).any()
            for place in PLACES
        }
        assert near == {place: place == seen for place in PLACES}


class Voyage:
    """Stands for an engine of two lanes, the second of which is looked at."""

    model, outputs = (
        load_model("mariner"),
        SimpleNamespace(outcomes=np.array([[-9.0, -0.1234]])),
    )
    task = SimpleNamespace(info_names=("cross_track",))
    command = np.zeros((1, 2))
    state = {  # noqa: RUF012
        "x": 10.0,
        "y": -20.0,
        "psi": 3.1,
        "u": 7.2,
        "v": -2.1,
        "delta": -0.1,
    }

    def physical_state(self):
        return {name: np.array([99.0, value]) for name, value in self.state.items()}

    def shapes(self, lane):
        return ()

    def waypoints(self, lane):
        return None

    def path_metres(self, name):
        return {"corridor": 160.0}.get(name)

    def info(self, name):
        return np.array([5.0, -34.6])


def test_readouts_are_those_of_the_lane_in_usual_units():
    voyage = Voyage()
    shown = scene(voyage, 1, np.zeros((0, 2)))
    assert shown.readouts == {
        "speed": "7.5 m/s, 14.6 kn",
        "heading": "177.6 deg",
        "rudder": "-5.7 deg",
        "cross-track": "-35 m",
        "reward": "-0.123",
    }
    assert (shown.x, shown.y, shown.heading, shown.rudder) == (10.0, -20.0, 3.1, -0.1)
    assert shown.rudder_limit == pytest.approx(np.radians(40.0))
    assert (shown.course_order, shown.corridor, shown.turn_radius) == (3.1, 160.0, None)
    assert (shown.wind, shown.current) == (None, None)
    voyage.state = {**voyage.state, "set_point": -3.1}  # 4.8 degrees on, through south
    voyage.task = SimpleNamespace(info_names=())
    shown = scene(voyage, 1, np.zeros((0, 2)))
    assert list(shown.readouts) == [
        "speed",
        "heading",
        "to steer",
        "heading error",
        "rudder",
        "reward",
    ]
    assert (shown.readouts["to steer"], shown.readouts["heading error"]) == (
        "182.4 deg",
        "+4.8 deg",
    )
    assert shown.course_order == -3.1
    voyage.command = np.array([[0.0, 0.1], [0.0, 0.75]])
    voyage.state = {**voyage.state, "n_command": 1.5}  # a shaft without lag
    shown = scene(voyage, 1, np.zeros((0, 2)))
    assert shown.readouts["shaft"] == "90 rpm, ordered +0.75"


@pytest.mark.parametrize(
    ("sea", "wind", "current"),
    [
        ({"wind_speed": 9.0, "wind_from": 0.5}, (9.0, 0.5), None),
        (
            {"wind_speed": 0.0, "current_north": 0.0, "current_east": -2.0},
            None,
            (2.0, -np.pi / 2),
        ),
        ({"current_north": -1.0, "current_east": 0.0}, None, (1.0, np.pi)),
        (
            {"current_north": 3.0, "current_east": 4.0},
            None,
            (5.0, np.arctan2(4.0, 3.0)),
        ),
    ],
)
def test_wind_and_current_are_shown_where_there_is_any(sea, wind, current):
    voyage = Voyage()
    voyage.state = {**voyage.state, **sea}
    shown = scene(voyage, 1, np.zeros((0, 2)))
    assert (shown.wind, shown.current) == (wind, current)


@pytest.mark.parametrize(
    ("angle_deg", "shown"),
    [
        (7.26, "007.3"),
        (-90.0, "270.0"),
        (359.96, "000.0"),
        (725.0, "005.0"),
    ],
)
def test_a_bearing_is_shown_as_on_a_compass(angle_deg, shown):
    voyage = Voyage()
    voyage.state = {**voyage.state, "psi": np.radians(angle_deg)}
    readouts = scene(voyage, 1, np.zeros((0, 2))).readouts
    assert readouts["heading"] == f"{shown} deg"


@pytest.mark.parametrize(
    ("rudder_deg", "part"), [(17.5, 0.5), (-35.0, -1.0), (50.0, 1.0)]
)
def test_the_gauge_shows_the_rudder_as_part_of_its_limit(renderer, rudder_deg, part):
    picture = renderer.draw(replace(SHIP, rudder=np.radians(rudder_deg)))
    gauge = picture[CHART.stop :]
    _, columns = np.nonzero(np.all(gauge == COLOURS.rudder, axis=-1))
    offsets = columns - SIZE / 2
    assert offsets[np.abs(offsets).argmax()] == pytest.approx(90.0 * part, abs=2.0)


def test_the_compass_shows_wind_from_its_side_and_current_to_its_side(renderer):
    scene = replace(
        SHIP,
        course_order=np.pi / 2,
        wind=(5.0, np.pi),
        current=(1.0, 0.0),
    )
    compass = renderer.draw(scene)[: CHART.start, SIZE // 2 :]
    rows = {}
    for colour in (COLOURS.wind, COLOURS.current, COLOURS.order):
        # the read-outs stand on the other half
        rows[colour], columns = np.nonzero(np.all(compass == colour, axis=-1))
    assert rows[COLOURS.wind].min() > 70.0  # from the south, below the middle
    assert rows[COLOURS.current].max() < 70.0  # to the north
    assert columns.min() > SIZE / 2 - 70.0 + 40.0  # the order's mark lies east
    assert rows[COLOURS.order].mean() == pytest.approx(70.0, abs=1.5)


@pytest.mark.parametrize(("length", "spacing"), [(160.0, 200.0), (85.5, 100.0)])
def test_lines_of_the_grid_are_a_round_distance_apart(renderer, length, spacing):
    """1, 2 or 5 times a power of ten, at most a sixth of the 14 ship lengths across."""
    picture = renderer.draw(replace(SHIP, length=length, beam=0.2 * length))
    is_grid = np.all(picture[CHART] == COLOURS.grid, axis=-1)
    columns = np.flatnonzero(is_grid.sum(axis=0) > 300)
    metres = 14.0 * length / SIZE
    intervals = np.diff(columns) * metres / spacing  # some lines fall between pixels
    tolerance = 1.1 * metres / spacing
    np.testing.assert_allclose(intervals, np.round(intervals), atol=tolerance)
    assert intervals.min() > 0.9


def test_corridor_and_wake_lie_where_they_are(renderer):
    path = np.array([[3000.0, 0.0], [7000.0, 0.0]])
    wake = np.array([[4900.0, -700.0], [5100.0, -700.0]])
    picture = renderer.draw(replace(SHIP, waypoints=path, corridor=50.0, wake=wake))
    _, east = where(picture, COLOURS.corridor)
    assert np.ptp(east) == pytest.approx(100.0, abs=3 * METRES)
    assert east.mean() == pytest.approx(300.0, abs=2 * METRES)
    north, east = where(picture, COLOURS.wake)
    assert np.ptp(north) == pytest.approx(200.0, abs=3 * METRES)
    assert east.mean() == pytest.approx(-400.0, abs=2 * METRES)


def test_a_wake_of_one_place_is_not_drawn(renderer):
    assert not shows(renderer.draw(replace(SHIP, wake=np.zeros((1, 2)))), COLOURS.wake)
