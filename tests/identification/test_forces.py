"""Captive tests: the vectorial PMM models, with coefficients shared by equations."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from papers.captive import oscillate, tow
from papers.xu2020_tank import PMM18, PMM38, TABLE_11, xu_ship

from identification import identify
from identification.models.forces import (
    force_regression,
    identify_forces,
)
from shipgym import InputError, Particulars, ShipModel, Trial

# a stand-in for what the paper does not print: a coaster's mass
PARTICULARS = Particulars(
    length=28.9,
    beam=9.6,
    draught=2.7,
    mass=417e3,
    speed=5.0,
    xg=-0.5,
    yaw_gyradius=7.2,
    water_density=1025.0,
)
SHIP = xu_ship(PARTICULARS)


AHEAD = (5.0, 0.0, 0.0)
PERIOD = 57.8  # s, 10 ship lengths


def at_drift(drift_deg: float) -> tuple[float, float, float]:
    angle = np.radians(drift_deg)
    return 5.0 * float(np.cos(angle)), -5.0 * float(np.sin(angle)), 0.0


@cache
def tank_tests(noise: float = 0.0, model_inertia: bool = True) -> tuple[Trial, ...]:
    """Surge, sway, yaw, yaw with drift and static drift; noise by each force's rms."""
    slow, fast, mixed = np.radians([3.0, 6.0, 4.0])
    swings = [
        (AHEAD, (0.5, 0.0, 0.0)),
        (AHEAD, (0.0, 0.5, 0.0)),
        (AHEAD, (0.0, 1.5, 0.0)),
        (AHEAD, (0.0, 0.0, slow)),
        (AHEAD, (0.0, 0.0, fast)),
        (at_drift(6.0), (0.0, 0.0, mixed)),
        (at_drift(-12.0), (0.0, 0.0, mixed)),
    ]
    runs = [
        oscillate(SHIP, mean, amplitude, PERIOD, model_inertia=model_inertia)
        for mean, amplitude in swings
    ]
    angles = [at_drift(angle) for angle in (-15.0, -8.0, -4.0, 4.0, 8.0, 15.0)]
    velocity = np.repeat(angles, 200, axis=0)
    t = 0.005 * np.arange(len(velocity))
    runs.append(tow(SHIP, t, velocity, 0.0 * velocity, model_inertia))
    return tuple(noisy(run, noise).with_(name=f"{i}") for i, run in enumerate(runs))


def noisy(run: Trial, noise: float) -> Trial:
    rng = np.random.default_rng(0)
    channels = {name: run[name] for name in run.channels}
    for name in "XYN":
        force = channels[name]
        size = np.sqrt(np.mean(force**2))
        channels[name] = force + noise * size * rng.standard_normal(len(run))
    return Trial(run.t, channels, kind="captive", length=run.length)


def test_the_models_have_the_coefficients_of_the_paper() -> None:
    """Equations 19 to 21 have 38 (10, 14, 14), equations 39 to 41 have 18 (5, 6, 7)."""
    assert len(PMM38.coefficient_names) == 38
    assert set(PMM18.coefficient_names) == TABLE_11.keys()
    assert TABLE_11.keys() < set(PMM38.coefficient_names)
    for table, counts in ((PMM38, (10, 14, 14)), (PMM18, (5, 6, 7))):
        owned = [
            sum(name[0] == letter for name in table.coefficient_names)
            for letter in "XYN"
        ]
        assert tuple(owned) == counts
    assert {"Y_vdot", "Y_rdot"} < set(PMM18.names("u"))
    assert "X_udot" in PMM18.names("v")
    assert {"X_udot", "Y_vdot", "Y_rdot"} < set(PMM18.names("r"))


@pytest.mark.parametrize("model_inertia", [True, False])
def test_table_11_is_recovered_from_the_virtual_tank(model_inertia: bool) -> None:
    """Added mass, and coefficients of three equations, from all tests at once."""
    model = identify_forces(
        tank_tests(model_inertia=model_inertia),
        "pmm18",
        PARTICULARS,
        model_inertia=model_inertia,
    )
    np.testing.assert_allclose(
        list(model.coefficients.values()), list(SHIP.coefficients.values()), rtol=1e-6
    )


def test_noise_is_told_by_the_standard_errors() -> None:
    model = identify_forces(tank_tests(noise=0.05), "pmm18", PARTICULARS, rank=18)
    assert model.covariance is not None
    errors = np.array(list(model.coefficients.values())) - list(
        SHIP.coefficients.values()
    )
    t = errors / np.sqrt(np.diag(model.covariance))
    assert 0.3 < np.sqrt(np.mean(t**2)) < 2.0
    assert np.abs(t).max() < 5.0


def test_the_full_model_explains_the_tests_but_not_all_its_coefficients() -> None:
    """With u' = 1 in pure yaw ur and uur are one: rank below 38 (tables 3, 6, 8)."""
    model = identify_forces(tank_tests(), "pmm38", PARTICULARS)
    assert model.provenance is not None
    assert model.provenance["rank"] < 38
    assert min(model.provenance["r_squared"].values()) > 1.0 - 1e-9
    for name in ("X_udot", "Y_vdot", "Y_rdot", "N_vdot", "N_rdot"):
        assert model.coefficients[name] == pytest.approx(TABLE_11[name], rel=1e-5), name


def test_trials_of_the_other_kind_are_refused() -> None:
    free = SHIP.simulate(np.zeros((600, 1)), 0.1)
    with pytest.raises(
        InputError, match="got 'pmm18', which is identified from captive tests"
    ):
        identify([free], "pmm18", particulars=PARTICULARS)
    with pytest.raises(InputError, match="for structure 'pmm18', got no 'X'"):
        identify_forces([free], "pmm18", PARTICULARS)
    with pytest.raises(
        InputError,
        match="got 'abkowitz', which is identified from free-running",
    ):
        identify_forces(tank_tests(), "abkowitz", PARTICULARS)
    with pytest.raises(
        InputError, match="expected a positive inertia, got mass of the ship"
    ):
        ShipModel(
            "wrong", "pmm18", PARTICULARS, SHIP.steering, TABLE_11 | {"Y_vdot": 1.0}
        ).ship_numbers()
    with pytest.raises(
        InputError, match="structure: name: expected a non-empty string"
    ):
        replace(PMM18, name=" ")


def test_tests_that_tell_nothing_are_refused() -> None:
    run = tank_tests()[0]
    with pytest.raises(InputError, match="trials: expected captive tests"):
        force_regression([], PMM18, PARTICULARS)
    stopped = Trial(
        run.t, {name: 0.0 * run[name] for name in run.channels}, name="stopped"
    )
    with pytest.raises(InputError, match="trial 'stopped': expected way on the ship"):
        force_regression([stopped], PMM18, PARTICULARS)
    with pytest.raises(InputError, match="particulars: expected at least length"):
        identify_forces([run], "pmm18", None)
