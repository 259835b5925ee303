"""The table of episodes: its file says what it holds, and what is no such file is refused."""

import numpy as np
import pyarrow
import pytest
from pyarrow import parquet

from agents.benchmarking import episode_table
from agents.benchmarking.episode_table import joined, read_episodes, write_episodes
from shipgym.errors import InputError

SEEDS = np.array([3, 4])
TABLE = joined(
    [
        (
            "pid",
            "calm",
            0,
            SEEDS,
            {"cost": np.array([0.5, 1.5]), "grounded": np.array([0.0, 1.0])},
        ),
        (
            "ppo",
            "calm",
            1,
            SEEDS,
            {"cost": np.array([0.25, np.nan]), "interventions": np.array([2.0, 0.0])},
        ),
    ]
)


def test_what_a_contestant_lacks_is_missing_and_comes_back_missing(tmp_path):
    path = tmp_path / "episodes.parquet"
    write_episodes(TABLE, path)
    found = read_episodes(path, 4)
    assert list(found) == [
        "contestant",
        "task",
        "run",
        "seed",
        "cost",
        "grounded",
        "interventions",
    ]
    for name, values in TABLE.items():
        np.testing.assert_array_equal(found[name], values)
    np.testing.assert_array_equal(found["run"], [0, 0, 1, 1])
    np.testing.assert_array_equal(found["grounded"], [0.0, 1.0, np.nan, np.nan])
    kinds = parquet.read_schema(path)
    assert [
        str(kinds.field(name).type)
        for name in ("grounded", "interventions", "cost", "seed")
    ] == ["bool", "int64", "double", "int64"]
    assert parquet.read_table(path)["cost"].null_count == 1


@pytest.mark.parametrize(
    ("changes", "rows", "message"),
    [
        ({}, 5, "5 columns of 2 rows found, expected 5 rows"),
        (
            {"seed": None},
            2,
            (
                "columns 'contestant', 'task', 'run', 'cost' found, expected"
                " 'contestant', 'task'"
            ),
        ),
        ({"cost": ["much", "more"]}, 2, "column 'cost' of string"),
        ({"cost": [[1.0], [2.0]]}, 2, "column 'cost' of list"),
        ({"seed": [1, None]}, 2, "column 'seed' has rows without a value"),
        ({"task": ["calm", "c" * 30]}, 2, "column 'task' of long texts"),
        ({"task": ["calm", None]}, 2, "cannot be read as Parquet"),
        ({"success": ["maybe", "not"]}, 2, "cannot be read as Parquet"),
    ],
)
def test_other_tables_are_refused(changes, rows, message, tmp_path, monkeypatch):
    monkeypatch.setattr(
        episode_table, "MOST_NUMBERS", 59
    )  # two texts of 30 characters are too many
    columns = {
        "contestant": ["a", "b"],
        "task": ["c", "c"],
        "run": [0, 0],
        "seed": [1, 2],
        "cost": [0.5, 1.0],
    }
    columns = {
        name: values
        for name, values in (columns | changes).items()
        if values is not None
    }
    path = tmp_path / "episodes.parquet"
    parquet.write_table(pyarrow.table(columns), path)
    with pytest.raises(InputError, match=message):
        read_episodes(path, rows)


def test_a_file_that_was_cut_short_and_a_table_too_large_are_refused(
    tmp_path, monkeypatch
):
    path = tmp_path / "episodes.parquet"
    write_episodes(TABLE, path)
    monkeypatch.setattr(episode_table, "MOST_NUMBERS", 4 * 7)
    assert len(read_episodes(path, 4)["cost"]) == 4
    monkeypatch.setattr(episode_table, "MOST_NUMBERS", 4 * 7 - 1)
    with pytest.raises(InputError, match="7 columns of 4 rows found"):
        read_episodes(path, 4)
    path.write_bytes(path.read_bytes()[:-8])
    with pytest.raises(
        InputError,
        match=r"episodes.parquet: cannot be read as Parquet .*may be cut short",
    ):
        read_episodes(path, 4)


def test_tables_of_five_million_numbers_are_read_at_most(tmp_path):
    path, rows = tmp_path / "episodes.parquet", 5_000_000 // 4 + 1
    nothing = {
        name: pyarrow.nulls(rows) for name in ("contestant", "task", "run", "seed")
    }
    parquet.write_table(pyarrow.table(nothing), path)
    with pytest.raises(InputError, match=f"4 columns of {rows} rows found"):
        read_episodes(path, rows)


def test_whole_numbers_and_yes_or_no_are_figures_of_their_own(tmp_path):
    """A number of events may be whole, a figure that is yes or no a truth; another may not."""
    path = tmp_path / "episodes.parquet"
    keys = {"contestant": ["a"], "task": ["c"], "run": [0], "seed": [1]}
    parquet.write_table(
        pyarrow.table({**keys, "interventions": [3], "success": [True]}), path
    )
    found = read_episodes(path, 1)
    assert (found["interventions"].tolist(), found["success"].tolist()) == (
        [3.0],
        [1.0],
    )
    assert {str(found[name].dtype) for name in ("interventions", "success")} == {
        "float64"
    }
    parquet.write_table(pyarrow.table({**keys, "cost": [True]}), path)
    with pytest.raises(InputError, match="column 'cost' of bool"):
        read_episodes(path, 1)
