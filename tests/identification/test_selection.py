"""Where no structure is named, the one that predicts held-out trials best is used."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from identification import LSSVM, IdentificationResult, identify
from shipgym import InputError, Particulars, ShipModel, SteeringGear, Trial
from shipgym.manoeuvres import zigzag
from shipgym.models.linear import straight_running
from shipgym.trials.derivatives import time_derivative

Auto = Callable[..., IdentificationResult]


@pytest.fixture(scope="module")
def trials(mariner: ShipModel, record: Callable[..., Trial]) -> list[Trial]:
    runs = [(10, False), (20, False), (20, True)]
    return [
        record(
            zigzag(mariner, angle, angle, port, 300, 0.25),
            4,
            1.0,
            5 + k,
            name=f"zigzag {k}",
        )
        for k, (angle, port) in enumerate(runs)
    ]


@pytest.fixture
def auto(mariner: ShipModel) -> Auto:
    """`identify` with the structure left open."""

    def run(trials: list[Trial], **options: object) -> IdentificationResult:
        particulars, steering = mariner.particulars, mariner.steering
        return identify(
            trials, "auto", particulars=particulars, steering=steering, **options
        )

    return run


def test_the_structure_that_predicts_best_is_taken_and_the_ranking_told(
    auto: Auto, trials: list[Trial], mariner: ShipModel
) -> None:
    turned = trials[2].with_(use="validate")
    result = auto([*trials[:2], turned])
    told = result.metrics["selection"]
    best = told["ranking"][0]
    structures = {row["structure"] for row in told["ranking"]}
    assert best["structure"] == result.model.structure == "grey-box"  # of herself
    assert {"nomoto", "steering7", "abkowitz"} <= structures
    of_yaw = next(row for row in told["ranking"] if row["structure"] == "norrbin")
    assert of_yaw["scales"]["u"] > 3.0 * best["scales"]["u"]  # it cannot say the speed
    assert "channel 'n' is missing" in told["refused"]["cubic by tls-svm"]
    assert result.model.provenance is not None
    assert result.model.provenance["selection"] == told
    assert result.settings["structure"] == "auto"
    # a trial that is not to fit has no part in it
    assert auto(trials[:2]).metrics["selection"] == told
    alone = identify(
        [*trials[:2], turned],
        "grey-box",
        best["method"],
        reference_model="auto",
        particulars=mariner.particulars,
        steering=mariner.steering,
    )
    assert alone.coefficients == result.coefficients


def test_a_single_trial_is_cut_into_thirds(auto: Auto, trials: list[Trial]) -> None:
    result = auto(trials[1:2])
    told = result.metrics["selection"]
    assert told["held_out"] == "each third of the only trial"
    assert result.trials == (trials[1],)


def test_a_method_or_setting_that_is_named_is_kept(
    auto: Auto, trials: list[Trial]
) -> None:
    result = auto(trials[:2], method=LSSVM(C=1e5))
    assert {row["method"] for row in result.metrics["selection"]["ranking"]} == {
        "ls-svm"
    }
    assert result.model.provenance["method"] == "ls-svm"


def nomoto_ship(bias_deg: float) -> ShipModel:
    """A ship of the first order whose rudder is off."""
    K, T = 0.08, 25.0
    constant = -K / T * np.radians(bias_deg)
    coefficients = {"c_0": constant, "c_r": -1.0 / T, "c_d": K / T}
    particulars = Particulars(length=150.0, speed=7.0)
    return ShipModel(
        "made", "nomoto-bias", particulars, SteeringGear(35.0, 2.5), coefficients
    )


def logged(ship: ShipModel, *angles: float) -> list[Trial]:
    """Heading and rudder of zigzags, as a bridge has them."""
    rng = np.random.default_rng(1)
    trials = []
    for angle in angles:
        run = zigzag(ship, abs(angle), abs(angle), angle < 0, 400, 1.0)
        psi = run["psi"] + np.radians(0.1) * rng.standard_normal(len(run))
        rate = time_derivative(run.t, psi)
        trial = Trial(
            run.t,
            {"psi": psi, "r": rate, "delta": run["delta"]},
            name=f"{angle:g}",
            kind="zigzag",
            derived=frozenset("r"),
        )
        trials.append(trial)
    return trials


@pytest.mark.parametrize(
    ("bias_deg", "angles"), [(0.0, (10.0, -10.0, 20.0)), (-1.5, (20.0,))]
)
def test_few_parameters_and_the_bias_of_the_rudder_are_found(
    bias_deg: float, angles: tuple[float, ...]
) -> None:
    """Of a ship of the first order, by three zigzags and by a single one."""
    trials = logged(nomoto_ship(bias_deg), *angles)
    result = identify(trials, "auto", particulars={"length": 150.0, "speed": 7.0})
    c = result.coefficients
    assert len(c) == (3 if bias_deg else 2)
    assert -c["c_d"] / c["c_r"] == pytest.approx(0.08, rel=0.03)
    bias = result.metrics["rudder_bias"]
    assert abs(bias["angle_deg"] - bias_deg) < 3.0 * bias["standard_error_deg"]
    assert bias["in_model"] == bool(bias_deg)
    assert (f"{abs(bias_deg):.2g} ±" in result.summary()) == bool(bias_deg)


@pytest.mark.parametrize("structure", ["nomoto", "norrbin", "nomoto2"])
def test_a_structure_without_a_constant_gets_one_for_the_bias(
    structure: str, tmp_path: Path
) -> None:
    """In the model file, too, so that an environment runs straight with that rudder."""
    trials = logged(nomoto_ship(2.0), 10.0, -10.0, 20.0)
    particulars = {"length": 150.0, "speed": 7.0}
    result = identify(trials, structure, particulars=particulars)
    assert result.model.structure == f"{structure}-bias"
    found = result.metrics["rudder_bias"]
    assert found["in_model"]
    assert found["angle_deg"] == pytest.approx(2.0, abs=0.3)

    result.model.save(tmp_path / "model.json")
    read = ShipModel.load(tmp_path / "model.json")
    neutral = straight_running(read).rudder
    assert np.degrees(neutral) == pytest.approx(found["angle_deg"])


def test_a_bias_that_is_to_stay_out_of_the_structure_is_reported() -> None:
    trials = logged(nomoto_ship(2.0), 10.0, -10.0, 20.0)
    particulars = {"length": 150.0, "speed": 7.0}
    result = identify(trials, "nomoto", particulars=particulars, rudder_bias="none")
    found = result.metrics["rudder_bias"]
    assert result.model.structure == "nomoto"
    assert found["angle_deg"] == pytest.approx(2.0, abs=0.2)
    assert "the model has none" in result.summary()


def test_nothing_to_fit_is_refused(auto: Auto, trials: list[Trial]) -> None:
    with pytest.raises(
        InputError, match='at least one that is marked use = "fit", got none'
    ):
        auto([trials[0].with_(use="validate")])
