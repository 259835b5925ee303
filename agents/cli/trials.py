"""`shipgym trials`: the standard manoeuvres of a model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from agents.cli.terminal import answer, console, progress_bars, say, warn
from shipgym.manoeuvres.quantiles import DRAWS

if TYPE_CHECKING:
    from agents.cli.standard_trials import StandardTrials


def trials_command(
    model: Annotated[
        str,
        Argument(metavar="MODEL", help="A model file, or the name of a shipped model."),
    ],
    out: Annotated[
        Path | None, Option(metavar="PLOTS.HTML", help="Write figures to this file.")
    ] = None,
    draws: Annotated[
        int, Option(min=0, help="Models drawn from an identified model's covariance.")
    ] = DRAWS,
    seed: Annotated[int, Option(min=0, help="Random seed of the draws.")] = 0,
) -> None:
    """Simulate the standard manoeuvres of a model. Assesses them by the IMO criteria.

    Zigzags, turning circles, and, with a shaft, stops. The indices of an identified
    model come with their 95 % intervals.
    """
    from agents.cli.standard_trials import standard_trials
    from agents.cli.trials_page import write_page
    from agents.output import check_page
    from shipgym.models import load_model

    ship = load_model(model)
    if out is not None:
        check_page(out, plots=True)

    with progress_bars():
        trials = standard_trials(ship, draws, seed)

    if out is not None:
        write_page(ship, trials, out)
    answer({"model": ship.name, "seed": seed, **trials.to_dict()})
    _print_trials(trials, out)
    say(f"indices are {ship.steering.remark}")


def _print_trials(trials: StandardTrials, page: Path | None) -> None:
    """Print tables of the standard manoeuvres, and where the page was written."""
    from agents.cli.tables import criteria_notes, criteria_table, manoeuvre_table
    from shipgym.manoeuvres.criteria import trials_to_run

    indices = manoeuvre_table(trials.indices)
    criteria = criteria_table(trials.criteria)
    console.print(indices)
    console.print()
    console.print(criteria)
    say(*criteria_notes(trials.criteria))
    if run_next := trials_to_run(trials.criteria):
        say(f"run next: {run_next}")
    for name, reason in trials.refused.items():
        warn(f"no {name}: {reason}")
    if page is not None:
        say(f"\nwritten: {page}")
