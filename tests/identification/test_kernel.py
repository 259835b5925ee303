"""Kernel ships: LS-SVM with an RBF kernel on what a reference ship leaves."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identification import (
    LSSVM,
    IdentificationResult,
    KernelResidual,
    identify,
)
from shipgym import Particulars, ShipModel, SteeringGear, Trial, check_ship_model
from shipgym.errors import InputError
from shipgym.manoeuvres import zigzag
from shipgym.models.catalogue import fitted_box
from shipgym.models.linear import nomoto
from shipgym.ships.kernel_boxes import (
    Kernel,
    KernelBox,
    kernel_box,
)

SHIP = Particulars(name="made up", length=7.0, speed=1.2)
GEAR = SteeringGear(rudder_limit_deg=35.0, rudder_rate_deg_s=16.0, time_constant=0.0)
LINEAR = {
    "a_0": 0.0,
    "a_du": -0.04,
    "b_0": 0.0,
    "b_v": -1.0,
    "b_r": -0.35,
    "b_d": -0.15,
    "c_0": 0.0,
    "c_v": -1.5,
    "c_r": -2.0,
    "c_d": 1.0,
}
ONE_SIDE = np.array(
    [[0.9, -0.7, 0.4, -0.5], [0.2, -0.4, 1.0, 0.4], [1.5, -1.4, -0.3, -1.2]]
)
CENTRES = np.concatenate([ONE_SIDE, ONE_SIDE * [-1.0, -1.0, -1.0, 1.0]])


@pytest.fixture(scope="module")
def reference() -> ShipModel:
    return ShipModel("linear ship", "linear", SHIP, GEAR, LINEAR)


@pytest.fixture(scope="module")
def truth(reference: ShipModel) -> ShipModel:
    """The linear ship with a smooth addition that is the same to both sides."""
    functions = Kernel(
        np.array([0.0, 0.0, 0.0, 0.9]),
        np.array([0.15, 0.4, 0.3, 0.1]),
        CENTRES,
        np.eye(len(CENTRES)),
    )
    table = kernel_box(fitted_box(reference), functions)
    even, odd = np.ones(2), np.array([1.0, -1.0])
    values = np.concatenate(
        [
            np.outer(side, weights).ravel()
            for side, weights in (
                (even, [-0.02, -0.01, -0.03]),
                (odd, [0.05, 0.02, 0.04]),
                (odd, [0.2, 0.3, -0.3]),
            )
        ]
    )
    coefficients = dict(zip(table.coefficient_names, values.tolist(), strict=True))
    return ShipModel("truth", table.name, SHIP, GEAR, coefficients, dynamics=table)


@pytest.fixture(scope="module")
def trials(truth: ShipModel) -> list[Trial]:
    found = []
    for angle, port_first in (
        (10, False),
        (10, True),
        (30, False),
        (30, True),
        (20, False),
    ):
        run = zigzag(truth, angle, angle, duration=100, dt=0.1, port_first=port_first)
        channels = {name: run[name][::4] for name in ("psi", "u", "v", "r", "delta")}
        use, name = "validate" if angle == 20 else "fit", f"{angle}-{port_first}"
        found.append(
            Trial(run.t[::4], channels, name=name, kind="zigzag", use=use, length=7.0)
        )
    return found


def fit(trials: list[Trial], **settings: Any) -> IdentificationResult:
    given = {"kernel": KernelResidual(centres=32), **settings}
    return identify(trials, particulars=SHIP, steering=GEAR, **given)


@pytest.fixture(scope="module")
def corrected(trials: list[Trial], reference: ShipModel) -> IdentificationResult:
    kernel = KernelResidual(centres=32, length=2.0, C=1e6)
    return fit(trials, reference_model=reference, kernel=kernel)


@pytest.fixture(scope="module")
def black_box(trials: list[Trial]) -> IdentificationResult:
    return fit(trials, structure="linear")


def errors(result: IdentificationResult, use: str) -> float:
    """Largest error of the heading over trials of one use, deg rms."""
    metrics = result.metrics["trials"]
    return float(
        np.degrees(max(m["rmse"]["psi"] for m in metrics.values() if m["use"] == use))
    )


def accelerations(
    model: ShipModel, trial: Trial, scale: float = 1.0, sign: float = 1.0
) -> np.ndarray:
    """Prime accelerations at states of a trial; drift, turn, rudder times a factor."""
    states = np.stack(
        [np.zeros(len(trial))] * 3 + [trial[n] for n in ("u", "v", "r", "delta")],
        axis=-1,
    )
    states[:, 4:] *= scale * sign
    rates = model.derivatives(states, np.zeros((len(trial), 1)))[:, 3:6]
    return rates * np.array([1.0, sign, sign * 7.0]) * 7.0 / 1.2**2


def test_a_known_smooth_residual_is_recovered(
    corrected: IdentificationResult,
    truth: ShipModel,
    reference: ShipModel,
    trials: list[Trial],
) -> None:
    for trial in trials:
        found, true, bare = (
            accelerations(m, trial) for m in (corrected.model, truth, reference)
        )
        left, there = (
            np.sqrt(np.mean((one - true) ** 2, axis=0)) for one in (found, bare)
        )
        assert np.all(left < 0.2 * there)
    assert errors(corrected, "validate") < 0.5


def test_far_from_the_data_it_is_the_reference_ship(
    corrected: IdentificationResult, reference: ShipModel, trials: list[Trial]
) -> None:
    turning = trials[2]
    hard = np.abs(turning["r"]) > 0.5 * np.abs(turning["r"]).max()
    found, bare = (
        accelerations(model, turning, scale=8.0)[hard]
        for model in (corrected.model, reference)
    )
    np.testing.assert_allclose(found, bare, rtol=0.0, atol=1e-3 * np.abs(bare).max())


def test_trials_to_both_sides_give_the_same_ship_to_both(
    corrected: IdentificationResult,
    black_box: IdentificationResult,
    trials: list[Trial],
) -> None:
    for model in (corrected.model, black_box.model):
        port, starboard = (
            accelerations(model, trials[2], sign=sign) for sign in (-1.0, 1.0)
        )
        np.testing.assert_allclose(
            port, starboard, rtol=0.0, atol=2e-3 * np.abs(starboard).max()
        )


def test_a_black_box_predicts_a_zigzag_that_was_held_out(
    black_box: IdentificationResult,
) -> None:
    report = (black_box.model.provenance or {})["kernel"]
    held_out = report["heading_errors_held_out"]
    assert black_box.stable
    assert (black_box.model.provenance or {})["structure"] == "linear"
    assert held_out["kernel"] < 0.5 * held_out["reference"]
    assert errors(black_box, "validate") < 2.0
    assert black_box.model.covariance is not None
    assert check_ship_model(black_box.model).problems == ()
    assert nomoto(black_box.model).K / nomoto(black_box.model).T > 0.0


def test_its_file_holds_numbers_only(
    black_box: IdentificationResult, tmp_path: Path
) -> None:
    model, path = black_box.model, tmp_path / "model.json"
    model.save(path)
    again = ShipModel.load(path)
    assert isinstance(again.table, KernelBox)
    assert again.compiled is model.compiled
    np.testing.assert_array_equal(again.ship_numbers(), model.ship_numbers())
    np.testing.assert_array_equal(again.covariance, model.covariance)
    fields = json.loads(path.read_text())
    for field, value, message in (
        ("centres", [[0.0, 1.0, "x", 2.0]], "structure.kernel"),
        ("scale", [0.0, 1.0, 1.0, 1.0], "kernel: expected a scale above 0"),
        ("basis", [[1.0]], "rows in centres and basis"),
        ("centres", None, "structure.kernel.centres"),
        ("code", "1", "code"),
    ):
        changed = json.loads(json.dumps(fields))
        changed["structure"]["kernel"][field] = value
        path.write_text(json.dumps(changed))
        with pytest.raises(InputError, match=message):
            ShipModel.load(path)


def test_models_drawn_differ_in_kernel_and_fitted_reference(
    black_box: IdentificationResult,
) -> None:
    one, other = black_box.model.sample(2, seed=0)
    assert one.compiled is black_box.model.compiled
    assert one.table.ship.coefficients != other.table.ship.coefficients  # type: ignore[attr-defined]
    assert one.coefficients != other.coefficients


def test_a_structure_that_is_named_is_beneath_the_kernel(trials: list[Trial]) -> None:
    """Also the one that is the default without a kernel."""
    kernel = KernelResidual(centres=32, length=2.0, C=1e6)
    hull = {"length": 7.0, "beam": 1.27, "draught": 0.455, "block_coefficient": 0.81}
    named = (
        identify(
            trials,
            structure="abkowitz",
            kernel=kernel,
            particulars=hull,
            steering=GEAR,
        ).model.provenance
        or {}
    )
    assert named["structure"] == "abkowitz"
    assert named["reference"]["name"].endswith("abkowitz")


def test_what_cannot_be(
    trials: list[Trial], reference: ShipModel, truth: ShipModel
) -> None:
    few = [trials[0].with_(name="few")]
    short = [
        Trial(
            few[0].t[:60], {k: v[:60] for k, v in few[0].channels.items()}, name="short"
        )
    ]
    for given, settings, message in (
        (
            trials,
            {"method": "rm-svm", "reference_model": reference},
            r"method: .*with a kernel on a grey box, .* got 'rm-svm'",
        ),
        (trials, {"structure": "auto"}, r"kernel: .*named, got 'auto'"),
        (trials, {"structure": "nomoto"}, r"kernel: .*u, v and r, got 'nomoto'"),
        (
            short,
            {"reference_model": reference},
            "different samples for 32 centres",
        ),
        (
            trials,
            {"reference_model": truth},
            "a grey box itself",
        ),
    ):
        with pytest.raises(InputError, match=message):
            fit(given, **settings)
    for wrong in (
        {"kernel": "poly"},
        {"centres": 1},
        {"centres": 101},
        {"length": 0.0},
        {"C": 0.0},
    ):
        with pytest.raises(InputError, match=f"{next(iter(wrong))}: "):
            KernelResidual(**wrong)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"kernel: .*'linear'"):
        identify(
            trials, structure="linear", particulars=SHIP, method=LSSVM(kernel="rbf")
        )
