"""Run the commands of `docs/tutorial.md` and put output and pictures into it.

`python scripts/tutorial.py [FOLDER]`; the folder keeps the log, the ship file and all
that is written.

The log is that of a simulated ship, as a bridge would have written it: time of the day,
latitude and longitude of an antenna forward of midship, heading, and the rudder
positive to port, in a current.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Annotated

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import typer

ROOT = Path(__file__).parents[1]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

import shipgym  # noqa: E402 - the folder above has to be found first
from agents.identifying import identification_settings, identify_ship  # noqa: E402
from shipgym import Current, Trial, Weather, manoeuvres  # noqa: E402
from tests.ships.mmg import mmg_ship  # noqa: E402

PAGE = ROOT / "docs" / "tutorial.md"
IMAGES = PAGE.parent / "images" / "tutorial"
SIZE, DPI = (6.4, 3.4), 110  # inches, dots an inch
STYLE = {
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "font.size": 9,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
}
SEA = Weather(current=Current(0.39, towards_deg=120.0))
ANTENNA = 30.0  # m forward of midship
LATITUDE, LONGITUDE, EARTH = 54.2, 7.6, 6371e3  # degrees north and east, m
BEGINS = pd.Timestamp("2026-05-04 09:00")
#: A shell block, and the output behind it, which is replaced.
BLOCK = re.compile(
    r"```sh\n(?P<command>.*?)```\n(?P<output>\n```text\n.*?```\n)?", re.DOTALL
)
#: What is shown of the output of commands that print much: so many lines from one that
#: begins so.
SHOWN = {
    "look": {"": 5, "written": 1},
    "identify": {"": 7, "circle_35.csv, ": 1, "Open-loop": 12, "Worst": 1},
    "trials": {"Manoeuvres": 6, "IMO": 16},
    "autopilot": {"unstable draws": 1, "Autopilots": 5, "report": 1},
}


def write_logs(folder: Path) -> None:
    """Two zigzags and two turning circles of a container ship, a CSV file each."""
    ship = mmg_ship("kcs")
    runs = {
        "zigzag_10": manoeuvres.zigzag(ship, 10, 10, duration=900, weather=SEA),
        "zigzag_20": manoeuvres.zigzag(ship, 20, 20, True, duration=900, weather=SEA),
        "circle_35": manoeuvres.turning_circle(ship, 35, duration=900, weather=SEA),
        "circle_port": manoeuvres.turning_circle(ship, -25, duration=900, weather=SEA),
    }
    for k, (name, run) in enumerate(runs.items()):
        logged(run, k).to_csv(folder / f"{name}.csv", index=False)


def logged(run: Trial, number: int) -> pd.DataFrame:
    """What the bridge writes down, once a second."""
    rng = np.random.default_rng(number)
    rows = slice(None, None, 10)
    psi = run["psi"][rows]
    north = run["x"][rows] + ANTENNA * np.cos(psi) + rng.normal(0.0, 0.4, len(psi))
    east = run["y"][rows] + ANTENNA * np.sin(psi) + rng.normal(0.0, 0.4, len(psi))
    clock = BEGINS + pd.to_timedelta(run.t[rows] + 3600.0 * number, unit="s")
    return pd.DataFrame(
        {
            "Time (UTC)": clock.strftime("%Y-%m-%dT%H:%M:%SZ"),
            "Latitude": np.round(LATITUDE + np.degrees(north / EARTH), 7),
            "Longitude": np.round(
                LONGITUDE + np.degrees(east / EARTH / np.cos(np.radians(LATITUDE))), 7
            ),
            "Heading (deg)": np.round(
                (np.degrees(psi) + rng.normal(0.0, 0.1, len(psi))) % 360.0, 1
            ),
            "Rudder (deg)": np.round(-np.degrees(run["delta"][rows]), 1) + 0.0,
            "Shaft (rpm)": np.round(60.0 * run["n"][rows], 1),
        }
    )


def run_command(command: str, folder: Path) -> str:
    """Output of a command without needless lines."""
    done = subprocess.run(
        command,
        shell=True,
        cwd=folder,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env=environment(),
    )
    if done.returncode:
        raise SystemExit(f"{command}: exit code {done.returncode}\n{done.stdout}")
    lines = [line.rstrip() for line in done.stdout.splitlines() if line.strip()]
    return "\n".join(shortened(lines, SHOWN.get(command.split()[1], {"": len(lines)})))


def shortened(lines: list[str], wanted: dict[str, int]) -> list[str]:
    """The lines that are wanted, with dots for those between."""
    shown: list[str] = []
    end = 0
    for begins, count in wanted.items():
        first = next(k for k, line in enumerate(lines) if line.startswith(begins))
        first = max(first, end)
        shown += ["..."] * (first > end) + lines[first : first + count]
        end = first + count
    return shown + ["..."] * (end < len(lines))


def environment() -> dict[str, str]:
    """Environment of this process: 100 columns, no colours, its own programs first."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return os.environ | {
        "COLUMNS": "100",
        "NO_COLOR": "1",
        "TERM": "dumb",
        "PATH": path,
    }


def edited(ship: str, wanted: str) -> str:
    """A ship file with a user's lines in it, each key in its place."""
    head, *trials = ship.split("[[trials]]")
    wishes, *of_trials = wanted.split("[[trials]]")
    head = _with_lines(head, wishes)
    for lines in of_trials:
        file, rest = lines.strip().split("\n", 1)
        trials = [_with_lines(one, rest) if file in one else one for one in trials]
    return "[[trials]]".join([head, *trials])


def _with_lines(text: str, lines: str) -> str:
    for line in lines.strip().splitlines():
        key = line.split(" = ")[0]
        text, count = re.subn(
            rf"^(# )?{key} = .*$", line, text, count=1, flags=re.MULTILINE
        )
        if not count:
            raise SystemExit(f"{key}: not in the ship file")
    return text


def pictures(folder: Path) -> None:
    """Draw what the commands found."""
    IMAGES.mkdir(parents=True, exist_ok=True)
    model = shipgym.load_model(str(folder / "my_ship" / "model.json"))
    trials = identify_again(folder)
    with mpl.rc_context(STYLE):
        plt.figure(figsize=SIZE, dpi=DPI, layout="constrained")
        for label, run in trials.items():
            plt.plot(
                run.t,
                np.degrees(run["r"]),
                "0.6" if label == "measured" else "C3",
                label=label,
            )
        plt.ylim(-1.2, 0.2)
        _save("prediction", "yaw rate, deg/s")
        plt.figure(figsize=SIZE, dpi=DPI, layout="constrained")
        runs = [
            manoeuvres.zigzag(one, 20, 20, duration=500)
            for one in model.sample(60, seed=0)
        ]
        band = np.percentile(
            np.degrees([run["psi"] for run in runs]), [2.5, 97.5], axis=0
        )
        best = manoeuvres.zigzag(model, 20, 20, duration=500)
        plt.fill_between(best.t, *band, alpha=0.3, label="95 % of the models")
        plt.plot(best.t, np.degrees(best["psi"]), label="identified")
        plt.plot(best.t, np.degrees(best["delta"]), color="0.7", label="rudder")
        plt.ylim(-35, 45)
        _save("zigzag", "heading and rudder, deg")


def identify_again(folder: Path) -> dict[str, Trial]:
    """The trial held out, measured and predicted, as the report has them."""
    ship = shipgym.ShipFile.load(folder / "ship.toml")
    result = identify_ship(ship, identification_settings(ship, {}))
    trial = next(one for one in result.trials if one.use == "validate")
    prediction = result.predictions[trial.name]
    assert prediction is not None
    return {"measured": trial, "predicted": prediction}


def _save(name: str, quantity: str) -> None:
    plt.xlabel("t, s"), plt.ylabel(quantity), plt.legend(ncols=3)
    plt.savefig(IMAGES / f"{name}.webp", pil_kwargs={"quality": 80})
    plt.close()


def main(folder: Path) -> None:
    """Run the page from top to bottom and write it anew."""
    write_logs(folder)
    text = PAGE.read_text(encoding="utf-8")
    wanted = re.search(r"```toml\n(.*?)```", text, re.DOTALL)
    assert wanted is not None

    def done(found: re.Match[str]) -> str:
        shown = run_command(found["command"].strip(), folder)
        print(found["command"], shown, sep="\n", flush=True)
        if "new-ship" in found["command"]:
            path = folder / "ship.toml"
            path.write_text(
                edited(path.read_text(encoding="utf-8"), wanted[1]), encoding="utf-8"
            )
        return f"```sh\n{found['command']}```\n" + (
            f"\n```text\n{shown}\n```\n" if shown else ""
        )

    PAGE.write_text(BLOCK.sub(done, text), encoding="utf-8")
    pictures(folder)


def run(
    folder: Annotated[
        Path | None, typer.Argument(help="Keeps all files; by default none are.")
    ] = None,
) -> None:
    """Run the tutorial in a folder; docs/tutorial.md and its pictures are rewritten."""
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        main(folder.resolve())
        return
    with tempfile.TemporaryDirectory() as made:
        main(Path(made))


if __name__ == "__main__":
    typer.run(run)
