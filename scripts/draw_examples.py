"""Draw docs/images/examples.png: the example tasks, one picture each.

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
    """An example, and how it comes to its picture."""

    name: str
    settings: dict[str, Any]
    shaft: float
    steps: int


SHOWN = (
    Shown("Encounter", {"case": 17}, 1.0, 16),
    Shown("Berth", {}, 0.35, 40),
    Shown("River", {}, 0.7, 25),
    Shown("Fairway", {"dt": 5.0}, 0.7, 80),
)


def main() -> None:
    """Write the four pictures as one."""
    montage = Image.new("RGB", (2 * SIZE, 2 * SIZE))
    for number, shown in enumerate(SHOWN):
        row, column = divmod(number, 2)
        montage.paste(picture(shown), (column * SIZE, row * SIZE))
    path = ROOT / "docs" / "images" / "examples.png"
    montage.quantize(128).save(path, optimize=True)
    print(path, path.stat().st_size, "bytes")


def picture(shown: Shown) -> Image.Image:
    """Sail an example for some steps, and draw it."""
    env = gymnasium.make(
        f"shipgym.examples:examples/{shown.name}-v0",
        render_mode="rgb_array",
        **shown.settings,
    )
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
