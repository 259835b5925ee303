"""Logs of every kind become the trials, and refusals have the words, that they once had."""

import pytest

from tests.golden.readers import QUESTIONS
from tests.golden.record import beyond_tolerance
from tests.golden.texts import same_text


@pytest.mark.parametrize("case", QUESTIONS.cases())
def test_logs_are_read_as_they_were(case):
    assert beyond_tolerance("readers", case) == []
    assert same_text(f"readers {case}", QUESTIONS.told(case))
