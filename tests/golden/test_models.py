"""Ships move, convert, scale and are read as they once did, and refusals have the words that they had."""

import pytest

from tests.golden import models
from tests.golden.answers import words
from tests.golden.record import beyond_tolerance
from tests.golden.texts import same_text


@pytest.mark.parametrize("case", models.cases())
def test_ships_are_what_they_were(case):
    assert beyond_tolerance("models", case) == []
    assert same_text(f"models {case}", "\n".join(words(models.answers(case))))
