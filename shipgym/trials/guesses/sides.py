"""Guess of the side to which a positive rudder steers."""

from typing import NamedTuple

from shipgym.trials.guesses.columns import ColumnGuess
from shipgym.trials.readers.cell_texts import number_with_side
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.rudder_sign import rudder_sign
from shipgym.trials.trial import Trial


class RudderSide(NamedTuple):
    """The side to which a positive rudder steers; None where it cannot be told."""

    side: str | None
    reason: str

    @property
    def choices(self) -> str:
        """What there is to decide."""
        return (
            '"starboard" or "port", the side to which the ship turns with a positive'
            f" rudder: {self.reason}"
        )


def rudder_side(
    table: LogTable, trial: Trial, column: ColumnGuess | None, *, is_turned: bool
) -> RudderSide | None:
    """Side of the rudder in a log that was read, `is_turned` with positive to port.

    None without a rudder.
    """
    has_turning = "psi" in trial
    if "delta" not in trial or not has_turning:
        return None
    if column is not None and _has_sides(table, column.column):
        return RudderSide("starboard", "the letters S and P of its values")
    psi = trial["psi"]
    delta = trial["delta"]
    found = rudder_sign(trial.t, psi, delta)
    if found.side is None:
        hint = found.side_by_hint(is_turned=is_turned)
        return RudderSide(None, f"the log does not tell{hint}")
    if not is_turned:
        return RudderSide(found.side, found.reason)
    if found.side == "port":
        return RudderSide(None, "two checks of the log contradict each other")
    return RudderSide("port", found.reason)


def _has_sides(table: LogTable, column: str) -> bool:
    """Return whether the values name their sides."""
    texts = table.texts(column)
    known = filter(None, texts)
    first = next(known, "")
    if table.decimal_comma:
        first = first.replace(",", ".")
    sided = number_with_side(first)
    return sided is not None
