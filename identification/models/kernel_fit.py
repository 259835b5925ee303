"""Fixed-size LS-SVM with an RBF kernel on what a reference ship leaves.

Source: Suykens, Van Gestel, De Brabanter, De Moor & Vandewalle 2002, Least squares
support vector machines, chapter 6: the kernel is approximated on a few centres, here of
k-means in mirrored pairs, and the ridge regression solved in the primal, in the leading
principal components of the data in feature space.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np
from scipy.linalg import eigh
from sklearn.cluster import KMeans
from sklearn.linear_model import Ridge

from identification.arrays import column_rms
from identification.estimators.estimator import Estimators
from identification.estimators.kernel_residual import KernelResidual
from identification.estimators.lssvm import LSSVM
from identification.estimators.rm_svm import heading_error, most_regularised
from identification.samples.folds import held_out_rows
from identification.samples.samples import Samples
from shipgym import InputError, ShipModel, Trial
from shipgym.arrays import Floats, finite
from shipgym.ships import GreyBox, Structure
from shipgym.ships.kernel_boxes import (
    Kernel,
    gaussians,
    kernel_box,
    kernel_inputs,
)

MIRROR = np.array([-1.0, -1.0, -1.0, 1.0])  # of the inputs, port to starboard
INPUT_CHANNELS = ("u", "v", "r", "delta")


@dataclass(frozen=True, eq=False)
class KernelFit:
    """A kernel on what a reference ship leaves; before its fit without estimators."""

    model: ShipModel
    samples: Samples
    estimators: Estimators = field(default_factory=dict)
    report: dict[str, Any] = field(default_factory=dict)  # for the provenance


def stabilised(model: ShipModel) -> ShipModel:
    """The linear model beneath a black box, damped so that a hard turn is bounded.

    Where the kernel fades the ship is linear: she must be stable, and neither drift nor
    turn beyond any ship.
    """
    c = dict(model.coefficients)
    shift = _least_damping(c, model.steering.limit)
    c["b_v"] -= shift
    c["c_r"] -= shift
    # surge must be damped too, in the prime system
    largest = -0.05 - 2.0 * c["a_0"]
    c["a_du"] = min(c["a_du"], largest)
    return replace(model, coefficients=c)


def _least_damping(c: dict[str, float], rudder_limit: float) -> float:
    """Least damping of sway and yaw, prime system, that keeps a linear ship bounded.

    The eigenvalues of steering are, and drift and turn with the rudder hard over.
    """
    A = np.array(
        [
            [c["b_v"], c["b_r"]],
            [c["c_v"], c["c_r"]],
        ]
    )
    by_rudder = np.array([c["b_d"], c["c_d"]])
    hard_over = rudder_limit * by_rudder
    for step in range(2000):
        shift = 0.05 * step
        damped = A - shift * np.eye(2)
        steady = np.linalg.solve(damped, hard_over)
        drift, turn = np.abs(steady)
        slowest = np.linalg.eigvals(damped).real.max()
        if slowest < -0.2 and drift < 0.5 and turn < 1.2:
            return float(shift)
    raise InputError(
        "kernel: expected a linear ship beneath it that some damping stabilises, got"
        " none; check rudder and yaw rate, or name a reference_model"
    )


def fit_kernel(
    asked: KernelResidual,
    blank: ShipModel,
    trials: Sequence[Trial],
    box: GreyBox,
    channels: Sequence[dict[str, Floats]],
    build_rows: Callable[[Structure], Samples],
) -> KernelFit:
    """Fit a kernel to what the reference ship of a grey box leaves.

    Length and weight of the errors, where not given, are the smoothest whose simulated
    headings of the trials held out are within a tenth of the best; a fitted reference
    ship knows these trials.

    Parameters
    ----------
    asked : KernelResidual
        Settings.
    blank : ShipModel
        The ship; its structure is not used.
    trials : sequence of Trial
        To fit.
    box : GreyBox
        Its reference ship is beneath the kernel.
    channels : sequence of dict
        `INPUT_CHANNELS` of each trial, smoothed.
    build_rows : callable
        The regression of the trials with a structure.

    Raises
    ------
    InputError
        For too few samples.
    """
    inputs = np.concatenate([kernel_inputs(one, blank.particulars) for one in channels])
    # lengths in root mean squares of the inputs, the smoothest first
    lengths: Sequence[float] = (2.8, 2.0, 1.4, 1.0, 0.7)
    if asked.length is not None:
        lengths = (float(asked.length),)
    # weights of squared errors over a ship length
    weights: Sequence[float] = np.geomspace(0.1, 1e4, 6).tolist()
    if asked.C is not None:
        weights = (float(asked.C),)

    kernels = _kernels(inputs, asked.centres, lengths)
    stages = {}
    for length, kernel in kernels.items():
        model = _without_coefficients(blank, kernel_box(box, kernel))
        stages[length] = KernelFit(model, build_rows(model.table))

    def error(weight: float, length: float) -> float:
        return _error_held_out(stages[length], trials, weight, asked.folds)

    pairs = list(product(weights, lengths))  # the smoothest first
    best = pairs[0]
    errors = {}
    if len(pairs) > 1:
        tried = [error(*pair) for pair in pairs]
        best = most_regularised(pairs, tried)
        errors["kernel"] = tried[pairs.index(best)]
    weight, length = best
    errors["reference"] = error(0.0, length)

    kernel = kernels[length]
    report = {
        "kind": asked.kernel,
        "centres": len(kernel.centres),
        "features": kernel.basis.shape[1],
        "length": length,
        "C": weight,
        "remarks": _remarks(errors),
        "heading_errors_held_out": {
            name: finite(error) for name, error in errors.items()
        },
    }
    return replace(_fitted(stages[length], weight), report=report)


def _kernels(
    inputs: Floats,
    number: int,
    lengths: Sequence[float],
) -> dict[float, Kernel]:
    """Kernels by their length, on centres among the samples."""
    offset, scale, centres = chosen_centres(inputs, number)
    basis = np.eye(len(centres))
    kernels = {}
    for length in lengths:
        kernel = Kernel(
            offset=offset,
            scale=scale * length,
            centres=centres / length,
            basis=basis,
        )
        kernels[length] = principal(kernel, inputs)
    return kernels


def _without_coefficients(blank: ShipModel, table: Structure) -> ShipModel:
    """The ship with a table, all coefficients 0."""
    return replace(
        blank,
        structure=table.name,
        dynamics=table,
        covariance=None,
        draws=None,
        provenance=None,
        coefficients=dict.fromkeys(table.coefficient_names, 0.0),
    )


def _error_weight(stage: KernelFit, weight: float) -> float:
    """Weight of the errors of the rows, from that by ship length, prime system."""
    ship = stage.model.particulars
    window = np.mean(stage.samples.duration)
    return float(weight / (ship["length"] * window * ship["speed"] ** 3))


def _error_held_out(
    stage: KernelFit, trials: Sequence[Trial], weight: float, folds: str
) -> float:
    """Mean error of the simulated headings of what is held out.

    Weight 0 gives that of the reference ship.
    """
    C = _error_weight(stage, weight)
    errors = []
    for rows, held in held_out_rows(trials, stage.samples, folds):
        model = stage.model
        if weight:
            ridge = Ridge(1.0 / C, fit_intercept=False)
            by_equation = stage.samples.select(rows).by_equation()
            found = {q: ridge.fit(X, y).coef_ for q, X, y in by_equation}
            model = model.with_accelerations(found)
        errors.append(heading_error(model, held))
    return float(np.mean(errors))


def _fitted(stage: KernelFit, weight: float) -> KernelFit:
    """The fit to all rows."""
    C = _error_weight(stage, weight)
    estimators: Estimators = {}
    for q, X, y in stage.samples.by_equation():
        estimator = LSSVM(C=C, scale=False, fit_intercept=False)
        estimators[q] = estimator.fit(X, y)
    coefficients = {q: estimator.coef_ for q, estimator in estimators.items()}
    model = stage.model.with_accelerations(coefficients)
    return replace(stage, model=model, estimators=estimators)


def _remarks(errors: dict[str, float]) -> list[str]:
    """Remarks for the user on the errors on held-out trials."""
    if "kernel" not in errors or errors["kernel"] < errors["reference"]:
        return []
    kernel = np.degrees(errors["kernel"])
    reference = np.degrees(errors["reference"])
    return [
        "on held-out trials the kernel predicts the heading no better than its"
        f" reference ship alone ({kernel:.2g} and {reference:.2g} deg rms)"
    ]


def chosen_centres(
    x: Floats,
    number: int,
    most_samples: int = 4000,
) -> tuple[Floats, Floats, Floats]:
    """Offset and scale of inputs x, shape (n_samples, 4), and centres in these.

    Centres are those of k-means of all samples brought to one side, and their mirror
    images. Raises InputError for too few samples.
    """
    speed = x[:, 3]
    offset = np.array([0.0, 0.0, 0.0, speed.mean()])
    deviations = x - offset
    scale = np.maximum(column_rms(deviations), 0.02)  # an input may hardly change
    folded = _folded(deviations / scale)

    needed = 3 * number
    different = np.unique(folded, axis=0)
    if len(different) < needed:
        raise InputError(
            f"trials: expected at least {needed} different samples for {number} centres"
            f" of the kernel, got {len(x)} samples; add trials, or give fewer centres"
        )
    clusters = KMeans(number // 2, n_init=1, random_state=0)
    clusters.fit(_thinned(folded, most_samples))
    means = clusters.cluster_centers_
    centres = np.concatenate([means, means * MIRROR])
    return offset, scale, centres


def _folded(z: Floats) -> Floats:
    """Inputs with those of a drift to port mirrored."""
    drifts_to_port = z[:, 1:2] < 0.0
    sides = np.where(drifts_to_port, MIRROR, 1.0)
    return np.asarray(z * sides)


def principal(
    kernel: Kernel,
    x: Floats,
    most_features: int = 40,
    most_samples: int = 4000,
) -> Kernel:
    """The kernel with principal components in feature space as features.

    The leading ones of the samples x are few, so that the covariance of their
    coefficients stays small.
    """
    scaled = (x - kernel.offset) / kernel.scale
    z = _thinned(scaled, most_samples)
    mirrored = z * MIRROR
    both_sides = np.concatenate([z, mirrored])
    centres = kernel.centres
    values = gaussians(both_sides, centres)
    moment = values.T @ values / len(values)

    among_centres = gaussians(centres, centres)
    jitter = 1e-9 * np.eye(len(centres))
    _, vectors = eigh(moment, among_centres + jitter)
    leading_first = vectors[:, ::-1]
    return replace(kernel, basis=np.ascontiguousarray(leading_first[:, :most_features]))


def _thinned(x: Floats, most: int) -> Floats:
    every = max(1, -(-len(x) // most))
    return x[::every]
