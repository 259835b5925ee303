"""Cao 2015, tables 2 to 7: the Mariner's 40 derivatives from its 15/15 zigzag, by sample structure.

500 s without noise, simulated with steps of 0.1 s and sampled every 0.5 s; the derivatives are identified
from the samples alone and compared with those of the simulated ship.
"""

from __future__ import annotations

import numpy as np
from rich.console import Console
from rich.table import Table

import shipgym
from identification import identify
from shipgym import Trial, manoeuvres


def sampled_zigzag() -> Trial:
    """The paper's trial."""
    trial = manoeuvres.zigzag(shipgym.load_model("mariner"), 15, 15, duration=500, dt=0.1, switch="step")
    channels = {name: trial[name][::5] for name in ("x", "y", "psi", "u", "v", "r", "delta")}
    return Trial(trial.t[::5], channels, name="zigzag 15/15", kind="zigzag", length=trial.length)


def main() -> None:
    """Identify with each sample structure and print how far off the derivatives are."""
    truth = shipgym.load_model("mariner")
    table = Table("samples", "within 1 %", "median error, %", "largest error, %", "of")
    for samples in ("euler", "integral", "spline"):
        result = identify([sampled_zigzag()], samples=samples, particulars=truth.particulars)
        errors = {
            name: 100.0 * abs(result.coefficients[name] / value - 1.0)
            for name, value in truth.coefficients.items()
        }
        worst = max(errors, key=errors.__getitem__)
        within = sum(error < 1.0 for error in errors.values())
        median = np.median(list(errors.values()))
        table.add_row(samples, f"{within} of 40", f"{median:.2g}", f"{errors[worst]:.3g}", worst)
    Console().print(table)


if __name__ == "__main__":
    main()
