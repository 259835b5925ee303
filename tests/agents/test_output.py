import errno
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from agents import output
from agents.cli.doctor import left_findings
from agents.output import check_file, check_folder, check_page, in_use, whole_folder
from shipgym import InputError
from shipgym.files import remove_drafts

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


@pytest.mark.parametrize("error", [InputError("no"), KeyboardInterrupt(), RuntimeError()])
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
    with pytest.raises(InputError, match="is not a folder"):
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


def test_a_second_process_is_told_who_uses_the_folder_and_takes_over_when_that_is_killed(holder, tmp_path):
    with pytest.raises(InputError, match=rf"ship: in use by process {holder.pid} on .* since .* \(-c "):
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


def test_doctor_tells_of_folders_in_use_and_of_what_killed_processes_left(holder, tmp_path, monkeypatch):
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
            assert {path.parts[0] for path in map(Path, everything(tmp_path))} == {"ship"}
            assert draft.parent == tmp_path / "ship"
        assert everything(tmp_path) == ["ship", "ship/model.json"]


def test_a_page_is_a_file_that_can_be_written(tmp_path):
    for name in ("page.html", "page.HTM"):
        check_page(tmp_path / name)
    check_file(tmp_path / "page.txt")
    (tmp_path / "folder.html").mkdir()
    (tmp_path / "file").write_text("")
    for name, message in (
        ("page.txt", r"page.txt: ending '.txt' found, expected a file that ends in .html"),
        ("folder.html", r"folder.html: is a folder, expected a file to write to"),
        ("absent/page.html", "its folder does not exist or cannot be written; choose another"),
        ("file/page.html", "its folder does not exist or cannot be written; choose another"),
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
        told = output._this_process()
    assert re.fullmatch(
        rf"process {os.getpid()} on \S+ since [-0-9]+ [0-9:+-]+ \(shipgym identify 'a b' x .*\)", told
    )
    assert len(told.partition(" (")[2]) == output.LONGEST_COMMAND + 1
