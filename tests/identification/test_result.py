"""What an identification prints, draws and writes."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from html import escape
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from identification import (
    RMSVM,
    IdentificationResult,
    Samples,
    TruncatedLSSVM,
    identify,
    plots,
    write_report,
)
from identification.estimators.search import BAND, LOG_C, SearchResult
from identification.judging.diagnostics import cross_correlation
from identification.judging.warnings import held_out_error
from identification.pipeline.result import FILES
from identification.pipeline.summary import coefficients_table
from identification.report.choice_figures import l_curve_figure, search_figure
from identification.report.choice_figures import truncated as with_a_rank
from identification.report.coefficient_figure import coefficients_figure
from identification.report.figures import (
    fit_figure,
    residual_figure,
    rudder_at_windows,
)
from identification.report.page import report_page, settings_rows
from identification.report.predictions import overview_figure, prediction_figure
from identification.report.tables import (
    coefficient_tables,
    index_lines,
    reference_rows,
    short_names,
    trial_row,
)
from identification.report.view import fit_view, quality_card
from shipgym import ShipFile, ShipModel, Trial
from shipgym.pages import NONE, environment, fixed
from shipgym.ships.particulars import ADDED_MASSES

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
    common = {"fit", "residuals", "coefficients", "trials", held}
    assert plots(truncated).keys() == common | {"l-curve"}
    assert plots(searched).keys() == common | {"search"}


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


def test_the_search_is_drawn_to_the_c_that_it_found(
    searched: IdentificationResult,
) -> None:
    traces = plots(searched)["search"].data
    assert traces[0].y[-1] == pytest.approx(1.0)
    assert np.all(np.diff(traces[0].y) <= 0.0)
    best = next(trace for trace in traces if trace.xaxis == "x2")
    assert best.y[-1] == pytest.approx(searched.estimators["u"].C_, rel=1e-5)  # type: ignore[attr-defined]


@pytest.mark.parametrize(("epsilon", "figures"), [(None, {"search"}), (0.1, set())])
def test_a_grey_box_tells_of_its_search_where_it_searched(
    noisy_trials: list[Trial],
    mariner: ShipModel,
    tmp_path: Path,
    epsilon: float | None,
    figures: set[str],
) -> None:
    options = {
        "particulars": mariner.particulars,
        "structure": "grey-box",
        "reference_model": "tanker",
    }
    result = identify(noisy_trials, method=RMSVM(epsilon=epsilon), **options)
    assert plots(result).keys() & {"search", "l-curve"} == figures
    if epsilon is None:
        panels = [trace.xaxis for trace in plots(result)["search"].data]
        assert sorted(panels) == [
            "x",
            "x2",
            "x2",
            "x2",
        ]  # one search, a band for each equation
    result.save(tmp_path)
    write_report(result, tmp_path)
    assert "Mariner" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "beside the bare reference ship 'tanker" in " ".join(
        result.summary().split()
    )


def test_a_channel_that_never_moves_is_no_trouble(
    mariner: ShipModel, cao_zigzag: Trial
) -> None:
    """A term of constant shaft speed is 0 throughout; least squares leaves it out."""
    steady = cao_zigzag.with_channels(
        {**cao_zigzag.channels, "n": np.full_like(cao_zigzag.t, 1.2)}
    )
    result = identify([steady], "surge-perturbed", particulars=mariner.particulars)
    assert np.all(np.isfinite(list(result.coefficients.values())))


def test_intervals_of_coefficients_are_theirs(truncated: IdentificationResult) -> None:
    """In per cent of the estimate, 1.96 standard errors to either side."""
    trace = plots(truncated)["coefficients"].data[0]
    drawn = dict(
        zip(
            (text.split(":")[0] for text in trace.text),
            trace.error_x.array,
            strict=True,
        )
    )
    value, error = truncated.coefficients["X_u"], truncated.standard_errors["X_u"]
    assert drawn["X_u"] == pytest.approx(100.0 * 1.96 * error / abs(value), rel=1e-5)


def test_the_rudder_is_that_of_the_middle_of_each_window(
    truncated: IdentificationResult,
) -> None:
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
        "coefficients-figure",
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
    assert 'id="coefficients-figure"' not in page
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


def section(macro: str, **data: Any) -> str:
    """What a macro of the sections on a fit shows."""
    imported = (
        '{% import "identification.report/sections.html" as sections with context %}'
    )
    return (
        environment()
        .from_string(f"{imported}{{{{ sections.{macro} }}}}")
        .render(contents=[], **data)
    )


def test_the_page_shows_trials_in_degrees_and_knots(
    truncated: IdentificationResult,
) -> None:
    view = fit_view(truncated)
    for row, trial in zip(view.trials, truncated.trials, strict=True):
        assert row.rudder == pytest.approx(np.degrees(np.abs(trial["delta"]).max()))
        fastest = np.hypot(trial["u"], trial["v"]).max() / 0.514444
        assert row.speeds is not None
        assert row.speeds.endswith(f" to {fastest:.1f}")
        assert (row.samples, row.duration) == (len(trial), trial.duration)
        assert row.interval == pytest.approx(trial.duration / (len(trial) - 1))
    ship, tables = truncated.model.particulars, section("ship_tables(fit)", fit=view)
    for text, shown in (
        ("length between perpendiculars", f"{ship['length']:.5g} m"),
        ("mass", f"{ship['mass'] / 1e3:.5g} t"),
        ("N_rdot", fixed(1e5 * ship["N_rdot"], 1)),
    ):
        assert re.search(f"<td>{text}</td>.*<td>{re.escape(shown)}</td>", tables)
    for rows in view.coefficients.values():
        for row in rows:
            value = truncated.coefficients[row.name]
            assert row.value == fixed(1e5 * value, 1)
            t = value / truncated.standard_errors[row.name]
            assert row.significant == (abs(t) >= 2.0)
    known = {name for name in ADDED_MASSES if ship[name] is not None}
    assert {row.name for row in view.added_masses} == known


def test_short_names_are_those_without_folders_where_they_differ() -> None:
    t = np.arange(3.0)

    def named(*names: str) -> dict[str, str]:
        return short_names([Trial(t, {"u": t}, name=name) for name in names])

    assert named("a/one.csv", "b/two.csv") == {
        "a/one.csv": "one.csv",
        "b/two.csv": "two.csv",
    }
    assert named("a/one.csv", "b/one.csv") == {
        "a/one.csv": "a/one.csv",
        "b/one.csv": "b/one.csv",
    }


def regression(rows: int, error: Any, equations: str = "r", **more: Any) -> Any:
    """A fit as figures need it: windows of 2 s, targets up to 1 over the first."""
    targets = np.linspace(0.0, 2.0, rows)
    time, half = 2.0 * np.arange(rows), np.arange(rows) * 2 // rows
    samples = Samples(
        dict.fromkeys(equations, targets[:, None]),
        dict.fromkeys(equations, targets + error),
        time,
        np.full(rows, 2.0),
        half,
        1,
    )
    estimators = dict.fromkeys(equations, SimpleNamespace(predict=lambda X: X[:, 0]))
    return SimpleNamespace(samples=samples, estimators=estimators, **more)


def test_of_many_windows_so_few_are_drawn_that_a_page_stays_small() -> None:
    """Of 5200 every second, with a gap between trials; yaw in degrees by the second."""
    figure = fit_figure(regression(5200, 0.1, "vr"))
    assert figure.layout.height == 95 * 4 + 80
    sway, yaw = (figure.data[k] for k in (0, 4))
    assert (sway.name, yaw.name, len(sway.y)) == ("trials", "trials", 2601)
    assert np.flatnonzero(np.isnan(sway.y)).tolist() == [1300]
    expected = np.linspace(0.0, 2.0, 5200)[::2] + 0.1
    np.testing.assert_allclose(np.delete(sway.y, 1300), expected / 2.0, rtol=1e-5)
    np.testing.assert_allclose(
        np.delete(yaw.y, 1300), np.degrees(expected / 2.0), rtol=1e-5
    )
    assert len(fit_figure(regression(4900, 0.1)).data[0].y) == 4901
    equal = next(trace for trace in figure.data if trace.name == "equal")
    np.testing.assert_allclose(
        equal.x, [0.0, 1.05], rtol=1e-3
    )  # from the least to the largest of both


@pytest.mark.parametrize(
    ("alike", "reach"), [(0.0, 3.0 * 1.96 / 20.0), (0.6, 0.66), (0.99, 1.05)]
)
def test_residuals_of_a_trial_without_a_rudder_are_drawn_with_themselves_alone(
    alike: float, reach: float
) -> None:
    """A tenth beyond the largest correlation, at least three bounds, at most 1.05."""
    rng = np.random.default_rng(0)
    error = rng.choice([-1.0, 1.0], 400)
    for k in range(1, 400):
        error[k] = error[k - 1] if rng.random() < alike else error[k]
    t = np.arange(9.0)
    figure = residual_figure(
        regression(400, error, trials=[Trial(t, {"r": t}, use="fit")])
    )
    bars, *bounds = figure.data
    assert (len(bars.x), bars.x[0], len(bounds)) == (24, 1, 2)
    assert sorted(bound.y[0] for bound in bounds) == pytest.approx([-0.098, 0.098])
    assert list(bounds[0].x) == [0.5, 24.5]
    low, high = figure.layout.yaxis.range
    assert (low, high) == (-high, pytest.approx(reach, rel=0.15))
    assert high == pytest.approx(
        min(max(1.1 * np.abs(bars.y).max(), 3.0 * 0.098), 1.05)
    )


def intervals(**given: tuple[float, float]) -> Any:
    coefficients, errors = (
        {name: pair[k] for name, pair in given.items()} for k in (0, 1)
    )
    fit: Any = SimpleNamespace(coefficients=coefficients, standard_errors=errors)
    return coefficients_figure(fit)


def test_a_coefficient_that_may_be_zero_is_not_significant() -> None:
    """Per cent of the estimate, of one that is 0 of 1."""
    figure = intervals(
        sure=(2.0, 0.5),
        unsure=(-1.0, 1.0),
        none=(0.0, 0.3),
        unknown=(4.0, np.nan),
        wild=(1.0, 9.0),
    )
    significant, other = figure.data
    assert [text.partition(":")[0] for text in significant.text] == ["sure", "unknown"]
    assert [text.partition(":")[0] for text in other.text] == ["unsure", "none", "wild"]
    assert significant.text[0] == "sure: ± 49 %"
    assert list(significant.x) == [100.0, 100.0]
    assert list(other.x) == [100.0, 0.0, 100.0]
    assert list(significant.error_x.array) == pytest.approx([49.0, 0.0])
    assert list(other.error_x.array) == pytest.approx([196.0, 58.8, 1764.0])
    assert list(other.y) == [1.0, 2.0, 4.0]


@pytest.mark.parametrize(
    ("count", "columns", "height"), [(11, 1, 330), (12, 2, 230), (13, 2, 250)]
)
def test_twelve_coefficients_stand_in_two_columns(
    count: int, columns: int, height: int
) -> None:
    figure = intervals(**{f"c{k}": (1.0, 0.1) for k in range(count)})
    axes = list(figure.select_yaxes())
    assert [name for axis in axes for name in axis.ticktext] == [
        f"c{k}" for k in range(count)
    ]
    assert (len(axes), figure.layout.height) == (columns, height)


def test_an_l_curve_is_drawn_where_a_rank_was_chosen_or_given() -> None:
    fit: Any = SimpleNamespace(
        estimators={
            "u": TruncatedLSSVM(selection="full"),
            "v": TruncatedLSSVM(selection="full", rank=2),
            "r": TruncatedLSSVM(),
            "p": SimpleNamespace(selection="gcv", rank=2),
        }
    )
    assert list(with_a_rank(fit)) == ["v", "r"]
    curve = SimpleNamespace(
        residual_norm=np.array([3.0, 2.0, 1.0]),
        solution_norm=np.array([1.0, 40.0, 5e3]),
    )
    for name in ("v", "r"):
        vars(fit.estimators[name]).update(l_curve_=curve, rank_=2)
    figure = l_curve_figure(with_a_rank(fit))
    assert [note.text for note in figure.layout.annotations] == [
        "sway: rank 2 of 3",
        "yaw: rank 2 of 3",
    ]
    line, chosen = figure.data[:2]
    assert (list(chosen.x), list(chosen.y)) == ([2.0], [40.0])
    assert list(line.text) == ["1", "2", "3"]


def test_a_search_that_leaves_nothing_is_drawn_as_it_is() -> None:
    """A band between 0 and 1; objectives by the final one, weights as powers of 10."""

    def search(
        value: float, history: list[float], variable: str, course: list[float]
    ) -> SearchResult:
        rounds = np.array(course)[:, None]
        return SearchResult(rounds[-1], value, np.array(history), rounds, 9, variable)

    both = {
        "v": search(0.0, [2.0, 0.0], BAND, [0.5, 0.2]),
        "r": search(2.0, [8.0, 2.0], BAND, [0.9, 0.1]),
    }
    figure = search_figure(both)
    for trace, values in zip(
        figure.data, ([2.0, 0.0], [4.0, 1.0], [0.5, 0.2], [0.9, 0.1]), strict=True
    ):
        assert list(trace.y) == pytest.approx(values)
    assert figure.layout.yaxis2.range == (0.0, 1.0)
    one = {"v": search(2.0, [8.0, 2.0], LOG_C, [1.0, 3.0])}
    figure = search_figure(one)
    for trace, values in zip(figure.data, ([4.0, 1.0], [10.0, 1000.0]), strict=True):
        assert list(trace.y) == pytest.approx(values)
    assert figure.layout.yaxis2.type == "log"


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


def test_trials_are_shown_together_where_all_have_heading_and_rudder() -> None:
    t = np.arange(4.0)
    whole = Trial(t, {"psi": 1.0 + 0.1 * t, "delta": 0.2 * t}, name="runs/a.csv")
    figure = overview_figure(
        [whole] * 3, {"runs/a.csv": Trial(t, {"psi": 1.0 + 0.3 * t})}
    )
    assert figure is not None
    assert figure.layout.height == 540
    assert [note.text for note in figure.layout.annotations] == ["a.csv"] * 3
    for line, values in zip(figure.data, (0.2 * t, 0.1 * t, 0.3 * t), strict=False):
        np.testing.assert_allclose(line.y, np.degrees(values), atol=1e-5)
    for name in ("psi", "delta"):
        assert overview_figure([whole, Trial(t, {name: t})], {}) is None


@pytest.mark.parametrize(("largest", "step"), [(99.0, "D2"), (101.0, 1)])
def test_less_than_two_decades_are_drawn_in_steps_of_1_2_and_5(
    largest: float, step: object
) -> None:
    norms = np.array([1.0, 7.0, largest])
    curve = SimpleNamespace(residual_norm=norms, solution_norm=np.array([0.0, 1.0, 2]))
    estimator = TruncatedLSSVM()
    vars(estimator).update(l_curve_=curve, rank_=2)
    axes = l_curve_figure({"u": estimator}).layout
    assert (axes.xaxis.dtick, axes.xaxis.type) == (step, "log")
    assert axes.yaxis.dtick == 1


def test_settings_are_told_in_words() -> None:
    settings = {
        "guarded": True,
        "hold_out": ["a.csv", "b.csv"],
        "samples": {"rule": "euler", "window": None},
        "preprocessing": {"smoothing": "rts", "repair": False},
        "name": None,
        "trials": [],
    }
    assert settings_rows(settings) == {
        "guarded": "yes",
        "hold out": "a.csv, b.csv",
        "samples": "rule euler",
        "preprocessing": "smoothing rts, repair no",
    }
    assert settings_rows({"hold_out": []}) == {"hold out": NONE}


def test_what_a_trial_did_not_record_is_left_out() -> None:
    t = np.arange(5.0)
    speed = 0.514444 * np.array([6.0, 8.0, 7.0, 6.5, 7.5])
    heading = Trial(
        2.0 * t,
        {"psi": t, "u": speed},
        kind="turning-circle",
        use="validate",
        derived=["u"],
    )
    row = trial_row(heading, "short")
    assert (row.rudder, row.speeds, row.derived) == (None, None, "u")
    assert (row.kind, row.use) == ("turning circle", "validate")
    assert (row.samples, row.duration, row.interval) == (5, 8.0, 2.0)
    channels = {"u": 0.6 * speed, "v": -0.8 * speed, "delta": -0.1 * t}
    whole = trial_row(Trial(t, channels), "whole")
    assert (whole.speeds, whole.kind, whole.derived) == ("6.0 to 8.0", None, "none")
    assert whole.rudder == pytest.approx(np.degrees(0.4))


def test_headings_of_trials_that_were_fitted_are_told_where_none_is_held_out() -> None:
    def card(**uses: tuple[str, float | None]) -> Any:
        trials = {}
        for name, (use, degrees) in uses.items():
            psi = None if degrees is None else np.radians(degrees)
            trials[f"runs/{name}.csv"] = {"use": use, "rmse": {"psi": psi}}
        return quality_card(SimpleNamespace(metrics={"trials": trials}))  # type: ignore[arg-type]

    found = card(a=("fit", 1.0), b=("fit", 4.0), c=("fit", 2.0), d=("fit", None))
    assert found.value == "2.0°"
    assert found.detail.endswith(
        "fitted trials, none to validate; largest 4.0° (b.csv)"
    )
    found = card(a=("fit", 9.0), b=("validate", 3.0))
    assert found.detail.endswith("median of trials not fitted; largest 3.0° (b.csv)")
    assert card(a=("fit", 9.0), b=("validate", None)).value == NONE


def test_an_index_is_told_where_the_trial_has_it() -> None:
    pair = {"measured": 8.0, "predicted": 7.0}
    metrics = {
        "overshoot_1_deg": pair | {"closed_loop": 7.5},
        "advance_lengths": None,
        "transfer_lengths": pair,
    }
    assert index_lines(metrics) == [
        "1st overshoot 8.00 → 7.00 (7.50) deg",
        "transfer 8.00 → 7.00 L",
    ]
    assert index_lines({}) == [NONE]


def test_a_bare_reference_ship_stands_beside_the_fit_by_the_names_of_trials() -> None:
    own = {"a/one": {"rmse": {"psi": 0.1}}, "a/two": {"rmse": {"psi": 0.2}}}
    bare = {"a/one": {"rmse": {"psi": 0.3}}, "a/two": {"rmse": {"psi": None}}}
    metrics = {"trials": own, "reference": {"name": "tanker", "trials": bare}}
    fit: Any = SimpleNamespace(metrics=metrics)
    rows = reference_rows(fit, {"a/one": "one", "a/two": "two"})
    assert rows == [("one", 0.1, 0.3), ("two", 0.2, None)]


def test_coefficients_without_errors_are_significant_unless_they_are_zero() -> None:
    """Accelerations in their own units; with an error two of these are needed."""
    dynamics = SimpleNamespace(normalisation="si", quantity="acceleration")
    given = {
        "b_v": (3.0, 0.0),
        "b_r": (0.0, 0.0),
        "c_v": (-1.99, 1.0),
        "c_r": (-2.0, 1.0),
    }
    fit: Any = SimpleNamespace(
        model=SimpleNamespace(dynamics=dynamics),
        coefficients={name: pair[0] for name, pair in given.items()},
        standard_errors={name: pair[1] for name, pair in given.items()},
    )
    ((title, rows),) = coefficient_tables(fit).items()
    assert title == "coefficient"
    assert [(row.t, row.significant) for row in rows] == [
        (None, True),
        (None, False),
        (-1.99, False),
        (-2.0, True),
    ]
    table = coefficients_table(fit)
    assert table.title == "Coefficients of accelerations, si units"
    assert list(table.columns[1].cells) == ["3", "0", "-1.99", "-2"]
    assert list(table.columns[3].cells) == ["-", "-", "-2.0", "-2.0"]
