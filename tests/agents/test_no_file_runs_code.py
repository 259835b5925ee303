"""Files that a user may receive run no code: models, ships, runs, agents, suites."""

import json
import linecache
import random
import re
import sys
from io import StringIO

import pytest
from typer.testing import CliRunner

from agents import load_agent
from agents.cli import app
from agents.cli.terminal import PlainConsole
from agents.identifying import identification_settings
from agents.suites.suite import parse_suite
from agents.training.plan import make_plan
from agents.training.run_folder import begin_folder
from identification.models.similarity import chosen_box
from shipgym import InputError, ShipFile, ShipModel, load_model
from shipgym.engine import record_code
from shipgym.pages import environment
from shipgym.plots.style import plain_texts
from shipgym.ships.term_functions import accelerations_source
from tests.agents.policies import random_policy

CODE = 'open("RAN", "w").close()'
TEXTS = (
    f'x"""\n{CODE}\n"""',
    f"x'''\n{CODE}\n'''",
    f"x\n{CODE}\n",
    f"x\r{CODE}#",
    f"0.0\n    {CODE}",
    f"0); {CODE} #",
    f"# x\n{CODE}",
    f"\\\n{CODE}",
    f"x\0{CODE}",
    f"x\u2028{CODE}",
    f"{{{CODE}}}",
    f'" + {CODE} + "',
    f"' or {CODE}",
    f"[{CODE}]",
    f"lambda: {CODE}",
    f"U) or {CODE} or (U",
    "__import__('os').system('touch RAN')",
    "c.__class__",
    "\uff55",
    "\u028b",
    "u\u0301",
    "\u202eu",
    "d\u0435lta",
    "motion.u",
    "|u|\n",
    " u",
    "u ",
)
#: What a source may be, said once more than in the package: a line each, fixed words,
#: no text.
LINE = re.compile(
    r"(    )?(def accelerations\(motion, c, ship\):|return udot, vdot, rdot( \+"
    r" motion\.q)?, pdot, qdot"
    r"|\w+ = ([-+*/()"
    r" ]|\b(motion|ship)\.[a-z]+|\bc\.c[0-9]+|\b[10]\.0\b"
    r"|\b(abs_)?(u|v|r|p|n|phi|delta|du|dn|s|U|per_U|fabs|sqrt)_?\b)+)",
    re.ASCII,
)
SMALL = {
    "format": 1,
    "name": "small",
    "structure": {
        "name": "own",
        "source": "made up",
        "normalisation": "service",
        "quantity": "acceleration",
        "equations": {
            "v": [
                {"name": "v", "powers": {"v": 1}},
                {"name": "d", "powers": {"delta": 1}},
            ],
            "r": [
                {"name": "r/U", "powers": {"r": 2, "U": -1}},
                {"name": "|v|r", "powers": {"|v|": 1, "r": 1}},
            ],
        },
    },
    "coefficients": {"b_v": -1.0, "b_d": -0.1, "c_r/U": -0.5, "c_|v|r": -0.2},
    "particulars": {"name": "small", "length": 100.0, "speed": 5.0, "estimated": []},
    "steering": {"rudder_limit_deg": 35.0},
    "provenance": {"made by": ["hand"]},
}


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """Code that ran would leave a file; what becomes code is fixed words."""
    made = []

    def execute(code, namespace):
        if "<accelerations " in code.co_filename:
            made.append(code.co_filename)
        exec(code, namespace)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(record_code, "exec", execute, raising=False)
    yield
    assert not (tmp_path / "RAN").exists()
    assert all(
        LINE.fullmatch(line[:-1]) for name in made for line in linecache.getlines(name)
    )


def places(value, path=()):
    """Where texts and numbers stand: (containers' keys, whether it is a key)."""
    if isinstance(value, dict):
        for key, one in value.items():
            yield (*path, key), True
            yield from places(one, (*path, key))
    elif isinstance(value, list):
        for k, one in enumerate(value):
            yield from places(one, (*path, k))
    else:
        yield path, False


def put(content, path, is_key, new):
    """A copy with a key or value replaced."""
    content = json.loads(json.dumps(content))
    *way, last = path
    inside = content
    for key in way:
        inside = inside[key]
    if is_key:
        renamed = {new if key == last else key: value for key, value in inside.items()}
        inside.clear()
        inside.update(renamed)
    else:
        inside[last] = new
    return content


def added(content, path, new):
    """A copy with an entry more, or another in place of one."""
    content = json.loads(json.dumps(content))
    inside = content
    for key in path[:-1]:
        inside = inside[key]
    inside[path[-1]] = new
    return content


def source_of(content):
    """The source that a model comes to; None if the model is refused."""
    try:
        model = ShipModel.from_dict(content)
    except InputError:
        return None
    table = model.table
    lines = accelerations_source(table.equations, table.normalisation == "prime")
    return [f"    {line}" for line in lines]


def test_names_and_comments_change_no_source_and_nothing_else_is_taken():
    innocent = source_of(SMALL)
    assert all(LINE.fullmatch(line) for line in innocent)
    assert not LINE.fullmatch(f"    udot = {CODE}")
    kept = set()
    for path, is_key in places(SMALL):
        for text in TEXTS:
            found = source_of(put(SMALL, path, is_key, text))
            assert found in (None, innocent), (path, text)
            kept |= {path} if found else set()
    assert ("structure", "name") in kept  # a text that is not empty is a name
    assert ("structure", "source") in kept
    assert not any("powers" in path for path in kept)


@pytest.mark.parametrize(
    "power",
    [10**9, 10**30, -(10**30), 10, 0, 1.5, 1e30, True, "1", None, [1], {"u": 1}],
)
def test_powers_are_small_whole_numbers(power):
    path = ("structure", "equations", "v", 0, "powers", "v")
    with pytest.raises(
        InputError,
        match=r"equations\.v: term 'v': power of 'v': expected",
    ):
        ShipModel.from_dict(put(SMALL, path, False, power))


@pytest.fixture
def evil(tmp_path):
    """A model file whose texts are code, and a Python file that tells if it ran."""
    model = load_model("mariner-tls-svm").to_dict()
    for path in (
        ("structure", "name"),
        ("structure", "source"),
        ("name",),
        ("particulars", "name"),
    ):
        model = put(model, path, False, TEXTS[0])
    (tmp_path / "evil.json").write_text(json.dumps(model))
    (tmp_path / "evil.py").write_text(f"{CODE}\nSHIP = None\n")
    (tmp_path / "evil").write_text(f"{CODE}\n")
    return tmp_path / "evil.json"


def test_the_command_and_the_loops_take_no_code_of_a_model(evil):
    answer = CliRunner().invoke(app, ["trials", str(evil), "--draws", "0", "--json"])
    assert answer.exit_code == 0, answer.output


@pytest.mark.parametrize(
    ("option", "full_name"),
    [
        ("reference_model", "reference_model"),
        ("prior", "prior"),
    ],
)
def test_a_ship_file_names_models_and_no_code(evil, option, full_name):
    ship = evil.with_name("ship.toml")
    text = (
        '[ship]\nlength = 160.93\nspeed = 7.7\n[identify]\n{} = "{}"\n[[trials]]\nfile'
        ' = "a.csv"\n'
    )
    evil.with_name("a.csv").write_text("t,u\n0,1\n")
    ship.write_text(text.format(option, "evil.py"))
    with pytest.raises(
        InputError,
        match=rf"ship.toml: \[identify\].{option}: expected data",
    ):
        ShipFile.load(ship)
    ship.write_text(text.format(option, "evil.json"))
    found = ShipFile.load(ship)
    reference = identification_settings(found, {})[full_name]
    box, _ = chosen_box(reference, found.particulars, [])
    assert box.reference.structure == TEXTS[0]
    box.compiled({}, False)


@pytest.mark.parametrize("what", [open, exec])
def test_a_checkpoint_runs_no_code(what, tmp_path):
    class Evil:
        def __reduce__(self):
            return what, ("RAN", "w") if what is open else (CODE,)

    torch = pytest.importorskip("torch")
    plan = make_plan("ppo", settings={"total_steps": 1})
    begin_folder(tmp_path / "run", plan)
    torch.save({"run": Evil()}, tmp_path / "run" / "checkpoint.pt")
    from agents.training.training import train

    with pytest.raises(InputError, match=r"checkpoint\.pt: cut short, or it does not"):
        train(plan, tmp_path / "run", resume=True)


def test_an_agent_only_records_what_it_learned_with(evil):
    path = evil.with_name("agent.json")
    options = {
        "reward": "evil.py",
        "sensors": "evil",
        "task": "evil:factory",
        "corridor": 1.0,
    }
    random_policy(env_options=options, model_name=TEXTS[0]).save(path)
    content = json.loads(path.read_text())
    content["environment"]["id"] = "evil:CourseKeeping-v0"
    path.write_text(json.dumps(content))
    agent = load_agent(path, load_model("mariner"))
    assert agent.env_options == options  # a record, which nothing is made of
    for kind in ("evil:factory", "evil.py"):
        path.write_text(json.dumps({**content, "kind": kind}))
        with pytest.raises(InputError):
            load_agent(path)


@pytest.mark.parametrize(
    "line",
    [
        'model = "evil.py"',
        'options = { reward = "evil" }',
        'options = { ensemble = ["evil.py"] }',
    ],
)
def test_a_suite_names_no_code(evil, line):
    text = f'name = "own"\n[tasks.one]\nenvironment = "course-keeping"\n{line}\n'
    text += "" if line.startswith("model") else 'model = "mariner"\n'
    with pytest.raises(InputError, match="expected data, got"):
        parse_suite(text, "suite.toml")
    suite = parse_suite(
        'name = "own"\n[tasks.one]\nenvironment = "course-keeping"\nmodel ='
        f' "{evil}"\n',
        "suite",
    )
    assert suite.task("one").ship.structure == TEXTS[0]


MARKS = (
    "<a href='javascript:1'>",
    "</script><script>",
    "&lt;b",
    "[red]",
    "[link=file:///etc/passwd]",
    ":smile:",
    "{{ 7 * 7 }}",
    "{% raw %}",
    "%{x}",
    "\x1b]8;;http://a\x07",
    "\x1b[2J",
    "\r",
    "\u202e",
    "$(touch RAN)",
    "`touch RAN`",
    "evil:CourseKeeping-v0",
    "evil:",
    "shipgym/",
    "evil.py",
    "../",
    *TEXTS,
)


def test_ten_thousand_names_ids_and_texts_run_nothing_and_mean_nothing(
    evil, monkeypatch
):
    monkeypatch.syspath_prepend(evil.parent)
    draw = random.Random(38)
    shown = StringIO()
    console = PlainConsole(file=shown, width=200)
    page = environment().from_string("<p title='{{ text }}'>{{ text }}</p>")
    for _ in range(10_000):
        text = "".join(draw.choices(MARKS, k=draw.randint(1, 3)))
        assert "<" not in plain_texts({"name": [text]})["name"][0]
        assert page.render(text=text).count("<") == 2
        shown.seek(0)
        shown.truncate()
        console.print(text, soft_wrap=True)
        told = shown.getvalue()
        assert "\x1b" not in told
        assert told.count("[") == text.count("[")
    assert "evil" not in sys.modules
