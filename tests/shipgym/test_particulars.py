"""Particulars of a ship, and the regressions that stand in for what is not known."""

import json
import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from shipgym.checks import did_you_mean
from shipgym.errors import InputError
from shipgym.ships.particulars import (
    ADDED_MASSES,
    NAMES,
    Particulars,
    clarke_added_masses,
)

MARINER = {"length": 160.93, "beam": 23.17, "draught": 8.23, "speed": 7.7175}
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


def test_clarke_gives_the_mariner_s_measured_added_masses_within_30_per_cent():
    # Chislett and Strom-Tejsen 1965; m' = 798e-5 is a block coefficient of 0.54 at the
    # main dimensions
    mass = 798e-5 * 0.5 * 1025.0 * 160.93**3
    ship = Particulars.from_mapping(MARINER | {"mass": mass}).completed()
    assert ship.block_coefficient == pytest.approx(0.542, abs=1e-3)
    assert ship.mass_prime == pytest.approx(798e-5)
    assert ship.Y_vdot == pytest.approx(-748e-5, rel=0.3)
    assert ship.N_rdot == pytest.approx(-43.8e-5, rel=0.3)
    assert ship.X_udot == pytest.approx(-42e-5, rel=0.06)
    assert ship.inertia_prime == pytest.approx(39.2e-5, rel=0.3)


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


def test_mass_and_inertia_are_estimated_from_the_block_coefficient():
    ship = Particulars(
        length=100.0, beam=16.0, draught=6.0, block_coefficient=0.7
    ).completed()
    assert ship.water_density == 1025.0
    assert ship.mass == pytest.approx(1025.0 * 100.0 * 16.0 * 6.0 * 0.7)
    assert (ship.xg, ship.yaw_gyradius) == (0.0, 25.0)
    assert ship.estimated == {
        "water_density",
        "mass",
        "xg",
        "yaw_gyradius",
        *ADDED_MASSES,
    }


def test_the_yaw_inertia_is_about_midship():
    ship = Particulars.from_mapping(KVLCC2)
    half_rho = 500.0
    assert ship.mass_prime == pytest.approx(3272.0 / (half_rho * 7.0**3))
    assert ship.xg_prime == pytest.approx(0.0348)
    assert ship.inertia_prime == pytest.approx(
        3272.0 * (1.740**2 + 0.2436**2) / (half_rho * 7.0**5)
    )


@given(st.floats(0.1, 100.0))
def test_prime_values_do_not_depend_on_the_scale(scale):
    powers = {"mass": 3, "block_coefficient": 0, "water_density": 0}
    other = {
        name: value * scale ** powers.get(name, 1) for name, value in KVLCC2.items()
    }
    a, b = (Particulars.from_mapping(values).completed() for values in (KVLCC2, other))
    assert b.mass_prime == pytest.approx(a.mass_prime)
    assert b.inertia_prime == pytest.approx(a.inertia_prime)
    for name in ADDED_MASSES:
        assert b.require(name) == pytest.approx(a.require(name))


def test_given_added_masses_ask_for_no_beam():
    added = {
        "X_udot": -0.0005,
        "Y_vdot": -0.008,
        "Y_rdot": 0.0,
        "N_vdot": 0.0,
        "N_rdot": -0.0004,
    }
    ship = Particulars.from_mapping(
        {"length": 100.0, "mass": 5e6, "added_mass": added}
    ).completed()
    assert ship.beam is None
    assert ship.estimated == {"water_density", "xg", "yaw_gyradius"}


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
    assert tuple(ship) == NAMES
    assert len(ship) == len(NAMES)
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
            "[ship] added_mass Y_vdot: expected a number > -1 and < 0",
        ),
        ({"added_mass": {"Y_vdot": -2500.0}}, "in the prime system"),
        ({"added_mass": {"Yvdot": -0.01}}, "Did you mean 'Y_vdot'?"),
        ({"added_mass": {"Y_vdot": -0.01}, "Y_vdot": -0.01}, "got Y_vdot twice"),
        ({"added_mass": 3}, "expected a table"),
        ({"estimated": ["colour"]}, "expected a list of names"),
    ],
)
def test_what_no_ship_has_is_refused(values, message):
    with pytest.raises(InputError) as caught:
        Particulars.from_mapping(KVLCC2 | values, "ship.toml: [ship]")
    assert str(caught.value).startswith("ship.toml: [ship]")
    assert message in str(caught.value)


def test_inertia_is_about_midship():
    """The gyradius is about the centre of gravity, xg forward of midship (Steiner)."""
    ship = Particulars(
        length=100.0, mass=8e6, xg=5.0, yaw_gyradius=25.0, water_density=1000.0
    )
    unit = 0.5 * 1000.0 * 100.0**3
    assert ship.mass_prime == pytest.approx(8e6 / unit)
    assert ship.xg_prime == pytest.approx(0.05)
    assert ship.inertia_prime == pytest.approx(
        8e6 * (25.0**2 + 5.0**2) / (unit * 100.0**2)
    )


def test_the_nearest_known_name_is_suggested_where_it_is_near():
    """Twice the letters in common by those of both: from 0.6 on, whatever the case."""
    assert did_you_mean("wxyzabcd", ["abcdk"]) == " Did you mean 'abcdk'?"  # 8 of 13
    assert did_you_mean("wxyzabcd", ["abcdkl"]) == ""  # 8 of 14
    assert did_you_mean("LENGHT", ["beam", "Length"]) == " Did you mean 'Length'?"
    assert did_you_mean("x", []) == ""
