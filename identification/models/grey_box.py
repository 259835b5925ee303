"""The reference ship of a grey box."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

from identification.models.similarity import select_reference
from shipgym import InputError, Particulars, ShipModel, Trial
from shipgym.models import grey_box
from shipgym.ships import GreyBox


def chosen_box(
    reference: str | ShipModel | None,
    particulars: Particulars,
    trials: Sequence[Trial],
) -> tuple[GreyBox, dict[str, float]]:
    """The grey box of a reference ship.

    Also returns the correlations of the candidates where she was not named.

    Parameters
    ----------
    reference : str, ShipModel or None
        A model, its name or file; "auto" or None chooses the one most like the target
        by `select_reference`.
    particulars : Particulars
        Of the target.
    trials : sequence of Trial
        Of the target; they tell whether its shaft speed and roll are known.
    """
    recorded: set[str] = set()
    if trials:
        recorded = set.intersection(*(set(trial.channels) for trial in trials))

    similarity: dict[str, float] = {}
    if reference in (None, "auto"):
        with suppress(InputError):  # too little may be known to estimate the rest
            particulars = particulars.completed()
        reference, similarity = select_reference(particulars, recorded)
        least, found = 0.5, similarity[reference]
        if found < least:
            raise InputError(
                "reference_model: 'auto' expected a ship like this one, with a"
                f" similarity of at least {least:g}, got {reference!r} with {found:.2f}"
                ' as the best; choose structure "abkowitz" or "cubic", or name the ship'
                f" all the same: reference_model = {reference!r}"
            )
    box = grey_box(reference)
    has_shaft = box.shaft and "n" in recorded
    return replace(box, shaft=has_shaft), similarity
