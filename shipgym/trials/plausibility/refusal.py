"""The refusal of a log, with the settings with which it may be read instead."""

from typing import NamedTuple

from shipgym.errors import InputError


class Proposal(NamedTuple):
    """A setting to read a log with instead: a channel's unit, or a convention."""

    name: str
    value: str


def implausible(
    where: str, evidence: str, remedy: str, *proposals: Proposal
) -> InputError:
    """Make the error for a log that cannot be right.

    Parameters
    ----------
    where : str
        The file, with line and column where one value shows it.
    evidence : str
        What was expected and what was found.
    remedy : str
        What to do about it.
    *proposals : Proposal
        Settings with which the log may be right, the likeliest first.
    """
    return InputError(f"{where}: {evidence}; {remedy}", proposals)
