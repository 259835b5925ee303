"""Golden sections `demo` and `identification`: numbers at the end of whole chains."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import shipgym
from identification import identify
from identification.pipeline.options import identify_arguments, read_table
from tests.golden.store import Floats, numbers_in

ROOT = Path(__file__).parents[2]
SHIP_FILE = ROOT / "examples" / "mariner" / "ship.toml"
#: Parts of names in metrics.json that tell of the run, not of the ship.
OF_THE_RUN = ("time", "duration", "version", "path", "software")

METHODS: Mapping[str, Mapping[str, Any]] = {
    "default": {},
    "ls": {"method": "ls"},
    "abc-lssvr": {
        "method": "abc-lssvr",
        "optimiser": {"name": "abc", "rounds": 10},
        "seed": 1,
    },
    "rm-svm": {
        "structure": "grey-box",
        "method": "rm-svm",
        "reference_model": "tanker",
    },
    "output-error": {"method": "output-error"},
    "tmils": {"method": "tmils"},
    "nomoto euler": {"method": "ls", "samples": "euler", "structure": "nomoto"},
    "cv-lssvr": {"method": "cv-lssvr"},
}
#: The refinement stops when a step is small, so that its last digits depend on the way.
TOLERANCES = {"": 1e-7, "output-error: ": 1e-5}


def record_demo(_: str) -> dict[str, Floats]:
    """The numbers in the metrics of `make demo`."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "report"
        words = [
            "autopilot",
            str(SHIP_FILE),
            "--out",
            str(out),
        ]
        subprocess.run(
            [sys.executable, "-m", "agents.cli", *words],
            cwd=ROOT,
            check=True,
            capture_output=True,
            text=True,
        )
        metrics = json.loads((out / "metrics.json").read_text(encoding="utf-8"))
    return numbers_in(metrics, left_out=OF_THE_RUN)


def record_identification(method: str) -> dict[str, Floats]:
    """Coefficients of the example's ship, each with its standard error, and the errors
    of predictions."""
    ship = shipgym.ShipFile.load(SHIP_FILE)
    options = METHODS[method]
    result = identify(
        ship.trials(),
        particulars=ship.particulars,
        steering=ship.steering,
        **identify_arguments(read_table(options, "golden")),
    )
    errors = result.standard_errors
    found = {
        f"coefficient {name}": np.array([value, errors[name]])
        for name, value in result.coefficients.items()
    }
    return found | numbers_in(result.metrics, "metrics")
