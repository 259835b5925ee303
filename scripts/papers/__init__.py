"""The papers' cases: as printed, as computed their way, and at best.

One file or folder per paper. Each has a `PAPER`: a citation and a function that yields
the rows of its tables.
"""

from __future__ import annotations

from importlib import import_module

from papers.row import Conclusion, Paper, Row
from shipgym.checks import check_choice

__all__ = ["PAPERS", "Conclusion", "Paper", "Row", "get_paper"]

PAPERS = ("cao2015", "xu2020", "zhu2018", "mei2019", "song2020")


def get_paper(name: str) -> Paper:
    """A paper's cases by the paper's short name.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    paper: Paper = import_module(f"papers.{check_choice(name, PAPERS, 'paper')}").PAPER
    return paper
