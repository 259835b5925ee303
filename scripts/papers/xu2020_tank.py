"""The captive tests of Xu et al. 2020 in a virtual tank, and their reduction.

The ship is Table 11's; her mass, the amplitudes and periods of the tests and the noise
are not printed. The steps are those of section 5: by type of test the terms to start
from, printed with their standard errors. A coefficient that an equation shares with
another (Y_vdot in X and N, X_udot in Y and N, ...) is known from the step before, so
sway and yaw alone come before the second step of surge.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from identification.design.reduction import Reduction, backward_elimination
from papers.captive import FORCES, ForceRegression, force_regression, oscillate
from shipgym.models import ShipModel
from shipgym.ships import get_structure
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]

PMM18: Any = get_structure("pmm18")
PMM38: Any = get_structure("pmm38")
#: Table 11: the reduced model of the ship towed at SINTEF Ocean, prime system.
TABLE_11 = {
    "X_udot": -1.04e-2,
    "X_uuu": -2.67e-4,
    "X_uvv": -9.29e-3,
    "X_rvu": 5.84e-2,
    "X_urr": -1.22e-3,
    "Y_vdot": -3.82e-2,
    "Y_rdot": -2.66e-4,
    "Y_uuv": -6.16e-2,
    "Y_v|v|": -1.22e-1,
    "Y_uur": 3.13e-2,
    "Y_r|v|": 1.12e-3,
    "N_rdot": -1.20e-3,
    "N_vdot": 1.87e-3,
    "N_uur": -8.41e-3,
    "N_r|r|": -1.00e-3,
    "N_uuv": 2.14e-2,
    "N_v|r|": -1.69e-2,
    "N_r|v|": 1.11e-2,
}
#: A small research ship; the paper prints no particulars.
PARTICULARS = Particulars(
    length=28.9,
    beam=9.6,
    draught=2.7,
    mass=417e3,
    speed=5.0,
    xg=-0.5,
    yaw_gyradius=7.2,
    water_density=1025.0,
)
# standard deviation of each force, in parts of its root mean square over all tests
NOISE = 0.015
SEED = 2020

# amplitude and period, s: surge in parts of the speed, drift in degrees, yaw rate as r'
SURGE = ((0.1, 20.0), (0.2, 20.0), (0.2, 40.0))
SWAY = ((10.0, 15.0), (20.0, 30.0), (30.0, 30.0), (20.0, 15.0))
YAW = ((0.3, 15.0), (0.6, 30.0), (0.9, 30.0), (0.6, 10.0))
MIXED = (
    (0.4, 5.0),
    (0.6, -10.0),
    (0.8, 15.0),
    (0.8, -20.0),
    (0.8, 25.0),
    (0.8, -25.0),
)  # r', drift
MIXED_PERIOD = 20.0

FINAL = (4, 7, 10)  # tables of the last step of each force
#: Of an elimination: held-out R2, relative standard error.
TOLERANCE, THRESHOLD = 1e-5, 0.05
#: Of terms that say the same the paper keeps the one that its damping matrix (equation
#: 42) multiplies by u.
CUBIC = ("uuu", "uvv", "uuv", "urr", "uur", "rvu")


class Step(NamedTuple):
    """One step of the reduction: table, force, types of test.

    `printed` has by coefficient its standard error, %, in the old and in the revised
    model; None where dropped.
    """

    table: int
    force: str
    kinds: tuple[str, ...]
    printed: Mapping[str, tuple[float, float | None]]

    @property
    def kept(self) -> set[str]:
        """Terms of the revised model."""
        return {name for name, (_, new) in self.printed.items() if new is not None}


def _step(table: int, force: str, kinds: str, printed: str) -> Step:
    """A step from its table: term, old and revised error, `-` where dropped."""
    words = printed.split()
    errors = {
        f"{force}_{term}": (float(old), None if new == "-" else float(new))
        for term, old, new in zip(words[::3], words[1::3], words[2::3], strict=True)
    }
    return Step(table, force, tuple(kinds.split()), errors)


ALL = "surge sway yaw mixed"
#: Misprints of the tables: Table 8's r|v| is equation 33's r|r|, Table 9's v|r| is
#: equation 35's v|v|.
STEPS = (
    _step(
        3,
        "X",
        "surge sway",
        "udot .64 .65 uu 14.91 - uuu 14.9 7.23 vv 53.69 - uvv 14.15 1.6 u|v| 31.49 -",
    ),
    _step(
        5,
        "Y",
        "sway",
        "vdot .13 .14 uv 11.95 - uuv 10.48 .54 vvv 10.15 - v|v| 5.82 1.65",
    ),
    _step(
        6,
        "Y",
        "yaw",
        "rdot 3.41 3.56 ur 57.32 - uur 57.9 .14 rrr 2.64 - r|r| 2.09 2.36",
    ),
    _step(
        4,
        "X",
        ALL,
        "udot .6 .61 uuu 1.49 1.29 uvv 1.54 1.76 rvu 4.89 .25 rv 29.68 - rr 3.13 - urr"
        " 3.07 2.33",
    ),
    _step(
        7,
        "Y",
        ALL,
        "vdot .14 .14 uuv .18 .18 v|v| .28 .28 rdot 3.81 3.85 uur .25 .09 r|r| 10.66 -"
        " v|r| 5.95 - r|v| .91 .91",
    ),
    _step(8, "N", "yaw", "rdot .11 .11 ur 17.21 - uur 17.15 .15 r|r| .74 .74"),
    _step(9, "N", "sway", "vdot .55 .56 uv 13.23 - uuv 14.24 .33 v|v| 26.79 -"),
    _step(
        10,
        "N",
        ALL,
        "rdot .19 .19 uur .21 .2 r|r| 2.03 2.5 vdot .63 .65 uuv .11 .1 vrr 2.64 - vvr"
        " 9.63 - v|r| .79 .4 r|v| 1.42 .73",
    ),
)


def xu_ship(particulars: Particulars) -> ShipModel:
    """The ship of Table 11, without rudder, propeller and printed particulars."""
    source = {"source": PMM18.source.replace("equations 39 to 41", "Table 11")}
    return ShipModel(
        "xu-2020", "pmm18", particulars, SteeringGear(), TABLE_11, provenance=source
    )


@cache
def captive_tests() -> tuple[tuple[str, Trial], ...]:
    """Type and trial of each test, without noise."""
    ship, speed = xu_ship(PARTICULARS), PARTICULARS.require("speed")
    rate = speed / PARTICULARS.length

    def test(course: Floats, amplitude: Floats, period: float) -> Trial:
        return oscillate(ship, course, amplitude, period, cycles=2, samples=500)

    ahead = np.array([speed, 0.0, 0.0])
    surge, sway, yaw = np.eye(3)
    runs = [
        ("surge", test(ahead, part * speed * surge, period)) for part, period in SURGE
    ]
    for angle, period in SWAY:
        aside = speed * np.tan(np.radians(angle))
        runs.append(("sway", test(ahead, aside * sway, period)))
    runs += [("yaw", test(ahead, prime * rate * yaw, period)) for prime, period in YAW]
    for prime, drift in MIXED:
        angle = np.radians(drift)
        course = speed * np.array([np.cos(angle), -np.sin(angle), 0.0])
        runs.append(("mixed", test(course, prime * rate * yaw, MIXED_PERIOD)))
    return tuple(runs)


@cache
def full_regression() -> ForceRegression:
    """The forces of all tests on the 38 coefficients, without noise."""
    return force_regression([run for _, run in captive_tests()], PMM38, PARTICULARS)


def measured(noise: float = NOISE, seed: int = SEED) -> Floats:
    """Forces with white noise in parts of their root mean squares, shape (n_rows,)."""
    regression = full_regression()
    errors = np.random.default_rng(seed).standard_normal(len(regression))
    forces: Floats = regression.targets + noise * regression.scales() * errors
    return forces


def rows_of(force: str, kinds: tuple[str, ...]) -> NDArray[np.int64]:
    """Rows of one force in tests of given types, in order of time within tests.

    So that each of the stretches that an elimination holds out has its part of every
    test.
    """
    regression = full_regression()
    wanted = np.array([kind in kinds for kind, _ in captive_tests()])
    is_force = regression.equation == FORCES.index(force)
    is_wanted = wanted[regression.trial]
    rows = np.flatnonzero(is_force & is_wanted)
    counts = np.bincount(regression.trial[rows])
    clock = np.concatenate([np.arange(n) / n for n in counts if n])
    return rows[np.argsort(clock, kind="stable")]


def eliminate(
    forces: Floats,
    force: str,
    kinds: tuple[str, ...],
    terms: Iterable[str],
    known: Mapping[str, float],
) -> Reduction:
    """Leave-one-out of one force, the coefficients of others taken as known.

    Parameters
    ----------
    forces : array of shape (n_rows,)
        From `measured`.
    force : str
        X, Y or N.
    kinds : tuple of str
        Types of test.
    terms : iterable of str
        To start from. What these tests do not excite is left out.
    known : dict of str to float
        Coefficients that X, Y and N share.

    Returns
    -------
    Reduction
    """
    regression, rows = full_regression(), rows_of(force, kinds)
    column = {name: i for i, name in enumerate(regression.names)}
    features = regression.features[rows]
    others = [name for name in regression.names if name[0] != force and name in known]
    targets = forces[rows] - features[:, [column[name] for name in others]] @ np.array(
        [known[name] for name in others]
    )
    excited = tuple(name for name in terms if features[:, column[name]].any())
    prefer = [f"{force}_{term}" for term in CUBIC]
    X = features[:, [column[name] for name in excited]]
    return backward_elimination(X, targets, excited, TOLERANCE, THRESHOLD, prefer)


def step_by_step(forces: Floats) -> tuple[dict[int, Reduction], dict[str, float]]:
    """The elimination of each step by table, and the coefficients that are left."""
    reductions: dict[int, Reduction] = {}
    known: dict[str, float] = {}
    for step in STEPS:
        found = eliminate(forces, step.force, step.kinds, step.printed, known)
        known |= found.coefficients
        reductions[step.table] = found
    final = {name for table in FINAL for name in reductions[table].terms}
    return reductions, {name: known[name] for name in sorted(final)}


def all_at_once(forces: Floats, known: Mapping[str, float]) -> set[str]:
    """Terms that are kept of all 38, each force from all tests at once."""
    names = full_regression().names
    kinds = tuple(ALL.split())
    return {
        name
        for force in FORCES
        for name in eliminate(
            forces, force, kinds, tuple(n for n in names if n[0] == force), known
        ).terms
    }
