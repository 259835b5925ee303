"""Draw the pictures of the gallery and write its page.

`python scripts/gallery.py` draws all, `python scripts/gallery.py turning_circle zigzag`
some, into `docs/images/gallery`, and writes `docs/gallery.md` with the lines of each
function below.
"""

from __future__ import annotations

import inspect
import sys
import tempfile
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

import shipgym
from agents import LQ, PID, LineOfSight, WheelOver, step_response
from agents.training.plan import Given, make_plan
from agents.training.training import train
from identification import coefficient_history, identify
from identification.validation.prediction import predict
from shipgym import Current, Waves, Weather, manoeuvres
from shipgym.manoeuvres import zigzag

DOCS = Path(__file__).parents[1] / "docs"
IMAGES = DOCS / "images" / "gallery"
SIZE, DPI = (6.4, 3.4), 110  # inches, dots an inch
STYLE = {
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "font.size": 9,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
}
INTRODUCTION = """\
# Gallery

Each picture is shown with the code that draws it, after these imports. `python scripts/gallery.py` draws all
of them again.

```python
{imports}
```"""
TOPICS: dict[str, list[Callable[[], Any]]] = {}


def topic(name: str) -> Callable[[Callable[[], Any]], Callable[[], Any]]:
    """Put a picture under a heading of the page."""

    def put(draw: Callable[[], Any]) -> Callable[[], Any]:
        TOPICS.setdefault(name, []).append(draw)
        return draw

    return put


@topic("Trials and models")
def measured_and_identified() -> None:
    """A zigzag that took no part in the fit, measured and predicted from the measured rudder."""
    ship = shipgym.ShipFile.load(shipgym.example_ship())
    result = identify(
        ship.trials(), particulars=ship.particulars, steering=ship.steering
    )
    trial = next(one for one in ship.trials() if one.use == "validate")
    prediction = predict(result.model, trial)
    plt.plot(trial.t, np.degrees(trial["delta"]), color="0.7", label="rudder, measured")
    plt.plot(
        trial.t,
        np.degrees(trial["psi"] - trial["psi"][0]),
        "k",
        label="heading, measured",
    )
    plt.plot(
        prediction.t,
        np.degrees(prediction["psi"] - trial["psi"][0]),
        "C3--",
        label="heading, predicted",
    )
    plt.xlabel("t, s"), plt.ylabel("deg"), plt.ylim(-30, 40), plt.legend(ncols=3)


@topic("Trials and models")
def uncertainty_band() -> None:
    """A 20/20 zigzag of an identified model, and of 60 models drawn from its covariance."""
    model = shipgym.load_model("kvlcc2-tanker-rm-svm")
    runs = [zigzag(one, 20, 20, duration=900) for one in model.sample(60, seed=0)]
    headings = np.degrees([run["psi"] for run in runs])
    best, truth = (
        zigzag(one, 20, 20, duration=900) for one in (model, shipgym.truth_of(model))
    )
    plt.fill_between(
        best.t,
        *np.percentile(headings, [2.5, 97.5], axis=0),
        alpha=0.3,
        label="95 % of the models",
    )
    plt.plot(best.t, np.degrees(best["psi"]), label="identified")
    plt.plot(
        truth.t, np.degrees(truth["psi"]), "k--", label="the ship behind the trials"
    )
    (
        plt.xlabel("t, s"),
        plt.ylabel("heading, deg"),
        plt.ylim(-40, 55),
        plt.legend(ncols=3),
    )


@topic("Trials and models")
def recursive_estimates() -> None:
    """Coefficients that converge as a log is read sample by sample."""
    mariner = shipgym.load_model("mariner")
    trial = zigzag(mariner, 20, 20, duration=400, dt=0.5)
    found = coefficient_history(trial, "linear-steering", mariner.particulars, "mils")
    for name in ("b_v", "b_r", "b_d"):
        plt.plot(found.t, found.values[:, found.names.index(name)], label=name)
    plt.xlabel("t, s"), plt.ylim(-3, 1.5), plt.legend()


@topic("Manoeuvres")
def turning_circles() -> None:
    """Turning circles with 35 degrees of rudder."""
    for name in ("mariner", "container", "kvlcc2", "tanker"):
        trial = manoeuvres.turning_circle(shipgym.load_model(name), 35, duration=1200)
        plt.plot(trial["y"], trial["x"], label=name)
    plt.axis("equal"), plt.xlabel("east, m"), plt.ylabel("north, m"), plt.legend()


@topic("Manoeuvres")
def overshoot() -> None:
    """A 20/20 zigzag of the Mariner and its overshoot angles."""
    trial = zigzag(shipgym.load_model("mariner"), 20, 20, duration=400)
    indices = manoeuvres.zigzag_indices(trial)
    plt.plot(trial.t, np.degrees(trial["delta"]), color="0.6", label="rudder")
    plt.plot(trial.t, np.degrees(trial["psi"]), label="heading")
    plt.title(
        f"overshoots {indices.overshoot_1_deg:.1f} and"
        f" {indices.overshoot_2_deg:.1f} deg"
    )
    plt.xlabel("t, s"), plt.ylabel("deg"), plt.ylim(-30, 40), plt.legend(ncols=2)


@topic("Manoeuvres")
def spiral() -> None:
    """The spiral of a tanker that is unstable on a straight course: two yaw rates for one rudder angle."""
    found = manoeuvres.direct_spiral(shipgym.load_model("tanker"))
    plt.plot(found.rudder_deg, found.yaw_rate_deg_s, ".-"), plt.xlim(-6, 6)
    plt.xlabel("rudder, deg"), plt.ylabel("steady yaw rate, deg/s")


@topic("Manoeuvres")
def shallow_water() -> None:
    """The same tanker turning in deep and in shallow water."""
    tanker = shipgym.load_model("tanker")
    for label, depth in {"deep": np.inf, "45 m": 45, "25 m": 25}.items():
        trial = manoeuvres.turning_circle(tanker, 35, duration=1800, water_depth=depth)
        plt.plot(trial["y"], trial["x"], label=label)
    plt.axis("equal"), plt.xlabel("east, m"), plt.ylabel("north, m"), plt.legend()


@topic("Weather")
def drifting_circle() -> None:
    """A turning circle in a current of one knot setting east, and in calm water."""
    mariner = shipgym.load_model("mariner")
    for label, sea in {
        "calm": None,
        "current": Weather(current=Current(0.514, towards_deg=90)),
    }.items():
        trial = manoeuvres.turning_circle(mariner, 20, duration=1500, weather=sea)
        plt.plot(trial["y"], trial["x"], label=label)
    plt.axis("equal"), plt.xlabel("east, m"), plt.ylabel("north, m"), plt.legend()


@topic("Weather")
def course_in_waves() -> None:
    """An LQ autopilot keeps a course in calm water and in two seas."""
    mariner = shipgym.load_model("mariner")
    for sea in ("calm", "moderate", "rough"):
        env = gym.make(
            "shipgym/CourseKeeping-v0", model=mariner, sea=sea, course_change_deg=0
        )
        pilot, headings = LQ.from_model(mariner), []
        observation, _ = env.reset(seed=4)
        for _ in range(200):
            observation, *_ = env.step(pilot.predict(observation)[0])
            headings.append(np.degrees(env.unwrapped.physical_state()["psi"]))
        plt.plot(np.array(headings) - headings[-1], label=sea)
    plt.xlabel("control interval"), plt.ylabel("heading, deg"), plt.legend()


@topic("Weather")
def wave_spectra() -> None:
    """Wave spectra with the same significant height and different peak enhancement."""
    frequency = np.linspace(0.3, 1.8, 200)
    for peak in (1.0, 3.3, 7.0):
        waves = Waves(2.5, 9.0, peak_enhancement=peak)
        plt.plot(
            frequency,
            shipgym.sea.wave_spectrum(waves, frequency),
            label=f"peak enhancement {peak:g}",
        )
    plt.xlabel("frequency, rad/s"), plt.ylabel("m² s"), plt.legend()


@topic("Autopilots")
def heading_change() -> None:
    """A change of heading by 20 degrees: PID and LQ on 20 models that fit the same two zigzags."""
    model = shipgym.load_model("container-two-zigzags")
    for k, design in enumerate((PID, LQ)):
        found = step_response(design.from_model(model), model.sample(20, seed=0), 20)
        plt.plot(found.t, np.degrees(found.heading).T, f"C{k}", lw=0.6)
        plt.plot([], [], f"C{k}", label=design.__name__)
    plt.xlabel("t, s"), plt.ylabel("heading, deg"), plt.legend(loc="lower right")


@topic("Autopilots")
def around_the_corners() -> None:
    """A path with sharp turns: line of sight, and wheel-over, which begins turns in good time."""
    kvlcc2 = shipgym.load_model("kvlcc2")
    waypoints = [[0, 0], [3500, 0], [5500, 3000], [2500, 5500], [2500, 9000]]
    env = gym.make(
        "shipgym/PathFollowing-v0", model=kvlcc2, waypoints=waypoints
    ).unwrapped
    plt.plot(*np.transpose(waypoints)[::-1], "o--", color="0.6", label="path")
    for design in (LineOfSight, WheelOver):
        pilot, memory, track, over = design.from_model(kvlcc2), None, [], False
        observation, _ = env.reset(seed=0)
        while not over:
            action, memory = pilot.predict(observation, memory)
            observation, _, terminated, truncated, _ = env.step(action)
            track.append((env.physical_state()["y"], env.physical_state()["x"]))
            over = terminated or truncated
        plt.plot(*np.transpose(track), label=design.__name__)
    plt.axis("equal"), plt.xlabel("east, m"), plt.ylabel("north, m"), plt.legend()


@topic("Environments")
def frame() -> None:
    """A frame of path following, version 1: the path with its arcs, the corridor, the ship and her track."""
    env = gym.make("shipgym/PathFollowing-v1", sea="moderate", render_mode="rgb_array")
    pilot, memory = (
        WheelOver.from_model(env.unwrapped.model, task=env.unwrapped.task),
        None,
    )
    observation, _ = env.reset(seed=3)
    for _ in range(420):
        action, memory = pilot.predict(observation, memory)
        observation, *_ = env.step(action)
    plt.gcf().set_size_inches(4.5, 4.5), plt.imshow(env.render()), plt.axis("off")


@topic("Environments")
def many_ships() -> None:
    """512 ships in one vector environment, in three seas, each on a course of her own."""
    envs = gym.make_vec(
        "shipgym/CourseKeeping-v0", num_envs=512, sea=["calm", "moderate", "rough"]
    )
    pilot = LQ.from_model(shipgym.load_model("mariner-tls-svm"))
    observations, _ = envs.reset(seed=0)
    tracks = []
    for _ in range(150):
        observations, *_ = envs.step(pilot.predict(observations)[0])
        tracks.append([envs.physical_state()["y"], envs.physical_state()["x"]])
    plt.plot(*np.moveaxis(tracks, 1, 0), lw=0.3, alpha=0.5)
    plt.axis("equal"), plt.xlabel("east, m"), plt.ylabel("north, m")


@topic("Environments")
def learning_curve() -> None:
    """PPO learns to keep a course: cost of an episode during training, and that of LQ."""
    with tempfile.TemporaryDirectory() as folder:
        plan = make_plan(
            Given(
                "ppo",
                environment="course-keeping",
                settings={"total_steps": 200_000, "base": "none"},
            )
        )
        found = train(plan, f"{folder}/run")
    plt.plot(
        *np.transpose([(row["steps"], row["cost"]) for row in found.curve]),
        ".-",
        label="PPO",
    )
    plt.axhline(found.lq_cost, color="0.5", ls="--", label="LQ")
    (
        plt.xlabel("steps"),
        plt.ylabel("cost of an episode"),
        plt.yscale("log"),
        plt.legend(),
    )


def home() -> None:
    """Draw the first page's picture: trials, the model with its uncertainty, an autopilot on a path."""
    _, panels = plt.subplots(1, 3, figsize=(12.0, 2.7), dpi=100, layout="constrained")
    plt.sca(panels[0])
    for trial in shipgym.ShipFile.load(shipgym.example_ship()).trials():
        plt.plot(
            trial.t,
            np.degrees(trial["psi"] - trial["psi"][0]),
            label=trial.name.removesuffix(".csv"),
        )
    plt.xlabel("t, s"), plt.ylabel("heading, deg"), plt.xlim(0, 500), plt.ylim(-45, 60)
    plt.sca(panels[1]), uncertainty_band()
    plt.sca(panels[2]), around_the_corners()
    titles = ("1  recorded trials", "2  a model, with its uncertainty", "3  autopilots")
    for panel, title in zip(panels, titles, strict=True):
        panel.set_title(title, loc="left", fontweight="bold")
        columns, spacing = (
            1 if panel is panels[2] else 3,
            {"columnspacing": 0.6, "handlelength": 1.2},
        )
        panel.legend(
            fontsize=7, ncols=columns, **spacing, handletextpad=0.4, loc="upper right"
        )


def main(names: list[str]) -> None:
    """Draw the pictures that are named, or all, and write the page."""
    IMAGES.mkdir(parents=True, exist_ok=True)
    known = {draw.__name__: draw for drawn in TOPICS.values() for draw in drawn}
    with mpl.rc_context(STYLE):
        if not names or "home" in names:
            home()
            plt.savefig(DOCS / "images" / "home.webp", pil_kwargs={"quality": 80})
        for name in [one for one in names if one != "home"] or ([] if names else known):
            plt.figure(figsize=SIZE, dpi=DPI, layout="constrained")
            known[name]()
            plt.savefig(IMAGES / f"{name}.webp", pil_kwargs={"quality": 80})
            plt.close("all")
            print(name)
    (DOCS / "gallery.md").write_text(page(), encoding="utf-8")


def page() -> str:
    """The gallery in Markdown."""
    text = Path(__file__).read_text(encoding="utf-8")
    imports = text[text.index("import gymnasium") : text.index("\nDOCS")].strip()
    lines = [INTRODUCTION.format(imports=f"import tempfile\n\n{imports}")]
    for name, drawn in TOPICS.items():
        lines.append(f"## {name}")
        for draw in drawn:
            title = str(draw.__doc__)
            source = inspect.getsource(draw).split('"""', 2)[2]
            code = textwrap.dedent(source.replace("\n\n\n", "\n")).strip()
            file = f"{draw.__name__}.webp"
            width, height = Image.open(IMAGES / file).size
            picture = (
                f"![{title}](images/gallery/{file}){{ width={width} height={height} }}"
            )
            lines += [f"**{title}**", picture, f"```python\n{code}\n```"]
    return "\n\n".join(lines) + "\n"


if __name__ == "__main__":
    main(sys.argv[1:])
