"""Every option of every command, as a user runs it on the shipped example, no stubs.

Beside the data lie modules with the names of all that commands import, and settings of
Numba: nothing in a folder of data is ever run or read as settings.
"""

import json
import os
import shlex
import subprocess
import sys
from importlib.metadata import packages_distributions
from pathlib import Path

import gymnasium
import pytest
import typer
from typer.testing import CliRunner

import agents
from agents import PID
from agents.cli import app
from shipgym import RecordEpisode, example_ship, load_model
from tests.agents.small_suite import write_suite

LINEAR = "--structure abkowitz --method ridge --set preprocessing=none --set alpha=0.01"
GREY = "--structure grey-box --set reference_model=mariner"
WRONG = "--structure abkowitz --set reference_model=mariner --set kernel=none-such"
TASK = "--task rough-path"
#: Sizes at which a rollout of learning takes a moment.
SMALL = "--set ships=2 --set n_steps=16 --set batch_size=16 --set evaluate_every=32"
TASK_OF_OWN = (
    "--env course-keeping --model mariner --sea calm --option episode_steps=20"
)
LEARNING = "--settings ppo.toml --total-steps 32"

#: Command lines in their order (later ones use what earlier ones wrote), each with its
#: exit code; every command also takes --json and --quiet.
LINES = (
    ("new-ship zigzag_15_15.csv --length 160.9 --out new.toml", 0),
    ("new-ship --update new.toml", 0),
    ("look ship.toml --out look.html", 0),
    (f"identify ship.toml {LINEAR} --out linear", 0),
    (f"identify ship.toml {GREY} --set kernel=rbf --out grey", 0),
    (f"advise ship.toml {LINEAR} --coefficient N_d --number 1", 0),
    (f"identify ship.toml {WRONG} --out wrong", 2),
    (f"advise ship.toml {WRONG}", 2),
    (
        f"reduce ship.toml {LINEAR} --tolerance 0.1 --out reduced",
        0,
    ),
    (f"reduce ship.toml {WRONG} --out reduced", 2),
    ("trials linear/model.json --draws 2 --seed 1 --out trials.html", 0),
    (
        f"autopilot ship.toml {LINEAR} --draws 2 --seed 1 --autopilots"
        " lq,ilos --out report",
        0,
    ),
    (f"autopilot ship.toml {WRONG} --out report2", 2),
    ("export report/lq.json --c c --fmu lq.fmu --name lq", 0),
    ("export path-following-ppo --onnx policy.onnx", 0),
    ("export tanker --c tanker --depth 25", 0),
    (f"train ppo {TASK_OF_OWN} {LEARNING} {SMALL} --seed 1 --out run", 0),
    (
        f"train ppo {TASK_OF_OWN} {LEARNING} {SMALL} --seed 1 --resume --out run",
        0,
    ),
    (f"train ppo {TASK} --model mariner --out run2", 2),
    (f"tune ppo {TASK_OF_OWN} {LEARNING} {SMALL} --trials 1 --seed 1 --out study", 0),
    (f"tune ppo {TASK} --model mariner --out study2", 2),
    (
        "benchmark --controllers pid,lq --suite small.toml --tasks calm --episodes 2"
        " --workers 1 --engine local --allow-code --seed 1 --runs 2"
        " --out results",
        0,
    ),
    (
        "benchmark --controllers pid,lq --suite small.toml --tasks calm --episodes 2"
        " --workers 1 --resume --seed 1 --runs 2 --out results",
        0,
    ),
    ("benchmark --controllers pid --address 127.0.0.1:9 --out results2", 2),
    ("reproduce nobody --markdown tables.md", 2),
    ("reproduce cao2015 --table nothing", 2),
    (
        f"identify ship.toml {LINEAR} --report --out reported",
        0,
    ),
    ("replay recordings/episode-00000.json --out replay.html", 0),
    ("doctor", 0),
)
MODULES = sorted(
    name
    for name in {*packages_distributions(), *sys.stdlib_module_names}
    if name.isidentifier() and name not in ("shipgym", "identification", "agents")
)


def options():
    """Each option of each command by its first long name, and its other names."""
    group = typer.main.get_command(app)
    context = typer.Context(group, info_name="shipgym")
    for name, command in group.commands.items():
        made = command.make_context(name, [], resilient_parsing=True, parent=context)
        for one in made.command.params:
            flags = [*one.opts, *one.secondary_opts]
            long = [flag for flag in flags if flag.startswith("--")]
            if long and long[0] not in ("--json", "--quiet", "--help"):
                yield from ((name, flag) for flag in long)


def test_every_option_has_a_command_line_here():
    lines = [shlex.split(line) for line, _ in LINES]
    tried = {(words[0], word) for words in lines for word in words[1:]}
    missing = [
        f"{name} {flag}" for name, flag in options() if (name, flag) not in tried
    ]
    assert not missing, "add a command line to LINES with: " + ", ".join(missing)


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """The shipped example, and what commands take beside it."""
    folder = tmp_path_factory.mktemp("data")
    for path in example_ship().parent.iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    for name in MODULES:
        (folder / f"{name}.py").write_text(
            f'open("RAN", "a").write("{name} ")\n1 / 0\n'
        )
    (folder / ".numba_config.yaml").write_text("cache_dir: [\n: broken")
    write_suite(folder)
    PID.from_model(load_model("mariner")).save(folder / "pid.json")
    (folder / "ppo.toml").write_text("gamma = 0.98\n")
    env = gymnasium.make("shipgym/CourseKeeping-v0", episode_steps=5)
    with RecordEpisode(env, folder / "recordings") as env:
        env.reset(seed=1)
        for _ in range(5):
            env.step(env.action_space.sample())
    yield folder
    assert not (folder / "RAN").exists(), (folder / "RAN").read_text()


@pytest.mark.parametrize(("line", "code"), LINES, ids=[line for line, _ in LINES])
def test_a_command_runs_as_a_user_runs_it(line, code, data, monkeypatch):
    monkeypatch.chdir(data)
    answer = CliRunner().invoke(app, [*shlex.split(line), "--json", "--quiet"])
    assert answer.exit_code == code, answer.stderr
    assert answer.stderr.count("\n") <= 1 or code == 0
    if code == 0:
        json.loads(answer.stdout)


def run(*words, **environment):
    """Run the command in a process of its own, in this folder."""
    home = str(Path(agents.__file__).parents[1])
    return subprocess.run(
        [sys.executable, "-m", "agents.cli", *words],
        env={**os.environ, "PYTHONPATH": home, **environment},
        capture_output=True,
        text=True,
        check=False,
    )


def test_processes_of_a_command_take_no_modules_from_the_folder_of_data(
    data, monkeypatch
):
    monkeypatch.chdir(data)
    words = "benchmark --controllers pid,lq --suite small.toml --tasks calm"
    more = "--episodes 1 --workers 2 --out in-processes"
    answer = run(*shlex.split(words), *shlex.split(more))
    assert answer.returncode == 0, answer.stderr
    assert not (data / "RAN").exists(), (data / "RAN").read_text()
