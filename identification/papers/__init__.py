"""The papers' cases, run again: what they print, what comes out their way, and what is best.

One file or folder per paper. Each holds a `PAPER`: a citation and a function that yields the rows of its
tables.
"""

from __future__ import annotations

from importlib import import_module

from identification.papers.row import Paper, Row
from shipgym.checks import check_choice

__all__ = ["PAPERS", "Paper", "Row", "get_paper"]

PAPERS = ("cao2015", "zhu2018", "mei2019")


def get_paper(name: str) -> Paper:
    """A paper's cases by the paper's short name.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    paper: Paper = import_module(f"identification.papers.{check_choice(name, PAPERS, 'paper')}").PAPER
    return paper
