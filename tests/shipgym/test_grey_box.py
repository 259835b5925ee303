"""Grey boxes: a reference ship at another length and speed, plus a table of terms."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import shipgym
from shipgym import ShipModel, register_structure
from shipgym.errors import InputError
from shipgym.manoeuvres import zigzag
from shipgym.models import converted_model, grey_box
from shipgym.ships import get_structure

pytestmark = pytest.mark.interpreted


@pytest.fixture(scope="module")
def tanker() -> ShipModel:
    return shipgym.load_model("tanker")


@pytest.fixture(scope="module")
def kvlcc2() -> ShipModel:
    return shipgym.load_model("kvlcc2")


@pytest.fixture(scope="module")
def bare(tanker: ShipModel, kvlcc2: ShipModel) -> ShipModel:
    """KVLCC2 as the bare tanker."""
    return converted_model(
        tanker, kvlcc2.particulars, kvlcc2.steering, kvlcc2.service_shaft_speed
    )


@pytest.mark.parametrize("name", ["mariner", "container"])
def test_a_reference_ship_converted_to_itself_is_itself(name: str) -> None:
    ship = shipgym.load_model(name)
    same = converted_model(
        ship, ship.particulars, ship.steering, ship.service_shaft_speed
    )
    ours, theirs = (
        zigzag(model, 20, 20, duration=300, dt=0.5) for model in (same, ship)
    )
    for channel in ("u", "v", "r", "psi"):
        np.testing.assert_allclose(ours[channel], theirs[channel], rtol=0.0, atol=1e-12)


def test_accelerations_are_the_converted_ones_and_the_terms(
    bare: ShipModel, tanker: ShipModel
) -> None:
    """Equations 7 and 8 of Mei 2019, and back: written out by hand for one state."""
    model = replace(
        bare, coefficients=bare.coefficients | {"a_0": 0.01, "c_v": -0.3, "b_d": 0.2}
    )
    p, q = model.particulars, tanker.particulars
    u, v, r, delta, n = 6.5, -0.8, 0.006, 0.3, 1.7
    fast, turning = (
        q["speed"] / p["speed"],
        (q["speed"] / q.length) / (p["speed"] / p.length),
    )
    shaft = n * tanker.service_shaft_speed / model.service_shaft_speed
    at = [0.0, 0.0, 0.0, fast * u, fast * v, turning * r, delta, shaft]
    theirs = tanker.derivatives(at, [delta, shaft])[3:6]
    V, L = p["speed"], p.length
    linear = (V**2 / L) / (q["speed"] ** 2 / q.length)
    angular = (V**2 / L**2) / (q["speed"] ** 2 / q.length**2)
    expected = theirs * [linear, linear, angular] + [
        0.01 * V**2 / L,
        0.2 * delta * V**2 / L,
        -0.3 * (v / V) * V**2 / L**2,
    ]
    found = model.derivatives([0.0, 0.0, 0.0, u, v, r, delta], [delta, n])[3:6]
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_the_file_of_a_grey_box_holds_the_reference_ship(
    bare: ShipModel, tmp_path: Path
) -> None:
    model = replace(bare, coefficients=bare.coefficients | {"c_r": -0.25})
    model.save(tmp_path / "model.json")
    again = ShipModel.load(tmp_path / "model.json")
    assert again.coefficients == model.coefficients
    np.testing.assert_array_equal(again.ship_numbers(), model.ship_numbers())
    assert again.compiled is model.compiled
    assert again.table.to_dict() == model.table.to_dict()


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (("reference",), 3, "structure.reference"),
        (("shaft",), "yes", "structure.shaft: expected a boolean"),
        (
            ("reference", "coefficients", "t"),
            "x",
            "structure.reference: coefficients.t",
        ),
        (("reference", "structure", "name"), "tankr", "tankr"),
    ],
)
def test_a_broken_file_names_the_field(
    bare: ShipModel, tmp_path: Path, path: tuple[str, ...], value: Any, message: str
) -> None:
    bare.save(tmp_path / "model.json")
    fields = json.loads((tmp_path / "model.json").read_text())
    place = fields["structure"]
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    (tmp_path / "model.json").write_text(json.dumps(fields))
    with pytest.raises(InputError, match=message.replace(".", r"\.")):
        ShipModel.load(tmp_path / "model.json")


def test_what_cannot_be_a_reference_is_refused(
    bare: ShipModel, tanker: ShipModel
) -> None:
    with pytest.raises(InputError, match="grey box itself"):
        grey_box(bare)
    with pytest.raises(InputError, match="has no shaft speed"):
        replace(grey_box("mariner"), shaft=True)
    with pytest.raises(InputError, match="give the reference"):
        get_structure("grey-box")
    with pytest.raises(
        InputError, match="got 'grey-box', which is another structure's"
    ):
        register_structure("grey-box", {"r": "r, delta"})
    with pytest.raises(InputError, match="expected quantity 'acceleration'"):
        replace(grey_box(tanker), quantity="force")
    with pytest.raises(InputError, match=r"some of 'u', 'v', 'r', .* got 'w'"):
        grey_box(tanker, {"w": "v"})
