"""Tables of terms: the compiled accelerations, the regression features and the inertia agree."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import shipgym
from shipgym import InputError
from shipgym.models.structures import ABKOWITZ, Structure, get_structure

speeds = st.floats(2.0, 10.0)


@settings(max_examples=50, deadline=None)
@given(speeds, st.floats(-3.0, 3.0), st.floats(-0.02, 0.02), st.floats(-0.7, 0.7))
def test_features_times_coefficients_are_the_simulated_accelerations(u, v, r, delta):
    model = shipgym.load_model("mariner")
    theta = ABKOWITZ.acceleration_matrix(model.particulars) @ list(model.coefficients.values())
    expected, row = [], 0
    for equation in ("u", "v", "r"):
        channels = {"u": [u], "v": [v], "r": [r], "delta": [delta]}
        features = ABKOWITZ.features(equation, channels, model.particulars)[0]
        expected.append(features @ theta[row : row + len(features)])
        row += len(features)
    simulated = model.derivatives([0.0, 0.0, 0.3, u, v, r, delta], [delta])[3:6]
    np.testing.assert_allclose(simulated, expected, rtol=1e-9, atol=1e-12)


def test_abkowitz_has_the_terms_of_the_paper():
    """Cao 2015, tables 2 to 4: 10 coefficients of surge, 15 of sway, 15 of yaw."""
    assert len(ABKOWITZ.coefficient_names) == 40
    assert {"X_uvd", "Y_0uu", "Y_vdd", "N_uud", "N_vvr"} <= set(ABKOWITZ.coefficient_names)
    assert ABKOWITZ.required_channels == ("u", "v", "r", "delta")


def test_a_force_along_one_axis_meets_the_coupled_inertia():
    """M a = F in the prime system with Mariner's inertia (Chislett & Strom-Tejsen 1965)."""
    p = shipgym.load_model("mariner").particulars
    matrix = ABKOWITZ.acceleration_matrix(p)
    y_v, n_v = ABKOWITZ.coefficient_names.index("Y_v"), ABKOWITZ.coefficient_names.index("N_v")
    inertia = 1e-5 * np.array([[1546.0, -9.0], [-23.0, 83.0]])
    length = p["length"]
    sway = matrix[np.ix_([y_v, n_v], [y_v, n_v])] * [[length], [length**2]]
    np.testing.assert_allclose(inertia @ sway, np.eye(2), atol=2e-4)


def test_a_table_survives_its_file_form():
    assert Structure.from_dict(ABKOWITZ.to_dict()) == ABKOWITZ


def test_an_unknown_structure_is_refused():
    with pytest.raises(InputError, match="Did you mean 'abkowitz'"):
        get_structure("abkowits")


def test_inertia_that_cannot_be_is_refused():
    p = replace(shipgym.load_model("mariner").particulars, N_vdot=0.9, Y_rdot=0.9)
    with pytest.raises(InputError, match="inertia of the ship is not positive"):
        ABKOWITZ.acceleration_matrix(p)
