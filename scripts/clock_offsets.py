"""How often a late channel is seen in logs, where there is one and where there is none.

    python scripts/clock_offsets.py [--seeds 3]

prints the table of docs/logs.md: zigzags 20/20 and 10/10 of five reference ships and
four ships of first order in yaw, logged at 0.5, 1 and 2 Hz, with noise of 0 to 0.5
degrees in the heading and a tenth of that a second in the yaw rate, which half of the
logs do not have.
"""

from __future__ import annotations

import argparse
import sys
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

ROOT = Path(__file__).parents[1]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

from real_ships.section import table  # noqa: E402

from shipgym import ShipModel, Trial, load_model  # noqa: E402
from shipgym.errors import InputError  # noqa: E402
from shipgym.manoeuvres import zigzag  # noqa: E402
from shipgym.ships.conversions import nomoto1_ship  # noqa: E402
from shipgym.trials.late_channels import find_late_channels  # noqa: E402
from shipgym.trials.resampling import Log  # noqa: E402
from shipgym.trials.units import DEGREE  # noqa: E402

REFERENCE = ("mariner", "container", "tanker", "kvlcc2", "kvlcc2-l7")
FIRST_ORDER = {"quick": (0.15, 8.0), "small": (0.05, 12.0), "usual": (0.08, 25.0)}
FIRST_ORDER["slow"] = (0.03, 60.0)
NOISES_DEG = (0.0, 0.1, 0.2, 0.5)
RATES_HZ = (0.5, 1.0, 2.0)


class Case(NamedTuple):
    """Delays of a log, s."""

    rate: float = 0.0
    rudder: float = 0.0


CASES = {
    "none": Case(),
    "yaw rate 1.5 s late": Case(rate=1.5),
    "yaw rate 1.5 s early": Case(rate=-1.5),
    "rudder 3 s late": Case(rudder=3.0),
    "rudder 3 s early": Case(rudder=-3.0),
}


def ships() -> list[ShipModel]:
    """Ships of the study."""
    particulars = {"length": 150.0, "speed": 7.0}
    found = [load_model(name) for name in REFERENCE]
    for name, (K, T) in FIRST_ORDER.items():
        found.append(nomoto1_ship(K, T, particulars, name=name))
    return found


def zigzags(model: ShipModel) -> list[Trial]:
    """Two zigzags, of 60 ship lengths each."""
    length_time = model.particulars["length"] / model.particulars["speed"]
    settings = {"duration": 60.0 * length_time, "dt": length_time / 200.0}
    return [
        zigzag(model, rudder_deg=20, heading_deg=20, **settings),
        zigzag(model, rudder_deg=10, heading_deg=10, port_first=True, **settings),
    ]


def recorded(
    trial: Trial,
    case: Case,
    noise_deg: float,
    rate_hz: float,
    has_rate: bool,
    random: np.random.Generator,
) -> Log:
    """Log of a trial with late channels and noise."""
    t = np.arange(trial.t[0], trial.t[-1], 1.0 / rate_hz)

    def channel(name: str, late: float, noise_of_deg: float) -> np.ndarray:
        values = np.interp(t - late, trial.t, trial[name])
        return values + noise_of_deg * DEGREE * random.standard_normal(t.size)

    channels = {
        "psi": channel("psi", 0.0, noise_deg),
        "delta": channel("delta", case.rudder, 0.1),
    }
    if has_rate:
        channels["r"] = channel("r", case.rate, 0.1 * noise_deg)
    return Log(t=t, channels=channels, where="log", notes=[])


def refused(log: Log) -> dict[str, float]:
    """Delays for which a log is refused, s, by channel; NaN for a rudder's sign."""
    try:
        late = find_late_channels(log)
    except InputError:
        return {"delta": np.nan}
    return {one.channel: one.delay for one in late if not one.is_small}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=1)
    seeds = range(parser.parse_args().seeds)
    trials = [trial for model in ships() for trial in zigzags(model)]

    rows = []
    for name, case in CASES.items():
        counts = {True: 0, False: 0}
        n_logs = {True: 0, False: 0}
        errors = []
        settings = product(trials, NOISES_DEG, RATES_HZ, (True, False), seeds)
        for number, (trial, noise_deg, rate_hz, has_rate, seed) in enumerate(settings):
            if case.rate and not has_rate:
                continue
            random = np.random.default_rng([number, seed])
            log = recorded(trial, case, noise_deg, rate_hz, has_rate, random)
            found = refused(log)
            n_logs[has_rate] += 1
            counts[has_rate] += bool(found)
            channel = "r" if case.rate else "delta"
            true = case.rate or case.rudder
            if true and channel in found:
                errors.append(abs(found[channel] - true))
        rows.append(
            [
                name,
                f"{counts[True]} of {n_logs[True]}",
                f"{counts[False]} of {n_logs[False]}",
                f"{np.nanmedian(errors):.1f} s" if errors else "-",
            ]
        )
    print(table(["delay", "refused, with a yaw rate", "without", "median error"], rows))


if __name__ == "__main__":
    main()
