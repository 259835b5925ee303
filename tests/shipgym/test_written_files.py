"""Files appear whole or not at all, wherever they are, and nothing is left of those
that did not."""

from pathlib import Path

import pytest

from shipgym.drafts import draft_folder, draft_name
from shipgym.errors import InputError
from shipgym.files import make_folder, write_text


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


def test_a_folder_is_removed_unless_it_was_renamed(tmp_path):
    with draft_folder(tmp_path / "result") as folder:
        assert list(folder.iterdir()) == []
        (folder / "new").write_text("whole")
        folder.rename(tmp_path / "result")
    assert [path.name for path in tmp_path.rglob("*")] == ["result", "new"]
    with pytest.raises(ZeroDivisionError), draft_folder(tmp_path / "other") as folder:
        (folder / "half").write_text(str(1 / 0))
    assert [path.name for path in tmp_path.iterdir()] == ["result"]
