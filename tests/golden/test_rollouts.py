"""Episodes come to the figures that were recorded."""

import pytest

from tests.golden import refusals, rollouts
from tests.golden.record import beyond_tolerance
from tests.golden.texts import same_text


@pytest.mark.parametrize("case", rollouts.cases())
def test_episodes_come_to_the_golden_figures(case):
    """Figures of episodes, steps, replays and tasks are what they were when this was recorded."""
    assert beyond_tolerance("rollouts", case) == []


def test_what_is_refused_is_said_in_the_golden_words():
    """Numbers beyond a limit are refused, those within it accepted, in the words that were recorded."""
    assert same_text("refusals/rollouts", refusals.text("rollouts"))
