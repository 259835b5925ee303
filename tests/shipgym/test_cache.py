"""The cache of compiled loops: one process compiles, and neither foreign nor broken
folders end a program."""

import json
import os
import pickle
import re
import stat
import subprocess
import sys
import tempfile
import warnings
from hashlib import sha256
from pathlib import Path

import pytest
from filelock import FileLock, Timeout
from platformdirs import user_cache_path

import shipgym
from shipgym.drafts import draft_name
from shipgym.engine import cache_folder
from shipgym.engine.compiling import compiled
from shipgym.engine.episode_program import EpisodeProgram
from shipgym.errors import InputError
from shipgym.instruments.sensor_set import shipped_sensors
from shipgym.sea.open_sea import CALM_SEA, OPEN_SEA
from shipgym.tasks.definition import read_definition

VECTOR = r"<\d+ x double>"  # as LLVM writes it
TWICE = """
import sys
import numpy as np
from shipgym.engine.compiling import compiled

sys.modules["ipykernel"] = None  # a notebook, where somebody waits

def twice(numbers):
    for i in range(len(numbers)):
        numbers[i] *= 2.0

numbers = np.ones(1)
compiled(twice, "void(float64[::1])", {}, "twice")(numbers)
print(numbers[0])
"""
OTHER_USER = """
import io, json, os, sys, warnings
import numpy as np
from shipgym.drafts import draft_name
from shipgym.engine import cache_folder
from shipgym.engine.compiling import compiled

sys.modules["ipykernel"] = None

def twice(numbers):
    for i in range(len(numbers)):
        numbers[i] *= 2.0

def thrice(numbers):
    for i in range(len(numbers)):
        numbers[i] *= 3.0

def attempt(function):
    cache_folder.usable_folder.cache_clear()
    sys.stderr = io.StringIO()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        loop = compiled(function, "void(float64[::1])", {}, "loop")
    announced = sys.stderr.getvalue().count("compiling loop")
    numbers = np.ones(1)
    loop(numbers)
    return [numbers[0], announced, [str(one.message) for one in caught]]

folder, closed = sys.argv[1:]
found = {"before": attempt(twice)}
os.chmod(folder, 0o555)
os.chmod(closed, 0 if os.geteuid() else 0o700)
if os.geteuid() == 0:
    os.seteuid(65534)
found["filled"], found["partly"] = attempt(twice), attempt(thrice)
del os.environ["SHIPGYM_CACHE"]
os.environ.pop("XDG_CACHE_HOME", None)
for home in ("/", closed, closed + "/deeper"):
    os.environ["HOME"] = home
    found[home] = attempt(twice)
print(json.dumps(found))
"""


def start(code, *arguments, cache):
    return subprocess.Popen(
        [sys.executable, "-c", code, *arguments],
        env={**os.environ, "SHIPGYM_CACHE": str(cache)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def compiles(cache):
    """Run `twice` in a process; return what it says, but for its answer."""
    answer, said = start(TWICE, cache=cache).communicate(timeout=120)
    assert answer == "2.0\n"
    return said


def test_of_processes_that_start_at_once_one_compiles(tmp_path):
    workers = [start(TWICE, cache=tmp_path) for _ in range(4)]
    answers, said = zip(*[worker.communicate() for worker in workers], strict=True)
    assert answers == ("2.0\n",) * 4
    assert "".join(said).count("compiling twice") == 1
    assert len(list(tmp_path.glob("*.loop"))) == 1
    assert not list(tmp_path.glob("*.draft"))


@pytest.mark.skipif(os.name == "nt", reason="there is no such signal")
def test_a_process_that_is_killed_while_it_compiles_blocks_nobody(tmp_path):
    killed = start(TWICE, cache=tmp_path)
    assert "compiling twice" in killed.stderr.readline()
    killed.kill()
    killed.communicate()
    assert list(tmp_path.glob("*.lock"))
    assert not list(tmp_path.glob("*.loop"))
    assert "compiling twice" in compiles(tmp_path)


@pytest.mark.parametrize(
    "damage",
    [
        lambda whole: b"",
        lambda whole: whole[:-100],
        lambda whole: whole[:-1] + b"?",
        lambda whole: sha256(b"no pickle").digest() + b"no pickle",
    ],
)
def test_a_damaged_file_is_compiled_anew(tmp_path, damage):
    assert "compiling twice" in compiles(tmp_path)
    (file,) = tmp_path.glob("*.loop")
    file.write_bytes(damage(file.read_bytes()))
    said = compiles(tmp_path)
    assert "compiling twice" in said
    assert said.count("CacheWarning") == said.count("it is compiled again") == 1
    assert compiles(tmp_path) == ""


@pytest.mark.skipif(os.name == "nt", reason="Windows has other permissions")
def test_a_cache_of_another_user_is_read_and_closed_folders_are_said():
    with (
        tempfile.TemporaryDirectory() as home
    ):  # pytest's own folders are closed to other users
        Path(home).chmod(0o755)
        folder, closed = Path(home) / "cache", Path(home) / "closed"
        folder.mkdir()
        closed.mkdir()
        found = json.loads(
            start(OTHER_USER, str(folder), str(closed), cache=folder).communicate()[0]
        )
        folder.chmod(stat.S_IRWXU)
        closed.chmod(stat.S_IRWXU)
    assert found.pop("before") == [2.0, 1, []]
    assert found.pop("filled") == [2.0, 0, []]
    assert found["partly"][0] == 3.0
    for factor, compilations, messages in found.values():
        assert factor in (2.0, 3.0)
        assert compilations == 1
        assert re.search(
            "cannot be written .* compiled again in each process. Set SHIPGYM_CACHE",
            *messages,
        )


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A cache of this user's, found anew by whoever asks."""
    cache = tmp_path / "above" / "cache"
    cache.mkdir(parents=True)
    monkeypatch.setenv("SHIPGYM_CACHE", str(cache))
    cache_folder.usable_folder.cache_clear()
    yield cache
    cache_folder.usable_folder.cache_clear()


@pytest.fixture
def give(monkeypatch):
    """Make another user the owner of a file or folder, as far as this
    process can see."""

    def to_another(path):
        if os.geteuid() == 0:
            os.chown(path, 1234, -1)
        else:
            monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)

    return to_another


posix = pytest.mark.skipif(os.name == "nt", reason="Windows has other permissions")


@posix
@pytest.mark.parametrize("mode", [0o777, 0o775, 0o757, 0o1777])
def test_a_folder_that_others_may_write_is_not_used(folder, mode):
    folder.chmod(mode)
    with pytest.warns(
        UserWarning,
        match="cache may be written by other users; chmod go-w .*cache, or set",
    ) as said:
        assert cache_folder.usable_folder() is None
    assert len(said) == 1
    folder.chmod(0o755)
    assert cache_folder.open_folder() == folder


@posix
def test_so_is_one_below_a_folder_that_others_may_write_but_for_sticky_ones(folder):
    folder.parent.chmod(0o777)
    with pytest.raises(
        ValueError,
        match=r"above may be written by other users; chmod go-w .*above, or set",
    ):
        cache_folder.open_folder()
    folder.parent.chmod(0o1777)  # as /tmp: others cannot rename what is not theirs
    assert cache_folder.open_folder() == folder


@posix
def test_a_folder_of_another_user_is_not_used(folder, give):
    give(folder.parent)
    with pytest.raises(
        ValueError,
        match=r"belongs to another user \(\d+\); set SHIPGYM_CACHE to a folder that",
    ):
        cache_folder.open_folder()
    give(folder)
    with pytest.raises(ValueError, match="cache belongs to another user"):
        cache_folder.open_folder()


@posix
def test_folders_are_made_so_that_only_their_owner_may_write(folder, monkeypatch):
    monkeypatch.setenv("SHIPGYM_CACHE", str(folder / "a" / "b"))
    before = os.umask(0)
    try:
        assert cache_folder.open_folder() == folder / "a" / "b"
    finally:
        os.umask(before)
    assert [
        stat.S_IMODE(one.stat().st_mode) for one in (folder / "a", folder / "a" / "b")
    ] == [0o755, 0o755]


@posix
def test_links_lead_to_the_folder_that_is_looked_at(folder, tmp_path, monkeypatch):
    (tmp_path / "link").symlink_to(folder)
    monkeypatch.setenv("SHIPGYM_CACHE", str(tmp_path / "link"))
    assert cache_folder.open_folder() == folder
    folder.parent.chmod(0o777)
    with pytest.raises(ValueError, match="above may be written by other users"):
        cache_folder.open_folder()


class Planted:
    def __reduce__(self):
        return os.system, ("touch PLANTED",)


def twice(numbers):
    for i in range(len(numbers)):
        numbers[i] *= 2.0


@posix
@pytest.mark.parametrize("change", ["owner", "group", "others", "link"])
def test_a_file_that_another_user_could_have_written_is_not_run(
    folder, give, monkeypatch, change
):
    monkeypatch.chdir(folder)
    compiled(twice, "void(float64[::1])", {}, "twice")
    (path,) = folder.glob("*.loop")
    cache_folder.write_loop(pickle.dumps(Planted()), path)
    if change == "owner":
        give(path)
    elif change == "link":
        path.rename(folder / "elsewhere")
        path.symlink_to(folder / "elsewhere")
    else:
        path.chmod(0o664 if change == "group" else 0o646)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        compiled(twice, "void(float64[::1])", {}, "twice")
        compiled(twice, "void(float64[::1])", {}, "twice")
    assert len(said) == (change != "link")  # a link is no file of ours
    assert not Path("PLANTED").exists()


def test_drafts_of_killed_processes_are_removed_by_the_next_one(folder):
    loop = folder / "tag-short.loop"
    killed = subprocess.Popen([sys.executable, "-c", ""])
    killed.wait()
    own = draft_name(loop).name
    dead, living = (
        folder / own.replace(f"-{os.getpid()}.", f"-{process}.")
        for process in (killed.pid, os.getppid())
    )
    dead.touch()
    living.touch()
    cache_folder.write_loop(b"content", loop)
    assert sorted(folder.iterdir()) == sorted([loop, living])
    assert cache_folder.read_loop(loop) == b"content"


@posix
def test_a_full_disk_is_said_once_and_nothing_is_left(tmp_path):
    full = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (500, 500))\n"
    told, said = start(full + TWICE, cache=tmp_path).communicate()
    assert told == "2.0\n"
    assert (
        said.count("CacheWarning")
        == said.count("cannot be written (File too large)")
        == 1
    )
    assert not [path for path in tmp_path.iterdir() if path.suffix != ".lock"]


def test_a_cache_that_cannot_be_made_is_said_and_survived(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("SHIPGYM_CACHE", str(tmp_path / "file" / "cache"))
    cache_folder.usable_folder.cache_clear()
    with pytest.warns(UserWarning, match="compiled again in each process"):
        assert cache_folder.usable_folder() is None
    cache_folder.usable_folder.cache_clear()


@pytest.mark.parametrize(
    ("terminal", "notebook", "lines"),
    [(True, False, 1), (False, True, 1), (False, False, 0)],
)
def test_who_waits_sees_one_line(
    folder, monkeypatch, capsys, terminal, notebook, lines
):
    monkeypatch.setattr("sys.stderr.isatty", lambda: terminal)
    if notebook:
        monkeypatch.setitem(sys.modules, "ipykernel", None)
    else:
        monkeypatch.delitem(sys.modules, "ipykernel", raising=False)
    compiled(twice, "void(float64[::1])", {}, "a ship")
    said = capsys.readouterr().err
    assert said.count("\n") == lines
    line = "shipgym: compiling a ship, once, about .* s; kept in .*"
    assert bool(re.search(line, said)) == bool(lines)
    assert (str(folder) in said) == bool(lines)


@pytest.mark.parametrize(
    ("task", "windy"), [("CourseKeeping", True), ("PathFollowing", False)]
)
def test_loops_over_ships_are_vectorised(folder, task, windy):
    ship = shipgym.load_model("mariner-tls-svm").compiled
    sensors = shipped_sensors(windy, False, False)
    sea = OPEN_SEA if windy else CALM_SEA
    program = EpisodeProgram(ship, sea, read_definition(task), sensors, shared=True)
    (code,) = program.run.inspect_llvm().values()
    counts = [
        [
            len(re.findall(rf" = f(?:mul|add|sub) (?:contract )?{kind}", block))
            for kind in (VECTOR, "double")
        ]
        for block in re.split(r"\n\n|\n}\n", code)
    ]
    (sailing, alone), (concluding, alone_too), *_ = sorted(counts, reverse=True)
    assert sailing > 300  # the Runge-Kutta step with the ship's 40 terms
    assert concluding > 60  # reward and observations
    assert alone == alone_too == 0


PRINTS = """
from shipgym.engine.compiling import compiled
def told(numbers):
    print(numbers[0])
def tell(numbers):
    told(numbers)
def tell_twice(numbers):
    told(numbers)
    told(numbers)
import numpy as np
for loop in (tell, tell_twice):
    compiled(loop, "void(float64[::1])", {}, "it")(np.array([1.5]))
"""


def test_what_loops_call_may_print_freshly_compiled_or_from_the_cache(tmp_path):
    for _ in range(2):
        told, _ = start(PRINTS, cache=tmp_path).communicate(timeout=120)
        assert told.split() == ["1.5"] * 3
    assert len(list(tmp_path.glob("*.loop"))) == 2


def test_a_user_whom_the_list_of_users_lacks_has_no_home(monkeypatch):
    def unknown(name):
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("SHIPGYM_CACHE", raising=False)
    monkeypatch.setattr(cache_folder, "user_cache_path", unknown)
    cache_folder.usable_folder.cache_clear()
    with pytest.warns(
        cache_folder.CacheWarning,
        match="cannot be written .the user has no home., so ships",
    ):
        assert cache_folder.usable_folder() is None
    cache_folder.usable_folder.cache_clear()


def test_a_user_without_a_home_has_no_folder_of_that_name_made(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SHIPGYM_CACHE", "~nobody-of-this-name/shipgym")
    with pytest.raises(OSError, match="the user has no home"):
        cache_folder.open_folder()
    assert list(tmp_path.iterdir()) == []


def test_the_cache_is_where_the_user_says_or_where_caches_are(monkeypatch, tmp_path):
    monkeypatch.setenv("SHIPGYM_CACHE", str(tmp_path))
    assert cache_folder.cache_folder() == tmp_path
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv(
        "SHIPGYM_CACHE", "~/ships"
    )  # as a container's settings have it, without a shell
    assert cache_folder.cache_folder() == tmp_path / "ships"
    monkeypatch.undo()
    monkeypatch.setenv("SHIPGYM_CACHE", "")
    assert cache_folder.cache_folder() == user_cache_path("shipgym")


def test_what_is_wrong_with_a_loop_s_file_is_told_and_other_files_are_none(folder):
    whole, damaged, other = (
        folder / "whole.loop",
        folder / "damaged.loop",
        folder / "other.txt",
    )
    cache_folder.write_loop(b"content", whole)
    damaged.write_bytes(whole.read_bytes()[:-1])
    other.write_bytes(b"anything")
    assert [cache_folder.loop_fault(path) for path in (whole, damaged, other)] == [
        "",
        "is damaged",
        "",
    ]
    assert "No such file" in cache_folder.loop_fault(folder / "none.loop")


@posix
def test_loops_may_be_read_by_others_whatever_the_user_s_habit(folder):
    before = os.umask(0o077)
    try:
        cache_folder.write_loop(b"content", folder / "a.loop")
    finally:
        os.umask(before)
    assert stat.S_IMODE((folder / "a.loop").stat().st_mode) == 0o644


def test_a_lock_is_held_while_a_loop_is_compiled_and_free_afterwards(folder):
    other = FileLock(folder / "hash.lock")
    waits = []
    with (
        cache_folder.locked(folder / "hash-signature.loop", lambda: waits.append(1)),
        pytest.raises(Timeout),
    ):
        other.acquire(timeout=0)
    assert waits == []
    with (
        other,
        cache_folder.locked(folder / "hash-signature.loop", other.release),
    ):  # who waits is told
        assert not other.is_locked
    other.acquire(timeout=0)
    other.release()
    assert [path.name for path in folder.iterdir() if path.suffix != ".lock"] == []


def test_a_warning_of_the_cache_names_folder_reason_and_remedy(tmp_path):
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        cache_folder.warn_of(tmp_path / "a", OSError(28, "No space left on device"))
        cache_folder.warn_of(tmp_path / "b", InputError("no place"))
        cache_folder.warn_of(tmp_path / "a", OSError(28, "No space left on device"))
    assert [str(one.message) for one in said] == [
        f"{tmp_path}/{name}: cannot be written ({reason}), so ships are compiled again"
        " in each process. Set SHIPGYM_CACHE to a folder that can."
        for name, reason in (("a", "No space left on device"), ("b", "no place"))
    ]
