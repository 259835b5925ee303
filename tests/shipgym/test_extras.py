"""Libraries of extras: given where they are installed, named with their extra where
they are not."""

import sys

import numpy as np
import pytest

from shipgym import InputError
from shipgym.extras import library


def test_a_library_is_given_or_named_with_what_needs_it(monkeypatch):
    assert library("numpy", "any") is np
    monkeypatch.setitem(sys.modules, "plotly.subplots", None)
    told = (
        r"^plotly is not installed, figures need it: pip install 'shipgym\[report\]'$"
    )
    with pytest.raises(InputError, match=told) as caught:
        library("plotly.subplots", "report", "figures need it")
    assert isinstance(caught.value.__cause__, ModuleNotFoundError)
    with pytest.raises(
        InputError, match=r"^nowhere is not installed: pip install 'shipgym\[x\]'$"
    ):
        library("nowhere.part", "x")
