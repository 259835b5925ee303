"""What a check of a log finds, and what follows from it."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from shipgym.errors import InputError


class Proposal(NamedTuple):
    """A setting with which a log may be read instead: a channel's unit, or a convention."""

    name: str
    value: str


@dataclass(frozen=True)
class LogFinding:
    """Something in a log that cannot be right, or may be wrong.

    Attributes
    ----------
    where : str
        The file, with line and column where one value shows it.
    evidence : str
        What was expected and what was found.
    remedy : str
        What to do about it.
    proposals : tuple of Proposal
        Settings with which the log may be right, the likeliest first.
    is_remark : bool
        Whether the log may be right as it is.
    """

    where: str
    evidence: str
    remedy: str
    proposals: tuple[Proposal, ...] = ()
    is_remark: bool = False


def settle(findings: Iterable[LogFinding]) -> list[str]:
    """Remarks among findings, in words; InputError for the first that cannot be right."""
    remarks = []
    for finding in findings:
        text = f"{finding.evidence}; {finding.remedy}"
        if not finding.is_remark:
            raise InputError(f"{finding.where}: {text}", finding.proposals)
        remarks.append(text)
    return remarks
