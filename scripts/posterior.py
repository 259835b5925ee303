"""The posterior by sampling: coverage beside the covariance, and another sampler.

    python scripts/posterior.py coverage [--ships kcs,stable-heavy] [--structures mmg]
    python scripts/posterior.py sampler

prints the tables of docs/certainty.md. `coverage` identifies ships from the trials of
`scripts/certainty.py`, with the covariance and with the posterior, and counts how many
of her indices lie in the 95 % intervals. `sampler` compares the ensemble with the
no-U-turn sampler of blackjax (Hoffman & Gelman 2014) on the same density of a first-
and a third-order ship; for that alone `pip install jax blackjax` is needed.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[1]
for folder in (ROOT, ROOT / "scripts"):
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))

import certainty  # noqa: E402 - the folders above have to be found first

from identification import identify  # noqa: E402
from identification.judging.coarsened import CoarsenedPosterior  # noqa: E402
from identification.judging.ensemble import sample_ensemble  # noqa: E402
from identification.judging.mixing import (  # noqa: E402
    autocorrelation_times,
    mixing_of,
)
from identification.judging.posterior import table_prior  # noqa: E402
from identification.models.whole_trials import WholeTrials  # noqa: E402
from shipgym import Particulars, ShipModel, SteeringGear, Trial  # noqa: E402
from shipgym.arrays import Floats  # noqa: E402
from shipgym.manoeuvres import zigzag  # noqa: E402
from shipgym.trials.sensors import Sensors  # noqa: E402


def coverage(ships: list[str], structures: list[str], draws: int) -> None:
    """Print, by ship, structure and kind of uncertainty, what intervals hold."""
    print("| ship, structure | uncertainty | hold, % | half-width, % | s | mixing |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name in ships:
        ship = certainty.ship_of(name)
        trials = certainty.sea_trials(ship, "zigzags", seed=0)
        truth = certainty.true_indices(ship)
        for structure in structures:
            for kind in ("analytic", "posterior"):
                _print_case(name, ship, trials, truth, structure, kind, draws)


def _print_case(
    name: str,
    ship: ShipModel,
    trials: list[Trial],
    truth: certainty.Key[float],
    structure: str,
    kind: str,
    draws: int,
) -> None:
    begun = time.process_time()
    result = identify(
        trials,
        structure,
        particulars=ship.particulars,
        steering=ship.steering,
        uncertainty=kind,
    )
    seconds = time.process_time() - begun
    found = certainty.index_intervals(result.model, draws)
    common = {key: one for key, one in found.items() if key in truth}
    held = certainty.holds(common, truth)
    widths = []
    for key, one in common.items():
        if one.interval is not None and one.interval[1] is not None:
            low, high = one.interval
            widths.append(0.5 * (high - low) / truth[key])
    report = result.metrics.get("posterior")
    mixing = "-"
    if report is not None and "r_hat" in report:
        mixing = (
            f"power {report['power']:.3g}, acceptance {report['acceptance']:.2f},"
            f" {report['autocorrelation_time']:.0f} steps, R-hat"
            f" {report['r_hat']:.2f}, {report['effective_samples']:.0f} samples"
        )
        if not report["kept"]:
            mixing += ", not kept"
    hold = 100.0 * np.mean(list(held.values()))
    width = 100.0 * np.median(widths) if widths else np.nan
    print(
        f"| {name}, {structure} | {kind} | {hold:.0f} ({len(held)}) | {width:.1f} |"
        f" {seconds:.1f} | {mixing} |",
        flush=True,
    )


def small_case(structure: str) -> CoarsenedPosterior:
    """The density of a ship of 100 m with few coefficients, from three zigzags."""
    coefficients = {"c_r": -0.06, "c_d": 0.004}
    if structure == "norrbin":
        coefficients["c_r3"] = -20.0
    ship = ShipModel(
        structure,
        structure,
        Particulars(length=100.0, speed=8.0),
        SteeringGear(),
        coefficients,
    )
    sensors = Sensors(sampling_s=1.0)
    trials = []
    for seed, (angle, port) in enumerate([(10.0, False), (20.0, True), (15.0, False)]):
        run = zigzag(ship, angle, angle, port, 300.0, 0.25)
        trials.append(sensors.measure(run, seed).with_(name=f"trial {seed}"))
    model = identify(
        trials,
        structure,
        particulars=ship.particulars,
        steering=ship.steering,
    ).model
    prior = table_prior(model)
    whole = WholeTrials(replace(model, covariance=None), trials, prior)
    start = np.zeros(prior.n_parameters)
    return CoarsenedPosterior(whole, whole.scales(start), power=0.1)


def sampler(draws: int) -> None:
    """Print means and deviations by the ensemble and by the no-U-turn sampler."""
    print("| ship | sampler | mean | deviation | effective samples | s |")
    print("| --- | --- | --- | --- | --- | --- |")
    for structure in ("nomoto", "norrbin"):
        posterior = small_case(structure)
        n_parameters = posterior.trials.prior.n_parameters
        start = np.random.default_rng(0).standard_normal((128, n_parameters))
        posterior.log_density(start)  # compiles
        begun = time.process_time()
        chains = sample_ensemble(posterior.log_density, start, steps=400, warm_up=200)
        seconds = time.process_time() - begun
        samples = mixing_of(chains).effective_samples
        _print_sampler(structure, "ensemble", chains.flat, samples, seconds)

        points, samples, seconds = by_gradients(posterior, draws)
        _print_sampler(structure, "no-U-turn", points, samples, seconds)


def _print_sampler(
    structure: str, name: str, points: Floats, samples: float, seconds: float
) -> None:
    means = ", ".join(f"{value:+.3f}" for value in points.mean(axis=0))
    spreads = ", ".join(f"{value:.3f}" for value in points.std(axis=0))
    print(
        f"| {structure} | {name} | {means} | {spreads} | {samples:.0f} |"
        f" {seconds:.1f} |",
        flush=True,
    )


def by_gradients(
    posterior: CoarsenedPosterior, draws: int
) -> tuple[Floats, float, float]:
    """Points, effective samples and seconds of a chain of blackjax."""
    import blackjax
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    log_density = _in_jax(posterior, jax, jnp)
    n_parameters = posterior.trials.prior.n_parameters
    begun = time.process_time()
    warm, run = jax.random.split(jax.random.key(0))
    adaptation = blackjax.window_adaptation(blackjax.nuts, log_density)
    (state, settings), _ = adaptation.run(warm, jnp.zeros(n_parameters), 200)
    step = blackjax.nuts(log_density, **settings).step

    def one(state: Any, key: Any) -> Any:
        state, _ = step(key, state)
        return state, state.position

    _, chain = jax.lax.scan(one, state, jax.random.split(run, draws))
    points = np.asarray(chain)
    seconds = time.process_time() - begun
    times = autocorrelation_times(points[:, None])
    return points, draws / float(times.max()), seconds


def _in_jax(posterior: CoarsenedPosterior, jax: Any, jnp: Any) -> Any:
    """The same density in JAX: r' = c_r r + c_r3 r^3 + c_d delta, by Runge-Kutta."""
    whole = posterior.trials
    names = list(whole.blank.coefficients)
    mean = jnp.asarray(whole.prior.mean)
    root = jnp.asarray(whole.prior.root)
    states = whole.blank.state_names
    parts = []
    for part in whole.parts:
        times = part.inputs[:, 0]
        rudder = part.inputs[:, 1]
        first = part.start[[states.index("r"), states.index("psi")]]
        kept = np.flatnonzero(part.samples >= 0)
        parts.append((times, rudder, first, kept, part))

    def misfit(coefficients: Any) -> Any:
        c = dict(zip(names, coefficients, strict=True))

        def rates(state: Any, delta: Any) -> Any:
            r = state[0]
            cubic = c.get("c_r3", 0.0) * r**3
            return jnp.array([c["c_r"] * r + cubic + c["c_d"] * delta, r])

        total = 0.0
        for times, rudder, first, kept, part in parts:

            def advance(state: Any, step: Any) -> Any:
                h, begin, end = step
                middle = 0.5 * (begin + end)
                k1 = rates(state, begin)
                k2 = rates(state + 0.5 * h * k1, middle)
                k3 = rates(state + 0.5 * h * k2, middle)
                k4 = rates(state + h * k3, end)
                state = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
                return state, state

            steps = (np.diff(times), rudder[:-1], rudder[1:])
            _, later = jax.lax.scan(advance, jnp.asarray(first), steps)
            sailed = later[kept[1:] - 1]
            by_name = {"r": sailed[:, 0], "psi": sailed[:, 1]}
            share = part.duration / whole.blank.travel_time / (len(kept) - 1)
            for column, channel in enumerate(whole.channels):
                off = by_name[channel] - part.measured[1:, column]
                scaled = off / posterior.scales[column]
                total = total + share * jnp.sum(scaled**2)
        return total

    def log_density(point: Any) -> Any:
        coefficients = mean + root @ point
        return -0.5 * (posterior.power * misfit(coefficients) + jnp.sum(point**2))

    return log_density


def main() -> None:
    """Run the comparison that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("coverage", "sampler"))
    parser.add_argument("--ships", default="kcs,seiun-maru,stable-heavy")
    parser.add_argument("--structures", default="mmg,abkowitz,norrbin")
    parser.add_argument("--draws", type=int, default=40)
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    if asked.what == "sampler":
        sampler(max(asked.draws, 500))
        return
    coverage(asked.ships.split(","), asked.structures.split(","), asked.draws)


if __name__ == "__main__":
    main()
