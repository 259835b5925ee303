"""Base of environments of one ship and of many: options, copies, states, resets."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from enum import Enum
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec
from numpy.typing import NDArray

from shipgym.arrays import Flags
from shipgym.checks import (
    check_choice,
    check_flag,
    check_whole,
    unexpected,
)
from shipgym.envs.engine import Engine, as_array, episode_key
from shipgym.envs.pace import Frames, Pace, PacedSteps
from shipgym.envs.randomisation import Randomisation
from shipgym.errors import InputError
from shipgym.models import ShipModel, load_model
from shipgym.tasks.task import Task

if TYPE_CHECKING:
    from shipgym.envs.rendering import Artist

Space = gymnasium.spaces.Box | gymnasium.spaces.Discrete
DEFAULT_MODEL = "mariner-tls-svm"
DEFAULT_TASK = "CourseKeeping"
LONGEST = "max_episode_steps"  # keyword of vector environments
#: Attributes that a copy has besides its arguments and the state of its engine.
KEPT = ("_keys", "_frames", "_over", "_some_over")
PACE = ("action_repeat", "rate_limit", "frame_stack")  # keywords that make a `Pace`


def read_options(
    task: Any,
    model: str | Path | ShipModel | Mapping[str, Any],
    options: Mapping[str, Any],
    taken: Sequence[str] = (),
) -> tuple[ShipModel, Task, Randomisation]:
    """Read ship, task and randomisation from an environment's keywords.

    `taken`: further keywords of its caller, for messages. Raises InputError for an
    unknown model or keyword, or a value out of its range.
    """
    randomisation, own = Randomisation.take_from(options)
    known = (*taken, *Randomisation.names())
    chosen = Task.of(task, known, **own)
    return load_model(model), chosen, randomisation


def spaces(task: Task, model: ShipModel, frame_stack: int = 1) -> tuple[Any, Space]:
    """Observation and action space of a task for a ship."""
    observed = task.observed(model)
    low = np.array([quantity.low for quantity in observed], dtype=np.float32)
    high = np.array([quantity.high for quantity in observed], dtype=np.float32)
    if frame_stack > 1:
        low = np.tile(low, (frame_stack, 1))
        high = np.tile(high, (frame_stack, 1))
    observations = gymnasium.spaces.Box(low, high, dtype=np.float32)
    if task.orders:
        return observations, gymnasium.spaces.Discrete(len(task.orders))
    shape = (task.n_commands,)
    return observations, gymnasium.spaces.Box(-1.0, 1.0, shape, dtype=np.float32)


def given_orders(
    orders: NDArray[np.float32],
    numbers: Any,
    space: gymnasium.Space[Any],
    where: str,
) -> NDArray[np.float32]:
    """Rudder orders by their numbers, shape (n, 1).

    InputError for numbers that are not in the action space.
    """
    array = as_array(numbers)
    if array not in space:
        raise unexpected(where, f"a member of {space}: rudder orders", numbers)
    ordered: NDArray[np.float32] = orders[array.reshape(-1, 1)]
    return ordered


class ShipSpec(EnvSpec):
    """Registration of an environment of shipgym."""

    def to_json(self) -> str:
        """Return the registration as JSON, with models and seas by their content.

        Raises InputError for a keyword that JSON cannot hold.
        """
        kwargs = json.loads(json.dumps(self.kwargs, default=_content))
        return EnvSpec.to_json(replace(self, kwargs=kwargs))


def _content(value: Any) -> Any:
    """Content of a keyword that is an object; InputError if JSON cannot hold it."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Enum):
        return value.value
    if not hasattr(value, "to_dict"):
        expected = "keywords that JSON can hold, models and weather"
        raise unexpected("spec", expected, value, "give its name or path")
    return value.to_dict()


class ShipsEnv:
    """An environment on an engine.

    `copy.deepcopy` and `pickle` rebuild an environment from its arguments, state and
    attributes: compiled code is not copied.

    Attributes
    ----------
    model : ShipModel
    task : Task
    pace : Pace
        Its keywords `action_repeat`, `rate_limit` and `frame_stack`.
    observation_names : tuple of str
    observation_scales : array of shape (n_observations,)
        Physical value of an observation of 1, SI units.
    render_mode : str or None
    """

    render_mode: str | None
    np_random: np.random.Generator
    _spec: EnvSpec | None = None

    def _make(
        self,
        arguments: dict[str, Any],
        taken: Sequence[str],
    ) -> tuple[Any, Space]:
        """Read the arguments of the environment; return the spaces of one ship."""
        options = arguments.pop("options")
        given = dict(arguments)
        for name in ("self", "__class__"):
            given.pop(name, None)
        self._arguments = given | options
        mode = given["render_mode"]
        if mode is not None:
            check_choice(mode, ["rgb_array"], "render_mode", also=", or None")
        self.render_mode = mode
        self.model, self.task, self.randomisation = read_options(
            given["task"], given["model"], options, taken
        )
        self.pace = Pace(*(given[name] for name in PACE))
        self._constraints = self.task.constraints
        self._constraint_cost = check_flag(given["constraint_cost"], "constraint_cost")
        if self._constraint_cost and not self._constraints:
            raise InputError(
                "constraint_cost: expected a task with constraints, got"
                f" {self.task.name!r}, which has none as it is asked; a ship that rolls"
                " has one with roll=True"
            )
        num_envs = given.get("num_envs", 1)
        longest = given.get(LONGEST)
        if longest in (None, -1):  # -1: Gymnasium's word for none
            longest = np.inf
        else:
            check_whole(longest, LONGEST, at_least=1)
        engine = Engine(
            self.model,
            num_envs,
            self.task,
            self.randomisation,
            allow_unstable=given["allow_unstable"],
            cut_off=longest * self.pace.action_repeat,
        )
        self._artists: list[Artist] = []
        if mode is not None:
            from shipgym.envs.rendering import Artist  # needed only for pictures

            self._artists = [Artist(row) for row in range(num_envs)]
        self._observe_and_order(num_envs)
        self._begun = False  # and not closed since
        self._keys: NDArray[np.uint64] | None = None  # of each row's episodes
        self._use(engine)
        return spaces(self.task, self.model, self.pace.frame_stack)

    def _observe_and_order(self, num_envs: int) -> None:
        """Prepare what agents see and what discrete actions order."""
        observed = self.task.observed(self.model)
        self.observation_names = tuple(quantity.name for quantity in observed)
        self.observation_scales = np.array([quantity.scale for quantity in observed])
        self._frames: Frames | None = None
        depth = self.pace.frame_stack
        if depth > 1:
            self._frames = Frames(num_envs, depth, len(observed))
        self._orders = np.array(self.task.orders, dtype=np.float32)
        self.pace.check_reaches(self._orders)

    @property
    def corridor(self) -> float | None:
        """Half the width of the corridor along the path, m; None in course keeping."""
        return self._engine.path_metres("corridor")

    @property
    def turn_radius(self) -> float | None:
        """Radius of the turns of the path, m; None where it has none."""
        return self._engine.path_metres("turn_radius")

    def _made(self) -> None:
        """End the construction: attributes that are added later are the user's."""
        self._by_arguments = frozenset([*vars(self), "_by_arguments"])

    def _use(self, engine: Engine) -> None:
        self._engine = engine
        self._paced: PacedSteps | None = None
        if self.pace.action_repeat > 1 or self.pace.rate_limit is not None:
            self._paced = PacedSteps(engine, self.pace)

    def _shown(self, begun: Flags | None = None) -> NDArray[np.float32]:
        """Observations of the engine, or the frames that end with them.

        `begun`: rows that have begun an episode, without a step of the others.
        """
        observations = self._engine.outputs.observations
        if self._frames is None:
            return observations
        if begun is None:
            self._frames.add(observations)
            steps = self._engine.steps
            begun = steps == 0.0
        if begun.any():
            self._frames.begin(observations, begun)
        return self._frames.shown

    @property
    def spec(self) -> EnvSpec | None:
        """Registration of the environment, with the number of steps of an episode."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = None
        if spec is not None:
            given = {
                one.name: getattr(spec, one.name) for one in fields(spec) if one.init
            }
            steps = ceil(self.task.episode_steps / self.pace.action_repeat)
            longest = spec.kwargs.get(LONGEST) or -1
            given[LONGEST] = min(steps, longest) if longest > 0 else steps
            self._spec = ShipSpec(**given)

    @property
    def dt(self) -> float:
        """Time of a step, s: the control interval, times `action_repeat`."""
        return self.pace.action_repeat * self._engine.dt

    def __reduce__(self) -> Any:
        attributes = {}
        for name, value in vars(self).items():
            if name not in self._by_arguments:
                attributes[name] = value
        state = None
        if self._begun:
            kept = {name: getattr(self, name, None) for name in KEPT}
            engine_state = self._engine.get_state()
            state = (engine_state, kept)
        kind = type(self)
        return rebuild, (kind, self._arguments, state, attributes)

    def __deepcopy__(self, memo: dict[int, Any]) -> Any:
        _, (kind, arguments, state, attributes) = self.__reduce__()
        return rebuild(kind, arguments, state, copy.deepcopy(attributes, memo))

    def _continue(self, engine_state: Any, kept: dict[str, Any]) -> None:
        """Continue from the state of an environment with the same arguments."""
        self._begun = True
        engine = self._engine
        engine.set_state(engine_state)
        self._use(engine)
        vars(self).update(copy.deepcopy(kept))
        for artist in self._artists:
            artist.begin(engine)

    def _refuse_step(self) -> NoReturn:
        """Raise the InputError of an environment in which no episode goes on."""
        raise InputError(
            "step: no episode has begun, it is over, or the environment was closed;"
            " call reset first"
        )

    def _warn_of_no_mode(self) -> None:
        """Warn, as Gymnasium's environments do, that nothing can be rendered."""
        if self.render_mode is None:
            gymnasium.logger.warn(
                "render: expected a render_mode, got none; give it where the"
                " environment is made, such as render_mode='rgb_array'"
            )

    def _drawn_keys(self) -> NDArray[np.uint64]:
        """Keys of episodes from the environment's own random numbers."""
        rows = range(self._engine.num_envs)
        keys = [episode_key(self.np_random) for _ in rows]
        return np.array(keys, dtype=np.uint64)

    def _draw(self, mask: Flags | None = None) -> None:
        """Extend the wakes, or begin them with an episode, in the rows of a mask."""
        engine = self._engine
        for row, artist in enumerate(self._artists):
            if mask is not None and not mask[row]:
                continue
            if engine.steps[row] == 0:
                artist.begin(engine)
            else:
                artist.note(engine)


def rebuild(
    kind: Any,
    arguments: dict[str, Any],
    state: Any,
    attributes: dict[str, Any],
) -> Any:
    """Rebuild an environment from its arguments, state and attributes."""
    env = kind(**arguments)
    vars(env).update(attributes)
    if state is not None:
        env._continue(*state)
    return env
