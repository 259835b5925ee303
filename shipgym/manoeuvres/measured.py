"""Indices of the criteria that a trial measures, each with its standard error.

They are read from a smoothed heading and track: the largest of noisy samples reads
high. Source of the smoothing: Reinsch 1967, Smoothing by spline functions.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import make_smoothing_spline
from scipy.special import ndtr

from shipgym.arrays import Floats
from shipgym.checks import (
    bounded,
    check_choice,
    check_table,
    check_text,
    keep_numbers,
    placed,
    read_fields,
    unexpected,
)
from shipgym.errors import InputError
from shipgym.manoeuvres.execution import first_held, rudder, usual_rudder
from shipgym.manoeuvres.imo_rules import RULES, Rule
from shipgym.manoeuvres.turning import full_rudder_deg, turning_indices
from shipgym.manoeuvres.zigzags import (
    STANDARD_DEG,
    course_error_deg,
    switch_heading_deg,
    zigzag_indices,
)
from shipgym.models.ship_model import ShipModel
from shipgym.trials.trial import Trial


@dataclass(frozen=True)
class MeasuredIndex:
    """An index that a trial measures."""

    value: float = bounded()  # ship lengths or degrees
    error: float = bounded(at_least=0.0)  # its standard error
    side: str = ""  # to which the rudder was ordered first, "starboard" or "port"
    #: by the model with the trial's own rudder, which no helmsman moves as a standard
    #: manoeuvre has it
    predicted: float | None = bounded(None)

    def __post_init__(self) -> None:
        keep_numbers(self)
        check_choice(self.side, ("starboard", "port"), "side")

    def __str__(self) -> str:
        return f"{self.value:.2f}±{self.error:.2f} {self.side}"

    def share_below(self, limit: float) -> float:
        """Probability that the ship's own index is within a limit."""
        if self.error == 0.0:
            return float(self.value <= limit)
        return float(ndtr((limit - self.value) / self.error))


def measured_by(
    model: ShipModel, trials: Sequence[Trial], simulated: Mapping[str, Trial | None]
) -> list[tuple[str, MeasuredIndex]]:
    """Criteria that trials measure, each by its name, in the order of the trials.

    `simulated`: trials by the model, by name.
    """
    found = list[tuple[str, MeasuredIndex]]()
    for trial in trials:
        found += measured_indices(model, trial, simulated.get(trial.name)).items()
    return found


def measured_in_file(model: ShipModel) -> list[tuple[str, MeasuredIndex]]:
    """Criteria that the trials of an identified model measured, by its file.

    Raises InputError for indices that do not fit the trials of the file.
    """
    provenance = model.provenance or {}
    table = provenance.get("measured", {})
    place = f"{model.name}: provenance.trials"
    fitted = provenance.get("trials", [])
    if not isinstance(fitted, list):
        raise unexpected(place, "a list of tables", fitted)
    trials = [
        check_text(check_table(trial, place).get("name"), f"{place} name")
        for trial in fitted
    ]
    where = f"{model.name}: provenance.measured"
    found = list[tuple[str, MeasuredIndex]]()
    for trial, indices in check_table(table, where, trials).items():
        named = check_table(indices, f"{where} {trial}", RULES)
        if len({RULES[name].manoeuvre for name in named}) > 1:
            wanted = "indices of one manoeuvre, as a trial is"
            raise unexpected(f"{where} {trial}", wanted, list(named))
        for name, given in named.items():
            place = f"{where} {trial} {name}"
            with placed(place, " "):
                found.append((name, read_fields(MeasuredIndex, given, place)))
    return found


def measured_indices(
    model: ShipModel, trial: Trial, simulated: Trial | None = None
) -> dict[str, MeasuredIndex]:
    """Criteria that a trial measures, by name; none for another manoeuvre.

    `simulated`: the same trial by the model.
    """
    if trial.kind not in ("zigzag", "turning-circle") or not _at_speed(model, trial):
        return {}
    try:
        manoeuvre = _manoeuvre_of(model, trial)
        rules = {
            name: rule for name, rule in RULES.items() if rule.manoeuvre == manoeuvre
        }
        found = _with_errors(model, trial, rules)
        predicted = _values(model, simulated, rules) if simulated and found else {}
    except InputError:  # a channel such as the position is missing
        return {}
    return {
        name: replace(index, predicted=predicted.get(name))
        for name, index in found.items()
    }


def _with_errors(
    model: ShipModel, trial: Trial, rules: dict[str, Rule]
) -> dict[str, MeasuredIndex]:
    """Indices of the smoothed trial, and errors by repeating its noise."""
    fewest_samples = 5  # for a smoothing spline
    if not rules or len(trial) < fewest_samples:
        return {}
    # Motions that last so long are halved, those of ten ship lengths kept to 3e-5.
    period = 0.7 * model.travel_time
    smooth, noise = smoothed(trial, period)
    values = _values(model, smooth, rules)
    repetitions = _repetitions(smooth, noise, period)
    repeated = [_values(model, again, rules) for again in repetitions]
    found = {}
    is_starboard = rudder(trial)[first_held(trial)] > 0.0
    side = "starboard" if is_starboard else "port"
    for name, value in values.items():
        scatter = np.std([again.get(name, value) for again in repeated])
        unseen = _unseen_error(model, smooth, noise, rules[name])
        found[name] = MeasuredIndex(value, float(np.hypot(scatter, unseen)), side)
    return found


def _values(model: ShipModel, trial: Trial, rules: dict[str, Rule]) -> dict[str, float]:
    """Values of the rules that the trial reached."""
    length = model.particulars["length"]
    indices: Any
    if trial.kind == "zigzag":
        _, _, heading_deg = next(iter(rules.values())).manoeuvre.rpartition("/")
        indices = zigzag_indices(
            trial,
            length,
            float(heading_deg),
        )
    else:
        indices = turning_indices(trial, length)
    values = {name: getattr(indices, rule.index) for name, rule in rules.items()}
    return {name: value for name, value in values.items() if value is not None}


def smoothed(trial: Trial, period: float) -> tuple[Trial, dict[str, float]]:
    """Trial with a smooth heading and track, and the noise of each channel.

    `period`: of motions that are halved, s.
    """
    t = trial.t
    # degrees of freedom of the spline, of each sample: the mean of its low pass
    freedom = np.pi * _step(t) / (np.sqrt(2.0) * period)
    kept = np.sqrt(1.0 - min(freedom, 0.9))

    smooth = {}
    noise = {}
    for name in ("psi", "x", "y"):
        if name not in trial:
            continue
        smooth[name] = _low_pass(
            name,
            t,
            trial[name],
            period,
        )
        noise[name] = float(np.std(trial[name] - smooth[name]) / kept)
    return trial.with_channels(smooth), noise


def _low_pass(
    name: str,
    t: Floats,
    values: Floats,
    period: float,
) -> Floats:
    """Smoothing spline along the first axis that halves motions of a period, s.

    The heading is continued before the start by its mirror image: a spline is straight
    at its ends, a heading is not where a trial begins with the order.
    """
    frequency = 2.0 * np.pi / period  # rad/s
    penalty = 1.0 / (_step(t) * frequency**4)
    times = t
    if name == "psi":
        start = t[0]
        end = np.searchsorted(t, start + period)
        mirrored = slice(int(end), 0, -1)
        before = 2.0 * start - t[mirrored]
        times = np.concatenate([before, t])
        values = np.concatenate([values[mirrored], values])

    spline = make_smoothing_spline(
        times,
        values,
        lam=penalty,
    )
    return np.asarray(spline(t))


def _repetitions(smooth: Trial, noise: dict[str, float], period: float) -> list[Trial]:
    """A smooth trial as it would have been with other noise, smoothed likewise."""
    rng = np.random.default_rng(0)
    repetitions = 30
    shape = (len(smooth), repetitions)
    left = {
        name: _low_pass(name, smooth.t, size * rng.standard_normal(shape), period)
        for name, size in noise.items()
    }

    trials = []
    for k in range(repetitions):
        channels = {name: smooth[name] + left[name][:, k] for name in noise}
        trials.append(smooth.with_channels(channels))
    return trials


def _unseen_error(
    model: ShipModel,
    trial: Trial,
    noise: dict[str, float],
    rule: Rule,
) -> float:
    """Error of an index that repeated noise does not show.

    Of headings: the helmsman counted from a course of his own near that of the
    approach. Of lengths: the order is known to one sample, and satellite positions
    wander slowly, by about twice their noise.
    """
    if rule.unit == "deg":
        return course_error_deg(trial)
    length = model.particulars["length"]
    step = _step(trial.t)
    speed = model.particulars["speed"]
    of_order = step * speed / np.sqrt(12.0)
    wander = 0.0
    if rule.manoeuvre == "turning circle":
        wander = 2.0 * noise.get("x", 0.0)
    return float(np.hypot(of_order, wander) / length)


def _step(t: Floats) -> float:
    """Usual sampling step, s."""
    return float(np.median(np.diff(t)))


def _at_speed(model: ShipModel, trial: Trial) -> bool:
    """Return whether a trial begins at service speed, to a tenth."""
    if "u" not in trial or "v" not in trial:
        return False
    service = model.particulars["speed"]
    first = np.hypot(trial["u"][0], trial["v"][0])
    return bool(abs(first / service - 1.0) <= 0.1)


def _manoeuvre_of(model: ShipModel, trial: Trial) -> str | None:
    """Manoeuvre of the rules that a trial is, to a degree; None for another."""
    rudder_deg = float(np.degrees(usual_rudder(trial)))
    if trial.kind == "turning-circle":
        off = abs(rudder_deg - full_rudder_deg(model))
        return "turning circle" if off <= 1.0 else None
    heading_deg = switch_heading_deg(trial) or 0.0
    for angle in STANDARD_DEG:
        if max(abs(rudder_deg - angle), abs(heading_deg - angle)) <= 1.0:
            return f"zigzag {angle:.0f}/{angle:.0f}"
    return None
