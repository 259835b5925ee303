"""Folders of results appear whole or not at all, and are one process's at a time."""

import errno
import re
import subprocess
import sys
from pathlib import Path

import pytest
from filelock import FileLock

from agents import output
from agents.output import check_file, check_folder, check_page, whole_folder
from shipgym.errors import InputError

NAMES = ("model.json", "metrics.json")
ROOT = Path(__file__).parents[2]
RESULT = ["ship", "ship/model.json"]


def everything(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def write(folder, error=None):
    with whole_folder(folder, NAMES) as draft:
        (draft / "model.json").write_text("new")
        if error is not None:
            raise error


@pytest.fixture
def earlier(tmp_path):
    """A folder with an earlier result."""
    (tmp_path / "ship").mkdir()
    (tmp_path / "ship" / "metrics.json").write_text("old")
    return tmp_path / "ship"


def test_an_earlier_result_is_replaced_as_a_whole(tmp_path, earlier):
    write(earlier)
    assert everything(tmp_path) == RESULT
    write(tmp_path / "a" / "b")
    assert everything(tmp_path) == ["a", "a/b", "a/b/model.json", *RESULT]


@pytest.mark.parametrize(
    "error", [InputError("no"), KeyboardInterrupt(), RuntimeError()]
)
def test_after_an_error_or_an_interruption_all_is_as_before(tmp_path, earlier, error):
    for folder in (tmp_path / "a" / "b", earlier):
        with pytest.raises(type(error)):
            write(folder, error)
    assert everything(tmp_path) == ["ship", "ship/metrics.json"]


def prepared(folder):
    """Places that cannot take results, by name."""
    (folder / "thesis").mkdir()
    (folder / "thesis" / "thesis.tex").write_text("years of work")
    (folder / "nested" / "model.json").mkdir(parents=True)
    (folder / "file").write_text("")
    (folder / "linked").symlink_to(folder / "thesis")
    (folder / "linking").mkdir()
    (folder / "linking" / "model.json").symlink_to(folder / "file")
    (folder / "folder.html").mkdir()


@pytest.mark.parametrize(
    ("check", "name", "said"),
    [
        (check_folder, "thesis", "holds 'thesis.tex'.*choose another folder"),
        (check_folder, "nested", "holds 'model.json', which is not a result"),
        (check_folder, "linking", "holds 'model.json', which is not a result"),
        (check_folder, "file", "expected a folder to write the results to"),
        (check_folder, "linked", "expected a folder to write the results to"),
        (check_folder, "file/ship", "cannot be written to"),
        (check_page, "page.txt", "page.txt: expected a file that ends in .html"),
        (check_page, "folder.html", "expected a file to write to, got a folder"),
        (check_page, "absent/page.html", "its folder does not exist or cannot be"),
        (check_file, "file/page", "its folder does not exist or cannot be written"),
    ],
)
def test_what_cannot_take_results_is_refused(check, name, said, tmp_path):
    prepared(tmp_path)
    given = (NAMES,) if check is check_folder else ()
    with pytest.raises(InputError, match=said):
        check(tmp_path / name, *given)


def test_a_page_is_a_file_that_can_be_written(tmp_path):
    for name in ("page.html", "page.HTM"):
        check_page(tmp_path / name)
    assert everything(tmp_path) == []


HOLDS = """
import sys, time
from pathlib import Path
from agents.output import whole_folder
with whole_folder(Path(sys.argv[1]), ["model.json"]) as draft:
    (draft / "model.json").write_text("half")
    print("locked", flush=True)
    time.sleep(60)
"""


def test_a_second_process_takes_the_folder_over_when_the_first_is_killed(tmp_path):
    command = [sys.executable, "-c", HOLDS, str(tmp_path / "ship")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, cwd=ROOT) as holder:
        assert holder.stdout.readline() == b"locked\n"
        said = "ship: in use by another process; wait until"
        with pytest.raises(InputError, match=said):
            write(tmp_path / "ship")
        holder.kill()
    assert len(everything(tmp_path)) == 4  # folder, lock, draft, the file in it
    write(tmp_path / "ship")
    assert everything(tmp_path) == RESULT


def test_a_write_protected_folder_is_refused(tmp_path, earlier, monkeypatch):
    monkeypatch.setattr(output.os, "access", lambda path, mode: path != earlier)
    said = f"ship: {earlier} cannot be written to; choose another folder"
    with pytest.raises(InputError, match=said):
        write(earlier)
    assert everything(tmp_path) == ["ship", "ship/metrics.json"]


def test_where_no_file_can_be_made_nobody_else_is_blamed():
    """In /proc, where all folders seem to be open to root."""
    with pytest.raises(InputError, match=r"^/proc/ship: .*cannot be written"):
        write(Path("/proc/ship"))


@pytest.mark.parametrize(
    "error", [NotImplementedError(), OSError(errno.ENOLCK, "No locks available")]
)
def test_a_disk_without_locks_takes_results(tmp_path, monkeypatch, error):
    def refuses(*given, **more):
        raise error

    monkeypatch.setattr(FileLock, "acquire", refuses)
    write(tmp_path / "ship")
    assert everything(tmp_path) == RESULT


def test_a_full_disk_is_told(tmp_path):
    said = "ship: cannot be written (No space left on device)"
    with pytest.raises(InputError, match=re.escape(said)):
        write(tmp_path / "ship", OSError(errno.ENOSPC, "No space left on device"))
    assert everything(tmp_path) == []
