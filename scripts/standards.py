"""Print what docs/standards.md publishes: `python scripts/standards.py [MODEL ...]`."""

from __future__ import annotations

import sys

from agents import LQ, PreviewLQ
from agents.verification.standards import standards
from agents.verification.tracks import keep_track, track_task
from shipgym.ships import load_model


def main(names: list[str]) -> None:
    """A row for each requirement, a column for each ship."""
    found = []
    for name in names:
        ship = load_model(name)
        track = keep_track(
            PreviewLQ.from_model(ship, task=track_task(ship)), [ship, ship]
        )
        found.append(standards(ship, LQ.from_model(ship), [track]))
    for rows in zip(*found, strict=True):
        values = (
            "not simulated" if row.value is None else f"{max(row.value, 0.0):.2f}"
            for row in rows
        )
        print(" | ".join(["", rows[0].name, *values, rows[0].unit, ""]).strip())


if __name__ == "__main__":
    main(sys.argv[1:] or ["mariner", "tanker"])
