"""`shipgym identify`, `advise` and `reduce`, with every option from the ship file or the command line."""

import json
import re
from pathlib import Path
from types import SimpleNamespace

import document_options
import pytest
from typer.testing import CliRunner

from agents import identifying
from agents.cli import app
from agents.cli.identify_options import parsed_options
from agents.identifying import (
    compare_ship,
    identification_settings,
    identify_ship,
    reduce_ship,
)
from identification.estimators.methods import METHODS
from identification.validation import selection
from shipgym import InputError, ShipFile, list_structures, load_model
from shipgym.trials.identify_table import OPTIONS
from tests.golden.texts import same_text

#: Every option of [identify], set to something that is not its default, of a method
#: that has it.
SETTINGS = {
    "tls-svm": [
        "rank = 12",
        'selection = "gcv"',
        "explained_variance = 0.99",
        "C = 1e9",
    ],
    "ls-svm": ["C = inf", "scale = false", "robust = true"],
    "ridge": ["alpha = 1e-3"],
    "svr": ["C = 50.0", "epsilon = 0.01", "seed = 3"],
    "abc-lssvr": [
        'optimiser = { name = "de", rounds = 5 }',
        'objective = "training"',
        "bounds = [1.0, 1e6]",
        "seed = 3",
        'folds = "trials"',
    ],
    "tmils": [
        "forgetting = 0.99",
        "innovations = 3",
        "inverse_free = true",
        "start_samples = 50",
        "start_interval = 2",
        "start_C = 1e4",
        "omega = 0.1",
    ],
}
#: The table of terms that the documentation shows.
TABLE = re.search(
    r"```toml\n(\[structure\].*?)```",
    document_options.PAGE.with_name("structures.md").read_text(encoding="utf-8"),
    re.S,
)[1]
GENERAL = [
    'structure = "linear-steering"',
    'samples = "integral"',
    'name = "mine"',
    "window = 9",
    "smooth = false",
    'preprocessing = "savgol"',
    "repair = true",
    'uncertainty = "bootstrap"',
    "guarded = false",
    'hold_out = ["zigzag_10_10.csv"]',
    'prior = "clarke"',
    "prior_strength = 0.1",
    'prior_folds = "largest-rudder"',
    "current = { north = 0.1, east = -0.2 }",
    'wind = "none"',
]


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


@pytest.mark.parametrize("method", SETTINGS)
def test_settings_of_a_method_come_from_the_ship_file(ship, method):
    read, result = identified(
        ship('structure = "linear-steering"', f'method = "{method}"', *SETTINGS[method])
    )
    for name, value in read.identify.items():
        assert result.settings[name] == (None if value == float("inf") else value)


def test_options_of_identify_come_from_the_ship_file(ship, demo):
    hold = GENERAL[9].replace("zigzag", f"{demo.parent}/zigzag")
    read, result = identified(ship(*GENERAL[:9], hold, *GENERAL[10:]))
    for name, value in read.identify.items():
        assert result.settings[name] == value
    assert result.model.name == "mine"
    assert (
        result.metrics["trials"][f"{demo.parent}/zigzag_10_10.csv"]["use"] == "validate"
    )


def test_the_options_tested_and_the_rest_are_all_there_are():
    known = {
        line.split(" = ")[0]
        for lines in (GENERAL, *SETTINGS.values())
        for line in lines
    }
    of_grey_box = {"reference_model", "regression", "free_constant", "constant"}
    of_kernels = {"kernel", "centres", "kernel_length"}
    of_refinement = {
        "segment_lengths",
        "staggered",
        "segment_start",
        "pull",
        "rudder_offsets",
        "anchor",
        "anchor_weight",
    }
    extra = {
        "extra_trials",
        "extra_weight",
        "service_shaft_speed",
        "method",
        "model_error",
    }
    assert known | of_grey_box | of_kernels | of_refinement | extra == OPTIONS.keys()


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("rnak = 3", "unknown key 'rnak'. Did you mean 'rank'?"),
        ("rank = 3.5", "[identify] rank: 3.5 found, expected a whole number"),
        ("repair = 1", "[identify] repair: 1 found, expected true or false"),
        ('C = "1e6"', "[identify] C: '1e6' found, expected a number"),
        (
            "bounds = [1.0]",
            "[identify] bounds: [1.0] found, expected a list of two numbers",
        ),
        (
            'hold_out = "a.csv"',
            "[identify] hold_out: 'a.csv' found, expected a list of texts",
        ),
        ('hold_out = ["a.csv"]', "hold_out: expected"),
        ("optimiser = 3", "[identify] optimiser: 3 found, expected a text or a table"),
        (
            "epsilon = 0.1",
            "settings: epsilon found, which method 'tls-svm' does not know",
        ),
        ('extra_trials = ["turn.csv"]', "trial: expected"),
    ],
)
def test_a_wrong_option_exits_with_2_and_is_named(ship, line, said, tmp_path):
    answer = shipgym("identify", ship(line), "--out", tmp_path / "out")
    assert answer.exit_code == 2
    assert said in answer.stderr
    assert not (tmp_path / "out").exists()


def test_the_command_line_goes_before_the_ship_file(demo):
    ship = ShipFile.load(demo)
    given = {
        "method": "abc-lssvr",
        "C": None,
        **parsed_options(["seed=3", "bounds=[1, 1e6]", "objective=k-fold"]),
    }
    chosen = identification_settings(ship, given)
    assert chosen == {
        "structure": "abkowitz",
        "method": "abc-lssvr",
        "seed": 3,
        "bounds": [1, 1e6],
        "objective": "k-fold",
    }


def test_a_reference_model_is_found_from_the_ship_file_s_folder(ship):
    path = ship('structure = "grey-box"', 'reference_model = "own/ship.json"')
    chosen = identification_settings(ShipFile.load(path), {})
    assert Path(chosen["reference_model"]) == path.parent / "own" / "ship.json"
    assert "reference_model" not in identification_settings(
        ShipFile.load(path), {"structure": "abkowitz"}
    )


def test_only_names_of_files_are_found_from_the_ship_file_s_folder(ship):
    path = ship(
        'prior = "own/prior.json"',
        'anchor = "anchor.json"',
        'reference_model = "tanker"',
    )
    chosen = identification_settings(ShipFile.load(path), {})
    assert (chosen["prior"], chosen["anchor"]) == (
        str(path.parent / "own" / "prior.json"),
        str(path.parent / "anchor.json"),
    )
    assert (chosen["reference_model"], chosen["structure"]) == ("tanker", "auto")


@pytest.mark.parametrize(
    ("lines", "given", "structure", "reference"),
    [
        (['structure = "grey-box"'], {}, "grey-box", "auto"),
        (
            ['structure = "grey-box"', 'reference_model = "tanker"'],
            {},
            "grey-box",
            "tanker",
        ),
        (
            ['structure = "grey-box"', 'reference_model = "tanker"'],
            {"structure": "norrbin"},
            "norrbin",
            None,
        ),
        (
            ['structure = "norrbin"', 'reference_model = "tanker"'],
            {"structure": "nomoto", "reference_model": "mariner"},
            "nomoto",
            "mariner",
        ),
        (
            ['structure = "norrbin"', 'reference_model = "tanker"'],
            {"structure": None},
            "norrbin",
            "tanker",
        ),
        (['method = "rm-svm"', 'reference_model = "tanker"'], {}, "grey-box", "tanker"),
        (['method = "rm-svm"'], {}, "auto", None),
        (['method = "rm-svm"'], {"reference_model": "mariner"}, "grey-box", "mariner"),
        (
            [
                'method = "rm-svm"',
                'structure = "norrbin"',
                'reference_model = "tanker"',
            ],
            {},
            "norrbin",
            "tanker",
        ),
        (['method = "ls"', 'reference_model = "tanker"'], {}, "auto", "tanker"),
    ],
)
def test_a_reference_ship_belongs_to_the_structure_that_it_was_named_for(
    ship, lines, given, structure, reference
):
    chosen = identification_settings(ShipFile.load(ship(*lines)), given)
    assert (chosen["structure"], chosen.get("reference_model")) == (
        structure,
        reference,
    )


def own_ship(path):
    """A ship file of three trials and a structure of its own."""
    trials = {
        name: SimpleNamespace(name=name)
        for name in ("zigzag.csv", "circle.csv", "spiral.csv")
    }
    return SimpleNamespace(
        path=path,
        particulars={"length": 100.0},
        steering="gear",
        structure=SimpleNamespace(name="mine"),
        trials=lambda: list(trials.values()),
        trial=trials.__getitem__,
    )


def test_a_comparison_is_told_structures_and_methods_but_no_method_of_its_own(
    monkeypatch, tmp_path
):
    asked = []
    monkeypatch.setattr(
        identifying,
        "compare_methods",
        lambda *given, **named: asked.append((given, named)),
    )
    ship = own_ship(tmp_path / "ship.toml")
    settings = {
        "method": "ls",
        "structure": "nomoto",
        "C": 2.0,
        "extra_trials": ["circle.csv"],
    }
    for structures, methods in (
        (None, None),
        ("nomoto, mine", " ls ,svr"),
        ("mine", "all"),
    ):
        compare_ship(ship, settings, structures, methods)
    (usual, as_usual), (named, arguments), (every, _) = asked
    assert [trial.name for trial in usual[0]] == ["zigzag.csv", "spiral.csv"]
    assert [trial.name for trial in as_usual.pop("extra_trials")] == ["circle.csv"]
    assert (usual[1:], as_usual) == (
        (None, None),
        {
            "particulars": {"length": 100.0},
            "steering": "gear",
            "structure": "nomoto",
            "C": 2.0,
        },
    )
    assert named[1:] == (["ls", "svr"], ["nomoto", ship.structure])
    assert "structure" not in arguments
    assert every[1:] == (list(METHODS), [ship.structure])


@pytest.mark.parametrize("what", ["identify", "compare_methods", "identify_reduced"])
def test_what_is_wrong_with_trials_is_told_with_the_ship_file(
    monkeypatch, tmp_path, what
):
    def fails(trials, *given, particulars, steering, **settings):
        raise InputError(f"{len(trials)} trials, {given}, {settings}")

    monkeypatch.setattr(identifying, what, fails)
    ship, settings = own_ship(tmp_path / "ship.toml"), {"structure": "nomoto"}
    call, given = {
        "identify": (lambda: identify_ship(ship, settings), "()"),
        "compare_methods": (
            lambda: compare_ship(ship, settings, None, "ls"),
            "(['ls'], None)",
        ),
        "identify_reduced": (
            lambda: reduce_ship(ship, settings, "backward", 0.25),
            "('backward', 0.25)",
        ),
    }[what]
    with pytest.raises(InputError) as error:
        call()
    assert (
        str(error.value) == f"{ship.path}: 3 trials, {given}, {{'structure': 'nomoto'}}"
    )


def test_rm_svm_on_the_command_line_goes_before_the_structure_of_the_ship_file(demo):
    ship, given = ShipFile.load(demo), {"method": "rm-svm", "reference_model": "tanker"}
    assert (
        identification_settings(ship, {**given, "structure": None})["structure"]
        == "grey-box"
    )
    assert (
        identification_settings(ship, {**given, "structure": "norrbin"})["structure"]
        == "norrbin"
    )


@pytest.mark.parametrize("text", ["seed", "=3", "sede=3", "seed=three"])
def test_an_option_written_wrongly_is_named(text):
    with pytest.raises(InputError, match="--set"):
        parsed_options([text])


def test_options_of_the_command_line_reach_the_settings(ship, demo, tmp_path):
    held = f"{demo.parent}/zigzag_10_10.csv"
    answer = shipgym(
        "identify",
        ship(),
        "--out",
        tmp_path / "out",
        "--structure",
        "linear-steering",
        "--method",
        "ls-svm",
        "--C",
        "1e4",
        "--preprocessing",
        "savgol",
        "--repair",
        "--uncertainty",
        "bootstrap",
        "--prior",
        "kijima",
        "--prior-strength",
        "0.5",
        "--hold-out",
        held,
        "--set",
        "window=9",
    )
    assert answer.exit_code == 0, answer.stderr
    assert same_text("identify with options", answer.stdout + answer.stderr)
    found = settings_of(tmp_path / "out")
    told = {
        "method": "ls-svm",
        "C": 1e4,
        "preprocessing": "savgol",
        "repair": True,
        "window": 9,
    }
    told |= {"uncertainty": "bootstrap", "prior": "kijima", "prior_strength": 0.5}
    assert {name: found[name] for name in told} == told
    assert found["hold_out"] == [held]


def test_the_whole_chain_takes_the_same_options(demo, tmp_path):
    held = "zigzag_10_10.csv"
    answer = shipgym(
        "autopilot",
        demo,
        "--out",
        tmp_path / "out",
        "--draws",
        "3",
        "--structure",
        "abkowitz",
        "--method",
        "abc-lssvr",
        "--objective",
        "training",
        "--hold-out",
        held,
        "--set",
        "seed=3",
        "--set",
        "bounds=[1, 1e6]",
        "--json",
    )
    assert answer.exit_code == 0, answer.stderr
    assert json.loads(answer.stdout)["trials"][held]["use"] == "validate"
    told = load_model(tmp_path / "out" / "model.json").provenance
    assert (told["method"], told["settings"]["objective"]) == ("abc-lssvr", "training")
    assert max(found["C"] for found in told["search"].values()) <= 1e6
    refused = shipgym("autopilot", demo, "--out", tmp_path / "no", "--set", "sede=3")
    assert refused.exit_code == 2
    assert "Did you mean 'seed'" in refused.stderr
    assert not (tmp_path / "no").exists()


def test_extra_trials_are_seen_by_the_refinement_alone(ship, demo):
    turn = f"{demo.parent}/turning_circle_35.csv"
    _, result = identified(
        ship(
            'structure = "linear-steering"',
            'method = "output-error"',
            f'extra_trials = ["{turn}"]',
            "extra_weight = 0.5",
            "segment_lengths = 5.0",
            "staggered = false",
            'segment_start = "measured"',
            "pull = 1e-5",
            "rudder_offsets = true",
        )
    )
    refinement = result.model.provenance["refinement"]
    assert [trial["name"] for trial in refinement["extra_trials"]] == [turn]
    assert (refinement["segment_lengths"], refinement["staggered"]) == (5.0, False)
    assert turn not in result.metrics["trials"]


def test_compare_ranks_methods_and_writes_their_models(demo, tmp_path):
    answer = shipgym(
        "identify",
        demo,
        "--out",
        tmp_path / "out",
        "--compare",
        "--methods",
        "ls,tls-svm,rm-svm",
        "--json",
    )
    assert answer.exit_code == 0
    told = json.loads(answer.stdout)
    assert {row["method"] for row in told["ranking"]} == {"ls", "tls-svm"}
    assert "rm-svm was not fitted" in answer.stderr
    names = {
        "comparison.html",
        "comparison.json",
        "model-ls.json",
        "model-tls-svm.json",
    }
    assert {path.name for path in (tmp_path / "out").iterdir()} == names
    again = shipgym(
        "identify", demo, "--out", tmp_path / "again", "--methods", "ls,tls-svm,rm-svm"
    )
    rows = [line.split()[0] for line in again.stdout.splitlines() if " stable " in line]
    assert rows == [row["method"] for row in told["ranking"]]
    assert same_text("compare", again.stdout + again.stderr)
    for name in names:
        assert (tmp_path / "out" / name).read_bytes() == (
            tmp_path / "again" / name
        ).read_bytes()


def test_compare_ranks_structures_by_both_names(ship, tmp_path):
    given = (
        "--structures",
        "nomoto, mine",
        "--methods",
        "ls,tls-svm",
        "--out",
        tmp_path / "out",
    )
    answer = shipgym("identify", ship(*TABLE.splitlines()), *given)
    assert answer.exit_code == 0, answer.stderr
    rows = [
        tuple(line.split()[:2])
        for line in answer.stdout.splitlines()
        if "stable " in line
    ]
    assert set(rows) == {
        (method, name) for method in ("ls", "tls-svm") for name in ("nomoto", "mine")
    }
    written = {path.name for path in (tmp_path / "out").glob("model-*")}
    assert written == {"model-nomoto.json", "model-mine.json"}
    page = (tmp_path / "out" / "comparison.html").read_text()
    assert f"{rows[0][1]} by {rows[0][0]} predicts best" in page
    assert (
        shipgym(
            "identify", ship(), "--structures", "nomto", "--out", tmp_path / "no"
        ).exit_code
        == 2
    )


def test_without_a_structure_it_is_auto_but_for_what_needs_a_table(
    ship, monkeypatch, tmp_path
):
    read = ShipFile.load(ship())
    assert identification_settings(read, {})["structure"] == "auto"
    assert "structure" not in identification_settings(read, {"kernel": "rbf"})
    assert identification_settings(read, {}, "abkowitz")["structure"] == "abkowitz"
    monkeypatch.setattr(selection, "STRUCTURES", ("nomoto", "linear-steering", "mmg"))
    monkeypatch.setattr(selection, "OTHERS", ())
    answer = shipgym("identify", ship(), "--out", tmp_path / "out")
    assert answer.exit_code == 0, answer.stderr
    assert (
        "Structures and methods by how they predict each trial in turn" in answer.stdout
    )
    assert "mmg by map was not fitted: trial" in answer.stdout
    assert same_text("identify auto", answer.stdout + answer.stderr)
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
        ('name = "mine"', "", "got no name"),
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


def test_compare_names_a_method_that_does_not_exist(demo, tmp_path):
    answer = shipgym("identify", demo, "--out", tmp_path / "out", "--methods", "ls,lsq")
    assert answer.exit_code == 2
    assert "method: expected" in answer.stderr
    assert "all" not in METHODS


def test_advise_tells_information_and_what_to_run_next(demo):
    answer = shipgym(
        "advise", demo, "--coefficient", "N_vvv", "--number", "1", "--json"
    )
    assert answer.exit_code == 0
    told = json.loads(answer.stdout)
    assert list(told["trials"]) == [
        "zigzag_10_10.csv",
        "zigzag_20_20.csv",
        "zigzag_20_10_port.csv",
        "zigzag_35_30_port.csv",
    ]
    (gains,) = told["gains"]
    assert told["run_next"] == [max(gains, key=gains.get)]
    errors = told["relative_errors"]
    shrunk = errors["now"]["N_vvv"] / errors["expected"]["N_vvv"]
    assert shrunk == pytest.approx(max(gains.values()))
    information = {
        name: trial["information"]["N_vvv"] for name, trial in told["trials"].items()
    }
    assert information["zigzag_35_30_port.csv"] > information["zigzag_10_10.csv"] > 0.0
    table = shipgym("advise", demo, "--coefficient", "N_vvv", "--number", "1").stdout
    assert f"run next: {told['run_next'][0]}" in table
    assert same_text("advise", table)
    assert shipgym("advise", demo, "--coefficient", "N_vv").exit_code == 2
    for wrong in (
        ("--criterion", "D", "--coefficient", "N_vvv"),
        ("--criterion", "A"),
    ):  # before any work
        refused = shipgym("advise", demo.with_name("absent.toml"), *wrong)
        assert (refused.exit_code, refused.stderr.count("\n")) == (2, 1)
        assert f"'{wrong[1]}'" in refused.stderr


def test_reduce_writes_the_smaller_model_and_its_path(ship, tmp_path):
    path = ship('structure = "norrbin"')
    answer = shipgym("reduce", path, "--out", tmp_path / "out", "--tolerance", "0.5")
    assert answer.exit_code == 0, answer.stderr
    told = json.loads((tmp_path / "out" / "reduction.json").read_text())
    assert (
        f"{told['terms']['reduced']} of {told['terms']['full']} coefficients left"
        in answer.stdout
    )
    assert same_text("reduce", answer.stdout + answer.stderr)
    assert (
        len(load_model(tmp_path / "out" / "model.json").coefficients)
        == told["terms"]["reduced"]
    )
    assert (tmp_path / "out" / "report.html").exists()
    assert (
        shipgym(
            "reduce", path, "--out", tmp_path / "x", "--direction", "sideways"
        ).exit_code
        == 2
    )


def test_the_tables_of_options_are_those_of_the_dataclass():
    page = document_options.PAGE.read_text(encoding="utf-8")
    assert document_options.page(page) == page, "run python scripts/document_options.py"


def test_every_option_and_method_is_documented():
    page = (Path(__file__).parents[2] / "docs" / "identification.md").read_text(
        encoding="utf-8"
    )
    assert [name for name in (*OPTIONS, *METHODS) if f"`{name}`" not in page] == []


def test_a_current_that_is_known_is_given_as_its_help_shows(demo, tmp_path):
    where, known = tmp_path / "identified", "{ north = 0.2, east = -0.1 }"
    result = shipgym(
        "identify", demo, "--structure", "nomoto", "--out", where, "--current", known
    )
    assert result.exit_code == 0, result.output
    settings = json.loads((where / "settings.json").read_text())
    assert settings["current"] == {"north": 0.2, "east": -0.1}
    result = shipgym(
        "identify",
        demo,
        "--out",
        tmp_path / "not",
        "--current",
        "{ nort = 0.2, east = 1 }",
    )
    assert result.exit_code == 2
    assert "current: unknown key 'nort'" in result.output
    assert not (tmp_path / "not").exists()
