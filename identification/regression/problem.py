"""What is to be identified: the trials used, the structure, the ship, and the regression they make."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from identification.options import Given, name_of, whole_call
from identification.regression.grey_box import chosen_box
from identification.regression.preprocess import repaired
from identification.regression.rudder import estimated_gear
from identification.regression.samples import Samples, build_samples
from identification.regression.still_water import in_still_water
from identification.regression.wind import constant_wind, with_constant_wind
from identification.validation.checks import check_samples, check_trials
from shipgym import InputError, Particulars, ShipModel, SteeringGear, Trial
from shipgym.checks import check_choice, check_number
from shipgym.ships import Envelope, Structure, Term, get_structure
from shipgym.ships.grey_boxes import GREY_BOX
from shipgym.ships.mmg import MMG
from shipgym.ships.structures import get_dynamics
from shipgym.trials.identify_table import Options
from shipgym.trials.scale import check_scale

ENVELOPE_CHANNELS = ("u", "v", "r", "delta")
#: Stands for the MMG form where channels, excitation and particulars are checked.
MMG_CHANNELS = Structure(
    MMG,
    "stand-in",
    dict.fromkeys("uvr", (Term("mmg", (("delta", 1), ("n", 1))),)),
    "service",
)


@dataclass(frozen=True, eq=False)
class Problem:
    """What a method is given to fit."""

    trials: tuple[Trial, ...]  # all, those held out marked `validate`
    used: tuple[Trial, ...]  # those to fit, repaired where asked
    blank: ShipModel  # the model but for its coefficients
    table: Structure  # of the regression; of the MMG form, which has none, a stand-in
    samples: Samples  # the regression
    #: of the candidates for the reference ship of a grey box, where it was chosen among
    #: several
    similarity: dict[str, float]
    sea: dict[str, Any]  # what is known of current and wind, for the provenance
    sampling: dict[str, Any]  # arguments of `build_samples`
    call: dict[str, Any]  # of `identify`, for settings.json


def pose(
    trials: Sequence[Trial],
    options: Options,
    particulars: Given,
    steering: SteeringGear | None,
) -> Problem:
    """Check what was given and make the regression; arguments and errors as in `identify`."""
    everything, sea = in_still_water(
        held_out(trials, options.hold_out), options, particulars
    )
    if not isinstance(steering, SteeringGear | None):
        raise InputError(
            f"steering: {steering!r} found, expected a SteeringGear, or None to"
            " estimate it from the rudders"
        )
    used = [
        repaired(trial) if options.repair else trial
        for trial in everything
        if trial.use == "fit"
    ]
    table, similarity = _table(
        options.structure, options.reference_model, particulars, used
    )
    used = [_at_constant_speed(trial, table, particulars) for trial in used]
    everything = [_at_constant_speed(trial, table, particulars) for trial in everything]
    check_trials(used, table)
    ship = _ship(particulars, used, table)
    for trial in used:
        check_scale(trial, ship, f"trial {trial.name!r}")
    shaft = _shaft_speed(options.service_shaft_speed, used, table)
    smooth = options.preprocessing or options.smooth
    sampling = dict[str, Any](
        samples=options.samples, window=options.window, gear=steering, smooth=smooth
    )
    regression = build_samples(used, table, ship, shaft_speed=shaft, **sampling)
    if options.wind == "constant":
        constants = constant_wind(used, regression, options.structure)
        used = [with_constant_wind(trial, constants) for trial in used]
        everything = [with_constant_wind(trial, constants) for trial in everything]
        regression = build_samples(used, table, ship, shaft_speed=shaft, **sampling)
        sea["wind"] = {"option": "constant", "accelerations": constants}
    check_samples(regression, used, table)
    gear = steering or (estimated_gear(used) if table.has_rudder else SteeringGear())
    blank = _blank(options.name or ship["name"], table, ship, gear, shaft, used)
    call = whole_call(options, everything, particulars, steering)
    return Problem(
        tuple(everything),
        tuple(used),
        blank,
        table,
        regression,
        similarity,
        sea,
        sampling,
        call,
    )


def _at_constant_speed(trial: Trial, table: Structure, particulars: Given) -> Trial:
    """A trial of heading and rudder at the service speed, for a structure of the yaw rate alone."""
    speed = (particulars or {}).get("speed")
    if (
        {"u", "v"} & trial.channels.keys()
        or set(table.symbols) > {"r", "delta"}
        or speed is None
    ):
        return trial
    return trial.with_channels(
        {"u": np.full(len(trial), float(speed)), "v": np.zeros(len(trial))}
    )


def _blank(
    name: str,
    table: Structure,
    ship: Particulars,
    gear: SteeringGear,
    shaft: float,
    used: Sequence[Trial],
) -> ShipModel:
    """The model but for its coefficients, with the envelope of the trials behind it."""
    dynamics = get_dynamics(MMG) if table is MMG_CHANNELS else table
    return ShipModel(
        name=name,
        structure=table.name,
        particulars=ship,
        steering=gear,
        service_shaft_speed=shaft,
        coefficients=dict.fromkeys(dynamics.coefficient_names, 0.0),
        dynamics=dynamics,
        envelope=Envelope.from_samples(
            *(np.concatenate([t[c] for t in used]) for c in ENVELOPE_CHANNELS)
        ),
    )


def held_out(trials: Any, names: Sequence[str]) -> Sequence[Trial]:
    """The trials, those named marked to validate only; InputError for what is no list of different trials."""
    wrong = (
        [trials]
        if isinstance(trials, Trial | str)
        else [t for t in trials if not isinstance(t, Trial)]
    )
    if wrong:
        raise InputError(
            f"trials: {wrong[0]!r} found, expected a list of Trials, such as"
            " ship.trials() of a ship file"
        )
    known = [trial.name for trial in trials]
    if twice := [name for name in known if known.count(name) > 1]:
        raise InputError(
            f"trials: {len(known)} trials found, two of them named {twice[0]!r},"
            " expected different names; rename one with trial.with_(name=...)"
        )
    wanted = [names] if isinstance(names, str) else list(names)
    for name in wanted:
        check_choice(name, known, "hold_out")
    return [
        trial.with_(use="validate") if trial.name in wanted else trial
        for trial in trials
    ]


def _table(
    structure: str | Structure,
    reference: str | ShipModel | None,
    particulars: Given,
    used: Sequence[Trial],
) -> tuple[Structure, dict[str, float]]:
    """The structure by name; a grey box with its reference ship, and the similarity of the candidates."""
    if structure == MMG:
        return MMG_CHANNELS, {}
    if structure != GREY_BOX:
        if reference is not None:
            raise InputError(
                f"reference_model: {reference!r} found with structure"
                f" {name_of(structure)!r}, expected structure 'grey-box'; or leave it"
                " out (to pull coefficients to a ship's, give prior)"
            )
        return (
            structure if isinstance(structure, Structure) else get_structure(structure)
        ), {}
    steering = get_structure("linear-steering")
    check_trials(used, steering)
    return chosen_box(reference, _ship(particulars, used, steering), used)


def _ship(particulars: Given, trials: Sequence[Trial], table: Structure) -> Particulars:
    """Particulars with speed, and for forces inertia and added mass, estimated where absent."""
    if particulars is None:
        raise InputError(
            "particulars: None found, expected those of the ship, at least its length"
            " and its mass and added mass or what they are estimated from: beam,"
            " draught, block_coefficient; for example identify(trials,"
            ' particulars={"length": 7.0, "beam": 1.27, "draught": 0.455,'
            ' "block_coefficient": 0.81}), or ship.particulars of a ship file'
        )
    ship = (
        particulars
        if isinstance(particulars, Particulars)
        else Particulars.from_mapping(particulars)
    )
    if ship.speed is None:
        speed = float(
            np.median([np.hypot(trial["u"][0], trial["v"][0]) for trial in trials])
        )
        if speed <= 0.0:
            raise InputError(
                f"trial {trials[0].name!r}: starts at rest, expected way on the ship;"
                " give the service speed in the particulars (speed, m/s)"
            )
        ship = replace(ship, speed=speed, estimated=ship.estimated | {"speed"})
    return ship.completed() if table.quantity == "force" else ship


def _shaft_speed(
    given: float | None, trials: Sequence[Trial], table: Structure
) -> float:
    """Shaft speed at service speed, 1/s; 0 for a structure that knows no shaft."""
    if "n" not in table.command_names:
        return 0.0
    if given is not None:
        return check_number(given, "service_shaft_speed", above=0.0, hint="in 1/s")
    shaft = float(np.median([trial["n"][0] for trial in trials]))
    if shaft <= 0.0:
        raise InputError(
            f"trial {trials[0].name!r}: starts with a shaft speed of {shaft:g} 1/s,"
            " expected that of service speed; give service_shaft_speed"
        )
    return shaft
