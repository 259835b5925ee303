import warnings
from dataclasses import replace
from types import SimpleNamespace

import gymnasium
import numpy as np
import pygame
import pytest

from shipgym import InputError
from shipgym.envs import artist
from shipgym.envs.artist import Artist, scene
from shipgym.envs.rendering import (
    CORRIDOR,
    CURRENT,
    FAINT,
    GRID,
    HULL,
    INK,
    ORDER,
    PANEL,
    PATH,
    RUDDER,
    SIZE,
    WAKE,
    WIND,
    Renderer,
    Scene,
    _Brush,
    _Chart,
)
from shipgym.sea import Current, Weather, Wind
from shipgym.ships import load_model
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
    """Rows and columns of a colour on the chart, from the middle: metres north and east."""
    rows, columns = np.nonzero(np.all(picture[CHART] == colour, axis=-1))
    return METRES * (SIZE / 2 - (rows + CHART.start)), METRES * (columns - SIZE / 2)


def test_the_ship_is_to_scale_and_north_is_up(renderer):
    picture = renderer.draw(SHIP)
    assert picture.shape == (SIZE, SIZE, 3)
    assert picture.dtype == np.uint8
    north, east = where(picture, HULL)
    hull = np.abs(east) > METRES  # without the line ahead
    assert np.ptp(north[hull]) == pytest.approx(0.95 * LENGTH, abs=6 * METRES)
    assert np.ptp(east) == pytest.approx(BEAM, abs=2.5 * METRES)
    _, east = where(renderer.draw(replace(SHIP, heading=np.pi / 2)), HULL)
    assert east.max() == pytest.approx(1.1 * LENGTH, abs=3 * METRES)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_rudder_to_starboard_shows_to_starboard(renderer, side):
    _, east = where(renderer.draw(replace(SHIP, rudder=side * 0.5)), RUDDER)
    assert side * east.mean() > METRES


def test_a_path_lies_where_it_is(renderer):
    path = np.array(
        [[4000.0, -100.0], [6000.0, -100.0]]
    )  # 200 m to starboard of the ship
    north, east = where(
        renderer.draw(replace(SHIP, waypoints=path, corridor=50.0)), PATH
    )
    assert east.mean() == pytest.approx(200.0, abs=2 * METRES)
    assert np.ptp(north) > 1000.0


@pytest.mark.parametrize(
    ("anchor", "left", "right"), [("left", 0, 1), ("right", 1, 0), ("centre", 1, 1)]
)
def test_a_text_stands_at_its_anchor(renderer, anchor, left, right):
    picture, brush = renderer._pygame.Surface((SIZE, SIZE)), renderer._brush
    brush.fill((255, 255, 255))
    brush.text("HIH", (300.0, 100.0), (0, 0, 0), anchor)
    brush.show(picture)
    columns, rows = np.nonzero(
        renderer._pygame.surfarray.array3d(picture)[..., 0] < 200
    )
    width = left * (300 - columns.min()) + right * (columns.max() - 300)
    assert np.ptp(columns) == pytest.approx(width, abs=4)
    assert 0 <= rows.mean() - (90 if anchor == "centre" else 100) < 20


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
    shown = scene(
        make(COURSE_KEEPING, model=ship).unwrapped._engine, 0, np.zeros((0, 2))
    )
    assert (shown.length, shown.beam) == pytest.approx((160.93, drawn))


@pytest.mark.parametrize(
    ("name", "options", "shown", "absent"),
    [
        (
            COURSE_KEEPING,
            {},
            (HULL, ORDER, WAKE, RUDDER),
            (PATH, CORRIDOR, WIND, CURRENT),
        ),
        (COURSE_KEEPING, {"sea": "moderate"}, (HULL, ORDER, WIND), (PATH, CURRENT)),
        (PATH_FOLLOWING, {}, (HULL, ORDER, PATH, CORRIDOR), (WIND, CURRENT)),
        (PATH_FOLLOWING, {"sea": TROUBLED}, (HULL, PATH, WIND, CURRENT), ()),
        (PATH_FOLLOWING, {"model": "kvlcc2"}, (HULL, PATH, CORRIDOR), (WIND,)),
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
    assert not shows(env.render(), WAKE)


def test_rendering_changes_nothing_of_the_voyage():
    shown, blind = (
        make(COURSE_KEEPING, render_mode=mode) for mode in ("rgb_array", None)
    )
    for env in (shown, blind):
        sailed(env)
    assert shown.unwrapped.physical_state() == blind.unwrapped.physical_state()
    assert blind.unwrapped.render() is None


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
    assert gymnasium.make_vec(PATH_FOLLOWING, 1, model="mariner").render() is None


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


class Recorder:
    """A brush that keeps what it is asked to draw, by colour."""

    def __init__(self):
        self.texts, self.drawn = [], []

    def __getattr__(self, kind):
        return lambda *what, **how: self.drawn.append((kind, *what))

    def text(self, text, at, colour, anchor="left", small=False):
        self.texts.append((text, at, anchor))

    def of(self, kind, colour):
        return [what[2:] for what in self.drawn if what[:2] == (kind, colour)]


@pytest.fixture
def sketch(renderer, monkeypatch):
    """What is drawn of a scene."""

    def draw(scene):
        recorder = Recorder()
        monkeypatch.setattr(renderer, "_brush", recorder)
        renderer.draw(scene)
        return recorder

    return draw


def test_readouts_stand_beside_their_names_line_by_line(sketch):
    scene = replace(
        SHIP,
        readouts={"speed": "7.5 m/s", "step": "12"},
        wind=(9.96, 0.5),
        current=(0.456, 1.0),
    )
    left = [
        one for one in sketch(scene).texts if one[2] == "left" and one[1][0] == 18.0
    ]
    right = [one for one in sketch(scene).texts if one[2] == "right"]
    assert [text for text, *_ in left] == ["speed", "step", "wind", "current"]
    assert [text for text, *_ in right] == ["7.5 m/s", "12", "10.0 m/s", "0.46 m/s"]
    heights = [at[1] for _, at, _ in left]
    assert heights == [at[1] for _, at, _ in right]
    assert np.all(np.diff(heights) >= 16.0)


def test_the_gauge_shows_the_rudder_as_part_of_its_limit(sketch):
    for rudder, part in ((0.0, 0.0), (17.5, 0.5), (-35.0, -1.0), (50.0, 1.0)):
        found = sketch(replace(SHIP, rudder=np.radians(rudder)))
        _, (tip, height), _ = next(
            one for one in found.of("line", RUDDER) if one[2] == 5
        )
        assert tip == pytest.approx(SIZE / 2 + 90.0 * part)
        assert height > 0.9 * SIZE
        texts = [text for text, *_ in found.texts]
        assert {"port 35", "stbd 35", f"rudder {rudder:+.1f} deg"} <= set(texts)


def test_the_compass_points_where_things_come_from_and_go_to(sketch):
    """Wind towards the middle from its side, current outward, the order's mark outside the circle."""
    found = sketch(
        replace(
            SHIP,
            heading=0.0,
            course_order=np.pi / 2,
            wind=(5.0, np.pi),
            current=(1.0, 0.0),
        )
    )
    middle = np.array([SIZE - 70.0, 70.0])
    letters = {
        text: np.array(at) - middle
        for text, at, _ in found.texts
        if text in tuple("NESW")
    }
    for letter, (x, y) in {
        "N": (0, -1),
        "E": (1, 0),
        "S": (0, 1),
        "W": (-1, 0),
    }.items():
        np.testing.assert_allclose(letters[letter], np.array([x, y]) * 37.0, atol=1e-9)
    ((tail, tip),) = found.of("arrow", WIND)
    assert np.hypot(*(np.array(tail) - middle)) == pytest.approx(64.0)
    assert tail[1] > tip[1] > 70.0  # from the south
    ((tail, tip),) = found.of("arrow", CURRENT)
    assert tip[1] < tail[1] < 70.0  # to the north
    mark = np.mean(found.of("polygon", ORDER)[0][0], axis=0) - middle
    assert mark[0] > 50.0
    assert mark[1] == pytest.approx(0.0, abs=1e-9)
    ((_, needle),) = found.of("arrow", HULL)
    np.testing.assert_allclose(np.array(needle) - middle, [0.0, -30.0], atol=1e-9)
    ticks = [
        np.hypot(*(np.array(end) - middle))
        for start, end in found.of("line", FAINT)[:12]
    ]
    np.testing.assert_allclose(ticks, 47.0)


def test_grid_and_scale_have_the_same_round_distance(sketch):
    """14 ship lengths across: lines every 200 m for a ship of 160 m, as long as the bar that says so."""
    found = sketch(SHIP)
    (bar,) = found.of("line", INK)
    assert "200 m" in [text for text, *_ in found.texts]
    assert bar[1][0] - bar[0][0] == pytest.approx(200.0 / METRES)
    lines = found.of("line", GRID)
    down = sorted(start[1] for start, end in lines if start[1] == end[1])
    across = sorted(start[0] for start, end in lines if start[0] == end[0])
    for offsets, centre, sign in ((down, 5000.0, -1.0), (across, -300.0, 1.0)):
        np.testing.assert_allclose(np.diff(offsets), 200.0 / METRES)
        metres = centre + sign * METRES * (np.array(offsets) - SIZE / 2)
        np.testing.assert_allclose(metres / 200.0, np.round(metres / 200.0), atol=1e-6)
        assert offsets[0] <= 0.0
        assert offsets[-1] >= SIZE


def test_a_corridor_is_drawn_around_its_path(sketch):
    path = np.array([[5000.0, -300.0], [5400.0, -300.0]])
    found = sketch(replace(SHIP, waypoints=path, corridor=50.0))
    ((strip,),) = found.of("polygon", CORRIDOR)
    width = np.ptp(np.array(strip)[:, 0]) * METRES
    assert width == pytest.approx(100.0)
    assert [radius for _, radius in found.of("circle", CORRIDOR)] == [
        pytest.approx(50.0 / METRES)
    ] * 2
    assert len(found.of("circle", PATH)) == 2


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
        north, east = where(renderer.draw(replace(scene, turn_radius=radius)), PATH)
        near = {
            place: (np.hypot(north - place[0], east - place[1]) < 4 * METRES).any()
            for place in PLACES
        }
        assert near == {place: place == seen for place in PLACES}


@pytest.mark.parametrize(
    ("angle_deg", "shown"),
    [
        (0.0, "000.0"),
        (7.26, "007.3"),
        (-90.0, "270.0"),
        (359.96, "000.0"),
        (725.0, "005.0"),
    ],
)
def test_a_bearing_is_shown_as_on_a_compass(angle_deg, shown):
    assert artist._bearing(np.radians(angle_deg)) == f"{shown} deg"


class Voyage:
    """Stands for an engine of two lanes, the second of which is looked at."""

    model, outputs = (
        load_model("mariner"),
        SimpleNamespace(outcomes=np.array([[-9.0, -0.1234]])),
    )
    task = SimpleNamespace(info_names=("cross_track",))
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


def test_the_wake_is_that_of_the_last_four_hundred_places():
    voyage, drawn = Voyage(), Artist("rgb_array", 1)
    voyage.state = {**voyage.state, "x": -1.0}
    drawn.begin(voyage)
    for x in range(500):
        voyage.state = {**voyage.state, "x": float(x)}
        drawn.note(voyage)
    assert drawn._wake == [(float(x), -20.0) for x in range(100, 500)]
    drawn.begin(voyage)
    assert drawn._wake == [(499.0, -20.0)]


def test_a_ship_is_drawn_with_her_bow_ahead_and_her_rudder_behind(sketch):
    """Heading east: the line ahead ends 1.1 lengths from midship, the order's arrow 1.6 lengths."""
    scene = replace(SHIP, heading=np.pi / 2, rudder=np.pi / 6, course_order=np.pi)
    found = sketch(scene)
    middle = np.array([SIZE / 2, SIZE / 2])
    start, bow, *_ = found.of("line", HULL)[0]
    np.testing.assert_allclose(
        (np.array([start, bow]) - middle) * METRES,
        [[0, 0], [1.1 * LENGTH, 0]],
        atol=1e-6,
    )
    stern, blade, width = next(one for one in found.of("line", RUDDER) if one[2] == 3)
    np.testing.assert_allclose(
        (stern - middle) * METRES, [-0.5 * LENGTH, 0.0], atol=1e-6
    )
    aft = (
        0.22 * LENGTH * np.array([-np.cos(np.pi / 6), np.sin(np.pi / 6)])
    )  # to starboard is down
    np.testing.assert_allclose((blade - stern) * METRES, aft, atol=1e-6)
    (tail, tip), *_ = found.of("arrow", ORDER)
    np.testing.assert_allclose(
        (np.array([tail, tip]) - middle) * METRES,
        [[0, 0], [0, 1.6 * LENGTH]],
        atol=1e-6,
    )
    ((hull,),) = found.of("polygon", HULL)
    along, across = ((np.array(hull) - middle) * METRES).T
    assert (along.max(), along.min()) == pytest.approx((0.5 * LENGTH, -0.5 * LENGTH))
    assert (across.max(), across.min()) == pytest.approx((0.5 * BEAM, -0.5 * BEAM))
    assert along[0] == along.max()  # the stem, amidships
    assert across[0] == pytest.approx(0.0, abs=1e-9)
    mirrored = {(round(x, 6), round(-y, 6)) for x, y in zip(along, across, strict=True)}
    assert mirrored == {
        (round(x, 6), round(y, 6)) for x, y in zip(along, across, strict=True)
    }
    assert width == 3


def test_what_a_scene_has_not_is_not_drawn(sketch):
    found = sketch(SHIP)
    assert (
        found.of("arrow", ORDER)
        == found.of("polygon", ORDER)
        == found.of("lines", WAKE)
        == []
    )
    assert (
        found.of("lines", PATH)
        == found.of("arrow", WIND)
        == found.of("arrow", CURRENT)
        == []
    )
    one = sketch(replace(SHIP, wake=np.zeros((1, 2))))
    assert one.of("lines", WAKE) == []  # of one place there is no line
    wake = np.array([[4900.0, -300.0], [5000.0, -200.0]])
    ((points, width),) = sketch(replace(SHIP, wake=wake)).of("lines", WAKE)
    np.testing.assert_allclose(
        (points - SIZE / 2) * METRES, [[0.0, 100.0], [100.0, 0.0]], atol=1e-9
    )
    assert width == 2


def test_the_gauge_has_marks_at_its_ends_halves_and_middle_within_its_panel(sketch):
    found = sketch(SHIP)
    marks = [
        one
        for one in found.of("line", FAINT)
        if one[0][0] == one[1][0] and one[0][1] > 0.9 * SIZE
    ]
    assert [start[0] - SIZE / 2 for start, *_ in marks] == [
        -90.0,
        -45.0,
        0.0,
        45.0,
        90.0,
    ]
    assert {end[1] - start[1] for start, end in marks} == {10.0}
    left, top, width, height = found.of("panel", PANEL)[-1][0]
    assert left + width / 2 == SIZE / 2
    for text, (x, y), anchor in found.texts:
        if text.startswith(("port", "stbd", "rudder")):
            assert anchor == "centre"
            assert left < x < left + width
            assert top < y < top + height
    (scale,) = [
        start[0] for start, end in [found.of("line", FAINT)[-6]] if start[1] == end[1]
    ]
    assert scale == SIZE / 2 - 90.0


def test_the_panel_of_readouts_holds_all_their_lines(sketch):
    for count in (1, 4):
        found = sketch(replace(SHIP, readouts={f"line {k}": "1" for k in range(count)}))
        left, top, width, height = found.of("panel", PANEL)[-1][0]
        lines = [at for text, at, anchor in found.texts if text.startswith("line")]
        assert min(x for x, _ in lines) >= left + 8.0
        assert all(top < y < top + height - 12.0 for _, y in lines)
        assert max(y for _, y in lines) > top + height - 30.0  # no empty line
        values = [at for text, at, anchor in found.texts if anchor == "right"]
        assert all(left + 100.0 < x < left + width - 5.0 for x, _ in values)
    assert len(sketch(SHIP).of("panel", PANEL)) == 1  # the gauge's alone


class Canvas:
    """What is drawn on a finer surface, by kind."""

    def __init__(self):
        self.calls = []

    def __getattr__(self, kind):
        return lambda surface, colour, *what, **how: self.calls.append(
            (kind, *what, how)
        )


def brushed(draw):
    """The calls of a brush, in pixels of the finer surface."""
    brush = _Brush(pygame)
    canvas = Canvas()
    brush._pygame = SimpleNamespace(draw=canvas)
    draw(brush)
    return canvas.calls


def test_a_pixel_is_two_of_the_finer_surface():
    assert brushed(lambda brush: brush.line(INK, (1, 2), (3.5, 4))) == [
        ("line", [2.0, 4.0], [7.0, 8.0], 2, {})
    ]
    assert brushed(lambda brush: brush.line(INK, (1, 2), (3, 4), 3))[0][3] == 6
    assert brushed(lambda brush: brush.lines(INK, [(1, 2), (3, 4)], 2)) == [
        ("lines", False, [[2.0, 4.0], [6.0, 8.0]], 4, {})
    ]
    assert brushed(lambda brush: brush.circle(INK, (1, 2), 5.0)) == [
        ("circle", [2.0, 4.0], 10.0, 0, {})
    ]
    assert brushed(lambda brush: brush.circle(INK, (1, 2), 5.0, 2))[0][3] == 4
    assert brushed(lambda brush: brush.panel(INK, (1, 2, 3, 4))) == [
        ("rect", [2.0, 4.0, 6.0, 8.0], {"border_radius": 16})
    ]


def test_an_arrow_has_its_tip_where_it_points_and_is_alike_on_both_sides():
    (_, tail, end, _, _), (_, head, _) = brushed(
        lambda brush: brush.arrow(INK, (10.0, 10.0), (10.0, 50.0))
    )
    assert tail == [20.0, 20.0]
    assert end == [20.0, 90.0]  # within the head
    tip, left, right = np.array(head)
    assert tip.tolist() == [20.0, 100.0]
    assert sorted([left.tolist(), right.tolist()]) == [[12.0, 82.0], [28.0, 82.0]]
    assert (
        len(brushed(lambda brush: brush.arrow(INK, (1.0, 1.0), (1.0, 1.0)))) == 2
    )  # of no length


@pytest.mark.parametrize(
    ("length", "spacing"),
    [
        (0.5, 1.0),
        (43.0, 100.0),
        (85.5, 100.0),
        (86.0, 200.0),
        (214.0, 200.0),
        (215.0, 500.0),
    ],
)
def test_lines_are_a_round_distance_apart_six_to_the_chart_or_more(length, spacing):
    """1, 2 or 5 times a power of ten, at most a sixth of the 14 ship lengths across."""
    chart = _Chart(replace(SHIP, length=length))
    assert chart.spacing == pytest.approx(spacing)
    assert chart.spacing <= 14.0 * length / 6.0 < 2.5 * chart.spacing
