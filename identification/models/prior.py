"""Prior knowledge from similar ships: coefficients, and how well they are known.

Two kinds of prior. A reference ship: w0 is what the structure gives on its virtual
trials at the target's scale, and S is the moment of those trials' features, so that
this is the same as mixing samples of a reference ship's zigzags and turns into the
regression. Formulas (Clarke 1983, Kijima 1990): w0 is theirs, and S is diagonal, each
coefficient weighed by what its term contributes in a hard turn.
"""

from dataclasses import dataclass

import numpy as np

from identification.models.formulas import formula_coefficients
from identification.models.hard_turn import hard_turn_features
from identification.models.methods import fit_all, get_method
from identification.models.similarity import AUTO, select_reference
from identification.samples.samples import Samples, build_samples
from shipgym import ShipModel, Trial
from shipgym.arrays import Flags, Floats
from shipgym.manoeuvres import turning_circle, zigzag
from shipgym.models import converted_model
from shipgym.ships import GreyBox


@dataclass(frozen=True, eq=False)
class Prior:
    """Values toward which the coefficients of the SI features are pulled."""

    name: str  # the reference ship, or whose formulas
    centre: dict[str, Floats]  # w0 of each equation, shape (n_terms,)
    #: root of S per sample and second of window: S is strength^2 n_samples duration^2
    #: root' root, shape (n_rows, n_terms)
    roots: dict[str, Floats]
    #: which coefficients the prior determines; the others are free, shape (n_terms,)
    known: dict[str, Flags]


def formula_prior(formula: str, blank: ShipModel) -> Prior:
    """The prior of the formulas of Clarke 1983 or Kijima 1990.

    Arguments as in `formula_coefficients`.
    """
    ship, table = blank.particulars, blank.table
    sizes = hard_turn_features(table, ship, blank.service_shaft_speed)
    coefficients = formula_coefficients(formula, table, ship)
    prior = Prior(formula, centre={}, roots={}, known={})
    for q, (values, known) in coefficients.items():
        weights = np.diag(sizes[q])
        prior.centre[q] = values
        prior.known[q] = known
        prior.roots[q] = weights[known]
    return prior


def reference_prior(reference: str | ShipModel, blank: ShipModel) -> Prior:
    """The prior of a reference ship, from its virtual trials at the target's scale.

    In the target's structure. A model, its name or file, or "auto" for the shipped one
    most like the target, which is complete but for its coefficients. Raises InputError
    for a reference that does not exist, or too little known to choose one.
    """
    model = _at_target(reference, blank)
    box = model.table
    assert isinstance(box, GreyBox)
    return _prior_of(box.ship.name, _virtual_samples(model, blank))


def _virtual_samples(model: ShipModel, blank: ShipModel) -> Samples:
    """Regression of the target's structure on virtual trials of a reference ship."""
    return build_samples(
        virtual_trials(model),
        blank.table,
        blank.particulars,
        smoothing="none",
        gear=blank.steering,
        window=1,
        shaft_speed=blank.service_shaft_speed,
    )


def _prior_of(name: str, samples: Samples) -> Prior:
    """The prior that counts as samples of a reference ship, which determine it all."""
    least_squares = get_method("ls")
    fitted = fit_all(least_squares.make, samples)
    n_samples = len(samples)
    weight = 1.0 / (samples.duration[:, None] * np.sqrt(n_samples))

    prior = Prior(name, centre={}, roots={}, known={})
    for q, X in samples.features.items():
        weighted = X * weight
        root = np.linalg.qr(weighted, mode="r")
        n_terms = X.shape[1]
        prior.centre[q] = fitted[q].coef_
        prior.known[q] = np.ones(n_terms, dtype=bool)
        prior.roots[q] = np.asarray(root)
    return prior


def _at_target(reference: str | ShipModel, blank: ShipModel) -> ShipModel:
    """A reference ship at the target's scale: a grey box without correction."""
    ship = blank.particulars
    if reference == AUTO:
        reference, _ = select_reference(ship.completed())
    return converted_model(
        reference,
        ship,
        blank.steering,
        blank.service_shaft_speed,
    )


def reference_turns(reference: str | ShipModel, blank: ShipModel) -> list[Trial]:
    """A reference ship's turning circles at the target's scale.

    Arguments as in `reference_prior`.
    """
    model = _at_target(reference, blank)
    every_second = slice(None, None, 2)
    turns = []
    for trial in virtual_trials(model):
        if trial.kind == "turning-circle":
            turns.append(trial.part(every_second))
    return turns


def virtual_trials(model: ShipModel) -> list[Trial]:
    """Zigzags and turning circles to both sides, with the channel n.

    Up to the rudder's limit.
    """
    duration = 20.0 * model.travel_time
    dt = 0.05 * model.travel_time
    limit = model.steering.rudder_limit_deg
    zigzags = [(10.0, 10.0, False), (20.0, 20.0, True), (35.0, 20.0, False)]
    turns = (35.0, -35.0, 15.0, -15.0)

    runs = []
    for rudder, heading, port_first in zigzags:
        run = zigzag(
            model,
            rudder_deg=min(rudder, limit),
            heading_deg=heading,
            port_first=port_first,
            duration=duration,
            dt=dt,
        )
        runs.append(run)
    for rudder in turns:
        angle = np.clip(rudder, -limit, limit)
        run = turning_circle(
            model,
            rudder_deg=float(angle),
            duration=duration,
            dt=dt,
        )
        runs.append(run)
    return [_virtual(model, run, index) for index, run in enumerate(runs)]


def _virtual(model: ShipModel, run: Trial, index: int) -> Trial:
    """A run as a trial that records the state, and a shaft at service speed."""
    channels = {name: run[name] for name in model.state_names}
    channels["n"] = np.full(len(run), model.service_shaft_speed)
    return Trial(
        run.t,
        channels,
        name=f"virtual-{index}",
        kind=run.kind,
    )
