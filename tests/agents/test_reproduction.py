import json

import pytest
import reproduce
from papers import CASES, PAPERS, Row
from papers.page import missed, page, papers_of
from papers.requirements import REQUIREMENTS
from typer.testing import CliRunner

from agents.cli import app, reproduction


def test_a_paper_that_is_not_known_gets_one_message(capfd):
    """Through the command `shipgym`, which runs the program of the checkout."""
    answer = CliRunner().invoke(app, ["reproduce", "cao2051"])
    assert answer.exit_code == 2
    assert "Did you mean 'cao2015'" in capfd.readouterr().err


def test_an_installed_package_says_where_the_tables_are_made(monkeypatch, tmp_path):
    monkeypatch.setattr(reproduction, "SCRIPT", tmp_path / "reproduce.py")
    answer = CliRunner().invoke(app, ["reproduce", "xu2020"])
    assert answer.exit_code == 2
    assert "checkout" in answer.stderr
    assert "python scripts/reproduce.py xu2020" in answer.stderr


def test_rows_for_programs_and_the_page_for_readers(tmp_path):
    path = tmp_path / "reproduction.md"
    answer = CliRunner().invoke(reproduce.app, ["cao2015", "--json", "--markdown", str(path)])
    assert answer.exit_code == 0
    rows = json.loads(answer.stdout)["cao2015"]
    assert len(rows) == 104
    assert rows[0]["case"] == "Table 2"
    text = path.read_text()
    assert "Aims met: 104 of 104" in text
    assert text.count("| Table 3 |") == 15


@pytest.mark.parametrize(("met", "listed"), [(True, 0), (None, 0), (False, 1)])
def test_only_aims_that_are_missed_fail(met, listed):
    row = Row("Table 1", "K, 1/s", 0.15, 0.16, 0.15, "within 1 %", met)
    assert len(missed({PAPERS[0]: [row]})) == listed
    assert f"{[0, 1][met is True]} of {[0, 1][met is not None]}." in page({PAPERS[0]: [row]})


def test_all_are_the_papers_and_the_requirements():
    assert papers_of("all") == CASES == (*PAPERS, "requirements")
    assert papers_of("xu2020") == ("xu2020",)


def test_the_page_tells_of_each_requirement_why_it_holds_and_what_shows_it():
    text = page({"requirements": [Row("R7", "gap", None, None, 0.0, "below 1e-9", True)]})
    table = [line for line in text.splitlines() if line.startswith("| R")]
    assert [line.split()[1] for line in table] == [one.name for one in REQUIREMENTS] + ["R7"]
    unescaped = [line.replace("\\|", "") for line in table]
    assert [line.count("|") for line in unescaped[:8]] == [6] * 8
    for line, one in zip(table, REQUIREMENTS, strict=False):
        assert all(f"`{test}`" in line for test in one.tests)


def test_a_note_stands_once_below_the_table_and_is_pointed_at():
    rows = [
        Row("Table 1", q, 1.0, 1.0, 1.0, note=note) for q, note in zip("abc", ("x|y", "", "x|y"), strict=True)
    ]
    lines = page({PAPERS[0]: rows}).splitlines()
    cells = [line.split("|")[-2].strip() for line in lines if line.startswith("| Table 1")]
    assert cells == ["1", "", "1"]
    assert lines.count("1. x|y") == 1
