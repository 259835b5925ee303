"""What an identification prints, draws and writes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from html import escape
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from identification import (
    IdentificationResult,
    identify,
    write_report,
)
from identification.judging.warnings import held_out_error
from identification.pipeline.result import FILES
from identification.report.view import report_page
from shipgym import InputError, ShipFile, ShipModel, Trial
from shipgym.pages import fixed

ROOT = Path(__file__).parents[2]
SAVE = """
import sys
from identification import identify, write_report
from shipgym import ShipFile
ship = ShipFile.load("examples/mariner/ship.toml")
result = identify(
    ship.trials(), method="abc-lssvr",
    particulars=ship.particulars, steering=ship.steering,
)
result.save(sys.argv[1])
write_report(result, sys.argv[1])
"""


@pytest.fixture(scope="module")
def searched(noisy_trials: list[Trial], mariner: ShipModel) -> IdentificationResult:
    return identify(
        noisy_trials,
        method="abc-lssvr",
        particulars=mariner.particulars,
        steering=mariner.steering,
    )


@pytest.fixture(scope="module")
def truncated(noisy_trials: list[Trial], mariner: ShipModel) -> IdentificationResult:
    return identify(
        noisy_trials, particulars=mariner.particulars, steering=mariner.steering
    )


def test_the_same_call_on_the_same_data_writes_the_same_bytes(tmp_path: Path) -> None:
    """Here, and in another process with other hashes of words."""
    command = [sys.executable, "-c", SAVE, str(tmp_path / "there")]
    environment = os.environ | {"PYTHONHASHSEED": "1", "PYTHONPATH": str(ROOT)}
    subprocess.run(command, cwd=ROOT, env=environment, check=True)
    ship = ShipFile.load(ROOT / "examples" / "mariner" / "ship.toml")
    result = identify(
        ship.trials(),
        method="abc-lssvr",
        particulars=ship.particulars,
        steering=ship.steering,
    )
    result.save(tmp_path / "here")
    write_report(result, tmp_path / "here")
    for name in FILES:
        assert (tmp_path / "here" / name).read_bytes() == (
            tmp_path / "there" / name
        ).read_bytes()


def test_settings_hold_the_whole_call(
    truncated: IdentificationResult, tmp_path: Path
) -> None:
    truncated.save(tmp_path)
    settings = json.loads((tmp_path / "settings.json").read_text())
    assert (settings["structure"], settings["method"], settings["samples"]) == (
        "abkowitz",
        "tls-svm",
        {"rule": "spline", "window": None},
    )
    assert settings["steering"]["rudder_rate_deg_s"] == 5.0
    assert [trial["use"] for trial in settings["trials"]] == [
        "fit",
        "fit",
        "fit",
        "validate",
    ]


def test_the_report_shows_trials_coefficients_and_figures(
    truncated: IdentificationResult,
) -> None:
    page = report_page(truncated)
    assert escape(held_out_error(truncated)) in page
    for name, value in truncated.coefficients.items():
        assert f"<td>{name}</td><td>{fixed(1e5 * value, 1)}</td>" in page
    for trial in truncated.trials:
        assert trial.raw.sha256[:16] in page
    figures = ("l-curve-figure", "fitted-trials", "prediction-0")
    for figure in figures:
        assert f'id="{figure}"' in page


def test_the_report_of_an_unstable_model_shows_no_coefficient(
    truncated: IdentificationResult,
) -> None:
    held = truncated.trials[-1].name
    lost = replace(truncated, predictions=truncated.predictions | {held: None})
    page = report_page(lost)
    assert "runs away on 1 of the recorded trials" in page
    assert "It must not be used." in page
    assert 'id="l-curve-figure"' in page
    assert "<td>X_u</td>" not in page


def test_a_notebook_shows_a_card_and_frames(truncated: IdentificationResult) -> None:
    card = repr(truncated)
    assert len(card.splitlines()) <= 10
    assert held_out_error(truncated) in card
    frame = truncated.to_frame()
    assert frame["value"].to_dict() == truncated.coefficients
    assert "<td>" in truncated._repr_html_()
    uses = [trial.use for trial in truncated.trials]
    assert truncated.trials_frame()["use"].tolist() == uses


def test_a_trial_and_its_prediction_are_drawn_on_the_axes_of_a_user(
    truncated: IdentificationResult,
) -> None:
    ax = Figure().subplots()
    assert truncated.plot("r", ax=ax) is ax
    labels = [line.get_label() for line in ax.lines]
    assert labels == ["measured", "predicted"]
    with pytest.raises(InputError, match="trial: expected one of"):
        truncated.plot(trial="none")
