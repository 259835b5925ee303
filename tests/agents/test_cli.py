import errno
import importlib.metadata
import importlib.util
import json
import os
import re
import resource
import shlex
import subprocess
import sys
import tempfile
import warnings
from contextlib import nullcontext
from io import BytesIO, TextIOWrapper
from pathlib import Path
from types import SimpleNamespace

import pytest
import typer
from typer.testing import CliRunner

from agents import cli
from agents.cli import app, doctor, identification, reproduction, training, warm
from agents.cli.command import answered, told_failure
from agents.cli.warm import _jobs, _names
from agents.controllers.designs import CLASSICAL
from agents.engines.jobs import JobEngine, WorkerDiedError
from agents.training.plan import Given
from agents.training.run_folder import CHECKPOINT
from shipgym import InputError, ManoeuvreError, UnstableModelError, load_model
from shipgym.engine.cache_folder import CacheWarning
from tests.golden.texts import same_page, same_text

ROOT = Path(__file__).parents[2]


def shipgym(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_what_is_for_verification_alone_is_refused_without_it(tmp_path):
    for option in (
        ("--allow-code", "mine:make"),
        ("--sample", "8"),
        ("--tolerance", "0.1"),
    ):
        answer = shipgym("benchmark", "--out", tmp_path / "out", *option)
        assert answer.exit_code == 2
        assert (
            "--allow-code, --sample and --tolerance are for --verify alone, leave"
            " them out" in answer.output
        )
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


ABOUT = (
    "metavar",
    "default",
    "min",
    "max",
    "required",
    "nargs",
    "multiple",
    "hidden",
    "help",
)


def test_commands_take_the_golden_options():
    """Their names, defaults, bounds and help."""
    told = []
    for name, command in commands().items():
        told.append(f"{name}: {command.help}\n{command.epilog}")
        for one in command.params:
            about = {name: getattr(one, name, None) for name in ABOUT}
            told.append(
                " ".join([*one.opts, *one.secondary_opts, *map(str, about.values())])
            )
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
    ("typed", "completed"),
    [("shipgym auto", "autopilot"), ("shipgym identify --struct", "--structure")],
)
def test_a_shell_completes_commands_and_the_options_of_identify(typed, completed):
    words = {
        "COMP_WORDS": typed,
        "COMP_CWORD": str(typed.count(" ")),
        "_SHIPGYM_COMPLETE": "complete_bash",
    }
    answer = subprocess.run(
        [sys.executable, "-c", "from agents.cli import main; main()"],
        cwd=ROOT,
        env=os.environ | words,
        capture_output=True,
        text=True,
        check=False,
    )
    assert completed in answer.stdout.split(), answer.stderr


def test_help_imports_nothing_heavy():
    code = (
        "import sys, agents.cli; sys.exit(any(m in sys.modules for m in ('numpy',"
        " 'scipy', 'numba', 'rich')))"
    )
    assert (
        subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode
        == 0
    )


@pytest.mark.parametrize(
    "command", [["sail"], ["identify"], ["doctor", "--loud"], ["autopilot", "x.toml"]]
)
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
    answer = shipgym(
        "identify",
        demo,
        "--out",
        tmp_path / "ship",
        "--set",
        "samples=integral",
        "--json",
    )
    assert json.loads(answer.stdout)["stable"] is True


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
    monkeypatch.setattr(
        "agents.verification.chain.why_unstable", lambda _: "for the test"
    )
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
    drawn = {
        "zigzags-0",
        "zigzags-1",
        "zigzags-2",
        "zigzags-3",
        "zigzags-paths",
        "zigzags-histories",
    }
    drawn |= {
        "circles-0",
        "circles-1",
        "circles-paths",
        "circles-histories",
        "spirals-0",
    }
    drawn |= {"spirals-histories", "pull-outs", "pull-outs-histories"}
    names = re.findall(r'Plotly.newPlot\("plot-([\w-]+)"', page)
    assert (set(names), len(names)) == (drawn, 14)
    for caption in (
        "Zigzag 20/20, starboard first. ",
        "Paths from above, north up, in metres.",
        "Sides that end apart",
        "Time histories: heading, rudder, yaw rate, speed and drift angle.",
    ):
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
    states = {
        finding["what"]: finding["state"]
        for finding in json.loads(answer.stdout)["findings"]
    }
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


def test_doctor_tells_of_a_cache_that_is_damaged_or_open_to_others(
    tmp_path, monkeypatch
):
    (tmp_path / "it.loop").write_bytes(bytes(200))
    monkeypatch.setenv("SHIPGYM_CACHE", str(tmp_path))
    answer = shipgym("doctor", "--json")
    (cache,) = (
        one for one in json.loads(answer.stdout)["findings"] if one["what"] == "cache"
    )
    assert (answer.exit_code, cache["state"]) == (1, "wrong")
    assert "1 of them not usable: it.loop is damaged" in cache["detail"]
    if os.name != "nt":
        tmp_path.chmod(0o777)
        answer = shipgym("doctor", "--json")
        assert answer.exit_code == 1
        assert (
            f"{tmp_path} may be written by other users; chmod go-w {tmp_path}, or set"
            in answer.stdout
        )


def test_warm_compiles_into_the_cache_and_writes_nothing_else(tmp_path):
    cache, here = tmp_path / "cache", tmp_path / "here"
    here.mkdir()
    command = [
        sys.executable,
        "-m",
        "agents.cli",
        "warm",
        "shipgym/CourseKeeping-v0",
        "--json",
    ]
    environment = {**os.environ, "SHIPGYM_CACHE": str(cache), "PYTHONPATH": str(ROOT)}
    answer = subprocess.run(
        command, cwd=here, env=environment, capture_output=True, text=True, check=True
    )
    told = json.loads(answer.stdout)
    assert told["cache"] == str(cache)
    assert [one["refused"] for one in told["ready"]] == ["", ""]
    assert len(list(cache.glob("*.loop"))) == 2
    assert not list(here.iterdir())


def test_warm_takes_what_is_named_or_all_there_is():
    everything = _names(None, True)
    assert {
        "shipgym/CourseKeeping-v0",
        "shipgym/PathFollowingRoll-v1",
        "mariner",
        "kvlcc2-mmg",
    } <= set(everything)
    assert _names(["tanker"], True) == everything
    assert _names(["tanker"], False) == ["tanker"]
    assert _names(None, False) == [
        "shipgym/CourseKeeping-v0",
        "shipgym/PathFollowing-v0",
        "shipgym/PathFollowing-v1",
        "mariner",
    ]
    assert [what for what, _ in _jobs("shipgym/CourseKeeping-v0")] == [
        "shipgym/CourseKeeping-v0 in calm water",
        "shipgym/CourseKeeping-v0 in a sea",
    ]
    assert {what for what, _ in _jobs("tanker")} >= {
        "tanker: zigzag",
        "tanker: open_loop",
    }
    with pytest.raises(
        InputError, match="'titanic' found, expected an environment's id or a model: "
    ):
        list(_jobs("titanic"))


def test_warm_says_what_cannot_be_and_goes_on_only_where_all_was_asked_for(monkeypatch):
    def refuses():
        raise InputError("no beam")

    jobs = {"one": [("first", refuses)], "other": [("second", int)]}
    monkeypatch.setattr("agents.cli.warm._names", lambda wanted, everything: list(jobs))
    monkeypatch.setattr("agents.cli.warm._jobs", lambda name, ship: iter(jobs[name]))
    answer = shipgym("warm", "--all", "--json")
    assert answer.exit_code == 0
    ready = json.loads(answer.stdout)["ready"]
    assert [(one["what"], one["refused"]) for one in ready] == [
        ("first", "no beam"),
        ("second", ""),
    ]
    answer = shipgym("warm", "one", "other")
    assert (answer.exit_code, answer.stderr) == (2, "error: no beam\n")
    assert "2/2  second: 0.0 s" in shipgym("warm", "--all").stdout


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (OSError(errno.ENOENT, "No such file", "a.toml"), 2, "a.toml: No such file"),
        (
            OSError(errno.ENOENT, "No such file", "a" * 5000),
            2,
            "a" * 200 + ": No such file",
        ),
        (OSError(errno.EIO, "Input/output error"), 2, "Input/output error"),
        (OSError("odd"), 2, "odd"),
        (
            OSError(errno.ENOSPC, "No space left"),
            1,
            "the output cannot be written (No space left)",
        ),
        (OSError(errno.EPIPE, "Broken pipe"), 1, ""),
    ],
)
def test_what_cannot_be_read_or_written_is_one_line(
    error, code, said, monkeypatch, capsys
):
    closed = []
    monkeypatch.setattr(os, "dup2", lambda *ends: closed.append(ends[1]))
    assert told_failure(error) == code
    assert closed == ([1] if code == 1 else [])
    told = capsys.readouterr().err.replace("\n", "")
    assert told == (f"error: {said}" if said else "")


def test_doctor_has_a_mark_for_each_state():
    told = [
        doctor.Finding(f"what is {state}", state, "and why").line().plain
        for state in doctor.MARKS
    ]
    assert same_text("doctor", "\n".join(told))


def test_doctor_names_what_is_missing_and_packages_of_one_name(monkeypatch):
    found = doctor._installed("numpy", ["numpy", "scipy"], "wrong", "shipgym")
    assert (found.what, found.state) == ("numpy", "fine")
    assert re.fullmatch(r"[0-9.]+, scipy [0-9.]+", found.detail)
    found = doctor._installed(
        "extra", ["numpy", "nowhere-1", "nowhere-2"], "left", "'shipgym[x]'"
    )
    assert (found.state, found.detail) == (
        "left",
        "nowhere-1, nowhere-2 not installed: pip install 'shipgym[x]'",
    )
    monkeypatch.setattr(
        importlib.metadata,
        "packages_distributions",
        lambda: {"agents": ["shipgym", "other", "alike"]},
    )
    found = doctor.name_finding("agents")
    assert found.state == "wrong"
    assert found.detail.startswith(
        "also a package of alike, other, they overwrite each other"
    )
    assert doctor.name_finding("identification").state == "fine"
    assert doctor.name_finding("json").detail.startswith("leads to ")
    assert doctor.name_finding("nowhere_1").detail.startswith(
        "leads to None, expected "
    )
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: SimpleNamespace(origin=None)
    )
    assert doctor.name_finding("identification").detail.startswith(
        "leads to None, expected "
    )


@pytest.mark.skipif(os.name == "nt", reason="Windows has other permissions")
def test_warm_fills_no_cache_that_would_not_be_used(tmp_path):
    tmp_path.chmod(0o777)
    answer = subprocess.run(
        [sys.executable, "-m", "agents.cli", "warm"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "SHIPGYM_CACHE": str(tmp_path)},
    )
    assert answer.returncode == 2
    assert "may be written by other users" in answer.stderr
    assert "there is no cache to fill" in answer.stderr
    assert not list(tmp_path.iterdir())


def test_warm_takes_the_file_of_a_task_with_a_ship(tmp_path, monkeypatch):
    fairway = str(ROOT / "examples" / "fairway.py")
    assert [what for what, _ in _jobs(fairway, "kvlcc2")] == [
        f"{fairway} in calm water",
        f"{fairway} in a sea",
    ]
    made = []
    monkeypatch.setattr(
        warm, "_make", lambda env_id, options: made.append((env_id, options))
    )
    for _, job in _jobs(fairway, "kvlcc2"):
        job()
    options = {"model": "kvlcc2", "task": fairway}
    assert made == [
        ("shipgym/CourseKeeping-v0", options),
        ("shipgym/CourseKeeping-v0", {**options, "sea": "rough"}),
    ]
    with pytest.raises(
        InputError, match="'CartPole-v1' found, expected an environment's id or a model"
    ):
        list(_jobs("CartPole-v1"))


def test_warm_ends_with_an_error_where_nothing_can_be_kept(monkeypatch):
    def kept_nowhere():
        warnings.warn("/cache: cannot be written", CacheWarning, stacklevel=1)

    monkeypatch.setattr(
        "agents.cli.warm._jobs", lambda name, ship: iter([("first", kept_nowhere)])
    )
    answer = shipgym("warm", "--all")
    assert (answer.exit_code, answer.stderr) == (
        2,
        "error: first: /cache: cannot be written\n",
    )


def test_warm_knows_environments_and_models():
    answer = shipgym("warm", "titanic")
    assert answer.exit_code == 2
    assert "'titanic' found, expected an environment's id or a model" in answer.stderr


def test_doctor_tells_of_another_distribution_called_agents(monkeypatch):
    monkeypatch.setattr(
        "importlib.metadata.packages_distributions",
        lambda: {"agents": ["shipgym", "openai-agents"]},
    )
    answer = shipgym("doctor")
    assert answer.exit_code == 1
    assert "also a package of openai-agents" in answer.stdout


def test_a_wrong_file_gives_no_traceback_from_the_shell(tmp_path):
    answer = subprocess.run(
        [
            sys.executable,
            "-m",
            "agents.cli",
            "identify",
            "absent.toml",
            "--out",
            str(tmp_path / "out"),
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"COLUMNS": "80"},
    )
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
    for name, depth, said in (
        ("tanker", 18, "draught of 18.46 m"),
        ("mariner", 30, "deep-water model"),
    ):
        answer = shipgym("trials", name, "--depth", depth)
        assert answer.exit_code == 2
        assert said in answer.stderr


def test_what_a_training_found_is_told(capsys):
    result = SimpleNamespace(
        to_dict=dict,
        resumed_from=None,
        lq_cost=None,
        best_cost=1.234,
        best_steps=2000,
        steps=3000,
        lq_reached=None,
        finished=True,
        plan=SimpleNamespace(settings=SimpleNamespace(total_steps=9000)),
    )
    training._print_result(result, Path("run"))
    assert (
        capsys.readouterr().out
        == "cost of a held-out episode: 1.23 (step 2,000 of 3,000)\nwritten:"
        " run/agent.json\n"
    )
    vars(result).update(
        resumed_from=1500,
        lq_cost=2.5,
        lq_reached={"steps": 1200, "seconds": 7.6},
        finished=False,
    )
    training._print_result(result, Path("run"))
    assert capsys.readouterr().out.splitlines() == [
        "resumed at step 1,500",
        "cost of a held-out episode: 1.23; LQ's: 2.50 (step 2,000 of 3,000)",
        "LQ's cost reached at step 1,200, after 8 s",
        "stopped at step 3,000 of 9,000: continue with --resume --out run",
        "written: run/agent.json",
    ]


def test_a_training_that_is_interrupted_says_whether_it_can_go_on(
    tmp_path, monkeypatch, capsys
):
    def interrupted(plan, out, **settings):
        assert (
            settings["command"] == "shipgym train ppo --out 'my run'"
        )  # as the run's file tells
        if out.name == "kept":
            out.mkdir()
            (out / CHECKPOINT).touch()
        raise KeyboardInterrupt

    monkeypatch.setattr("agents.training.training.train", interrupted)
    monkeypatch.setattr(
        sys, "argv", ["/usr/bin/shipgym", "train", "ppo", "--out", "my run"]
    )
    told = {
        "none": "interrupted",
        "kept": f"interrupted; continue with --resume --out {tmp_path / 'kept'}",
    }
    for name, said in told.items():
        with pytest.raises(typer.Exit) as left:
            training._train(Given("ppo"), tmp_path / name, False, None)
        assert (left.value.exit_code, capsys.readouterr().err) == (
            130,
            f"error: {said}\n",
        )


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (InputError("length: -1 found"), 2, "length: -1 found"),
        (ManoeuvreError("never turned", None), 1, "never turned"),
        (UnstableModelError("lost", 1.0, {}), 1, "lost"),
        (WorkerDiedError("a worker died"), 1, "a worker died"),
        (KeyboardInterrupt(), 130, "interrupted, nothing was written"),
        (OSError(errno.ENOENT, "No such file", "a.toml"), 2, "a.toml: No such file"),
    ],
)
def test_whatever_goes_wrong_is_one_message_and_an_exit_code(error, code, said, capsys):
    def command():
        raise error

    with pytest.raises(typer.Exit) as left:
        answered(command)()
    assert (left.value.exit_code, capsys.readouterr().err) == (code, f"error: {said}\n")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["", "--json"], "argument: '' found"),
        (["identify", ""], "argument: '' found"),
        (["identify", "x", "--out", ""], "--out: '' found"),
        (["identify", "--out="], "--out: '' found"),
        (["look", "a\0b"], "argument: 'a\\x00b' found"),
        (["look", "--out=\0"], "--out: '\\x00' found"),
    ],
)
def test_an_argument_without_text_is_refused_by_the_name_of_its_option(words, said):
    answer = shipgym(*words)
    assert answer.exit_code == 2
    assert f"{said}, expected a text that is not empty" in " ".join(
        answer.stderr.split()
    )


def run_main(monkeypatch, command):
    """The command line with another command in place of all."""
    monkeypatch.setattr(
        warnings, "showwarning", warnings.showwarning
    )  # is put back afterwards
    monkeypatch.setattr(cli, "app", lambda prog_name: command())
    cli.main()


def test_a_warning_is_one_line_on_standard_error(monkeypatch, capsys):
    def command():
        with warnings.catch_warnings():
            warnings.simplefilter("always")
            warnings.warn("the cache is full", stacklevel=1)

    run_main(monkeypatch, command)
    assert capsys.readouterr() == ("", "warning: the cache is full\n")


def test_names_that_the_terminal_has_no_letters_for_are_written_all_the_same(
    monkeypatch,
):
    monkeypatch.setattr(sys, "stdout", TextIOWrapper(BytesIO(), "ascii"))
    run_main(monkeypatch, lambda: print("\u2192 Elbe", flush=True))
    assert sys.stdout.buffer.getvalue().strip() == b"\\u2192 Elbe"


def test_without_standard_output_nothing_is_begun_and_without_standard_error_nothing_is_said(
    monkeypatch,
):
    monkeypatch.setattr(sys, "stderr", None)
    run_main(monkeypatch, lambda: print("odd", file=sys.stderr))
    assert sys.stderr.name == os.devnull
    sys.stderr.close()
    monkeypatch.setattr(sys, "stdout", None)
    with pytest.raises(SystemExit, match="error: standard output is closed"):
        run_main(monkeypatch, lambda: None)


def test_standard_trials_are_asked_for_as_told_and_say_how_far_they_are(
    monkeypatch, tmp_path
):
    asked, shown = [], []
    found = SimpleNamespace(
        indices={},
        water="water of 25 m",
        criteria={},
        refused={"direct spiral": "runs away"},
        to_dict=dict,
    )

    def stand_in(ship, draws, seed, tell, depth):
        asked.append((ship.name, draws, seed, depth))
        shown.append(tell)
        return found

    monkeypatch.setattr("agents.cli.standard_trials.standard_trials", stand_in)
    monkeypatch.setattr(
        "agents.cli.trials_page.write_page", lambda ship, found, out: out.touch()
    )
    answer = shipgym(
        "trials",
        "tanker",
        "--depth",
        25,
        "--draws",
        7,
        "--seed",
        3,
        "--out",
        tmp_path / "a.html",
    )
    assert answer.exit_code == 0, answer.stderr
    assert "Manoeuvres from service speed in water of 25 m" in " ".join(
        answer.stdout.split()
    )
    assert [line for line in answer.stdout.splitlines() if line][-2:] == [
        "The IMO criteria are made for deep water: leave --depth out to assess them.",
        f"written: {tmp_path / 'a.html'}",
    ]
    assert answer.stderr == "warning: no direct spiral: runs away\n"
    shallow = shipgym("trials", "tanker", "--depth", 18)  # before anything is simulated
    assert (shallow.exit_code, len(asked)) == (2, 1)
    told = shipgym("trials", "tanker", "--json")
    assert json.loads(told.stdout) == {"model": "tanker", "seed": 0}
    assert asked == [("tanker", 7, 3, 25.0), ("tanker", 100, 0, float("inf"))]
    assert shown == [None, None]  # standard error is no terminal
    bars = []
    monkeypatch.setattr(
        "agents.cli.terminal.progress_bars",
        lambda: nullcontext(lambda *now: bars.append(now)),
    )
    assert shipgym("trials", "tanker", "--draws", 7).exit_code == 0
    shown[-1](2)
    assert bars == [("models drawn", 2, 7)]


def test_autopilots_are_asked_for_as_told(demo, tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(
        "agents.verification.chain.build_autopilot",
        lambda *given, **more: asked.append((given, more)),
    )
    monkeypatch.setattr(cli, "_print_result", lambda *given: asked.append(given))
    words = ["autopilot", demo, "--out", tmp_path]
    more = [
        "--draws",
        "3",
        "--seed",
        "4",
        "--autopilots",
        "pid, lqg",
        "--agent",
        "a.json",
        "--standards",
    ]
    assert (
        shipgym(*words).exit_code
        == shipgym(*words, *more, "--workers", "2", "--method", "ls").exit_code
        == 0
    )
    usual, told, given, other = asked
    assert usual[0] == given[0] == (demo, tmp_path)
    assert told == (None, tmp_path / "report.html", 200)
    assert other[2] == 3
    expected = {
        "draws": 200,
        "seed": 0,
        "options": {},
        "agents": (),
        "standards": False,
        "progress": None,
        "designs": ("pid", "lq", "lq-scheduled", "turn-rate", "wheel-over"),
        "where": JobEngine(),
    }
    assert usual[1] == expected
    assert given[1] == {
        "draws": 3,
        "seed": 4,
        "options": {"method": "ls"},
        "agents": ["a.json"],
        "standards": True,
        "progress": None,
        "designs": ["pid", "lqg"],
        "where": JobEngine("local", 2),
    }


@pytest.mark.parametrize(
    ("instability", "refusal", "said"),
    [
        (
            "it runs away",
            None,
            "the identified model is unstable: it runs away; see out.html",
        ),
        (
            None,
            "every design loses control",
            "no autopilot is given: every design loses control; see out.html",
        ),
    ],
)
def test_an_autopilot_that_cannot_be_trusted_fails_with_the_reason(
    instability, refusal, said, capsys
):
    result = SimpleNamespace(
        metrics={},
        verification=None,
        stable=instability is None,
        instability=instability,
        refusal=refusal,
    )
    with pytest.raises(typer.Exit) as left:
        cli._print_result(result, Path("out.html"), 9)
    assert (left.value.exit_code, capsys.readouterr().err) == (1, f"error: {said}\n")


@pytest.fixture
def benchmarked(monkeypatch):
    """What the command asks for of benchmarks that are not run, and their result."""
    summary = {
        "contestants": dict.fromkeys(("pid", "lq", "mine")),
        "seeds": {"count": 100},
    }
    found = SimpleNamespace(
        summary=summary, failures=[], asked=[], submitted=[], ends=None
    )

    def benchmark(*given, **more):
        found.asked.append((*given[:5], more["episodes"], more["resume"]))
        if found.ends is not None:
            raise found.ends
        given[3].mkdir(exist_ok=True)
        return found

    def write_page(result, path, **_):
        raise InputError("plotly is not installed")

    monkeypatch.setattr("agents.benchmarking.run.benchmark", benchmark)
    monkeypatch.setattr("agents.benchmarking.page.write_page", write_page)
    monkeypatch.setattr(
        "agents.benchmarking.submission.submit",
        lambda _, *what: found.submitted.append(what),
    )
    for table in ("ranking_table", "costs_table"):
        monkeypatch.setattr(
            f"agents.cli.benchmark_tables.{table}", lambda result: "a table"
        )
    return found


def test_a_benchmark_is_run_as_told_and_the_last_contestant_submitted(
    benchmarked, tmp_path
):
    out, mine = tmp_path / "out", tmp_path / "mine.json"
    answer = shipgym("benchmark", "--out", out, "--submit", mine)
    assert answer.exit_code == 0, answer.stderr
    assert answer.stderr == "warning: there is no index.html: plotly is not installed\n"
    assert answer.stdout.splitlines() == [
        "a table",
        "",
        "a table",
        "",
        f"written: {out}",
    ]
    assert benchmarked.submitted == [("mine", mine)]
    benchmarked.failures.append("lq lost control")
    benchmarked.summary["seeds"]["count"] = 99
    words = [
        "--controllers",
        "pid,mine",
        "--tasks",
        "a,b",
        "--workers",
        3,
        "--episodes",
        99,
        "--resume",
    ]
    answer = shipgym("benchmark", "--out", out, *words, "--no-page")
    assert answer.stderr.splitlines() == [
        "warning: lq lost control",
        "warning: 99 of 100 episodes: for a quick look, not for a ranking",
    ]
    assert len(benchmarked.submitted) == 1
    assert benchmarked.asked == [
        (CLASSICAL, "shipgym-v1", None, out, None, 100, False),
        ("pid,mine", "shipgym-v1", ["a", "b"], out, 3, 99, True),
    ]
    absent = shipgym(
        "benchmark", "--out", out, "--submit", tmp_path / "absent" / "mine.json"
    )
    assert (absent.exit_code, len(benchmarked.asked)) == (
        2,
        2,
    )  # before anything is run
    benchmarked.ends = KeyboardInterrupt()
    answer = shipgym("benchmark", "--out", out)
    assert answer.exit_code == 130
    assert (
        answer.stderr
        == f"error: interrupted; what was done is kept in {out}: continue with"
        " --resume\n"
    )


def test_results_are_verified_as_told(monkeypatch, tmp_path):
    asked = []

    def verify(path, **given):
        asked.append((path, given))
        return []

    monkeypatch.setattr("agents.benchmarking.verification.verify", verify)
    assert shipgym("benchmark", "--verify", tmp_path, "--json").stdout.split() == [
        "{",
        '"checks":',
        "[]",
        "}",
    ]
    given = (
        "--sample",
        3,
        "--tolerance",
        0.1,
        "--workers",
        2,
        "--allow-code",
        "mine:make",
    )
    assert shipgym("benchmark", "--verify", tmp_path, *given).exit_code == 0
    assert asked == [
        (tmp_path, {"sample": 8, "tolerance": None, "workers": None, "allow_code": []}),
        (
            tmp_path,
            {"sample": 3, "tolerance": 0.1, "workers": 2, "allow_code": ["mine:make"]},
        ),
    ]


@pytest.mark.parametrize(
    ("stable", "error", "code"), [(True, 0.1, 0), (False, 0.1, 1), (True, None, 1)]
)
def test_a_comparison_in_which_no_method_stays_stable_fails(
    stable, error, code, demo, tmp_path, monkeypatch
):
    found = SimpleNamespace(
        save=lambda folder: (folder / "comparison.json").write_text("{}"),
        to_dict=lambda: {"held_out": "trials marked validate", "ranking": []},
        refused={"svr": "too few"},
        left_out={"ls": ("C", "rank")},
        standings=[SimpleNamespace(stable=stable, error=error)],
    )
    monkeypatch.setattr("agents.identifying.compare_ship", lambda *_: found)
    answer = shipgym("identify", demo, "--out", tmp_path / "out", "--compare")
    assert answer.exit_code == code
    assert answer.stderr.splitlines() == [
        "warning: svr was not fitted: too few",
        (
            "warning: ls has no setting of these names and was fitted without them: C,"
            " rank"
        ),
        *(
            ["error: no method gives a model that stays stable on every held-out trial"]
            if code
            else []
        ),
    ]


def test_notes_on_the_trials_are_told_before_what_speaks_against_the_model(
    monkeypatch, capsys
):
    trials = [
        SimpleNamespace(name="a.csv", notes=["two clocks"]),
        SimpleNamespace(name="b.csv", notes=[]),
    ]
    monkeypatch.setattr(
        "identification.validation.warnings.model_warnings",
        lambda _: ["sway was derived"],
    )
    monkeypatch.setattr(
        "identification.validation.warnings.why_unstable", lambda _: None
    )
    identification._check_stable(SimpleNamespace(trials=trials))
    assert (
        capsys.readouterr().err
        == "warning: a.csv: two clocks\nwarning: sway was derived\n"
    )
    monkeypatch.setattr(
        "identification.validation.warnings.why_unstable", lambda _: "it turns"
    )
    with pytest.raises(typer.Exit) as left:
        identification._check_stable(SimpleNamespace(trials=trials))
    told = "error: the identified model is unstable: it turns; it must not be used\n"
    assert (left.value.exit_code, capsys.readouterr().err) == (1, told)


def test_a_cache_that_can_only_be_read_is_of_use_where_there_is_something_in_it(
    tmp_path, monkeypatch
):
    def refused(**_):
        raise OSError(errno.EROFS, "Read-only file system")

    readable = {"yes": True}
    monkeypatch.setattr(doctor, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(doctor, "open_folder", lambda: tmp_path)
    monkeypatch.setattr(tempfile, "NamedTemporaryFile", refused)
    monkeypatch.setattr(os, "access", lambda *_: readable["yes"])
    state, told = doctor._cache()
    assert state == "wrong"
    assert (
        "cannot be written (Read-only file system): every process compiles its ships"
        " again" in told
    )
    (tmp_path / "notes.txt").write_text("2" * 260_000)
    assert doctor._cache() == (
        "fine",
        (
            f"{tmp_path}, 1 files, 0.3 MB, to be read only: what is missing is compiled"
            " in memory"
        ),
    )
    readable["yes"] = False
    assert doctor._cache()[0] == "wrong"


def test_doctor_looks_here_one_level_below_and_into_the_cache(tmp_path, monkeypatch):
    (tmp_path / "b").mkdir()
    (tmp_path / "a").mkdir()
    (tmp_path / "file").touch()
    seen = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(doctor, "cache_folder", lambda: Path("cache"))
    monkeypatch.setattr(
        doctor,
        "locks_and_drafts",
        lambda folder: seen.append(folder) or [("a lock", False)],
    )
    found = doctor.left_findings()
    assert seen == [tmp_path, tmp_path / "a", tmp_path / "b", Path("cache")]
    assert {(one.what, one.state, one.detail) for one in found} == {
        ("in use", "fine", "a lock")
    }


def test_doctor_knows_what_is_needed_and_what_is_an_extra_but_not_what_developers_need(
    monkeypatch,
):
    declared = [
        "numpy>=2",
        "tomli; python_version < '3.11'",
        'plotly>=6; extra == "report"',
    ]
    declared += [
        'shipgym[report]; extra == "dev"',
        'ruff; extra == "dev"',
        'mkdocs; extra == "docs"',
    ]
    monkeypatch.setattr(importlib.metadata, "requires", lambda name: declared)
    assert doctor._declared() == {
        "": ["numpy", "tomli"],
        "report": ["plotly"],
        "dev": ["ruff"],
        "docs": ["mkdocs"],
    }
    monkeypatch.setattr(doctor, "_cache", lambda: ("fine", "here"))
    monkeypatch.setattr(doctor, "left_findings", list)
    monkeypatch.setattr(
        doctor,
        "name_finding",
        lambda name: doctor.Finding(f"import {name}", "fine", ""),
    )
    found = {one.what: (one.state, one.detail) for one in doctor.examine_installation()}
    assert list(found) == [
        "shipgym",
        "numpy",
        "tomli",
        "extra report",
        "cache",
        "import shipgym",
        "import identification",
        "import agents",
    ]
    assert found["extra report"][0] == "fine"
    monkeypatch.setattr(importlib.metadata, "requires", lambda name: None)
    assert doctor._declared() == {}


def test_papers_are_reproduced_by_the_program_of_the_checkout(monkeypatch, tmp_path):
    asked = []

    def run(command, **more):
        asked.append((command, more["stdout"]))
        return SimpleNamespace(returncode=3)

    monkeypatch.setattr(reproduction.subprocess, "run", run)
    page = str(tmp_path / "page.md")
    for words in ([], ["--markdown", page, "--json", "--quiet"], ["--quiet"]):
        assert shipgym("reproduce", "xu2020", *words).exit_code == 3
    program = [sys.executable, str(ROOT / "scripts" / "reproduce.py"), "xu2020"]
    assert asked == [
        (program, None),
        ([*program, "--markdown", page, "--json"], None),
        (program, subprocess.DEVNULL),
    ]


def test_warming_is_told_to_a_hundredth_of_a_second(monkeypatch):
    clock = iter([10.0, 11.23456])
    monkeypatch.setattr(warm, "time", SimpleNamespace(perf_counter=lambda: next(clock)))
    monkeypatch.setattr(warm, "_names", lambda wanted, everything: ["one"])
    monkeypatch.setattr(warm, "_jobs", lambda name, ship: iter([("first", int)]))
    assert [
        one["seconds"] for one in json.loads(shipgym("warm", "--json").stdout)["ready"]
    ] == [1.23]


def test_an_environment_is_made_closed_and_not_warned_of(monkeypatch):
    made = []

    def make(env_id, **options):
        warnings.warn("there is a newer version", DeprecationWarning, stacklevel=1)
        made.append((env_id, options))
        return SimpleNamespace(close=lambda: made.append("closed"))

    monkeypatch.setattr("gymnasium.make", make)
    for _, job in _jobs("shipgym/CourseKeeping-v0"):
        job()
    assert made == [
        ("shipgym/CourseKeeping-v0", {}),
        "closed",
        ("shipgym/CourseKeeping-v0", {"sea": "rough"}),
        "closed",
    ]


def test_a_training_is_asked_for_as_told(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(training, "_train", lambda *given: asked.append(given))
    monkeypatch.setattr(
        training, "_print_result", lambda result, out: asked.append(out)
    )
    words = [
        "train",
        "sac",
        "--out",
        tmp_path,
        "--env",
        "path-following-v1",
        "--model",
        "tanker",
    ]
    words += [
        "--sea",
        "rough",
        "--option",
        "current=0.5",
        "--total-steps",
        "5000",
        "--set",
        "gamma=0.9",
    ]
    words += [
        "--from-nothing",
        "--seed",
        "7",
        "--randomise",
        "--threads",
        "2",
        "--max-seconds",
        "9",
        "--resume",
    ]
    for given in (words, words[:4]):
        answer = shipgym(*given)
        assert answer.exit_code == 0, answer.output
    own = {"gamma": 0.9, "total_steps": 5000, "base": "none"}
    given = Given(
        "sac",
        "path-following-v1",
        "tanker",
        "rough",
        None,
        {"current": 0.5},
        None,
        own,
        7,
        True,
        2,
    )
    assert asked == [
        (given, tmp_path, True, 9.0),
        tmp_path,
        (Given("sac"), tmp_path, False, None),
        tmp_path,
    ]
