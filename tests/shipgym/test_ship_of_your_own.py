"""A ship with equations of her own from one file outside the package.

The one of its documentation page.
"""

import pickle
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import shipgym
from shipgym import (
    InputError,
    check_ship_model,
    load_model,
    manoeuvres,
    register_ship_equations,
)
from shipgym.models.linear import nomoto
from shipgym.ships.structures import REGISTERED_EQUATIONS

pytestmark = pytest.mark.interpreted

PAGE = Path(__file__).parents[2] / "docs" / "ship_of_your_own.md"
TUG = re.search(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)[1]  # type: ignore[index]


@pytest.fixture
def tug(tmp_path: Path) -> Iterator[Path]:
    (tmp_path / "tug.py").write_text(TUG, encoding="utf-8")
    yield tmp_path / "tug.py"
    REGISTERED_EQUATIONS.clear()


def test_one_file_makes_a_sound_ship_that_manoeuvres(tug: Path) -> None:
    model = load_model(tug)
    assert model.state_names == ("x", "y", "psi", "u", "v", "r", "delta", "n")
    assert check_ship_model(model).problems == ()
    circle = manoeuvres.turning_circle(model, 35.0)
    assert 1.0 < manoeuvres.turning_indices(circle).tactical_diameter_lengths < 10.0
    zigzag = manoeuvres.zigzag(model, 20.0, 20.0, duration=200.0)
    assert manoeuvres.zigzag_indices(zigzag).overshoot_1_deg > 0.0
    assert nomoto(model).K > 0.0
    assert (
        np.ptp(manoeuvres.zigzag(model, duration=60.0, weather="moderate")["psi_wave"])
        > 0.0
    )


def test_she_is_known_by_name_in_files_and_in_other_processes(
    tug: Path, tmp_path: Path
) -> None:
    register_ship_equations(tug)
    assert "tug" in shipgym.list_models()
    model = load_model("tug")
    model.save(tmp_path / "tug.json")
    again = load_model(tmp_path / "tug.json")
    np.testing.assert_array_equal(again.ship_numbers(), model.ship_numbers())
    assert again.compiled is model.compiled
    (tmp_path / "tug.pickle").write_bytes(pickle.dumps(model))
    code = (
        "import pickle, sys; tug = pickle.load(open(sys.argv[1], 'rb')); "
        "print(tug.simulate([[0.1, 2.3]] * 20, 0.5)['r'][-1])"
    )
    told = subprocess.run(
        [sys.executable, "-c", code, tmp_path / "tug.pickle"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert float(told.stdout) == model.simulate([[0.1, 2.3]] * 20, 0.5)["r"][-1]


def test_changed_coefficients_compile_nothing_anew(tug: Path) -> None:
    model = load_model(tug)
    quicker = replace(model, coefficients={**model.coefficients, "N_d": 2.8})
    assert quicker.compiled is model.compiled
    state, command = model.service_state, model.service_command
    state[model.state_names.index("delta")] = 0.1
    yaw = model.state_names.index("r")
    rates = [ship.derivatives(state, command)[yaw] for ship in (model, quicker)]
    assert rates[1] == pytest.approx(2.0 * rates[0])


@pytest.mark.parametrize(
    ("wrong", "right", "message"),
    [
        ("SHIP =", "BOAT =", "expected SHIP = ShipEquations.* got None"),
        (
            "from math import fabs",
            "from maths import fabs",
            "line .*: cannot be executed: ModuleNotFoundError",
        ),
        ("= 5.0  # s", "= 'slow'", "coefficient 'T_shaft'.*'slow'"),
        (
            "T_shaft: float = 5.0",
            "T_shaft: str = '5'",
            "expected a NamedTuple of floats",
        ),
        ("= 5.0  # s", "= [5.0]", r"coefficient 'T_shaft'.*\[5\.0\]"),
        pytest.param(
            "fabs(u) * u",
            "fabs(u) * u / (fabs(motion.delta) < 0.5)",
            r"expected a number for the acceleration of 'u' .* got -inf;"
            r" look at .*tug\.py, line LINE, in"
            r" accelerations: ZeroDiv",
            marks=pytest.mark.compiled,
        ),
        (
            "    accelerations,\n",
            "    (lambda k: lambda m, c, s: 5 * (k,))(1.0),\n",
            r"around it \(k\)",
        ),
        (
            "=shaft_acceleration",
            "=(lambda k: lambda n, m, c, s: k * (m - n))(0.2)",
            r"around it \(k\)",
        ),
        (
            '"tug",\n',
            '"mariner",\n',
            "tug.py: name: expected a new one, got 'mariner'",
        ),
        ('"tug",\n', '"container",\n', "got 'container', which is another ship's"),
        (
            "service_shaft_speed=2.357",
            "service_shaft_speed=0.0",
            "service_shaft_speed: expected a number > 0",
        ),
        ("speed=6.0", "speed=None", "speed is needed"),
        (
            "fabs(u) * u",
            "fabs(w) * u",
            r"tug\.py, line LINE, in accelerations: .*name 'w' is not defined",
        ),
        ("rdot, 0.0, 0.0\n", "rdot\n", "accelerations: expected five numbers"),
        (
            "return udot, vdot, rdot, 0.0, 0.0",
            "return [udot, vdot, rdot, 0.0, 0.0]",
            "five numbers, a tuple",
        ),
        (
            "(motion, c, ship)",
            "(motion, c)",
            r"accelerations: expected a function .*got one of arguments",
        ),
        (
            "return (command - n) / c.T_shaft",
            "pass",
            "shaft_acceleration: expected a number, int or float, got None",
        ),
        pytest.param(
            "def accelerations",
            "import numba\n\n\n@numba.njit\ndef accelerations",
            r"tug\.py, line \d+: equations of 'tug': accelerations: expected a"
            r" function .*got no plain function",
            marks=pytest.mark.compiled,
        ),
        (
            "c.N_v * U",
            "c.N_w * U",
            r"tug\.py, line LINE, in accelerations: .*no attribute 'N_w'",
        ),
        pytest.param(
            "c.X_nn * fabs(n) * n",
            "c.X_nn * motion._replace(n=n).n",
            r"cannot be compiled in accelerations .*line LINE.*_replace",
            marks=pytest.mark.compiled,
        ),
        ("c.N_d * U * U", "-c.N_d * U * U", "a positive rudder turns to starboard"),
    ],
)
def test_what_is_wrong_with_her_is_said(
    tug: Path, wrong: str, right: str, message: str
) -> None:
    assert wrong in TUG
    text = TUG.replace(wrong, right)
    tug.write_text(text, encoding="utf-8")
    line = text[: text.index(right)].count("\n") + 1
    found = check_ship_model(tug)
    assert not found.ok
    message = message.replace("LINE", str(line))
    assert re.search(message, found.problems[0], re.DOTALL), found.problems[0]


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(
        InputError,
        match=(
            r"barge\.py: expected a Python file that defines SHIP ="
            r" ShipEquations\(\.\.\.\)"
        ),
    ):
        load_model(tmp_path / "barge.py")
