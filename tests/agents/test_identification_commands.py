"""`shipgym identify`, `advise` and `reduce`, with every option from the ship file or
the command line."""

import json
import re

import document_options
import pytest
from typer.testing import CliRunner

from agents.cli import app
from agents.identifying import (
    identification_settings,
    identify_ship,
    reduce_ship,
)
from identification.models.methods import METHODS
from identification.pipeline.options import ARGUMENTS, stage_settings
from shipgym import InputError, ShipFile, list_structures, load_model

#: The table of terms that the documentation shows.
TABLE = re.search(
    r"```toml\n(\[structure\].*?)```",
    document_options.PAGE.with_name("structures.md").read_text(encoding="utf-8"),
    re.S,
)[1]


def shipgym(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def ship(demo, tmp_path):
    """Writes the demo's ship file with lines of its own in [identify]."""

    def write(*lines):
        head, tail = demo.read_text().split(
            '[identify]\nstructure = "abkowitz"\nmethod = "tls-svm"\n'
        )
        head = head.replace("[steering]", "rudder_area = 30.0\n\n[steering]")
        text = "\n".join([head + "[identify]", *lines, tail])
        (tmp_path / "ship.toml").write_text(
            text.replace('file = "', f'file = "{demo.parent}/')
        )
        return tmp_path / "ship.toml"

    return write


def settings_of(folder):
    return json.loads((folder / "settings.json").read_text())


def identified(path):
    """A ship file, and what is identified from it."""
    ship = ShipFile.load(path)
    return ship, identify_ship(ship, identification_settings(ship, {}))


def test_options_come_from_the_ship_file(ship):
    _, result = identified(
        ship(
            'structure = "linear-steering"',
            'method = "abc-lssvr"',
            'optimiser = { name = "pso", rounds = 5 }',
            "bounds = [1.0, 1e6]",
            'samples = { rule = "integral", window = 9 }',
            'preprocessing = "none"',
            "repair = true",
            'name = "mine"',
            "model_error = false",
            'wind = "none"',
        )
    )
    told = result.settings
    assert told["method"]["name"] == "pso-lssvr"
    assert told["method"]["bounds"] == [1.0, 1e6]
    assert told["method"]["optimiser"] == {"name": "pso", "rounds": 5}
    assert told["samples"] == {"rule": "integral", "window": 9}
    assert told["preprocessing"] == {"smoothing": "none", "repair": True}
    asked = {"covariance": "analytic", "model_error": False}
    assert asked.items() <= told["uncertainty"].items()
    assert told["wind"] == "none"
    assert result.model.name == "mine"


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("rnak = 3", r"ship.toml: \[identify\] rnak: .*Did you mean 'rank'"),
        ("rank = 3.5", r"ship.toml: rank: .*3.5"),
        ("epsilon = 0.1", r"ship.toml: epsilon: .*method 'tls-svm'"),
    ],
)
def test_a_wrong_option_exits_with_2_and_is_named(ship, line, said, tmp_path):
    answer = shipgym("identify", ship(line), "--out", tmp_path / "out")
    assert answer.exit_code == 2
    assert re.search(said, answer.stderr)
    assert answer.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_what_is_wrong_with_trials_is_told_with_the_ship_file(demo):
    ship = ShipFile.load(demo)
    settings = identification_settings(ship, {"structure": "cubic"})
    for call in (
        lambda: identify_ship(ship, settings),
        lambda: reduce_ship(ship, settings, 0.25),
    ):
        with pytest.raises(InputError, match="channel 'n' is missing") as error:
            call()
        assert str(error.value).startswith(f"{ship.path}: ")


def test_options_of_the_command_line_reach_the_settings(ship, tmp_path):
    answer = shipgym(
        "identify",
        ship(),
        "--out",
        tmp_path / "out",
        "--structure",
        "linear-steering",
        "--method",
        "ls-svm",
        "--set",
        "C=1e4",
        "--set",
        "preprocessing=none",
        "--set",
        "repair=true",
        "--set",
        "window=9",
    )
    assert answer.exit_code == 0, answer.stderr
    found = settings_of(tmp_path / "out")
    assert (found["method"]["name"], found["method"]["C"]) == ("ls-svm", 1e4)
    assert found["samples"]["window"] == 9
    assert found["preprocessing"] == {"smoothing": "none", "repair": True}


def test_without_a_structure_it_is_auto_but_for_what_needs_a_table(ship, tmp_path):
    read = ShipFile.load(ship())
    assert identification_settings(read, {})["structure"] == "auto"
    assert "structure" not in identification_settings(read, {"kernel": "rbf"})
    assert identification_settings(read, {}, "abkowitz")["structure"] == "abkowitz"
    answer = shipgym("identify", ship(), "--report", "--out", tmp_path / "out")
    assert answer.exit_code == 0, answer.stderr
    assert (
        "Structures and methods by how they predict each trial in turn" in answer.stdout
    )
    assert "mmg by map was not fitted: trial" in answer.stdout
    told = json.loads((tmp_path / "out" / "metrics.json").read_text())["selection"]
    assert (
        told["ranking"][0]["structure"]
        == load_model(tmp_path / "out" / "model.json").structure
    )
    assert "No structure was named" in (tmp_path / "out" / "report.html").read_text()


def test_a_table_of_terms_in_the_ship_file_is_taken_and_stays_with_the_model(ship):
    read, result = identified(ship(*TABLE.splitlines()))
    assert "mine" not in list_structures()
    assert list(result.coefficients) == [
        "b_v",
        "b_|v|v",
        "b_d",
        "c_v",
        "c_r",
        "c_v2r/U",
        "c_d",
    ]
    assert (result.settings["structure"]["name"], result.stable) == ("mine", True)
    assert result.model.structure == result.model.provenance["structure"] == "mine"
    assert (
        identification_settings(read, {"structure": "nomoto"})["structure"] == "nomoto"
    )
    assert (
        identification_settings(read, {"structure": "mine"})["structure"]
        is read.structure
    )


@pytest.mark.parametrize(
    ("line", "other", "said"),
    [
        (
            'r = "v, r, v^2 r/U, delta"',
            'r = "v, rr"',
            "[structure]: equations.r: terms: expected products",
        ),
        (
            'r = "v, r, v^2 r/U, delta"',
            'r = ""',
            "[structure]: equations.r: expected formulas",
        ),
        (
            'r = "v, r, v^2 r/U, delta"',
            'r = "v r, r v"',
            "expected each term once, got 'rv' twice",
        ),
        (
            'r = "v, r, v^2 r/U, delta"',
            'w = "v"',
            "'q' in this order, got 'v', 'w'",
        ),
        (
            'r = "v, r, v^2 r/U, delta"',
            'r = "import os"',
            "got 'import' in 'import os'",
        ),
        (
            'name = "mine"',
            'name = "auto"',
            "got 'auto', which is another structure's",
        ),
        ('name = "mine"', "", "field 'name' is missing"),
        (
            'name = "mine"',
            'name = "mine"\nterms = 3',
            "[structure]: unknown key 'terms'",
        ),
    ],
)
def test_a_wrong_table_of_terms_is_named(ship, line, other, said, tmp_path):
    assert line in TABLE
    answer = shipgym(
        "identify",
        ship(*TABLE.replace(line, other).splitlines()),
        "--out",
        tmp_path / "out",
    )
    assert answer.exit_code == 2
    assert said in answer.stderr


def test_advise_tells_what_to_run_next(demo):
    answer = shipgym(
        "advise", demo, "--coefficient", "N_vvv", "--number", "1", "--json"
    )
    assert answer.exit_code == 0
    told = json.loads(answer.stdout)
    (gains,) = told["gains"]
    assert told["run_next"] == [max(gains, key=gains.get)]
    errors = told["relative_errors"]
    shrunk = errors["now"]["N_vvv"] / errors["expected"]["N_vvv"]
    assert shrunk == pytest.approx(max(gains.values()))
    table = shipgym("advise", demo, "--coefficient", "N_vvv", "--number", "1").stdout
    assert f"run next: {told['run_next'][0]}" in table
    assert shipgym("advise", demo, "--coefficient", "N_vv").exit_code == 2


def test_reduce_writes_the_smaller_model_and_its_path(ship, tmp_path):
    path = ship('structure = "norrbin"')
    out = ("--out", tmp_path / "out")
    answer = shipgym("reduce", path, *out, "--tolerance", "0.5")
    assert answer.exit_code == 0, answer.stderr
    told = json.loads((tmp_path / "out" / "reduction.json").read_text())
    assert (
        f"{told['terms']['reduced']} of {told['terms']['full']} coefficients left"
        in answer.stdout
    )
    assert (
        len(load_model(tmp_path / "out" / "model.json").coefficients)
        == told["terms"]["reduced"]
    )
    assert (
        shipgym("reduce", path, "--out", tmp_path / "x", "--tolerance", "-1").exit_code
        == 2
    )


def test_the_tables_of_options_are_those_of_the_docstrings():
    page = document_options.PAGE.read_text(encoding="utf-8")
    assert document_options.page(page) == page, "run python scripts/document_options.py"


def test_every_option_and_method_is_documented():
    page = document_options.PAGE.read_text(encoding="utf-8")
    options = [*ARGUMENTS, *(one for own in stage_settings().values() for one in own)]
    assert [name for name in (*options, *METHODS) if f"{name}`" not in page] == []
