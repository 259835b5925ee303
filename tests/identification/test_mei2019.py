"""Mei 2019 again: KVLCC2 from small zigzags, and hard turns that none shows."""

from __future__ import annotations

import pytest
from papers import Row
from papers import mei2019 as mei

MARIN = pytest.mark.skipif(not mei.measured(), reason="MARIN's zigzags are not at hand")


@pytest.fixture(scope="module")
def turns() -> dict[str, Row]:
    return {row.quantity: row for row in mei.virtual_rows()}


def test_table_4_gives_its_correlations_and_the_tanker() -> None:
    found = list(mei.selection_rows())
    assert len(found) == 5
    assert all(row.met for row in found)


def test_the_turns_of_the_virtual_ship_come_within_one_per_cent(
    turns: dict[str, Row],
) -> None:
    """From zigzags of 10 and 20 degrees; the hull at another scale is 3 % off."""
    aimed = [row for name, row in turns.items() if row.aim and "tanker" not in name]
    assert [row.met for row in aimed] == 4 * [True]
    bare = [row.best for name, row in turns.items() if "bare reference" in name]
    assert len(bare) == 4
    assert all(error is not None and error < -2.5 for error in bare)


def test_their_way_errs_as_much_as_printed(turns: dict[str, Row]) -> None:
    """Printed, against measured turns: 1 and 4 per cent."""
    theirs = [abs(row.as_paper or 0.0) for row in turns.values() if row.aim]
    assert 1.0 < max(theirs) < 4.0


@MARIN
def test_the_turns_that_marin_measured() -> None:
    found = {row.quantity: row for row in mei.turn_rows(mei.measured())}
    assert [row.met for row in found.values() if row.aim] == [True, True]
    bare = found["+35 deg: tactical diameter, L, bare reference"].best
    assert bare is not None
    assert bare < 0.95 * mei.MEASURED["tactical"]


@MARIN
def test_the_zigzags_that_marin_measured() -> None:
    target = mei.measured()
    assert [row.met for row in mei.overshoot_rows(target)] == [True, True]
    found = {row.quantity: row for row in mei.figure_rows(target)}
    headings = found["correlation of headings, 20/20 zigzag"]
    assert headings.as_paper == pytest.approx(headings.printed, abs=0.003)
    for row in found.values():
        if "accelerations" in row.quantity:
            assert row.best is not None
            assert row.as_paper is not None
            assert row.best > row.as_paper > 0.94
