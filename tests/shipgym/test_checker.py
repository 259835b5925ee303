"""check_ship_model finds what is wrong with a model, and passes the shipped ones."""

import json
from dataclasses import replace

import pytest

import shipgym
from shipgym import Particulars, ShipModel, SteeringGear, check_ship_model
from shipgym.ships import Structure, get_structure
from shipgym.ships.terms import read_terms


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


@pytest.mark.parametrize("name", ["mariner-tls-svm", "kvlcc2-tanker-rm-svm"])
def test_shipped_models_are_sound(name):
    check = check_ship_model(name)
    assert check.ok, str(check)


def test_a_rudder_that_turns_to_the_wrong_side_is_found(mariner):
    check = check_ship_model(nomoto(-0.05, 30.0))
    assert not check.ok
    assert (
        "a positive rudder turns to starboard: read the trials with"
        " rudder_positive='port'" in str(check)
    )
    literature = {
        name: -c if name.count("d") % 2 else c
        for name, c in mariner.coefficients.items()
    }
    assert (
        "with full rudder to starboard"
        in check_ship_model(replace(mariner, coefficients=literature)).problems[0]
    )


def test_a_ship_that_runs_away_is_found(mariner):
    wild = replace(
        mariner, coefficients=mariner.coefficients | {"N_r": 0.01, "N_vvr": 5.0}
    )
    problems = check_ship_model(wild).problems
    assert any(
        "rudder to starboard: model 'mariner' runs away after" in problem
        for problem in problems
    )
    assert any("rudder to port" in problem for problem in problems)


def test_accelerations_that_are_no_numbers_are_found(mariner):
    huge = replace(mariner, coefficients=mariner.coefficients | {"X_uuu": 1.7e308})
    assert check_ship_model(huge).problems[0].startswith("derivatives: ")
    assert (
        "; look for coefficients that are far too" in check_ship_model(huge).problems[0]
    )


def test_a_missing_coefficient_in_a_file_is_a_problem_found(mariner, tmp_path):
    mariner.save(tmp_path / "model.json")
    fields = json.loads((tmp_path / "model.json").read_text())
    del fields["coefficients"]["Y_v"]
    (tmp_path / "model.json").write_text(json.dumps(fields))
    check = check_ship_model(tmp_path / "model.json")
    assert "missing: 'Y_v'" in check.problems[0]
    assert (
        "there is no such model file"
        in check_ship_model(tmp_path / "none.json").problems[0]
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


def rolling(**equations: dict[str, float]) -> ShipModel:
    """A ship of own equations, each given by its terms and their coefficients."""
    table = Structure(
        "own",
        "own",
        {q: read_terms(", ".join(terms)) for q, terms in equations.items()},
        "si",
        "acceleration",
    )
    values = [value for terms in equations.values() for value in terms.values()]
    return ShipModel(
        "own",
        "own",
        Particulars(length=100.0, speed=5.0),
        SteeringGear(),
        dict(zip(table.coefficient_names, values, strict=True)),
        dynamics=table,
    )


@pytest.mark.parametrize(("heel_deg", "capsized"), [(59.0, False), (61.0, True)])
def test_a_heel_of_sixty_degrees_is_a_capsize(heel_deg, capsized):
    """With the rudder at its limit of 35 deg, to which the ship heels slowly."""
    ship = rolling(
        r={"r": -0.1, "delta": 0.01},
        p={"p": -2.0, "phi": -0.2, "delta": 0.2 * heel_deg / 35.0},
    )
    problems = check_ship_model(ship).problems
    assert [one.partition(":")[0] for one in problems] == [
        "full rudder to starboard",
        "full rudder to port",
    ] * capsized
