"""Page of recorded trials as they were read: facts, remarks, track and channels."""

from collections.abc import Sequence
from typing import NamedTuple

from shipgym.pages.templates import render
from shipgym.plots.style import Figure
from shipgym.plots.trials import history_figure, path_figure
from shipgym.trials.trial import Trial

_CHANNELS = ("psi", "r", "delta", "u", "v", "n", "phi", "wind_speed")


class _Record(NamedTuple):
    """Content of the page's section on a trial."""

    name: str
    facts: dict[str, str]
    notes: tuple[str, ...]
    track: Figure | None
    history: Figure


def look_page(name: str, trials: Sequence[Trial]) -> str:
    """The page, as text, of the trials in a file of that name."""
    records = [_record(trial) for trial in trials]
    return render("shipgym.pages/look.html", name=name, records=records)


def _record(trial: Trial) -> _Record:
    measured = {"measured": trial}
    has_position = "x" in trial and "y" in trial
    return _Record(
        name=trial.name,
        facts=_facts(trial),
        notes=trial.notes,
        track=path_figure(measured) if has_position else None,
        history=history_figure(measured, _CHANNELS),
    )


def _facts(trial: Trial) -> dict[str, str]:
    n_samples = len(trial)
    step = trial.duration / (n_samples - 1)
    velocity = "over ground" if trial.over_ground else "through the water"
    facts = {
        "samples": (
            f"{n_samples} over {trial.duration:.5g} s, {step:.4g} s apart on average"
        ),
        "channels": ", ".join(trial.channels),
        "computed from others": ", ".join(sorted(trial.derived)) or "none",
        "u and v": velocity if "u" in trial else "not known",
    }
    filled = []
    for name, count in trial.repaired.items():
        filled.append(f"{count} values of {name}")
    if filled:
        facts["filled in"] = ", ".join(filled)
    return facts
