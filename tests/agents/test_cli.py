import errno
import importlib.metadata
import json
import os
import re
import resource
import shlex
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
import typer
from typer.testing import CliRunner

from agents.cli import app, doctor, training
from agents.cli.command import LONGEST_NAME, told_failure
from agents.cli.warm import _jobs, _names
from agents.training.plan import Given
from agents.training.run_folder import CHECKPOINT
from shipgym import InputError, load_model
from tests.golden.texts import same_page, same_text

ROOT = Path(__file__).parents[2]


def shipgym(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_what_is_for_verification_alone_is_refused_without_it(tmp_path):
    for option in (("--allow-code", "mine:make"), ("--tolerance", "0.1")):
        answer = shipgym("benchmark", "--out", tmp_path / "out", *option)
        assert answer.exit_code == 2
        assert "--allow-code and --tolerance are for --verify alone, leave them out" in answer.output
    assert not (tmp_path / "out").exists()


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
        [sys.executable, "-m", "agents.cli", "--help"], cwd=ROOT, capture_output=True, text=True, check=True
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
        name: command.make_context(name, [], resilient_parsing=True, parent=context).command
        for name, command in group.commands.items()
    }


@pytest.mark.parametrize("name", commands())
def test_every_command_has_json_and_quiet_and_an_example_that_it_takes(name):
    command = commands()[name]
    assert {"--json", "--quiet"} <= {flag for one in command.params for flag in one.opts}
    begin, *example = shlex.split(command.epilog.removeprefix("Example: shipgym "))
    assert begin == name
    assert not command.make_context(name, example).args
    assert command.epilog in " ".join(shipgym(name, "--help").stdout.split())


ABOUT = ("metavar", "default", "min", "max", "required", "nargs", "multiple", "hidden", "help")


def test_commands_take_the_golden_options():
    """Their names, defaults, bounds and help."""
    told = []
    for name, command in commands().items():
        told.append(f"{name}: {command.help}\n{command.epilog}")
        for one in command.params:
            about = {name: getattr(one, name, None) for name in ABOUT}
            told.append(" ".join([*one.opts, *one.secondary_opts, *map(str, about.values())]))
    assert same_text("commands", "\n".join(told))


@pytest.mark.parametrize(
    "words",
    [
        ["look", "SHIP", "--out", "OUT/look.html"],
        ["new-ship", "SHIP/../zigzag_10_10.csv", "--out", "OUT/new.toml"],
        ["trials", "mariner", "--draws", "0"],
        ["export", "mariner", "--c", "OUT/mariner"],
        ["simulate", "mariner", "--nmea", "udp:127.0.0.1:9", "--duration", "0.1"],
    ],
)
def test_json_is_all_that_is_printed_and_with_quiet_nothing(words, demo, tmp_path):
    for flags in (["--json", "--quiet"], ["--quiet"]):
        out = tmp_path / str(len(flags))
        out.mkdir()
        places = {"SHIP/..": demo.parent, "SHIP": demo, "OUT": out}
        given = words
        for place, path in places.items():
            given = [word.replace(place, str(path)) for word in given]
        answer = shipgym(*given, *flags)
        assert (answer.exit_code, answer.stderr) == (0, "")
        assert json.loads(answer.stdout) if "--json" in flags else answer.stdout == ""


@pytest.mark.parametrize(
    ("typed", "completed"), [("shipgym auto", "autopilot"), ("shipgym identify --struct", "--structure")]
)
def test_a_shell_completes_commands_and_the_options_of_identify(typed, completed):
    words = {"COMP_WORDS": typed, "COMP_CWORD": str(typed.count(" ")), "_SHIPGYM_COMPLETE": "complete_bash"}
    answer = subprocess.run(
        [sys.executable, "-c", "from agents.cli import main; main()"],
        cwd=ROOT, env=os.environ | words, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert completed in answer.stdout.split(), answer.stderr


def test_help_imports_nothing_heavy():
    code = (
        "import sys, agents.cli; sys.exit(any(m in sys.modules for m in ('numpy', 'scipy', 'numba', 'rich')))"
    )
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode == 0


@pytest.mark.parametrize("command", [["sail"], ["identify"], ["doctor", "--loud"], ["autopilot", "x.toml"]])
def test_wrong_usage_exits_with_2_and_says_why(command):
    answer = shipgym(*command)
    assert answer.exit_code == 2
    assert answer.stdout == ""
    assert "Error:" in answer.stderr


def test_identify_writes_model_and_metrics(demo, tmp_path):
    answer = shipgym("identify", demo, "--out", tmp_path / "ship")
    assert answer.exit_code == 0
    assert "N_vvr" in answer.stdout
    assert "zigzag_15_15.csv" in answer.stdout
    assert "estimated, not given in the ship file: N_rdot" in answer.stderr
    assert same_text("identify", answer.stdout + answer.stderr)
    names = ["metrics.json", "model.json", "report.html", "settings.json"]
    assert sorted(path.name for path in (tmp_path / "ship").iterdir()) == names
    assert load_model(tmp_path / "ship" / "model.json").coefficients["N_d"] > 0.0
    metrics = json.loads((tmp_path / "ship" / "metrics.json").read_text())
    assert metrics["trials"]["zigzag_15_15.csv"]["use"] == "validate"


def test_identify_prints_nothing_but_json_when_asked(demo, tmp_path):
    answer = shipgym("identify", demo, "--out", tmp_path / "ship", "--samples", "integral", "--json")
    assert json.loads(answer.stdout)["stable"] is True


def test_an_unstable_model_exits_with_1_and_prints_no_coefficients(unstable_ship, tmp_path):
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
def test_a_wrong_ship_file_exits_with_2_one_message_and_nothing_written(broken, command, old, new, said):
    ship = broken(old, new)
    answer = shipgym(command, ship, "--out", ship.parent / "out")
    assert answer.exit_code == 2
    assert answer.stderr.startswith("error: ")
    assert answer.stderr.count("\n") == 1
    assert said in answer.stderr
    assert answer.stdout == ""
    assert not (ship.parent / "out").exists()


def test_a_wrong_sample_is_told_with_file_line_and_column(broken):
    ship = broken("\n20.0,", "\n20.0,north", "zigzag_20_20.csv")
    answer = shipgym("identify", ship, "--out", ship.parent / "out")
    assert answer.exit_code == 2
    assert "zigzag_20_20.csv" in answer.stderr
    assert "gnss_north_m" in answer.stderr


def test_a_folder_with_other_files_is_refused_before_any_work(demo, tmp_path):
    (tmp_path / "thesis.tex").write_text("")
    answer = shipgym("autopilot", demo, "--out", tmp_path)
    assert answer.exit_code == 2
    assert "holds 'thesis.tex'" in answer.stderr


def test_an_interruption_leaves_nothing_and_exits_with_130(demo, tmp_path, monkeypatch):
    def interrupted(*_args, **_settings):
        raise KeyboardInterrupt

    monkeypatch.setattr("agents.verification.page.write_report", interrupted)
    monkeypatch.setattr("agents.verification.chain.why_unstable", lambda _: "for the test")
    answer = shipgym("autopilot", demo, "--out", tmp_path / "report")
    assert answer.exit_code == 130
    assert "interrupted, nothing was written" in answer.stderr
    assert list(tmp_path.iterdir()) == []


def test_trials_tells_indices_and_criteria():
    answer = shipgym("trials", "mariner", "--json")
    told = json.loads(answer.stdout)
    zigzag = told["manoeuvres"]["zigzag 20/20, starboard first"]["overshoot_1_deg"]
    assert zigzag["value"] == pytest.approx(7.78, abs=0.02)
    assert zigzag["interval_95"] is None
    assert told["imo"]["stopping"]["passed"] is None
    assert told["imo"]["tactical_diameter"]["passed"] is False
    assert told["imo"]["advance"]["value"] < 4.5


def test_trials_writes_figures_that_work_offline(tmp_path):
    answer = shipgym("trials", "mariner", "--out", tmp_path / "plots.html")
    assert answer.exit_code == 0
    page = (tmp_path / "plots.html").read_text()
    drawn = {"zigzags-0", "zigzags-1", "zigzags-2", "zigzags-3", "zigzags-paths", "zigzags-histories"}
    drawn |= {"circles-0", "circles-1", "circles-paths", "circles-histories", "spirals-0"}
    drawn |= {"spirals-histories", "pull-outs", "pull-outs-histories"}
    names = re.findall(r'Plotly.newPlot\("plot-([\w-]+)"', page)
    assert (set(names), len(names)) == (drawn, 14)
    for caption in (
        "Zigzag 20/20, starboard first. ", "Paths from above, north up, in metres.", "Sides that end apart",
        "Time histories: heading, rudder, yaw rate, speed and drift angle.",
    ):  # fmt: skip
        assert caption in page
    assert 'src="http' not in page
    assert same_page("trials page", page)
    assert same_text("trials", answer.stdout + answer.stderr)


@pytest.mark.parametrize("model", ["marinr", "no_such.json"])
def test_an_unknown_model_exits_with_2(model):
    answer = shipgym("trials", model)
    assert answer.exit_code == 2
    assert model in answer.stderr


def test_a_model_file_cut_in_half_exits_with_2(tmp_path):
    load_model("mariner").save(tmp_path / "model.json")
    text = (tmp_path / "model.json").read_text()
    (tmp_path / "model.json").write_text(text[: len(text) // 2])
    answer = shipgym("trials", tmp_path / "model.json")
    assert answer.exit_code == 2
    assert "cut short" in answer.stderr


def test_figures_go_to_html_files_only(tmp_path):
    answer = shipgym("trials", "mariner", "--out", tmp_path / "plots.png")
    assert answer.exit_code == 2
    assert ".html" in answer.stderr


def test_doctor_finds_this_installation_fit():
    answer = shipgym("doctor", "--json")
    states = {finding["what"]: finding["state"] for finding in json.loads(answer.stdout)["findings"]}
    assert states["numba"] == states["cache"] == states["import agents"] == "fine"
    assert states["extra report"] == "fine"


def test_doctor_tells_of_a_cache_that_cannot_be_written(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("SHIPGYM_CACHE", str(tmp_path / "file" / "cache"))
    answer = shipgym("doctor")
    assert answer.exit_code == 1
    assert "compiles its ships again" in answer.stdout


def test_doctor_tells_place_and_size_of_the_cache(tmp_path, monkeypatch):
    (tmp_path / "it.loop").write_bytes(bytes(200_000))
    monkeypatch.setenv("SHIPGYM_CACHE", str(tmp_path))
    assert f"{tmp_path}, 1 files, 0.2 MB" in shipgym("doctor").stdout.replace("\n", "")


def test_doctor_tells_of_a_cache_that_is_damaged_or_open_to_others(tmp_path, monkeypatch):
    (tmp_path / "it.loop").write_bytes(bytes(200))
    monkeypatch.setenv("SHIPGYM_CACHE", str(tmp_path))
    answer = shipgym("doctor", "--json")
    (cache,) = (one for one in json.loads(answer.stdout)["findings"] if one["what"] == "cache")
    assert (answer.exit_code, cache["state"]) == (1, "wrong")
    assert "1 of them not usable: it.loop is damaged" in cache["detail"]
    if os.name != "nt":
        tmp_path.chmod(0o777)
        answer = shipgym("doctor", "--json")
        assert answer.exit_code == 1
        assert f"{tmp_path} may be written by other users; chmod go-w {tmp_path}, or set" in answer.stdout


def test_warm_compiles_into_the_cache_and_writes_nothing_else(tmp_path):
    cache, here = tmp_path / "cache", tmp_path / "here"
    here.mkdir()
    command = [sys.executable, "-m", "agents.cli", "warm", "shipgym/CourseKeeping-v0", "--json"]
    environment = {**os.environ, "SHIPGYM_CACHE": str(cache), "PYTHONPATH": str(ROOT)}
    answer = subprocess.run(command, cwd=here, env=environment, capture_output=True, text=True, check=True)
    told = json.loads(answer.stdout)
    assert told["cache"] == str(cache)
    assert [one["refused"] for one in told["ready"]] == ["", ""]
    assert len(list(cache.glob("*.loop"))) == 2
    assert not list(here.iterdir())


def test_warm_takes_what_is_named_or_all_there_is():
    everything = _names(None, True)
    assert {"shipgym/CourseKeeping-v0", "shipgym/PathFollowingRoll-v1", "mariner", "kvlcc2-mmg"} <= set(
        everything
    )
    assert _names(["tanker"], True) == everything
    assert _names(["tanker"], False) == ["tanker"]
    assert _names(None, False) == [
        "shipgym/CourseKeeping-v0", "shipgym/PathFollowing-v0", "shipgym/PathFollowing-v1", "mariner"
    ]  # fmt: skip
    assert [what for what, _ in _jobs("shipgym/CourseKeeping-v0")] == [
        "shipgym/CourseKeeping-v0 in calm water", "shipgym/CourseKeeping-v0 in a sea"
    ]  # fmt: skip
    assert {what for what, _ in _jobs("tanker")} >= {"tanker: zigzag", "tanker: open_loop"}
    with pytest.raises(InputError, match="'titanic' found, expected an environment's id or a model: "):
        list(_jobs("titanic"))


def test_warm_says_what_cannot_be_and_goes_on_only_where_all_was_asked_for(monkeypatch):
    def refuses():
        raise InputError("no beam")

    jobs = {"one": [("first", refuses)], "other": [("second", int)]}
    monkeypatch.setattr("agents.cli.warm._names", lambda wanted, everything: list(jobs))
    monkeypatch.setattr("agents.cli.warm._jobs", lambda name: iter(jobs[name]))
    answer = shipgym("warm", "--all", "--json")
    assert answer.exit_code == 0
    ready = json.loads(answer.stdout)["ready"]
    assert [(one["what"], one["refused"]) for one in ready] == [("first", "no beam"), ("second", "")]
    answer = shipgym("warm", "one", "other")
    assert (answer.exit_code, answer.stderr) == (2, "error: no beam\n")
    assert "2/2  second: 0.0 s" in shipgym("warm", "--all").stdout


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (OSError(errno.ENOENT, "No such file", "a.toml"), 2, "a.toml: No such file"),
        (OSError(errno.ENOENT, "No such file", "a" * 5000), 2, "a" * LONGEST_NAME + ": No such file"),
        (OSError(errno.EIO, "Input/output error"), 2, "Input/output error"),
        (OSError("odd"), 2, "odd"),
        (OSError(errno.ENOSPC, "No space left"), 1, "the output cannot be written (No space left)"),
        (OSError(errno.EPIPE, "Broken pipe"), 1, ""),
    ],
)
def test_what_cannot_be_read_or_written_is_one_line(error, code, said, monkeypatch, capsys):
    closed = []
    monkeypatch.setattr(os, "dup2", lambda *ends: closed.append(ends[1]))
    assert told_failure(error) == code
    assert closed == ([1] if code == 1 else [])
    told = capsys.readouterr().err.replace("\n", "")
    assert told == (f"error: {said}" if said else "")


def test_doctor_has_a_mark_for_each_state():
    told = [doctor.Finding(f"what is {state}", state, "and why").line().plain for state in doctor.MARKS]
    assert same_text("doctor", "\n".join(told))


def test_doctor_names_what_is_missing_and_packages_of_one_name(monkeypatch):
    found = doctor._installed("numpy", ["numpy", "scipy"], "wrong", "shipgym")
    assert (found.what, found.state) == ("numpy", "fine")
    assert re.fullmatch(r"[0-9.]+, scipy [0-9.]+", found.detail)
    found = doctor._installed("extra", ["numpy", "nowhere-1", "nowhere-2"], "left", "'shipgym[x]'")
    assert (found.state, found.detail) == (
        "left",
        "nowhere-1, nowhere-2 not installed: pip install 'shipgym[x]'",
    )
    monkeypatch.setattr(
        importlib.metadata, "packages_distributions", lambda: {"agents": ["shipgym", "other", "alike"]}
    )
    found = doctor.name_finding("agents")
    assert found.state == "wrong"
    assert found.detail.startswith("also a package of alike, other, they overwrite each other")
    assert doctor.name_finding("identification").state == "fine"
    assert doctor.name_finding("json").detail.startswith("leads to ")
    assert doctor.name_finding("nowhere_1").detail.startswith("leads to None, expected ")


@pytest.mark.skipif(os.name == "nt", reason="Windows has other permissions")
def test_warm_fills_no_cache_that_would_not_be_used(tmp_path):
    tmp_path.chmod(0o777)
    answer = subprocess.run(
        [sys.executable, "-m", "agents.cli", "warm"], cwd=ROOT, capture_output=True, text=True, check=False,
        env={**os.environ, "SHIPGYM_CACHE": str(tmp_path)},
    )  # fmt: skip
    assert answer.returncode == 2
    assert "may be written by other users" in answer.stderr
    assert "there is no cache to fill" in answer.stderr
    assert not list(tmp_path.iterdir())


def test_warm_knows_environments_and_models():
    answer = shipgym("warm", "titanic")
    assert answer.exit_code == 2
    assert "'titanic' found, expected an environment's id or a model" in answer.stderr


def test_doctor_tells_of_another_distribution_called_agents(monkeypatch):
    monkeypatch.setattr(
        "importlib.metadata.packages_distributions", lambda: {"agents": ["shipgym", "openai-agents"]}
    )
    answer = shipgym("doctor")
    assert answer.exit_code == 1
    assert "also a package of openai-agents" in answer.stdout


def test_a_wrong_file_gives_no_traceback_from_the_shell(tmp_path):
    answer = subprocess.run(
        [sys.executable, "-m", "agents.cli", "identify", "absent.toml", "--out", str(tmp_path / "out")],
        cwd=ROOT, capture_output=True, text=True, check=False, env=os.environ | {"COLUMNS": "80"},
    )  # fmt: skip
    assert answer.returncode == 2
    assert "Traceback" not in answer.stderr
    assert answer.stderr.count("\n") == 1


def test_trials_in_shallow_water():
    answer = shipgym("trials", "tanker", "--depth", 25, "--json")
    found = json.loads(answer.stdout)
    assert found["water_depth"] == 25.0
    assert found["imo"] == {}  # the criteria are made for deep water
    turn = found["manoeuvres"]["turning circle 35 deg to starboard"]
    assert turn["tactical_diameter_lengths"]["value"] > 3.5
    for name, depth, said in (("tanker", 18, "draught of 18.46 m"), ("mariner", 30, "deep-water model")):
        answer = shipgym("trials", name, "--depth", depth)
        assert answer.exit_code == 2
        assert said in answer.stderr


def test_what_a_training_found_is_told(capsys):
    result = SimpleNamespace(
        to_dict=dict, resumed_from=None, lq_cost=None, best_cost=1.234, best_steps=2000, steps=3000,
        lq_reached=None, finished=True, plan=SimpleNamespace(settings=SimpleNamespace(total_steps=9000)),
    )  # fmt: skip
    training._print_result(result, Path("run"))
    assert capsys.readouterr().out == (
        "cost of a held-out episode: 1.23 (step 2,000 of 3,000)\nwritten: run/agent.json\n"
    )
    vars(result).update(
        resumed_from=1500, lq_cost=2.5, lq_reached={"steps": 1200, "seconds": 7.6}, finished=False
    )
    training._print_result(result, Path("run"))
    assert capsys.readouterr().out.splitlines() == [
        "resumed at step 1,500",
        "cost of a held-out episode: 1.23; LQ's: 2.50 (step 2,000 of 3,000)",
        "LQ's cost reached at step 1,200, after 8 s",
        "stopped at step 3,000 of 9,000: continue with --resume --out run",
        "written: run/agent.json",
    ]


def test_a_training_that_is_interrupted_says_whether_it_can_go_on(tmp_path, monkeypatch, capsys):
    def interrupted(plan, out, **settings):
        if out.name == "kept":
            out.mkdir()
            (out / CHECKPOINT).touch()
        raise KeyboardInterrupt

    monkeypatch.setattr("agents.training.training.train", interrupted)
    told = {"none": "interrupted", "kept": f"interrupted; continue with --resume --out {tmp_path / 'kept'}"}
    for name, said in told.items():
        with pytest.raises(typer.Exit) as left:
            training._train(Given("ppo"), tmp_path / name, False, None)
        assert (left.value.exit_code, capsys.readouterr().err) == (130, f"error: {said}\n")
