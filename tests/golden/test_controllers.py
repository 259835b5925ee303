"""Designs and commands of controllers are the recorded ones."""

import pytest

from tests.golden import controllers
from tests.golden.record import beyond_tolerance


@pytest.mark.parametrize("case", controllers.cases())
def test_designs_and_commands_are_the_golden_ones(case):
    """Every kind designs and commands what it did when this was recorded."""
    assert beyond_tolerance("controllers", case) == []
