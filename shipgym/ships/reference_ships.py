"""What was published of the reference ships, from `reference_ships.json`."""

import json
from functools import cache
from pathlib import Path
from typing import Any


@cache
def published_ships() -> dict[str, dict[str, Any]]:
    """By name: note, source, particulars, steering, shaft speed and coefficients."""
    path = Path(__file__).with_suffix(".json")
    ships: dict[str, dict[str, Any]] = json.loads(path.read_text("utf-8"))
    return ships
