"""Golden section `environments`: what every environment shows over 2,000 steps, in all
its options.

Rows are steered by a helmsman of fixed rules: a rudder that swings smoothly, and a
feedback of heading error and yaw rate, rounded to 1/64. Observations are single
precision: without that rounding a difference of 1e-15 could turn a last digit of an
observation, hence of an action, into a difference of 1e-7.

What a difference grows to before the ship forgets it depends on the ship. When results
are recorded, each case is sailed a second time with a ship longer by 1e-13 of her
length; only the steps before that shows by 1e-9 are kept and compared.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

import shipgym
from tests.golden.store import Floats, vector

STEPS, ROWS, SEED = 2000, 3, 20
#: Infos that are not compared: the cost is the reward's, the others follow from it.
LEFT_OUT = ("cost", "constraints", "episode_cost", "is_success", "episode")
EVERY = 200  # steps between samples, which are of one row after the other
STRETCH, FORGIVEN = 1e-13, 1e-9
TOLERANCES = {
    "": 1e-9,
    "seen ": 3e-7,
    "final seen ": 3e-7,
}  # single observations are single precision


@dataclass(frozen=True)
class Case:
    """An environment as it is made.

    Attributes
    ----------
    env : str
        Its id without the package and the version.
    options : dict
        Its keywords.
    single : bool
        Whether it is made by `gymnasium.make`, not by `make_vec`.
    swing : float
        Amplitude of the rudder's swing, part of its limit.
    """

    env: str
    options: Mapping[str, Any] = field(default_factory=dict)
    single: bool = False
    swing: float = 0.2

    def make(self, stretch: float = 0.0) -> Any:
        """The environment, with ships that are longer by a part `stretch` of their
        length."""
        options = {"bounded": False, **self.options}  # the reward is minus the cost
        if stretch:
            name = options.get(
                "model", gymnasium.spec(self.id).kwargs.get("model", "mariner-tls-svm")
            )
            options["model"] = longer(name, stretch)
            options["ensemble"] = [
                longer(one, stretch) for one in options.get("ensemble", ())
            ]
        if self.single:
            return gymnasium.make(self.id, **options)
        return gymnasium.make_vec(
            self.id, **{"num_envs": ROWS, "autoreset_mode": "SameStep"} | options
        )

    @property
    def id(self) -> str:
        """Its id."""
        return f"shipgym/{self.env}-v0"


def longer(name: str, stretch: float) -> Any:
    """A shipped model, longer by a part of her length."""
    model = shipgym.load_model(name)
    length = model.particulars["length"] * (1.0 + stretch)
    return replace(model, particulars=replace(model.particulars, length=length))


COURSE, PATH = "CourseKeeping", "PathFollowing"
VARIANTS = ("", "Discrete", "Shaft")
CHANGING_SEA = shipgym.Weather(
    current=shipgym.Current(1.0, towards_deg=90.0, variation=0.3),
    wind=shipgym.Wind(12.0, from_deg=20.0),
    waves=shipgym.Waves(3.0, 9.0, from_deg=45.0),
)
GUSTS = shipgym.Weather(
    current=shipgym.Current(0.5),
    wind=shipgym.Wind(14.0),
)
CORNERS = [[0.0, 0.0], [1600.0, 0.0], [2800.0, 900.0], [4000.0, 400.0]]


def cases() -> dict[str, Case]:
    """All cases by name."""
    found = {
        task + variant: Case(task + variant)
        for task in (COURSE, PATH)
        for variant in VARIANTS
    }
    found |= {name: Case(name) for name in ("RudderRoll", f"{PATH}Roll")}
    for model in shipgym.list_models():
        for task in (
            (COURSE, PATH) if model != "mariner-tls-svm" else ()
        ):  # the default of both
            found[f"{task} {model}"] = Case(task, {"model": model})
    for task in (COURSE, PATH):
        for model in ("mariner-tls-svm", "container", "kvlcc2"):
            roll = {"roll": True} if model == "container" else {}
            seas = {
                "moderate noise": {"sea": "moderate", "noise": 1.0},
                "rough filtered": {
                    "sea": "rough",
                    "noise": 1.0,
                    "measurement": "filtered",
                },
            }
            for name, sea in seas.items():
                found[f"{task} {model} {name}"] = Case(
                    task, {"model": model, **sea, **roll}
                )
        more: dict[str, dict[str, Any]] = {
            "shallow": {"model": "tanker", "water_depth": 27.7},
            "long dt": {"dt": 3.0},
            "changing sea": {"sea": CHANGING_SEA},
            "seas": {"sea": ["calm", "slight", GUSTS]},
            "posterior": {"model_uncertainty": "covariance"},
            "ensemble": {"ensemble": ["mariner"], "speed_range": (0.7, 1.0)},
            "loading rough": {"loading_range": (0.9, 1.2), "sea": "rough"},
            "next step": {"autoreset_mode": "NextStep", "episode_steps": 450},
        }
        found |= {
            f"{task} {name}": Case(task, options) for name, options in more.items()
        }
        found[f"{task} single"] = Case(task, {"sea": "moderate"}, single=True)
        found[f"{task} envelope"] = Case(
            task, {"envelope_weight": 0.5, "max_envelope_distance": 1.5}, swing=0.9
        )
    found[f"{COURSE} course changes"] = Case(
        COURSE, {"course_changes_deg": [20.0, -35.0, 10.0]}
    )
    found[f"{COURSE} lost control"] = Case(
        COURSE, {"max_heading_error_deg": 12.0, "episode_steps": 300}
    )
    found[f"{COURSE} posterior grey box"] = Case(
        COURSE,
        {"model": "kvlcc2-rm-svm", "model_uncertainty": "covariance", "sea": "rough"},
    )
    found["RudderRoll astern"] = Case(
        "RudderRoll",
        {"model": "container", "action": "rudder-shaft", "sea": "rough"},
    )
    found[f"{PATH} waypoints"] = Case(
        PATH, {"waypoints": CORNERS, "lookahead": 2.0, "corridor": 0.7}
    )
    found[f"{PATH} aground"] = Case(PATH, {"ground": 1.1, "corridor": 0.5}, swing=0.6)
    found[f"{PATH} sharp turns"] = Case(
        PATH,
        {
            "n_legs": 8,
            "leg_lengths": (5.0, 8.0),
            "max_turn_deg": 110.0,
            "turn_radius": 1.5,
            "ground": 8.0,
        },
    )
    return found


def record(name: str, steps: int | None = None) -> dict[str, Floats]:
    """The values of a case over some steps; by default over as many as can
    be compared."""
    return recorded_case(cases()[name], STEPS, EVERY, steps)


def recorded_case(
    case: Case, longest: int, every: int, steps: int | None = None
) -> dict[str, Floats]:
    """The values of a case over some steps, by default over as many of the longest as
    can be compared."""
    if steps is None:
        history = sailed(case, longest)
        steps = comparable_steps(history, sailed(case, longest, STRETCH))
        history = {key: values[:steps] for key, values in history.items()}
    else:
        history = sailed(case, steps)
    return {"steps": vector(steps)} | summary(history, every)


def sailed(case: Case, steps: int, stretch: float = 0.0) -> dict[str, Floats]:
    """All that an environment shows in each step, by name, each of shape (steps,
    n_rows)."""
    env = case.make(stretch)
    single = env if not case.single else None
    names = list(env.unwrapped.observation_names)
    rows = 1 if case.single else ROWS
    seen, _ = env.reset(seed=SEED)
    history: dict[str, Floats] = {}
    for step in range(steps):
        action = helmsman(np.atleast_2d(seen), names, step, case.swing, env.unwrapped)
        shown = env.step(action if single is not None else action[0])
        for key, values in told(shown, names, env.unwrapped).items():
            if key not in history:
                history[key] = np.zeros((steps, rows))
            history[key][step] = values
        seen, _, terminated, truncated, _ = shown
        if case.single and (terminated or truncated):
            seen, _ = env.reset()
    env.close()
    return history


def helmsman(
    seen: NDArray[np.float32], names: list[str], step: int, swing: float, env: Any
) -> Any:
    """Commands of all rows."""
    rows = np.arange(len(seen))
    sine, cosine, rate = (
        seen[:, names.index(name)].astype(float)
        for name in ("heading_error_sin", "heading_error_cos", "yaw_rate")
    )
    feedback = np.round(64.0 * (1.2 * np.arctan2(sine, cosine) - 0.7 * rate)) / 64.0
    phase = 2.0 * np.pi * step / (60.0 + 20.0 * rows) + rows
    rudder = np.clip(feedback + swing * np.sin(phase), -1.0, 1.0)
    space = getattr(env, "single_action_space", env.action_space)
    if isinstance(space, gymnasium.spaces.Discrete):
        return np.round(0.5 * (rudder + 1.0) * (space.n - 1)).astype(int)
    shaft = 0.7 + 0.3 * np.cos(0.4 * phase)
    return np.stack([rudder, shaft][: space.shape[0]], axis=-1).astype(np.float32)


def told(shown: Any, names: list[str], env: Any) -> dict[str, Any]:
    """What a step showed: observations, reward, flags, infos, those of episodes that
    ended, and the state."""
    seen, reward, terminated, truncated, infos = shown
    found = {
        f"seen {name}": column
        for name, column in zip(names, np.atleast_2d(seen).T, strict=True)
    }
    found |= {"reward": reward, "terminated": terminated, "truncated": truncated}
    found |= {f"state {name}": value for name, value in env.physical_state().items()}
    for name, values in infos.items():
        if name in LEFT_OUT:
            continue
        if name == "final_info":
            found |= {
                f"final {key}": last
                for key, last in values.items()
                if not key.startswith("_") and key not in LEFT_OUT
            }
        elif name == "final_obs":
            ended = np.stack(
                [np.zeros(len(names)) if last is None else last for last in values]
            )
            found |= {
                f"final seen {key}": column
                for key, column in zip(names, ended.T, strict=True)
            }
        elif not name.startswith("_"):
            found[f"info {name}"] = values
    return found


def comparable_steps(
    history: Mapping[str, Floats], perturbed: Mapping[str, Floats]
) -> int:
    """Steps until a difference has grown too large in anything that is double
    precision."""
    steps = len(next(iter(history.values())))
    for name, values in history.items():
        if "seen " in name:
            continue
        scale = max(float(np.abs(values).max()), 1e-6)
        apart = np.abs(perturbed[name] - values).max(axis=1) > FORGIVEN * scale
        if apart.any():
            steps = min(steps, int(np.argmax(apart)))
    return steps


def summary(history: Mapping[str, Floats], every: int) -> dict[str, Floats]:
    """Mean and root mean square of each row, and samples, each of another row than the
    one before."""
    found = {}
    for name, values in history.items():
        steps, rows = values.shape
        when = np.arange(every - 1, steps, every)
        if not len(when):
            when = np.array([steps - 1])
        sums = [values.mean(axis=0), np.sqrt((values**2).mean(axis=0))]
        samples = values[when, np.arange(len(when)) % rows]
        if name in ("terminated", "truncated"):
            found[name] = vector([values.sum(axis=0), np.arange(steps) @ values])
        elif "final " in name:
            found[name] = vector(sums)
        elif name.startswith("seen "):
            found |= {
                name: samples,
                f"observation {name.removeprefix('seen ')}": vector(sums),
            }
        else:
            found[name] = np.concatenate([*sums, samples])
    return found
