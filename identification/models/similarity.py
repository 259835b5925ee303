"""The ship most like another, by its main dimensions (Mei 2019, equations 3 to 6)."""

from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from identification.arrays import by_name
from shipgym import InputError, Particulars, ShipModel, Trial, load_model
from shipgym.arrays import Floats
from shipgym.models import grey_box
from shipgym.models.catalogue import REFERENCE_SHIPS
from shipgym.ships import GreyBox
from shipgym.ships.particulars import with_estimates


def similarity_vector(particulars: Particulars) -> Floats:
    """What ships are compared by, shape (5,); nan for what is not known.

    Block coefficient, length by beam, beam by draught, inverse Froude number, and
    rudder area by length and draught. Mei 2019 prints the fourth as L/V0 in seconds,
    with which a model of 7 m is like no ship at all; here it is sqrt(g L)/V0.
    """
    names = ("block_coefficient", "beam", "draught", "speed", "rudder_area")
    known = (particulars[name] for name in names)
    C_b, B, T, V, A = (np.nan if value is None else float(value) for value in known)
    L = particulars.length
    return np.array([C_b, L / B, B / T, np.sqrt(9.81 * L) / V, A / (L * T)])


def correlations(
    target: ArrayLike, candidates: Mapping[str, ArrayLike]
) -> dict[str, float]:
    """Pearson correlation of each candidate's features with the target's.

    Features have the shape (n_features,). Each is first divided by its 2-norm over all
    ships. Features that are nan for any ship are left out. Raises InputError if fewer
    than three features are known of all ships.
    """
    table = np.array([target, *candidates.values()], dtype=float)
    known = np.isfinite(table).all(axis=0)
    n_known = int(known.sum())
    if n_known < 3:
        raise InputError(
            "particulars: expected at least 3 of block coefficient, L/B, B/T, L/V0 and"
            f" rudder area to find a reference ship, got {n_known}; give beam,"
            " draught, block_coefficient and rudder_area in [ship], or name the"
            " reference_model"
        )

    features = table[:, known]
    norms = np.linalg.norm(features, axis=0)
    scaled = features / norms
    between_ships = np.corrcoef(scaled)
    with_target = between_ships[0, 1:]
    return by_name(candidates, with_target)


def select_reference(
    particulars: Particulars,
    channels: Collection[str] | None = None,
    candidates: Collection[str] = tuple(REFERENCE_SHIPS),
) -> tuple[str, dict[str, float]]:
    """The shipped reference ship most like a ship.

    `particulars`: of the target; `channels`: recorded of the target: a reference ship
    that rolls needs p and phi; `candidates`: names of models to choose from. Returns
    the name of the ship with the highest correlation, of hulls of one form that nearest
    in length, and the correlations of all candidates. Raises InputError if too little
    is known of the target.
    """
    with_roll = channels is None or {"p", "phi"} <= set(channels)
    ships, vectors = {}, {}
    for name in candidates:
        ship = load_model(name)
        if with_roll or "phi" not in ship.state_names:
            ships[name] = ship
            vectors[name] = similarity_vector(_with_rudder_area(name, ship))
    similarity = correlations(
        similarity_vector(particulars),
        vectors,
    )

    same_hull = 0.01  # correlations so close are those of one hull form
    least = max(similarity.values()) - same_hull
    alike = [name for name in similarity if similarity[name] > least]

    def distance(name: str) -> tuple[float, float]:
        """Distance of the lengths; of one length the most similar comes first."""
        scale = ships[name].particulars.length / particulars.length
        return abs(float(np.log(scale))), -similarity[name]

    return min(alike, key=distance), similarity


def _with_rudder_area(name: str, ship: ShipModel) -> Particulars:
    """Particulars of a reference ship, completed; rudder area by Mei 2019, Table 4."""
    by_length_and_draught = {"mariner": 1.0 / 83.1, "tanker": 1.0 / 61.0}

    p = ship.particulars.completed()
    if p.rudder_area is not None or p.draught is None:
        return p
    if name not in by_length_and_draught:
        return p
    area = by_length_and_draught[name] * p.length * p.draught
    return replace(
        p,
        rudder_area=area,
    )


def with_usual_hull(ship: Particulars | Mapping[str, Any]) -> Particulars:
    """Particulars with absent beam, draught and block coefficient of a usual hull.

    A beam of L / 6.2, a draught of B / 2.7 and a block coefficient of 0.75 lie between
    those of tankers and container ships; marked as estimated. A mass that was given
    leads to the block coefficient. Boats below 30 m differ too much, and keep what is
    known.
    """
    if not isinstance(ship, Particulars):
        ship = Particulars.from_mapping(ship)
    shortest = 30.0
    if ship.length < shortest:
        return ship
    return with_estimates(
        ship,
        {
            "beam": lambda known: known.length / 6.2,
            "draught": lambda known: known.require("beam") / 2.7,
            "block_coefficient": _usual_block,
        },
    )


def _usual_block(known: Particulars) -> float:
    """Block coefficient by the mass where it is known, of ships as they are."""
    if known.mass is None:
        return 0.75
    box = known.length * known.require("beam") * known.require("draught")
    density = known.water_density or 1025.0
    return min(max(known.mass / (density * box), 0.4), 0.9)


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
