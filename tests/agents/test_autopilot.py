import json
from dataclasses import replace

import numpy as np
import pytest

from agents import LQ, IntegralLineOfSight, sail
from agents.cli.tables import ranking_table
from agents.verification.chain import build_autopilot, verify
from agents.verification.page import write_report
from agents.verification.result import verification_metrics
from agents.verification.tracks import keep_track
from identification import identify
from identification.judging.warnings import model_warnings
from shipgym import InputError, ShipFile, load_model
from tests.agents.policies import random_policy


def test_the_folder_holds_report_model_metrics_and_all_autopilots(chain):
    folder, _, _ = chain
    found = sorted(path.name for path in folder.iterdir())
    assert found == [
        "lq.json",
        "metrics.json",
        "model.json",
        "pid.json",
        "preview-lq.json",
        "report.html",
    ]
    assert list(folder.parent.iterdir()) == [folder]


def test_the_model_predicts_the_trials_that_were_not_fitted(chain):
    trials = chain[1].metrics["trials"]
    zigzag, circle = trials["zigzag_15_15.csv"], trials["turning_circle_35.csv"]
    assert zigzag["use"] == circle["use"] == "validate"
    assert np.degrees(zigzag["rmse"]["psi"]) < 2.0
    diameter = circle["tactical_diameter_lengths"]
    assert diameter["predicted"] == pytest.approx(diameter["measured"], rel=0.03)


def test_metrics_tell_probabilities_margins_and_ranking(chain):
    folder, result, _ = chain
    metrics = json.loads((folder / "metrics.json").read_text())
    assert metrics["draws"]["count"] == 24
    assert metrics["draws"]["unstable"] == int(result.verification.unstable.sum())
    assert metrics["imo"]["advance"]["probability"] == 1.0
    assert metrics["imo"]["tactical_diameter"]["probability"] == 0.0
    assert sorted(metrics["ranking"]) == ["lq", "pid"]
    costs = [metrics["controllers"][name]["cost_mean"] for name in metrics["ranking"]]
    assert costs == sorted(costs)
    for name in metrics["ranking"]:
        assert metrics["controllers"][name]["lost_control"] == 0
        assert metrics["controllers"][name]["margins"]["phase_margin_deg"] > 30.0


def test_lq_with_preview_keeps_to_the_track_in_a_current_on_every_model_drawn(chain):
    """Within half a ship length; with a lead of next to nothing by more."""
    _, result, _ = chain
    (track,), length = result.verification.tracks, result.model.particulars["length"]
    assert track.arrived.all()
    assert len(track.largest) == 25
    assert track.largest.max() < 0.5 * length
    told = result.metrics["tracks"]["preview-lq"]
    assert told["cross_track_largest_m"] == track.largest[0]
    late = replace(track.controller, gains={**track.controller.gains, "reach": 1.0})
    assert keep_track(late, [result.model]).largest[0] > 1.5 * track.largest[0]


def test_only_what_is_asked_for_is_designed_and_a_path_autopilot_alone_is_refused(
    chain,
):
    model = chain[1].model
    found = verify(model, 4, 1, designs=("lqg", "lqg"))
    assert [pilot.key for pilot in found.pilots] == ["lqg"]
    assert found.tracks == ()
    with pytest.raises(
        InputError, match=r"no autopilot that keeps a heading .*got 'wheel-over'"
    ):
        verify(model, 4, 1, designs=("wheel-over",))
    with pytest.raises(InputError, match="autopilots: expected one of"):
        build_autopilot("examples/mariner/ship.toml", "out", designs=["wheelover"])


def test_the_saved_model_is_the_identified_one(chain):
    folder, result, _ = chain
    assert load_model(folder / "model.json").coefficients == result.model.coefficients


def test_a_learned_guest_flies_beside_them_without_gains_and_margins(chain, tmp_path):
    result = chain[1]
    guest = random_policy(
        result.model, base=LQ.from_model(result.model), authority=0.01
    )
    found = verify(result.model, 24, 1, guests=[guest])
    told = verification_metrics(found)["controllers"]
    alone = sail(guest, result.model.sample(24, 1), seeds=1 + np.arange(24))
    assert told["learned"]["cost_mean"] == pytest.approx(alone.cost.mean(), rel=1e-6)
    assert told["learned"]["gains"] is told["learned"]["margins"] is None
    assert told["lq"] == verification_metrics(result.verification)["controllers"]["lq"]
    write_report(replace(result, verification=found), tmp_path / "report.html")
    assert (
        "Trained earlier, on another model, and used unchanged: LEARNED."
        in (tmp_path / "report.html").read_text()
    )
    table = ranking_table(replace(result, verification=found))
    gain_margins = table.columns[6].cells
    rows = dict(zip(table.columns[0].cells, gain_margins, strict=True))
    assert rows["LEARNED"] == "-"
    assert float(rows["LQ"]) > 1.0


@pytest.mark.parametrize("made_for", ["paths", "another ship"])
def test_a_guest_of_another_environment_or_ship_is_wrong_input(
    demo, tmp_path, made_for
):
    path = tmp_path / "guest.json"
    if made_for == "paths":
        IntegralLineOfSight.from_model(
            load_model("mariner"), autopilot=LQ.from_model(load_model("mariner"))
        ).save(path)
    else:
        random_policy(load_model("kvlcc2")).save(path)
    said = (
        "cross_track.*for paths there is"
        if made_for == "paths"
        else "scale of '.*': expected"
    )
    with pytest.raises(InputError, match=f"agent '.*guest.json': .*{said}"):
        build_autopilot(demo, tmp_path / "out", draws=4, agents=[path])
    assert not (tmp_path / "out").exists()


def test_an_unknown_guest_is_refused_with_the_nearest_name(tmp_path):
    expected = (
        "agent: expected a file, or one of .*'path-folowing-ppo'. Did you mean"
        " 'path-following-ppo'"
    )
    with pytest.raises(InputError, match=expected):
        build_autopilot(
            "examples/mariner/ship.toml", tmp_path / "out", agents=["path-folowing-ppo"]
        )
    assert list(tmp_path.iterdir()) == []


def test_progress_is_told_to_the_end(chain):
    stages = chain[2]
    assert ("models drawn", 24, 24) in stages
    assert stages[-1] == ("writing the report", 1, 1)


def test_the_same_seed_gives_the_same_numbers(chain):
    result = chain[1]
    again = verify(result.model, 24, 1)
    for first, second in zip(result.verification.pilots, again.pilots, strict=True):
        assert np.array_equal(first.episodes.cost, second.episodes.cost)


def test_every_autopilot_ends_on_the_new_course(chain):
    for pilot in chain[1].verification.pilots:
        _, headings, rudders = pilot.step
        assert len(headings) == len(rudders) == 25
        assert np.degrees(headings[:, -1]) == pytest.approx(20.0, abs=1.5)


def test_an_unstable_model_gives_a_report_that_says_so_and_no_model(
    unstable_ship, tmp_path
):
    result = build_autopilot(unstable_ship, tmp_path / "report", draws=10)
    assert not result.stable
    assert sorted(path.name for path in (tmp_path / "report").iterdir()) == [
        "metrics.json",
        "report.html",
    ]
    assert (
        "runs away"
        in json.loads((tmp_path / "report" / "metrics.json").read_text())["instability"]
    )
    page = (tmp_path / "report" / "report.html").read_text()
    assert "The identified model is unstable" in page
    assert "N_vvr" not in page


def test_too_few_draws_are_refused(demo, tmp_path):
    with pytest.raises(InputError, match="draws: expected"):
        build_autopilot(demo, tmp_path / "report", draws=1)
    assert list(tmp_path.iterdir()) == []


def test_a_rudder_of_the_wrong_sign_is_noticed(demo, tmp_path):
    text = (
        demo.read_text()
        .replace('"starboard"', '"port"')
        .replace('file = "', f'file = "{demo.parent}/')
    )
    (tmp_path / "ship.toml").write_text(text)
    with pytest.raises(InputError, match="opposite sign"):
        ShipFile.load(tmp_path / "ship.toml").trials()
    ship = ShipFile.load(demo)
    trials = [
        trial.with_channels({"delta": -trial["delta"]}) for trial in ship.trials()
    ]
    result = identify(trials, particulars=ship.particulars, steering=ship.steering)
    assert "likely a wrong rudder_positive" in model_warnings(result)[0]


def verified(**changes: float) -> dict:
    """Metrics of the Mariner with other coefficients, hardly uncertain."""
    mariner = load_model("mariner")
    coefficients = {**mariner.coefficients, **changes}
    spread = np.diag([(1e-4 * value) ** 2 for value in coefficients.values()])
    found = verify(
        replace(mariner, coefficients=coefficients, covariance=spread),
        4,
        0,
        designs=("pid", "lq"),
    )
    metrics = verification_metrics(found)
    json.dumps(metrics, allow_nan=False)
    return metrics


def test_a_ship_with_complex_steering_poles_has_no_nomoto_time_constants():
    metrics = verified(N_v=1.2e-3, Y_r=-1e-2, Y_d=-1e-3)
    assert metrics["nomoto"]["T1"] is None
    assert metrics["nomoto"]["K"] > 0.0


def test_an_autopilot_that_cannot_be_designed_is_said_and_the_others_fly():
    """With T3 > T1 + T2 the first-order form of the PID design has no meaning."""
    metrics = verified(N_v=2e-3)
    assert metrics["ranking"] == ["lq"]
    assert "closed loop is unstable" in metrics["refused"]["pid"]
