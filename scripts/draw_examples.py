"""Draw pictures of the example tasks and the learning tasks for docs/images.

    python scripts/draw_examples.py

The ships are steered by plain rules, to be in the middle of what there is to do.
"""

from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from PIL import Image

ROOT = Path(__file__).parents[1]
SIZE = 600  # pixels of a picture


class Shown(NamedTuple):
    """An environment, and how it comes to its picture."""

    env_id: str
    settings: dict[str, Any]
    shaft: float
    steps: int


FAIRWAY = {
    "task": str(ROOT / "examples" / "fairway.py"),
    "model": "kvlcc2",
    "action": "rudder-shaft",
    "dt": 5.0,
}
ROWS = {
    "examples": (
        Shown("shipgym.examples:examples/Berth-v0", {}, 0.35, 40),
        Shown("shipgym.examples:examples/River-v0", {}, 0.7, 25),
        Shown("shipgym:shipgym/CourseKeeping-v0", FAIRWAY, 0.7, 80),
    ),
    "encounter": (
        Shown("shipgym:shipgym/Encounter-v0", {"case": 17}, 1.0, 40),
        Shown("shipgym:shipgym/Encounter-v0", {"case": 14}, 1.0, 50),
    ),
    "unknown_ship": (
        Shown("shipgym:shipgym/UnknownShip-v0", {"speed_range": (0.6, 0.6)}, 1.0, 90),
        Shown("shipgym:shipgym/UnknownShip-v0", {"speed_range": (1.0, 1.0)}, 1.0, 90),
    ),
    "rudder_roll": (Shown("shipgym:shipgym/RudderRoll-v0", {}, 1.0, 100),),
}


def main() -> None:
    """Write them, each several pictures side by side."""
    for name, row in ROWS.items():
        montage = Image.new("RGB", (len(row) * SIZE, SIZE))
        for column, shown in enumerate(row):
            montage.paste(picture(shown), (column * SIZE, 0))
        path = ROOT / "docs" / "images" / f"{name}.png"
        montage.quantize(128).save(path, optimize=True)
        print(path, path.stat().st_size, "bytes")


def picture(shown: Shown) -> Image.Image:
    """Sail for some steps, and draw."""
    env = gymnasium.make(shown.env_id, render_mode="rgb_array", **shown.settings)
    env.reset(seed=0)
    for _ in range(shown.steps):
        _, _, terminated, truncated, _ = env.step(orders(env, shown.shaft))
        if terminated or truncated:
            break
    return Image.fromarray(env.render())


def orders(env: gymnasium.Env[Any, Any], shaft: float) -> Any:
    """Rudder to the course that the task wants, and a shaft order where it has one."""
    ship = env.unwrapped.physical_state()
    wanted = ship.get("set_point", 0.0)
    error = np.arctan2(np.sin(wanted - ship["psi"]), np.cos(wanted - ship["psi"]))
    travel_time = env.unwrapped.model.travel_time
    rudder = np.clip(1.5 * error - 0.7 * travel_time * ship["r"], -1.0, 1.0)
    given = np.array([rudder, shaft], dtype=np.float32)
    return given[: env.action_space.shape[0]]


if __name__ == "__main__":
    main()
