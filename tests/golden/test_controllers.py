"""Designs and commands of controllers are the recorded ones."""

import pytest

from tests.golden import controllers, refusals
from tests.golden.record import beyond_tolerance
from tests.golden.texts import same_text


@pytest.mark.parametrize("case", controllers.cases())
def test_designs_and_commands_are_the_golden_ones(case):
    """Every kind designs and commands what it did when this was recorded."""
    assert beyond_tolerance("controllers", case) == []


def test_what_is_refused_is_said_in_the_golden_words():
    """Numbers beyond a limit are refused, those within it accepted, in the words that were recorded."""
    assert same_text("refusals/controllers", refusals.text("controllers"))
