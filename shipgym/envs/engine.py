"""Many ships at once under a task, without Gymnasium's interface."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, ClassVar, NoReturn

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from shipgym.arrays import Flags, Floats
from shipgym.checks import check_flag, check_number, check_whole
from shipgym.engine.compiling import entry_of
from shipgym.engine.episode_program import EpisodeProgram, episode_program
from shipgym.engine.episodes import BEGIN, BEGIN_NEXT, STEP, STEP_AND_BEGIN
from shipgym.engine.records import LANES
from shipgym.envs.lanes import Lanes
from shipgym.envs.outputs import ANSWER_FLAGS, ANSWER_OUTCOMES
from shipgym.envs.plain_python import fault_of_interval, plain_loop
from shipgym.envs.randomisation import Randomisation
from shipgym.errors import InputError
from shipgym.models import ShipModel
from shipgym.python_files import asked, place_of
from shipgym.sea.open_sea import CALM_SEA, OPEN_SEA
from shipgym.tasks.task import Task, course_keeping_task

Observation = NDArray[np.float32]


#: Programs whose first step was taken in plain Python.
_TRIED: set[EpisodeProgram] = set()


class Engine(Lanes):
    """A task for many ships at once.

    Raises InputError if `num_envs` is not positive, the number of models or their
    structures do not fit, a ship's particulars are not enough for the weather, or a
    model is unstable.

    Parameters
    ----------
    models : ShipModel or sequence of ShipModel
        One ship for all, or one for each lane; all of one structure.
    num_envs : int
        Number of lanes.
    task : Task, optional
        Task of the ships; by default course keeping.
    randomisation : Randomisation, optional
        Variation from episode to episode; only with one ship for all.
    allow_unstable : bool
        Whether a model that was found unstable when it was identified may be used.
    loop : callable, optional
        Makes the loop that steps the ships; by default it is compiled.
    cut_off : float
        Control intervals after which an episode is truncated, if earlier than by the
        task.

    Attributes
    ----------
    ship_steps : int
        Control intervals of ships that all engines of this process have taken.
    """

    ship_steps: ClassVar[int] = 0

    def __init__(
        self,
        models: ShipModel | Sequence[ShipModel],
        num_envs: int,
        task: Task | None = None,
        randomisation: Randomisation | None = None,
        allow_unstable: bool = False,
        loop: Callable[[EpisodeProgram], Any] | None = None,
        cut_off: float = np.inf,
    ) -> None:
        check_whole(num_envs, "num_envs", at_least=1)
        ships = [models] if isinstance(models, ShipModel) else list(models)
        _check_ships(ships, num_envs, allow_unstable)
        model = ships[0]
        task = task or course_keeping_task()
        task.check_fits(model)
        randomisation = randomisation or Randomisation()
        self.pool = randomisation.ships(model, task.seas)
        drawn = len(self.pool) > 1
        windy = any(not sea.calm for _, sea in self.pool)
        own = [(ship, task.seas[0]) for ship in ships]
        if drawn:
            if len(ships) > 1:
                raise InputError(
                    "models: expected a ship for each lane or a pool of ships, got both"
                )
            own = self.pool

        program = episode_program(
            model.compiled,
            OPEN_SEA if windy else CALM_SEA,
            task.definition,
            task.instruments(windy),
            len(own) == 1,
            task.checked,
        )
        super().__init__(
            program,
            model,
            task,
            num_envs,
            own,
            drawn,
            cut_off,
        )
        self._begin_all(loop or self._compiled)

    def _begin_all(self, loop: Callable[[EpisodeProgram], Any]) -> None:
        """Begin an episode in each lane, with the loop of the program."""
        self._orders = self._actions.T
        self.all_lanes = np.ones(self.num_envs, dtype=np.bool_)
        self.all_lanes.flags.writeable = False
        self.renew_outputs()
        # last, when no input is left that may be refused
        self._run = loop(self.program)
        if self.program.users_code and loop == self._compiled:
            self._run = partial(self._explained, self._run)
        self.reset(np.arange(self.num_envs))

    def _explained(self, run: Callable[..., int], *arguments: Any) -> int:
        """Run a compiled loop; InputError names what fails in it, and where."""
        try:
            return run(*arguments)
        except (IndexError, ArithmeticError, ValueError) as error:
            *_, asked = arguments
            begins = asked in (BEGIN, BEGIN_NEXT)
            fault = fault_in_python(self.model, self.task) if begins else self.fault()
            if not fault:
                functions = [place_of(one) for one in self.program.users_code]
                places = "; ".join(sorted(functions))
                fault = f"{type(error).__name__}: {error}, in one of these: {places}"
            raise InputError(fault) from None

    def fault(self) -> str:
        """Say what fails in the last interval: in plain Python, which knows the line.

        It is empty where nothing does.
        """
        program = self.program
        fault, lane = fault_of_interval(program, self._memory, len(self._states))
        return fault and f"{fault}, in lane {lane} at step {self.steps[lane]:g}"

    def _compiled(self, program: EpisodeProgram) -> Any:
        """Return the loop of a program; InputError names what does not compile."""
        if program.users_code and program not in _TRIED:
            # compiled, a loop that does not end cannot be stopped
            if fault := fault_in_python(self.model, self.task):
                raise InputError(fault)
            _TRIED.add(program)
        run = entry_of(program.run)
        task = program.task
        cost = asked(task.worst_cost, self.task.settings)
        where = f"{task.reward_source}: worst_cost"
        check_number(cost, where, at_least=0.0)
        return run

    def renew_outputs(self) -> None:
        """Write the next outputs into new arrays; earlier ones do not change."""
        self.outputs = self._output_pool.take()

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Continue from the `get_state` of an engine with the same arguments."""
        self._states[:] = state["states"]
        self._random[:] = state["random"]
        self._ships[:] = state["ships"]
        self.renew_outputs()
        self.outputs.memory[:] = state["outputs"]

    def advance(self, begin_ended: bool = False, anew: bool = False) -> int:
        """Take one control interval with the commands as they stand.

        With `begin_ended`, lanes whose episode was over begin the next one instead of
        staying as they are. With `anew`, results are written into new arrays, so that
        earlier ones may be kept. Returns the number of episodes that ended. Raises
        InputError if a command is not finite; nothing is changed then.
        """
        Engine.ship_steps += self.num_envs
        before = self.outputs
        if anew:
            self.renew_outputs()
        asked = STEP_AND_BEGIN if begin_ended else STEP
        n_ended: int = self._run(self._memory, self.outputs.memory, asked)
        if n_ended < 0:  # `REFUSED`
            self.outputs = before
            self._refuse_orders()
        return n_ended

    def _refuse_orders(self) -> NoReturn:
        """Raise an InputError that names the first command that is not finite."""
        is_wrong = ~np.isfinite(self._orders)
        places = np.argwhere(is_wrong)
        lane, command = places[0]
        found = self._orders[lane, command]
        raise InputError(
            f"actions: expected numbers in [-1, 1], got {found} in lane {lane}"
        )

    def step_of_one(self) -> Callable[[], int]:
        """Return the step of an engine of one lane, whose arrays stay the same.

        The step returns the number of episodes that ended, or
        `shipgym.engine.episodes.REFUSED`.
        """
        return partial(self._run, self._memory, self.outputs.memory, STEP)

    def reset(self, seeds: ArrayLike) -> Observation:
        """Begin in each lane the episode of the single environment's `reset(seed=...)`.

        `seeds` are those of the lanes, shape (num_envs,). Returns float32 observations
        of shape (num_envs, n_observations).
        """
        return self.begin(episode_keys(seeds))

    def begin(
        self,
        keys: ArrayLike,
        episodes: ArrayLike = 0,
        mask: ArrayLike = True,
    ) -> Observation:
        """Begin an episode in the lanes of a mask; return observations as `reset` does.

        An episode is a function of its key (`episode_keys`) and number under that key
        alone; keys, uint64, numbers and mask are of shape (num_envs,).
        """
        chosen = np.array(np.broadcast_to(mask, self.num_envs), dtype=np.bool_)
        lanes = np.flatnonzero(chosen)
        tiles, lanes_in_tile = np.divmod(lanes, LANES)
        for row, words in enumerate((keys, episodes)):
            numbers = np.asarray(words).astype(np.uint64)
            of_lanes = np.broadcast_to(numbers, (self.num_envs,))
            self._random[tiles, row, lanes_in_tile] = of_lanes[lanes]
        self._begin(chosen, BEGIN)
        return self.observations

    def begin_next(self, chosen: Flags) -> None:
        """Begin the next episode in the lanes of a mask, shape (num_envs,).

        Reward and ends of the last step stay.
        """
        outputs = self.outputs
        answer = outputs.outcomes[:ANSWER_OUTCOMES].copy()
        ends = outputs.flags[:ANSWER_FLAGS].copy()
        self._begin(chosen, BEGIN_NEXT)
        outputs.outcomes[:ANSWER_OUTCOMES] = answer
        outputs.flags[:ANSWER_FLAGS] = ends

    def _begin(self, chosen: Flags, asked: int) -> None:
        self._chosen[:] = chosen
        self._run(self._memory, self.outputs.memory, asked)

    def order(self, actions: ArrayLike) -> None:
        """Set the commands for the next step, which refuses non-finite ones.

        `actions`, shape (num_envs, n_commands), are commanded rudder, and shaft speed,
        parts of their limits, clipped to [-1, 1]. Raises InputError for another shape,
        texts, objects or complex numbers.
        """
        array = as_numbers(actions, "actions")
        shape = self._orders.shape
        if array.shape != shape:
            raise InputError(f"actions: expected shape {shape}, got {array.shape}")
        self._orders[...] = array

    def step(self, actions: ArrayLike) -> tuple[Observation, Floats, Flags, Flags]:
        """Take one control interval by orders (`order`).

        A lane whose episode is over stays as it is and earns 0. Returns float32
        observations of shape (num_envs, n_observations), rewards, and whether episodes
        were terminated and truncated, of shape (num_envs,); copies.
        """
        self.order(actions)
        self.advance()
        return (
            self.observations,
            self.outputs.outcomes[0].copy(),
            self.outputs.terminated.copy(),
            self.outputs.truncated.copy(),
        )

    def refuse_rewards(self) -> None:
        """Raise an InputError that names the last reward that is not finite."""
        at_fault = np.argwhere(~np.isfinite(self.reward_parts))
        if len(at_fault):
            lane, part = at_fault[0]
        else:  # finite numbers whose sum is not
            lane = np.argmax(~np.isfinite(self.outputs.outcomes[0]))
            part = 0
        name = self.task.reward_parts[part]
        reward = self.info(name)[lane]
        step = self.steps[lane]
        raise InputError(
            f"{self.task.definition.reward_source}: {name}: expected a finite number,"
            f" got {reward} in lane {lane} at step {step:g}; "
            + (self.fault() or "look for a division by zero")
        )

    @property
    def command(self) -> Observation:
        """Commands of the next step, shape (n_commands, num_envs); may be written."""
        return self._actions

    @property
    def observations(self) -> Observation:
        """Observations, float32, shape (num_envs, n_observations), a copy."""
        return self.outputs.observations.copy()

    def info(self, name: str) -> Floats:
        """Entry of `info` for each lane, shape (num_envs,), a view of the last step."""
        row = ANSWER_OUTCOMES + self.task.info_names.index(name)
        entry: Floats = self.outputs.outcomes[row]
        return entry

    @property
    def reward_parts(self) -> Floats:
        """Parts of the last rewards, shape (num_envs, n_parts)."""
        return np.stack([self.info(name) for name in self.task.reward_parts], axis=-1)


def _check_ships(
    ships: Sequence[ShipModel],
    num_envs: int,
    allow_unstable: bool,
) -> None:
    """Refuse too many or few ships, several structures, unstable models."""
    if len(ships) not in (1, num_envs):
        raise InputError(
            f"models: expected 1, or one for each of {num_envs} lanes, got {len(ships)}"
        )
    first = ships[0]
    if any(other.compiled is not first.compiled for other in ships):
        raise InputError("models: expected one structure in one engine, got several")
    check_flag(allow_unstable, "allow_unstable")
    for model in ships:
        provenance = model.provenance or {}
        if provenance.get("stable", True) is not False:
            continue
        found = (
            f"model {model.name!r}: expected a stable ship, got one that was found"
            " unstable when it was identified"
        )
        if not allow_unstable:
            raise InputError(
                f"{found}; identify it from more trials or with the guard, or give"
                " allow_unstable=True to use it all the same"
            )
        warnings.warn(
            f"{found}; do not trust what is learned or tuned on it", stacklevel=4
        )


def fault_in_python(model: ShipModel, task: Task) -> str:
    """Fault that plain Python finds in the first step of a task; empty if none.

    Arithmetic errors are ignored: compiled code continues with infinities and NaN.
    """
    try:
        with warnings.catch_warnings(action="ignore"):
            asked(_first_step, model, task)
    except InputError as error:
        if isinstance(error.__cause__, ArithmeticError | ValueError):
            return ""
        return str(error)
    return ""


def _first_step(model: ShipModel, task: Task) -> None:
    """Take a step in plain Python."""
    engine = Engine(model, 1, task, allow_unstable=True, loop=plain_loop)
    engine.step(np.zeros((1, task.n_commands)))
    engine.shapes(0)


def as_array(actions: Any) -> NDArray[Any]:
    """Actions as an array; of objects where NumPy cannot read them, as ragged lists."""
    try:
        return np.asarray(actions)
    except (TypeError, ValueError, RuntimeError):
        return np.array(None)


def as_numbers(actions: Any, where: str) -> NDArray[Any]:
    """Return actions as an array; InputError if it is not one of real numbers."""
    array = as_array(actions)
    if array.dtype.kind not in "fiub":
        raise InputError(
            f"{where}: expected real numbers, got {actions!r}; see the action space"
        )
    return array


def episode_keys(seeds: ArrayLike) -> NDArray[np.uint64]:
    """Keys of episodes for seeds of environments, of the same shape."""
    array = np.asarray(seeds)
    keys = []
    for seed in array.ravel().tolist():
        random, _ = gymnasium.utils.seeding.np_random(int(seed))
        keys.append(episode_key(random))
    return np.array(keys, dtype=np.uint64).reshape(array.shape)


def episode_key(random: np.random.Generator) -> int:
    """Draw the key of an episode, the only draw from an environment's generator."""
    return int(random.integers(2**63))
