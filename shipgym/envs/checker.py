"""Conformance check for vector environments; Gymnasium's checker takes single ones."""

from collections.abc import Callable, Mapping
from contextlib import closing
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv

from shipgym.arrays import Flags
from shipgym.errors import InputError

Vectors = VectorEnv[Any, Any, Any]
SEED = 1234
SPACES = (
    "num_envs",
    "single_observation_space",
    "single_action_space",
    "observation_space",
    "action_space",
)
ANSWER = ("observations", "rewards", "terminated", "truncated")


def check_vector_env(
    make: Callable[[], Vectors],
    make_single: Callable[[], gymnasium.Env[Any, Any]],
    n_steps: int = 200,
) -> None:
    """Check that a vector environment equals Gymnasium's own of single environments.

    The same spaces, and bit for bit the same answers under the same seeds and actions,
    in the autoreset mode named in its metadata; arrays that are not changed later;
    infos with masks; wrong actions refused.

    Raises InputError for the first requirement that is not met.

    Parameters
    ----------
    make : callable
        Makes the environment, `lambda: gymnasium.make_vec("shipgym/CourseKeeping-v0",
        num_envs=3)`.
    make_single : callable
        Makes the single environment that row i equals when it is reset with the seed
        plus i.
    n_steps : int
        Steps taken, enough for some episodes to end.
    """
    with closing(make()) as env:
        mode = env.metadata.get("autoreset_mode")
        if not isinstance(mode, AutoresetMode):
            expected = "a member of gymnasium.vector.AutoresetMode"
            raise _differs("metadata['autoreset_mode']", expected, mode)
        singles = [make_single] * max(int(env.num_envs), 1)
        with closing(SyncVectorEnv(singles, autoreset_mode=mode)) as reference:
            for name in SPACES:
                given = getattr(env, name)
                if given != getattr(reference, name):
                    raise _differs(name, getattr(reference, name), given)
            _compare_episodes(env, reference, n_steps)
        _check_actions(env)


def _differs(what: str, expected: Any, given: Any) -> InputError:
    return InputError(f"vector environment: {what}: expected {expected}, got {given}")


def _compare_episodes(env: Vectors, reference: SyncVectorEnv, n_steps: int) -> None:
    seeds = [SEED + row for row in range(env.num_envs)]
    for seed in (SEED + 10_000, seeds, SEED):
        _compare_reset(env, reference, "reset", seed=seed)

    reference.action_space.seed(SEED)
    kept: list[tuple[Any, Any]] = []
    for step in range(n_steps):
        action = reference.action_space.sample()
        where = f"step {step + 1}"
        answer = env.step(action)
        if len(answer) != len(ANSWER) + 1:
            raise _differs(where, "5 values", f"{len(answer)}")
        expected = reference.step(action)
        _compare(answer, expected, where)
        for array, copy in kept:
            if not np.array_equal(array, copy):
                raise _differs(where, "earlier arrays as they were", "one changed")
        kept = [(array, np.copy(array)) for array in answer[:-1]]

        done = expected[2] | expected[3]
        if env.metadata["autoreset_mode"] is AutoresetMode.DISABLED:
            stagger = 5  # step at which a row is reset by hand
            done[0] |= step == stagger
            if done.any():
                _compare_reset(env, reference, "reset with a mask", mask=done)


def _compare_reset(
    env: Vectors,
    reference: SyncVectorEnv,
    where: str,
    seed: Any = None,
    mask: Flags | None = None,
) -> None:
    answer = env.reset(seed=seed, options=_options(mask))
    if not isinstance(answer, tuple) or len(answer) != 2:
        raise _differs(where, "(observations, infos)", type(answer))
    _compare(answer, reference.reset(seed=seed, options=_options(mask)), where)


def _options(mask: Flags | None) -> dict[str, Any] | None:
    """Options of a reset, anew for each, because environments may change them."""
    return None if mask is None else {"reset_mask": mask.copy()}


def _compare(answer: Any, expected: Any, where: str) -> None:
    """Refuse arrays other than the expected ones, and infos without masks."""
    *arrays, infos = answer
    *expected_arrays, expected_infos = expected
    for name, array, right in zip(ANSWER, arrays, expected_arrays, strict=False):
        _compare_array(f"{where}: {name}", array, right)
    _check_infos(infos, len(arrays[0]), where)
    if "final_obs" not in expected_infos:
        return
    for name in ("final_obs", "final_info"):
        if name not in infos:
            raise _differs(where, f"{name!r} in infos, as an episode ended", "none")
        mask = expected_infos[f"_{name}"]
        _compare_array(f"{where}: infos['_{name}']", infos[f"_{name}"], mask)
    for row in np.flatnonzero(expected_infos["_final_obs"]):
        right = expected_infos["final_obs"][row]
        _compare_array(f"{where}: final_obs", infos["final_obs"][row], right)


def _compare_array(what: str, array: Any, right: Any) -> None:
    form = (getattr(array, "shape", None), getattr(array, "dtype", None))
    if form != (right.shape, right.dtype):
        raise _differs(f"{what}: shape and type", (right.shape, right.dtype), form)
    wrong = np.argwhere(array != right)
    if len(wrong):
        row = wrong[0][0]
        raise _differs(
            what, f"row {row} as the single environment's, {right[row]}", array[row]
        )


def _check_infos(infos: Any, n: int, where: str) -> None:
    if not isinstance(infos, Mapping):
        raise _differs(f"{where}: infos", "a dict of arrays", type(infos))
    for key, value in infos.items():
        if key.startswith("_"):
            continue
        mask: Any = infos.get(f"_{key}")
        is_flags = isinstance(mask, np.ndarray) and mask.dtype == np.bool_
        if not is_flags or mask.shape != (n,):
            raise _differs(f"{where}: infos['_{key}']", f"a mask of {n} booleans", mask)
        if isinstance(value, dict):
            _check_infos(value, n, f"{where}, {key}")
        elif not isinstance(value, np.ndarray) or len(value) != n:
            raise _differs(f"{where}: infos['{key}']", "an entry for each row", value)


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
        raise _differs("step", f"an error for actions {bad!r}", "none")
