"""Which ship is most like another, by its main dimensions (Mei 2019, equations 3 to 6)."""

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from shipgym import InputError, Particulars, ShipModel, load_model
from shipgym.arrays import Floats
from shipgym.checks import quoted
from shipgym.constants import GRAVITY
from shipgym.ships.catalogue import REFERENCE_SHIPS

AUTO = "auto"
#: Rudder area by length and draught of ships whose particulars lack it: Mei 2019, Table
#: 4.
RUDDER_SHARE = {"mariner": 1.0 / 83.1, "tanker": 1.0 / 61.0}
#: Correlations so close are those of one hull: the ship nearest in length is taken.
CORRELATION_TOLERANCE = 0.01
# correlation below which a reference ship is unlike a ship, and not taken unnamed
LEAST_SIMILARITY = 0.5


def similarity_vector(particulars: Particulars, printed: bool = False) -> Floats:
    """Block coefficient, L/B, B/T, inverse Froude number and rudder area by L T; nan for what is not known.

    With `printed` the fourth is L/V0 in seconds, as Mei 2019 prints it, in place of
    sqrt(g L)/V0: then a model of 7 m is like no ship at all.
    """
    L, names = (
        particulars.length,
        ("beam", "draught", "speed", "rudder_area", "block_coefficient"),
    )
    known = (particulars[name] for name in names)
    B, T, V, area, block = (
        np.nan if value is None else float(value) for value in known
    )
    time = L / V if printed else np.sqrt(GRAVITY * L) / V
    return np.array([block, L / B, B / T, time, area / (L * T)])


def correlations(
    target: ArrayLike, candidates: Mapping[str, ArrayLike]
) -> dict[str, float]:
    """Pearson correlation of each candidate's features with the target's, of shape (n_features,).

    Each feature is first divided by its 2-norm over all ships. Features that are nan
    for any ship are left out. Raises InputError if fewer than three features are known
    of all ships.
    """
    table = np.array(
        [np.asarray(target, dtype=float), *map(np.asarray, candidates.values())],
        dtype=float,
    )
    known = np.all(np.isfinite(table), axis=0)
    if known.sum() < 3:
        raise InputError(
            f"particulars: only {known.sum()} of block coefficient, L/B, B/T, L/V0 and"
            " rudder area are known, expected at least 3 to find a reference ship;"
            " give beam, draught, block_coefficient and rudder_area in [ship], or name"
            " the reference_model"
        )
    table = table[:, known] / np.linalg.norm(table[:, known], axis=0)
    return dict(zip(candidates, np.corrcoef(table)[0, 1:].tolist(), strict=True))


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
    ships = {name: load_model(name) for name in candidates}
    rolls = channels is None or {"p", "phi"} <= set(channels)
    usable = {
        name: ship
        for name, ship in ships.items()
        if rolls or "phi" not in ship.state_names
    }
    if not usable:
        raise InputError(
            f"reference_model: none of {quoted(ships)} can be evaluated at"
            f" {quoted(channels or ())}, because all of them roll; record p and phi, or"
            " allow other candidates"
        )
    vectors = {
        name: similarity_vector(_known(name, ship)) for name, ship in usable.items()
    }
    found = correlations(similarity_vector(particulars), vectors)
    least = max(found.values()) - CORRELATION_TOLERANCE
    apart = {
        n: abs(np.log(ship.particulars.length / particulars.length))
        for n, ship in usable.items()
    }
    return (
        min(
            (n for n in found if found[n] > least), key=lambda n: (apart[n], -found[n])
        ),
        found,
    )


def check_alike(name: str, similarity: float, otherwise: str) -> None:
    """Refuse the most similar reference ship where she is unlike the target; `otherwise`: what else to do."""
    if similarity < LEAST_SIMILARITY:
        raise InputError(
            "reference_model: 'auto' found, but none is like this ship; the best is"
            f" {name!r} with a similarity of {similarity:.2f}, expected at least"
            f" {LEAST_SIMILARITY:g}; {otherwise}, or name the ship all the same:"
            f" reference_model = {name!r}"
        )


def _known(name: str, ship: ShipModel) -> Particulars:
    """Particulars of a reference ship, with block coefficient and rudder area."""
    p = ship.particulars.completed()
    if p.rudder_area is None and name in RUDDER_SHARE and p.draught is not None:
        p = replace(p, rudder_area=RUDDER_SHARE[name] * p.length * p.draught)
    return p
