"""Units of a file are those of the international system, by their definitions."""

import pytest
from scipy import constants

from shipgym.errors import InputError
from shipgym.trials.units import QUANTITIES, UNITS, si_factor, si_unit


@pytest.mark.parametrize(
    ("channel", "units"),
    [
        (
            "t",
            {
                "s": 1,
                "ms": constants.milli,
                "min": constants.minute,
                "h": constants.hour,
                "us": constants.micro,
                "ns": constants.nano,
                "days": constants.day,
                "unix": 1,
            },
        ),
        (
            "x",
            {
                "m": 1,
                "km": constants.kilo,
                "nm": constants.nautical_mile,
            },
        ),
        ("psi", {"rad": 1, "deg": constants.degree}),
        (
            "r",
            {
                "rad/s": 1,
                "deg/s": constants.degree,
                "deg/min": constants.degree / constants.minute,
            },
        ),
        (
            "u",
            {
                "m/s": 1,
                "knots": constants.knot,
                "kn": constants.knot,
                "km/h": constants.kmh,
            },
        ),
        ("n", {"rps": 1, "rpm": 1 / constants.minute}),
        ("X", {"N": 1, "kN": constants.kilo}),
        ("N", {"N m": 1, "kN m": constants.kilo}),
        ("lat", {"deg": 1, "ddmm.mm": 1}),
        ("wind_udot", {"m/s^2": 1}),
        ("wind_rdot", {"rad/s^2": 1, "deg/s^2": constants.degree}),
    ],
)
def test_units_are_what_they_are_by_definition(channel, units):
    known = UNITS[QUANTITIES[channel]]
    assert {unit: si_factor(channel, unit) for unit in units} == pytest.approx(units)
    # the same, counted from a date
    dated = ("unix", "excel", "matlab", "gps")
    assert all(unit.startswith(dated) for unit in known.keys() - units.keys())
    assert si_unit(channel) == next(iter(units))
    with pytest.raises(
        InputError,
        match=(rf"columns: expected a unit of {QUANTITIES[channel]} .*, got 'furlong'"),
    ):
        si_factor(channel, "furlong", "columns")
