"""What an identification prints, draws and writes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from identification import IdentificationResult, identify
from identification.report.figures import rudder_at_windows
from identification.report.page import report_page
from identification.report.view import fit_view, short_names
from identification.result import FILES
from identification.validation.diagnostics import cross_correlation
from shipgym import ShipFile, ShipModel, Trial
from shipgym.ships.particulars import ADDED_MASSES
from tests.golden.texts import same_page, same_text

ROOT = Path(__file__).parents[2]
SAVE = """
import sys
from identification import identify
from shipgym import ShipFile
ship = ShipFile.load("examples/mariner/ship.toml")
identify(
    ship.trials(), method="abc-lssvr", particulars=ship.particulars, steering=ship.steering,
    hold_out=["zigzag_10_10.csv"], uncertainty="bootstrap",
).save(sys.argv[1])
"""


@pytest.fixture(scope="module")
def searched(noisy_trials: list[Trial], mariner: ShipModel) -> IdentificationResult:
    return identify(
        noisy_trials, method="abc-lssvr", particulars=mariner.particulars, steering=mariner.steering
    )


@pytest.fixture(scope="module")
def truncated(noisy_trials: list[Trial], mariner: ShipModel) -> IdentificationResult:
    return identify(noisy_trials, particulars=mariner.particulars, steering=mariner.steering)


def test_the_same_call_on_the_same_data_writes_the_same_bytes(tmp_path: Path) -> None:
    """Here, and in another process with other hashes of words."""
    command = [sys.executable, "-c", SAVE, str(tmp_path / "there")]
    environment = os.environ | {"PYTHONHASHSEED": "1", "PYTHONPATH": str(ROOT)}
    subprocess.run(command, cwd=ROOT, env=environment, check=True)
    ship = ShipFile.load(ROOT / "examples" / "mariner" / "ship.toml")
    settings = {"method": "abc-lssvr", "hold_out": ["zigzag_10_10.csv"], "uncertainty": "bootstrap"}
    result = identify(ship.trials(), particulars=ship.particulars, steering=ship.steering, **settings)
    result.save(tmp_path / "here")
    for name in FILES:
        assert (tmp_path / "here" / name).read_bytes() == (tmp_path / "there" / name).read_bytes()


def test_settings_hold_the_whole_call(truncated: IdentificationResult, tmp_path: Path) -> None:
    truncated.save(tmp_path)
    settings = json.loads((tmp_path / "settings.json").read_text())
    assert (settings["structure"], settings["method"], settings["samples"]) == (
        "abkowitz", "tls-svm", "spline"
    )  # fmt: skip
    assert settings["steering"]["rudder_rate_deg_s"] == 5.0
    assert [trial["use"] for trial in settings["trials"]] == ["fit", "fit", "fit", "validate"]


def test_figures_by_name(truncated: IdentificationResult, searched: IdentificationResult) -> None:
    held = f"prediction: {truncated.trials[-1].name}"
    common = {"fit", "residuals", "coefficients", "trials", held}
    assert truncated.plots().keys() == common | {"l-curve"}
    assert searched.plots().keys() == common | {"search"}


def test_the_fit_is_drawn_from_the_regression(truncated: IdentificationResult) -> None:
    traces = truncated.plots()["fit"].data
    seen = np.asarray(traces[0].y, dtype=float)
    seen = seen[np.isfinite(seen)]
    samples = truncated.samples
    np.testing.assert_allclose(seen, samples.targets["u"] / samples.duration, atol=1e-7, rtol=1e-4)


def test_residuals_come_with_bounds_of_white_noise(truncated: IdentificationResult) -> None:
    traces = truncated.plots()["residuals"].data
    bars, bound = traces[0], max(traces[2].y)
    autocorrelation = truncated.diagnostics["u"].residual_autocorrelation
    np.testing.assert_allclose(bars.y[: len(autocorrelation)], autocorrelation, atol=1e-6)
    step = int(np.ceil(truncated.samples.window / max(truncated.samples.window // 2, 1)))
    rows = -(-len(truncated.samples) // step)
    assert bound == pytest.approx(1.96 / np.sqrt(rows), rel=1e-6)


def test_the_rank_chosen_is_marked_on_the_l_curve(truncated: IdentificationResult) -> None:
    figure = truncated.plots()["l-curve"]
    curve = truncated.estimators["u"].l_curve_  # type: ignore[attr-defined]
    marked = next(trace for trace in figure.data if trace.name == "chosen")
    rank = truncated.diagnostics["u"].rank
    assert marked.x[0] == pytest.approx(curve.residual_norm[rank - 1], rel=1e-6)
    assert marked.y[0] == pytest.approx(curve.solution_norm[rank - 1], rel=1e-6)


def test_the_search_is_drawn_to_the_c_that_it_found(searched: IdentificationResult) -> None:
    traces = searched.plots()["search"].data
    assert traces[0].y[-1] == pytest.approx(1.0)
    assert np.all(np.diff(traces[0].y) <= 0.0)
    best = next(trace for trace in traces if trace.xaxis == "x2")
    assert best.y[-1] == pytest.approx(searched.estimators["u"].C_, rel=1e-5)  # type: ignore[attr-defined]


@pytest.mark.parametrize(("epsilon", "figures"), [(None, {"search"}), (0.1, set())])
def test_a_grey_box_tells_of_its_search_where_it_searched(
    noisy_trials: list[Trial], mariner: ShipModel, tmp_path: Path, epsilon: float | None, figures: set[str]
) -> None:
    options = {"particulars": mariner.particulars, "structure": "grey-box", "reference_model": "tanker"}
    result = identify(noisy_trials, method="rm-svm", epsilon=epsilon, **options)
    assert result.plots().keys() & {"search", "l-curve"} == figures
    if epsilon is None:
        panels = [trace.xaxis for trace in result.plots()["search"].data]
        assert sorted(panels) == ["x", "x2", "x2", "x2"]  # one search, a band for each equation
    result.save(tmp_path)
    assert "Mariner" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "beside the bare reference ship 'tanker" in " ".join(result.summary().split())


def test_a_channel_that_never_moves_is_no_trouble(mariner: ShipModel, cao_zigzag: Trial) -> None:
    """A term of constant shaft speed is 0 throughout; least squares leaves it out without a word."""
    steady = cao_zigzag.with_channels({**cao_zigzag.channels, "n": np.full_like(cao_zigzag.t, 1.2)})
    result = identify([steady], "surge-perturbed", particulars=mariner.particulars)
    assert np.all(np.isfinite(list(result.coefficients.values())))


def test_intervals_of_coefficients_are_theirs(truncated: IdentificationResult) -> None:
    """In per cent of the estimate, 1.96 standard errors to either side."""
    trace = truncated.plots()["coefficients"].data[0]
    drawn = dict(zip((text.split(":")[0] for text in trace.text), trace.error_x.array, strict=True))
    value, error = truncated.coefficients["X_u"], truncated.standard_errors["X_u"]
    assert drawn["X_u"] == pytest.approx(100.0 * 1.96 * error / abs(value), rel=1e-5)


def test_the_rudder_is_that_of_the_middle_of_each_window(truncated: IdentificationResult) -> None:
    samples, angles = truncated.samples, rudder_at_windows(truncated)
    assert angles is not None
    row, trial = 40, truncated.trials[0]
    assert samples.trial[row] == 0
    middle = samples.start[row] + 0.5 * samples.duration[row]
    assert angles[row] == pytest.approx(np.interp(middle, trial.t, trial["delta"]))


def test_cross_correlation_finds_the_delay() -> None:
    noise = np.random.default_rng(0).standard_normal(4000)
    lags = np.arange(-9, 10)
    found = cross_correlation(np.roll(noise, 3), noise, lags)
    assert lags[int(np.argmax(found))] == 3
    assert found.max() == pytest.approx(1.0, abs=0.01)
    assert np.abs(np.delete(found, 12)).max() < 4.0 / np.sqrt(4000)
    assert not cross_correlation(noise, np.ones(4000), lags).any()


def test_the_report_and_the_summary_are_the_golden_ones(truncated: IdentificationResult) -> None:
    assert same_page("identification", report_page(truncated))
    assert same_text("identification summary", truncated.summary())


def test_the_summary_prints_each_coefficient_with_its_error(truncated: IdentificationResult) -> None:
    rows = {
        cells[0]: cells[1:]
        for line in truncated.summary().splitlines()
        if len(cells := [cell.strip() for cell in line.replace("┃", "│").split("│")[1:-1]]) == 4
    }
    for name, error in truncated.standard_errors.items():
        value = truncated.coefficients[name]
        assert rows[name] == [f"{1e5 * value:.2f}", f"{1e5 * error:.2g}", f"{value / error:.1f}"]
    gear = truncated.model.steering
    assert rows["rudder limit"][:2] == [f"{gear.rudder_limit_deg:.4g}", "deg"]
    assert rows["rudder rate"] == [f"{gear.rudder_rate_deg_s:.4g}", "deg/s", "given"]
    assert rows["Y_vdot"][:2] == [f"{1e5 * truncated.model.particulars['Y_vdot']:.6g}", "1e-5"]


def test_the_page_shows_trials_in_degrees_and_knots(truncated: IdentificationResult) -> None:
    view = fit_view(truncated)
    for row, trial in zip(view["trials"], truncated.trials, strict=True):
        assert row["rudder"] == pytest.approx(np.degrees(np.abs(trial["delta"]).max()))
        assert row["speeds"][1] == pytest.approx(np.hypot(trial["u"], trial["v"]).max() / 0.514444, rel=1e-5)
        assert (row["samples"], row["duration"]) == (len(trial), trial.duration)
        assert row["interval"] == pytest.approx(trial.duration / (len(trial) - 1), rel=1e-6)
    particulars = {text: (value, unit) for text, _, value, unit in view["particulars"]}
    ship = truncated.model.particulars
    assert particulars["length between perpendiculars"] == (f"{ship['length']:.5g}", "m")
    assert particulars["mass"] == (f"{ship['mass'] / 1000.0:.5g}", "t")
    trials = truncated.metrics["trials"].values()
    unseen = [metrics["rmse"]["psi"] for metrics in trials if metrics["use"] == "validate"]
    errors = np.degrees(unseen)
    assert view["heading"]["unseen"]
    assert view["heading"]["largest"] == pytest.approx(errors.max())
    assert view["heading"]["median"] == pytest.approx(np.median(errors))
    for rows in view["coefficients"].values():
        for row in rows:
            assert row["value"] == pytest.approx(1e5 * truncated.coefficients[row["name"]])
            assert row["significant"] == (abs(row["t"]) >= 2.0)
    assert {name for name, _, _ in view["added_masses"]} == {n for n in ADDED_MASSES if ship[n] is not None}
    assert {n: v for n, _, v in view["added_masses"]}["N_rdot"] == pytest.approx(1e5 * ship["N_rdot"])
    assert view["derivatives"]


def test_short_names_are_those_without_folders_where_they_differ() -> None:
    t = np.arange(3.0)

    def named(*names: str) -> dict[str, str]:
        return short_names([Trial(t, {"u": t}, name=name) for name in names])

    assert named("a/one.csv", "b/two.csv") == {"a/one.csv": "one.csv", "b/two.csv": "two.csv"}
    assert named("a/one.csv", "b/one.csv") == {"a/one.csv": "a/one.csv", "b/one.csv": "b/one.csv"}
