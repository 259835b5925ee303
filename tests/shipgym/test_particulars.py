"""Particulars of a ship, and the regressions that stand in for what is not known."""

import json
import math
from dataclasses import replace

import pytest

from shipgym import Particulars
from shipgym.errors import InputError
from shipgym.ships.particulars import clarke_added_masses

KVLCC2 = {
    "length": 7.0,
    "beam": 1.2688,
    "draught": 0.455,
    "mass": 3272.0,
    "xg": 0.2436,
    "yaw_gyradius": 1.740,
    "block_coefficient": 0.8098,
    "water_density": 1000.0,
}


def test_clarke_gives_the_kvlcc2_added_masses_within_20_per_cent():
    # Yasukawa and Yoshimura 2015: my' = 0.223, Jz' = 0.011, by rho L^2 d / 2 and rho
    # L^4 d / 2
    by_clarke = clarke_added_masses(7.0, 1.27, 0.46, 0.81)
    draught_by_length = 0.46 / 7.0
    assert by_clarke["Y_vdot"] == pytest.approx(-0.223 * draught_by_length, rel=0.2)
    assert by_clarke["N_rdot"] == pytest.approx(-0.011 * draught_by_length, rel=0.2)


def test_clarkes_regressions_are_those_printed():
    """L/B 100/15, B/T 3, CB 0.7, by -pi (T/L)^2.

    Clarke, Gedling & Hine 1983, worked out.
    """
    scale = -math.pi * 0.05**2
    assert clarke_added_masses(100.0, 15.0, 5.0, 0.7) == pytest.approx(
        {
            "Y_vdot": scale * (1.0 + 0.336 - 0.11475),
            "Y_rdot": scale * (0.1005 - 0.0297),
            "N_vdot": scale * (0.165 - 0.123),
            "N_rdot": scale * (1.0 / 12.0 + 0.0357 - 0.0495),
        }
    )


def test_what_is_given_is_kept_and_what_is_estimated_is_marked():
    ship = Particulars.from_mapping(KVLCC2 | {"added_mass": {"Y_vdot": -0.0145}})
    completed = ship.completed()
    assert ship.estimated == frozenset()
    assert hash(replace(ship, estimated=["mass"])) == hash(
        replace(ship, estimated={"mass"})
    )
    assert completed.estimated == {"X_udot", "Y_rdot", "N_vdot", "N_rdot"}
    assert completed.Y_vdot == -0.0145
    assert completed.X_udot == pytest.approx(-0.05 * completed.mass_prime)
    assert completed.completed() == completed


def test_what_cannot_be_estimated_is_named_with_the_ways_out():
    with pytest.raises(
        InputError,
        match="mass is not given and cannot be estimated without beam, draught, block",
    ):
        Particulars(length=100.0).completed()
    with pytest.raises(
        InputError,
        match=(
            r"Y_vdot .* without beam, draught, block_coefficient; .*\[ship.added_mass\]"
        ),
    ):
        Particulars(length=100.0, mass=5e6).completed()
    with pytest.raises(InputError, match="outside its range"):
        Particulars(
            length=10.0, beam=7.0, draught=0.5, block_coefficient=0.5
        ).completed()
    with pytest.raises(
        InputError, match="particulars of Kvasir: mass is needed and not known"
    ):
        _ = Particulars(name="Kvasir", length=100.0).mass_prime


def test_particulars_are_a_mapping_and_go_through_json():
    ship = Particulars.from_mapping(KVLCC2 | {"name": "KVLCC2"}).completed()
    assert ship["length"] == ship.length == 7.0
    assert Particulars.from_mapping(json.loads(json.dumps(ship.to_dict()))) == ship
    with pytest.raises(KeyError):
        ship["estimated"]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"length": -7.0}, "[ship] length: expected a number > 0"),
        (
            {"length": "7"},
            "got '7'; write the number without quotes",
        ),
        ({"length": math.nan}, "[ship] length: expected"),
        ({"length": True}, "[ship] length: expected"),
        ({"length": None}, "[ship] length: expected"),
        ({"lenght": 7.0}, "[ship]: unknown key 'lenght'. Did you mean 'length'?"),
        ({"name": 3}, "[ship] name: expected a non-empty string"),
        (
            {"block_coefficient": 81.0},
            "[ship] block_coefficient: expected a number > 0 and < 1",
        ),
        (
            {"beam": 12.688},
            "[ship] beam: expected at most 1 of the length, got 12.688 with length 7",
        ),
        ({"xg": 4.0}, "[ship] xg: expected at most 0.5 of the length, got 4"),
        ({"speed": 0.0}, "[ship] speed: expected"),
        ({"water_density": 1.025}, "in kg/m3"),
        ({"mass": 3.272}, "check the units (kg, not tonnes)"),
        (
            {"mass": 3.272, "beam": None, "block_coefficient": None},
            "0.0002 to 0.2 times",
        ),
        (
            {"mass": 9000.0, "block_coefficient": None},
            "a block coefficient of 0.2 to 1",
        ),
        (
            {"added_mass": {"Y_vdot": 0.0145}},
            "[ship] Y_vdot: expected a number > -1 and < 0",
        ),
        ({"added_mass": {"Y_vdot": -2500.0}}, "in the prime system"),
        ({"added_mass": {"Yvdot": -0.01}}, "Did you mean 'Y_vdot'?"),
        ({"added_mass": 3}, "expected a table"),
        ({"estimated": ["colour"]}, "expected a list of names"),
    ],
)
def test_what_no_ship_has_is_refused(values, message):
    with pytest.raises(InputError) as caught:
        Particulars.from_mapping(KVLCC2 | values, "ship.toml: [ship]")
    assert str(caught.value).startswith("ship.toml: [ship]")
    assert message in str(caught.value)
