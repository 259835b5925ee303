"""Errors that a user of shipgym sees, each with one message that says what to do."""

from collections.abc import Sequence
from typing import Any

LONGEST_MESSAGE = 2000  # characters


class InputError(ValueError):
    """Invalid input by the user: a file, a row, a field or an argument.

    The message names the file, the row or field, what was expected, what was given, and
    the remedy. The command line prints it and exits with code 2. The middle of a
    message longer than `LONGEST_MESSAGE` is left out: it repeats the input, which may
    be a whole file. `instead`: alternatives with which a log may be read, the likely
    one first, each a channel with its unit or a convention with its value.
    """

    def __init__(self, message: str, instead: Sequence[tuple[str, str]] = ()) -> None:
        half = LONGEST_MESSAGE // 2
        if len(message) > LONGEST_MESSAGE:
            message = f"{message[:half]} ... {message[-half:]}"
        super().__init__(message)
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
    """A manoeuvre, so far in `trial`, that missed its switch heading or final speed."""

    # `Any`, because the file of `Trial` imports this one
    def __init__(self, message: str, trial: Any) -> None:
        super().__init__(message)
        self.trial = trial
