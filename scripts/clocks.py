"""How often a synchronous log of a tanker is refused for its clock.

`python scripts/clocks.py [--seeds 20] [--late 0]` sails zigzags 10/10 and 20/20 of five
tankers at 1 Hz, with five levels of noise of heading and yaw rate, and counts the logs
of which the clock of the yaw rate is refused (docs/logs.md).
"""

import argparse
from collections.abc import Iterator

import numpy as np

from shipgym import InputError, load_model
from shipgym.arrays import Floats
from shipgym.manoeuvres import zigzag
from shipgym.trials.late_channels import find_late_channels, is_corrected
from shipgym.trials.resampling import Log
from shipgym.trials.units import DEGREE

#: Models, and lengths in m to which they are scaled by Froude's law.
TANKERS = {"tanker": (180.0, 325.0, 400.0), "kvlcc2": (200.0, 325.0)}
#: Noise of the heading, deg, and of the yaw rate, deg/s.
NOISES = ((0.2, 0.02), (0.5, 0.1), (1.0, 0.02), (1.0, 0.1), (0.2, 0.1))


def runs() -> Iterator[tuple[str, dict[str, Floats]]]:
    """Zigzags at 1 Hz: name, and time, heading, yaw rate and rudder in SI units."""
    for name, lengths in TANKERS.items():
        ship = load_model(name)
        duration = 35.0 * ship.travel_time
        step = ship.travel_time / 200.0
        for angle in (10, 20):
            run = zigzag(ship, angle, angle, duration=duration, dt=step)
            for length in lengths:
                slower = np.sqrt(length / ship.particulars["length"])
                t = slower * run.t
                clock = np.arange(0.0, min(t[-1], 3600.0))
                channels = {
                    name: np.interp(clock, t, run[name]) for name in run.channels
                }
                channels["r"] = channels["r"] / slower
                yield (
                    f"{name} of {length:g} m, {angle}/{angle}",
                    {"t": clock, **channels},
                )


def is_refused(run: dict[str, Floats], late: float, seed: int, level: int) -> bool:
    """Return whether a log with noise, its yaw rate `late` s, is refused."""
    of_heading, of_rate = NOISES[level]
    rng = np.random.default_rng([seed, level])
    t = run["t"]
    noise = DEGREE * rng.standard_normal((2, t.size))
    channels = {
        "psi": run["psi"] + of_heading * noise[0],
        "r": np.interp(t - late, t, run["r"]) + of_rate * noise[1],
        "delta": run["delta"],
    }
    log = Log(t, channels, "log", [])
    try:
        for one in find_late_channels(log):
            is_corrected(one, None, "log", is_one_clock=True)
    except InputError:
        return True
    return False


def main() -> None:
    """Count and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--late", type=float, default=0.0, help="of the yaw rate, s")
    given = parser.parse_args()
    refused = logs = 0
    for name, run in runs():
        found = [
            is_refused(run, given.late, seed, level)
            for seed in range(given.seeds)
            for level in range(len(NOISES))
        ]
        refused += sum(found)
        logs += len(found)
        print(f"{name}: {sum(found)} of {len(found)} refused", flush=True)
    print(f"{refused} of {logs} refused")


if __name__ == "__main__":
    main()
