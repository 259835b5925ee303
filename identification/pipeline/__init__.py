"""From trials to a ship model: `identify`."""

import inspect
from collections.abc import Sequence
from typing import Any

from identification.estimators.threads import single_threaded
from identification.pipeline.by_regression import by_regression
from identification.pipeline.options import (
    AUTO,
    Options,
    identify_arguments,
    read_table,
)
from identification.pipeline.result import IdentificationResult, with_provenance
from identification.progress import announce
from identification.samples.problem import named_apart
from identification.samples.still_water import in_still_water
from shipgym import Trial
from shipgym.ships.structures import MMG


@single_threaded()
def identify(
    trials: Sequence[Trial], *arguments: Any, **options: Any
) -> IdentificationResult:
    """Identify a manoeuvring model from recorded trials.

    The other arguments are those of `Options`, which documents them: structure, method,
    samples, particulars and steering, also by their place, and others by name; settings
    of a method or a stage by name too, such as ``objective="k-fold"``.

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
    asked = Options(*arguments, **_read(options))
    marked, sea = in_still_water(
        named_apart(trials),
        asked.particulars,
        asked.current,
        asked.wind,
    )
    if asked.kernel is None and asked.structure not in (AUTO, MMG):
        result = by_regression(marked, asked)
    else:
        from identification.pipeline.choice import identified

        announce(f"identifying {len(marked)} trials, some seconds")
        result = identified(
            marked,
            asked,
        )
    return with_provenance(result, sea)


def _read(options: dict[str, Any]) -> dict[str, Any]:
    """Arguments of `Options`; settings of stages may be named as in a ship file."""
    if options.keys() <= inspect.signature(Options).parameters.keys():
        return options
    ship = {"particulars", "steering"} & options.keys()
    about_ship = {name: options.pop(name) for name in ship}
    return about_ship | identify_arguments(read_table(options, "identify"))


_TRIALS = inspect.signature(identify).parameters["trials"]
identify.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
    [_TRIALS, *inspect.signature(Options).parameters.values()],
    return_annotation=IdentificationResult,
)
