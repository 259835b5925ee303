import json
from pathlib import Path

import pytest
import reproduce
from papers import PAPERS, Conclusion, Row, get_paper
from papers.markdown import page
from papers.page import missed
from papers.row import aims
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


@pytest.mark.parametrize(
    ("printed", "ours", "agrees"),
    [
        (156.0, 148.3, True),
        (156.0, 210.9, False),
        (0.0, 0.4, True),
        (0.0, 0.6, False),
        (-0.0382, -0.0383, True),
        (4.035e-06, 5.984e-06, False),
        (None, 1.0, None),
        (1.0, None, None),
    ],
)
def test_ours_agrees_with_print_within_a_tenth_or_its_rounding(printed, ours, agrees):
    assert row(printed, ours).agrees is agrees


def test_an_aim_counts_once_however_many_rows_show_its_number():
    shown = [
        row(None, 1.0, 0.25, True),
        row(None, 2.0, 0.25, True, "T"),
        row(None, 1.0, 0.5, False),
    ]
    assert aims(shown) == (1, 2)
    assert aims([row(None, 1.0, 18.0, True), row(None, 1.0, 18.0, True, "T")]) == (
        2,
        2,
    )  # counts, not measured
    assert aims([row(None, None, 0.25, True), row(None, None, 0.25, False)]) == (0, 1)


def test_a_conclusion_is_what_its_rows_show():
    conclusion = Conclusion(
        "K is small", ("Table 1: K",), lambda found: found.as_paper < 1.0
    )
    assert conclusion.verdict([row(None, 0.5)]) == "confirmed"
    assert conclusion.verdict([row(None, 2.0)]) == "contradicted"
    assert (
        conclusion.verdict([row(1.0, None)]) == conclusion.verdict([]) == "not testable"
    )
    assert Conclusion("K is nice").verdict([row(None, 0.5)]) == "not testable"


@pytest.mark.parametrize("name", PAPERS)
def test_the_page_tells_of_every_conclusion_what_became_of_it(name):
    text = (Path(__file__).parents[2] / "docs" / "reproduction.md").read_text()
    section = text.partition(f"\n## {name}\n")[2].partition("\n## ")[0]
    conclusions = get_paper(name).conclusions
    assert len(conclusions) >= 3
    for conclusion in conclusions:
        told = section.partition(f"| {conclusion.statement} | ")[2]
        verdict = told.partition(" |")[0]
        assert verdict in ("confirmed", "contradicted", "not testable")
        assert (verdict == "not testable") == (conclusion.holds is None)


def test_what_was_put_in_or_picked_is_counted_apart():
    shown = [
        Row("Table 1", "K", 1.0, 1.0, None),
        Row("Table 1", "T", 1.0, 1.0, None, basis="put in"),
        Row("Table 1", "C", 1.0, 1.0, None, basis="picked"),
        Row("Table 2", "K", 1.0, 1.0, None, basis="counted elsewhere"),
    ]
    text = page({PAPERS[0]: shown})
    assert "Agree with print: 1 of 1. By construction: 2." in text


@pytest.mark.parametrize(
    ("options", "nearest"),
    [
        (["--table", "Table 22"], "Table 2"),
        (["--row", "X_u: eror, %"], "X_u: error, %"),
    ],
)
def test_a_table_or_row_that_is_not_there_gets_one_message(options, nearest):
    answer = CliRunner().invoke(reproduce.app, ["cao2015", *options])
    assert answer.exit_code == 2
    assert f"Did you mean '{nearest}'" in " ".join(answer.stderr.split())


def test_one_table_of_a_paper():
    answer = CliRunner().invoke(
        reproduce.app, ["cao2015", "--table", "Table 2", "--json"]
    )
    assert answer.exit_code == 0
    rows = json.loads(answer.stdout)["cao2015"]
    assert {row["case"] for row in rows} == {"Table 2"}
    assert [row["agrees"] for row in rows] == [True] * 10 + [None]


def test_the_page_begins_with_what_became_of_each_paper():
    shown = [
        Row("Table 1", "K", 1.0, 1.05, 0.3, "", True),
        Row("Table 2", "K", 1.0, 2.0, 0.3, "", True),
    ]
    lines = page({PAPERS[0]: shown}).splitlines()
    untestable = len(get_paper(PAPERS[0]).conclusions)
    assert (
        f"| [cao2015](#cao2015) | 0 | 0 | {untestable} | 1 of 2 |  | 1 of 1 |" in lines
    )
