"""A structure reduced on trials, identified again with what is left."""

from __future__ import annotations

from pathlib import Path

import pytest

from identification import ReducedIdentification, identify_reduced
from shipgym import InputError, ShipModel, Trial
from shipgym.ships import get_structure


@pytest.fixture(scope="module")
def found(noisy_trials: list[Trial], mariner: ShipModel) -> ReducedIdentification:
    options = {"particulars": mariner.particulars, "steering": mariner.steering}
    return identify_reduced(noisy_trials, tolerance=1e-4, **options)


def test_the_reduced_model_predicts_with_fewer_terms(
    found: ReducedIdentification, noisy_trials: list[Trial]
) -> None:
    few, many = len(found.reduced.coefficients), len(found.full.coefficients)
    assert few < many == 40
    kept = {
        name for q in found.structure.equations for name in found.structure.names(q)
    }
    assert set(found.reduced.coefficients) == kept < set(found.full.coefficients)
    held = noisy_trials[-1].name
    errors = [
        r.metrics["trials"][held]["rmse"]["r"] for r in (found.full, found.reduced)
    ]
    assert errors[1] < 1.2 * errors[0]
    told = found.to_dict()
    assert told["terms"] == {"full": 40, "reduced": few}
    assert told["equations"]["r"][0]["changed"] == ""


def test_the_model_carries_its_table(
    found: ReducedIdentification, tmp_path: Path
) -> None:
    found.reduced.model.save(tmp_path / "model.json")
    loaded = ShipModel.load(tmp_path / "model.json")
    assert loaded.dynamics == found.structure == get_structure(found.structure.name)


def test_a_grey_box_is_refused(noisy_trials: list[Trial], mariner: ShipModel) -> None:
    options = {
        "particulars": mariner.particulars,
        "structure": "grey-box",
        "reference_model": "mariner",
    }
    with pytest.raises(
        InputError,
        match="got 'grey-box', whose table adds to a reference ship",
    ):
        identify_reduced(noisy_trials, **options)


def test_a_structure_with_a_memory_of_yaw_is_refused(
    noisy_trials: list[Trial], mariner: ShipModel
) -> None:
    options = {"particulars": mariner.particulars, "structure": "nomoto2"}
    with pytest.raises(
        InputError,
        match="whose memory of yaw has no regression",
    ):
        identify_reduced(noisy_trials, **options)
