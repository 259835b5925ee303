"""Identify the models in the box again, from the trials that ship with the project.

python scripts/build_models.py [folder]       by default shipgym/models/library
"""

from __future__ import annotations

import sys
from pathlib import Path

import shipgym
from identification import IdentificationResult, identify
from shipgym.models.catalogue import LIBRARY

EXAMPLES = Path(__file__).parents[1] / "examples"


def mariner_tls_svm() -> IdentificationResult:
    """Identify the Mariner class ship from its noisy zigzags, by truncated LS-SVM on spline samples."""
    ship = shipgym.ShipFile.load(EXAMPLES / "mariner" / "ship.toml")
    return identify(
        ship.trials(), particulars=ship.particulars, steering=ship.steering, name="mariner-tls-svm"
    )


def build(folder: Path) -> None:
    """Write every identified model into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    result = mariner_tls_svm()
    result.model.save(folder / f"{result.model.name}.json")
    print(result.summary())


if __name__ == "__main__":
    build(Path(sys.argv[1]) if len(sys.argv) > 1 else LIBRARY)
