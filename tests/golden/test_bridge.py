"""What stands on a bridge orders, shows and sends what was recorded."""

import pytest

from tests.golden import policies
from tests.golden.record import beyond_tolerance
from tests.golden.texts import same_text


@pytest.mark.parametrize("case", policies.BRIDGE)
def test_what_is_ordered_and_measured_is_golden(case):
    """Autopilots, routes, helms and instruments give the numbers they gave when this was recorded."""
    assert beyond_tolerance("bridge", case) == []


@pytest.mark.parametrize("name", policies.TEXTS)
def test_what_is_exported_and_sent_is_golden(name):
    """Sentences of NMEA 0183 are what they were when this was recorded."""
    assert same_text(f"bridge/{name.replace(' ', '-')}", policies.texts(name))
