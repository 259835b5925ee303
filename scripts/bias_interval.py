"""How often the 95 % intervals of rudder bias and coefficients hold the truth.

    python scripts/bias_interval.py [--logs 40] [--structure nomoto]

Logs are four zigzags of a first-order ship whose rudder is off by up to 2 deg, with
0.1 deg of noise in heading and rudder, from which the yaw rate is derived.
"""

import argparse

import numpy as np
import pandas as pd

from identification import identify
from shipgym import Particulars, ShipModel, SteeringGear, Trial
from shipgym.manoeuvres import zigzag

GAIN, TIME_CONSTANT = 0.08, 25.0  # 1/s and s
SHIP = Particulars(length=150.0, speed=7.0)


def truth(bias_deg: float) -> dict[str, float]:
    """Coefficients of a ship whose rudder is off."""
    per_rudder = GAIN / TIME_CONSTANT
    return {
        "c_0": -per_rudder * np.radians(bias_deg),
        "c_r": -1.0 / TIME_CONSTANT,
        "c_d": per_rudder,
    }


def logs(bias_deg: float, rng: np.random.Generator) -> list[Trial]:
    """Her zigzags as a bridge logs them."""
    ship = ShipModel("made", "nomoto-bias", SHIP, SteeringGear(), truth(bias_deg))
    noise_deg = 0.1
    trials = []
    for angle in (10.0, -10.0, 20.0, -20.0):
        run = zigzag(ship, abs(angle), abs(angle), angle < 0.0, 400.0, 1.0)
        columns = {"t": run.t}
        for name in ("psi", "delta"):
            noise = noise_deg * rng.standard_normal(len(run))
            columns[name] = np.degrees(run[name]) + noise
        units = {name: {"column": name, "unit": "deg"} for name in ("psi", "delta")}
        trial = Trial.from_frame(
            pd.DataFrame(columns),
            {"t": "t", **units},
            name=f"{angle:g}",
            kind="zigzag",
        )
        trials.append(trial)
    return trials


def standard_scores(structure: str, seed: int) -> dict[str, float]:
    """Errors of bias and coefficients by their standard errors."""
    rng = np.random.default_rng(seed)
    bias_deg = float(rng.uniform(-2.0, 2.0))
    found = identify(logs(bias_deg, rng), structure, particulars=SHIP)
    bias = found.metrics["rudder_bias"]
    error = bias["angle_deg"] - bias_deg
    scores = {"bias": error / bias["standard_error_deg"]}
    expected = truth(bias_deg)
    for name, standard_error in found.standard_errors.items():
        off = found.coefficients[name] - expected.get(name, 0.0)
        scores[name] = off / standard_error
    return scores


def main() -> None:
    """Print how many intervals hold."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=40)
    parser.add_argument("--structure", default="nomoto")
    given = parser.parse_args()
    rows = [standard_scores(given.structure, seed) for seed in range(given.logs)]
    table = pd.DataFrame(rows)
    for name, scores in table.items():
        known = scores.dropna()
        inside = int((known.abs() < 1.96).sum())
        print(f"{name}: {inside} of {len(known)} inside the 95 % interval")


if __name__ == "__main__":
    main()
