"""The problem that trials and options pose, its data checked."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.pipeline.options import Given, Options, name_of
from identification.samples.checks import check_samples, check_trials
from identification.samples.preprocess import repaired
from identification.samples.problem import Problem
from identification.samples.rudder import estimated_gear
from identification.samples.samples import build_samples
from shipgym import InputError, Particulars, ShipModel, SteeringGear, Trial
from shipgym.arrays import Floats
from shipgym.ships import Envelope, Structure, Term, get_structure
from shipgym.ships.structures import GREY_BOX, MMG, get_dynamics
from shipgym.trials.scale import check_scale

#: Stands for the MMG form where channels, excitation and particulars are checked.
MMG_CHANNELS = Structure(
    MMG,
    "stand-in",
    dict.fromkeys("uvr", (Term("mmg", (("delta", 1), ("n", 1))),)),
    "service",
)


def pose(trials: Sequence[Trial], options: Options) -> Problem:
    """Check trials and options, and make the regression; errors as in `identify`."""
    particulars = options.particulars
    everything = list(trials)
    used = [trial for trial in trials if trial.use == "fit"]
    if options.preprocessing.repair:
        used = [repaired(trial) for trial in used]

    table, similarity = _table(options, used)
    is_yaw_alone = set(table.symbols) <= {"r", "delta"}
    if is_yaw_alone:
        used = [_at_service_speed(trial, particulars) for trial in used]
        everything = [_at_service_speed(trial, particulars) for trial in everything]
    check_trials(used, table)
    ship = _ship(particulars, used, table)
    for trial in used:
        check_scale(trial, ship, f"trial {trial.name!r}")
    shaft = _shaft_speed(options.service_shaft_speed, used, table)
    sampling = {
        "samples": options.samples.rule,
        "window": options.samples.window,
        "smoothing": options.preprocessing.smoothing,
        "gear": options.steering,
    }
    samples = build_samples(
        used, structure=table, particulars=ship, shaft_speed=shaft, **sampling
    )
    check_samples(samples, used, table)
    gear = options.steering
    if gear is None:
        gear = estimated_gear(used) if table.has_rudder else SteeringGear()
    dynamics = get_dynamics(MMG) if table is MMG_CHANNELS else table
    blank = ShipModel(
        name=options.name or ship["name"],
        structure=table.name,
        particulars=ship,
        steering=gear,
        service_shaft_speed=shaft,
        coefficients=dict.fromkeys(dynamics.coefficient_names, 0.0),
        dynamics=dynamics,
        envelope=_envelope(used, table, ship),
    )
    return Problem(
        trials=tuple(everything),
        used=tuple(used),
        blank=blank,
        table=table,
        samples=samples,
        similarity=similarity,
        sampling=sampling,
    )


def _at_service_speed(trial: Trial, particulars: Given) -> Trial:
    """A trial without sway as if it had none, without surge as if at service speed."""
    if "v" in trial:
        return trial
    missing = {"v": np.zeros(len(trial))}
    speed = None
    if particulars is not None:
        speed = particulars.get("speed")
    if "u" not in trial:
        if speed is None:
            return trial
        missing["u"] = np.full(len(trial), float(speed))
    return trial.with_channels(missing)


def _envelope(trials: Sequence[Trial], table: Structure, ship: Particulars) -> Envelope:
    """Envelope of the trials; a model of yaw alone keeps to the service speed."""
    channels = {
        name: np.concatenate([trial[name] for trial in trials])
        for name in ("u", "v", "r", "delta")
    }
    if not {"u", "v"} & table.equations.keys():
        channels["u"] = np.full_like(channels["r"], ship["speed"])
        channels["v"] = np.zeros_like(channels["r"])
    return Envelope.from_samples(**channels)


def _table(
    options: Options, used: Sequence[Trial]
) -> tuple[Structure, dict[str, float]]:
    """The structure; for a grey box also the similarity of the candidates."""
    structure, reference = options.structure, options.reference_model
    if structure == GREY_BOX:
        from identification.models.similarity import chosen_box

        steering = get_structure("linear-steering")
        check_trials(used, steering)
        ship = _ship(options.particulars, used, steering)
        return chosen_box(reference, ship, used)
    if reference is not None:
        raise InputError(
            "reference_model: expected none with structure"
            f" {name_of(structure)!r}, got {name_of(reference)!r}; leave it out, or"
            " choose structure 'grey-box' (what pulls the coefficients of 'mmg' is its"
            " prior)"
        )
    if structure == MMG:
        return MMG_CHANNELS, {}
    if not isinstance(structure, Structure):
        structure = get_structure(str(structure))
    return structure, {}


def _ship(particulars: Given, trials: Sequence[Trial], table: Structure) -> Particulars:
    """Particulars with those that are needed estimated where absent.

    Needed are the speed, and for structures of forces inertia and added mass.
    """
    if particulars is None:
        raise InputError(
            "particulars: expected those of the ship, at least its length and its mass"
            " and added mass or what they are estimated from: beam, draught,"
            " block_coefficient; got None; for example identify(trials,"
            ' particulars={"length": 7.0, "beam": 1.27, "draught": 0.455,'
            ' "block_coefficient": 0.81}), or ship.particulars of a ship file'
        )
    ship = particulars
    if not isinstance(ship, Particulars):
        ship = Particulars.from_mapping(ship)
    if ship.speed is None:
        speed = _speed_at_start(trials)
        ship = replace(ship, speed=speed, estimated=ship.estimated | {"speed"})
    return ship.completed() if table.quantity == "force" else ship


def _speed_at_start(trials: Sequence[Trial]) -> float:
    """Median of the speeds at which the trials start, m/s."""
    starts = [_service(one.t, np.hypot(one["u"], one["v"])) for one in trials]
    speed = float(np.median(starts))
    if speed <= 0.0:
        raise InputError(
            f"trial {trials[0].name!r}: expected way on the ship at the start, got"
            " a ship at rest; give the service speed in the particulars (speed,"
            " m/s)"
        )
    return speed


def _service(t: Floats, values: Floats) -> float:
    """Value at the start of a trial; of one that starts at rest its largest steady one.

    Steady is what changes by less than a twentieth within a tenth of the trial.
    """
    rows = max(3, t.size // 10)
    parts = np.split(values[: t.size // rows * rows], t.size // rows)
    steady = [
        float(np.mean(part))
        for part in parts
        if np.ptp(part) < 0.05 * np.abs(part).max()
    ]
    start, largest = float(values[0]), max([float(values[0]), *steady])
    return largest if start < 0.2 * largest else start


def _shaft_speed(
    given: float | None,
    trials: Sequence[Trial],
    table: Structure,
) -> float:
    """Shaft speed at service speed, 1/s; 0 for a structure that knows no shaft."""
    if "n" not in table.command_names:
        return 0.0
    if given is not None:
        return float(given)
    shaft = float(np.median([_service(trial.t, trial["n"]) for trial in trials]))
    if shaft <= 0.0:
        raise InputError(
            f"trial {trials[0].name!r}: expected the shaft speed of service speed at"
            f" the start, got {shaft:g} 1/s; give service_shaft_speed"
        )
    return shaft
