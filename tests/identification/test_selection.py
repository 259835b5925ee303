"""Where no structure is named, the one that predicts held-out trials best is used."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from identification import LSSVM, IdentificationResult, Options, identify
from identification.judging.selection import RankedFit, simplest
from identification.pipeline.choice import select
from shipgym import InputError, Particulars, ShipModel, SteeringGear, Trial
from shipgym.manoeuvres import zigzag
from shipgym.models.linear import straight_running
from shipgym.trials.derivatives import time_derivative

Auto = Callable[..., IdentificationResult]


def fit(
    structure: str, coefficients: int, *errors: float, method: str = "tls-svm"
) -> RankedFit:
    by_trial = {str(k): error for k, error in enumerate(errors)}
    mean = sum(errors) / len(errors)
    return RankedFit(
        structure, method, coefficients, True, 0, mean, None, None, by_trial
    )


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
    assert told["ranking"][0]["errors"].keys() == {"zigzag 0", "zigzag 1"}
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


@pytest.mark.parametrize(("worse", "taken"), [(1.019, "nomoto"), (1.021, "abkowitz")])
def test_two_per_cent_of_the_error_decide_nothing(worse: float, taken: str) -> None:
    ranked = [fit("abkowitz", 20, 1.0, 1.0), fit("nomoto", 2, worse, worse)]
    assert simplest(ranked).structure == taken


def test_a_single_trial_is_cut_into_thirds(auto: Auto, trials: list[Trial]) -> None:
    result = auto(trials[1:2])
    told = result.metrics["selection"]
    assert told["held_out"] == "each third of the only trial"
    assert list(told["ranking"][0]["errors"]) == [
        f"zigzag 1, part {k}" for k in (1, 2, 3)
    ]
    assert result.trials == (trials[1],)


def test_a_method_or_setting_that_is_named_is_kept(
    auto: Auto, trials: list[Trial]
) -> None:
    result = auto(trials[:2], method=LSSVM(C=1e5))
    assert {row["method"] for row in result.metrics["selection"]["ranking"]} == {
        "ls-svm"
    }
    assert result.model.provenance["method"] == "ls-svm"


@pytest.mark.parametrize(
    ("rudders", "groups"),
    [((10, 10, 20), [[0], [1], [2], [2]]), ((10, 20, 20), [[0], [1], [2]])],
)
def test_each_trial_is_held_out_and_those_of_the_largest_rudder_together(
    rudders: tuple[int, ...], groups: list[list[int]]
) -> None:
    """Together only where two trials of less rudder are left."""
    ship = nomoto_ship(0.0)
    trials = [
        zigzag(ship, angle, 10, duration=60, dt=0.5).with_(name=f"run {k}")
        for k, angle in enumerate(rudders)
    ]
    asked = []

    def fitted(parts: Sequence[Trial], options: Options) -> Any:
        def without(places: list[int]) -> ShipModel:
            asked.append(places)
            return ship

        problem = SimpleNamespace(used=parts)
        return SimpleNamespace(
            problem=problem,
            model=ship,
            free_coefficients=3,
            stable=True,
            without=without,
        )

    options = Options(structure="auto", method="ls")  # no other method is tried
    choice = select(fitted, trials, options, structures=("nomoto",))
    assert asked == groups
    assert choice.report["held_out"] == "each trial in turn"
    assert choice.report["ranking"][0]["error"] == pytest.approx(0.0, abs=1e-3)


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
    assert "take structure 'norrbin-bias'" in result.summary()


def test_in_wind_a_structure_that_knows_no_speed_comes_after_those_that_do() -> None:
    small, large = fit("norrbin", 3, 0.06, 0.07), fit("cubic", 27, 0.08, 0.12)
    knows_speed = replace(large, predicts_speed=True)
    assert simplest([small, knows_speed]) is small
    assert simplest([small, knows_speed], in_wind=True) is knows_speed
    assert simplest([small, large], in_wind=True) is small


def test_nothing_to_fit_is_refused(auto: Auto, trials: list[Trial]) -> None:
    with pytest.raises(
        InputError, match='at least one that is marked use = "fit", got none'
    ):
        auto([trials[0].with_(use="validate")])


def test_the_fewest_coefficients_among_errors_that_differ_by_chance() -> None:
    best, small = (
        fit("abkowitz", 40, 0.10, 0.12, 0.11),
        fit("grey-box", 15, 0.10, 0.10, 0.14),
    )
    assert simplest([best, small]) is small  # 0.003 +- 0.013
    assert (
        simplest([best, fit("nomoto", 2, 0.13, 0.14, 0.15)]) is best
    )  # 0.027 +- 0.003
    assert (
        simplest([best, fit("cubic", 27, 0.102, 0.122, 0.112)]).structure == "cubic"
    )  # 1.8 %
    first, even = (
        fit("abkowitz", 40, 0.14, 0.10, 0.10),
        fit("nomoto", 2, 0.136, 0.11, 0.11),
    )
    assert simplest([first, even]) is first  # 0.0053 +- 0.0047
    exact = fit("abkowitz", 40, 0.0, 0.0)
    assert simplest([exact, fit("nomoto", 2, 0.001, 0.001)]) is exact
    assert simplest([exact, fit("nomoto", 2, 0.0, 0.0)]).structure == "nomoto"
    usual = fit("abkowitz", 40, 0.10, 0.12, 0.112)
    other = fit("abkowitz", 40, 0.10, 0.12, 0.11, method="ls")
    assert simplest([other, usual]) is usual


def test_ships_that_run_away_come_last_then_unstable_ones_then_by_error() -> None:
    good, worse = fit("abkowitz", 40, 0.1), fit("cubic", 27, 0.2)
    unstable, lost = replace(good, stable=False), replace(good, ran_away=1, error=None)
    often = replace(lost, ran_away=2)
    unknown = replace(good, error=None)
    exact, better = replace(good, error=0.0), replace(good, error=0.05)
    in_order = [exact, better, good, worse, unknown, unstable, lost, often]
    shuffled = [often, unknown, better, good, lost, unstable, exact, worse]
    assert sorted(shuffled, key=lambda one: one.rank) == in_order
