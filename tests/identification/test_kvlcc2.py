"""KVLCC2, 7 m model, zigzags measured by HSVA: data not written for a program."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identification import IdentificationResult, identify
from shipgym import ShipFile, Trial

SHIP_FILE = Path(__file__).parents[1] / "ships" / "kvlcc2_hsva.toml"
DATA = Path(__file__).parents[2].parent / "shared" / "data" / "kvlcc2_hsva"

pytestmark = pytest.mark.skipif(
    not DATA.is_dir(), reason=f"the measured zigzags are not at {DATA}"
)

TRIPLES = [
    ("Z_10_05", "Z_20_05", "Z_30_05"),
    ("Z_05_01", "Z_10_01", "Z_10_05"),
    ("Z_10_01", "Z_10_05", "Z_10_10_S"),
    ("Z_05_01", "Z_10_01", "Z_15_01"),
    ("Z_10_10_S", "Z_15_05", "Z_20_10_S"),
]


@pytest.fixture(scope="module")
def ship() -> ShipFile:
    return ShipFile.load(SHIP_FILE)


@pytest.fixture(scope="module")
def trials(ship: ShipFile) -> dict[str, Trial]:
    return {Path(trial.name).stem: trial for trial in ship.trials()}


def fit(
    ship: ShipFile, trials: dict[str, Trial], names: tuple[str, ...], **settings: Any
) -> IdentificationResult:
    marked = [
        t.with_(use="fit" if key in names else "validate", name=key)
        for key, t in trials.items()
    ]
    return identify(
        marked, particulars=ship.particulars, steering=ship.steering, **settings
    )


@pytest.mark.parametrize("triple", TRIPLES, ids="-".join)
def test_a_fit_of_three_runs_diverges_on_no_other(
    ship: ShipFile, trials: dict[str, Trial], triple: tuple[str, ...]
) -> None:
    result = fit(ship, trials, triple)
    assert result.stable
    assert [
        key for key, metrics in result.metrics["trials"].items() if metrics["diverged"]
    ] == []


def test_one_run_suffices_not_to_diverge(
    ship: ShipFile, trials: dict[str, Trial]
) -> None:
    result = fit(ship, trials, ("Z_10_05",))
    assert result.stable
    assert not any(metrics["diverged"] for metrics in result.metrics["trials"].values())


def test_prediction_of_runs_not_used(ship: ShipFile, trials: dict[str, Trial]) -> None:
    metrics = fit(ship, trials, TRIPLES[0]).metrics["trials"]
    unused = [metrics[key] for key in ("Z_10_10_S", "Z_15_05", "Z_20_10_S")]
    assert np.degrees(np.mean([run["rmse"]["r"] for run in unused])) < 0.11
    assert np.degrees(np.mean([run["rmse"]["psi"] for run in unused])) < 2.0
    first, second = (
        np.mean(
            [abs(run[index]["predicted"] - run[index]["measured"]) for run in unused]
        )
        for index in ("overshoot_1_deg", "overshoot_2_deg")
    )
    assert first < 0.55
    assert second < 1.3


def test_measured_overshoots_are_those_of_the_data_sheet(
    ship: ShipFile, trials: dict[str, Trial]
) -> None:
    metrics = fit(ship, trials, TRIPLES[0]).metrics["trials"]
    published = {
        "Z_10_05": (5.33, 13.28),
        "Z_10_10_S": (9.69, 20.54),
        "Z_20_10_S": (11.71, 15.62),
    }
    for key, (first, second) in published.items():
        assert metrics[key]["overshoot_1_deg"]["measured"] == pytest.approx(
            first, abs=0.1
        )
        assert metrics[key]["overshoot_2_deg"]["measured"] == pytest.approx(
            second, abs=0.1
        )


def test_steering_gear_is_estimated_from_noisy_rudders(
    ship: ShipFile, trials: dict[str, Trial]
) -> None:
    from identification.samples.rudder import estimated_gear

    assert estimated_gear(list(trials.values())).rudder_rate_deg_s == pytest.approx(
        15.8, rel=0.05
    )
