"""The promise of vector environments: bit for bit those of single ones."""

from collections.abc import Callable
from contextlib import closing
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv

from shipgym.errors import InputError

Vectors = VectorEnv[Any, Any, Any]
SEED = 1234
STAGGER = 5  # step after which a row is reset by hand
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
        singles = [make_single] * env.num_envs
        with closing(SyncVectorEnv(singles, autoreset_mode=mode)) as reference:
            for name in SPACES:
                right, given = getattr(reference, name), getattr(env, name)
                if given != right:
                    raise _differs(name, right, given)
            seeds = [SEED + row for row in range(env.num_envs)]
            for seed in (SEED + 10_000, seeds, SEED):
                answer = env.reset(seed=seed)
                _compare(answer, reference.reset(seed=seed), "reset")
            _compare_steps(env, reference, n_steps)
        _check_actions(env)


def _differs(what: str, expected: Any, given: Any) -> InputError:
    return InputError(f"vector environment: {what}: expected {expected}, got {given}")


def _compare_steps(env: Vectors, reference: SyncVectorEnv, n_steps: int) -> None:
    reference.action_space.seed(SEED)
    kept: list[tuple[Any, Any]] = []
    for step in range(1, n_steps + 1):
        action = reference.action_space.sample()
        where = f"step {step}"
        answer = env.step(action)
        expected = reference.step(action)
        _compare(answer, expected, where)
        for array, copy in kept:
            if not np.array_equal(array, copy):
                raise _differs(where, "earlier arrays as they were", "one changed")
        kept = [(array, np.copy(array)) for array in answer[:-1]]

        done = expected[2] | expected[3]
        if env.metadata["autoreset_mode"] is AutoresetMode.DISABLED:
            done[0] |= step == STAGGER
            if done.any():
                begun = env.reset(options={"reset_mask": done.copy()})
                right = reference.reset(options={"reset_mask": done.copy()})
                _compare(begun, right, "reset with a mask")


def _compare(answer: Any, expected: Any, where: str) -> None:
    """Refuse arrays other than the expected ones, and infos without masks."""
    if not isinstance(answer, tuple) or len(answer) != len(expected):
        raise _differs(where, f"a tuple of {len(expected)}", answer)
    *arrays, infos = answer
    *rights, right_infos = expected
    pairs = list(zip(ANSWER, arrays, rights, strict=False))
    if not isinstance(infos, dict):
        raise _differs(f"{where}: infos", "a dict of arrays", infos)
    if "final_obs" in right_infos:
        if not {"final_obs", "final_info"} <= infos.keys():
            expected = "'final_obs' and 'final_info' in infos, as an episode ended"
            raise _differs(where, expected, list(infos))
        ended = right_infos["_final_obs"]
        pairs.append(("infos['_final_obs']", infos["_final_obs"], ended))
        for row in np.flatnonzero(ended):
            seen, right = infos["final_obs"][row], right_infos["final_obs"][row]
            pairs.append((f"infos['final_obs'][{row}]", seen, right))
    for name, array, right in pairs:
        if not data_equivalence(array, right, exact=True):
            raise _differs(f"{where}: {name}", right, array)
    masks = [f"_{name}" for name in infos if not name.startswith("_")]
    for name in masks:
        mask = np.asarray(infos.get(name))
        if mask.shape != (len(arrays[0]),) or mask.dtype != np.bool_:
            raise _differs(f"{where}: infos['{name}']", "a mask of all rows", mask)


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
