"""Table of episodes and its Parquet file."""

import numpy as np
import pyarrow
import pytest
from pyarrow import parquet

from agents.benchmarking import episode_table as module
from agents.benchmarking.cells import Cell, ScoredRun
from agents.benchmarking.episode_table import (
    episode_table,
    read_episodes,
    write_episodes,
)
from shipgym.errors import InputError

SEEDS = np.array([3, 4])
KEYS = {"controller": ["a"], "task": ["c"], "run": [0], "seed": [1]}


def run(**figures):
    arrays = {name: np.array(values) for name, values in figures.items()}
    return ScoredRun(arrays)


CELLS = {
    ("pid", "calm"): Cell((run(cost=[0.5, 1.5], grounded=[0.0, 1.0]),)),
    ("ppo", "calm"): Cell(
        (
            run(cost=[0.25, np.nan], settling_s=[2.0, 0.0]),
            run(cost=[0.75, 1.0], settling_s=[3.0, 1.0]),
        )
    ),
}
TABLE = episode_table(CELLS, SEEDS)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "episodes.parquet"


def test_a_figure_that_a_controller_lacks_is_missing_also_in_the_file(path):
    write_episodes(TABLE, path)
    found = read_episodes(path, 6)
    np.testing.assert_equal(found, TABLE)
    assert found["run"].tolist() == [0, 0, 0, 0, 1, 1]
    nan = np.nan
    np.testing.assert_array_equal(found["grounded"], [0.0, 1.0, nan, nan, nan, nan])
    schema = parquet.read_schema(path)
    kinds = {name: str(schema.field(name).type) for name in found}
    assert kinds == {
        "controller": "string",
        "task": "string",
        "run": "int64",
        "seed": "int64",
        "cost": "double",
        "grounded": "bool",
        "settling_s": "double",
    }
    assert parquet.read_table(path)["cost"].null_count == 1


@pytest.mark.parametrize(
    ("changes", "rows", "message"),
    [
        ({}, 5, "expected 5 rows, got 2 of 5 columns"),
        ({"seed": None}, 2, "expected columns 'controller', .* got 'controller'"),
        ({"cost": ["much", "more"]}, 2, "column 'cost' of string"),
        ({"cost": [True, False]}, 2, "column 'cost' of bool"),
        ({"cost": [[1.0], [2.0]]}, 2, "column 'cost' of list"),
        ({"seed": [1, None]}, 2, "column 'seed' has rows without a value"),
        ({"task": ["calm", "c" * 2_500_001]}, 2, "column 'task' of long texts"),
        ({"task": ["calm", None]}, 2, "expected a Parquet file"),
        ({"success": ["maybe", "not"]}, 2, "expected a Parquet file"),
    ],
)
def test_another_table_is_refused(changes, rows, message, path):
    columns = {
        "controller": ["a", "b"],
        "task": ["c", "c"],
        "run": [0, 0],
        "seed": [1, 2],
        "cost": [0.5, 1.0],
    }
    columns |= changes
    kept = {name: values for name, values in columns.items() if values is not None}
    parquet.write_table(pyarrow.table(kept), path)
    with pytest.raises(InputError, match=message):
        read_episodes(path, rows)


def test_a_file_that_was_cut_short_is_refused(path):
    write_episodes(TABLE, path)
    path.write_bytes(path.read_bytes()[:-8])
    with pytest.raises(InputError, match=r"episodes\.parquet: .* may be cut short"):
        read_episodes(path, 6)


def test_a_table_of_too_many_numbers_is_refused_before_it_is_read(path):
    rows = module.MOST_NUMBERS // len(KEYS) + 1
    nothing = {name: pyarrow.nulls(rows) for name in KEYS}
    parquet.write_table(pyarrow.table(nothing), path)
    with pytest.raises(InputError, match=f"got {rows} of 4 columns"):
        read_episodes(path, rows)


def test_figures_may_be_integers_or_booleans_in_the_file(path):
    figures = {"settling_s": [3], "success": [True]}
    parquet.write_table(pyarrow.table(KEYS | figures), path)
    found = read_episodes(path, 1)
    assert [found[name].tolist() for name in figures] == [[3.0], [1.0]]
    assert {found[name].dtype for name in figures} == {np.dtype("float64")}
