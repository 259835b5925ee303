"""Fixed-size LS-SVM with an RBF kernel on what a reference ship leaves.

Source: Suykens, Van Gestel, De Brabanter, De Moor & Vandewalle 2002, Least squares
support vector machines, chapter 6: the kernel is approximated on a few centres, here of
k-means in mirrored pairs, and the ridge regression solved in the primal, in the leading
principal components of the data in feature space.
"""

from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import eigh
from sklearn.cluster import KMeans

from identification.arrays import column_rms
from identification.estimators.kernel_residual import KernelResidual
from identification.estimators.linear import Estimators
from identification.estimators.lssvm import LSSVM
from identification.estimators.rm_svm import heading_error, most_regularised
from identification.models.guard import with_coefficients
from identification.models.methods import fit_all
from identification.samples.preprocess import smoothed_channels
from identification.samples.problem import Problem, held_out_rows
from identification.samples.samples import Samples
from shipgym import InputError, ShipModel
from shipgym.arrays import Floats, finite
from shipgym.ships import GreyBox
from shipgym.ships.kernel_boxes import Kernel, gaussians, kernel_box, kernel_inputs

MIRROR = np.array([-1.0, -1.0, -1.0, 1.0])  # of the inputs, port to starboard
INPUT_CHANNELS = ("u", "v", "r", "delta")
MOST_SAMPLES = 4000  # of those that choose the centres and the components


class KernelFit(NamedTuple):
    """A kernel on what a reference ship leaves."""

    model: ShipModel
    samples: Samples
    estimators: Estimators
    report: dict[str, Any]  # for the provenance


class _Stage(NamedTuple):
    """A kernel of one length, and the regression of its coefficients."""

    kernel: Kernel
    blank: ShipModel
    samples: Samples

    def fitted(self, weight: float, rows: Any = slice(None)) -> Estimators:
        """The fit to some rows, by the weight of the errors over a ship length."""
        ship = self.blank.particulars
        window = np.mean(self.samples.duration)
        C = float(weight / (ship["length"] * window * ship["speed"] ** 3))
        make = partial(LSSVM, C=C, scale=False, fit_intercept=False)
        return fit_all(make, self.samples.select(rows))

    def model(self, estimators: Estimators) -> ShipModel:
        """The ship with what was fitted."""
        return with_coefficients(self.blank, estimators)


def fit_kernel(
    asked: KernelResidual,
    blank: ShipModel,
    problem: Problem,
    box: GreyBox,
) -> KernelFit:
    """Fit a kernel to what the reference ship of a grey box leaves.

    Length and weight of the errors, where not given, are the smoothest whose simulated
    headings of the trials held out are within a tenth of the best; a fitted reference
    ship knows these trials. Raises InputError for too few samples.

    Parameters
    ----------
    asked : KernelResidual
        Settings.
    blank : ShipModel
        The ship; its structure is not used.
    problem : Problem
        The trials to fit, and how they become a regression.
    box : GreyBox
        Its reference ship is beneath the kernel.
    """
    trials, smoothing = problem.used, problem.sampling["smoothing"]
    channels = [smoothed_channels(one, INPUT_CHANNELS, smoothing) for one in trials]
    inputs = np.concatenate([kernel_inputs(one, blank.particulars) for one in channels])
    # lengths in root mean squares of the inputs, the smoothest first
    lengths = (2.8, 2.0, 1.4, 1.0, 0.7) if asked.length is None else (asked.length,)
    weights = np.geomspace(0.1, 1e4, 6) if asked.C is None else (asked.C,)
    stages = {
        length: _stage(blank, box, _kernel(inputs, asked.centres, length), problem)
        for length in lengths
    }

    def error(weight: float, length: float) -> float:
        """Mean error of the simulated headings of trials held out."""
        stage, errors = stages[length], []
        for rows, held in held_out_rows(trials, stage.samples):
            model = stage.blank
            if weight:
                model = stage.model(stage.fitted(weight, rows))
            errors.append(heading_error(model, held))
        return float(np.mean(errors))

    pairs = list(product(map(float, weights), lengths))  # the smoothest first
    errors = {}
    weight, length = pairs[0]
    if len(pairs) > 1:
        tried = [error(*pair) for pair in pairs]
        weight, length = most_regularised(pairs, tried)
        errors["kernel"] = tried[pairs.index((weight, length))]
    errors["reference"] = error(0.0, length)

    chosen = stages[length]
    report = {
        "kind": asked.kernel,
        "length": length,
        "C": weight,
        "centres": len(chosen.kernel.centres),
        "features": chosen.kernel.basis.shape[1],
        "remarks": _remarks(errors),
        "heading_errors_held_out": {name: finite(one) for name, one in errors.items()},
    }
    estimators = chosen.fitted(weight)
    return KernelFit(
        chosen.model(estimators),
        chosen.samples,
        estimators,
        report,
    )


def _stage(blank: ShipModel, box: GreyBox, kernel: Kernel, problem: Problem) -> _Stage:
    """A kernel on a reference ship, with the regression of its coefficients."""
    table = kernel_box(box, kernel)
    ship = replace(
        blank,
        structure=table.name,
        dynamics=table,
        covariance=None,
        draws=None,
        provenance=None,
        coefficients=dict.fromkeys(table.coefficient_names, 0.0),
    )
    return _Stage(kernel, ship, problem.rows_of(table, ship))


def _remarks(errors: dict[str, float]) -> list[str]:
    """Remarks for the user on the errors on held-out trials."""
    if errors.get("kernel", 0.0) < errors["reference"]:
        return []
    kernel, reference = np.degrees([errors["kernel"], errors["reference"]])
    return [
        "on held-out trials the kernel predicts the heading no better than its"
        f" reference ship alone ({kernel:.2g} and {reference:.2g} deg rms)"
    ]


def _kernel(x: Floats, number: int, length: float) -> Kernel:
    """A kernel of a length for inputs x, shape (n_samples, 4).

    Centres are those of k-means of all samples brought to one side, and their mirror
    images. Features are the leading principal components in feature space, so that the
    covariance of their coefficients stays small. Raises InputError for too few samples.
    """
    offset = np.array([0.0, 0.0, 0.0, x[:, 3].mean()])
    scale = np.maximum(column_rms(x - offset), 0.02)  # an input may hardly change
    scaled = (x - offset) / scale
    drifts_to_port = scaled[:, 1:2] < 0.0
    folded = np.where(drifts_to_port, scaled * MIRROR, scaled)
    if len(np.unique(folded, axis=0)) < 3 * number:
        raise InputError(
            f"trials: expected at least {3 * number} different samples for {number}"
            f" centres of the kernel, got {len(x)} samples; add trials, or give fewer"
            " centres"
        )
    every = -(-len(x) // MOST_SAMPLES)
    clusters = KMeans(
        number // 2,
        n_init=1,
        random_state=0,
    ).fit(folded[::every])
    means = clusters.cluster_centers_
    centres = np.concatenate([means, means * MIRROR]) / length

    samples = scaled[::every] / length
    values = gaussians(np.concatenate([samples, samples * MIRROR]), centres)
    among_centres = gaussians(centres, centres) + 1e-9 * np.eye(len(centres))
    _, vectors = eigh(values.T @ values / len(values), among_centres)
    basis = np.ascontiguousarray(vectors[:, ::-1][:, :40])
    return Kernel(
        offset=offset,
        scale=scale * length,
        centres=centres,
        basis=basis,
    )
