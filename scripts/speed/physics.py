"""Manoeuvres, without tasks and environments."""

import shipgym
from speed.measure import MODEL, Row, best_time


def zigzag_run() -> Row:
    """A 20/20 zigzag of 600 s at 0.1 s, the Trial included."""
    ship = shipgym.load_model(MODEL)
    shipgym.manoeuvres.zigzag(ship, 20.0, 20.0)
    seconds = best_time(lambda: shipgym.manoeuvres.zigzag(ship, 20.0, 20.0), 20)
    return Row(
        "zigzag 20/20, 600 s at 0.1 s", f"{1e3 * seconds:.1f} ms", "", None, "5 ms"
    )
