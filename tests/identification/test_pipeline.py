from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identification import (
    LSSVM,
    IdentificationResult,
    Sampling,
    Uncertainty,
    identify,
    write_report,
)
from shipgym import InputError, ShipModel, Trial
from shipgym.manoeuvres import turning_circle, turning_indices, zigzag, zigzag_indices
from shipgym.models.simulate import open_loop


def errors_percent(result: IdentificationResult, truth: ShipModel) -> dict[str, float]:
    return {
        name: 100.0 * abs(value / truth.coefficients[name] - 1.0)
        for name, value in result.coefficients.items()
    }


def within_one_per_cent(result: IdentificationResult, truth: ShipModel) -> int:
    return sum(error < 1.0 for error in errors_percent(result, truth).values())


def test_integral_samples_are_in_between(cao_zigzag: Trial, mariner: ShipModel) -> None:
    fit = identify([cao_zigzag], samples="integral", particulars=mariner.particulars)
    assert within_one_per_cent(fit, mariner) == 25
    assert 100.0 < max(errors_percent(fit, mariner).values()) < 1000.0


def test_switch_on_the_step_and_rounded_files_are_as_good(
    mariner: ShipModel, record: Any
) -> None:
    run = record(
        zigzag(mariner, 15, 15, duration=500, dt=0.1, switch="step"),
        every=5,
        name="step",
    )
    rounded = Trial(
        run.t,
        {c: [float(f"{x:.8g}") for x in v] for c, v in run.channels.items()},
        kind="zigzag",
    )
    assert (
        within_one_per_cent(
            identify([rounded], particulars=mariner.particulars), mariner
        )
        == 40
    )


def test_manoeuvres_not_seen_are_predicted_to_a_thousandth(
    cao_fit: IdentificationResult, mariner: ShipModel
) -> None:
    for truth in (
        zigzag(mariner, 25, 25, duration=600),
        turning_circle(mariner, 30, duration=900),
    ):
        predicted = open_loop(cao_fit.model, truth)
        span = max(np.ptp(truth["x"]), np.ptp(truth["y"]))
        away = np.hypot(predicted["x"] - truth["x"], predicted["y"] - truth["y"])
        assert np.sqrt(np.mean(away**2)) < 1e-3 * span


def test_noisy_trials_give_a_model_that_manoeuvres_like_the_ship(
    noisy_fit: IdentificationResult, mariner: ShipModel
) -> None:
    assert noisy_fit.stable
    for side in (35.0, -35.0):
        expected = turning_indices(
            turning_circle(mariner, side)
        ).tactical_diameter_lengths
        found = turning_indices(
            turning_circle(noisy_fit.model, side)
        ).tactical_diameter_lengths
        assert found == pytest.approx(expected, rel=0.05)
    validation = noisy_fit.metrics["trials"]["zigzag_15_15"]
    assert np.degrees(validation["rmse"]["r"]) < 0.02


def test_trials_to_validate_influence_nothing(
    noisy_trials: list[Trial], noisy_fit: IdentificationResult, mariner: ShipModel
) -> None:
    alone = identify(
        noisy_trials[:3], particulars=mariner.particulars, steering=mariner.steering
    )
    assert alone.coefficients == noisy_fit.coefficients
    np.testing.assert_array_equal(alone.model.covariance, noisy_fit.model.covariance)
    assert alone.model.provenance == noisy_fit.model.provenance
    np.testing.assert_array_equal(
        alone.model.envelope.high, noisy_fit.model.envelope.high
    )  # type: ignore[union-attr]


def test_identification_is_repeatable_to_the_bit(
    noisy_trials: list[Trial], mariner: ShipModel
) -> None:
    first, second = (
        identify(noisy_trials[:1], particulars=mariner.particulars, samples="integral")
        for _ in range(2)
    )
    assert first.coefficients == second.coefficients


def test_metrics_have_the_promised_form(
    noisy_fit: IdentificationResult, mariner: ShipModel
) -> None:
    metrics = noisy_fit.metrics["trials"]["zigzag_15_15"]
    assert set(metrics) == {
        "use",
        "diverged",
        "rmse",
        "overshoot_1_deg",
        "overshoot_2_deg",
        "advance_lengths",
        "transfer_lengths",
        "tactical_diameter_lengths",
    }
    assert metrics["use"] == "validate"
    assert metrics["diverged"] is False
    assert set(metrics["rmse"]) == {"u", "v", "r", "psi"}
    assert metrics["advance_lengths"] is None
    overshoot = metrics["overshoot_1_deg"]
    truth = zigzag_indices(
        zigzag(mariner, 15, 15, port_first=True, duration=400)
    ).overshoot_1_deg
    assert overshoot["measured"] == pytest.approx(truth, abs=0.15)
    assert overshoot["predicted"] == pytest.approx(overshoot["measured"], abs=1.5)


def test_result_is_saved_whole_and_read_back(
    noisy_fit: IdentificationResult, tmp_path: Path
) -> None:
    noisy_fit.save(tmp_path / "ship")
    write_report(noisy_fit, tmp_path / "ship")
    names = ["metrics.json", "model.json", "report.html", "settings.json"]
    assert sorted(path.name for path in (tmp_path / "ship").iterdir()) == names
    loaded = ShipModel.load(tmp_path / "ship" / "model.json")
    assert loaded.coefficients == noisy_fit.coefficients
    assert loaded.provenance == noisy_fit.model.provenance
    assert (
        json.loads((tmp_path / "ship" / "metrics.json").read_text())
        == noisy_fit.metrics
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"particulars": None}, r"particulars: .*length"),
        ({"structure": "abkowits"}, "abkowitz"),
        ({"structure": 3}, r"structure: .*3"),
        ({"method": "svm"}, r"method: .*'tls-svm'.*Did you mean"),
        ({"samples": "cubic"}, r"samples: .*'cubic'"),
        ({"preprocessing": "cubic"}, r"preprocessing: .*'cubic'"),
        ({"uncertainty": "large"}, r"uncertainty: .*'large'"),
        ({"prior": "tanker"}, r"prior: expected none but with structure 'mmg'"),
        ({"prior": 3}, r"prior: .*3"),
        ({"structure": "mmg", "method": "tls-svm"}, "method: expected none with"),
        ({"method": "map"}, r"method: .*or 'map' with structure 'mmg', got 'map'"),
        ({"kernel": "poly"}, r"kernel: .*'poly'"),
        ({"current": "tide"}, r"current: .*'tide'"),
        ({"current": {"north": 0.1}}, r"current: .*'east'"),
        ({"wind": 3}, r"wind: .*3"),
        ({"guarded": "no"}, r"guarded: .*'no'"),
        ({"name": " "}, "name: "),
        ({"service_shaft_speed": 0.0}, "service_shaft_speed: "),
        ({"steering": 3.0}, r"steering: .*3.0"),
        ({"reference_model": "kvlcc2"}, r"reference_model: .*'abkowitz'.*'kvlcc2'"),
        ({"structure": "grey-box", "reference_model": 3}, r"reference_model: .*3"),
    ],
)
def test_wrong_arguments_are_named(
    cao_zigzag: Trial, mariner: ShipModel, arguments: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        identify([cao_zigzag], **{"particulars": mariner.particulars, **arguments})


def test_no_trial_to_fit_and_two_of_one_name_are_refused(
    cao_zigzag: Trial, mariner: ShipModel
) -> None:
    with pytest.raises(InputError, match='at least one that is marked use = "fit"'):
        identify([cao_zigzag.with_(use="validate")], particulars=mariner.particulars)
    with pytest.raises(InputError, match="two trials named 'zigzag_15_15'"):
        identify([cao_zigzag, cao_zigzag], particulars=mariner.particulars)


@pytest.mark.parametrize("method", ["ls", LSSVM(C=1e12)], ids=str)
def test_least_squares_and_ls_svm_agree_where_there_is_no_noise(
    cao_zigzag: Trial, mariner: ShipModel, method: Any
) -> None:
    fit = identify([cao_zigzag], method=method, particulars=mariner.particulars)
    assert within_one_per_cent(fit, mariner) == 40


def test_provenance_and_settings_tell_how_a_model_was_made(
    cao_zigzag: Trial, mariner: ShipModel
) -> None:
    given = LSSVM(C=1e5)
    fit = identify(
        [cao_zigzag],
        "nomoto",
        given,
        Sampling("integral", 4),
        mariner.particulars,
        preprocessing="none",
        uncertainty=Uncertainty(model_error=False),
    )
    provenance = fit.model.provenance or {}
    assert (provenance["method"], provenance["samples"]) == ("ls-svm", "integral")
    assert provenance["settings"] == {
        "samples": {"rule": "integral", "window": 4},
        "preprocessing": {"smoothing": "none", "repair": False},
        "guarded": True,
        "method": fit.settings["method"],
    }
    assert fit.settings["method"]["C"] == 1e5
    assert fit.settings["uncertainty"]["model_error"] is False
    assert fit.settings["trials"][0]["sha256"] == cao_zigzag.sha256
