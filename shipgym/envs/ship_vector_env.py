"""Many ships under a task as one of Gymnasium's vector environments."""

from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from shipgym.arrays import Flags, Floats
from shipgym.checks import check_keys, quoted, unexpected
from shipgym.envs.engine import episode_keys
from shipgym.envs.environment import (
    DEFAULT_MODEL,
    DEFAULT_TASK,
    ShipsEnv,
    given_orders,
)
from shipgym.envs.outputs import EpisodeInfo, gather_constraints, named_rows
from shipgym.envs.starts import start_lanes
from shipgym.envs.task_checker import check_once
from shipgym.errors import InputError
from shipgym.models import ShipModel
from shipgym.tasks.task import VECTOR_OPTIONS

Observation = NDArray[np.float32]
Infos = dict[str, Any]


class ShipVectorEnv(ShipsEnv, VectorEnv[Observation, Any, Floats]):
    """Many ships under a task.

    Row i is the single environment reset with `seed + i`, bit for bit.

    Raises InputError for an unknown model or keyword, or an argument out of its range.

    Parameters
    ----------
    num_envs : int
        Number of rows.
    model : str, Path or ShipModel
        A shipped model's name, the path of a model file, or a model.
    render_mode : {None, "rgb_array"}
        Whether `render` gives pictures.
    allow_unstable : bool
        Whether a model that was found unstable when it was identified may be used.
    autoreset_mode : AutoresetMode or str
        When the next episode of a row begins.
    max_episode_steps : int, optional
        Steps after which an episode is cut off, as by `gymnasium.make`.
    action_repeat, rate_limit, frame_stack, constraint_cost, **options
        As for the single environment.
    """

    def __init__(
        self,
        num_envs: int = 1,
        model: str | Path | ShipModel = DEFAULT_MODEL,
        task: Any = DEFAULT_TASK,
        render_mode: str | None = None,
        allow_unstable: bool = False,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        action_repeat: int = 1,
        rate_limit: float | None = None,
        frame_stack: int = 1,
        constraint_cost: bool = False,
        **options: Any,
    ) -> None:
        arguments = locals()
        mode = _mode(autoreset_mode)
        observation_space, action_space = self._make(arguments, VECTOR_OPTIONS)
        check_once(self._engine, self.randomisation)
        self.num_envs = int(num_envs)
        self.metadata = {
            "render_modes": ["rgb_array"],
            "render_fps": 30,
            "autoreset_mode": mode,
        }
        self.single_observation_space = observation_space
        self.single_action_space = action_space
        self.observation_space = batch_space(observation_space, self.num_envs)
        self.action_space = batch_space(action_space, self.num_envs)

        self.autoreset_mode = mode  # read by TorchRL
        self._names = self.task.info_names
        self._flags = self._engine.flag_names
        self._masks: dict[str, Flags] = {}  # of steps, where every row has its infos
        self._own_reward = not self.task.definition.shipped
        self._some_over = False  # NEXT_STEP: whether episodes ended in the last step
        self._keeps_ends = mode is AutoresetMode.DISABLED
        self._over = np.zeros(self.num_envs, dtype=np.bool_)  # then, rows to reset
        self._made()

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observation, Infos]:
        """Begin an episode in each row.

        Raises InputError for other options, or seeds of another number than rows.

        Parameters
        ----------
        seed : int or sequence of int or None, optional
            Row i has the seed `seed + i`, or number i of the sequence. Without one the
            next episodes begin.
        options : dict, optional
            `reset_mask`, bool array of shape (num_envs,): rows in which an episode is
            to begin, the others go on. `start` as in the single environment; its
            numbers may be arrays of shape (num_envs,).

        Returns
        -------
        observations : float32 array of shape (num_envs, n_observations)
        infos : dict
            Arrays of shape (num_envs,) with their masks.
        """
        super().reset(seed=seed if isinstance(seed, int) else None)
        mask = self._mask(options)
        episodes = self._engine.episodes + np.uint64(1)
        engine = self._engine
        self._keys, episodes = self._next_episodes(seed, mask, episodes)
        shown_before = engine.outputs
        engine.renew_outputs()
        engine.outputs.take(shown_before)  # of rows that go on
        self._begun = False  # until the starts are known to be some
        self._over = self._over & ~mask
        engine.begin(self._keys, episodes, mask)
        if options and options.get("start"):
            start_lanes(engine, options["start"], mask)
        self._begun = True
        self._draw(mask)
        infos = self._infos(mask.copy())
        return self._shown(mask), infos

    def _next_episodes(
        self,
        seed: int | Sequence[int | None] | None,
        mask: Flags,
        numbers: NDArray[np.uint64],
    ) -> tuple[NDArray[np.uint64], NDArray[np.uint64]]:
        """Keys and numbers of the next episodes, `numbers` where no key changes."""
        keys = self._keys
        if keys is None:
            keys = self._drawn_keys()
            numbers[:] = 0
        seeds = self._seeds(seed)
        for row in np.flatnonzero(mask).tolist():
            row_seed = seeds[row]
            if row_seed is not None:
                keys[row] = episode_keys(row_seed)
                numbers[row] = 0
        return keys, numbers

    def _infos(self, mask: Flags, outcomes: Any = None, flags: Any = None) -> Infos:
        """Rows of the last step's arrays by name, with their masks."""
        outputs = self._engine.outputs
        if outcomes is None:
            outcomes, flags = outputs.outcomes, outputs.flags
        infos = named_rows(outcomes, flags, self._names, self._flags)
        if self._constraints:
            gather_constraints(infos, self._constraints, self._constraint_cost)
            masks = {f"_{name}": mask for name in self._constraints}
            infos["constraints"] |= masks
        if mask is self._engine.all_lanes:
            if not self._masks:
                self._masks = {f"_{name}": mask for name in infos}
            return infos | self._masks
        return infos | {f"_{name}": mask for name in infos}

    def _note_ends(self, infos: Infos, ended: Flags) -> EpisodeInfo:
        """Add the cost of episodes that ended, and whether they were a success."""
        outputs = self._engine.outputs
        costs = self._engine.read("episode_cost")
        success = infos.get("success", outputs.truncated)
        more = {
            "episode_cost": np.where(ended, costs, 0.0),
            "is_success": success & ended,
        }
        return EpisodeInfo({**infos, **more, **{f"_{name}": ended for name in more}})

    def _mask(self, options: dict[str, Any] | None) -> Flags:
        """Rows in which an episode is to begin; InputError for another mask."""
        options = options or {}
        check_keys(options, ["reset_mask", "start"], "options")
        mask: Any = options.get("reset_mask", self._engine.all_lanes)
        is_flags = isinstance(mask, np.ndarray) and mask.dtype == np.bool_
        shape = (self.num_envs,)
        if not is_flags or mask.shape != shape:
            expected = f"a bool array of {self.num_envs}"
            raise unexpected("options: reset_mask", expected, mask)
        if not mask.any():
            raise InputError(
                "options: reset_mask: expected True in one row at least, got none"
            )
        return np.asarray(mask)

    def _seeds(self, seed: int | Sequence[int | None] | None) -> Sequence[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int | np.integer):
            return [int(seed) + row for row in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise InputError(
                f"seed: expected one for each of {self.num_envs} rows, got {len(seed)}"
            )
        return seed

    def step(self, actions: Any) -> tuple[Observation, Floats, Flags, Flags, Infos]:  # type: ignore[override]
        """Take one control interval in all rows.

        Raises InputError if an action is not a number or their shape is another, a
        reward of your own is not finite, no episode has begun, or, without autoreset,
        some are over.

        Parameters
        ----------
        actions : array of shape (num_envs, n_commands)
            See the single environment; rudder orders are an int array of shape
            (num_envs,).

        Returns
        -------
        observations : float32 array of shape (num_envs, n_observations)
        rewards : array of shape (num_envs,)
        terminated, truncated : bool arrays of shape (num_envs,)
        infos : dict
            Arrays of shape (num_envs,) with their masks; `final_obs` and `final_info`
            of episodes that ended where the next one begins in the same step;
            `episode_cost` and `is_success` with the last info.
        """
        if not self._begun:
            self._refuse_step()
        if self._keeps_ends and self._over.any():
            self._refuse_over()
        if len(self._orders):
            actions = given_orders(self._orders, actions, self.action_space, "actions")
        engine = self._engine
        engine.order(actions)
        paced = engine if self._paced is None else self._paced
        n_ended = paced.advance(self._some_over, anew=True)
        outputs = engine.outputs
        rewards = outputs.outcomes[0]
        if self._own_reward and not isfinite(rewards.sum()):
            engine.refuse_rewards()

        observations = self._shown()
        infos = self._infos(engine.all_lanes)
        self._some_over = n_ended > 0 and not self._keeps_ends
        if n_ended:
            ended = outputs.terminated | outputs.truncated
            if self.autoreset_mode is AutoresetMode.SAME_STEP:
                self._some_over = False
                infos = EpisodeInfo({**infos, **self._final(observations, ended)})
                engine.begin_next(ended)
                observations = self._shown(ended)
            else:
                infos = self._note_ends(infos, ended)
                self._over = ended & self._keeps_ends
        self._draw()
        return (
            observations,
            rewards,
            outputs.terminated,
            outputs.truncated,
            infos,
        )

    def _refuse_over(self) -> NoReturn:
        """Raise the InputError of rows that nobody has reset."""
        rows = np.flatnonzero(self._over).tolist()
        raise InputError(
            f"step: expected episodes that go on, got ends in rows {rows}:"
            " reset them (options: reset_mask), or choose another autoreset_mode"
        )

    def _final(self, observations: Observation, ended: Flags) -> Infos:
        """Last observations and infos of episodes that ended."""
        outputs = self._engine.outputs
        final_obs = np.full(self.num_envs, None, dtype=object)
        for row in np.flatnonzero(ended).tolist():
            final_obs[row] = observations[row].copy()

        # zero in the rows that go on, as in Gymnasium's vector environments
        outcomes = np.where(ended, outputs.outcomes, 0.0)
        flags = outputs.flags & ended
        final_info = self._infos(ended, outcomes, flags)
        return {
            "final_obs": final_obs,
            "_final_obs": ended,
            "final_info": self._note_ends(final_info, ended),
            "_final_info": ended,
        }

    def write(self, name: str, values: Any) -> None:
        """Write one number of the state in all rows (see `Engine.write`)."""
        self._engine.write(name, values)

    def physical_state(self) -> dict[str, Floats]:
        """State, set-point and weather by name, SI units, each of shape (num_envs,)."""
        return self._engine.physical_state()

    def waypoints(self, row: int = 0) -> Floats | None:
        """North and east of the path of a row's episode, m, shape (n, 2).

        None in course keeping.
        """
        return self._engine.waypoints(row)

    def render(self) -> tuple[Any, ...] | None:
        """Picture of each row, uint8 arrays of shape (600, 600, 3).

        None without a render mode, with a warning.
        """
        self._warn_of_no_mode()
        if self.render_mode is None:
            return None
        return tuple(artist.picture(self._engine) for artist in self._artists)

    def close_extras(self, **kwargs: Any) -> None:
        """Close all windows; a further step needs a `reset`."""
        self._begun = False


def _mode(given: AutoresetMode | str) -> AutoresetMode:
    try:
        return AutoresetMode(given)
    except ValueError:
        modes = quoted(mode.value for mode in AutoresetMode)
        raise unexpected("autoreset_mode", f"one of {modes}", given) from None
