"""From trials to a ship model: `identify`."""

import inspect
from collections.abc import Sequence
from typing import Any

from identification.estimators.threads import single_threaded
from identification.pipeline.by_regression import by_regression
from identification.pipeline.options import AUTO, Options
from identification.pipeline.result import IdentificationResult
from identification.progress import announce
from shipgym import Trial
from shipgym.ships.structures import MMG


@single_threaded()
def identify(
    trials: Sequence[Trial], *arguments: Any, **options: Any
) -> IdentificationResult:
    """Identify a manoeuvring model from recorded trials.

    The other arguments are those of `Options`, which documents them: structure, method,
    samples, particulars and steering, also by their place, and others by name.

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
    asked = Options(
        *arguments,
        **options,
    )
    if asked.kernel is None and asked.structure not in (AUTO, MMG):
        return by_regression(trials, asked)

    from identification.pipeline.routes import identified

    announce(f"identifying {len(trials)} trials, some seconds")
    return identified(trials, asked)


_TRIALS = inspect.signature(identify).parameters["trials"]
identify.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
    [_TRIALS, *inspect.signature(Options).parameters.values()],
    return_annotation=IdentificationResult,
)
