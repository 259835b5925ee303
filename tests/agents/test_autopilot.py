import json
from dataclasses import replace

import numpy as np
import pytest

from agents.verification.chain import build_autopilot, verify
from agents.verification.result import verification_metrics
from agents.verification.tracks import keep_track
from identification import identify
from identification.judging.warnings import model_warnings
from shipgym import InputError, ShipFile, load_model


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
