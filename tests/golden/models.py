"""Golden section `models`: ships as equations, tables and files; their linear forms and conversions."""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from shipgym.engine.lane_records import Sums
from shipgym.engine.motion import Motion, Ship
from shipgym.manoeuvres import towing_tank
from shipgym.ships import (
    catalogue,
    checker,
    container,
    conversions,
    equations,
    inertia,
    kernel_boxes,
    kvlcc2,
    linear,
    mmg,
    model_file,
    scaling,
    shared_structure,
    simulate,
    structures,
    tanker,
    term_functions,
    term_table,
    terms,
)
from shipgym.ships.envelope import Envelope, smallest_ellipsoid
from shipgym.ships.particulars import Particulars, clarke_added_masses
from shipgym.ships.particulars_limits import LIMITS
from shipgym.ships.prime_inertia import prime_inertia
from shipgym.ships.ship_model import ShipModel
from shipgym.ships.steering import SteeringGear
from shipgym.trials.trial import Trial
from tests.golden.answers import Questions, asked, plain, refused
from tests.golden.ships import more_ships

Answers = dict[str, Any]
HULL = Particulars(
    151.0,
    "Hull",
    beam=24.5,
    draught=8.1,
    mass=1.71e7,
    xg=-1.25,
    yaw_gyradius=36.0,
    speed=6.9,
    water_density=1013.0,
    rudder_area=21.0,
    propeller_diameter=5.1,
    rudder_aspect_ratio=1.7,
    propellers=2.0,
    rudders=2.0,
    metacentric_height=0.9,
    roll_period=13.0,
)
GEAR = SteeringGear(33.0, 3.1, 1.3)
AROUND = (0.8, 0.9, 0.97, 1.03, 1.1, 1.2)  # a limit


@cache
def model(name: str) -> ShipModel:
    """A shipped model, or one of `models.json`."""
    if name in more_ships():
        return ShipModel.from_dict(copy.deepcopy(more_ships()[name]))
    return catalogue.load_model(name)


def motions(length: float, speed: float, shaft: float, count: int = 12) -> list[Motion]:
    """States as ships have them, some astern, slow, or with a shaft that is slow or turns back."""
    random = np.random.default_rng(11)
    found = []
    for k in range(count):
        u = (
            speed
            * random.uniform(0.3, 1.1)
            * (-0.4 if k == 3 else 0.01 if k == 5 else 1.0)
        )
        v, r = random.uniform(-0.3, 0.3) * u, random.uniform(-0.7, 0.7) * u / length
        p, phi, q = (
            random.uniform(-0.02, 0.02),
            random.uniform(-0.3, 0.3),
            random.uniform(-1e-4, 1e-4),
        )
        n = (
            shaft
            * random.uniform(0.5, 1.1)
            * (-0.6 if k in (4, 7) else 0.1 if k == 6 else 1.0)
        )
        found.append(
            Motion(3.0, -5.0, 0.7, u, v, r, p, phi, q, random.uniform(-0.6, 0.6), n)
        )
    return found


def of(p: Particulars, shaft: float, depth: float = math.inf) -> Ship:
    """What every ship has, as her equations read it."""
    return Ship(p.length, p["speed"], 0.6, 0.05, 0.7, shaft, depth, p["speed"])


def reference_ships() -> Answers:
    """Accelerations of ships with equations of their own, in every regime and form, no coefficient at 0."""
    found: Answers = {}
    for one, depths in (
        (container.SHIP, ()),
        (tanker.SHIP, (60.0, 40.0, 25.0, 1e9)),
        (kvlcc2.SHIP, ()),
        (mmg.SHIP, ()),
    ):
        p, n = one.particulars, one.service_shaft_speed
        values = one.coefficients_record()._asdict()
        nonzero = {
            k: v or 0.003 * (i % 5 + 1)
            for i, (k, v) in enumerate(values.items())
            if k != "PACKAGE_FORM"
        }
        c = one.coefficients_record(**values | nonzero)
        at = motions(p.length, p["speed"], n)
        for depth in (math.inf, *depths):
            found[f"{one.name} {depth:g}"] = [
                list(one.accelerations(m, c, of(p, n, depth))) for m in at
            ]
        if one.shaft_acceleration is not None:
            pairs = [
                (n * a, n * b)
                for a in (-0.7, 0.0, 0.1, 0.2, 0.24, 0.7, 1.2)
                for b in (-9.0, 0.9, 9.0)
            ]
            found[f"{one.name} shaft"] = [
                one.shaft_acceleration(*pair, c, of(p, n)) for pair in pairs
            ]
        found[f"{one.name} facts"] = [
            one.particulars,
            one.steering,
            n,
            one.state_names,
            one.command_names,
            one.coefficients,
        ]
        found[f"{one.name} flags"] = [
            one.rolls,
            one.shallow_water,
            one.astern,
            one.scales,
            one.normalisation,
            one.quantity,
        ]
        found[f"{one.name} numbers"] = lambda one=one, p=p: one.numbers(
            one.coefficients, replace(p, water_density=1013.0)
        )
        found[f"{one.name} vessel"] = lambda one=one: (
            one.compiled(one.coefficients, True).state_names
        )
    p, c = kvlcc2.SHIP.particulars, kvlcc2.Coefficients(PACKAGE_FORM=1.0)
    found["package form"] = [
        list(kvlcc2.package_accelerations(m, c, of(p, 11.9)))
        for m in motions(7.0, 1.179, 11.9)
    ]
    found["power law"] = [
        mmg.power_law(x, 0.37) for x in (0.0, 0.009, 0.012, 0.3, 1.7, 3.9, 4.5)
    ]
    found["dimensions"] = [
        lambda k=k: mmg.dimensions(replace(HULL, **k))
        for k in (
            {},
            {"rudders": 1.0},
            {"propellers": None},
            {"rudder_area": None},
            {"rudder_aspect_ratio": 0.3},
        )
    ]
    found["standard form"] = lambda: mmg.standard_form(
        kvlcc2.SHIP.coefficients, 1.3, 10.0
    )
    found["no standard form"] = lambda: mmg.standard_form(
        {**kvlcc2.SHIP.coefficients, "PACKAGE_FORM": 1.0}, 1.3, 10.0
    )
    return found


def tables() -> Answers:
    """Every structure: its terms, names and channels, features on samples, and the accelerations it makes."""
    found: Answers = {}
    random = np.random.default_rng(4)
    at = motions(151.0, 6.9, 1.9, 4)
    samples = {
        name: np.array([getattr(m, name) for m in at])
        for name in ("u", "v", "r", "p", "phi", "delta", "n")
    }
    p = HULL.completed()
    formulas = {
        "u": "du, |n| u, n^2",
        "v": "v, r, n delta",
        "r": "v, |v| r, delta^3, dn",
    }
    own = {
        f"own {unit}": term_table.Structure(
            "own",
            "own",
            {q: terms.read_terms(t) for q, t in (formulas | more).items()},
            unit,
            "acceleration",
        )
        for unit, more in (
            ("prime", {"p": "p, phi, n p"}),
            ("service", {"q": "r, delta, n r"}),
        )
    }
    printed = {
        one: structures.get_structure(one) for one in structures.printed_tables()
    }
    for name, table in (printed | own).items():
        shaft = 1.9 if "n" in table.command_names else 0.0
        values = dict(
            zip(
                table.coefficient_names,
                random.uniform(-1.0, 1.0, len(table.coefficient_names)),
                strict=True,
            )
        )
        if isinstance(table, shared_structure.SharedStructure):
            values |= {one: -0.01 for one in values if one.endswith("dot")}
        numbers_ = table.term_numbers(values, p, shaft)
        source = term_functions.accelerations_source(
            table.equations, table.normalisation == "prime"
        )
        function = term_functions.accelerations_function(source)
        c = term_functions.coefficients_record(len(numbers_))(*numbers_)
        found[name] = {
            "numbers": numbers_,
            "rates": [list(function(m, c, of(p, shaft))) for m in at],
            "normalisation": table.normalisation,
            "quantity": table.quantity,
            "names": " ".join(table.coefficient_names),
            "states": " ".join(table.state_names),
            "commands": " ".join(table.command_names),
            "channels": " ".join(table.required_channels),
            "flags": [
                table.has_rudder,
                table.captive,
                table.astern,
                table.needs_shaft_speed,
            ],
            "features": {
                q: table.features(q, samples, p, shaft) for q in table.equations
            },
            "powers": {
                q: [table.speed_power(q, t) for t in ts]
                for q, ts in table.equations.items()
            },
        }
        if name in (
            "nomoto2",
            "surge-perturbed",
            "linear",
            "steering5",
            "zhu-9",
            "cubic",
            "abkowitz",
        ):
            found[name]["source"] = source
            found[name]["back"] = table.from_dict(table.to_dict()) == table
    found["matrix"] = lambda: structures.get_structure("linear").acceleration_matrix(p)
    found["no shaft"] = lambda: structures.get_structure("cubic").acceleration_matrix(p)
    found["undamped"] = term_functions.accelerations_source(
        structures.get_structure("nomoto").equations, prime=False, damped=False
    )
    return found


def terms_and_refusals() -> Answers:
    """Formulas, terms, shares, and tables that cannot be."""
    term, own = terms.Term, partial(structures.own_structure, where="[structure]")

    def table(
        name: str = "own",
        source: str = "own",
        normalisation: str = "si",
        quantity: str = "acceleration",
        **given: str,
    ) -> Any:
        return term_table.Structure(
            name,
            source,
            {q: terms.read_terms(text) for q, text in given.items()},
            normalisation,
            quantity,
        ).to_dict()

    def shares(**given: str) -> Any:
        return shared_structure.shared_structure(
            "own",
            "own",
            {q: shared_structure.read_shares(text) for q, text in given.items()},
        )

    def products(n: int) -> tuple[terms.Term, ...]:
        """So many different terms."""
        return tuple(
            term(
                f"t{i}",
                tuple((q, i // 9**k % 9 + 1) for k, q in enumerate("uvr")),
            )
            for i in range(n)
        )

    formulas = (
        "v, |v| r, v^3/U, n^2 delta, 1, du dn",
        "phi p |phi| |p|",
        "v v^2 / U",
        "v^0",
        "x",
        "v,",
        "|v",
        "v^10",
        "delta^9 delta^9 u^9",
    )
    wrong = [
        ("x", 1),
        ("v", 0),
        ("v", 10),
        ("v", True),
        ("U", -10),
        ("U", -9),
        ("U", 9),
        ("v", 9),
        ("v", -1),
        ("v", 1.5),
    ]
    captive = {
        "u": "X_u X_uu X_udot",
        "v": "Y_v Y_|r|v -Y_vdot:rdot Y_vdot",
        "r": "N_v N_rdot Y_vdot:vdot",
    }
    made = shares(**captive)
    values = dict(
        zip(
            made.coefficient_names,
            (-0.02, 0.01, -0.001, -0.3, 0.2, -0.012, 0.05, -0.0007),
            strict=False,
        )
    )
    p = HULL.completed()
    return {
        "formulas": [
            lambda f=f: [[t.name, dict(t.powers)] for t in terms.read_terms(f)]
            for f in formulas
        ],
        "short": [
            [t.name, dict(t.powers)]
            for t in terms.short_terms("u 0u 0 vvr |v|r uud d|d|", "u")
        ],
        "powers": [lambda w=w: term("t", (w,)).check("here") for w in wrong],
        "factors": refused(
            lambda n: term("t", tuple((s, 5) for s in terms.SYMBOLS[:n])).check("here"),
            (3, 4, 5),
        ),
        "power": term("t", (("v", 2), ("r", 3), ("U", -1))).power("v", "U"),
        "products": (
            term("a", (("v", 1), ("r", 2))).product
            == term("b", (("r", 2), ("v", 1))).product
        ),
        "tables": {
            str(k): lambda k=k: table(**k)
            for k in (
                {"v": "v, r"},
                {"r": "v", "v": "v"},
                {},
                {"name": " ", "r": "r"},
                {"source": "", "r": "r"},
                {"normalisation": "own", "r": "r"},
                {"quantity": "power", "r": "r"},
                {"r": "p, r"},
                {"r": "r", "p": "p, phi"},
                {"r": "r", "q": "r"},
                {"q": "r"},
                {"r": "r", "p": "p", "q": "r"},
                {"r": "r", "p": "p", "quantity": "force", "normalisation": "prime"},
                {
                    "v": "v, r",
                    "r": "r, v",
                    "quantity": "force",
                    "normalisation": "prime",
                },
                {"v": "v, r", "quantity": "force"},
                {"r": "r, r"},
                {"r": "r U", "normalisation": "prime"},
                {"r": "r U^-1, v/U"},
            )
        },
        "many": refused(
            lambda n: term_table.Structure(
                "own", "own", {"r": products(n)}, "si", "acceleration"
            ),
            (0, 1, 81, 201),
        ),
        "own": [
            lambda o=o: own(o)
            for o in (
                3,
                {"name": "a"},
                {"equations": {}},
                {"name": "a", "equations": {"r": " "}},
                {"name": "a", "equations": {"r": 3}},
                {"name": "a", "equations": {"r": ["r"]}},
                {"name": "a", "equations": {"r": "w"}},
                {"name": "nomoto", "equations": {"r": "r"}},
                {"name": "container", "equations": {"r": "r"}},
                {"name": "a", "equation": {}},
                {"name": "auto", "equations": {"r": "r"}},
            )
        ],
        "get": [
            lambda n=n: structures.get_structure(n).name
            for n in ("mmg", "grey-box", "abkowitsch", "nomoto")
        ],
        "dynamics": [structures.get_dynamics(n).name for n in ("tanker", "linear")],
        "list": structures.list_structures(),
        "shares": [
            lambda: made.to_dict(),
            lambda: shares(u="X_u", v="Y_v"),
            lambda: shares(u="X_vdot", v="Y_v", r="N_r"),
            lambda: shares(u="X_u", v="Y_udot", r="N_r"),
            lambda: shared_structure.Share("a", term("t", (("vdot", 2),))),
        ],
        "captive": [
            made.coefficient_names,
            made.names("v"),
            made.added_mass(values),
            made.prime_inertia(values, p),
            made.term_numbers(values, p),
            made.equations,
        ],
        "not positive": lambda: made.prime_inertia(dict.fromkeys(values, 0.5), p),
        "free": lambda: made.acceleration_matrix(p),
        "back": shared_structure.SharedStructure.from_dict(made.to_dict()) == made,
        "inertia": [
            prime_inertia(p),
            lambda: prime_inertia(replace(p, xg=70.0, yaw_gyradius=0.01)),
        ],
    }


def particulars() -> Answers:
    """Estimates, bounds, and values that do not belong together."""
    mapping = partial(Particulars.from_mapping, where="[ship]")
    plain_hull = {
        "length": 151.0,
        "beam": 24.5,
        "draught": 8.1,
        "block_coefficient": 0.63,
    }
    shares = {
        "beam": 1.0,
        "draught": 0.5,
        "xg": 0.5,
        "yaw_gyradius": 0.7,
        "propeller_diameter": 0.5,
        "length_overall": 2.0,
        "frontal_area": 0.5,
        "lateral_area": 0.5,
        "lateral_centroid": 0.5,
        "lateral_centroid_height": 0.5,
        "metacentric_height": 0.2,
    }
    areas = ("frontal_area", "lateral_area")
    wrong: tuple[dict[str, Any], ...] = (
        {},
        {"length": "long"},
        {"length": 151.0, "name": 3},
        {"length": 151.0, "breadth": 3.0},
        {"length": 0.01},
        {"length": 2000.0},
        {"length": 151.0, "added_mass": {"X_u": -0.1}},
        {"length": 151.0, "X_udot": -0.01, "added_mass": {"X_udot": -0.01}},
        {"length": 151.0, "estimated": ["beams"]},
        {"length": 151.0, "estimated": "beam"},
        {"length": 151.0, "speed": 51.0},
        {"length": 151.0, "water_density": 400.0},
        {"length": 151.0, "beam": 152.0},
        {"length": 151.0, "lateral_area": 12_000.0},
        {"length": 151.0, "mass": 17.0},
        {**plain_hull, "mass": 1.0},
        {k: plain_hull.get(k) for k in ("length", "beam", "draught")} | {"mass": 1e9},
    )
    return {
        "completed": HULL.completed(),
        "from block": mapping(plain_hull).completed(),
        "lone": lambda: mapping({"length": 151.0}).completed(),
        "with mass": lambda: mapping({"length": 151.0, "mass": 1.7e7}).completed(),
        "added": (
            lambda: mapping(
                {**plain_hull, "added_mass": {"Y_vdot": -0.01, "N_rdot": -0.0005}}
            ).completed()
        ),
        "flat": (
            lambda: mapping(
                {"length": 30.0, "beam": 29.0, "draught": 0.5, "block_coefficient": 0.9}
            ).completed()
        ),
        "clarke": clarke_added_masses(151.0, 24.5, 8.1, 0.63),
        "primes": [HULL.mass_prime, HULL.xg_prime, HULL.inertia_prime],
        "require": lambda: mapping({"length": 151.0}).require("mass"),
        "dict": HULL.to_dict(),
        "short dict": mapping({"length": 9.0}).to_dict(),
        "again": Particulars.from_mapping(HULL.completed().to_dict())
        == HULL.completed(),
        "wrong": [lambda w=w: mapping(w) for w in wrong],
        "shares": {
            name: refused(
                lambda k, name=name, share=share: mapping(
                    {
                        "length": 40.0,
                        name: k * share * (1600.0 if name in areas else 40.0),
                    }
                ),
                AROUND,
            )
            for name, share in shares.items()
        },
        "bounds": {
            name: refused(
                lambda k, name=name, given=given: mapping({"length": 4.0, name: k}),
                [
                    k * bound
                    for bound in (given.above, given.below)
                    if bound is not None
                    for k in (0.95, 1.05)
                ],
            )
            for name, given in LIMITS.items()
            if name != "length"
        },
        "masses": [
            refused(
                lambda k, given=given, m=m: mapping({**given, "mass": k * m}), AROUND
            )
            for given, ms in (
                ({"length": 151.0}, (2e-4 * 1025 * 151**3, 0.2 * 1025 * 151**3)),
                (
                    {
                        "length": 151.0,
                        "beam": 24.0,
                        "draught": 8.0,
                        "water_density": 1000.0,
                    },
                    (0.2 * 1e3 * 151 * 192, 1e3 * 151 * 192),
                ),
                (
                    {**plain_hull},
                    (
                        0.5 * 1025 * 151 * 24.5 * 8.1 * 0.63,
                        2 * 1025 * 151 * 24.5 * 8.1 * 0.63,
                    ),
                ),
            )
            for m in ms
        ],
        "steering": [
            lambda k=k: SteeringGear(**k)
            for k in (
                {},
                {"rudder_limit_deg": 90.0},
                {"rudder_limit_deg": 91.0},
                {"rudder_limit_deg": 0.0},
                {"rudder_rate_deg_s": 0.0},
                {"time_constant": -0.1},
                {"time_constant": 0.0},
            )
        ],
        "gear": [
            GEAR.limit,
            GEAR.rate,
            GEAR.to_dict(),
            lambda: SteeringGear.from_mapping({"limit": 3.0}, "[steering]"),
            lambda: SteeringGear.from_mapping(
                {"rudder_rate_deg_s": -3.0}, "[steering]"
            ),
            lambda: SteeringGear.from_mapping(3, "[steering]"),
        ],
    }


def linear_forms() -> Answers:
    """Straight running, state space, Nomoto's forms and stability; ships from linear forms."""
    found: Answers = {}
    for name in ("mariner", "container", "kvlcc2", "tanker", "kvlcc2-nomoto"):
        ship = model(name)
        at = linear.straight_running(ship)
        rate = 0.3 * ship.particulars["speed"] / ship.particulars["length"]
        found[name] = {
            "straight": at,
            "state": at.state(ship),
            "slow": lambda ship=ship: linear.straight_running(
                ship, 0.8 * ship.particulars["speed"]
            ),
            "sides": [
                lambda ship=ship, at=at, k=k: linear.linearise(ship, at, k)
                for k in (-1, 0, 1)
            ],
            "nomoto": lambda ship=ship: (
                linear.nomoto(ship) if ship.name != "kvlcc2" else None
            ),
            "effect": lambda ship=ship: linear.nomoto(ship).rudder_effect,
            "stable": linear.is_course_stable(ship) if ship.name != "kvlcc2" else None,
            "turn": [
                lambda ship=ship, k=k, r=rate: linear.steady_turn_rudder(ship, r, k)
                for k in (True, False)
            ],
            "port": lambda ship=ship, r=rate: linear.steady_turn_rudder(ship, -0.7 * r),
            "at once": lambda ship=ship, r=rate: linear.steady_turn_rudder(
                ship, 90.0 * r
            ),
        }
        stability = linear.straight_line_stability(ship)
        found[name]["stability"] = [
            stability.eigenvalues,
            stability.criterion,
            stability.index,
            stability.stable,
            stability.unstable_sides,
        ]
    A, B = np.array([[-0.021, -2.9], [-0.0013, -0.071]]), np.array([[0.091], [-0.0047]])
    B = -B
    form, unstable = (
        linear.nomoto_of(A, B),
        linear.nomoto_of(np.array([[0.02, -2.9], [-0.0013, -0.071]]), B),
    )
    turned = replace(
        model("mariner"),
        coefficients={
            k: v * (30.0 if k in ("N_0", "Y_0") else 1.0)
            for k, v in model("mariner").coefficients.items()
        },
    )
    oscillating = linear.nomoto_of(np.array([[-0.02, -3.0], [0.01, -0.02]]), B)

    ships = {
        "first": lambda: conversions.nomoto1_ship(0.07, 31.0, HULL, GEAR, "one"),
        "second": lambda: conversions.nomoto2_ship(form, HULL, GEAR, "two"),
        "linear": lambda: conversions.linear_steering_ship(A, B, HULL, GEAR, "three"),
        "mapping": lambda: conversions.nomoto1_ship(
            -0.07, -31.0, {"length": 151.0, "speed": 6.0}
        ),
        "wrong side": lambda: conversions.nomoto1_ship(-0.07, 31.0, HULL),
        "nothing": lambda: conversions.nomoto1_ship(0.0, 31.0, HULL),
        "complex": lambda: conversions.nomoto2_ship(oscillating, HULL),
        "no K": lambda: conversions.nomoto2_ship(replace(form, K=0.0), HULL),
        "no T1": lambda: conversions.nomoto2_ship(replace(form, T1=0.0), HULL),
        "shape": lambda: conversions.linear_steering_ship(A[:1], B, HULL),
        "nan": lambda: conversions.linear_steering_ship(A, B * np.nan, HULL),
        "no speed": lambda: conversions.linear_steering_ship(A, B, {"length": 151.0}),
    }
    return found | {
        "form": form,
        "unstable": unstable,
        "oscillating": oscillating,
        "no effect": [
            lambda: linear.nomoto_of(A, 0.0 * B),
            lambda: linear.nomoto_of(0.0 * A, B),
        ],
        "no course": lambda: linear.straight_running(turned),
        "no course at": lambda: linear.straight_running(turned, 4.0),
        "prime": conversions.prime_matrices(A, B, 151.0, 6.9),
        "si": conversions.si_matrices(A, B, 151.0, 6.9),
        "length": lambda: conversions.prime_matrices(A, B, 0.0, 6.9),
        "speed": lambda: conversions.si_matrices(A, B, 7.0, -1.0),
        "ships": {
            name: lambda make=make: [
                (ship := make()).coefficients,
                ship.structure,
                ship.name,
                ship.steering,
                ship.particulars.length,
            ]
            for name, make in ships.items()
        },
    }


def masses_and_scales() -> Answers:
    """Mass and added mass of every ship; ships at other scales; envelopes; what every shipped model has."""
    found: Answers = {}
    for name in (
        "mariner",
        "container",
        "tanker",
        "kvlcc2",
        "kvlcc2-mmg",
        "pmm38",
        "mariner-tls-svm",
        "nomoto",
    ):
        ship = model(name)
        found[name] = [
            lambda ship=ship: inertia.inertia(ship),
            lambda ship=ship: inertia.rigid_inertia(ship),
            ship.travel_time,
            ship.service_state,
            ship.service_command,
            lambda ship=ship: ship.ship_numbers(),
        ]
    found["shallow"] = [
        lambda: inertia.inertia(model("tanker"), 27.0),
        lambda: model("tanker").ship_numbers(31.0),
    ]
    for name in catalogue.list_models():
        ship = model(name)
        found[f"{name} file"] = [
            ship.coefficients,
            ship.particulars,
            ship.steering,
            ship.service_shaft_speed,
            (ship.provenance or {}).get("source"),
            ship.structure,
        ]
    random = np.random.default_rng(9)
    samples = random.standard_normal((4, 60)) * np.array(
        [[0.3], [0.1], [0.01], [0.2]]
    ) + np.array([[7.0], [0.05], [-0.002], [0.03]])
    envelope, still = (
        Envelope.from_samples(*samples),
        Envelope.from_samples(7.0 * np.ones(20), *samples[1:, :20]),
    )
    identified = replace(model("mariner-tls-svm"), envelope=envelope)
    surge = replace(model("surge-perturbed"), covariance=np.diag([1.0, 2.0, 3.0]))
    scaled = {
        "mariner": lambda: scaling.scale_model(identified, 7.0),
        "fast": lambda: scaling.scale_model(identified, 80.0, 6.0, 1000.0),
        "surge": lambda: scaling.scale_model(surge, 3.7, 2.9),
        "cubic": lambda: scaling.scale_model(model("cubic"), 3.7, 2.9),
        "roll": lambda: scaling.scale_model(model("mmg4dof"), 12.0),
        "norrbin": lambda: scaling.scale_model(model("norrbin"), 7.0),
        "mmg": lambda: scaling.scale_model(model("kvlcc2-mmg"), 7.0),
        "hull": lambda: scaling.scale_model(
            replace(model("norrbin"), particulars=HULL), 15.1, water_density=1000.0
        ),
        "reference": lambda: scaling.scale_model(model("tanker"), 3.0),
        "length": lambda: scaling.scale_model(model("norrbin"), 0.0),
        "speed": lambda: scaling.scale_model(model("norrbin"), 3.0, -1.0),
    }

    def told(ship: ShipModel) -> Any:
        covariance = (
            None
            if ship.covariance is None
            else ship.covariance / np.outer(*2 * [list(ship.coefficients.values())])
        )
        box = (
            None
            if ship.envelope is None
            else [
                ship.envelope.low,
                ship.envelope.high,
                ship.envelope.centre,
                ship.envelope.distance(*samples[:, :3] * 0.9),
            ]
        )
        return [
            ship.coefficients,
            ship.particulars,
            ship.steering,
            ship.service_shaft_speed,
            (ship.provenance or {}).get("scaled"),
            covariance,
            box,
        ]

    return found | {
        "scaled": {
            name: lambda make=make: told(make()) for name, make in scaled.items()
        },
        "envelope": [
            envelope.low,
            envelope.high,
            envelope.centre,
            envelope.distance(*samples),
            envelope.distance(7.0, 0.3, 0.02, -0.4),
        ],
        "still": [still.centre, still.distance(*samples)],
        "ellipsoid": smallest_ellipsoid(samples[:2].T, 0.05),
        "envelope file": envelope.to_dict(),
    }


def towed() -> Answers:
    """Captive tests with every setting."""
    tank = towing_tank.Tank
    ship, other, shallow = model("mariner"), model("container"), model("tanker")
    tests = {
        "drift": lambda: towing_tank.static_drift(
            ship, [-7.0, 3.0, 12.0], 2.0, tank(samples=8)
        ),
        "surge": lambda: towing_tank.pure_surge(
            ship, 0.7, tank=tank(speed=5.0, rudder_deg=4.0, cycles=2, samples=12)
        ),
        "sway": lambda: towing_tank.pure_sway(
            other,
            0.6,
            90.0,
            tank(shaft_speed=1.1, model_inertia=False, cycles=1, samples=20),
        ),
        "yaw": lambda: towing_tank.pure_yaw(
            other, 0.4, tank=tank(noise=0.1, seed=3, cycles=1, samples=20)
        ),
        "yaw with drift": lambda: towing_tank.yaw_with_drift(
            shallow,
            0.2,
            -5.0,
            300.0,
            tank(water_depth=30.0, model_inertia=False, cycles=1, samples=16),
        ),
        "kvlcc2": lambda: towing_tank.yaw_with_drift(
            model("kvlcc2"), 0.2, 5.0, None, tank(cycles=1, samples=9)
        ),
    }
    wrong = {
        "no angle": lambda: towing_tank.static_drift(ship, []),
        "angle": lambda: towing_tank.static_drift(ship, [3.0, 181.0]),
        "hold": lambda: towing_tank.static_drift(ship, [3.0], 0.0),
        "fast": lambda: towing_tank.pure_surge(ship, 8.0),
        "still": lambda: towing_tank.pure_sway(ship, 0.0),
        "rate": lambda: towing_tank.pure_yaw(ship, -1.0),
        "drift": lambda: towing_tank.yaw_with_drift(ship, 1.0, 91.0),
        "period": lambda: towing_tank.pure_yaw(ship, 1.0, -3.0),
        "rudder": lambda: towing_tank.pure_sway(ship, 1.0, tank=tank(rudder_deg=41.0)),
        "shaft": lambda: towing_tank.pure_sway(ship, 1.0, tank=tank(shaft_speed=1.0)),
        **{
            str(k): lambda k=k: tank(**k)
            for k in (
                {"speed": 0.0},
                {"shaft_speed": 0.0},
                {"rudder_deg": 91.0},
                {"cycles": 0},
                {"samples": 7},
                {"noise": -0.1},
                {"seed": -1},
            )
        },
    }
    return {
        "tests": tests,
        "wrong": wrong,
        "rigid": towing_tank.rigid_body_forces(
            (3.0, 0.7, 5.0),
            np.array([[2.0], [0.3], [0.2]]),
            np.array([[0.4], [-0.5], [0.6]]),
        ),
    }


def simulated() -> Answers:
    """Simulations and predictions of few steps, orders and states that are refused, and draws."""
    ship, other = model("mariner"), model("container")
    swing = 0.3 * np.sin(0.4 * np.arange(30.0))
    start = np.array([10.0, -3.0, 0.4, 7.0, 0.2, 0.003, -0.05])
    rolled = simulate.orders(other, swing, 1.2 + 0.2 * swing)
    t = np.cumsum(np.linspace(0.5, 9.0, 25))
    measured = {
        "psi": 0.1 + 0.0 * t,
        "u": 7.0 + 0.0 * t,
        "v": 0.1 + 0.0 * t,
        "r": 0.002 + 0.0 * t,
        "delta": 0.2 * np.sin(t / 20.0),
    }
    blown = measured | {
        "x": 5.0 + t,
        "y": -3.0 - t,
        "wind_udot": 0.001 * np.cos(t),
        "wind_vdot": 0.002 + 0.0 * t,
        "wind_rdot": 1e-5 * np.sin(t),
    }
    wrong = {
        "columns": lambda: ship.simulate(rolled, 1.0),
        "one row": lambda: ship.simulate(np.zeros((1, 1)), 1.0),
        "step": lambda: ship.simulate(np.zeros((3, 1)), 0.0),
        "nan": lambda: ship.simulate(np.full((3, 1), np.nan), 1.0),
        "degrees": lambda: ship.simulate(np.full((3, 1), 20.0), 1.0),
        "rpm": lambda: other.simulate(np.full((3, 2), [0.1, 80.0]), 1.0),
        "astern": lambda: other.simulate(np.full((3, 2), [0.1, -0.5]), 1.0),
        "tanker astern": (
            lambda: model("tanker").simulate(np.full((3, 2), [0.1, -7.0]), 1.0)
        ),
        "state": lambda: ship.simulate(np.zeros((3, 1)), 1.0, [1.0, 2.0]),
        "shallow": lambda: ship.simulate(np.zeros((3, 1)), 1.0, water_depth=20.0),
        "aground": (
            lambda: model("tanker").derivatives(np.zeros(8) + 1.0, [0.0, 1.0], 18.0)
        ),
        "depth": lambda: model("tanker").check_depth(-1.0),
        "long step": lambda: ship.simulate(np.full((40, 1), 0.6), 400.0),
        "seed": lambda: ship.simulate(np.zeros((3, 1)), 1.0, weather="rough", seed=-1),
        "states": lambda: ship.derivatives(np.zeros((2, 5)), [0.0]),
        "commands": lambda: ship.derivatives(np.zeros(7), 0.0),
        "infinite": lambda: ship.derivatives(np.full(7, np.inf), [0.0]),
        "no psi": lambda: simulate.open_loop(
            ship, Trial(t, {k: v for k, v in measured.items() if k != "psi"})
        ),
        "no shaft": lambda: simulate.open_loop(other, Trial(t, measured)),
        "no covariance": lambda: ship.sample(2, 1),
    }
    drawn = replace(model("norrbin"), covariance=np.diag([1e-6, 0.0, 4e-6]))
    values = {"r_c": 1.0}
    of_ship = partial(replace, model("norrbin"))
    made = {
        "missing": lambda: of_ship(coefficients={}),
        "unknown": lambda: of_ship(
            coefficients={**model("norrbin").coefficients, **values}
        ),
        "nan": lambda: of_ship(
            coefficients=dict.fromkeys(model("norrbin").coefficients, math.nan)
        ),
        "covariance": lambda: of_ship(covariance=np.eye(2)),
        "shaft": lambda: replace(model("cubic"), service_shaft_speed=0.0),
        "speed": lambda: of_ship(particulars=Particulars(7.0)),
        "structure": lambda: ShipModel("a", "nomotto", HULL, GEAR, {}),
        "table": lambda: model("tanker").table,
    }
    return {
        "mariner": lambda: ship.simulate(swing[:, None], 2.0, start),
        "container": lambda: other.simulate(rolled, 1.0),
        "weather": lambda: other.simulate(rolled, 1.0, weather="rough", seed=4),
        "prime": lambda: simulate.simulate(ship, swing[:, None], 2.0, kind="random"),
        "tanker": (
            lambda: model("tanker").simulate(
                np.stack([swing, -0.9 + 0.0 * swing], axis=1), 2.0, water_depth=30.0
            )
        ),
        "kvlcc2": (
            lambda: model("kvlcc2").simulate(
                np.stack([swing, 1.7 + 0.0 * swing], axis=1), 3.0
            )
        ),
        "open loop": lambda: simulate.open_loop(
            model("mariner-tls-svm"),
            Trial(t, measured, name="sea", kind="zigzag", use="validate"),
        ),
        "in wind": lambda: simulate.open_loop(
            model("mariner-tls-svm"), Trial(t, blown)
        ),
        "memory": lambda: simulate.open_loop(
            model("mariner-nomoto"), Trial(t, measured)
        ),
        "wind": [
            simulate.wind_accelerations(Trial(t, blown)),
            simulate.wind_accelerations(
                Trial(t, blown), structures.get_structure("nomoto")
            ),
        ],
        "wrong": wrong,
        "made": made,
        "drawn": lambda: [
            [one.name, one.coefficients, one.covariance is None]
            for one in drawn.sample(3, 5)
        ],
        "with": lambda: (
            drawn.with_accelerations({"r": np.array([1.0, 2.0, 3.0])}).coefficients
        ),
        "rates": lambda: ship.rates(
            {name: np.array([0.1, 0.2]) for name in ("u", "v", "delta")}
        ),
        "many": lambda: ship.derivatives(
            np.tile(start, (2, 3, 1)), np.full((3, 1), 0.2)
        ),
    }


def files() -> Answers:
    """Model files with one thing wrong, and what is read of whole ones; the catalogue and its grey boxes."""
    whole = {
        "cubic": model("norrbin").to_dict(),
        "captive": model("pmm38").to_dict(),
        "box": model("kvlcc2-rm-svm").to_dict(),
        "tanker": model("tanker").to_dict(),
        "mariner": model("mariner-tls-svm").to_dict(),
    }
    changes: dict[str, tuple[str, Any]] = {
        "cubic/format": ("cubic", 2),
        "cubic/name": ("cubic", " "),
        "cubic/normalisation": ("cubic", "prime"),
        "cubic/coefficients/c_r": ("cubic", "large"),
        "cubic/coefficients/e_r": ("cubic", 1.0),
        "cubic/structure/source": ("cubic", None),
        "cubic/structure/name": ("cubic", 3),
        "cubic/structure/equations/w": ("cubic", []),
        "cubic/structure/equations/r": ("cubic", []),
        "cubic/structure/equations": ("cubic", 3),
        "cubic/particulars/speed": ("cubic", None),
        "cubic/particulars/length": ("cubic", -1.0),
        "cubic/steering/limit": ("cubic", 3.0),
        "cubic/service_shaft_speed": ("cubic", -1.0),
        "cubic/provenance": ("cubic", 3),
        "cubic/sha256": ("cubic", "0123456789abcdef"),
        "cubic/more": ("cubic", 1),
        "captive/structure/shares/u": (
            "captive",
            [{"coefficient": "a", "name": "b", "powers": {"u": 1}, "sign": 2.0}],
        ),
        "captive/structure/shares/v": ("captive", [{"coefficient": "a"}]),
        "captive/structure/shares/w": ("captive", []),
        "box/structure/shaft": ("box", 3),
        "box/structure/reference": ("box", 3),
        "box/structure/quantity": ("box", "force"),
        "box/structure/kernel": ("box", {"offset": [1.0]}),
        "tanker/structure/name": ("tanker", "tankers"),
        "tanker/structure/equation": ("tanker", 1),
        "mariner/covariance": ("mariner", [[1.0]]),
        "mariner/envelope/channels": ("mariner", ["u"]),
        "mariner/envelope/low": ("mariner", [1.0]),
        "mariner/envelope/middle": ("mariner", 1.0),
    }
    wrong: Answers = {}
    for path, (name, value) in changes.items():
        fields = copy.deepcopy(whole[name])
        *places, last = path.split("/")[1:]
        place = fields
        for one in places:
            place = place[one]
        place[last] = value
        wrong[path] = asked(
            lambda fields=fields: plain(ShipModel.from_dict(fields, "model.json").name)
        )
    for name in ("format", "structure", "steering", "coefficients"):
        wrong[f"without {name}"] = asked(
            lambda name=name: ShipModel.from_dict(
                {k: v for k, v in whole["cubic"].items() if k != name}, "model.json"
            )
        )
    skew = copy.deepcopy(whole["mariner"])
    skew["covariance"][0][1] += 1.0
    negative = copy.deepcopy(whole["mariner"])
    negative["covariance"][2][2] = -1.0
    wrong |= {
        "skew": asked(lambda: ShipModel.from_dict(skew, "model.json")),
        "negative": asked(lambda: ShipModel.from_dict(negative, "model.json")),
    }
    truths = {
        name: lambda name=name: catalogue.truth_of(name).name
        for name in (
            "mariner-tls-svm",
            "kvlcc2-rm-svm",
            "container-nomoto",
            "tanker",
            "container-4dof-output-error",
        )
    }
    converted = catalogue.converted_model("tanker", HULL, GEAR, 1.7, "converted")
    box = catalogue.grey_box(
        "mariner", {"v": "v, r", "r": terms.read_terms("delta")}, name="box"
    )
    random = np.random.default_rng(6)
    samples = {
        name: random.uniform(low, high, 5)
        for name, low, high in (
            ("u", 4.0, 7.0),
            ("v", -1.0, 1.0),
            ("r", -0.01, 0.01),
            ("delta", -0.4, 0.4),
            ("n", 1.0, 2.0),
            ("p", -0.02, 0.02),
            ("phi", -0.2, 0.2),
        )
    }
    Path("list.json").write_text("[1]")
    model("norrbin").save("saved.json")
    return {
        "wrong": wrong,
        "truths": truths,
        "saved": sorted(json.loads(Path("saved.json").read_text())),
        "loaded": lambda: ShipModel.load("saved.json").to_dict(),
        "list": lambda: catalogue.load_model("list.json"),
        "none": lambda: catalogue.load_model("none.json"),
        "name": lambda: catalogue.load_model("marine"),
        "path": lambda: catalogue.load_model(Path("mariner")),
        "forms": [
            lambda f=f, k=k: [
                f(k).coefficients["PACKAGE_FORM"],
                f(k).provenance,
                f(k).name,
            ]
            for f in (catalogue.kvlcc2, catalogue.kvlcc2_l7)
            for k in ("published", "shipmmg")
        ],
        "limits": [catalogue.container(10.0).steering, catalogue.tanker(11.0).steering],
        "models": catalogue.list_models(),
        "converted": [
            converted.coefficients,
            converted.structure,
            converted.provenance,
            converted.state_names,
        ],
        "box": [
            lambda: box.to_dict()["equations"],
            box.required_channels,
            box.has_rudder,
            box.needs_shaft_speed,
            box.astern,
            box.rolls,
            box.remembers,
            box.shaft,
            lambda: box.converted_accelerations(samples, HULL),
        ],
        "container box": [
            lambda: catalogue.grey_box("container").converted_accelerations(
                samples, HULL, 1.7
            ),
            lambda: [
                (c := catalogue.grey_box("container")).required_channels,
                c.shaft,
                c.needs_shaft_speed,
            ],
            lambda: catalogue.grey_box(
                "container", shaft=False
            ).converted_accelerations(samples, HULL),
        ],
        "unknown shaft": lambda: [
            catalogue.converted_model("tanker", HULL, GEAR).dynamics.shaft,
            catalogue.converted_model(box, HULL, GEAR).name,
        ],
        "fitted": lambda: catalogue.fitted_box(model("mariner-tls-svm")).ship.name,
        "box of box": lambda: catalogue.grey_box("kvlcc2-rm-svm"),
        "box's shaft": lambda: catalogue.grey_box("mariner", shaft=True),
        "no ship": lambda: catalogue.grey_box("none"),
        "register": lambda: catalogue.register_ship_equations(
            replace(tanker.SHIP, name="mariner")
        ),
        "hash": (
            model_file.numbers_hash(model("norrbin"))
            == json.loads(Path("saved.json").read_text())["sha256"]
        ),
        "envelope": lambda: Envelope.from_dict(
            model("mariner-tls-svm").envelope.to_dict(), "here"
        ),
    }


def kernels() -> Answers:
    """Grey boxes with a kernel in place of terms, as plain functions."""
    random = np.random.default_rng(8)
    centres = random.standard_normal((5, 4))
    kernel = kernel_boxes.Kernel(
        np.array([0.1, -0.2, 0.03, 0.9]),
        np.array([0.3, 0.5, 0.2, 0.7]),
        centres,
        random.standard_normal((5, 2)),
    )
    box = kernel_boxes.kernel_box(catalogue.grey_box("mariner", name="box"), kernel)
    values = dict(zip(box.coefficient_names, random.standard_normal(6), strict=True))
    numbers_ = box.numbers(values, HULL)
    own = numbers_[len(box.ship.ship_numbers()) :]
    c = kernel_boxes.KernelCoefficients(*own[:8], table=own[8:])
    at = motions(151.0, 6.9, 1.9, 6)
    samples = {
        name: np.array([getattr(m, name) for m in at])
        for name in ("u", "v", "r", "delta")
    }
    kernel_boxes.N_CENTRES, kernel_boxes.row_of = kernel.size, lambda table, i: table[i]
    rates = [list(kernel_boxes.kernel_accelerations(m, c, of(HULL, 1.9))) for m in at]
    kernel_boxes.N_CENTRES, kernel_boxes.row_of = KERNEL_PARTS
    features = box.features("u", samples, HULL)
    wrong = [
        (kernel.offset[:3], kernel.scale, centres, kernel.basis),
        (kernel.offset, -kernel.scale, centres, kernel.basis),
        (kernel.offset, kernel.scale, centres[:0], kernel.basis[:0]),
        (kernel.offset, kernel.scale, centres, kernel.basis[:4]),
        (kernel.offset, kernel.scale, np.zeros((101, 4)), np.zeros((101, 1))),
    ]
    return {
        "numbers": numbers_,
        "rates": rates,
        "features": features,
        "same": (
            float(
                np.abs(
                    features @ np.array(list(values.values())).reshape(3, 2).T / 151.0
                    - np.array(rates)[:, :3] * [1.0, 1.0, 151.0]
                )[[0, 1, 2, 4]].max()
            )
            < 1e-9
            or features
        ),
        "inputs": kernel_boxes.kernel_inputs(samples, HULL),
        "gaussians": kernel_boxes.gaussians(centres, centres[:2]),
        "sizes": [
            replace(kernel, centres=np.zeros((n, 4)), basis=np.zeros((n, 1))).size
            for n in (1, 32, 33, 64, 65, 100)
        ],
        "dict": box.to_dict()["kernel"],
        "names": [
            box.coefficient_names,
            box.required_channels,
            box.quantity,
            box.normalisation,
        ],
        "wrong": [lambda w=w: kernel_boxes.Kernel(*w) for w in wrong],
        "none": lambda: replace(box, kernel=None),
        "again": lambda: (
            ShipModel.from_dict(
                ShipModel("k", "box", HULL, GEAR, values, dynamics=box).to_dict()
            ).dynamics.kernel
        ),
        "vessel": lambda: len(box.compiled(values, True).state_names),
        "sum": kernel_boxes.sum_accelerations(
            at[1], Sums(0.3, -0.2, 0.1), of(HULL, 1.0)
        ),
    }


KERNEL_PARTS = kernel_boxes.N_CENTRES, kernel_boxes.row_of


def checked() -> Answers:
    """What the battery of checks says of sound and of spoilt ships."""

    def spoilt(name: str, **factors: float) -> ShipModel:
        ship = model(name)
        return replace(
            ship,
            coefficients={
                k: v * factors.get(k, 1.0) for k, v in ship.coefficients.items()
            },
        )

    ships: dict[str, Any] = {
        "mariner": "mariner",
        "container": "container",
        "wrong rudder": spoilt("mariner", Y_d=-1.0, N_d=-1.0),
        "surge": spoilt("mariner", X_u=0.3),
        "asymmetric": spoilt("mariner", N_0=60.0),
        "capsizing": spoilt("container", K_f=-900.0),
        "wild": spoilt("mariner", N_v=1e12),
        "no file": "none.json",
        "covariance": replace(model("mariner-tls-svm"), covariance=-np.eye(40)),
        "surge alone": model("surge-perturbed"),
    }
    skew = np.eye(40)
    skew[0, 1] = skew[1, 0] = 1.5
    ships["correlations"] = replace(model("mariner-tls-svm"), covariance=skew)
    return {
        name: lambda ship=ship: [
            str(check := checker.check_ship_model(ship)),
            check.asymmetry,
            check.ok,
        ]
        for name, ship in ships.items()
    }


def own_equations() -> Answers:
    """Ships with equations of their own that cannot be, and what is read of a file."""
    ship = tanker.SHIP
    record = equations.record_of({"a": 1.5, "b": 2.5}, __name__)

    def failing(motion: Any, c: Any, ship: Any) -> Any:
        raise ValueError("no such sea")

    wrong: dict[str, Callable[[], Any]] = {
        "name": lambda: replace(ship, name=" "),
        "source": lambda: replace(ship, source=""),
        "record": lambda: replace(ship, coefficients_record=dict),
        "no function": lambda: replace(ship, accelerations=3),
        "no shaft": lambda: replace(ship, service_shaft_speed=0.0),
        "speed": lambda: replace(ship, particulars=Particulars(3.0)),
        "raises": lambda: replace(ship, accelerations=failing),
        "four": lambda: replace(
            ship, accelerations=lambda m, c, s: (0.0, 0.0, 0.0, 0.0)
        ),
        "text": lambda: replace(
            ship, accelerations=lambda m, c, s: ("a", 0.0, 0.0, 0.0, 0.0)
        ),
        "shaft": lambda: replace(ship, shaft_acceleration=lambda n, command, c, s: "a"),
    }

    def told(question: Callable[[], Any]) -> str:
        return (
            str(asked(question))
            .replace(__file__, "models.py")
            .split(", line")[0]
            .split("<class")[0]
            .split("<function")[0]
        )

    Path("ship.py").write_text("SHIP = 3\n")
    return {
        "wrong": {name: told(question) for name, question in wrong.items()},
        "record": [record._fields, record().a, record(b=3.0).b],
        "no ship": (
            lambda: str(
                asked(lambda: equations.read_ship_equations("ship.py"))
            ).rpartition("/")[2]
        ),
        "missing": (
            lambda: str(
                asked(lambda: equations.read_ship_equations("none.py"))
            ).rpartition("/")[2]
        ),
        "container": [
            container.SHIP.state_names,
            container.SHIP.command_names,
            container.SHIP.to_dict(),
        ],
        "reduced": [str(one) for one in container.SHIP.__reduce__()[1]],
        "hull": [
            hull(container.State(0.9, 0.1, 0.2, 0.3, 0.4), container.PUBLISHED)
            for hull in (container.sway_hull, container.roll_hull, container.yaw_hull)
        ],
    }


QUESTIONS = Questions(
    {
        "reference ships": reference_ships,
        "tables": tables,
        "terms": terms_and_refusals,
        "particulars": particulars,
        "linear forms": linear_forms,
        "masses and scales": masses_and_scales,
        "towed": towed,
        "simulated": simulated,
        "files": files,
        "kernels": kernels,
        "checked": checked,
        "own equations": own_equations,
    }
)
