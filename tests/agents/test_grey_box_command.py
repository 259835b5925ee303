"""A grey box from the command line: what the table [identify] of a ship file says of
it."""

import pytest
from typer.testing import CliRunner

import shipgym
from agents.cli import app

OWN = 'structure = "abkowitz"\nmethod = "tls-svm"'
QUICK = "C = 1.0\nepsilon = 0.1"  # chosen neither by folds nor by a search


@pytest.fixture
def ship_file(demo, tmp_path):
    """The demo's ship file with another table [identify]."""

    def write(identify):
        text = demo.read_text()
        assert OWN in text
        path = tmp_path / "ship.toml"
        path.write_text(
            text.replace(OWN, identify).replace('file = "', f'file = "{demo.parent}/')
        )
        return path

    return write


def identified(ship, *options):
    arguments = ["identify", str(ship), "--out", str(ship.parent / "out"), *options]
    return CliRunner().invoke(app, arguments)


def test_a_method_and_a_reference_ship_are_enough(ship_file):
    ship = ship_file(
        f'method = "rm-svm"\nreference_model = "container-own.json"\n{QUICK}'
    )
    shipgym.load_model("tanker").save(ship.parent / "container-own.json")
    answer = identified(ship, "--report")
    assert answer.exit_code == 0, answer.stderr
    assert "grey-box by rm-svm" in answer.stdout
    model = shipgym.load_model(ship.parent / "out" / "model.json")
    assert model.structure == "grey-box"
    assert model.provenance["reference"]["name"] == "tanker"
    assert (ship.parent / "out" / "report.html").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("identify", "options", "said"),
    [
        (
            'structure = "abkowitz"\nmethod = "rm-svm"',
            [],
            "expected structure 'grey-box', which has a reference ship, got",
        ),
        (
            OWN,
            ["--method", "rm-svm"],
            "a reference_model ('auto', a shipped model's name or a model file)",
        ),
        (
            OWN,
            [
                "--method",
                "rm-svm",
                "--set",
                "reference_model=tanker",
                "--structure",
                "abkowitz",
            ],
            "choose structure 'grey-box'",
        ),
        ('method = "rm-svm"\nreference_model = "tankr"', [], "Did you mean 'tanker'"),
        (
            'method = "rm-svm"\nreference_model = "auto"\nfolds = "luck"',
            [],
            "'largest-rudder'",
        ),
        ('structure = "gray-box"', [], "Did you mean 'grey-box'"),
    ],
)
def test_what_does_not_fit_is_one_message_and_nothing_written(
    ship_file, identify, options, said
):
    ship = ship_file(identify)
    answer = identified(ship, *options)
    assert answer.exit_code == 2
    assert answer.stderr.startswith("error: ")
    assert answer.stderr.count("\n") == 1
    assert said in answer.stderr
    assert answer.stdout == ""
    assert not (ship.parent / "out").exists()
