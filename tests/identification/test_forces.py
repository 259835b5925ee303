"""Captive tests: the vectorial PMM models, with coefficients shared by equations."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from papers.captive import oscillate, tow
from papers.xu2020_tank import PMM18, PMM38, TABLE_11, xu_ship

import shipgym
from identification import identify
from identification.models.forces import (
    ForceRegression,
    between_jumps,
    force_regression,
    force_variances,
    identify_forces,
)
from shipgym import InputError, Particulars, ShipModel, Trial
from shipgym.ships.shared_structure import VR, Share, read_shares, shared_structure
from shipgym.ships.structures import get_structure

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
PRIME_MASS = 0.5 * 1025.0 * 28.9**3


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


def test_a_share_counts_as_it_is_unless_a_sign_is_given() -> None:
    assert Share("Y_vr", VR).to_dict()["sign"] == 1.0


def test_each_term_stands_once_and_before_those_of_the_mass() -> None:
    named = {"u": "X_uuu -Y_vdot:vr X_uvv", "v": "Y_v Y_uv", "r": "N_r Y_v"}
    shares = {axis: read_shares(text) for axis, text in named.items()}
    table = shared_structure("mine", "own", shares)
    assert [term.name for term in table.terms("u")] == ["uuu", "uvv", "vr", "rr"]
    assert sorted(term.name for term in table.terms("r")) == ["r", "ur", "uv", "v"]
    assert table.terms("v") == table.terms("r")
    assert table.coefficient_names == ("X_uuu", "Y_vdot", "X_uvv", "Y_v", "Y_uv", "N_r")
    signs = {share.coefficient: share.sign for share in table.shares["u"]}
    assert signs == {"X_uuu": 1.0, "Y_vdot": -1.0, "X_uvv": 1.0}


def test_a_kept_acceleration_feels_mass_and_added_mass() -> None:
    """Equation 40 with v only: (m' - Y_vdot) vdot' + ... = Y_uuv + Y_v|v| v'|v'|."""
    m = 417e3 / PRIME_MASS
    drift, L, U = 0.1, 28.9, 5.0
    u, v = np.cos(drift), -np.sin(drift)
    rates = SHIP.derivatives([0.0, 0.0, 0.0, U * u, U * v, 0.0, 0.0], [0.0])
    udot, vdot, rdot = rates[3] * L / U**2, rates[4] * L / U**2, rates[5] * (L / U) ** 2
    c = TABLE_11
    assert udot == pytest.approx(
        (c["X_uuu"] * u**3 + c["X_uvv"] * u * v * v) / (m - c["X_udot"])
    )
    Y = c["Y_uuv"] * u * u * v + c["Y_v|v|"] * v * abs(v)
    N = (c["Y_vdot"] - c["X_udot"]) * u * v + c["N_uuv"] * u * u * v
    static, yaw = m * -0.5 / L, m * ((7.2 / L) ** 2 + (0.5 / L) ** 2)
    assert (m - c["Y_vdot"]) * vdot + (static - c["Y_rdot"]) * rdot == pytest.approx(Y)
    assert (static - c["N_vdot"]) * vdot + (yaw - c["N_rdot"]) * rdot == pytest.approx(
        N
    )


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
    model = identify_forces(tank_tests(noise=0.05), "pmm18", PARTICULARS, method="ls")
    assert model.covariance is not None
    errors = np.array(list(model.coefficients.values())) - list(
        SHIP.coefficients.values()
    )
    t = errors / np.sqrt(np.diag(model.covariance))
    assert 0.3 < np.sqrt(np.mean(t**2)) < 2.0
    assert np.abs(t).max() < 5.0


def test_each_force_has_the_noise_of_its_own_residuals() -> None:
    """A bad gauge of X leaves the coefficients of N as certain as they are."""
    rng = np.random.default_rng(0)
    runs = []
    for run in tank_tests(noise=0.05):
        spoilt = run["X"] + 3.0 * np.std(run["X"]) * rng.standard_normal(len(run))
        channels = {name: run[name] for name in run.channels} | {"X": spoilt}
        runs.append(
            Trial(run.t, channels, name=run.name, kind="captive", length=run.length)
        )
    model = identify_forces(runs, "pmm18", PARTICULARS, method="ls")
    assert model.covariance is not None
    errors = np.array(list(model.coefficients.values())) - list(
        SHIP.coefficients.values()
    )
    t = errors / np.sqrt(np.diag(model.covariance))
    for force in "XN":
        own = [name[0] == force for name in model.coefficients]
        assert 0.3 < np.sqrt(np.mean(t[own] ** 2)) < 2.5, force


def test_the_full_model_explains_the_tests_but_not_all_its_coefficients() -> None:
    """With u' = 1 in pure yaw ur and uur are one: rank below 38 (tables 3, 6, 8)."""
    model = identify_forces(tank_tests(), "pmm38", PARTICULARS)
    assert model.provenance is not None
    assert model.provenance["rank"] < 38
    assert min(model.provenance["r_squared"].values()) > 1.0 - 1e-9
    for name in ("X_udot", "Y_vdot", "Y_rdot", "N_vdot", "N_rdot"):
        assert model.coefficients[name] == pytest.approx(TABLE_11[name], rel=1e-5), name


def test_the_regression_stacks_x_y_and_n() -> None:
    regression = force_regression(tank_tests(), PMM18, PARTICULARS)
    assert regression.features.shape == (len(regression), 18)
    assert np.bincount(regression.equation).tolist() == [len(regression) // 3] * 3
    truth = np.array(list(SHIP.coefficients.values()))
    assert min(regression.r_squared(truth).values()) > 1.0 - 1e-9
    shared = regression.features[:, regression.names.index("Y_vdot")]
    assert all(np.abs(shared[regression.equation == i]).max() > 0.0 for i in range(3))


def test_a_table_of_shares_survives_its_file(tmp_path) -> None:  # type: ignore[no-untyped-def]
    SHIP.save(tmp_path / "ship.json")
    again = ShipModel.load(tmp_path / "ship.json")
    assert again.table == PMM18
    assert again.coefficients == TABLE_11
    assert shipgym.check_ship_model(again).ok
    assert get_structure("pmm38") == type(PMM38).from_dict(PMM38.to_dict())
    commands = np.zeros((600, 1))
    start = [0.0, 0.0, 0.0, 5.0, 0.3, 0.05, 0.0]
    runs = [ship.simulate(commands, 0.1, start) for ship in (SHIP, again)]
    np.testing.assert_array_equal(runs[0]["u"], runs[1]["u"])
    assert 0.0 < runs[0]["u"][-1] < 5.0  # nothing drives her


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


def test_rows_of_the_regression_know_their_force_and_their_trial() -> None:
    runs = tank_tests()[:3]
    found = force_regression(runs, PMM18, PARTICULARS)
    rows = len(found.targets)
    assert found.features.shape == (rows, len(PMM18.coefficient_names))
    assert found.equation.shape == found.trial.shape == (rows,)
    of_axis = [found.trial[found.equation == k].tolist() for k in range(3)]
    assert of_axis[0] == of_axis[1] == of_axis[2] == sorted(of_axis[0])
    assert {k: of_axis[0].count(k) for k in range(3)} == {
        k: len(run) for k, run in enumerate(runs)
    }


def test_tests_that_tell_nothing_are_refused() -> None:
    run = tank_tests()[0]
    with pytest.raises(InputError, match="trials: expected captive tests"):
        force_regression([], PMM18, PARTICULARS)
    stopped = Trial(
        run.t, {name: 0.0 * run[name] for name in run.channels}, name="stopped"
    )
    with pytest.raises(InputError, match="trial 'stopped': expected way on the ship"):
        force_regression([stopped], PMM18, PARTICULARS)
    with pytest.raises(InputError, match="rank: expected none with method 'ls'"):
        identify_forces([run], "pmm18", PARTICULARS, method="ls", rank=3)
    with pytest.raises(InputError, match="particulars: expected at least length"):
        identify_forces([run], "pmm18", None)


def test_the_variance_of_a_force_is_by_its_own_residuals_and_freedom():
    equation = np.array([0, 0, 0, 1, 1, 2])
    residuals = np.array(
        [[1.0, 2.0], [1.0, 2.0], [2.0, 0.0], [3.0, 1.0], [4.0, 1.0], [5.0, 6.0]]
    )
    leverages = np.array([0.5, 0.25, 0.25, 0.9, 0.9, 1.0])
    np.testing.assert_allclose(
        force_variances(equation, residuals, leverages),
        [[3.0, 4.0], [25.0, 2.0], [25.0, 36.0]],
    )


def test_a_static_test_is_cut_where_a_velocity_jumps_by_twenty_usual_changes() -> None:
    for jump, pieces in ((19.0, [slice(0, 20)]), (21.0, [slice(0, 10), slice(10, 20)])):
        change = np.where(np.arange(19) == 9, jump, 1.0)
        u = 5.0 + 0.01 * np.append(0.0, np.cumsum(change))
        trial = Trial(np.arange(20.0), {"u": u, "v": np.zeros(20), "r": np.zeros(20)})
        assert between_jumps(trial) == pieces
    angle = np.repeat(
        [0.0, 0.2, 0.4, 0.6], [5, 3, 4, 8]
    )  # of three samples none tells an acceleration
    held = Trial(np.arange(20.0), {"u": np.ones(20), "v": -angle, "r": np.zeros(20)})
    assert between_jumps(held) == [slice(0, 5), slice(8, 12), slice(12, 20)]


def test_each_force_is_scaled_by_its_root_mean_square_unless_it_is_zero() -> None:
    regression = ForceRegression(
        np.ones((6, 1)),
        np.array([0.0, 0.0, 3.0, 4.0, 5.0, -5.0]),
        ("a",),
        np.repeat(np.arange(3), 2),
        np.tile([0, 1], 3),
    )
    np.testing.assert_allclose(
        regression.scales(), [1.0, 1.0, *[np.sqrt(12.5)] * 2, 5.0, 5.0]
    )
    found = regression.r_squared(np.array([3.5]))
    assert (found["Y"], found["N"]) == (
        pytest.approx(0.0),
        pytest.approx(1.0 - (1.5**2 + 8.5**2) / 50.0),
    )


def test_a_test_of_jumps_alone_is_refused_and_rounding_is_none() -> None:
    steps = np.repeat([0.0, 0.2, 0.4], 3)
    run = {name: np.ones(9) for name in ("X", "Y", "N", "u")} | {
        "v": -steps,
        "r": np.zeros(9),
    }
    with pytest.raises(
        InputError,
        match="trial 'held': expected 4 samples somewhere between",
    ):
        force_regression([Trial(np.arange(9.0), run, name="held")], PMM18, PARTICULARS)
    for off, pieces in ((1.9e-9, 1), (2.1e-9, 2)):  # of the largest velocity
        u = np.where(np.arange(12) < 6, 5.0, 5.0 * (1.0 + off))
        held = Trial(np.arange(12.0), {"u": u, "v": np.zeros(12), "r": np.zeros(12)})
        assert len(between_jumps(held)) == pieces


def test_forces_are_those_of_the_prime_system_less_the_inertia_of_the_ship() -> None:
    """X by rho L^2 U^2 / 2, N by another L; at constant velocities m' r' is left."""
    length, density, U, n = 28.9, 1025.0, 2.0, 8
    still = np.ones(n)
    motion = {"u": 1.6 * still, "v": 1.2 * still, "r": 0.05 * still}
    run = Trial(
        np.arange(float(n)),
        {**motion, "X": 1e4 * still, "Y": 2e4 * still, "N": 3e5 * still},
    )
    unit = 0.5 * density * length**2 * U**2
    plain = force_regression([run], PMM18, PARTICULARS, model_inertia=False)
    forces = [1e4 / unit, 2e4 / unit, 3e5 / unit / length]
    np.testing.assert_allclose(plain.targets, np.repeat(forces, n))
    mass, r, xg = 417e3 / PRIME_MASS, 0.05 * length / U, -0.5 / length
    own = [-mass * (0.6 * r + xg * r**2), mass * 0.8 * r, mass * xg * 0.8 * r]
    full = force_regression([run], PMM18, PARTICULARS)
    np.testing.assert_allclose(full.targets, np.repeat(np.add(forces, own), n))
