"""Reduction keeps what is true, and sensitivities follow the physics."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from identification import build_samples
from identification.design.reduced import reduce, reduced_structure
from identification.design.reduction import (
    backward_elimination,
    collinear_terms,
    forward_selection,
)
from identification.design.sensitivity import sensitivity
from shipgym import (
    InputError,
    Particulars,
    ShipModel,
    SteeringGear,
    Trial,
    UnstableModelError,
)
from shipgym.manoeuvres import turning_circle, zigzag
from shipgym.ships import get_structure

Floats = np.ndarray[Any, np.dtype[np.float64]]
NAMES = tuple("abcdefgh")


def orthogonal(noise: float = 0.05) -> tuple[Floats, Floats]:
    """Eight orthogonal regressors of which a, c and f count."""
    rng = np.random.default_rng(3)
    X = np.sqrt(600.0) * np.linalg.qr(rng.standard_normal((600, 8)))[0]
    return X, X @ np.array(
        [3.0, 0.0, -1.0, 0.0, 0.0, 0.5, 0.0, 0.0]
    ) + noise * rng.standard_normal(600)


@pytest.mark.parametrize("run", [backward_elimination, forward_selection])
def test_of_an_orthogonal_design_the_truth_is_kept(run: Any) -> None:
    found = run(*orthogonal(), NAMES)
    assert set(found.terms) == {"a", "c", "f"}
    assert found.coefficients["c"] == pytest.approx(-1.0, abs=0.01)


def test_forward_selection_adds_terms_by_what_they_explain() -> None:
    X, y = orthogonal(0.0)
    found = forward_selection(X, y, NAMES)
    assert [step.changed for step in found.path[:3]] == ["a", "c", "f"]
    ratios = [step.error_reduction for step in found.path[:3]]
    np.testing.assert_allclose(ratios, np.array([9.0, 1.0, 0.25]) / 10.25, rtol=1e-10)


def test_elimination_keeps_its_whole_path() -> None:
    found = backward_elimination(*orthogonal(), NAMES)
    assert [len(step.terms) for step in found.path] == [8, 7, 6, 5, 4, 3]
    for before, after in zip(found.path, found.path[1:], strict=False):
        assert set(before.terms) - set(after.terms) == {after.changed}
        assert after.r_squared <= before.r_squared
    assert "chosen" in str(found)


def test_of_collinear_one_is_dropped() -> None:
    X, y = orthogonal()
    doubled = np.column_stack([X[:, [0, 2, 5]], X[:, 0] + 0.01 * X[:, 1]])
    found = backward_elimination(doubled, y, ("a", "c", "f", "copy"))
    assert len(found.terms) == 3
    assert {"c", "f"} < set(found.terms)
    assert found.path[-1].held_out > 0.999


@pytest.mark.parametrize(("share", "found"), [(0.975, False), (0.985, True)])
def test_collinear_is_what_one_other_or_all_others_make_up_to_98_per_cent(
    share: float, found: bool
) -> None:
    X, _ = orthogonal()
    rest = np.sqrt(1.0 - share**2) * X[:, 4]
    of_one = np.column_stack([X[:, :2], rest - share * X[:, 1]])
    assert collinear_terms(5.0 * of_one, [0, 1, 2]) == ({1, 2} if found else set())
    of_three = np.column_stack(
        [X[:, :4], rest + share * X[:, 1:4].sum(axis=1) / np.sqrt(3.0)]
    )
    assert collinear_terms(of_three, [0, 1, 2, 3, 4]) == ({4} if found else set())
    assert collinear_terms(of_three, [0, 1, 2, 4]) == set()


@pytest.mark.parametrize("preferred", ["a", "copy"])
def test_of_terms_that_say_the_same_the_preferred_one_stays(preferred: str) -> None:
    X, y = orthogonal()
    doubled = np.column_stack([X[:, [0, 2, 5]], X[:, 0]])
    found = backward_elimination(
        doubled, y, ("a", "c", "f", "copy"), prefer=[preferred]
    )
    assert set(found.terms) == {preferred, "c", "f"}


def test_a_term_that_matters_is_not_dropped_however_uncertain() -> None:
    X, y = orthogonal(noise=1.0)
    found = backward_elimination(X, y, NAMES, tolerance=1e-3, threshold=0.0)
    assert {"a", "c", "f"} <= set(found.terms)


PARTICULARS = Particulars(length=160.93, speed=7.7175)
TRUE = {
    "b_v": -0.06,
    "b_r": -2.3,
    "b_|v|r": -0.9,
    "b_d": -0.08,
    "c_v": -1e-3,
    "c_r": -0.104,
    "c_|v|r": -0.03,
    "c_d": 3.7e-3,
}


def virtual_ship(name: str = "steering5") -> ShipModel:
    names = get_structure(name).coefficient_names
    own = {**dict.fromkeys(names, 0.0), **TRUE}
    own = {c: own[c] for c in names}
    return ShipModel("virtual", name, PARTICULARS, SteeringGear(35.0, 5.0, 1.0), own)


@pytest.mark.parametrize("direction", ["backward", "forward"])
def test_the_terms_of_a_virtual_ship_are_found_among_more(direction: str) -> None:
    """A ship of four terms an equation, looked at with seven."""
    table = get_structure("steering7")
    rng = np.random.default_rng(0)
    trials = [
        zigzag(virtual_ship(), a, a, duration=600, dt=0.5).with_(name=f"{a}")
        for a in (10, 20, 35)
    ]
    samples = build_samples(
        trials, table, PARTICULARS, "integral", window=20, smoothing="none"
    )
    for target in samples.targets.values():
        target += 2e-4 * np.std(target) * rng.standard_normal(len(target))
    found = reduce(samples, table, direction, tolerance=1e-6)
    small = reduced_structure(table, found, "small")
    for q in ("v", "r"):
        assert found[q].path[found[q].chosen].held_out > 0.9999
        assert {t.name for t in small.terms(q)} <= {t.name for t in table.terms(q)}
        assert len(small.terms(q)) < 7
    np.testing.assert_allclose(found["r"].coefficients["c_d"], TRUE["c_d"], rtol=0.02)


def test_the_sensitivity_to_nomoto_s_gain_is_the_motion_itself() -> None:
    """Yaw rate and heading are proportional to the coefficient of the rudder."""
    own = {"c_r": -1 / 30.0, "c_d": 0.05 / 30.0}
    ship = ShipModel(
        "virtual", "nomoto", PARTICULARS, SteeringGear(35.0, 5.0, 1.0), own
    )
    turn = partial(turning_circle, rudder_deg=20.0, duration=300.0, dt=0.5)
    effects, base = sensitivity(ship, turn), turn(ship)
    squares = [np.mean(base[c] ** 2) / np.ptp(base[c]) ** 2 for c in ("r", "psi")]
    assert effects["c_d"] == pytest.approx(np.sqrt(np.mean(squares)), rel=1e-9)


def test_a_coefficient_of_zero_has_no_effect_and_the_strongest_stands_first() -> None:
    effects = sensitivity(
        virtual_ship("steering7"), partial(turning_circle, duration=300.0, dt=0.5)
    )
    assert effects["b_|r|r"] == 0.0
    assert effects["c_d"] > effects["b_d"] > 0.0
    assert list(effects.values()) == sorted(effects.values(), reverse=True)


def test_what_cannot_be_reduced_is_named() -> None:
    X, y = orthogonal()
    with pytest.raises(InputError, match="got 20 samples for 8 terms"):
        backward_elimination(X[:20], y[:20], NAMES)
    with pytest.raises(InputError, match="expected b to be excited, got 0"):
        forward_selection(X * np.array([1.0, 0, 1, 1, 1, 1, 1, 1]), y, NAMES)
    for wrong in ((np.where(X > 2.0, np.nan, X), y), (X, np.append(y[1:], np.inf))):
        with pytest.raises(InputError, match="got a value that is not finite"):
            backward_elimination(*wrong, NAMES)
    with pytest.raises(InputError, match="expected y to be excited"):
        forward_selection(X, 0.0 * y, NAMES)
    with pytest.raises(InputError, match="one name a term"):
        backward_elimination(X, y[:-1], NAMES)
    with pytest.raises(InputError, match="one name a term"):
        backward_elimination(X, y, NAMES[:3])


def test_each_step_says_how_much_is_explained_and_of_what_is_held_out() -> None:
    """Of y = 2 a + c with orthogonal terms of one size a explains 4/5, c the rest."""
    rows = np.arange(400)
    X = np.column_stack([np.where(rows // 2**k % 2, 1.0, -1.0) for k in range(4)])
    found = forward_selection(X, 2.0 * X[:, 0] + X[:, 2], ["a", "b", "c", "d"])
    assert found.terms == ("a", "c")
    first, second = found.path[0], found.path[1]
    assert (first.changed, second.changed) == ("a", "c")
    assert (first.r_squared, second.r_squared) == pytest.approx((0.8, 1.0), abs=1e-9)
    assert (first.error_reduction, second.error_reduction) == pytest.approx(
        (0.8, 0.2), abs=1e-9
    )
    assert second.coefficients == pytest.approx({"a": 2.0, "c": 1.0})
    assert second.held_out == pytest.approx(1.0)
    assert first.held_out == pytest.approx(0.8, abs=0.02)


def test_numbers_beyond_their_bounds_are_refused() -> None:
    X, y = orthogonal()
    for name in ("tolerance", "threshold"):
        with pytest.raises(InputError, match=f"{name}: expected"):
            backward_elimination(X, y, NAMES, **{name: -1.0})
    with pytest.raises(InputError, match=r"tolerance: expected .*got -1"):
        forward_selection(X, y, NAMES, tolerance=-1.0)
    for change in (0.0, 1.0):
        with pytest.raises(InputError, match="change: expected"):
            sensitivity(virtual_ship("steering7"), turning_circle, change)


def signs(count: int) -> Floats:
    """Columns of -1 and 1, orthogonal within every fifth of 400 rows too."""
    rows = np.arange(400)
    return np.column_stack(
        [np.where(rows // 2**k % 2, 1.0, -1.0) for k in range(count)]
    )


@pytest.mark.parametrize(("share", "terms"), [(0.96e-3, ("a",)), (1.04e-3, ("a", "b"))])
def test_by_default_a_term_that_explains_less_than_a_thousandth_is_left_out(
    share: float, terms: tuple[str, ...]
) -> None:
    """An elimination counts it only where it is uncertain, here by over 20 per cent."""
    X = signs(3)
    y = X[:, 0] + np.sqrt(share) * X[:, 1]
    assert forward_selection(X[:, :2], y, ["a", "b"]).terms == terms
    samples: Any = SimpleNamespace(features={"r": X[:, :2]}, targets={"r": y})
    nomoto: Any = SimpleNamespace(equations={"r": ()}, names=lambda q: ["a", "b"])
    assert reduce(samples, nomoto, "forward")["r"].terms == terms
    other = 0.13  # of the targets, by what is no term
    noisy = (
        np.sqrt(1.0 - other**2 - share) * X[:, 0]
        + np.sqrt(share) * X[:, 1]
        + other * X[:, 2]
    )
    assert backward_elimination(X[:, :2], noisy, ["a", "b"]).terms == terms


@pytest.mark.parametrize(("error", "terms"), [(0.095, ("a", "b")), (0.105, ("a",))])
def test_by_default_a_term_is_uncertain_beyond_a_tenth_of_its_size(
    error: float, terms: tuple[str, ...]
) -> None:
    X = signs(3)
    y = X[:, 0] + 0.1 * X[:, 1] + 0.1 * error * np.sqrt(398.0) * X[:, 2]
    found = backward_elimination(X[:, :2], y, ["a", "b"], tolerance=1.0)
    assert found.path[0].relative_errors["b"] == pytest.approx(error, rel=1e-3)
    assert found.terms == terms


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_terms_are_selected_whatever_the_unit_of_the_targets(unit: float) -> None:
    """Also beside one that says the same as another, which adds nothing."""
    X, y = orthogonal()
    found = forward_selection(
        np.column_stack([X, 2.0 * X[:, 2]]), unit * y, (*NAMES, "copy")
    )
    assert [step.changed for step in found.path][:3] in (
        ["a", "c", "f"],
        ["a", "copy", "f"],
    )
    assert len({step.changed for step in found.path}) == len(found.path) == 8


def test_one_term_stays_and_is_enough_for_ten_samples() -> None:
    X, y = orthogonal()
    assert (
        len(backward_elimination(X, y, NAMES, tolerance=9.0, threshold=0.0).terms) == 1
    )
    few = np.linspace(1.0, 2.0, 10)[:, None]
    assert forward_selection(few, 3.0 * few[:, 0], ["a"]).coefficients[
        "a"
    ] == pytest.approx(3.0)
    with pytest.raises(
        InputError,
        match="at least 5 times as many samples as terms, got 9 samples for 1",
    ):
        forward_selection(few[:9], few[:9, 0], ["a"])


def test_a_coefficient_with_which_the_ship_runs_away_has_no_bound_and_is_first() -> (
    None
):
    ship = virtual_ship()

    def sail(model: ShipModel) -> Trial:
        if model.coefficients["c_r"] > TRUE["c_r"]:
            raise UnstableModelError("lost", 1.0, {})
        t = np.arange(20.0)
        psi = model.coefficients["c_d"] * t
        return Trial(t, {"u": 0.0 * t, "v": 0.0 * t, "r": 0.0 * t, "psi": psi})

    effects = sensitivity(ship, sail)
    assert (next(iter(effects)), effects["c_r"]) == ("c_r", np.inf)
    t = np.arange(20.0)
    assert effects["c_d"] == pytest.approx(np.sqrt(np.mean(t**2)) / 19.0)
    assert effects["b_d"] == 0.0
