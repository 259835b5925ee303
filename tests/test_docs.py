"""Every Python block of the pages runs, page by page, top to bottom, in one namespace
and an empty folder.

Comments of a page, which readers do not see, say what is special:

    <!-- not run: REASON -->            the next block is not run
    <!-- before: CODE -->               run first: what the page leaves to the reader

Numbers of ships, steps and draws are made small (`SMALLER`). The notebooks are run by
`make evidence`.
"""

import ast
import contextlib
import io
import os
import re
import shutil
import sys
import traceback
import types
from importlib import import_module
from pathlib import Path

import document_api
import gymnasium
import numba
import pytest
import sklearn.linear_model  # noqa: F401 - what many pages need is loaded once, before they fork
from plotly.basedatatypes import BaseFigure

import identification.pipeline
import identification.pipeline.result  # noqa: F401
from shipgym import example_ship
from shipgym.envs.registration import ENVIRONMENTS

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(
    r"(?:<!-- (?P<mark>not run|before): (?P<said>.*?)"
    r" -->\n)?\n?^```python\n(?P<code>.*?)^```",
    re.M | re.S,
)
PAGES = [
    path
    for path in sorted((ROOT / "docs").rglob("*.md"))
    if "```python" in path.read_text(encoding="utf-8")
]
#: Pages that take few steps, for which loops are not worth compiling.
PLAIN = ("docs/environments/", "docs/gallery.md")
SMALLER = {
    "num_envs=1024": "num_envs=3",
    "learn(20_000)": "learn(64)",
    "learn(65_000)": "learn(64)",
    "episodes=10": "episodes=1",
    "range(20)": "range(2)",
    "range(1000)": "range(3)",
    "n_draws=200": "n_draws=3",
    "seconds=35.0": "seconds=1.0",
    ".engine(100)": ".engine(3)",
    "(task.seeds)": "(task.seeds[:3])",
}


@pytest.mark.filterwarnings("ignore:.*multi-threaded, use of fork:DeprecationWarning")
@pytest.mark.parametrize(
    "page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix()
)
def test_the_blocks_of_a_page_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(example_ship().parent, tmp_path, dirs_exist_ok=True)
    for folder in ("examples", "agents"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    if not (child := os.fork()):  # whatever a page registers ends with it
        status = 1
        numba.config.DISABLE_JIT = page.relative_to(ROOT).as_posix().startswith(PLAIN)
        try:
            run(page)
            status = 0
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(status)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def run(page):
    """Run the blocks of a page."""
    BaseFigure.show = lambda _: None
    name = f"page_{page.stem}"
    module = sys.modules[name] = types.ModuleType(name)  # jobs are functions of modules
    names = vars(module)
    for found in BLOCK.finditer(page.read_text(encoding="utf-8")):
        mark, said, code = found["mark"], found["said"], found["code"]
        if mark == "not run":
            ast.parse(code)
            assert len(said) > 10
            continue
        if mark == "before":
            exec(said, names)
        for large, small in SMALLER.items():
            code = code.replace(large, small)
        with contextlib.redirect_stdout(io.StringIO()):
            exec(compile(code, str(page), "exec"), names)


def test_every_block_that_is_not_run_is_parsed_and_has_its_mark():
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    found = BLOCK.findall(text)
    assert len(found) == text.count("\n```python\n")
    marks = text.count("<!-- not run: ") + text.count("<!-- before: ")
    assert marks == sum(bool(mark) for mark, _, _ in found)


def test_the_reference_has_every_public_name():
    written = {
        path.name: path.read_text(encoding="utf-8")
        for path in (ROOT / "docs" / "api").glob("*.md")
    }
    assert written == document_api.pages()


def test_every_name_of_a_package_but_constants_has_an_entry():
    text = "".join(document_api.pages().values())
    described = {entry.rpartition(".")[2] for entry in re.findall("::: (.*)", text)}
    assert described >= {"LSSVM", "RMSVM", "LQ", "LQG", "PID", "MPC"}
    packages = [name for page in document_api.PACKAGES.values() for name in page]
    public = {name for one in packages for name in import_module(one).__all__}
    colours = {"LIMIT", "MEASURED", "MODEL", "MUTED", "PALETTE"}
    constants = {"AIR_DENSITY", "CHANNEL_AXES", "manoeuvres", "plots"}  # modules too
    assert public - described == colours | constants


def test_the_table_of_ids_is_that_of_the_environments():
    text = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
    rows = re.findall(
        r"`(\w+-v0)`.* \| `(rudder[-a-z]*)`.* \| (\d+) \| `(.*)` \|", text
    )
    assert [f"shipgym/{name}" for name, *_ in rows] == [*ENVIRONMENTS]
    for name, action, count, model in rows:
        env = gymnasium.make(f"shipgym/{name}").unwrapped
        keywords = ENVIRONMENTS[f"shipgym/{name}"]
        assert keywords.get("action", "rudder") == action
        assert len(env.observation_names) == int(count)
        assert keywords.get("model", "mariner-tls-svm") == model
