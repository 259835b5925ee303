"""A conformance suite for vector environments, which Gymnasium's own checker refuses."""

from collections.abc import Callable
from contextlib import closing
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from numpy.typing import NDArray

from shipgym.errors import InputError

Make = Callable[[], VectorEnv[Any, Any, Any]]
MakeSingle = Callable[[], gymnasium.Env[Any, Any]]
Episode = list[tuple[Any, Any, Any, Any]]
SEED = 1234
STEPS = 200
STAGGER = 5  # step at which a row is begun anew by hand


def check_vector_env(
    make: Make, make_single: MakeSingle | None = None, n_steps: int = STEPS
) -> None:
    """Check that a vector environment meets the requirements of Gymnasium's interface.

    Spaces and shapes, seeds that hold, arrays that are not changed later, the autoreset
    that its metadata name, wrong actions, and, given single environments, that each row
    is one of them, bit for bit.

    Raises InputError naming the first requirement that is not met, what was found and
    what is expected.

    Parameters
    ----------
    make : callable
        Makes the environment, `lambda: gymnasium.make_vec("shipgym/CourseKeeping-v0",
        num_envs=3)`; several environments are made and closed.
    make_single : callable, optional
        Makes the single environment that row i equals when it is reset with the seed
        plus i.
    n_steps : int
        Steps taken in each check; let them be enough for some episodes to end.
    """
    for check in (
        _check_spaces,
        _check_reset,
        _check_steps,
        _check_seeds,
        _check_actions,
        _check_autoreset,
    ):
        with closing(make()) as env:
            check(env, n_steps)
    if make_single is not None:
        _check_rows(make, make_single, n_steps)


def _expect(condition: bool, promise: str) -> None:
    if not condition:
        raise InputError(f"vector environment: {promise}")


def autoreset_mode(env: VectorEnv[Any, Any, Any]) -> AutoresetMode:
    """How an environment says that it begins the next episode; InputError where it does not say."""
    mode = env.metadata.get("autoreset_mode")
    if not isinstance(mode, AutoresetMode):
        raise InputError(
            f"vector environment: metadata['autoreset_mode'] is {mode!r}, expected a"
            " member of gymnasium.vector.AutoresetMode"
        )
    return mode


def _check_spaces(env: VectorEnv[Any, Any, Any], n_steps: int) -> None:
    autoreset_mode(env)
    n = env.num_envs
    _expect(isinstance(n, int) and n >= 1, f"num_envs is {n!r}, expected >= 1")
    for which in ("observation", "action"):
        single, batch = (
            getattr(env, f"single_{which}_space"),
            getattr(env, f"{which}_space"),
        )
        expected = gymnasium.vector.utils.batch_space(single, env.num_envs)
        what = (
            f"{which}_space is {batch}, expected {expected}: single_{which}_space"
            " batched"
        )
        _expect(batch == expected, what)


def _check_reset(env: VectorEnv[Any, Any, Any], n_steps: int) -> None:
    answer = env.reset(seed=SEED)
    pair = isinstance(answer, tuple) and len(answer) == 2
    _expect(pair, f"reset returned {type(answer)}, expected (observations, infos)")
    observations, infos = answer
    _check_observations(env, observations, "reset")
    _check_infos(env, infos, "reset")


def _check_steps(env: VectorEnv[Any, Any, Any], n_steps: int) -> None:
    env.action_space.seed(SEED)
    env.reset(seed=SEED)
    kept: list[tuple[Any, Any]] = []
    for _ in range(min(n_steps, 20)):
        answer = env.step(env.action_space.sample())
        _expect(len(answer) == 5, f"step returned {len(answer)} values, expected 5")
        observations, rewards, terminated, truncated, infos = answer
        _check_observations(env, observations, "step")
        for name, array in {
            "rewards": rewards,
            "terminated": terminated,
            "truncated": truncated,
        }.items():
            kind = np.floating if name == "rewards" else np.bool_
            found = (getattr(array, "shape", None), getattr(array, "dtype", None))
            right = found[0] == (env.num_envs,) and np.issubdtype(found[1], kind)
            _expect(
                right,
                f"step: {name} of shape and type {found}, expected ({env.num_envs},)"
                f" {kind}",
            )
        _expect(
            bool(np.all(np.isfinite(rewards))),
            f"step: rewards {rewards} are not all finite",
        )
        _check_infos(env, infos, "step")
        for before, copy in kept:
            _expect(
                np.array_equal(before, copy),
                "step changed an array that an earlier step had returned",
            )
        kept = [
            (array, np.copy(array))
            for array in (observations, rewards, terminated, truncated)
        ]


def _check_observations(
    env: VectorEnv[Any, Any, Any], observations: Any, where: str
) -> None:
    space = env.observation_space
    _expect(
        observations in space,
        f"{where}: observations {observations} are not in {space}",
    )


def _check_infos(env: VectorEnv[Any, Any, Any], infos: Any, where: str) -> None:
    _expect(
        isinstance(infos, dict),
        f"{where}: infos are {type(infos)}, expected a dict of arrays",
    )
    for key, value in infos.items():
        if key.startswith("_"):
            continue
        mask = infos.get(f"_{key}")
        right = (
            isinstance(mask, np.ndarray)
            and mask.shape == (env.num_envs,)
            and mask.dtype == np.bool_
        )
        expected = f"expected a mask of {env.num_envs} truth values"
        _expect(right, f"{where}: infos['_{key}'] is {mask!r}, {expected}")
        if isinstance(value, dict):
            _check_infos(env, value, f"{where}, {key}")
        else:
            rows = isinstance(value, np.ndarray) and len(value) == env.num_envs
            _expect(
                rows,
                f"{where}: infos['{key}'] is {value!r}, expected an entry for each row",
            )


def _check_seeds(env: VectorEnv[Any, Any, Any], n_steps: int) -> None:
    seeds = (SEED, SEED, [SEED + i for i in range(env.num_envs)], SEED + 10_000)
    first, again, of_list, other = (_rollout(env, seed, n_steps) for seed in seeds)
    _expect(
        _same(first, again),
        "reset with the same seed and the same actions gave another episode",
    )
    _expect(
        _same(first, of_list),
        "reset(seed=s) gave another episode than reset(seed=[s, s + 1, ...])",
    )
    _expect(
        not _same(first[:1], other[:1]),
        "reset with another seed gave the same first observations",
    )


def _rollout(env: VectorEnv[Any, Any, Any], seed: Any, n_steps: int) -> Episode:
    env.action_space.seed(SEED)
    observations, _ = env.reset(seed=seed)
    nothing = np.zeros(env.num_envs)
    course: Episode = [(observations, nothing, nothing, nothing)]
    for _ in range(n_steps):
        *outcome, _ = env.step(env.action_space.sample())
        course.append(tuple(outcome))
        if autoreset_mode(env) is AutoresetMode.DISABLED and np.any(
            outcome[2] | outcome[3]
        ):
            break
    return course


def _same(one: Episode, other: Episode) -> bool:
    steps = zip(one, other, strict=True)
    return all(
        np.array_equal(a, b)
        for left, right in steps
        for a, b in zip(left, right, strict=True)
    )


def _check_actions(env: VectorEnv[Any, Any, Any], n_steps: int) -> None:
    env.reset(seed=SEED)
    actions = env.action_space.sample()
    wrong = [np.concatenate([actions, actions])]
    if np.issubdtype(actions.dtype, np.floating):
        wrong.append(np.full_like(actions, np.nan))
    for bad in wrong:
        try:
            env.step(bad)
        except (ValueError, AssertionError, IndexError):
            continue
        raise InputError(
            f"vector environment: step took actions {bad!r}, expected an error"
        )


def _check_autoreset(env: VectorEnv[Any, Any, Any], n_steps: int) -> None:
    mode = autoreset_mode(env)
    env.action_space.seed(SEED)
    env.reset(seed=SEED)
    ended = np.zeros(env.num_envs, dtype=np.bool_)
    first_row = np.arange(env.num_envs) == 0
    for step in range(n_steps):
        observations, rewards, terminated, truncated, infos = env.step(
            env.action_space.sample()
        )
        done = terminated | truncated
        if (
            mode is AutoresetMode.DISABLED and step == STAGGER
        ):  # so that episodes do not all end together
            done = done | first_row
        if mode is AutoresetMode.NEXT_STEP:
            _expect(
                not np.any(done & ended),
                "an episode ended in the step that had begun it",
            )
            _expect(
                not np.any(rewards[ended]),
                "the step that begins an episode earned something, expected 0",
            )
        elif mode is AutoresetMode.SAME_STEP and np.any(done):
            _check_final(env, infos, done)
        elif mode is AutoresetMode.DISABLED and np.any(done):
            observations = _check_partial_reset(env, observations, done)
        ended = done


def _check_final(
    env: VectorEnv[Any, Any, Any], infos: dict[str, Any], done: NDArray[np.bool_]
) -> None:
    for key in ("final_obs", "final_info"):
        _expect(key in infos, f"an episode ended and infos have no '{key}'")
        mask = infos.get(f"_{key}", np.zeros(0))
        _expect(
            np.array_equal(mask, done),
            f"infos['_{key}'] is {mask}, expected {done}: the ended rows",
        )
    for i in np.flatnonzero(done):
        final = infos["final_obs"][i]
        seen = final in env.single_observation_space
        _expect(seen, f"infos['final_obs'][{i}] is {final}, not an observation")


def _check_partial_reset(
    env: VectorEnv[Any, Any, Any], before: Any, done: NDArray[np.bool_]
) -> Any:
    kept = np.copy(before)
    after, _ = env.reset(options={"reset_mask": done.copy()})
    _check_observations(env, after, "reset with a mask")
    _expect(
        np.array_equal(after[~done], kept[~done]),
        "reset with a mask changed rows outside of it",
    )
    _expect(
        not np.array_equal(after[done], kept[done]),
        "reset with a mask left a row within it as it was",
    )
    return after


def _check_rows(make: Make, make_single: MakeSingle, n_steps: int) -> None:
    with closing(make()) as env:
        singles = [make_single] * env.num_envs
        with closing(
            SyncVectorEnv(singles, autoreset_mode=autoreset_mode(env))
        ) as reference:
            steps = zip(
                _rollout(env, SEED, n_steps),
                _rollout(reference, SEED, n_steps),
                strict=False,
            )
    for found, expected in (
        (one[i], other[i]) for one, other in steps for i in range(len(one))
    ):
        for row, (shown, due) in enumerate(zip(found, expected, strict=True)):
            alone = f"expected {due} of the single environment with seed {SEED + row}"
            _expect(
                bool(np.array_equal(shown, due)), f"row {row} shows {shown}, {alone}"
            )
