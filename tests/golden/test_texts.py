"""How golden texts are compared: words exactly, numbers by what is printed of them."""

import pytest

from tests.golden import texts


@pytest.mark.parametrize(
    ("golden", "found", "same"),
    [
        ("speed 7.53 m/s", "speed 7.54 m/s", True),
        ("speed 7.53 m/s", "speed 7.55 m/s", False),
        ("cost 1234.5", "cost 1235.6", True),
        ("cost 1234.5", "cost 1236.0", False),
        ("5 trials", "6 trials", False),
        ("seed 900009", "seed 900010", False),
        ("a tls-svm of 3", "a tls-svm of -3", False),
        ("2.5e-03", "2.6e-03", True),
        ("2.5e-03", "2.7e-03", False),
        ("a   9.99", "a   9.98", True),
        ("a   9.99", "a  9.99", False),  # a column has moved
        ("a   9.99", "a  10.00", True),
        ("it passes", "it fails", False),
        ("one\ntwo", "one two", False),
        ("1 and 2", "1", False),
    ],
)
def test_words_are_compared_exactly_and_numbers_to_their_last_decimal(
    golden, found, same
):
    assert texts.alike(golden, found) is same


def test_what_differs_from_run_to_run_is_left_out():
    told = (
        "written: /tmp/a-1/report.html, 2026-05-01T10:20:30 by 0123456789abcdef0123,"
        " N/m/s, in 3.1 s  \n\n"
    )
    assert (
        texts.masked(told, r"[\d.]+ s")
        == "written: <...>/report.html, DATE by HASH, N/m/s, in <...>\n"
    )


def test_a_text_that_is_not_the_golden_one_is_told_with_its_lines(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(texts, "TEXTS", tmp_path)
    monkeypatch.setenv(texts.VARIABLE, "write")
    assert texts.same_text("one", "a 1.0\nb 2.0")
    with pytest.raises(AssertionError, match="-a 1"):
        texts.same_text("one", "another of the same name")
    monkeypatch.delenv(texts.VARIABLE)
    with pytest.raises(AssertionError, match=r"-b 2\.0\n\+b 3\.0"):
        texts.same_text("one", "a 1.0\nb 3.0")


def test_the_text_of_a_page_has_its_rows_and_what_is_drawn():
    page = (
        '<p class="good">It'
        " <b>passes</b></p><table><tr><td>a</td><td>1.5</td></tr></table>"
        "<style>p {}</style>"
        '<script>Plotly.newPlot("plot-one",[{"x":[0,1,2,3,4,5,60],"y":{"dtype":"f8","bdata":"AAAAAAAA+D8="}}],'
        '{"height":300},{"responsive":true});</script>'
    )
    assert texts.page_text(page).splitlines() == [
        "<class=good> It passes",
        "| a | 1.5",
        "figure: plot-one",
        "data[0].x: 7 of 7, 0 1 3 4 60, mean 10.714",
        "data[0].y: 1 of 1, 1.5000, mean 1.5000",
        "layout: height 300",
    ]
