"""Folders of results are whole, locked, and never over other files."""

import errno
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest
from filelock import FileLock

from agents import output
from agents.cli.doctor import left_findings
from agents.output import (
    check_file,
    check_folder,
    check_page,
    check_writable,
    in_use,
    locks_and_drafts,
    present,
    whole_folder,
)
from shipgym import InputError
from shipgym.drafts import remove_drafts

ROOT = Path(__file__).parents[2]

NAMES = ("model.json", "metrics.json")


def everything(folder):
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


def write_half(folder, error):
    with whole_folder(folder, NAMES) as draft:
        (draft / "model.json").write_text("new")
        raise error


def test_the_folder_appears_whole(tmp_path):
    with whole_folder(tmp_path / "a" / "ship", NAMES) as draft:
        (draft / "model.json").write_text("{}")
        assert not (tmp_path / "a" / "ship").exists()
    assert everything(tmp_path) == ["a", "a/ship", "a/ship/model.json"]


@pytest.mark.parametrize(
    "error", [InputError("no"), KeyboardInterrupt(), RuntimeError()]
)
def test_after_an_error_or_an_interruption_nothing_is_left(tmp_path, error):
    with pytest.raises(type(error)):
        write_half(tmp_path / "a" / "ship", error)
    assert everything(tmp_path) == []


def test_after_an_error_the_earlier_result_is_still_there(tmp_path):
    (tmp_path / "ship").mkdir()
    (tmp_path / "ship" / "model.json").write_text("old")
    with pytest.raises(RuntimeError):
        write_half(tmp_path / "ship", RuntimeError())
    assert (tmp_path / "ship" / "model.json").read_text() == "old"


def test_an_interruption_while_a_folder_takes_its_place_leaves_the_earlier_result(
    tmp_path, monkeypatch
):
    rename, target = Path.replace, tmp_path / "ship"

    def replace(self, to):
        if to == target and self.name.endswith(".draft"):
            raise KeyboardInterrupt
        return rename(self, to)

    target.mkdir()
    (target / "metrics.json").write_text("old")
    monkeypatch.setattr(Path, "replace", replace)
    with pytest.raises(KeyboardInterrupt), whole_folder(target, NAMES) as draft:
        (draft / "model.json").write_text("new")
    assert everything(tmp_path) == ["ship", "ship/metrics.json"]


def test_an_earlier_result_is_replaced_as_a_whole(tmp_path):
    (tmp_path / "ship").mkdir()
    (tmp_path / "ship" / "metrics.json").write_text("old")
    with whole_folder(tmp_path / "ship", NAMES) as draft:
        (draft / "model.json").write_text("new")
    assert everything(tmp_path) == ["ship", "ship/model.json"]


def test_a_folder_with_other_files_is_refused(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(InputError, match=r"holds 'thesis.tex'.*choose another folder"):
        check_folder(tmp_path, NAMES)


def test_a_file_is_refused(tmp_path):
    (tmp_path / "ship").write_text("")
    with pytest.raises(InputError, match="expected a folder to write the results to"):
        check_folder(tmp_path / "ship", NAMES)


def test_a_folder_below_a_file_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written to"):
        check_folder(tmp_path / "file" / "ship", NAMES)


def test_a_folder_by_the_name_of_a_result_is_not_a_result(tmp_path):
    (tmp_path / "out" / "model.json").mkdir(parents=True)
    (tmp_path / "out" / "model.json" / "precious.txt").write_text("mine")
    with pytest.raises(InputError, match=r"holds 'model.json', which is not a result"):
        check_folder(tmp_path / "out", ["model.json"])


HOLDS = """
import sys, time
from pathlib import Path
from agents.output import whole_folder
with whole_folder(Path(sys.argv[1]), ["model.json"]) as draft:
    (draft / "model.json").write_text("half")
    print("locked", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def holder(tmp_path):
    """Another process that writes to the folder `ship`."""
    command = [sys.executable, "-c", HOLDS, str(tmp_path / "ship")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, cwd=ROOT) as process:
        assert process.stdout.readline() == b"locked\n"
        yield process
        process.kill()


def test_a_second_process_takes_the_folder_over_when_the_first_is_killed(
    holder, tmp_path
):
    with pytest.raises(
        InputError, match=rf"ship: in use by process {holder.pid} on .* since .* \(-c "
    ):
        write_half(tmp_path / "ship", RuntimeError())
    with pytest.raises(InputError, match="in use"), in_use(tmp_path / "ship"):
        pass
    holder.kill()
    holder.wait()
    assert len(everything(tmp_path)) == 3  # lock, draft, and the file in it
    remove_drafts.cache_clear()
    with whole_folder(tmp_path / "ship", NAMES) as draft:
        (draft / "model.json").write_text("new")
    assert everything(tmp_path) == ["ship", "ship/model.json"]


def test_doctor_tells_of_folders_in_use_and_of_what_killed_processes_left(
    holder, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (found,) = left_findings()
    assert (found.what, found.state) == ("in use", "fine")
    assert f"process {holder.pid} on " in found.detail
    holder.kill()
    holder.wait()
    found = left_findings()
    assert [(one.what, one.state) for one in found] == [("left over", "left")] * 2
    assert ".draft: left by a process that was killed" in found[0].detail
    assert f".ship.lock: left by process {holder.pid} on " in found[1].detail


def test_a_folder_set_aside_by_a_killed_process_is_back(tmp_path):
    (tmp_path / ".ship.0-1.old").mkdir()
    (tmp_path / ".ship.0-1.old" / "model.json").write_text("old")
    with pytest.raises(RuntimeError):
        write_half(tmp_path / "ship", RuntimeError())
    assert everything(tmp_path) == ["ship", "ship/model.json"]


@pytest.mark.parametrize("error", [errno.EXDEV, errno.EBUSY])
def test_a_mounted_volume_takes_results(tmp_path, monkeypatch, error):
    rename, target = Path.replace, tmp_path / "ship"

    def replace(self, to):
        if target in (self, to):
            raise OSError(error, "mounted")
        return rename(self, to)

    monkeypatch.setattr(Path, "replace", replace)
    target.mkdir()
    (target / "metrics.json").write_text("old")
    with whole_folder(target, NAMES) as draft:
        (draft / "model.json").write_text("new")
    assert everything(tmp_path) == ["ship", "ship/model.json"]


def test_of_a_folder_that_stands_alone_nothing_is_beside(tmp_path, monkeypatch):
    (tmp_path / "ship").mkdir()
    monkeypatch.setattr("os.path.ismount", lambda path: path == tmp_path / "ship")
    for _ in range(2):
        with whole_folder(tmp_path / "ship", NAMES) as draft:
            (draft / "model.json").write_text("new")
            assert {path.parts[0] for path in map(Path, everything(tmp_path))} == {
                "ship"
            }
            assert draft.parent == tmp_path / "ship"
        assert everything(tmp_path) == ["ship", "ship/model.json"]


def test_a_page_is_a_file_that_can_be_written(tmp_path):
    for name in ("page.html", "page.HTM"):
        check_page(tmp_path / name)
    check_file(tmp_path / "page.txt")
    (tmp_path / "folder.html").mkdir()
    (tmp_path / "file").write_text("")
    for name, message in (
        (
            "page.txt",
            r"page.txt: expected a file that ends in .html",
        ),
        ("folder.html", r"folder.html: expected a file to write to, got a folder"),
        (
            "absent/page.html",
            "its folder does not exist or cannot be written; choose another",
        ),
        (
            "file/page.html",
            "its folder does not exist or cannot be written; choose another",
        ),
    ):
        with pytest.raises(InputError, match=message):
            check_page(tmp_path / name)


def test_a_lock_without_words_is_another_process(tmp_path):
    (tmp_path / "empty").write_text("")
    (tmp_path / "named").write_text("process 7 on ship")
    found = [output.holder(tmp_path / name) for name in ("empty", "absent", "named")]
    assert found == ["another process", "another process", "process 7 on ship"]
    command = ["shipgym", "identify", "a b", *["x"] * 500]
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(output.sys, "argv", command)
        told = output.process_description()
    assert re.fullmatch(
        rf"process {os.getpid()} on \S+ since [-0-9]+ [0-9:+-]+ \(shipgym identify 'a"
        r" b' x .*\)",
        told,
    )
    assert len(told.partition(" (")[2]) == 200 + len(")")


def test_what_a_link_leads_to_is_not_replaced(tmp_path):
    (tmp_path / "own").mkdir()
    (tmp_path / "linked").symlink_to(tmp_path / "own")
    with pytest.raises(
        InputError,
        match="linked: expected a folder to write the results to",
    ):
        check_folder(tmp_path / "linked", NAMES)
    (tmp_path / "file").write_text("")
    (tmp_path / "own" / "model.json").symlink_to(tmp_path / "file")
    with pytest.raises(
        InputError,
        match=r"own: holds 'model.json', which is not a result of this command",
    ):
        check_folder(tmp_path / "own", NAMES)
    (tmp_path / "own" / "model.json").unlink()
    (tmp_path / "own" / "model.json").write_text("")
    check_folder(tmp_path / "own", NAMES)


def test_what_cannot_be_written_is_refused(tmp_path, monkeypatch):
    check_writable(tmp_path / "a" / "b")
    monkeypatch.setattr(output.os, "access", lambda path, mode: path != tmp_path)
    for folder in ("b", "a/b"):
        with pytest.raises(
            InputError,
            match=rf"b: {tmp_path} cannot be written to; choose another folder",
        ):
            check_writable(tmp_path / folder)
    with pytest.raises(
        InputError, match=r"page.txt: its folder does not exist or cannot be written"
    ):
        check_file(tmp_path / "page.txt")
    (tmp_path / "ship").mkdir()
    check_writable(tmp_path / "ship")  # which is written to itself, nothing beside it


def test_a_folder_that_is_write_protected_is_refused_and_nothing_is_left(
    tmp_path, monkeypatch
):
    (tmp_path / "ship").mkdir()
    (tmp_path / "ship" / "model.json").write_text("mine")
    monkeypatch.setattr(
        output.os, "access", lambda path, mode: path != tmp_path / "ship"
    )
    said = rf"ship: {tmp_path / 'ship'} cannot be written to; choose another folder"
    with pytest.raises(InputError, match=said):
        write_half(tmp_path / "ship", RuntimeError())
    assert everything(tmp_path) == ["ship", "ship/model.json"]
    assert (tmp_path / "ship" / "model.json").read_text() == "mine"


def test_where_no_file_can_be_made_nobody_else_is_blamed():
    """In /proc a file cannot be made even by root, to whom all folders seem
    to be open."""
    with pytest.raises(InputError, match=r"^/proc/ship: .*cannot be written"):
        write_half(Path("/proc/ship"), RuntimeError())
    with (
        pytest.raises(InputError, match=r"^/proc/ship: cannot be written"),
        in_use(Path("/proc/ship")),
    ):
        pass


def test_where_nothing_can_be_beside_a_folder_locks_and_drafts_are_in_it(
    tmp_path, monkeypatch
):
    (tmp_path / "ship").mkdir()
    monkeypatch.setattr(output.os, "access", lambda path, mode: path != tmp_path)
    with in_use(tmp_path / "ship") as home:
        assert home == tmp_path / "ship"
        assert everything(tmp_path) == ["ship", "ship/.ship.lock"]
        assert present(tmp_path / "ship") == []
    assert everything(tmp_path) == ["ship"]


def test_results_are_told_in_order_without_locks_and_drafts(tmp_path):
    for name in ("b", "a", ".ship.lock", ".a.0123abcd-7.draft", ".old.lock"):
        (tmp_path / name).write_text("")
    assert present(tmp_path) == [".old.lock", ".ship.lock", "a", "b"]


def test_one_is_told_at_once_that_a_folder_is_in_use(tmp_path):
    lock = FileLock(tmp_path / ".ship.lock")
    began = time.monotonic()
    with lock:
        (tmp_path / ".ship.lock").write_text("process 7 on ship")
        with pytest.raises(
            InputError, match="ship: in use by process 7 on ship; wait until"
        ):
            write_half(tmp_path / "ship", RuntimeError())
        assert list(locks_and_drafts(tmp_path)) == [
            (f"{tmp_path / '.ship.lock'}: process 7 on ship", False)
        ]
    assert time.monotonic() - began < 0.9


def test_locks_of_others_are_not_spoken_of(tmp_path, monkeypatch):
    (tmp_path / ".apt.lock").write_text("7")
    assert list(locks_and_drafts(tmp_path)) == []
    (tmp_path / ".ship.lock").write_text("process 7 on ship since then")
    ((told, dead),) = locks_and_drafts(tmp_path)
    assert dead
    assert told.endswith(
        "lock: left by process 7 on ship since then, which is dead; the next run there"
        " removes it"
    )

    def refuses(*given, **more):
        raise PermissionError

    monkeypatch.setattr(output, "FileLock", refuses)
    assert list(locks_and_drafts(tmp_path)) == []


@pytest.mark.parametrize(
    "error", [NotImplementedError(), OSError(errno.ENOLCK, "No locks available")]
)
def test_a_disk_without_locks_takes_results(tmp_path, monkeypatch, error):
    def refuses(*given, **more):
        raise error

    monkeypatch.setattr(FileLock, "acquire", refuses)
    (tmp_path / "a").mkdir()
    with whole_folder(tmp_path / "a" / "ship", NAMES) as draft:
        (draft / "model.json").write_text("new")
        assert not (tmp_path / "a" / ".ship.lock").exists()
    assert everything(tmp_path) == ["a", "a/ship", "a/ship/model.json"]


def test_a_lock_is_given_back_and_folders_that_were_there_stay(tmp_path, monkeypatch):
    locks = []

    class Noted(FileLock):
        def __init__(self, *given, **more):
            super().__init__(*given, **more)
            locks.append(self)

    monkeypatch.setattr(output, "FileLock", Noted)
    (tmp_path / "a").mkdir()
    with pytest.raises(RuntimeError):
        write_half(tmp_path / "a" / "b" / "ship", RuntimeError())
    assert everything(tmp_path) == ["a"]
    assert [lock.is_locked for lock in locks] == [False]


def test_a_folder_below_a_file_is_not_used(tmp_path):
    (tmp_path / "file").write_text("")
    with (
        pytest.raises(
            InputError,
            match=(
                r"ship: cannot be written \(File exists|ship: cannot .*Not a directory"
            ),
        ),
        in_use(tmp_path / "file" / "ship"),
    ):
        pass


def test_what_a_killed_process_set_aside_goes_where_results_are_there_again(tmp_path):
    for name in ("ship", ".ship.0-1.old", ".other.0-1.old"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "model.json").write_text(name)
    draft = tmp_path / ".ship.00000000-1.draft"
    draft.mkdir()
    os.utime(draft, (0.0, 0.0))  # a week ago and more
    remove_drafts.cache_clear()
    with in_use(tmp_path / "ship"):
        assert everything(tmp_path) == [
            ".other.0-1.old",
            ".other.0-1.old/model.json",
            ".ship.lock",
            "ship",
            "ship/model.json",
        ]
    assert (tmp_path / "ship" / "model.json").read_text() == "ship"


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (
            OSError(errno.ENOSPC, "No space left on device"),
            "ship: cannot be written (No space left on device)",
        ),
        (OSError("broken"), "ship: cannot be written (broken)"),
    ],
)
def test_a_full_disk_is_told(tmp_path, error, said):
    with pytest.raises(InputError, match=re.escape(said)):
        write_half(tmp_path / "ship", error)
    assert everything(tmp_path) == []
