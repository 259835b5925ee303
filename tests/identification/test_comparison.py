"""Methods are ranked by what they predict of trials that they have not seen."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identification import Comparison, compare_methods, cross_validate
from identification.pipeline.comparison import COMPARISON_FILES
from shipgym import InputError, ShipModel, Trial


@pytest.fixture(scope="module")
def comparison(noisy_trials: list[Trial], mariner: ShipModel) -> Comparison:
    methods = ["sg", "ls", "tls-svm", "rm-svm", "ls-svm"]
    options = {
        "particulars": mariner.particulars,
        "steering": mariner.steering,
    }
    return compare_methods(noisy_trials, methods, **options)


def test_the_smallest_error_stands_first(comparison: Comparison) -> None:
    errors = [fit.error for fit in comparison.ranked]
    assert errors == sorted(errors, key=lambda e: (e is None, e))
    assert comparison.ranked[-1].method == "sg"
    assert comparison.best is comparison.results[comparison.ranked[0].method]


def test_errors_are_those_of_the_trials_held_out(comparison: Comparison) -> None:
    first = comparison.ranked[0]
    held = comparison.best.trials[-1]
    rmse = comparison.best.metrics["trials"][held.name]["rmse"]
    ratios = [rmse[c] / np.std(held[c]) for c in ("u", "v", "r", "psi")]
    assert first.errors == {held.name: pytest.approx(np.mean(ratios))}
    assert first.heading_deg == pytest.approx(np.degrees(rmse["psi"]))
    assert not comparison.in_turn


def test_a_method_that_does_not_fit_the_structure_is_told(
    comparison: Comparison,
) -> None:
    assert comparison.refused.keys() == {"rm-svm"}
    assert "expected structure 'grey-box'" in comparison.refused["rm-svm"]


def test_it_is_written_with_every_model(comparison: Comparison, tmp_path: Path) -> None:
    comparison.save(tmp_path)
    names = {path.name for path in tmp_path.iterdir()}
    models = {f"model-{name}.json" for name in comparison.results}
    assert names == {"comparison.json"} | models
    assert names <= set(COMPARISON_FILES)
    told = json.loads((tmp_path / "comparison.json").read_text())
    assert [row["method"] for row in told["ranking"]] == [
        s.method for s in comparison.ranked
    ]
    assert (
        ShipModel.load(tmp_path / "model-ls.json").coefficients
        == comparison.results["ls"].coefficients
    )
    (first, result), *_ = comparison.results.items()
    alone = replace(comparison, ranked=comparison.ranked[:1], results={first: result})
    alone.save(tmp_path / "alone")
    assert (tmp_path / "alone" / f"model-{first}.json").exists()


def test_without_trials_to_validate_each_is_held_out_in_turn(
    noisy_trials: list[Trial], mariner: ShipModel
) -> None:
    options = {"particulars": mariner.particulars, "steering": mariner.steering}
    found = compare_methods(
        noisy_trials[:3], ["ls", "tls-svm"], structure="linear-steering", **options
    )
    assert found.in_turn
    assert list(found.ranked[0].errors) == [trial.name for trial in noisy_trials[:3]]


def test_two_trials_are_enough_to_hold_each_out(
    noisy_trials: list[Trial], mariner: ShipModel
) -> None:
    options = {"structure": "nomoto", "particulars": mariner.particulars}
    (first,) = compare_methods(noisy_trials[:2], ["ls"], **options).ranked
    seen = cross_validate(noisy_trials[:2], method="ls", **options)
    assert (
        list(first.errors) == list(seen) == [trial.name for trial in noisy_trials[:2]]
    )
    headings = [np.degrees(metrics["rmse"]["psi"]) for metrics in seen.values()]
    assert first.heading_deg == pytest.approx(np.mean(headings))
    with pytest.raises(
        InputError, match="trials: expected at least 2 to fit, to hold one out, got 1"
    ):
        cross_validate(noisy_trials[:1], **options)


def test_what_cannot_be_compared_is_named(
    noisy_trials: list[Trial], mariner: ShipModel
) -> None:
    options = {"particulars": mariner.particulars}
    with pytest.raises(InputError, match=r"method: expected .*got 'lsq'"):
        compare_methods(noisy_trials, ["ls", "lsq"], **options)
    with pytest.raises(InputError, match="methods: expected at least one"):
        compare_methods(noisy_trials, [], **options)
    with pytest.raises(InputError, match="expected at least 2 to fit"):
        compare_methods(noisy_trials[:1], ["ls"], **options)
    with pytest.raises(InputError, match="expected structure 'grey-box'"):
        compare_methods(noisy_trials, ["rm-svm"], **options)
