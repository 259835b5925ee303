"""One ship under a task as one of Gymnasium's environments."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from numpy.typing import NDArray

from shipgym.checks import did_you_mean, quoted
from shipgym.engine.episodes import REFUSED
from shipgym.envs.engine import Engine, as_array, as_numbers, episode_key
from shipgym.envs.outputs import STEP_OUTCOME
from shipgym.envs.randomisation import Randomisation
from shipgym.envs.remade import Remade, refuse_step
from shipgym.errors import InputError
from shipgym.instruments.sensor_set import read_sensors
from shipgym.ships import ShipModel, load_model
from shipgym.tasks.definition import read_definition
from shipgym.tasks.task import RUDDER_ORDERS, Task

Floats = NDArray[np.float64]
Observation = NDArray[np.float32]
Space = gymnasium.spaces.Box | gymnasium.spaces.Discrete
DEFAULT_MODEL = "mariner-tls-svm"
DEFAULT_TASK = "CourseKeeping"
FLOAT32 = np.dtype(np.float32)
ENV_OPTIONS = ("model", "task", "reward", "render_mode", "allow_unstable")


class UnknownKeywordError(InputError, TypeError):
    """A keyword that an environment does not take; libraries probe for it by its being a TypeError."""

    def __init__(self, message: str, known: Sequence[str] = ()) -> None:
        if known:  # made anew by Gymnasium, it has the message alone
            hint = f"{did_you_mean(message, known)} Known keys: {quoted(known)}; it is"
            wrong = f"unexpected keyword argument '{message}'"
            message = f"environment options: unknown key '{message}'.{hint} an {wrong}"
        super().__init__(message)


def read_options(
    task: Any, model: str | Path | ShipModel, options: Mapping[str, Any], taken: Sequence[str] = ()
) -> tuple[ShipModel, Task, Randomisation]:
    """The ship, the task and what is randomised, by an environment's keywords.

    `taken`: keywords that its caller takes beside them, for messages.

    Raises
    ------
    InputError
        For an unknown model or keyword, or a value out of its range.
    """
    definition = read_definition(task, options.get("reward"))
    sensors = options.get("sensors")
    own = Task.option_names(definition, None if sensors is None else read_sensors(sensors))
    known = [*taken, "reward", *own, *Randomisation.names()]
    unknown = [name for name in options if name not in known]
    if unknown:
        raise UnknownKeywordError(unknown[0], known)
    randomisation, rest = Randomisation.take_from(options)
    rest.pop("reward", None)
    if not isinstance(model, str | Path | ShipModel):
        raise InputError(f"model: {model!r} found, expected a name, the path of a model file, or a ShipModel")
    ship = model if isinstance(model, ShipModel) else load_model(model)
    return ship, Task.of(definition, **rest), randomisation


def spaces(task: Task, model: ShipModel) -> tuple[gymnasium.spaces.Box, Space]:
    """Observation and action space of a task for a ship."""
    observed = task.observed(model)
    low, high = (
        np.array([getattr(quantity, bound) for quantity in observed], dtype=np.float32)
        for bound in ("low", "high")
    )
    actions: Space = gymnasium.spaces.Box(-1.0, 1.0, (task.n_commands,), dtype=np.float32)
    if task.action == "rudder-discrete":
        actions = gymnasium.spaces.Discrete(len(RUDDER_ORDERS))
    return gymnasium.spaces.Box(low, high, dtype=np.float32), actions


class ShipEnv(Remade, gymnasium.Env[Observation, Any]):
    """One ship under a task; the environments differ by their task alone.

    The action is the commanded rudder, -1 to 1 of its limit, positive to starboard. The observation holds the
    quantities of `observation_names`, each divided by its entry of `observation_scales`. The reward is the
    sum of its parts, which `info` has by name. What is asked, observed and paid is told by the task's file
    (`shipgym/tasks/course_keeping.py`, `shipgym/tasks/path_following.py`, or one of your own).

    Parameters
    ----------
    model : str, Path or ShipModel
        A shipped model's name, the path of a model file, or a model.
    task : str, Path or module
        The name of a registered task, or the file of one (`shipgym.tasks.contract`).
    render_mode : {None, "human", "rgb_array"}
        As Gymnasium has it.
    allow_unstable : bool
        Whether a model that was found unstable when it was identified may be used.
    **options
        Settings of the task, fields of `Task` and of `Randomisation`; `reward` and `sensors`, files with a
        reward and a sensor set of your own (`shipgym.tasks.contract`).

    Raises
    ------
    InputError
        For an unknown model or keyword, or an argument out of its range.
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 30}  # noqa: RUF012 - Gymnasium declares it so

    def __init__(
        self,
        model: str | Path | ShipModel = DEFAULT_MODEL,
        task: Any = DEFAULT_TASK,
        render_mode: str | None = None,
        allow_unstable: bool = False,
        **options: Any,
    ) -> None:
        arguments = locals()
        self.render_mode = render_mode
        self._artist = _artist(render_mode)
        self.model, self.task, randomisation = read_options(task, model, options, ENV_OPTIONS)
        seen, commands = spaces(self.task, self.model)
        self.observation_space, self.action_space = seen, commands  # type: ignore[assignment]
        observed = self.task.observed(self.model)
        self.observation_names = tuple(quantity.name for quantity in observed)
        self.observation_scales = np.array([quantity.scale for quantity in observed])
        self._advance: Callable[[], int] = refuse_step
        self._use(Engine(self.model, 1, self.task, randomisation, allow_unstable))
        self._discrete = self.task.action == "rudder-discrete"
        self._names = self.task.info_names
        self._flags = [(name, k) for k, name in enumerate(self._names) if name in self.task.flags]
        self._key = 0
        self._episode = -1
        self._made(arguments)

    def _use(self, engine: Engine) -> None:
        self._engine = engine
        self._seen, self._outcomes = engine.shown.observations[0], engine.shown.outcomes[:, 0]
        self._step_of_one = engine.step_of_one()
        self._command = engine.command[:, 0]

    def _going(self) -> bool:
        return self._advance is not refuse_step

    def _counters(self) -> dict[str, Any]:
        return {"key": self._key, "episode": self._episode}

    def _recall(self, engine: Engine, state: Mapping[str, Any]) -> None:
        self._use(engine)
        self._key, self._episode, self._advance = state["key"], state["episode"], self._step_of_one
        if self._artist is not None:
            self._artist.begin(engine)

    @property
    def dt(self) -> float:
        """Control interval, s."""
        return self._engine.dt

    @property
    def waypoints(self) -> Floats | None:
        """North and east of this episode's path, m, shape (n, 2); None in course keeping."""
        return self._engine.waypoints()

    @property
    def corridor(self) -> float | None:
        """Half the width of the corridor along the path, m; None in course keeping."""
        return self._engine.path_metres("corridor")

    @property
    def turn_radius(self) -> float | None:
        """Radius of the turns of the path, m; None where it has none."""
        return self._engine.path_metres("turn_radius")

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode, straight ahead at service speed.

        Parameters
        ----------
        seed : int, optional
            Fixes this episode and all that follow it.
        options : dict, optional
            Until the next reset: `waypoints` of the path, or of several; `model_index`, the one of the ships
            that episodes are drawn from. Or, alone, `state`: go on from what `get_state` gave.

        Returns
        -------
        observation : float32 array
        info : dict
            As `step` has it, the parts of the reward 0.

        Raises
        ------
        InputError
            For other options, or a value that does not fit.
        """
        super().reset(seed=seed)
        if (state := self._take(options)) is not None:
            self.set_state(state)
            return self._seen.copy(), self._info(self._outcomes[STEP_OUTCOME:].tolist())
        if seed is not None or self._episode < 0:
            self._key = episode_key(self.np_random)
            self._episode = -1
        self._episode += 1
        self._advance = self._step_of_one
        self._engine.begin([self._key], [self._episode])
        if self._artist is not None:
            self._artist.begin(self._engine)
        if self.render_mode == "human":
            self.render()
        return self._seen.copy(), self._info(self._outcomes[STEP_OUTCOME:].tolist())

    def step(self, action: Any) -> tuple[Observation, SupportsFloat, bool, bool, dict[str, Any]]:
        """Hold a command over one control interval.

        Parameters
        ----------
        action : array of shape (n_commands,), or int
            Commanded rudder, and shaft speed, parts of their limits, clipped to [-1, 1]; or the number of a
            rudder order.

        Returns
        -------
        observation : float32 array
        reward : float
        terminated, truncated : bool
        info : dict
            The parts of the reward, `heading_error` in rad, `envelope_distance`, `extrapolating`, and what
            the environment's page names.

        Raises
        ------
        InputError
            If the action is not a finite number for each command, or no episode has begun.
        """
        self._order(action)
        if self._advance() == REFUSED:
            wrong = next(number for number in self._command.tolist() if not isfinite(number))
            raise InputError(f"action: {wrong} found, expected numbers in [-1, 1]: parts of the limit")
        values = self._outcomes.tolist()
        if not isfinite(values[0]):
            self._engine.refuse_rewards()
        info = self._info(values[STEP_OUTCOME:])
        if self._artist is not None:
            self._artist.note(self._engine)
            if self.render_mode == "human":
                self.render()
        return self._seen.copy(), values[0], values[1] > 0.0, values[2] > 0.0, info

    def _info(self, values: list[float]) -> dict[str, Any]:
        info: dict[str, Any] = dict(zip(self._names, values))  # noqa: B905 - as many, by construction
        for flag, k in self._flags:
            info[flag] = values[k] > 0.0
        return info

    def _order(self, action: Any) -> None:
        """Set the command, refusing what is none."""
        if self._discrete:
            self._command[0] = RUDDER_ORDERS[_one_order(action)]
            return
        array = action
        if not isinstance(array, np.ndarray) or array.dtype is not FLOAT32:
            array = as_numbers(action, "action")
        if array.shape != self._command.shape:
            what = "the commanded rudder" + (" and shaft speed" if len(self._command) > 1 else "")
            raise InputError(f"action: shape {array.shape} found, expected {self._command.shape}: {what}")
        self._command[...] = array

    def physical_state(self) -> dict[str, float]:
        """State, course to steer and weather by name, SI units (see `Engine.physical_state`)."""
        return {name: float(value[0]) for name, value in self._engine.physical_state().items()}

    def render(self) -> Any:
        """The ship on her chart, uint8 array of shape (600, 600, 3); None without a render mode."""
        if self._artist is None:
            return None
        picture = self._artist.picture(self._engine)
        return picture if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Close the window, if there is one; to step again takes a `reset`."""
        self._advance = refuse_step
        if self._artist is not None:
            self._artist.close()


def _one_order(action: Any) -> int:
    """The number of a discrete rudder order."""
    array = as_array(action)
    if array.shape != () or array.dtype.kind not in "iu" or not 0 <= array < len(RUDDER_ORDERS):
        raise InputError(
            f"action: {action!r} found, expected a whole number from 0 to {len(RUDDER_ORDERS) - 1}: "
            "a rudder order"
        )
    return int(array)


def _artist(render_mode: str | None) -> Any:
    """Who draws, if anyone does."""
    if render_mode is None:
        return None
    from shipgym.envs.artist import Artist

    return Artist(render_mode)
