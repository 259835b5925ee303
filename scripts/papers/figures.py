"""The figures of `docs/reproduction.md`, drawn from the data of the rows."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from identification.estimators.recursive import MultiInnovationLeastSquares
from identification.samples.prediction import predict
from papers import (
    cao2015,
    comparators,
    get_paper,
    mei2019,
    mei2019_targets,
    song2020,
    song2020_nomoto,
    xu2020_rank,
)
from papers.coefficient_history import coefficient_history
from papers.zhu2018 import (
    container_ship,
    fits,
    recursive_start,
    sample_counts,
    steering_forms,
)
from papers.zhu2018.ships import zigzag_trial
from shipgym.models import load_model

WIDTH, DPI = 9.0, 100  # of a figure, inches; dots an inch
TRUTH = {"color": "black", "lw": 1.6}
THEIRS, OTHER, OURS, NEURAL = (
    {"color": colour, "lw": 1.1}
    for colour in ("tab:red", "tab:orange", "tab:blue", "tab:green")
)
DASHED = {"ls": "--"}


def cao(axes: Any) -> None:
    """Heading of the zigzag and track of the turn."""
    models: dict[str, tuple[Any, Any]] = {
        "Mariner": (load_model("mariner"), TRUTH),
        "Euler": (cao2015.as_printed("euler"), OTHER),
        "integral, trapezoid": (cao2015.as_printed("integral"), THEIRS),
        "at best": (cao2015.at_best(), OURS | DASHED),
    }
    zigzag, turn = (
        {label: run(model) for label, (model, _) in models.items()}
        for run in cao2015.MANOEUVRES.values()
    )
    for label, (_, style) in models.items():
        axes[0].plot(
            zigzag[label].t, np.degrees(zigzag[label]["psi"]), label=label, **style
        )
        axes[1].plot(turn[label]["y"], turn[label]["x"], label=label, **style)
    axes[0].set(
        title="25/25 zigzag", xlabel="t, s", ylabel="heading, deg", ylim=(-60.0, 60.0)
    )
    axes[1].set(
        title="30 deg turning circle", xlabel="y, m", ylabel="x, m", aspect="equal"
    )


def xu(axes: Any) -> None:
    """Singular values, and errors against rank and noise."""
    ranks = np.arange(1, 39)
    axes[0].semilogy(
        ranks, xu2020_rank.decomposition()[1], ".-", label="38 terms", **OTHER
    )
    axes[0].semilogy(
        ranks[:18], xu2020_rank.reduced_values(), ".-", label="18 of Table 11", **OURS
    )
    axes[0].set(title="singular values", xlabel="number")
    colours = ("tab:blue", "tab:green", "tab:orange", "tab:red")
    for noise, colour in zip(xu2020_rank.NOISES, colours, strict=True):
        found = xu2020_rank.errors(noise)
        rank = int(np.median(found.ranks))
        for axis, values in zip(
            axes[1:], (found.coefficients, found.forces), strict=True
        ):
            axis.semilogy(
                ranks, values, color=colour, lw=1.1, label=f"noise {100 * noise:g} %"
            )
            axis.plot(rank, values[rank - 1], "o", color=colour)
    axes[1].set(title="error of coefficients, relative", xlabel="rank kept")
    axes[2].set(title="error of forces, relative", xlabel="rank kept")


def recursion(axes: Any) -> None:
    """Two of the Mariner's six parameters, sample by sample."""
    t = np.arange(len(recursive_start.history("RLS"))) * recursive_start.INTERVAL
    styles = {"RLS": OTHER, "LSSVR-RLS": OURS}
    for axis, name, limits in zip(
        axes, ("a11", "a22"), ((-1.4, 0.0), (-6.0, 4.0)), strict=True
    ):
        k = recursive_start.NAMES.index(name)
        for euler in (False, True):
            for method, style in styles.items():
                label = f"{method}, ship by {'Euler' if euler else 'Runge-Kutta'}"
                path = recursive_start.history(method, euler)[:, k]
                axis.plot(t, path, label=label, **(style | (DASHED if euler else {})))
        axis.axhline(recursive_start.TRUTH[k], label="truth", color="black", lw=1.0)
        axis.set(title=name, xlabel="t, s", ylim=limits)


def container(axes: Any) -> None:
    """Sway and yaw rate of the 20/20 zigzag."""
    trial = zigzag_trial(20, by_euler=True)
    seven, four = (
        container_ship.as_printed("ABC"),
        steering_forms.as_printed(steering_forms.CHOSEN),
    )
    best = predict(container_ship.best_steering(), trial)
    assert best is not None
    runs: dict[str, tuple[Any, Any]] = {
        "container ship": (trial, TRUTH),
        "seven terms, ABC": (fits.steer(seven["v"], seven["r"], trial), OTHER),
        "chosen four, ABC": (fits.steer(four["v"], four["r"], trial), THEIRS),
        "neural network": (
            comparators.container_networks()[0].run(trial, ("v", "r")),
            NEURAL,
        ),
        "at best": (best, OURS | DASHED),
    }
    shown = trial.t < 500.0
    for label, (run, style) in runs.items():
        axes[0].plot(trial.t[shown], run["v"][shown], label=label, **style)
        axes[1].plot(trial.t[shown], np.degrees(run["r"][shown]), label=label, **style)
    axes[0].set(title="sway speed, m/s", xlabel="t, s")
    axes[1].set(title="yaw rate, deg/s", xlabel="t, s")


def samples(axes: Any) -> None:
    """Errors of prediction against the number of samples."""
    counts = np.array(sample_counts.COUNTS)
    for axis, (q, name) in zip(axes, container_ship.EQUATIONS.items(), strict=True):
        theirs = [sample_counts.learned(count)[0][q] for count in sample_counts.COUNTS]
        best = [sample_counts.learned_best(count)[q] for count in sample_counts.COUNTS]
        for label, values, style in (
            ("as the thesis", theirs, THEIRS),
            ("at best", best, OURS),
        ):
            finite = np.where(
                np.array(values) < 1e3, values, np.nan
            )  # the others ran away
            axis.semilogy(counts, finite, ".-", label=label, **style)
        axis.axhline(
            sample_counts.WITH_ALL[q],
            color="black",
            lw=1.0,
            label="printed, all samples",
            **DASHED,
        )
        axis.set(title=f"{name}, {container_ship.UNITS[q]}", xlabel="samples")


def nomoto(axes: Any) -> None:
    """K and T sample by sample."""
    run, names = song2020_nomoto.trial("nomoto"), tuple(song2020_nomoto.TRUTH["nomoto"])
    X, y = song2020_nomoto.regression("nomoto", run)
    times, history = coefficient_history(
        run, "nomoto", song2020_nomoto.PARTICULARS, MultiInnovationLeastSquares()
    )
    paths = {
        "SG": (run.t[1:], song2020.gradient_history(X, y)[0], OTHER),
        "NISG": (
            run.t[1:],
            song2020.gradient_history(X, y, omega=song2020_nomoto.OMEGA)[0],
            THEIRS,
        ),
        "TMILS": (times, np.column_stack([history[name] for name in names]), OURS),
        "extended Kalman filter, noise": (
            run.t,
            comparators.nomoto_history("nomoto"),
            NEURAL,
        ),
    }
    for label, (t, (c_r, c_d), style) in (
        (k, (t, path.T, style)) for k, (t, path, style) in paths.items()
    ):
        with np.errstate(divide="ignore", invalid="ignore"):
            indices = -c_d / c_r, -1.0 / c_r
        for axis, values in zip(axes, indices, strict=True):
            axis.plot(t, values, label=label, **style)
    for axis, value, name in zip(
        axes, (song2020_nomoto.K, song2020_nomoto.T), ("K, 1/s", "T, s"), strict=True
    ):
        axis.axhline(value, color="black", lw=1.0, label="truth", **DASHED)
        axis.set(title=name, xlabel="t, s", ylim=(0.0, 2.0 * value))


def turns(axes: Any) -> None:
    """Tracks of the turns to both sides."""
    target = mei2019_targets.virtual()
    models: dict[str, tuple[Any, Any]] = {
        "bare tanker": (target.bare(mei2019_targets.TANKER), OTHER),
        "RM-SVM as the paper": (mei2019_targets.papers_way(target).model, THEIRS),
        "RM-SVM at best": (
            mei2019_targets.our_way(target, mei2019_targets.same_hull()).model,
            OURS | DASHED,
        ),
    }
    for axis, rudder in zip(axes, (mei2019.HARD, -mei2019.HARD), strict=True):
        truth = comparators.sampled_turn(rudder)
        runs: dict[str, tuple[Any, Any]] = {"MMG model": (truth, TRUTH)}
        runs |= {
            label: (target.turn(model, rudder), style)
            for label, (model, style) in models.items()
        }
        runs["neural network"] = (
            comparators.turned(comparators.tanker_networks()[0], truth),
            NEURAL,
        )
        for label, (run, style) in runs.items():
            axis.plot(
                run["y"] / truth.length, run["x"] / truth.length, label=label, **style
            )
        axis.set(
            title=f"{rudder:+.0f} deg", xlabel="y / L", ylabel="x / L", aspect="equal"
        )


#: What draws a figure, on how many axes, and the figure's height in inches.
FIGURES: dict[str, tuple[Callable[[Any], None], int, float]] = {
    "reproduction_cao2015.png": (cao, 2, 3.8),
    "reproduction_xu2020.png": (xu, 3, 3.4),
    "reproduction_zhu2018_recursive.png": (recursion, 2, 3.4),
    "reproduction_zhu2018_zigzag.png": (container, 2, 3.4),
    "reproduction_zhu2018_samples.png": (samples, 3, 3.2),
    "reproduction_mei2019.png": (turns, 2, 4.2),
    "reproduction_song2020.png": (nomoto, 2, 3.2),
}


def draw(name: str, folder: Path) -> list[Path]:
    """Write the figures of a paper into a folder; returns the files."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot as plt

    written = []
    for file, _ in get_paper(name).figures:
        drawn, count, height = FIGURES[file]
        figure, axes = plt.subplots(
            1, count, figsize=(WIDTH, height), layout="constrained"
        )
        drawn(axes)
        for axis in axes:
            axis.grid(alpha=0.3)
        named = {
            label: line
            for axis in axes
            for line, label in zip(*axis.get_legend_handles_labels(), strict=True)
        }
        figure.legend(
            named.values(), named, loc="outside lower center", ncols=6, fontsize=8
        )
        figure.savefig(folder / file, dpi=DPI, metadata={"Software": None})
        plt.close(figure)
        written.append(folder / file)
    return written
