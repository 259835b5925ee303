"""Logs as bridges make them become trials in SI units, whatever the kind of file."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from shipgym import Trial
from tests.shipgym.one_zigzag import SPEED, sailed

DATA = Path(__file__).parents[2].parent / "shared" / "data"
FORWARD, STARBOARD = 25.0, 3.0  # the antenna, m
SHIP = sailed(240)
PSI = np.radians([one.psi for one in SHIP])
FRAME = pd.DataFrame(
    {
        "time": pd.Timestamp("2024-05-31 09:30")
        + pd.to_timedelta(np.arange(240), unit="s"),
        "psi": PSI,
        "u": np.full(240, SPEED),
        "v": np.radians([-30.0 * one.r for one in SHIP]),
        "delta": np.radians([one.rudder for one in SHIP]),
    }
)
COLUMNS = {"t": "time"} | {name: name for name in ("psi", "u", "v", "delta")}


def test_positions_of_an_antenna_become_velocities_of_midship(tmp_path):
    velocity = (FRAME.u + 1j * FRAME.v) * np.exp(1j * PSI)
    position = np.concatenate(
        [[0], np.cumsum(0.5 * (velocity[1:] + velocity.shift()[1:]))]
    )
    antenna = position + (FORWARD + 1j * STARBOARD) * np.exp(1j * PSI)
    columns = {"t": np.arange(240.0), "psi": PSI, "x": antenna.real, "y": antenna.imag}
    pd.DataFrame(columns).to_csv(tmp_path / "log.csv", index=False)
    at = {"gnss_antenna": {"forward": FORWARD, "starboard": STARBOARD}}
    trial = Trial.from_csv(tmp_path / "log.csv", sensors=at)
    assert trial.over_ground
    assert np.std(trial["u"] - FRAME.u) < 0.03
    assert np.std(trial["v"] - FRAME.v) < 0.03
    there = Trial.from_csv(tmp_path / "log.csv")
    assert np.std(there["v"] - FRAME.v) > 0.05


def test_every_kind_of_table_gives_the_same_trial(tmp_path):
    expected = Trial.from_frame(FRAME, COLUMNS)
    FRAME.to_excel(tmp_path / "log.xlsx", index=False)
    FRAME.to_parquet(tmp_path / "log.parquet")
    FRAME.to_csv(tmp_path / "log.csv", index=False)
    seconds = {"time": np.arange(240.0), "name": "x"}
    savemat(
        tmp_path / "log.mat",
        seconds | {c: FRAME[c].to_numpy() for c in FRAME.columns[1:]},
    )
    for ending in ("xlsx", "parquet", "csv", "mat"):
        trial = Trial.from_csv(tmp_path / f"log.{ending}", COLUMNS)
        for name in ("t", "psi", "u", "v", "r", "delta"):
            np.testing.assert_allclose(trial[name], expected[name], atol=1e-6)


@pytest.mark.skipif(
    not DATA.is_dir(), reason="the real log lies beside the checkout and is absent here"
)
def test_the_real_log_is_read_and_says_that_it_has_no_rudder():
    trial = Trial.from_csv(DATA / "nmea0183" / "hakefjord.txt")
    assert 1300 < trial.duration < 1320
    notes = " ".join(trial.notes)
    assert "no rudder angle in this log: without rudder nothing" in notes
    assert "set and drift" in notes


def test_a_current_that_a_speed_log_shows_is_taken_out_of_the_track():
    north, east = 0.5, -0.4
    through = (FRAME.u + 1j * FRAME.v) * np.exp(1j * PSI)
    over = through + north + 1j * east
    steps = 0.5 * (through[1:].to_numpy() + through[:-1].to_numpy())
    place = np.concatenate([[0.0], np.cumsum(steps)])
    drifted = place + (north + 1j * east) * np.arange(240.0)
    frame = FRAME[["time", "psi", "delta"]].assign(
        x=drifted.real,
        y=drifted.imag,
        sog=np.abs(over),
        cog=np.angle(over),
        stw=FRAME.u,
    )
    names = ("psi", "delta", "x", "y", "sog", "cog", "stw")
    trial = Trial.from_frame(frame, {"t": "time"} | {name: name for name in names})
    assert "removed from the sway and the track" in " ".join(trial.notes)
    np.testing.assert_allclose(trial["v"], FRAME.v, atol=0.01)
    np.testing.assert_allclose(trial["x"] + 1j * trial["y"], place, atol=2.0)
