"""(c) Esso Osaka on a pond: starts from rest, strong wind, satellite spikes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from identification import Preprocessing
from identification.pipeline import identify
from identification.samples.prediction import predict
from real_ships.data import Data, MeasuredShip
from real_ships.measures import Floats
from real_ships.section import Section, number, table
from shipgym.models import ShipModel
from shipgym.trials.trial import Trial

SHIP, EVERY = "esso_osaka_3m", 2
REFERENCE = "tanker"
LEAST_SPEED = 0.1  # m/s; slower, the ship is taken to be at rest
MEASURES = ("u, m/s", "v, m/s", "r, deg/s", "heading, deg")

REPAIRED = Preprocessing(repair=True)
METHODS: dict[str, dict[str, Any]] = {
    "least squares, nomoto": {"structure": "nomoto", "method": "ls"},
    "least squares, cubic": {"structure": "cubic", "method": "ls"},
    "tls-svm, cubic, repaired": {
        "structure": "cubic",
        "method": "tls-svm",
        "preprocessing": REPAIRED,
    },
    "tls-svm, grey box of the tanker, repaired": {
        "structure": "grey-box",
        "method": "tls-svm",
        "reference_model": REFERENCE,
        "preprocessing": REPAIRED,
    },
    "mmg, prior of formulas, repaired": {"structure": "mmg", "preprocessing": REPAIRED},
}
BARE = f"{REFERENCE}, nothing fitted"
BEST = "tls-svm, cubic, repaired"


def under_way(trial: Trial) -> Trial:
    """The trial from where the ship has way on her."""
    first = int(np.argmax(np.hypot(trial["u"], trial["v"]) > LEAST_SPEED))
    channels = {name: values[first:] for name, values in trial.channels.items()}
    return Trial(
        trial.t[first:], channels, name=trial.name, kind=trial.kind, length=trial.length
    )


def errors(model: ShipModel, trial: Trial) -> Floats:
    """RMSE of u, v, r and heading; NaN after running away or without the channel."""
    prediction = predict(model, trial)
    found = []
    for channel in ("u", "v", "r", "psi"):
        if prediction is None or channel not in prediction:
            found.append(float("nan"))
            continue
        rms = float(np.sqrt(np.mean((prediction[channel] - trial[channel]) ** 2)))
        found.append(float(np.degrees(rms)) if channel in ("r", "psi") else rms)
    return np.array(found)


def study(ship: MeasuredShip, settings: dict[str, Any]) -> dict[str, Any]:
    """Each zigzag predicted from the five others."""
    names = [name for name in ship.runs if name.startswith("zigzag")]
    found: dict[str, Any] = {"way": [], "unstable": 0, "models": {}}
    for held in names:
        runs = [ship.runs[name] for name in names if name != held]
        result = identify(
            runs, particulars=ship.particulars, steering=ship.steering, **settings
        )
        found["way"].append(errors(result.model, under_way(ship.runs[held])))
        found["unstable"] += not result.stable
        found["models"][held] = result.model
    return found


def bare_study(ship: MeasuredShip) -> dict[str, Any]:
    """The same of the reference ship, at the fastest shaft speed of the runs."""
    names = [name for name in ship.runs if name.startswith("zigzag")]
    shaft = max(float(ship.runs[name]["n"].max()) for name in names)
    model = fastest(ship, shaft)
    found: dict[str, Any] = {
        "way": [],
        "unstable": 0,
        "models": dict.fromkeys(names, model),
    }
    for name in names:
        found["way"].append(errors(model, under_way(ship.runs[name])))
    return found


def fastest(ship: MeasuredShip, shaft: float) -> ShipModel:
    """The reference ship at this scale and at the speed of the fastest approach."""
    from shipgym.models import converted_model
    from shipgym.ships.steering import SteeringGear

    return converted_model(
        REFERENCE, ship.particulars, ship.steering or SteeringGear(), shaft
    )


def run(data: Data) -> Section:
    """The case."""
    ship = data.ship(SHIP, EVERY)
    found = {BARE: bare_study(ship)} | {
        name: study(ship, settings) for name, settings in METHODS.items()
    }
    text = TEXT.format(
        way=table(
            ["fit", *MEASURES, "ran away", "refused by the guard"],
            [_row(n, f) for n, f in found.items()],
        ),
        size=table(["", *MEASURES], [["root mean square of the runs", *_size(ship)]]),
    )
    return Section(
        "Esso Osaka, zigzags from rest in wind",
        text,
        {"real_ships_c.svg": _painter(ship, found)},
    )


def _cells(found: list[Floats]) -> list[str]:
    every = np.array(found)
    if np.isnan(every).all(axis=0).any():
        means = [
            np.nan if np.isnan(column).all() else float(np.nanmean(column))
            for column in every.T
        ]
    else:
        means = np.nanmean(every, axis=0).tolist()
    return [
        number(value, digits) for value, digits in zip(means, (3, 3, 2, 1), strict=True)
    ]


def _row(name: str, found: dict[str, Any]) -> list[str]:
    away = int(sum(np.isnan(error[2]) for error in found["way"]))
    return [
        name,
        *_cells(found["way"]),
        f"{away} of {len(found['way'])}",
        str(found["unstable"]),
    ]


def _size(ship: MeasuredShip) -> list[str]:
    """How large the motion is that is predicted."""
    runs = [
        under_way(trial)
        for name, trial in ship.runs.items()
        if name.startswith("zigzag")
    ]
    scale = {"u": 1.0, "v": 1.0, "r": np.degrees(1.0), "psi": np.degrees(1.0)}
    means = [
        float(np.mean([np.sqrt(np.mean(t[c] ** 2)) for t in runs])) * k
        for c, k in scale.items()
    ]
    return [
        number(value, digits) for value, digits in zip(means, (3, 3, 2, 1), strict=True)
    ]


def _painter(ship: MeasuredShip, found: dict[str, Any]) -> Callable[[Any], None]:
    names = [name for name in ship.runs if name.startswith("zigzag")][-2:]

    def paint(figure: Any) -> None:
        axes = figure.subplots(2, len(names), sharex="col")
        for column, name in enumerate(names):
            trial = ship.runs[name]
            for row, (channel, scale) in enumerate(
                (("u", 1.0), ("psi", np.degrees(1.0)))
            ):
                axes[row][column].plot(
                    trial.t - trial.t[0],
                    scale * trial[channel],
                    "k",
                    lw=1.2,
                    label="measured",
                )
                for label in (BARE, "least squares, cubic", BEST):
                    prediction = predict(found[label]["models"][name], trial)
                    if prediction is not None:
                        axes[row][column].plot(
                            prediction.t - trial.t[0],
                            scale * prediction[channel],
                            lw=0.8,
                            label=label,
                        )
            axes[0][column].set_title(f"{name}, from rest")
            axes[1][column].set_xlabel("t, s")
        axes[0][0].set_ylabel("u, m/s")
        axes[1][0].set_ylabel("heading, deg")
        axes[0][0].legend(fontsize=5.5)

    return paint


TEXT = """
Each of the six zigzags is predicted from the five others, open loop from measured
rudder and shaft speed at 5 Hz. The ship is at rest at first; `cubic`, the grey box and
`mmg` include the shaft speed and so can start from rest. Errors from when she has way
on (0.1 m/s):

{way}

For comparison, the size of the motion:

{size}

**Limits.** The wind is a third of the ship's speed and no model here includes it: its
effect on the heading counts as error. About half of the yaw rate is predicted; the
error of heading, its integral, is larger than the motion itself. Each run has its own
shaft speed (10 to 17 1/s), so that most predictions are at a speed that few of the
other runs cover.

![Zigzags from rest](images/real_ships_c.svg)
"""
