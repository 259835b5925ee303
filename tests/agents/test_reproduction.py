import json

import pytest
import reproduce
from papers import PAPERS, Row
from papers.markdown import page
from papers.page import missed
from typer.testing import CliRunner

from agents.cli import app


def test_a_paper_that_is_not_known_gets_one_message(capfd):
    """Through the command `shipgym`, which runs a program of its own."""
    answer = CliRunner().invoke(app, ["reproduce", "cao2051"])
    assert answer.exit_code == 2
    assert "Did you mean 'cao2015'" in capfd.readouterr().err


def test_rows_for_programs_and_the_page_for_readers(tmp_path):
    path = tmp_path / "reproduction.md"
    answer = CliRunner().invoke(
        reproduce.app, ["cao2015", "--json", "--markdown", str(path)]
    )
    assert answer.exit_code == 0
    rows = json.loads(answer.stdout)["cao2015"]
    assert len(rows) == 114
    assert rows[0]["case"] == "Table 2"
    assert rows[0]["agrees"]
    text = path.read_text()
    assert (
        "Aims met: 52 of 52" in text
    )  # 104 rows, of which the best of the integral and Euler tables is one
    assert "Agree with print: 84 of 86" in text


@pytest.mark.parametrize(("met", "listed"), [(True, 0), (None, 0), (False, 1)])
def test_only_aims_that_are_missed_fail(met, listed):
    row = Row("Table 1", "K, 1/s", 0.15, 0.16, 0.15, "within 1 %", met)
    assert len(missed({PAPERS[0]: [row]})) == listed
    text = page({PAPERS[0]: [row]})
    assert ("Aims met:" in text) == (met is not None)
    assert met is None or f"Aims met: {int(met)} of 1." in text


def row(printed, ours, best=None, met=None, quantity="K"):
    return Row("Table 1", quantity, printed, ours, best, "", met)


def test_a_table_that_is_not_there_gets_one_message():
    words = ["cao2015", "--table", "Table 22"]
    answer = CliRunner().invoke(reproduce.app, words)
    assert answer.exit_code == 2
    assert "Did you mean 'Table 2'" in " ".join(answer.stderr.split())


def test_one_table_of_a_paper():
    answer = CliRunner().invoke(
        reproduce.app, ["cao2015", "--table", "Table 2", "--json"]
    )
    assert answer.exit_code == 0
    rows = json.loads(answer.stdout)["cao2015"]
    assert {row["case"] for row in rows} == {"Table 2"}
    assert [row["agrees"] for row in rows] == [True] * 10 + [None]
