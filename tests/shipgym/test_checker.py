"""check_ship_model finds what is wrong with a model, and passes the shipped ones."""

import json
from dataclasses import replace

import numpy as np
import pytest

import shipgym
from shipgym import Particulars, ShipModel, SteeringGear, check_ship_model
from shipgym.ships import checker
from shipgym.ships.structures import get_structure


@pytest.fixture(scope="module")
def mariner() -> ShipModel:
    return shipgym.load_model("mariner")


def nomoto(K: float, T: float) -> ShipModel:
    return ShipModel(
        "nomoto",
        "nomoto",
        Particulars(length=160.93, speed=7.7175),
        SteeringGear(),
        {"c_r": -1.0 / T, "c_d": K / T},
    )


@pytest.mark.parametrize("name", shipgym.list_models())
def test_shipped_models_are_sound(name):
    check = check_ship_model(name)
    assert check.ok, str(check)
    assert check.asymmetry < 0.1


def test_a_symmetric_ship_has_no_asymmetry(mariner):
    assert check_ship_model(nomoto(0.05, 30.0)).asymmetry == 0.0
    odd = {"Y_0": 0.0, "Y_0u": 0.0, "Y_0uu": 0.0, "N_0": 0.0, "N_0u": 0.0, "N_0uu": 0.0}
    assert (
        check_ship_model(
            replace(mariner, coefficients=mariner.coefficients | odd)
        ).asymmetry
        < 1e-12
    )
    assert 0.001 < check_ship_model(mariner).asymmetry < 0.05


def test_an_asymmetric_ship_is_remarked(mariner):
    lopsided = replace(mariner, coefficients=mariner.coefficients | {"N_0": 60e-5})
    check = check_ship_model(lopsided)
    assert any("port and starboard differ" in remark for remark in check.remarks)
    assert "remark: port and starboard" in str(check)


def test_a_rudder_that_turns_to_the_wrong_side_is_found(mariner):
    check = check_ship_model(nomoto(-0.05, 30.0))
    assert not check.ok
    assert (
        "a positive rudder turns to starboard; read the trials with"
        " rudder_positive='port'" in str(check)
    )
    literature = {
        name: -c if name.count("d") % 2 else c
        for name, c in mariner.coefficients.items()
    }
    assert (
        "rudder: 5 deg to starboard"
        in check_ship_model(replace(mariner, coefficients=literature)).problems[0]
    )


def test_a_ship_that_runs_away_is_found(mariner):
    wild = replace(
        mariner, coefficients=mariner.coefficients | {"N_r": 0.01, "N_vvr": 5.0}
    )
    problems = check_ship_model(wild).problems
    assert any(
        "deg to starboard: model 'mariner' runs away after" in problem
        for problem in problems
    )
    assert any("deg to port" in problem for problem in problems)


def test_accelerations_that_are_no_numbers_are_found(mariner):
    huge = replace(mariner, coefficients=mariner.coefficients | {"X_uuu": 1.7e308})
    assert check_ship_model(huge).problems[0].startswith("derivatives: ")
    assert (
        "expected a number; look for coefficients" in check_ship_model(huge).problems[0]
    )


def test_inertia_that_cannot_be_is_found(mariner):
    light = replace(
        mariner, particulars=replace(mariner.particulars, N_vdot=0.9, Y_rdot=0.9)
    )
    assert "inertia of the ship is not positive" in check_ship_model(light).problems[0]


def test_a_missing_coefficient_in_a_file_is_a_problem_found(mariner, tmp_path):
    mariner.save(tmp_path / "model.json")
    fields = json.loads((tmp_path / "model.json").read_text())
    del fields["coefficients"]["Y_v"]
    (tmp_path / "model.json").write_text(json.dumps(fields))
    check = check_ship_model(tmp_path / "model.json")
    assert "missing: 'Y_v'" in check.problems[0]
    assert np.isnan(check.asymmetry)
    assert (
        "there is no such model file"
        in check_ship_model(tmp_path / "none.json").problems[0]
    )


def test_a_covariance_that_is_none_is_found(mariner):
    root = np.eye(40)
    root[0, 1] = root[1, 0] = 2.0
    assert (
        "least eigenvalue"
        in check_ship_model(replace(mariner, covariance=root)).problems[0]
    )
    negative = np.diag([-1.0, *np.ones(39)])
    assert (
        "variance of 'X_u' is -1"
        in check_ship_model(replace(mariner, covariance=negative)).problems[0]
    )


def test_a_ship_without_rudder_or_thrust_is_remarked():
    table = get_structure("surge")
    drag = dict(zip(table.coefficient_names, [0.0, -4e-4, 0.0, 1e-3], strict=True))
    ship = ShipModel(
        "surge",
        "surge",
        Particulars(length=160.93, speed=7.7175),
        SteeringGear(),
        drag,
        service_shaft_speed=1.2,
    )
    remarks = check_ship_model(ship).remarks
    assert any("no rudder turns this model" in remark for remark in remarks)
    assert any("% of service speed" in remark for remark in remarks)


def test_remarks_begin_at_a_tenth_of_asymmetry_and_at_70_and_130_per_cent_of_the_speed(
    mariner, monkeypatch
):
    for asymmetry, speed, remarks in (
        (0.099, 0.71, 0),
        (0.101, 1.0, 1),
        (0.0, 0.69, 1),
        (0.0, 1.29, 0),
        (0.0, 1.31, 1),
    ):
        monkeypatch.setattr(
            checker, "_run", lambda *_, by=speed: {"u": np.array([by * 7.7175])}
        )
        assert len(list(checker._unusual(mariner, asymmetry))) == remarks


@pytest.mark.parametrize(("heel_deg", "capsized"), [(59.0, False), (-61.0, True)])
def test_a_heel_of_sixty_degrees_is_a_capsize(mariner, heel_deg, capsized, monkeypatch):
    monkeypatch.setattr(
        checker, "_run", lambda *_: {"phi": np.radians([0.0, heel_deg])}
    )
    found = list(checker._wrong_courses(mariner))
    assert [one.partition(":")[0] for one in found] == [
        "straight ahead",
        "rudder 40 deg to starboard",
        "rudder 40 deg to port",
    ] * capsized


def test_a_ship_is_sailed_straight_for_30_lengths_and_in_hard_turns_for_40(
    mariner, monkeypatch
):
    sailed = []
    monkeypatch.setattr(
        checker,
        "_run",
        lambda model, rudder, lengths: sailed.append((rudder, lengths)) or {},
    )
    assert list(checker._wrong_courses(mariner)) == []
    limit = np.radians(40.0)
    assert sailed == [
        (0.0, 30.0),
        (pytest.approx(limit), 40.0),
        (pytest.approx(-limit), 40.0),
    ]


def test_states_are_those_of_hard_manoeuvres(mariner):
    """By service speed and ship length: slow and a little too fast, drifting, turning, rolling and heeled."""
    states = checker._states(mariner)
    length, speed = mariner.particulars["length"], mariner.particulars["speed"]
    u = states["u"]
    assert (u.min() / speed, u.max() / speed) == (
        pytest.approx(0.2, abs=0.01),
        pytest.approx(1.1, abs=0.01),
    )
    sizes = {
        "v": states["v"] / u,
        "r": states["r"] * length / u,
        "p": states["p"] * length / u,
        "phi": np.degrees(states["phi"]),
        "q": states["q"] * (length / speed) ** 2,
        "delta": np.degrees(states["delta"]),
    }
    ranges = {"v": 0.3, "r": 0.8, "p": 0.5, "phi": 15.0, "q": 0.5, "delta": 40.0}
    for name, most in ranges.items():
        assert 0.98 * most < sizes[name].max() <= most
        assert -most <= sizes[name].min() < -0.98 * most


@pytest.mark.parametrize(("off", "problems"), [(0.95e-9, 0), (1.05e-9, 1)])
def test_compiled_accelerations_are_those_of_the_table_to_nine_digits(
    mariner, off, problems, monkeypatch
):
    """By the largest of each."""
    found = checker._accelerations(mariner, checker._states(mariner))
    changed = found.copy()
    changed[7] += off * np.abs(found).max(axis=0)
    monkeypatch.setattr(checker, "_from_table", lambda *_: changed)
    assert len(list(checker._wrong_accelerations(mariner))) == problems


@pytest.mark.parametrize(("excess", "problems"), [(9e-7, 0), (1.05e-6, 1)])
def test_correlations_may_be_off_by_a_millionth(mariner, excess, problems):
    """The least eigenvalue of [[1, 1 + e], [1 + e, 1]] is -e, whatever the units of the coefficients."""
    root = np.diag(np.r_[1e-5, 1.0, np.zeros(38)])
    correlation = np.eye(40)
    correlation[0, 1] = correlation[1, 0] = 1.0 + excess
    found = list(
        checker._wrong_covariance(
            replace(mariner, covariance=root @ correlation @ root)
        )
    )
    assert len(found) == problems
