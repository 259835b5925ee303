import pytest

from agents.output import check_folder, whole_folder
from shipgym import InputError

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
