"""Fixed-size LS-SVM with an RBF kernel on what a reference ship leaves of the accelerations.

Source: Suykens, Van Gestel, De Brabanter, De Moor & Vandewalle 2002, Least squares
support vector machines, chapter 6: the kernel is approximated on a few centres, here of
k-means in mirrored pairs, and the ridge regression solved in the primal, in the leading
principal components of the data in feature space.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import eigh
from sklearn.cluster import KMeans

from identification.estimators.estimator import Estimators
from identification.estimators.lssvm import LSSVM
from identification.estimators.methods import fit_all
from identification.estimators.rm_svm import heading_error, most_regularised
from identification.regression.preprocess import smoothed_channels
from identification.regression.samples import Samples, build_samples
from identification.validation.folds import TRIALS, held_out_rows
from shipgym import InputError, ShipModel, Trial
from shipgym.arrays import Floats, finite
from shipgym.checks import check_number, check_whole
from shipgym.ships import GreyBox
from shipgym.ships.grey_boxes import GREY_BOX
from shipgym.ships.kernel_boxes import (
    RBF,
    SIZES,
    Kernel,
    gaussians,
    kernel_box,
    kernel_inputs,
)
from shipgym.trials.identify_table import AUTO, Options

OWN = (
    "kernel",
    "centres",
    "kernel_length",
    "C",
    "folds",
)  # options of the kernel alone
BLACK_BOX = "linear"  # the structure beneath a kernel where none is named
METHODS = ("tls-svm", "ls-svm", "rm-svm", "output-error", "map")
CENTRES = 64
LENGTHS = (
    2.8,
    2.0,
    1.4,
    1.0,
    0.7,
)  # of the functions, in root mean squares of the inputs
WEIGHTS = tuple(
    np.geomspace(0.1, 1e4, 6).tolist()
)  # of squared errors over a ship length
MOST_FEATURES = 40  # of each equation, so that their covariance stays small
LEAST_SCALE = 0.02  # of an input that hardly changes
MOST_SAMPLES = 4000  # among which centres are sought
MIRROR = np.array([-1.0, -1.0, -1.0, 1.0])  # of the inputs, port to starboard
# Of the linear model beneath a black box, prime system: eigenvalues of steering, drift
# and turn with the rudder hard over, damping of surge
LEAST_DAMPING, HARDEST_TURN, LEAST_SURGE_DAMPING = -0.2, (0.5, 1.2), -0.05
SHIFTS = tuple((0.05 * np.arange(2000)).tolist())  # of the damping, tried in turn
EVERY_CENTRE_NEEDS = 3  # rows of the regression


@dataclass(frozen=True, eq=False)
class KernelFit:
    """A kernel fitted to what a reference ship leaves, or before that, without estimators and report."""

    model: ShipModel
    samples: Samples
    estimators: Estimators = field(default_factory=dict)
    report: dict[str, Any] = field(default_factory=dict)  # for the provenance


def reference_options(options: Options) -> Options:
    """The options by which the reference ship beneath a kernel is identified; a grey box names hers."""
    if options.kernel != RBF:
        raise InputError(f"kernel: {options.kernel!r} found, expected {RBF!r}, or none")
    if options.method not in METHODS:
        raise InputError(
            f"kernel: {RBF!r} found with method {options.method!r}, which has none,"
            " expected method 'rm-svm' or 'ls-svm'; or leave the kernel out"
        )
    if options.regression not in (None, "ls-svm") or options.epsilon is not None:
        raise InputError(
            f"regression: epsilon-SVR found with kernel {RBF!r}, which is fitted by"
            " LS-SVM only"
        )
    structure = options.structure
    if structure in (Options.structure, AUTO):  # none was named
        structure = BLACK_BOX if options.reference_model is None else GREY_BOX
    method = (
        "ls-svm"
        if structure != GREY_BOX and options.method == "rm-svm"
        else options.method
    )
    cleared: dict[str, Any] = dict.fromkeys(OWN)
    return replace(options, structure=structure, method=method, **cleared)


def stabilised(model: ShipModel) -> ShipModel:
    """The linear model beneath a black box, damped until a hard turn that is in no trial keeps within bounds.

    Where the kernel fades the ship is linear: she must be stable, and neither drift nor
    turn beyond any ship.
    """
    c = dict(model.coefficients)
    A = np.array([[c["b_v"], c["b_r"]], [c["c_v"], c["c_r"]]])
    rudder = model.steering.limit * np.array([c["b_d"], c["c_d"]])
    for shift in SHIFTS:
        damped = A - shift * np.eye(2)
        turn = np.abs(np.linalg.solve(damped, rudder))
        if np.linalg.eigvals(damped).real.max() < LEAST_DAMPING and np.all(
            turn < HARDEST_TURN
        ):
            break
    else:
        raise InputError(
            "kernel: no damping stabilises the linear ship beneath it; check rudder and"
            " yaw rate, or name a reference_model"
        )
    c |= {"b_v": c["b_v"] - shift, "c_r": c["c_r"] - shift}
    c["a_du"] = min(c["a_du"], LEAST_SURGE_DAMPING - 2.0 * c["a_0"])
    return replace(model, coefficients=c)


def fit_kernel(
    blank: ShipModel,
    trials: Sequence[Trial],
    box: GreyBox,
    options: Options,
    sampling: Mapping[str, Any],
) -> KernelFit:
    """Fit a kernel to what the reference ship of a grey box leaves, length and weight of the errors chosen.

    Where not given these are the smoothest whose simulated headings of the trials held
    out are within a tenth of the best; a fitted reference ship knows these trials. Of
    `blank`, the ship, the structure is not used. Raises InputError for too few samples
    and settings that cannot be.
    """
    search = _Search(blank, trials, box, sampling, options.folds or TRIALS)
    kernels = _kernels(search, options)
    weights = (
        WEIGHTS if options.C is None else (check_number(options.C, "C", above=0.0),)
    )
    stages = {length: search.stage(kernel) for length, kernel in kernels.items()}
    pairs = [
        (length, weight) for weight in weights for length in stages
    ]  # the smoothest first
    (length, weight), errors = pairs[0], {}
    if len(pairs) > 1:
        tried = {pair: search.error(stages[pair[0]], pair[1]) for pair in pairs}
        length, weight = most_regularised(pairs, [*tried.values()])
        errors = {"kernel": tried[length, weight]}
    errors["reference"] = search.error(stages[length], 0.0)
    remarks, kernel = list[str](), kernels[length]
    if "kernel" in errors and not errors["kernel"] < errors["reference"]:
        remarks.append(
            "on held-out trials the kernel predicts the heading no better than its"
            f" reference ship alone ({np.degrees(errors['kernel']):.2g} and"
            f" {np.degrees(errors['reference']):.2g} deg rms)"
        )
    report = {
        "kind": RBF,
        "centres": len(kernel.centres),
        "features": kernel.basis.shape[1],
        "length": length,
        "C": weight,
        "remarks": remarks,
        "heading_errors_held_out": {k: finite(e) for k, e in errors.items()},
    }
    return replace(search.fitted(stages[length], weight), report=report)


def _kernels(search: _Search, options: Options) -> dict[float, Kernel]:
    """Kernels by their length, on centres among the samples."""
    number = CENTRES if options.centres is None else options.centres
    check_whole(number, "centres", at_least=2)
    check_number(number, "centres", at_most=SIZES[-1])
    names, smooth = ("u", "v", "r", "delta"), search.sampling["smooth"]
    channels = [smoothed_channels(trial, names, smooth) for trial in search.trials]
    x = np.concatenate(
        [kernel_inputs(one, search.blank.particulars) for one in channels]
    )
    offset, scale, centres = chosen_centres(x, number)
    given, basis = options.kernel_length, np.eye(len(centres))
    lengths = (
        LENGTHS if given is None else (check_number(given, "kernel_length", above=0.0),)
    )
    return {
        one: principal(Kernel(offset, scale * one, centres / one, basis), x)
        for one in lengths
    }


def chosen_centres(x: Floats, number: int) -> tuple[Floats, Floats, Floats]:
    """Offset and scale of inputs x, shape (n_samples, 4), and centres in these, mirrored in pairs.

    Centres are those of k-means of all samples brought to one side. Raises InputError
    for too few samples.
    """
    offset = np.array([0.0, 0.0, 0.0, x[:, 3].mean()])
    scale = np.maximum(np.sqrt(np.mean((x - offset) ** 2, axis=0)), LEAST_SCALE)
    z = (x - offset) / scale
    folded = z * np.where(z[:, 1:2] < 0.0, MIRROR, 1.0)
    if len(np.unique(folded, axis=0)) < EVERY_CENTRE_NEEDS * number:
        raise InputError(
            f"trials: {len(x)} samples found for {number} centres of the kernel,"
            f" expected at least {EVERY_CENTRE_NEEDS} different ones for each; add"
            " trials, or give fewer centres"
        )
    means = (
        KMeans(number // 2, n_init=1, random_state=0)
        .fit(_thinned(folded))
        .cluster_centers_
    )
    return offset, scale, np.concatenate([means, means * MIRROR])


def principal(kernel: Kernel, x: Floats) -> Kernel:
    """The kernel with the leading principal components of the samples x in feature space as features."""
    z = _thinned((x - kernel.offset) / kernel.scale)
    values = gaussians(np.concatenate([z, z * MIRROR]), kernel.centres)
    own = gaussians(kernel.centres, kernel.centres)
    _, vectors = eigh(values.T @ values / len(values), own + 1e-9 * np.eye(len(own)))
    return replace(
        kernel, basis=np.ascontiguousarray(vectors[:, ::-1][:, :MOST_FEATURES])
    )


def _thinned(x: Floats) -> Floats:
    return x[:: max(1, -(-len(x) // MOST_SAMPLES))]


@dataclass(frozen=True, eq=False)
class _Search:
    """Fits with different kernels and weights of the errors, and what they predict."""

    blank: ShipModel
    trials: Sequence[Trial]
    box: GreyBox
    sampling: Mapping[str, Any]
    folds: Any

    def stage(self, kernel: Kernel) -> KernelFit:
        """The regression, and the model but for its coefficients."""
        table, ship = kernel_box(self.box, kernel), self.blank.particulars
        blank = replace(
            self.blank,
            structure=table.name,
            dynamics=table,
            covariance=None,
            provenance=None,
            coefficients=dict.fromkeys(table.coefficient_names, 0.0),
        )
        given = {"shaft_speed": blank.service_shaft_speed, **self.sampling}
        return KernelFit(blank, build_samples(self.trials, table, ship, **given))

    def unit(self, samples: Samples) -> float:
        """What the weight of the errors, by ship length and in the prime system, is in SI units by row."""
        ship = self.blank.particulars
        return float(
            1.0 / (ship["length"] * np.mean(samples.duration) * ship["speed"] ** 3)
        )

    def error(self, stage: KernelFit, weight: float) -> float:
        """Mean error of the simulated headings of what is held out; 0: of the reference ship."""
        samples, C, errors = stage.samples, weight * self.unit(stage.samples), []
        for rows, held in held_out_rows(self.trials, samples, self.folds):
            found: dict[str, Floats] = {}
            for q, X in samples.select(rows).features.items():
                moment = X.T @ X * C + np.eye(X.shape[1])
                found[q] = np.linalg.solve(
                    moment, C * (X.T @ samples.targets[q][rows])
                ).astype(float)
            errors.append(
                heading_error(stage.model.with_accelerations(found), held, "rmse")
            )
        return float(np.mean(errors))

    def fitted(self, stage: KernelFit, weight: float) -> KernelFit:
        """The fit to all rows."""
        samples, C = stage.samples, weight * self.unit(stage.samples)
        estimators = fit_all(
            partial(LSSVM, C=C, scale=False, fit_intercept=False), samples
        )
        model = stage.model.with_accelerations(
            {q: one.coef_ for q, one in estimators.items()}
        )
        return KernelFit(model, samples, estimators)
