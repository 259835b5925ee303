"""One ship through time with given commands.

Each writes a state a sample into the rows of `out`, in weather followed by what is recorded of it, and
returns the last row at which the ship had not yet run away. Other passages lie in files of their own, so
that a ship is compiled for what is asked of her only.
"""

from __future__ import annotations

from typing import Any

from .compiling import kernel
from .passage import advance, felt, follow, lost, record, stored
from .weather import begin_weather


@kernel("void(float64[:, ::1], float64[::1], uint64[::1], float64[::1])")
def meet(out: Any, sky: Any, words: Any, ship: Any) -> None:
    """Begin the weather for the ship in row 0, with `words[0]` as the seed of its random numbers."""
    state = stored(out, 0)
    begin_weather(state[2], state[3], state[4], sky, words, ship, 0)
    record(out, 0, sky, ship)


@kernel("int64(float64[:, ::1], float64[:, ::1], float64, float64[::1], uint64[::1], float64[::1])")
def simulate(out: Any, commands: Any, h: float, sky: Any, words: Any, ship: Any) -> int:
    """From the state in row 0 with one row of commands (rudder, shaft speed) a step of h seconds."""
    state = stored(out, 0)
    for i in range(commands.shape[0]):
        state = advance(state, commands[i, 0], commands[i, 1], h, felt(state, sky, ship), ship)
        if lost(state, ship):
            return i
        follow(out, i + 1, state, h, sky, words, ship)
    return commands.shape[0]
