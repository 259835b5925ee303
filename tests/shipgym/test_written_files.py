"""Files appear whole or not at all, wherever they are, and nothing is left of those
that did not."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from shipgym.drafts import (
    abandoned_drafts,
    draft_folder,
    draft_name,
    remove_drafts,
)
from shipgym.errors import InputError
from shipgym.files import make_folder, write_text

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
    left = path.with_name(
        name if host is None else name.replace(own.split(".")[-2].split("-")[0], host)
    )
    left.write_text("half")
    return left


def test_drafts_of_dead_processes_are_removed_by_the_next_writer_beside(tmp_path, dead):
    left = draft(tmp_path / "model.json", dead)
    (
        draft_name(tmp_path / "ship").with_name(left.name.replace("model.json", "ship"))
    ).mkdir()
    living, elsewhere = (
        draft(tmp_path / "a", os.getppid()),
        draft(tmp_path / "b", dead, "00000000"),
    )
    (tmp_path / ".mine.draft").write_text("not one of these")
    write_text("whole", tmp_path / "new")
    assert {path.name for path in tmp_path.iterdir()} == {
        "new",
        ".mine.draft",
        living.name,
        elsewhere.name,
    }
    for path in (living, elsewhere):
        os.utime(path, (path.stat().st_mtime - WEEK - 1,) * 2)
    assert sorted(abandoned_drafts(tmp_path)) == sorted([living, elsewhere])
    remove_drafts.cache_clear()


def test_a_draft_has_a_random_name_and_never_follows_what_lies_there(
    tmp_path, monkeypatch
):
    names = {draft_name(tmp_path / "a") for _ in range(100)}
    assert len(names) == 100
    victim = tmp_path / "victim"
    victim.write_text("precious")
    for target in (victim, tmp_path / "nowhere"):
        guessed = tmp_path / f".a.guessed.{target.name}.draft"
        guessed.symlink_to(target)
        monkeypatch.setattr("shipgym.drafts.draft_name", lambda _, name=guessed: name)
        with pytest.raises(InputError, match=r"cannot be written \(File exists\)"):
            write_text("stolen", tmp_path / "a")
        guessed.symlink_to(target)
        with pytest.raises(FileExistsError), draft_folder(tmp_path / "a"):
            pass
        assert guessed.is_symlink()
    assert victim.read_text() == "precious"
    assert not (tmp_path / "a").exists()
    assert not (tmp_path / "nowhere").exists()


@pytest.mark.parametrize("error", [errno.EXDEV, errno.EBUSY])
def test_a_file_that_is_a_mount_point_is_written(tmp_path, monkeypatch, error):
    def replace(*_):
        raise OSError(error, "mounted")

    monkeypatch.setattr(Path, "replace", replace)
    write_text("new", tmp_path / "model.json")
    assert [path.read_text() for path in tmp_path.iterdir()] == ["new"]


@pytest.mark.parametrize(
    "path",
    ["/dev/null", "/proc/self/mem", "/dev/full", "x" * 5000, "/proc/nothing", "/"],
)
def test_what_cannot_be_a_file_is_refused_and_stays(path):
    with pytest.raises(InputError, match=r"cannot be written|is not a file"):
        write_text("text", Path(path))
    assert Path("/dev/null").is_char_device()


def test_a_refusal_gives_the_reason_of_the_system_in_words(tmp_path):
    with pytest.raises(InputError) as caught:
        write_text("text", tmp_path / "none" / "a")
    assert (
        str(caught.value)
        == f"{tmp_path}/none/a: cannot be written (No such file or directory); choose a"
        " folder that exists"
    )
    with pytest.raises(InputError) as caught:
        write_text(
            "text", tmp_path / ("x" * 250)
        )  # its draft's name is longer than names may be
    assert str(caught.value).endswith("x: cannot be written (File name too long)")
    write_text("a file", tmp_path / "file")
    with pytest.raises(
        InputError, match=r"no folder can be made there \(Not a directory\)$"
    ):
        make_folder(tmp_path / "file" / "first")


def test_a_folder_is_removed_unless_it_was_renamed(tmp_path, dead):
    left = draft(tmp_path / "result", dead)
    with draft_folder(tmp_path / "result") as folder:
        assert not left.exists()
        assert list(folder.iterdir()) == []
        (folder / "new").write_text("whole")
        folder.rename(tmp_path / "result")
    assert [path.name for path in tmp_path.rglob("*")] == ["result", "new"]
    with pytest.raises(ZeroDivisionError), draft_folder(tmp_path / "other") as folder:
        (folder / "half").write_text(str(1 / 0))
    assert [path.name for path in tmp_path.iterdir()] == ["result"]
