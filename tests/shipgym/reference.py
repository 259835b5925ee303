"""Reference manoeuvres and derivatives of published ships, where they lie beside the
checkout.
"""

from pathlib import Path

import numpy as np
import pytest

SHARED = Path(__file__).parents[3] / "shared"


def table(name: str) -> np.ndarray:
    """Rows of a reference file; skips the test where the reference data is absent."""
    path = SHARED / "reference" / name
    if not path.is_file():
        pytest.skip(
            "the reference data lies beside the checkout of the developers only"
        )
    return np.genfromtxt(path, delimiter=",", names=True)
