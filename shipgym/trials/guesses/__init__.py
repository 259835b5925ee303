"""Columns, units, signs and frames of a log, guessed, each with its reason."""

from shipgym.trials.columns import ColumnGuess
from shipgym.trials.guesses.columns import guess_columns
from shipgym.trials.guesses.trials import (
    ConventionGuess,
    Decision,
    TrialGuess,
    guess_trial,
)
from shipgym.trials.rudder_sign import RudderSide

__all__ = [
    "ColumnGuess",
    "ConventionGuess",
    "Decision",
    "RudderSide",
    "TrialGuess",
    "guess_columns",
    "guess_trial",
]
