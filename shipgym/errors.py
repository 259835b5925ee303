"""The errors a user of shipgym meets, each with one message that says what to do."""

from collections.abc import Sequence
from typing import Any

LONGEST_MESSAGE = 2000  # characters


class InputError(ValueError):
    """Invalid input by the user: a file, a row, a field or an argument.

    The message names the file, the row or field, the value found, what is expected, and
    the remedy. The command line prints it and exits with code 2. Of a message longer
    than `LONGEST_MESSAGE` the middle is left out: it repeats what was found, which may
    be a whole file. `instead`: what a log may be read with instead, the likely one
    first, each a channel with its unit or a convention with its value.
    """

    def __init__(self, message: str, instead: Sequence[tuple[str, str]] = ()) -> None:
        half = LONGEST_MESSAGE // 2
        long = len(message) > LONGEST_MESSAGE
        super().__init__(f"{message[:half]} ... {message[-half:]}" if long else message)
        self.instead = tuple(instead)


class UnstableModelError(RuntimeError):
    """A simulated ship left every physical range: its model runs away.

    `time_s`: simulated time at which it was noticed, s; `state`: the last physical one,
    by name in SI units.
    """

    def __init__(self, message: str, time_s: float, state: dict[str, float]) -> None:
        super().__init__(message)
        self.time_s = time_s
        self.state = state


class ManoeuvreError(RuntimeError):
    """A manoeuvre, so far in `trial`, never reached its switch heading or final speed."""

    def __init__(
        self, message: str, trial: Any
    ) -> None:  # a Trial's own file imports this one
        super().__init__(message)
        self.trial = trial
