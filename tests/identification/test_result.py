"""What an identification prints, draws and writes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from html import escape
from pathlib import Path

import numpy as np
import pytest

from identification import (
    IdentificationResult,
    identify,
    plots,
    write_report,
)
from identification.judging.warnings import held_out_error
from identification.pipeline.result import FILES
from identification.report.page import report_page
from identification.report.predictions import prediction_figure
from shipgym import ShipFile, ShipModel, Trial
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
    hold_out=["zigzag_10_10.csv"],
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
    settings = {
        "method": "abc-lssvr",
        "hold_out": ["zigzag_10_10.csv"],
    }
    result = identify(
        ship.trials(), particulars=ship.particulars, steering=ship.steering, **settings
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


def test_figures_by_name(
    truncated: IdentificationResult, searched: IdentificationResult
) -> None:
    held = f"prediction: {truncated.trials[-1].name}"
    common = {"fit", "residuals", "trials", held}
    assert plots(truncated).keys() == common | {"l-curve"}
    assert plots(searched).keys() == common


def test_the_fit_is_drawn_from_the_regression(truncated: IdentificationResult) -> None:
    traces = plots(truncated)["fit"].data
    seen = np.asarray(traces[0].y, dtype=float)
    seen = seen[np.isfinite(seen)]
    samples = truncated.samples
    np.testing.assert_allclose(
        seen, samples.targets["u"] / samples.duration, atol=1e-7, rtol=1e-4
    )


def test_residuals_come_with_bounds_of_white_noise(
    truncated: IdentificationResult,
) -> None:
    traces = plots(truncated)["residuals"].data
    bars, bound = traces[0], max(traces[2].y)
    autocorrelation = truncated.diagnostics["u"].residual_autocorrelation
    np.testing.assert_allclose(
        bars.y[: len(autocorrelation)], autocorrelation, atol=1e-6
    )
    step = int(
        np.ceil(truncated.samples.window / max(truncated.samples.window // 2, 1))
    )
    rows = -(-len(truncated.samples) // step)
    assert bound == pytest.approx(1.96 / np.sqrt(rows), rel=1e-6)


def test_the_rank_chosen_is_marked_on_the_l_curve(
    truncated: IdentificationResult,
) -> None:
    figure = plots(truncated)["l-curve"]
    curve = truncated.estimators["u"].l_curve_  # type: ignore[attr-defined]
    marked = next(trace for trace in figure.data if trace.name == "chosen")
    rank = truncated.diagnostics["u"].rank
    assert marked.x[0] == pytest.approx(curve.residual_norm[rank - 1], rel=1e-6)
    assert marked.y[0] == pytest.approx(curve.solution_norm[rank - 1], rel=1e-6)


def test_a_channel_that_never_moves_is_no_trouble(
    mariner: ShipModel, cao_zigzag: Trial
) -> None:
    """A term of constant shaft speed is 0 throughout; least squares leaves it out."""
    steady = cao_zigzag.with_channels(
        {**cao_zigzag.channels, "n": np.full_like(cao_zigzag.t, 1.2)}
    )
    result = identify([steady], "surge-perturbed", particulars=mariner.particulars)
    assert np.all(np.isfinite(list(result.coefficients.values())))


def test_the_report_shows_trials_coefficients_and_figures(
    truncated: IdentificationResult,
) -> None:
    page = report_page(truncated)
    assert escape(held_out_error(truncated)) in page
    for name, value in truncated.coefficients.items():
        assert f"<td>{name}</td><td>{fixed(1e5 * value, 1)}</td>" in page
    for trial in truncated.trials:
        assert trial.raw.sha256[:16] in page
    figures = (
        "fit-figure",
        "residuals-figure",
        "l-curve-figure",
    )
    for figure in (*figures, "fitted-trials", "prediction-0"):
        assert f'id="{figure}"' in page


def test_the_report_of_an_unstable_model_shows_no_coefficient(
    truncated: IdentificationResult,
) -> None:
    held = truncated.trials[-1].name
    lost = replace(truncated, predictions=truncated.predictions | {held: None})
    page = report_page(lost)
    assert "runs away on 1 of the recorded trials" in page
    assert "It must not be used." in page
    assert 'id="fit-figure"' in page
    assert "<td>X_u</td>" not in page


def test_the_summary_prints_each_coefficient_with_its_error(
    truncated: IdentificationResult,
) -> None:
    rows = {
        cells[0]: cells[1:]
        for line in truncated.summary().splitlines()
        if len(
            cells := [cell.strip() for cell in line.replace("┃", "│").split("│")[1:-1]]
        )
        == 4
    }
    for name, error in truncated.standard_errors.items():
        value = truncated.coefficients[name]
        assert rows[name] == [
            f"{1e5 * value:.2f}",
            f"{1e5 * error:.2g}",
            f"{value / error:.1f}",
        ]
    gear = truncated.model.steering
    assert rows["rudder limit"][:2] == [f"{gear.rudder_limit_deg:.4g}", "deg"]
    assert rows["rudder rate"] == [f"{gear.rudder_rate_deg_s:.4g}", "deg/s", "given"]
    assert rows["Y_vdot"][:2] == [
        f"{1e5 * truncated.model.particulars['Y_vdot']:.6g}",
        "1e-5",
    ]


def test_a_turn_is_drawn_to_scale_and_seen_from_its_first_course() -> None:
    """First to the east: what is ahead is east, what is to starboard is south."""
    t = np.arange(4.0)
    channels = {
        "x": 5.0 - t,
        "y": 3.0 + t**2,
        "psi": np.pi / 2.0 + 0.1 * t,
        "r": 0.1 + 0.0 * t,
        "delta": 0.2 * t,
    }
    turn = Trial(t, channels, kind="turning-circle")
    predicted = turn.with_channels({"x": 5.0 - 2.0 * t})
    *lines, measured, ours = prediction_figure(turn, predicted).data
    assert [line.name for line in lines] == ["measured", "predicted"] * 2 + [
        "measured"
    ]  # u, v are not known
    np.testing.assert_allclose(lines[-1].y, np.degrees(0.2 * t), rtol=1e-6)
    np.testing.assert_allclose([measured.x, measured.y], [t, t**2], atol=1e-5)
    np.testing.assert_allclose([ours.x, ours.y], [2.0 * t, t**2], atol=1e-5)
    layout = prediction_figure(turn, predicted).layout
    assert (layout.xaxis6.title.text, layout.yaxis6.title.text) == (
        "to starboard, m",
        "along the first course, m",
    )
    assert (layout.yaxis6.scaleanchor, layout.yaxis6.scaleratio) == ("x6", 1)
    straight = prediction_figure(Trial(t, channels, kind="zigzag"), None)
    np.testing.assert_allclose(
        [straight.data[-1].x, straight.data[-1].y], [t**2, t], atol=1e-5
    )
    assert straight.layout.yaxis6.autorange == "reversed"
    assert {line.name for line in straight.data} == {"measured"}
    assert [straight.layout[f"xaxis{k}"].title.text for k in (1, 2, 3, 4, 5)] == [
        "",
        "",
        "",
        "time, s",
        "time, s",
    ]
