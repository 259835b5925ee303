"""Learned policies command what was recorded."""

import pytest

from tests.golden import policies, refusals
from tests.golden.record import beyond_tolerance
from tests.golden.texts import same_text


@pytest.mark.parametrize("case", policies.cases())
def test_what_learned_policies_command_is_golden(case):
    """Networks command what they did when this was recorded."""
    assert beyond_tolerance("policies", case) == []


def test_what_is_refused_is_said_in_the_golden_words():
    """Numbers beyond a limit are refused, those within it accepted, in the words that were recorded."""
    assert same_text("refusals/policies", refusals.text("policies"))
