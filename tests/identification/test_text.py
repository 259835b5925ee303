"""Tables as plain text."""

from identification.text import WIDTH, as_text, lined_table


def test_columns_are_aligned_as_their_headings_ask():
    table = lined_table("Coefficients", "name", ">value")
    table.add_row("N_r", "-1.5")
    table.add_row("a longer name", "12345.25")
    title, *lines = as_text(table).splitlines()
    assert title.rstrip() == "Coefficients"
    row = next(line for line in lines if "N_r" in line)
    assert [cell for cell in row.split("│") if cell] == [
        " N_r           ",
        "     -1.5 ",
    ]
    assert any(" value " in line and ">" not in line for line in lines)


def test_lines_of_text_are_not_broken():
    assert as_text("x" * (2 * WIDTH)) == "x" * (2 * WIDTH) + "\n"


def test_tables_are_at_most_a_hundred_characters_wide():
    table = lined_table("Words", "one", "other")
    table.add_row("x" * 70, "y" * 70)
    assert max(map(len, as_text(table).splitlines())) == WIDTH == 100
