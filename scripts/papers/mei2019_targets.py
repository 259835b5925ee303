"""The target ships of Mei 2019, and the models of them in its tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.svm import SVR

from identification import RMSVM
from identification.estimators.linear import validated
from identification.models.similarity import select_reference
from identification.pipeline import identify
from identification.pipeline.result import IdentificationResult
from identification.samples.prediction import predict
from identification.samples.problem import LARGEST_RUDDER
from identification.samples.samples import build_samples
from papers.row import sampled
from shipgym.manoeuvres import turning_circle, turning_indices, zigzag, zigzag_indices
from shipgym.models import ShipModel, converted_model, load_model
from shipgym.ships import GreyBox, get_structure
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]

TANKER = "tanker"
CANDIDATES = ("mariner", "container", TANKER, "kvlcc2")  # all but the virtual ship
SHOWN = "20-starboard"  # the zigzag of Table 5 and of figures 6 and 7
STEPS_PER_SAMPLE = 4
TURN, ZIGZAG = 15.0, 20.0  # ship lengths at service speed that are simulated

DATA = Path(__file__).parents[3] / "shared" / "data" / "kvlcc2_marin"
FILES = {
    "10-starboard": "zz_-10_m",
    "10-port": "zz_10_m",
    SHOWN: "zz_-20_m",
    "20-port": "zz_20_m",
}
COLUMNS: Mapping[str, Any] = {
    "t": "t",
    "psi": "psi",
    "u": "dx0",
    "v": "dy0",
    "r": "r",
    "delta": "delta",
    "n": {"column": "rpm", "unit": "rpm"},
}


@dataclass(eq=False, repr=False)
class AsPrinted(RMSVM):
    """RM-SVM as the paper has it: a constant without penalty, bands by correlation.

    The last column is the constant, integrated over each row's window.
    """

    C: float | None = 1.0

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit to samples (n_samples, n_features) and targets (n_samples,)."""
        features, targets = validated(self, X, y)
        duration = features[:, -1]
        rows, rates = features[:, :-1] / duration[:, None], targets / duration
        centre, level = rows.mean(axis=0), rates.mean()
        scale, deviation = np.std(rows, axis=0), np.std(rates)
        scale[scale == 0.0] = 1.0
        weight = float(self.C or 1.0)
        solver = SVR(kernel="linear", C=weight / len(rows), epsilon=self.band)
        solver.fit((rows - centre) / scale, (rates - level) / deviation)
        slopes = solver.coef_.ravel() * deviation / scale
        constant = level + deviation * solver.intercept_ - centre @ slopes
        self.coef_ = np.append(slopes, constant)
        strength = len(rows) / weight * np.mean(duration) ** 2
        penalty = np.append(strength * scale**2, 0.0)
        moment = features.T @ features + np.diag(penalty)
        self.inverse_moment_ = np.linalg.pinv(moment, hermitian=True)
        return self

    def error(self, model: ShipModel, trial: Trial) -> float:
        """1 less Pearson's correlation of the simulated heading with the measured."""
        predicted = predict(model, trial)
        if predicted is None:
            return float("inf")
        headings = predicted["psi"], trial["psi"]
        if not all(np.ptp(psi) for psi in headings):
            return 1.0
        return 1.0 - float(np.corrcoef(*headings)[0, 1])


@dataclass(frozen=True, eq=False)
class Target:
    """A ship to be modelled.

    Attributes
    ----------
    ship : ShipModel
        Gives particulars and steering gear.
    trials : tuple of Trial
        Her 10/10 and 20/20 zigzags to both sides.
    shaft : float or None
        Shaft speed at service speed, 1/s; None: that at the start of the trials.
    """

    ship: ShipModel
    trials: tuple[Trial, ...]
    shaft: float | None

    @property
    def travel(self) -> float:
        """Time to sail one length at service speed, s."""
        return float(self.ship.particulars["length"] / self.ship.particulars["speed"])

    def trial(self, name: str) -> Trial:
        """One of the trials."""
        return next(trial for trial in self.trials if trial.name == name)

    def fit(self, reference: str, method: RMSVM) -> IdentificationResult:
        """RM-SVM with a reference ship."""
        return identify(
            self.trials,
            structure="grey-box",
            method=method,
            particulars=self.ship.particulars,
            steering=self.ship.steering,
            service_shaft_speed=self.shaft,
            reference_model=reference,
        )

    def bare(self, reference: str) -> ShipModel:
        """The reference ship alone, converted."""
        shaft = (
            float(np.median([t["n"][0] for t in self.trials]))
            if self.shaft is None
            else self.shaft
        )
        return converted_model(
            reference, self.ship.particulars, self.ship.steering, shaft
        )

    def turn(self, model: ShipModel, rudder_deg: float) -> dict[str, Any]:
        """Advance and tactical diameter of a turning circle, lengths."""
        dt = 0.01 * self.travel
        run = turning_circle(model, rudder_deg, duration=TURN * self.travel, dt=dt)
        found = turning_indices(run, self.ship.particulars.length)
        lengths = found.advance_lengths, found.tactical_diameter_lengths
        return {"advance": lengths[0], "tactical": lengths[1]}

    def overshoots(self, model: ShipModel) -> dict[str, Any]:
        """First and second overshoot of a 20/20 zigzag to starboard, degrees."""
        dt = 0.01 * self.travel
        run = zigzag(model, 20, 20, duration=ZIGZAG * self.travel, dt=dt)
        found = zigzag_indices(run, self.ship.particulars.length)
        angles = {"overshoot_1": found.overshoot_1_deg}
        angles["overshoot_2"] = found.overshoot_2_deg
        return angles


@cache
def virtual() -> Target:
    """The MMG model of KVLCC2 at model scale without noise, at 1 Hz at full scale."""
    ship = load_model("kvlcc2-l7")
    full_scale = load_model("kvlcc2").particulars.length
    second = float(np.sqrt(ship.particulars.length / full_scale))
    trials = []
    for angle in (10, 20):
        for side in ("starboard", "port"):
            run = zigzag(
                ship,
                angle,
                angle,
                duration=600.0 * second,
                dt=second / STEPS_PER_SAMPLE,
                port_first=side == "port",
            )
            log = sampled(run, STEPS_PER_SAMPLE, f"{angle}-{side}")
            shaft = {"n": np.full(len(log), ship.service_shaft_speed)}
            channels = {**log.channels, **shaft}
            trials.append(Trial(log.t, channels, name=log.name, kind=log.kind))
    return Target(ship, tuple(trials), ship.service_shaft_speed)


@cache
def measured() -> Target | None:
    """MARIN's zigzags scaled to the ship, every other sample, 1.08 s apart.

    None where the files are missing.
    """
    if not DATA.is_dir():
        return None
    ship = load_model("kvlcc2")
    trials = [
        Trial.from_csv(
            DATA / f"{file}.csv",
            COLUMNS,
            rudder_positive="port",
            velocity_frame="earth",
            name=name,
            kind="zigzag",
            length=ship.particulars.length,
        )
        for name, file in FILES.items()
    ]
    every_other = [sampled(run, 2, run.name, run.channels) for run in trials]
    return Target(ship, tuple(every_other), None)


@cache
def papers_way(target: Target) -> IdentificationResult:
    """The tanker as reference by pattern search on the correlation of headings."""
    return target.fit(TANKER, AsPrinted())


@cache
def our_way(target: Target, reference: str) -> IdentificationResult:
    """As reference by search on rms errors, weighted by 10/10 fits of the 20/20s."""
    return target.fit(reference, RMSVM(folds=LARGEST_RUDDER))


def same_hull() -> str:
    """The other reference ship most like the virtual ship, at full scale."""
    target = virtual()
    return select_reference(
        target.ship.particulars, tuple(target.trials[0].channels), CANDIDATES
    )[0]


def acceleration_correlations(target: Target, model: ShipModel) -> dict[str, float]:
    """Correlation of a grey box's accelerations with measured ones.

    Pearson's, of means over windows, by equation; `model` is a grey box of the target.
    """
    box, gear, shaft = model.table, model.steering, model.service_shaft_speed
    assert isinstance(box, GreyBox)
    any_table = get_structure("linear")  # the changes are those of the trials
    changes = build_samples(target.trials, any_table, model.particulars, gear=gear)
    left = build_samples(
        target.trials, box, model.particulars, gear=gear, shaft_speed=shaft
    )
    theta = np.split(
        box.acceleration_matrix(model.particulars, shaft)
        @ np.array(list(model.coefficients.values())),
        np.cumsum([len(box.equations[q]) for q in changes.targets])[:-1],
    )
    found = {}
    for (q, change), terms in zip(changes.targets.items(), theta, strict=True):
        modelled = change - left.targets[q] + left.features[q] @ terms
        found[q] = float(
            np.corrcoef(modelled / left.duration, change / left.duration)[0, 1]
        )
    return found


def heading_correlation(target: Target, fit: IdentificationResult) -> float:
    """Pearson correlation of simulated and measured heading, 20/20 to starboard."""
    prediction = fit.predictions[SHOWN]
    assert prediction is not None
    return float(np.corrcoef(prediction["psi"], target.trial(SHOWN)["psi"])[0, 1])
