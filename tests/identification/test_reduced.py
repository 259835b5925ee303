"""A structure reduced on trials, identified again with what is left."""

from __future__ import annotations

import pytest

from identification import identify_reduced
from identification.reduced import zigzag_sensitivity
from shipgym import InputError, ShipModel, Trial


def test_the_reduced_model_predicts_with_fewer_terms(noisy_trials: list[Trial], mariner: ShipModel) -> None:
    options = {"particulars": mariner.particulars, "steering": mariner.steering}
    found = identify_reduced(noisy_trials, tolerance=1e-4, **options)
    few, many = len(found.reduced.coefficients), len(found.full.coefficients)
    assert few < many == 40
    kept = {name for q in found.structure.equations for name in found.structure.names(q)}
    assert set(found.reduced.coefficients) == kept < set(found.full.coefficients)
    held = noisy_trials[-1].name
    errors = [r.metrics["trials"][held]["rmse"]["r"] for r in (found.full, found.reduced)]
    assert errors[1] < 1.2 * errors[0]
    again = identify_reduced(noisy_trials, tolerance=1e-4, **options)
    assert again.structure == found.structure
    told = found.to_dict()
    assert told["terms"] == {"full": 40, "reduced": few}
    assert told["equations"]["r"]["path"][0]["changed"] == ""
    assert max(told["sensitivity"], key=lambda name: told["sensitivity"][name] or 0.0) in kept


def test_the_model_carries_its_table(
    noisy_trials: list[Trial], mariner: ShipModel, tmp_path_factory: pytest.TempPathFactory
) -> None:
    found = identify_reduced(
        noisy_trials, "forward", structure="linear-steering", particulars=mariner.particulars
    )
    path = tmp_path_factory.mktemp("reduced")
    found.reduced.save(path)
    loaded = ShipModel.load(path / "model.json")
    assert loaded.own_table == found.structure
    assert zigzag_sensitivity(loaded) == found.to_dict()["sensitivity"]


def test_a_grey_box_is_refused(noisy_trials: list[Trial], mariner: ShipModel) -> None:
    options = {"particulars": mariner.particulars, "structure": "grey-box", "reference_model": "mariner"}
    with pytest.raises(InputError, match="structure: 'grey-box' found, whose table stands beside"):
        identify_reduced(noisy_trials, **options)
