"""Write the demo's trials: the Mariner class ship with the sensors of a sea trial.

The reference ship is steered through zigzags and a turning circle by a helmsman who
reads the noisy compass, and what the ship's sensors would have logged is written as CSV
files in everyday units, with the ship file that reads them. The same seed always gives
the same files.

    python scripts/make_demo_trials.py [folder]
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray

from shipgym import ShipModel, example_ship, load_model

Floats = NDArray[np.float64]

FOLDER = Path(__file__).parents[1] / "examples" / "mariner"
PACKAGED = (
    "zigzag_20_20.csv",
    "zigzag_35_30_port.csv",
    "zigzag_15_15.csv",
)  # what the wheel holds
SEED = 1965
STEP = 0.1  # simulation, s
SAMPLING = 0.5  # the logger, s
APPROACH = 20.0  # straight ahead before the first order, s
KNOT = 1852.0 / 3600.0  # m/s

# Standard deviations of the sensors
POSITION_NOISE = 0.5  # GNSS, m
HEADING_NOISE = 0.1  # gyro compass, deg
YAW_RATE_NOISE = 0.02  # rate gyro, deg/s
SURGE_NOISE, SWAY_NOISE = 0.03, 0.02  # Doppler log, m/s
RUDDER_RESOLUTION = 0.1  # feedback, deg

HEADER = (
    "time_s,gnss_north_m,gnss_east_m,compass_deg,log_ahead_kn,log_starboard_kn,"
    "gyro_deg_s,rudder_deg"
)
FORMATS = ("%.1f", "%.2f", "%.2f", "%.2f", "%.3f", "%.3f", "%.3f", "%.1f")

SHIP_FILE = """\
# The demo: sea trials of a Mariner class cargo ship, simulated with realistic sensor
# noise by scripts/make_demo_trials.py. Added masses are not given, as in most ships:
# they are estimated.

[ship]
name = "Mariner class cargo ship"
length = {length:.2f}
beam = {beam:.2f}
draught = {draught:.2f}
mass = {mass:.4g}
xg = {xg:.2f}
yaw_gyradius = {yaw_gyradius:.2f}
speed = {speed:.4f}  # 15 knots

[steering]
rudder_limit_deg = 40.0
rudder_rate_deg_s = 5.0
time_constant = 1.0

[columns]
t = {{ column = "time_s", unit = "s" }}
x = {{ column = "gnss_north_m", unit = "m" }}
y = {{ column = "gnss_east_m", unit = "m" }}
psi = {{ column = "compass_deg", unit = "deg" }}
u = {{ column = "log_ahead_kn", unit = "knots" }}
v = {{ column = "log_starboard_kn", unit = "knots" }}
r = {{ column = "gyro_deg_s", unit = "deg/s" }}
delta = {{ column = "rudder_deg", unit = "deg" }}

[conventions]
rudder_positive = "starboard"
velocity_frame = "body"
origin = "midship"

[identify]
structure = "abkowitz"
method = "tls-svm"
"""

TRIAL_ENTRY = """
[[trials]]
file = "{file}"
kind = "{kind}"
use = "{use}"
"""


@dataclass(frozen=True)
class Order:
    """One manoeuvre to log; a heading of None is a turning circle."""

    file: str
    use: str
    rudder_deg: float
    heading_deg: float | None
    duration: float
    course_deg: float


ORDERS = (
    Order("zigzag_10_10.csv", "fit", 10.0, 10.0, 420.0, 5.0),
    Order("zigzag_20_20.csv", "fit", 20.0, 20.0, 480.0, 352.0),
    Order("zigzag_20_10_port.csv", "fit", -20.0, 10.0, 420.0, 184.0),
    Order("zigzag_35_30_port.csv", "fit", -35.0, 30.0, 480.0, 91.0),
    Order("zigzag_15_15.csv", "validate", 15.0, 15.0, 480.0, 270.0),
    Order("turning_circle_35.csv", "validate", 35.0, None, 480.0, 2.0),
)


def sail(model: ShipModel, order: Order, rng: np.random.Generator) -> Floats:
    """Sail one manoeuvre.

    Returns
    -------
    array of shape (n_samples, 8)
        Time and the state at each tick of the logger, SI units.
    """
    heading = model.state_names.index("psi")
    state = model.service_state.copy()
    state[heading] = np.radians(order.course_deg)
    steps = round(SAMPLING / STEP)
    ticks = round((APPROACH + order.duration) / SAMPLING)
    side = 1.0
    rows = []
    for tick in range(ticks + 1):
        time = tick * SAMPLING
        rows.append([time, *state])
        compass_deg = np.degrees(state[heading]) + rng.normal(0.0, HEADING_NOISE)
        turned_deg = compass_deg - order.course_deg
        first_turn = np.sign(order.rudder_deg) * turned_deg
        if order.heading_deg is not None and side * first_turn >= order.heading_deg:
            side = -side

        rudder_deg = side * order.rudder_deg if time >= APPROACH else 0.0
        rudder = np.full((steps, 1), np.radians(rudder_deg))
        ahead = model.simulate(rudder, STEP, state)
        state = np.array([ahead[name][-1] for name in model.state_names])
    return np.array(rows)


def log(truth: Floats, rng: np.random.Generator) -> Floats:
    """What the sensors made of it, in the units of `HEADER`, shape (n_samples, 8)."""
    t, x, y, psi, u, v, r, delta = truth.T
    noise = rng.standard_normal
    columns = (
        t,
        x + POSITION_NOISE * noise(len(t)),
        y + POSITION_NOISE * noise(len(t)),
        np.mod(np.degrees(psi) + HEADING_NOISE * noise(len(t)), 360.0),
        (u + SURGE_NOISE * noise(len(t))) / KNOT,
        (v + SWAY_NOISE * noise(len(t))) / KNOT,
        np.degrees(r) + YAW_RATE_NOISE * noise(len(t)),
        np.round(np.degrees(delta) / RUDDER_RESOLUTION) * RUDDER_RESOLUTION,
    )
    return np.column_stack(columns) + 0.0


def write(folder: Path, files: Collection[str] | None = None) -> None:
    """Write the ship file and some of its trials into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    model = load_model("mariner")
    text = SHIP_FILE.format(**model.particulars)
    for number, order in enumerate(ORDERS):
        if files is not None and order.file not in files:
            continue
        rng = np.random.default_rng([SEED, number])
        logged = log(sail(model, order, rng), rng)
        np.savetxt(
            folder / order.file,
            logged,
            FORMATS,
            delimiter=",",
            header=HEADER,
            comments="",
        )
        kind = "turning-circle" if order.heading_deg is None else "zigzag"
        text += TRIAL_ENTRY.format(file=order.file, kind=kind, use=order.use)
        print(f"{folder / order.file}: {len(logged)} samples")
    (folder / "ship.toml").write_text(text, encoding="utf-8")


def main(
    folder: Annotated[
        Path | None, typer.Argument(help="By default those of the project.")
    ] = None,
) -> None:
    """Write the ship file and its trials."""
    if folder is not None:
        write(folder)
        return
    write(FOLDER)
    write(example_ship().parent, PACKAGED)


if __name__ == "__main__":
    typer.run(main)
