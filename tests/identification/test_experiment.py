"""Information adds up, and advised manoeuvres shrink what they promise to."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

import shipgym
from identification import build_samples
from identification.design.experiment import (
    Advice,
    advise,
    gains_of,
    most_felt,
    standard_candidates,
)
from identification.design.information import (
    TrialInformation,
    fisher_information,
    noise_variance,
    relative_errors,
    trial_regression,
)
from shipgym import (
    InputError,
    Particulars,
    ShipModel,
    SteeringGear,
    Trial,
    UnstableModelError,
)
from shipgym.manoeuvres import turning_circle, zigzag
from shipgym.models import converted_model
from shipgym.ships import get_structure

PARTICULARS = Particulars(length=160.93, speed=7.7175)
COEFFICIENTS = {"c_r": -1 / 30.0, "c_r3": -4000.0 / 30.0, "c_d": 0.05 / 30.0}
SIGMA = 2e-5  # noise of the yaw rate, rad/s


@pytest.fixture(scope="module")
def ship() -> ShipModel:
    return ShipModel(
        "virtual", "norrbin", PARTICULARS, SteeringGear(35.0, 5.0, 1.0), COEFFICIENTS
    )


def recorded(run: Trial, name: str, seed: int = 0) -> Trial:
    channels = {c: run[c].copy() for c in ("x", "y", "psi", "u", "v", "r", "delta")}
    channels["r"] += SIGMA * np.random.default_rng(seed).standard_normal(len(run))
    return Trial(run.t, channels, name=name)


def gentle(ship: ShipModel, seed: int = 0) -> Trial:
    return recorded(zigzag(ship, 5, 5, duration=600, dt=0.5), "gentle", seed)


def test_information_adds_over_trials(ship: ShipModel) -> None:
    runs = [gentle(ship), recorded(turning_circle(ship, 20, 300, 0.5), "turn")]
    parts = [
        build_samples([run], ship.table, PARTICULARS, "integral", 10) for run in runs
    ]
    both = build_samples(runs, ship.table, PARTICULARS, "integral", 10)
    noise = {"r": 1e-9}
    total = sum(fisher_information(ship, part, noise) for part in parts)
    np.testing.assert_allclose(fisher_information(ship, both, noise), total, rtol=1e-10)
    assert np.all(np.linalg.eigvalsh(total) > 0.0)


def test_information_is_the_inverse_of_the_covariance_of_least_squares(
    ship: ShipModel,
) -> None:
    samples = build_samples([gentle(ship)], ship.table, PARTICULARS, "integral", 10)
    X = samples.features["r"]
    np.testing.assert_allclose(
        np.linalg.inv(fisher_information(ship, samples, {"r": 4.0})),
        4.0 * np.linalg.inv(X.T @ X),
        rtol=1e-8,
    )


def test_the_advised_manoeuvre_really_shrinks_the_error_in_a_refit(
    ship: ShipModel,
) -> None:
    """A gentle zigzag hardly shows the cubic term; refits show which trial helps."""
    first = gentle(ship)
    times = {"duration": 600.0, "dt": 0.5}
    candidates = {
        "zigzag 5/5": partial(zigzag, rudder_deg=5.0, heading_deg=5.0, **times),
        "zigzag 20/20": partial(zigzag, rudder_deg=20.0, heading_deg=20.0, **times),
        "turning circle 10": partial(turning_circle, rudder_deg=10.0, **times),
    }
    advice = advise(ship, [first], candidates)
    assert advice.coefficient == "c_r3"

    def scatter(name: str) -> float:
        found = []
        for seed in range(12):
            runs = [
                gentle(ship, seed),
                recorded(candidates[name](ship), name, 100 + seed),
            ]
            samples = build_samples(
                runs, ship.table, PARTICULARS, "integral", 4, smoothing="none"
            )
            coefficients = np.linalg.lstsq(
                samples.features["r"], samples.targets["r"], rcond=None
            )[0]
            found.append(coefficients[1])
        return float(np.std(found))

    errors = {name: scatter(name) for name in candidates}
    assert advice.chosen == (min(errors, key=lambda name: errors[name]),)
    assert advice.after["c_r3"] < 0.2 * advice.before["c_r3"]


@pytest.mark.parametrize("criterion", ["c", "D", "E"])
def test_every_choice_gains_and_none_loses(ship: ShipModel, criterion: str) -> None:
    advice = advise(ship, [gentle(ship)], criterion=criterion, number=3)
    assert len(advice.chosen) == 3
    for gains, name in zip(advice.steps, advice.chosen, strict=True):
        assert gains[name] == max(gains.values())
        assert min(gains.values()) >= 1.0
    assert all(advice.after[name] <= before for name, before in advice.before.items())
    text = str(advice)
    assert advice.chosen[0] in text
    assert "gentle" in text


def test_criteria_ask_for_volume_longest_axis_or_one_coefficient() -> None:
    """Relative errors 0.1, 0.01, 1: a narrow axis counts in the volume alone."""
    known, size = np.diag([1e2, 1e4, 1.0]), np.ones(3)
    offers = {"first": np.diag([1e8, 0.0, 0.0]), "longest": np.diag([0.0, 0.0, 15.0])}

    def gains(criterion: str, at: int = 0) -> dict[str, float]:
        return gains_of(known, offers, size, criterion, at)

    assert gains("E") == pytest.approx({"first": 1.0, "longest": 4.0})
    assert gains("D") == pytest.approx(
        {"first": (1.0 + 1e6) ** (1 / 6), "longest": 16 ** (1 / 6)}
    )
    assert gains("c", 2) == pytest.approx({"first": 1.0, "longest": 4.0})
    assert gains("c", 1) == pytest.approx({"first": 1.0, "longest": 1.0})


def test_advice_for_an_identified_mariner_of_forty_coefficients() -> None:
    mariner = shipgym.load_model("mariner")
    run = zigzag(mariner, 10, 10, duration=400, dt=0.5)
    trial = Trial(
        run.t,
        {c: run[c] for c in ("x", "y", "psi", "u", "v", "r", "delta")},
        name="10/10",
    )
    advice = advise(mariner, [trial], criterion="D")
    assert set(advice.before) == set(get_structure("abkowitz").coefficient_names)
    assert "zigzag 5/5" not in advice.chosen
    assert advice.trials[0].condition_number["r"] > 30.0
    assert set(advice.steps[0]) == set(standard_candidates(mariner))


def test_a_grey_box_that_explains_her_trials_is_certain_of_her_coefficients() -> None:
    """The accelerations that the reference ship explains are not counted as noise."""
    mariner = shipgym.load_model("mariner")
    blank = converted_model("mariner", mariner.particulars, mariner.steering)
    coefficients = {
        name: -0.1 if name in ("a_du", "b_v", "c_r") else 0.01
        for name in blank.coefficients
    }
    box = replace(blank, coefficients=coefficients)
    run = zigzag(box, 20, 20, duration=600, dt=0.5)
    trial = Trial(
        run.t,
        {c: run[c] for c in ("x", "y", "psi", "u", "v", "r", "delta")},
        name="20/20",
    )
    assert max(advise(box, [trial], {"same": gentle}).before.values()) < 0.1


def test_what_cannot_be_advised_is_named(ship: ShipModel) -> None:
    with pytest.raises(InputError, match="criterion"):
        advise(ship, [gentle(ship)], criterion="A")
    with pytest.raises(InputError, match=r"coefficient: .*'Y_v'"):
        advise(ship, [gentle(ship)], coefficient="Y_v")
    for criterion in ("D", "E"):
        with pytest.raises(
            InputError,
            match=f"expected none with criterion '{criterion}', which is of all",
        ):
            advise(
                ship,
                [gentle(ship)],
                criterion=criterion,
                coefficient=next(iter(ship.coefficients)),
            )
    with pytest.raises(InputError, match="trials: expected those"):
        advise(ship, [])
    with pytest.raises(
        InputError,
        match=r"structure: expected a table of terms, .* got 'container'",
    ):
        advise(shipgym.load_model("container"), [gentle(ship)])


def test_candidates_that_no_ship_survives_are_refused(ship: ShipModel) -> None:
    def lost(model: ShipModel) -> Trial:
        raise UnstableModelError("lost", 1.0, {})

    with pytest.raises(
        InputError,
        match="candidates: expected one that model 'virtual' can simulate, got 1",
    ):
        advise(ship, [gentle(ship)], {"hard": lost})
    both = {"hard": lost, "gentle": gentle}
    assert list(advise(ship, [gentle(ship)], both).steps[0]) == ["gentle"]
    with pytest.raises(InputError, match="number: expected at least 1, got 0"):
        advise(ship, [gentle(ship)], number=0)


def test_the_condition_of_a_trial_does_not_depend_on_units(ship: ShipModel) -> None:
    """That of the features by their root mean squares, however tiny."""
    trial = gentle(ship)
    (known,) = advise(ship, [trial], {"same": gentle}).trials
    X = trial_regression(ship, trial).features["r"]
    assert np.sqrt(np.mean(X**2, axis=0)).min() < 0.1
    scaled = X / np.sqrt(np.mean(X**2, axis=0))
    assert known.condition_number["r"] == pytest.approx(
        np.linalg.cond(scaled), rel=1e-9
    )
    moment = np.linalg.inv(scaled.T @ scaled / len(scaled))
    np.testing.assert_allclose(
        list(known.inflation.values()), np.diag(moment), rtol=1e-6
    )


@pytest.mark.parametrize(
    ("samples", "dt", "window"),
    [(200, 0.5, 8), (40, 0.1, 4), (90, 20.0, 1), (9, 0.1, 1)],
)
def test_windows_last_a_fifth_of_a_ship_length_but_a_tenth_of_a_short_trial(
    ship: ShipModel, samples: int, dt: float, window: int
) -> None:
    """A ship length takes 20.85 s, a fifth 4.17 s; windows are at least a step."""
    t = dt * np.arange(samples)
    swing = np.sin(2.0 * np.pi * t / t[-1])
    trial = Trial(
        t, {"u": 7.0 + 0.0 * t, "v": 0.0 * t, "r": 0.01 * swing, "delta": 0.1 * swing}
    )
    assert trial_regression(ship, trial).window == window


def test_noise_is_what_the_model_leaves_over_all_trials_and_of_exact_data_the_rounding(
    ship: ShipModel,
) -> None:
    X = np.random.default_rng(0).standard_normal((50, 3))
    exact = X @ (ship.acceleration_matrix @ np.array(list(ship.coefficients.values())))

    def noise(*targets: np.ndarray) -> float:
        return noise_variance(
            ship,
            [SimpleNamespace(features={"r": X}, targets={"r": one}) for one in targets],
        )["r"]

    assert noise(exact + 1e3, exact - 3e3) == pytest.approx((1e6 + 9e6) / 2.0)
    assert noise(exact) == pytest.approx(1e-12 * np.mean(exact**2))
    X = 0.0 * X
    assert noise(0.0 * exact) == np.finfo(float).tiny


def test_an_error_is_felt_by_the_acceleration_that_it_is_a_part_of() -> None:
    """A tenth of the sway by the rudder is more in m/s^2 than a third of the yaw."""
    given = {
        "b_v": -1.0,
        "b_r": -0.3,
        "b_d": -1.0,
        "c_v": -0.3,
        "c_r": -1.0,
        "c_d": 0.5,
    }
    model = ShipModel(
        "virtual", "linear-steering", PARTICULARS, SteeringGear(35.0, 5.0, 1.0), given
    )
    size = np.abs(list(given.values()))
    assert most_felt(model, size * [0.0, 0.0, 0.1, 0.0, 0.0, 0.3]) == "c_d"
    assert most_felt(model, size * [0.0, 0.0, 0.3, 0.0, 0.0, 0.1]) == "b_d"


def test_what_is_not_excited_is_uncertain_beyond_measure_but_not_infinitely() -> None:
    np.testing.assert_allclose(
        relative_errors(np.diag([4.0, 0.0]), np.array([1.0, 1.0])), [0.5, 0.5e7]
    )
    np.testing.assert_allclose(
        relative_errors(np.diag([4.0, 1.0]), np.array([2.0, 0.1])), [0.25, 10.0]
    )


def test_candidates_go_up_to_the_rudders_limit(ship: ShipModel) -> None:
    def angles(limit: float) -> list[str]:
        gear = replace(ship.steering, rudder_limit_deg=limit)
        names = standard_candidates(replace(ship, steering=gear))
        return [
            name.removeprefix("turning circle ")
            for name in names
            if name.startswith("turning")
        ]

    assert angles(40.0) == ["5", "10", "20", "35"]
    assert angles(33.0) == ["5", "10", "20", "33"]
    assert angles(20.0) == ["5", "10", "20"]
    assert angles(9.0) == ["5", "9"]
    times = standard_candidates(ship)["zigzag 5/5"].keywords  # type: ignore[attr-defined]
    assert times["duration"] == pytest.approx(40.0 * 160.93 / 7.7175)
    assert times["dt"] == pytest.approx(160.93 / 7.7175 / 60.0)


@pytest.mark.parametrize(
    ("told", "shares"), [((0.02, 0.03), ("40", "60")), ((0.0, 0.0), ("0", "0"))]
)
def test_each_trial_has_its_share_of_the_information(
    told: tuple[float, float], shares: tuple[str, str]
) -> None:
    trials = tuple(
        TrialInformation(
            f"run {k}", {"r": 3.0}, {"c_r": 1.0, "c_d": 2.6}, np.diag([9.0, one])
        )
        for k, one in enumerate(told)
    )
    errors = {"c_r": 0.1, "c_d": 0.5}
    text = str(
        Advice(
            "c",
            "c_d",
            trials,
            errors,
            ({"turn": 1.5, "zigzag": 2.0},),
            ("zigzag",),
            errors,
        )
    )
    for k, share in enumerate(shares):
        (row,) = (line for line in text.splitlines() if f"run {k}" in line)
        assert [cell.strip() for cell in row.split("│")[1:-1]] == [
            f"run {k}",
            "r 3",
            "3 (c_d)",
            f"{share} % of all",
        ]
    assert text.index("zigzag") < text.index("turn ")
    assert "2.00 *" in text
