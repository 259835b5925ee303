"""Conformance suite for vector environments; Gymnasium's checker takes single ones."""

from collections.abc import Callable
from contextlib import closing
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv

from shipgym.arrays import Flags
from shipgym.errors import InputError

Vectors = VectorEnv[Any, Any, Any]
Make = Callable[[], Vectors]
Space = gymnasium.Space[Any]
MakeSingle = Callable[[], gymnasium.Env[Any, Any]]
Episode = list[tuple[Any, Any, Any, Any]]
SEED = 1234
STEPS = 200


def check_vector_env(
    make: Make,
    make_single: MakeSingle | None = None,
    n_steps: int = STEPS,
) -> None:
    """Check that a vector environment meets the requirements of Gymnasium's interface.

    Spaces and shapes, reproducible seeds, arrays that are not changed later, the
    autoreset named in its metadata, wrong actions, and, given single environments, that
    each row equals one of them, bit for bit.

    Raises InputError for the first requirement that is not met.

    Parameters
    ----------
    make : callable
        Makes the environment, `lambda: gymnasium.make_vec("shipgym/CourseKeeping-v0",
        num_envs=3)`; several environments are made and closed.
    make_single : callable, optional
        Makes the single environment that row i equals when it is reset with the seed
        plus i.
    n_steps : int
        Steps taken in each check, enough for some episodes to end.
    """
    with closing(make()) as env:
        _check_spaces(env)
        _check_steps(env)
        _check_seeds(env, n_steps)
        _check_actions(env)
        _check_autoreset(env, n_steps)
    if make_single is not None:
        _check_rows(make, make_single, n_steps)


def _expect(condition: bool, promise: str) -> None:
    if not condition:
        raise InputError(f"vector environment: {promise}")


def autoreset_mode(env: Vectors) -> AutoresetMode:
    """Autoreset mode that an environment's metadata name; InputError without one."""
    mode = env.metadata.get("autoreset_mode")
    if not isinstance(mode, AutoresetMode):
        raise InputError(
            "vector environment: metadata['autoreset_mode']: expected a member of"
            f" gymnasium.vector.AutoresetMode, got {mode!r}"
        )
    return mode


def _check_spaces(env: Vectors) -> None:
    autoreset_mode(env)
    n = env.num_envs
    _expect(isinstance(n, int) and n >= 1, f"num_envs: expected >= 1, got {n!r}")
    for which in ("observation", "action"):
        single: Space = getattr(env, f"single_{which}_space")
        batch: Space = getattr(env, f"{which}_space")
        expected = gymnasium.vector.utils.batch_space(single, n)
        _expect(
            batch == expected,
            f"{which}_space: expected {expected}, that is single_{which}_space batched,"
            f" got {batch}",
        )


def _check_steps(env: Vectors) -> None:
    answer = env.reset(seed=SEED)
    _expect(
        isinstance(answer, tuple) and len(answer) == 2,
        f"reset: expected (observations, infos), got {type(answer)}",
    )
    _check_observations(env, answer[0], "reset")
    _check_infos(env, answer[1], "reset")
    env.action_space.seed(SEED)
    kept: list[tuple[Any, Any]] = []
    for _ in range(20):
        step = env.step(env.action_space.sample())
        _expect(len(step) == 5, f"step: expected 5 values, got {len(step)}")
        observations, rewards, terminated, truncated, infos = step
        _check_observations(env, observations, "step")
        _check_array("rewards", rewards, np.floating, env.num_envs)
        _check_array("terminated", terminated, np.bool_, env.num_envs)
        _check_array("truncated", truncated, np.bool_, env.num_envs)
        _expect(
            bool(np.all(np.isfinite(rewards))),
            f"step: rewards: expected finite numbers, got {rewards}",
        )
        _check_infos(env, infos, "step")
        for before, copy in kept:
            _expect(
                np.array_equal(before, copy),
                "step changed an array that an earlier step had returned",
            )
        arrays = (observations, rewards, terminated, truncated)
        kept = [(array, np.copy(array)) for array in arrays]
        if np.any(terminated | truncated):
            break


def _check_array(name: str, array: Any, kind: Any, n: int) -> None:
    shape = getattr(array, "shape", None)
    dtype = getattr(array, "dtype", None)
    _expect(
        shape == (n,) and np.issubdtype(dtype, kind),
        f"step: {name}: expected shape and type ({n},) {kind}, got {(shape, dtype)}",
    )


def _check_observations(
    env: Vectors,
    observations: Any,
    where: str,
) -> None:
    space = env.observation_space
    _expect(
        observations in space,
        f"{where}: observations: expected a member of {space}, got {observations}",
    )


def _check_infos(env: Vectors, infos: Any, where: str) -> None:
    _expect(
        isinstance(infos, dict),
        f"{where}: infos: expected a dict of arrays, got {type(infos)}",
    )
    for key, value in infos.items():
        if key.startswith("_"):
            continue
        mask = infos.get(f"_{key}")
        is_flags = isinstance(mask, np.ndarray) and mask.dtype == np.bool_
        _expect(
            is_flags and mask.shape == (env.num_envs,),
            f"{where}: infos['_{key}']: expected a mask of {env.num_envs} booleans, got"
            f" {mask!r}",
        )
        if isinstance(value, dict):
            _check_infos(env, value, f"{where}, {key}")
        else:
            _expect(
                isinstance(value, np.ndarray) and len(value) == env.num_envs,
                f"{where}: infos['{key}']: expected an entry for each row, got"
                f" {value!r}",
            )


def _check_seeds(env: Vectors, n_steps: int) -> None:
    by_row = [SEED + row for row in range(env.num_envs)]
    first = _rollout(env, SEED, n_steps)
    _expect(
        _same(first, _rollout(env, SEED, n_steps)),
        "reset with the same seed and the same actions gave another episode",
    )
    _expect(
        _same(first, _rollout(env, by_row, n_steps)),
        "reset(seed=s) gave another episode than reset(seed=[s, s + 1, ...])",
    )
    other = _rollout(env, SEED + 10_000, n_steps)
    _expect(
        not _same(first[:1], other[:1]),
        "reset with another seed gave the same first observations",
    )


def _rollout(env: Vectors, seed: Any, n_steps: int) -> Episode:
    goes_on = autoreset_mode(env) is not AutoresetMode.DISABLED
    env.action_space.seed(SEED)
    observations, _ = env.reset(seed=seed)
    nothing = np.zeros(env.num_envs)
    episode: Episode = [(observations, nothing, nothing, nothing)]
    for _ in range(n_steps):
        action = env.action_space.sample()
        observations, rewards, terminated, truncated, _ = env.step(action)
        episode.append((observations, rewards, terminated, truncated))
        if not goes_on and np.any(terminated | truncated):
            break
    return episode


def _same(one: Episode, other: Episode) -> bool:
    return all(
        np.array_equal(array, other_array)
        for step, other_step in zip(one, other, strict=True)
        for array, other_array in zip(step, other_step, strict=True)
    )


def _check_actions(env: Vectors) -> None:
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
            f"vector environment: step: expected an error for actions {bad!r}, got none"
        )


def _check_autoreset(env: Vectors, n_steps: int) -> None:
    mode = autoreset_mode(env)
    env.action_space.seed(SEED)
    env.reset(seed=SEED)
    ended = np.zeros(env.num_envs, dtype=np.bool_)
    stagger = 5  # step at which a row is reset by hand
    for step in range(n_steps):
        action = env.action_space.sample()
        observations, rewards, terminated, truncated, infos = env.step(action)
        done = terminated | truncated
        if mode is AutoresetMode.NEXT_STEP:
            _expect(
                not np.any(done & ended),
                "an episode ended in the step that had begun it",
            )
            _expect(
                not np.any(rewards[ended]),
                "rewards: expected 0 in the step that begins an episode, got another",
            )
        elif mode is AutoresetMode.SAME_STEP:
            if np.any(done):
                _check_final(env, infos, done)
        else:
            if step == stagger:  # so that episodes do not all end together
                done = done.copy()
                done[0] = True
            if np.any(done):
                _check_partial_reset(env, observations, done)
        ended = done


def _check_final(
    env: Vectors,
    infos: dict[str, Any],
    done: Flags,
) -> None:
    for key in ("final_obs", "final_info"):
        _expect(key in infos, f"an episode ended and infos have no '{key}'")
        mask = infos.get(f"_{key}", np.zeros(0))
        _expect(
            np.array_equal(mask, done),
            f"infos['_{key}']: expected the ended rows {done}, got {mask}",
        )
    for row in np.flatnonzero(done):
        final = infos["final_obs"][row]
        _expect(
            final in env.single_observation_space,
            f"infos['final_obs'][{row}]: expected an observation, got {final}",
        )


def _check_partial_reset(
    env: Vectors,
    before: Any,
    done: Flags,
) -> None:
    kept = np.copy(before)
    seen, _ = env.reset(options={"reset_mask": done.copy()})
    _check_observations(env, seen, "reset with a mask")
    after = seen
    _expect(
        np.array_equal(after[~done], kept[~done]),
        "reset with a mask changed rows outside of it",
    )
    _expect(
        not np.array_equal(after[done], kept[done]),
        "reset with a mask left a row within it as it was",
    )


def _check_rows(make: Make, make_single: MakeSingle, n_steps: int) -> None:
    with closing(make()) as env:
        mode = autoreset_mode(env)
        episode = _rollout(env, SEED, n_steps)
        singles = [make_single] * env.num_envs
        with closing(SyncVectorEnv(singles, autoreset_mode=mode)) as reference:
            expected_episode = _rollout(reference, SEED, n_steps)

    for step, expected_step in zip(episode, expected_episode, strict=False):
        for array, expected_array in zip(step, expected_step, strict=True):
            for row, expected in enumerate(expected_array):
                found = array[row]
                _expect(
                    bool(np.array_equal(found, expected)),
                    f"row {row}: expected {expected} of the single environment with"
                    f" seed {SEED + row}, got {found}",
                )
