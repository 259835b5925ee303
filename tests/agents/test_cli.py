"""The command line: what it prints, writes and refuses, and its exit codes."""

import errno
import json
import re
import resource
import shlex
import shutil
import subprocess
import sys
from inspect import signature
from pathlib import Path
from types import SimpleNamespace

import pytest
import typer
from typer.testing import CliRunner

import agents
import identification
from agents import PID
from agents.cli import app, shared_options
from agents.cli.autopilot import autopilot_command
from agents.cli.trials import trials_command
from agents.jobs import JobError
from agents.verification.chain import build_autopilot
from shipgym import (
    InputError,
    ManoeuvreError,
    UnstableModelError,
    example_ship,
    load_model,
)

ROOT = Path(__file__).parents[2]


def shipgym(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def broken(demo, tmp_path):
    """Writes the demo's ship file with one thing replaced."""

    def write(old, new, file="ship.toml"):
        for path in demo.parent.iterdir():
            text = path.read_text()
            if path.name == file:
                assert old in text
                text = text.replace(old, new, 1)
            (tmp_path / path.name).write_text(text)
        return tmp_path / "ship.toml"

    return write


def test_version():
    answer = shipgym("--version")
    assert answer.exit_code == 0
    assert answer.stdout == "shipgym 0.1.0\n"


def test_help_is_fast():
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    answer = subprocess.run(
        [sys.executable, "-m", "agents.cli", "--help"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert sum(after[:2]) - sum(before[:2]) < 0.6  # s of processor time
    for command in ("identify", "trials", "autopilot", "doctor"):
        assert command in answer.stdout


def commands():
    """Each command by its name, with the parameters that it has when it is called."""
    group = typer.main.get_command(app)
    context = typer.Context(group, info_name="shipgym")
    return {
        name: (
            command.make_context(
                name, [], resilient_parsing=True, parent=context
            ).command
        )
        for name, command in group.commands.items()
    }


@pytest.mark.parametrize("name", commands())
def test_every_command_has_json_and_quiet_and_an_example_that_it_takes(name):
    command = commands()[name]
    assert {"--json", "--quiet"} <= {
        flag for one in command.params for flag in one.opts
    }
    begin, *example = shlex.split(command.epilog.removeprefix("Example: shipgym "))
    assert begin == name
    assert not command.make_context(name, example).args
    assert command.epilog in " ".join(shipgym(name, "--help").stdout.split())


@pytest.mark.parametrize(
    "command", [["sail"], ["identify"], ["doctor", "--loud"], ["autopilot", "x.toml"]]
)
def test_wrong_usage_exits_with_2_and_says_why(command):
    answer = shipgym(*command)
    assert answer.exit_code == 2
    assert answer.stdout == ""
    assert "Error:" in answer.stderr


@pytest.mark.parametrize(
    ("words", "near"),
    [
        (["identfy"], "Did you mean 'identify'?"),
        (["steer", "lq.json"], "No such command 'steer'"),
        (["export", "x", "--fmi", "2.0"], "No such option: --fmi"),
        (["export", "x", "--fmi", "2.0"], "--fmu"),
    ],
)
def test_what_does_not_exist_is_refused_with_the_nearest_that_does(words, near):
    answer = shipgym(*words)
    assert answer.exit_code == 2
    assert near in " ".join(answer.stderr.split())


def test_identify_writes_model_and_metrics(demo, tmp_path):
    answer = shipgym("identify", demo, "--out", tmp_path / "ship")
    assert answer.exit_code == 0
    assert "N_vvr" in answer.stdout
    assert "zigzag_15_15.csv" in answer.stdout
    assert "estimated, not given in the ship file: N_rdot" in answer.stderr
    names = ["metrics.json", "model.json", "settings.json"]
    assert sorted(path.name for path in (tmp_path / "ship").iterdir()) == names
    assert load_model(tmp_path / "ship" / "model.json").coefficients["N_d"] > 0.0
    metrics = json.loads((tmp_path / "ship" / "metrics.json").read_text())
    assert metrics["trials"]["zigzag_15_15.csv"]["use"] == "validate"


def test_an_unstable_model_exits_with_1_and_prints_no_coefficients(
    unstable_ship, tmp_path
):
    answer = shipgym("identify", unstable_ship, "--out", tmp_path / "ship")
    assert answer.exit_code == 1
    assert "the identified model is unstable" in answer.stderr
    assert "N_vvr" not in answer.stdout


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("beam =", "beem =", "Did you mean 'beam'"),
        ("length = 160.93", "length = -160.93", "length"),
        ('unit = "knots"', 'unit = "furlongs"', "furlongs"),
        ('"starboard"', '"left"', "left"),
        ("[ship]", "[ship", "TOML"),
        ('file = "zigzag_10_10.csv"', 'file = "zigzag.csv"', "zigzag.csv"),
        ('method = "tls-svm"', 'method = "svm"', "tls-svm"),
        ('structure = "abkowitz"', 'structure = "abkovitz"', "abkowitz"),
    ],
)
@pytest.mark.parametrize("command", ["identify", "autopilot"])
def test_a_wrong_ship_file_exits_with_2_one_message_and_nothing_written(
    broken, command, old, new, said
):
    ship = broken(old, new)
    answer = shipgym(command, ship, "--out", ship.parent / "out")
    assert answer.exit_code == 2
    assert answer.stderr.startswith("error: ")
    assert answer.stderr.count("\n") == 1
    assert said in answer.stderr
    assert answer.stdout == ""
    assert not (ship.parent / "out").exists()


def test_a_folder_with_other_files_is_refused_before_any_work(demo, tmp_path):
    (tmp_path / "thesis.tex").write_text("")
    answer = shipgym("autopilot", demo, "--out", tmp_path)
    assert answer.exit_code == 2
    assert "holds 'thesis.tex'" in answer.stderr


def test_an_interruption_leaves_nothing_and_exits_with_130(demo, tmp_path, monkeypatch):
    def interrupted(*_args, **_settings):
        raise KeyboardInterrupt

    monkeypatch.setattr("agents.verification.page.write_report", interrupted)
    monkeypatch.setattr(
        "agents.verification.chain.why_unstable", lambda _: "for the test"
    )
    answer = shipgym("autopilot", demo, "--out", tmp_path / "report")
    assert answer.exit_code == 130
    assert "interrupted, nothing was written" in answer.stderr
    assert list(tmp_path.iterdir()) == []


def test_an_interruption_after_the_identification_leaves_the_model(
    demo, tmp_path, monkeypatch
):
    def interrupted(*_args, **_settings):
        raise KeyboardInterrupt

    monkeypatch.setattr("agents.verification.chain.verify", interrupted)
    words = ["autopilot", str(demo), "--out", str(tmp_path / "a report")]
    answer = shipgym(*words)
    assert answer.exit_code == 130
    assert f"kept in {tmp_path}/a report" in answer.stderr
    assert shlex.split(answer.stderr)[-5:] == ["shipgym", *words]
    assert load_model(tmp_path / "a report" / "model.json").covariance is not None


def test_trials_tells_indices_and_criteria():
    answer = shipgym("trials", "mariner", "--json")
    told = json.loads(answer.stdout)
    zigzag = told["manoeuvres"]["zigzag 20/20, starboard first"]["overshoot_1_deg"]
    assert zigzag["value"] == pytest.approx(7.78, abs=0.02)
    assert zigzag["interval_95"] is None
    assert told["imo"]["stopping"]["passed"] is None
    assert told["imo"]["tactical_diameter"]["passed"] is False
    assert told["imo"]["advance"]["value"] < 4.5


def test_trials_and_autopilot_judge_by_the_same_draws():
    drawn = [
        {name: signature(one).parameters[name].default for name in ("draws", "seed")}
        for one in (trials_command, autopilot_command, build_autopilot)
    ]
    assert drawn == [{"draws": 200, "seed": 0}] * 3


def test_trials_writes_figures_that_work_offline(tmp_path):
    answer = shipgym("trials", "mariner", "--out", tmp_path / "plots.html")
    assert answer.exit_code == 0
    page = (tmp_path / "plots.html").read_text()
    names = re.findall(r'Plotly.newPlot\("plot-([\w-]+)"', page)
    assert len(set(names)) == len(names) == 8
    assert {"zigzags-paths", "circles-1"} <= set(names)
    for caption in (
        "Zigzag 20/20, starboard first. ",
        "Paths from above, north up, in metres.",
    ):
        assert caption in page
    assert 'src="http' not in page


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["marinr"], "Did you mean 'mariner'"),
        (["no_such.json"], "no_such.json"),
        (["half.json"], "cut short"),
        (["mariner", "--out", "plots.png"], ".html"),
    ],
)
def test_what_trials_cannot_use_exits_with_2(words, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    load_model("mariner").save("model.json")
    text = Path("model.json").read_text()
    Path("half.json").write_text(text[: len(text) // 2])
    answer = shipgym("trials", *words)
    assert answer.exit_code == 2
    assert message in answer.stderr


@pytest.mark.parametrize(
    ("words", "found", "command"),
    [
        ("identify zigzag_15_15.csv --out out", "log", "new-ship"),
        ("autopilot model.json --out out", "model file", "trials"),
        ("trials ship.toml", "ship file", "look, identify"),
        ("trials pid.json", "controller file", "export"),
        ("export zigzag_15_15.csv --c c", "log", "new-ship"),
        ("replay pid.json --out out.html", "controller file", "export"),
        ("look model.json --out out.html", "model file", "trials"),
        ("benchmark --controllers model.json --out out", "model file", "trials"),
        ("trials .", "folder", None),
    ],
)
def test_a_file_of_another_kind_is_named_with_the_command_for_it(
    words, found, command, demo, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(example_ship().parent, tmp_path, dirs_exist_ok=True)
    ship = load_model("mariner")
    ship.save("model.json")
    PID.from_model(ship).save("pid.json")
    answer = shipgym(*words.split())
    assert answer.exit_code == 2
    given = f", got a {found}; give " + ("it to shipgym " if command else "model.json")
    assert given + (command or "") in answer.stderr
    assert answer.stderr.count("error: ") == 1


def test_an_unknown_name_is_refused_with_the_nearest_and_that_of_papers():
    for package, name, near in (
        (identification, "TLS_SVM", "TruncatedLSSVM"),
        (identification, "ABC_LSSVR", "TunedLSSVM"),
        (agents, "LQR", "LQ"),
    ):
        with pytest.raises(AttributeError, match=f"Did you mean '{near}'"):
            getattr(package, name)
    with pytest.raises(AttributeError, match=r"It is identification\.TruncatedLSSVM"):
        _ = sys.modules["shipgym"].TLSSVM


def failing_command(error):
    """A command line whose one command raises an error."""
    app = typer.Typer()

    @app.callback()
    def group():
        """More than one command."""

    def command():
        raise error

    app.command("run")(shared_options(command))
    return CliRunner().invoke(app, ["run"])


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (InputError("length: -1 found"), 2, "length: -1 found"),
        (ManoeuvreError("never turned", None), 1, "never turned"),
        (UnstableModelError("lost", 1.0, {}), 1, "lost"),
        (JobError("a worker was killed"), 1, "a worker was killed"),
        (KeyboardInterrupt(), 130, "interrupted, nothing was written"),
        (OSError(errno.ENOENT, "No such file", "a.toml"), 2, "a.toml: No such file"),
    ],
)
def test_an_expected_error_is_one_message_and_an_exit_code(error, code, message):
    answer = failing_command(error)
    assert (answer.exit_code, answer.stderr) == (code, f"error: {message}\n")


def test_an_unexpected_error_keeps_its_traceback():
    assert isinstance(failing_command(ZeroDivisionError()).exception, ZeroDivisionError)


@pytest.fixture
def built(monkeypatch):
    """Arguments of `build_autopilot`, and the result that it returns."""
    result = SimpleNamespace(
        metrics={},
        verification=None,
        stable=True,
        instability=None,
        refusal=None,
        identification=SimpleNamespace(
            metrics={
                "selection": {
                    "ranking": [
                        {"structure": name, "coefficients": number, "stable": True}
                        for name, number in (("abkowitz", 40), ("norrbin-bias", 4))
                    ]
                }
            }
        ),
        calls=[],
    )

    def build(*places, **options):
        result.calls.append((places, options))
        return result

    monkeypatch.setattr("agents.verification.chain.build_autopilot", build)
    monkeypatch.setattr(
        "identification.judging.warnings.model_warnings", lambda _: ["odd sway"]
    )
    return result


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        (
            {"stable": False, "instability": "it runs away"},
            "error: the identified model is unstable: it runs away; see",
        ),
        (
            {"refusal": "every design loses control"},
            "error: no autopilot is given: every design loses control, or give"
            " --structure norrbin-bias; see",
        ),
        ({}, "warning: odd sway"),
    ],
)
def test_an_autopilot_that_cannot_be_trusted_fails_with_the_reason(
    fields, message, built, demo, tmp_path
):
    vars(built).update(fields)
    answer = shipgym("autopilot", demo, "--out", tmp_path)
    assert answer.exit_code == (1 if fields else 0)
    assert answer.stderr.startswith(message)
