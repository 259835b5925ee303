"""From trials to a ship model: `identify`."""

from collections.abc import Mapping, Sequence
from typing import Any

from identification.estimators.kernel_residual import KernelResidual
from identification.estimators.threads import single_threaded
from identification.judging.uncertainty import Uncertainty
from identification.models.prior_knowledge import PriorKnowledge
from identification.pipeline.by_regression import by_regression
from identification.pipeline.options import AUTO, Given, Options, stage
from identification.pipeline.result import IdentificationResult
from identification.progress import announce
from identification.samples.preprocess import Preprocessing
from identification.samples.samples import Sampling
from shipgym import ShipModel, SteeringGear, Trial
from shipgym.ships import Structure
from shipgym.ships.structures import MMG


@single_threaded()
def identify(
    trials: Sequence[Trial],
    structure: str | Structure = "abkowitz",
    method: Any = "tls-svm",
    samples: str | Sampling = "spline",
    particulars: Given = None,
    steering: SteeringGear | None = None,
    *,
    preprocessing: str | Preprocessing = "spline",
    reference_model: str | ShipModel | None = None,
    kernel: str | KernelResidual | None = None,
    prior: str | ShipModel | PriorKnowledge | None = None,
    uncertainty: str | Uncertainty = "analytic",
    current: str | Mapping[str, float] = "auto",
    wind: str | Mapping[str, Any] = "auto",
    rudder_bias: str = "auto",
    hold_out: str | Sequence[str] = (),
    guarded: bool = True,
    name: str | None = None,
    service_shaft_speed: float | None = None,
) -> IdentificationResult:
    """Identify a manoeuvring model from recorded trials.

    `Options` documents all arguments but the trials. A stage is an object, such as
    `method=TruncatedLSSVM(rank=12)`, or the name of a default one, such as "tls-svm".

    Parameters
    ----------
    trials : sequence of Trial
        Those with `use` "fit" are fitted; they need the channels u, v, r and delta, and
        n for structures that know the shaft speed. Those marked "validate" are
        predicted, and influence no coefficient.

    Returns
    -------
    IdentificationResult
        The model, how well it predicts the trials, and how it came about.

    Raises
    ------
    InputError
        For trials that excite nothing, lack channels or samples, and for particulars
        that do not suffice.
    """
    options = Options(
        structure=structure,
        method=method,
        samples=stage(Sampling, samples),
        particulars=particulars,
        steering=steering,
        preprocessing=stage(Preprocessing, preprocessing),
        reference_model=reference_model,
        kernel=None if kernel is None else stage(KernelResidual, kernel),
        prior=None if prior is None else stage(PriorKnowledge, prior),
        uncertainty=stage(Uncertainty, uncertainty),
        current=current,
        wind=wind,
        rudder_bias=rudder_bias,
        hold_out=hold_out,
        guarded=guarded,
        name=name,
        service_shaft_speed=service_shaft_speed,
    )
    named = options.kernel is None and options.structure not in (AUTO, MMG)
    if named:
        result = by_regression(trials, options)
    else:
        from identification.pipeline.routes import identified

        announce(f"identifying {len(trials)} trials, some seconds")
        result = identified(trials, options)
    return result
