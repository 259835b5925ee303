"""What is said of a verified autopilot, from numbers made up."""

from dataclasses import asdict, dataclass
from types import SimpleNamespace

import numpy as np
import pytest

import shipgym
from agents import PID
from agents.engines.jobs import JobEngine
from agents.verification import chain, page
from agents.verification.page import headline, verification_view
from agents.verification.result import pilot_metrics, track_metrics
from agents.verification.tracks import track_task
from identification.progress import PROGRESS
from shipgym import InputError, load_model


def track(largest, rms, arrived):
    controller = SimpleNamespace(gains={"heading": np.float64(1.5)})
    return SimpleNamespace(
        controller=controller,
        largest=np.array(largest),
        rms=np.array(rms),
        arrived=np.array(arrived),
    )


def test_the_first_ship_of_a_track_is_the_identified_one_and_the_others_are_drawn():
    found = track_metrics(
        track(
            [40.0, *range(101)], [9.0, *range(101)], [True, *[False] * 3, *[True] * 98]
        )
    )
    assert found == {
        "gains": {"heading": 1.5},
        "cross_track_largest_m": 40.0,
        "cross_track_rmse_m": 9.0,
        "cross_track_largest_m_quantile_95": 95.0,
        "arrived": True,
        "not_arrived": 3,
    }
    alone = track_metrics(track([40.0], [9.0], [False]))
    assert (
        alone["cross_track_largest_m_quantile_95"],
        alone["arrived"],
        alone["not_arrived"],
    ) == (
        40.0,
        False,
        0,
    )


def test_a_path_autopilot_that_does_not_arrive_on_the_identified_model_is_refused(
    monkeypatch,
):
    guides = {
        "here": track([1.0, 2.0], [1.0, 1.0], [True, False]),
        "lost": track([1.0], [1.0], [False]),
    }
    for key, one in guides.items():
        one.key = key
    monkeypatch.setattr(chain, "keep_track", lambda guide, models: guides[guide])
    refused = {}
    assert chain._tracks(list(guides), [], refused) == tuple(guides.values())
    assert refused == {
        "lost": "it does not reach the end of the track on the identified model"
    }


def episodes(count=101):
    numbers = np.arange(float(count))
    return SimpleNamespace(
        cost=numbers,
        heading_rmse_deg=2.0 * numbers,
        rudder_travel_deg_min=3.0 * numbers,
        extrapolating=numbers / 100.0,
        terminated=numbers > 97.0,
    )


def test_a_pilots_figures_are_means_and_the_95th_of_a_hundred():
    design = PID.from_model(load_model("mariner"))
    found = pilot_metrics(SimpleNamespace(episodes=episodes(), design=design))
    assert found["gains"] == pytest.approx(design.gains)
    margins = {
        name: value
        for name, value in asdict(design.margins).items()
        if np.isfinite(value)
    }
    assert {
        name: value for name, value in found["margins"].items() if value is not None
    } == pytest.approx(margins)
    figures = {
        name: value for name, value in found.items() if name not in ("gains", "margins")
    }
    assert figures == pytest.approx(
        {
            "cost_mean": 50.0,
            "cost_quantile_95": 95.0,
            "heading_rmse_deg_mean": 100.0,
            "heading_rmse_deg_quantile_95": 190.0,
            "rudder_travel_deg_min_mean": 150.0,
            "extrapolating_mean": 0.5,
            "lost_control": 3,
        }
    )
    learned = pilot_metrics(SimpleNamespace(episodes=episodes(), design=None))
    assert (learned["gains"], learned["margins"]) == (None, None)


def criterion(passed, decided=True):
    return SimpleNamespace(passed=passed, decided=decided, manoeuvre="", run="")


@pytest.mark.parametrize(
    ("criteria", "runaway", "lost", "said"),
    [
        (
            {"advance": True},
            0,
            0,
            (
                "is stable and meets all IMO criteria. LQ steers best and keeps control"
                " of all 9"
            ),
        ),
        (
            {"advance": True, "tactical_diameter": False},
            0,
            0,
            "is stable but misses the IMO criterion of tactical",
        ),
        (
            {"advance": True, "tactical_diameter": None},
            0,
            0,
            "misses no IMO criterion that these trials decide. Not",
        ),
        (
            {"advance": None},
            0,
            0,
            "Not decided by these trials: advance. LQ steers best",
        ),
        (
            {"advance": True},
            2,
            0,
            "all IMO criteria. 2 of 9 models drawn run away in a manoeuvre. LQ steers",
        ),
        (
            {"advance": True},
            0,
            4,
            "LQ steers best and loses control of 4 of 9 models drawn.",
        ),
    ],
)
def test_the_verdict_says_what_is_met_missed_and_not_decided(
    criteria, runaway, lost, said
):
    best = SimpleNamespace(
        name="LQ", episodes=SimpleNamespace(terminated=np.arange(9) < lost)
    )
    made = {
        name: criterion(passed, passed is not None) for name, passed in criteria.items()
    }
    manoeuvres = SimpleNamespace(criteria=made, unstable=np.arange(9) < runaway)
    told = headline(SimpleNamespace(draws=9, pilots=[best], manoeuvres=manoeuvres))
    assert told.startswith("The model ")
    assert said in told


@pytest.mark.parametrize(
    ("passed", "runaway", "lost", "certain"),
    [
        ((True, True), 0, 0, True),
        ((True, None), 0, 0, False),
        ((False, True), 0, 0, False),
        ((True, True), 1, 0, False),
        ((True, True), 0, 1, False),
        ((False, None), 2, 3, False),
    ],
)
def test_a_verdict_is_certain_where_nothing_is_missed_or_open_and_no_model_drawn_is_lost(
    passed, runaway, lost, certain
):
    def pilot(name, costs):
        numbers = episodes(9)
        numbers.cost, numbers.terminated = np.array(costs), np.arange(9) < lost
        return SimpleNamespace(name=name, design=None, episodes=numbers)

    pilots = [pilot("LQ", [1.0] * 9), pilot("PID", [0.5] * 3 + [2.0] * 6)]
    criteria = dict(
        zip(("advance", "tactical_diameter"), map(criterion, passed), strict=True)
    )
    manoeuvres = SimpleNamespace(criteria=criteria, unstable=np.arange(9) < runaway)
    found = SimpleNamespace(
        draws=9,
        pilots=pilots,
        by_name=pilots,
        manoeuvres=manoeuvres,
        tracks=(),
        course_unstable=np.arange(9) < 4,
    )
    view = verification_view(found)
    assert view["certain"] == certain
    assert (view["met"], view["missed"]) == (passed.count(True), passed.count(False))
    assert (view["unstable"], view["course_unstable"], view["best"]) == (
        runaway,
        4,
        "LQ",
    )
    assert view["cheaper"] == pytest.approx({"PID": 6.0 / 9.0})
    assert (view["learned"], view["designs"]) == (["LQ", "PID"], {})


def test_a_stage_is_told_at_its_beginning_and_end_and_its_parts_in_between():
    told, outside = [], PROGRESS.get(None)
    with chain._stage(lambda *one: told.append(one), "reading"):
        assert told == [("reading", 0, 1)]
        PROGRESS.get()("part", 1, 3)
    assert told[1:] == [("part", 1, 3), ("reading", 1, 1)]
    assert PROGRESS.get(None) is outside
    told.clear()
    with (
        pytest.raises(ValueError, match="lost"),
        chain._stage(lambda *one: told.append(one), "it"),
    ):
        raise ValueError("lost")
    assert told == [("it", 0, 1)]
    assert PROGRESS.get(None) is outside


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"seed": -1}, "seed: expected .*got -1"),
        ({"seed": 2**32 + 1}, "seed: expected .*got 4"),
        ({"where": "lokal"}, "Did you mean 'local'"),
        ({"plotly": False}, "plotly is missing"),
    ],
)
def test_what_is_wrong_is_said_before_a_file_is_read(
    given, message, tmp_path, monkeypatch
):
    if "where" in given:
        given = {"where": JobEngine(given["where"])}
    if given.pop("plotly", True) is False:

        def missing():
            raise InputError("plotly is missing")

        monkeypatch.setattr(chain, "graph_objects", missing)
    monkeypatch.setattr(
        chain.ShipFile, "load", lambda path: pytest.fail("a file is read")
    )
    with pytest.raises(InputError, match=message):
        chain.build_autopilot("ship.toml", tmp_path / "out", **given)
    assert list(tmp_path.iterdir()) == []


def test_twice_the_time_that_the_track_takes_is_sailed_at_most():
    """Six legs of twelve ship lengths, at service speed."""
    model = load_model("mariner")
    task = track_task(model)
    waypoints = np.array(task.settings.waypoints[1:]).reshape(-1, 2)
    length = np.hypot(*np.diff(waypoints, axis=0).T).sum()
    assert length == pytest.approx(6 * 12 * model.particulars["length"])
    most = task.episode_steps * task.interval(model) * model.particulars["speed"]
    assert most / length == pytest.approx(2.0, abs=0.05)


def to_be_built(monkeypatch, verification="found", refusal=None):
    """Stands in for the work of the chain; returns what is asked of it."""
    asked = {"standards": 0}
    fit = SimpleNamespace(model="model")

    @dataclass(frozen=True)
    class Result:
        verification: object
        refusal: str | None

    def examined(ship, fit, guests, verified):
        asked["verify"] = verified.args
        return Result(verification, refusal)

    def to_standards(found, model):
        asked["standards"] += 1
        return f"{found} of {model}"

    stand_ins = {
        "trials_of": lambda ship, settings: ("trials", {}),
        "examined": examined,
        "identification_settings": lambda ship, options: {},
        "_to_standards": to_standards,
        "identify": lambda *_: fit,
        "_write": lambda result, folder: (folder / "report.html").touch(),
        "load_agent": lambda agent: f"made of {agent}",
    }
    for name, one in stand_ins.items():
        monkeypatch.setattr(chain, name, one)
    monkeypatch.setattr(
        chain.ShipFile, "load", lambda path: SimpleNamespace(path="ship.toml")
    )
    return asked


def test_by_default_two_hundred_models_are_drawn_from_the_first_seed_on(
    monkeypatch, tmp_path
):
    asked = to_be_built(monkeypatch)
    result = chain.build_autopilot("ship.toml", tmp_path / "out", agents=["guest"])
    model, draws, seed, _, where, guests, designs = asked["verify"]
    assert (model, draws, seed, guests) == ("model", 200, 0, ["made of guest"])
    assert designs == ("pid", "lq", "lq-scheduled", "turn-rate", "wheel-over")
    assert where is chain.HERE
    assert (result.verification, asked["standards"]) == ("found", 0)
    assert (tmp_path / "out" / "report.html").exists()


@pytest.mark.parametrize(
    ("wanted", "verification", "refusal", "simulated"),
    [
        (True, "found", None, 1),
        (False, "found", None, 0),
        (True, None, None, 0),
        (True, "found", "it loses control", 0),
        (True, None, "it is wrong", 0),
    ],
)
def test_standards_are_simulated_where_they_are_asked_for_and_an_autopilot_is_given(
    wanted, verification, refusal, simulated, monkeypatch, tmp_path
):
    asked = to_be_built(monkeypatch, verification, refusal)
    told = []
    result = chain.build_autopilot(
        "ship.toml",
        tmp_path / "out",
        standards=wanted,
        progress=lambda *one: told.append(one),
    )
    assert asked["standards"] == simulated
    assert result.verification == ("found of model" if simulated else verification)
    stages = [
        "reading trials",
        "identifying",
        *["standards"] * simulated,
        "writing the report",
    ]
    assert told == [(name, done, 1) for name in stages for done in (0, 1)]


def test_standards_are_those_of_the_best_design_and_the_tracks_that_are_given(
    monkeypatch,
):
    def pilot(key, design):
        return SimpleNamespace(key=key, design=design)

    @dataclass(frozen=True)
    class Found:
        pilots: tuple
        tracks: tuple
        refused: dict
        standards: tuple = ()

    pilots = (
        pilot("guest", None),
        pilot("pid", "PID"),
        pilot("lq", "LQ"),
        pilot("lqg", "LQG"),
    )
    tracks = SimpleNamespace(key="los"), SimpleNamespace(key="wheel-over")
    found = Found(pilots, tracks, {"pid": "it loses control", "los": "it is late"})
    monkeypatch.setattr("agents.verification.standards.standards", lambda *given: given)
    assert chain._to_standards(found, "model").standards == ("model", "LQ", [tracks[1]])


@pytest.mark.parametrize("known", [True, False])
def test_a_report_tells_how_the_model_was_made_where_that_is_known(
    known, monkeypatch, tmp_path
):
    drawn = {}
    monkeypatch.setattr(
        page, "render", lambda name, **data: drawn.update(data) or "page"
    )
    monkeypatch.setattr(page, "fit_view", lambda result: "fit")
    monkeypatch.setattr(page, "held_out_error", lambda result: 0.5)
    provenance = {
        "software": "shipgym 0.0.9",
        "structure": "abkowitz",
        "method": "ls",
        "samples": 900,
    }
    model = SimpleNamespace(
        provenance=provenance if known else None, particulars={"length": 161.0}
    )
    ship = SimpleNamespace(
        particulars=SimpleNamespace(name="Mariner"), path=tmp_path / "ship.toml"
    )
    result = SimpleNamespace(
        verification=None,
        model=model,
        ship=ship,
        identification=None,
        instability="it runs away",
        refusal=None,
        trials=(),
    )
    page.write_report(result, tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text() == "page"
    if known:
        assert (drawn["software"], drawn["settings"]) == (
            "shipgym 0.0.9",
            ["abkowitz", "ls", "900"],
        )
    else:
        assert (drawn["software"], drawn["settings"]) == (
            f"shipgym {shipgym.__version__}",
            [page.NONE] * 3,
        )
    assert (drawn["found"], drawn["figures"], drawn["step_deg"]) == (None, {}, 20.0)
    assert drawn["infinity"] == np.inf
