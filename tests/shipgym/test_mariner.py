"""The Mariner class ship against the MSS toolbox (Fossen), rows and manoeuvres of
../shared/reference.
"""

from dataclasses import replace

import numpy as np
import pytest

import shipgym
from shipgym import manoeuvres
from tests.shipgym.reference import table

STATE = ("x_m", "y_m", "psi_rad", "u_m_s", "v_m_s", "r_rad_s", "delta_rad")

# u - U0, v, r, psi, delta and command in the toolbox's signs; dot x, y, psi, u, v, r,
# delta (rows 2, 9, 74)
QUOTED = [
    (
        (
            0.109922006385504,
            -1.28104557403754,
            -0.000236012473635734,
            -1.6592545915132,
            0.463090115976534,
            -0.493775397495325,
        ),
        (
            -1.9675343688253,
            -7.6836463698104,
            -0.000236012473635734,
            -0.0248488781949769,
            0.0899953536218345,
            -0.000639396277595128,
            0.0306852815187907,
        ),
    ),
    (
        (
            -2.36031323033306,
            0.868584607808822,
            -0.00468575781008243,
            -0.531783358161809,
            0.0919319512080486,
            -0.133117521863383,
        ),
        (
            5.05781578551091,
            -1.9678386076743,
            -0.00468575781008243,
            0.00809371814830123,
            -0.0169180517352556,
            0.000123742035452563,
            0.041185570655334,
        ),
    ),
    (
        (
            -1.85530905563183,
            0.102028819411614,
            -0.00699777654520087,
            2.58821330186862,
            -0.109910795327196,
            -0.81628443378589,
        ),
        (
            -5.04090116921831,
            2.99416231196576,
            -0.00699777654520087,
            0.0130209171184678,
            0.00521660991970111,
            0.000448466989932269,
            0.0872664625997165,
        ),
    ),
]


def at_speed(speed):
    """The Mariner at a service speed, m/s."""
    model = shipgym.load_model("mariner")
    return replace(model, particulars=replace(model.particulars, speed=speed))


@pytest.mark.parametrize(("given", "expected"), QUOTED)
def test_derivatives_are_the_toolbox_s(given, expected):
    du, v, r, psi, delta, command = given
    state = [0.0, 0.0, psi, 7.7175 + du, v, r, -delta]
    rates = shipgym.load_model("mariner").derivatives(state, [command])
    np.testing.assert_allclose(rates, [*expected[:6], -expected[6]], rtol=1e-10)


def test_all_derivatives_of_the_reference_table():
    rows = table("mariner_derivatives.csv")
    for row in rows:
        state = [
            row["x_m"],
            row["y_m"],
            row["psi_rad"],
            row["U0_m_s"] + row["du_pert_m_s"],
            row["v_m_s"],
            row["r_rad_s"],
            -row["delta_state_rad"],
        ]
        expected = [
            row[f"dot_{name}"]
            for name in ("x_m_s", "y_m_s", "psi_rad_s", "u_m_s2", "v_m_s2", "r_rad_s2")
        ]
        rates = at_speed(row["U0_m_s"]).derivatives(state, [row["ui_delta_cmd_rad"]])
        np.testing.assert_allclose(
            rates, [*expected, -row["dot_delta_rad_s"]], rtol=1e-10
        )


@pytest.mark.parametrize(
    ("angle", "first", "second"),
    [(10, 4.98, 4.47), (20, 7.78, 6.36)],
)
def test_zigzag_overshoots(angle, first, second):
    trial = manoeuvres.zigzag(
        shipgym.load_model("mariner"), angle, angle, switch="step"
    )
    indices = manoeuvres.zigzag_indices(trial)
    assert indices.overshoot_1_deg == pytest.approx(first, abs=0.01)
    assert indices.overshoot_2_deg == pytest.approx(second, abs=0.01)


@pytest.mark.parametrize(
    ("rudder", "advance", "tactical"),
    [(35, 3.54, 6.40), (-35, 3.71, 6.65), (30, 3.67, 6.52)],
)
def test_turning_circles(rudder, advance, tactical):
    indices = manoeuvres.turning_indices(
        manoeuvres.turning_circle(shipgym.load_model("mariner"), rudder)
    )
    assert indices.advance_lengths == pytest.approx(advance, abs=0.006)
    assert indices.tactical_diameter_lengths == pytest.approx(tactical, abs=0.006)


def simulated(file: str):
    model = shipgym.load_model("mariner")
    if "turning" in file:
        return manoeuvres.turning_circle(model, 35.0)
    angle = float(file.split("_")[2])
    return manoeuvres.zigzag(model, angle, angle, switch="step")


@pytest.mark.parametrize(
    "file", ["zigzag_10_10", "zigzag_15_15", "zigzag_20_20", "turning_35"]
)
def test_trajectories_are_the_reference_s(file):
    expected = table(f"mariner_{file}.csv")
    trial = simulated(f"mariner_{file}")
    for name, column in zip(
        ("x", "y", "psi", "u", "v", "r", "delta"), STATE, strict=True
    ):
        sign = -1.0 if name == "delta" else 1.0
        span = np.ptp(expected[column])
        np.testing.assert_allclose(
            trial[name][::5], sign * expected[column], rtol=0.0, atol=1e-6 * span
        )
