"""Files appear whole or not at all, wherever they are, and nothing is left of those that did not."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from shipgym.errors import InputError
from shipgym.files import abandoned_drafts, draft_name, make_folder, remove_drafts, write_text

WEEK = 7 * 86400


@pytest.fixture
def dead():
    """Number of a process that is no more."""
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        process.wait()
        return process.pid


def draft(path, process, host=None):
    own = draft_name(path).name
    name = own.replace(str(os.getpid()), str(process))
    left = path.with_name(name if host is None else name.replace(own.split(".")[-2].split("-")[0], host))
    left.write_text("half")
    return left


def test_drafts_of_dead_processes_are_removed_by_the_next_writer_beside(tmp_path, dead):
    left = draft(tmp_path / "model.json", dead)
    (draft_name(tmp_path / "ship").with_name(left.name.replace("model.json", "ship"))).mkdir()
    living, elsewhere = draft(tmp_path / "a", os.getppid()), draft(tmp_path / "b", dead, "00000000")
    (tmp_path / ".mine.draft").write_text("not one of these")
    write_text("whole", tmp_path / "new")
    assert {path.name for path in tmp_path.iterdir()} == {"new", ".mine.draft", living.name, elsewhere.name}
    for path in (living, elsewhere):
        os.utime(path, (path.stat().st_mtime - WEEK - 1,) * 2)
    assert sorted(abandoned_drafts(tmp_path)) == sorted([living, elsewhere])
    remove_drafts.cache_clear()


@pytest.mark.parametrize("error", [errno.EXDEV, errno.EBUSY])
def test_a_file_that_is_a_mount_point_is_written(tmp_path, monkeypatch, error):
    def replace(*_):
        raise OSError(error, "mounted")

    monkeypatch.setattr(Path, "replace", replace)
    write_text("new", tmp_path / "model.json")
    assert [path.read_text() for path in tmp_path.iterdir()] == ["new"]


@pytest.mark.parametrize(
    "path", ["/dev/null", "/proc/self/mem", "/dev/full", "x" * 5000, "/proc/nothing", "/"]
)
def test_what_cannot_be_a_file_is_refused_and_stays(path):
    with pytest.raises(InputError, match=r"cannot be written|is not a file"):
        write_text("text", Path(path))
    assert Path("/dev/null").is_char_device()


def test_a_folder_is_made_with_those_above_it_and_may_be_there(tmp_path):
    for _ in range(2):
        make_folder(tmp_path / "runs" / "first")
    assert (tmp_path / "runs" / "first").is_dir()
    write_text("a file", tmp_path / "file")
    with pytest.raises(InputError, match="file/first: no folder can be made there"):
        make_folder(tmp_path / "file" / "first")
