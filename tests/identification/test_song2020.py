import numpy as np
import pytest
from papers import get_paper, song2020, song2020_container
from papers.song2020_container import (
    HULL,
    PROPULSION,
    inertia_matrix,
    recorded,
    regressors,
)

from shipgym.models import load_model
from shipgym.ships import container as own
from shipgym.ships.structures import get_structure


@pytest.fixture(scope="module")
def rows():
    return list(get_paper("song2020").rows())


def quantities(rows, *cases):
    return [row for row in rows if row.case in cases]


def test_every_aim_is_met(rows):
    assert [row for row in rows if row.met is False] == []
    assert sum(row.met is True for row in rows) > 50


def test_nomoto_s_coefficients_come_within_a_thousandth(rows):
    tables = quantities(rows, "Table 3-3", "Table 3-4", "Figure 3.4", "Figure 3.5")
    assert len(tables) == 18
    assert all(row.best < 0.1 for row in tables)


def test_the_printed_means_are_those_of_the_printed_errors(rows):
    means = {
        row.quantity: row.printed for row in rows if row.quantity.startswith("mean by")
    }
    assert means == {
        "mean by SG: error, %": pytest.approx(4.05),
        "mean by NISG: error, %": pytest.approx(1.02),
    }
    linear = [
        row.printed
        for row in rows
        if row.case == "Table 3-3" and row.quantity.startswith("mean")
    ]
    assert linear == pytest.approx([52.0, 18.8])


def test_the_printed_errors_are_those_of_the_printed_estimates():
    """To the digits given."""
    for method, (gain, time) in song2020.ESTIMATES.items():
        printed = song2020.TABLE_3_3[method]
        assert 100.0 * (1.0 - gain / song2020.K) == pytest.approx(printed["K"], abs=0.5)
        assert 100.0 * (1.0 - time / song2020.T) == pytest.approx(printed["T"], abs=0.5)


def test_with_the_noise_of_instruments_they_come_within_one_per_cent(rows):
    noisy = quantities(rows, "Section 3.1")
    assert len(noisy) == 5
    assert all(row.best < 1.0 for row in noisy)


def test_the_printed_gradient_is_the_one_of_the_package_on_scaled_columns():
    """The package's tanh(omega e) / omega, of omega 0, is the plain innovation."""
    from identification.estimators.recursive import StochasticGradient

    X, y = song2020.regression("norrbin", song2020.trial("norrbin"))
    ours, _ = song2020.gradient(X[:500], y[:500])
    np.testing.assert_allclose(
        StochasticGradient().fit(X[:500], y[:500]).coef_, ours, rtol=1e-9
    )


def test_the_printed_innovation_only_shortens_the_steps():
    """tanh(omega e) of an acceleration is omega e: the path of SG with longer steps."""
    X, y = song2020.regression("nomoto", song2020.trial("nomoto"))
    bent, largest = song2020.gradient(X[:2000], y[:2000], omega=0.5)
    short, _ = song2020.gradient(X[:2000], y[:2000], gain=0.5)
    assert largest < 1e-3
    np.testing.assert_allclose(bent, short, rtol=1e-4)


def test_the_regressors_are_those_of_the_structure_of_the_package():
    """But for thrust and rudder, and what the structure has to find."""
    known = {"u": set(), "v": {"ur"}, "r": set(), "p": {"f"}}
    for equation, text in HULL.items():
        theirs = {term.powers for term in song2020_container.read_terms(text)}
        ours = {
            term.powers
            for term in get_structure("mmg4dof").terms(equation)
            if not {"n", "delta"} & {symbol for symbol, _ in term.powers}
            and term.name not in known[equation]
        }
        assert theirs == ours, equation


def test_thrust_rudder_and_known_forces_are_the_container_ship_s():
    """With her own hull and numbers the equations give her accelerations."""
    ship, trial = load_model("container"), recorded(20, 20)
    motion = {name: trial[name][400] for name in song2020_container.CHANNELS}
    state = np.array([motion[name] for name in ship.state_names])
    command = np.array([motion["delta"], motion["n"]])
    index = [ship.state_names.index(name) for name in "uvrp"]
    expected = ship.derivatives(state, command)[index]
    speed, L = np.hypot(motion["u"], motion["v"]), own.LENGTH
    u, v, r, p, f = (
        *(motion[c] / speed for c in "uv"),
        *(motion[c] * L / speed for c in "rp"),
        motion["phi"],
    )
    basis = np.array(
        [
            v,
            r,
            p,
            f,
            v**3,
            r**3,
            v * v * r,
            v * r * r,
            v * v * f,
            v * f * f,
            r * r * f,
            r * f * f,
        ]
    )
    labels = (
        "v",
        "r",
        "p",
        "f",
        "vvv",
        "rrr",
        "vvr",
        "vrr",
        "vvf",
        "vff",
        "rrf",
        "rff",
    )
    columns, known = regressors(motion), song2020_container.known_forces(motion)
    numbers = {equation: [] for equation in HULL}
    for equation, _, true in PROPULSION.values():
        numbers[equation].append(true)
    forces = []
    for equation, letter in zip("uvrp", "XYNK", strict=True):
        if letter == "X":
            hull = (
                own.PUBLISHED.X_uu * u * u
                + own.PUBLISHED.X_vr * v * r
                + own.PUBLISHED.X_vv * v * v
                + own.PUBLISHED.X_rr * r * r
                + own.PUBLISHED.X_ff * f * f
            )
        else:
            hull = basis @ [
                getattr(own.PUBLISHED, f"{letter}_{label}") for label in labels
            ]
        pushed = np.dot(columns[equation][-len(numbers[equation]) :], numbers[equation])
        forces.append(hull + pushed + known[equation])
    scale = speed**2 / L / np.array([1.0, 1.0, L, L])
    np.testing.assert_allclose(
        np.linalg.solve(inertia_matrix(), forces) * scale, expected, rtol=1e-9
    )


def test_propeller_and_rudder_come_out_near_the_container_ship_s(rows):
    for name, (_, _, true) in PROPULSION.items():
        row = next(row for row in rows if row.quantity == name)
        assert row.best == pytest.approx(true, rel=0.12), name
        assert row.as_paper == pytest.approx(true, rel=0.12), name


def test_the_printed_innovation_is_even_and_fails_where_the_odd_one_converges(rows):
    found = {
        row.quantity: row.as_paper
        for row in rows
        if row.case == "Equations 4-9 to 4-12"
    }
    assert len(found) == 4
    for quantity, error in found.items():
        assert (abs(error) < 2.0) == ("odd" in quantity)


def test_knowing_the_seas_halves_every_error_at_least(rows):
    seas = [row for row in rows if row.case == "Sea state 2 to 3"]
    assert len(seas) == 8
    for known, left_in in zip(seas[::2], seas[1::2], strict=True):
        assert known.met
        assert known.best < 0.5 * left_in.best
