"""Page of recorded trials as they were read: facts, remarks, track and channels."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from shipgym.pages.numbers import counted
from shipgym.pages.templates import render
from shipgym.plots.style import Figure, panels
from shipgym.plots.trials import history_panel, path_figure
from shipgym.trials.trial import Trial

_CHANNELS = ("psi", "r", "delta", "u", "v", "n", "phi", "wind_speed")


class _Record(NamedTuple):
    """Content of the page's section on a trial."""

    name: str
    facts: dict[str, str]
    reading: Mapping[str, str]  # what each channel was read as, and why
    notes: tuple[str, ...]
    track: Figure | None
    history: Figure


def look_page(
    name: str,
    trials: Sequence[Trial],
    readings: Sequence[Mapping[str, str]],
    to_decide: Sequence[str] = (),
) -> str:
    """The page, as text, of the trials in a file of that name.

    `readings` say of each trial what its channels were read as, and why; `to_decide`
    are the decisions that the log leaves to its reader.
    """
    pairs = zip(trials, readings, strict=True)
    records = [_record(trial, reading) for trial, reading in pairs]
    headline, kind = verdict(trials, to_decide)
    return render(
        "shipgym.pages/look.html",
        name=name,
        headline=headline,
        kind=kind,
        records=records,
        to_decide=to_decide,
    )


def verdict(trials: Sequence[Trial], to_decide: Sequence[str]) -> tuple[str, str]:
    """A sentence on what the trials are good for; "good", "warn" or "bad"."""
    if to_decide:
        return f"{counted(len(to_decide), 'decision')} to take before use.", "bad"
    channels = {
        name
        for trial in trials
        for name, values in trial.channels.items()
        if values.min() < values.max()
    }
    if not channels & {"delta", "delta_command"}:
        return "Nothing can be identified from this: there is no rudder.", "bad"
    if not channels & {"psi", "r"}:
        return "Nothing can be identified from this: there is no heading.", "bad"
    notes = sum(len(trial.notes) for trial in trials)
    found = counted(len(trials), "trial")
    return (
        f"{found} to identify a model from, with {counted(notes, 'warning')}.",
        "warn" if notes else "good",
    )


def _record(trial: Trial, reading: Mapping[str, str]) -> _Record:
    measured = {"measured": trial}
    shown = [history_panel(measured, channel) for channel in _CHANNELS]
    histories = [panel for panel in shown if panel.traces]
    height = 150 * ((len(histories) + 1) // 2) + 70
    has_position = "x" in trial and "y" in trial
    return _Record(
        name=trial.name,
        facts=_facts(trial),
        reading=reading,
        notes=trial.notes,
        track=path_figure(measured) if has_position else None,
        history=panels(histories, height, 2),
    )


def _facts(trial: Trial) -> dict[str, str]:
    n_samples = len(trial)
    step = trial.duration / (n_samples - 1)
    velocity = "over ground" if trial.over_ground else "through the water"
    filled = []
    for name, count in trial.repaired.items():
        filled.append(f"{count} values of {name}")
    derived = sorted(trial.derived)
    return {
        "samples": f"{n_samples} over {trial.duration:.5g} s, one in {step:.4g} s",
        "channels": ", ".join(trial.channels),
        "computed from others": ", ".join(derived) or "none",
        "u and v": velocity if "u" in trial else "not known",
        "filled in": ", ".join(filled) or "none",
    }
