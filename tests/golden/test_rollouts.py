"""Episodes come to the figures that were recorded."""

import pytest

from tests.golden import rollouts
from tests.golden.record import beyond_tolerance


@pytest.mark.parametrize("case", rollouts.cases())
def test_episodes_come_to_the_golden_figures(case):
    """Figures of episodes, steps, replays and tasks are what they were when this was recorded."""
    assert beyond_tolerance("rollouts", case) == []
