"""Learned policies command what was recorded."""

import pytest

from tests.golden import policies
from tests.golden.record import beyond_tolerance


@pytest.mark.parametrize("case", policies.cases())
def test_what_learned_policies_command_is_golden(case):
    """Networks command what they did when this was recorded."""
    assert beyond_tolerance("policies", case) == []
