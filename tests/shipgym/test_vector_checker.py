import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box, Discrete
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from gymnasium.vector.utils import batch_space

from shipgym import InputError, check_vector_env


def single():
    return gymnasium.make(
        "shipgym/CourseKeeping-v0", episode_steps=30, disable_env_checker=True
    )


class Right(SyncVectorEnv):
    """Three ships by Gymnasium's own means."""

    mode = AutoresetMode.NEXT_STEP

    def __init__(self):
        super().__init__([single] * 3, autoreset_mode=self.mode)


class SameStep(Right):
    mode = AutoresetMode.SAME_STEP


class Disabled(Right):
    mode = AutoresetMode.DISABLED


@pytest.mark.parametrize("kind", [Right, SameStep, Disabled])
def test_what_is_right_passes(kind):
    check_vector_env(kind, single, n_steps=70)


class Walker(gymnasium.Env):
    """Draws where it begins and when it ends, and goes where it is told; what it costs
    is its distance."""

    observation_space = Box(-99.0, 99.0, (2,), np.float32)
    action_space = Box(-1.0, 1.0, (1,), np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.x, self.k, self.last = (
            self.np_random.random(),
            0,
            3 + self.np_random.integers(4),
        )
        return self.seen(), {}

    def seen(self):
        return np.array([self.x, self.k], np.float32)

    def step(self, action):
        self.x, self.k = self.x + 0.1 * float(action[0]), self.k + 1
        return self.seen(), -(self.x**2), self.k >= self.last, False, {}


class Walkers(VectorEnv):
    """Two walkers, as promised."""

    mode = AutoresetMode.NEXT_STEP
    single_observation_space, single_action_space = (
        Walker.observation_space,
        Walker.action_space,
    )
    num_envs = 2

    def __init__(self):
        self.metadata = {"autoreset_mode": self.mode}
        self.observation_space = batch_space(Walker.observation_space, 2)
        self.action_space = batch_space(Walker.action_space, 2)
        self.walkers = [Walker() for _ in range(2)]

    def reset(self, *, seed=None, options=None):
        seeds = (
            [seed + k for k in range(2)]
            if isinstance(seed, int)
            else seed or [None, None]
        )
        mask = (options or {}).get("reset_mask", np.ones(2, np.bool_))
        for walker, one, asked in zip(self.walkers, seeds, mask, strict=True):
            if asked:
                walker.reset(seed=one)
        self.over = np.zeros(2, np.bool_)
        return self.seen(), self.infos()

    def seen(self):
        return np.stack([walker.seen() for walker in self.walkers])

    def infos(self):
        k = np.array([walker.k for walker in self.walkers])
        return {
            "k": k,
            "_k": np.ones(2, np.bool_),
            "more": {"k": k, "_k": np.ones(2, np.bool_)},
        } | {"_more": np.ones(2, np.bool_)}

    def step(self, actions):
        if actions.shape != (2, 1) or not np.isfinite(actions).all():
            raise ValueError("no actions")
        rewards, terminated = np.zeros(2), np.zeros(2, np.bool_)
        for k, walker in enumerate(self.walkers):
            if self.over[k] and self.mode is AutoresetMode.NEXT_STEP:
                walker.reset()
            else:
                _, rewards[k], terminated[k], *_ = walker.step(actions[k])
        self.over = terminated
        infos = self.infos()
        if self.mode is AutoresetMode.SAME_STEP and terminated.any():
            infos |= {
                "final_obs": self.seen(),
                "final_info": {},
                "_final_obs": terminated,
                "_final_info": terminated,
            }
            for k in np.flatnonzero(terminated):
                self.walkers[k].reset()
        return self.seen(), rewards, terminated, np.zeros(2, np.bool_), infos


class WalkersInTurn(Walkers):
    mode = AutoresetMode.SAME_STEP


class WalkersByHand(Walkers):
    mode = AutoresetMode.DISABLED


@pytest.mark.parametrize("kind", [Walkers, WalkersInTurn, WalkersByHand])
def test_any_environment_that_keeps_its_promises_passes(kind):
    check_vector_env(kind, Walker, n_steps=60)


def changed_step(**changes):
    """A step of which some of the answer is another."""

    def step(self, actions):
        names = ("seen", "rewards", "terminated", "truncated", "infos")
        answer = dict(zip(names, Walkers.step(self, actions), strict=True))
        return tuple(
            (
                answer
                | {name: change(answer[name]) for name, change in changes.items()}
            ).values()
        )

    return {"step": step}


def changed_reset(change):
    return {"reset": lambda self, **given: change(Walkers.reset(self, **given))}


class EndsAtOnce(Walkers):
    """An episode that is over before its first step."""

    def step(self, actions):
        seen, rewards, _, *rest = super().step(actions)
        self.over = np.ones(2, np.bool_)
        return seen, 0.0 * rewards, np.ones(2, np.bool_), *rest


def keeps(self, seed=None, options=None):
    return (self.seen(), self.infos()) if options else Walkers.reset(self, seed=seed)


def takes_one_seed(self, seed=None, options=None):
    return Walkers.reset(self, seed=5 if isinstance(seed, list) else seed)


def ended(**changes):
    """Infos of episodes that ended are others."""
    return changed_step(
        infos=lambda one: (
            one | {k: f(one[k]) for k, f in changes.items()}
            if "final_obs" in one
            else one
        )
    )


WIDE = {"single_observation_space": Box(-9.0, 9.0, (3,), np.float32)}
FOUR = {"step": lambda self, actions: Walkers.step(self, actions)[:4]}
ONE_EPISODE = {
    "reset": lambda self, seed=None, options=None: Walkers.reset(self, seed=5)
}
UNMASKED = changed_step(infos=lambda one: one | {"more": {"l": one["k"]}})
NO_INFO = changed_step(
    infos=lambda one: {k: v for k, v in one.items() if "final_info" not in k}
)
WRONG = [
    (Walkers, {"num_envs": 0}, "num_envs: expected >= 1, got 0"),
    (Walkers, {"num_envs": 2.0}, "num_envs: expected >= 1, got 2.0"),
    (
        Walkers,
        WIDE,
        "observation_space: expected Box.* single_observation_space batched",
    ),
    (
        Walkers,
        {"single_action_space": Discrete(3)},
        "action_space: expected MultiDiscrete.* got Box",
    ),
    (
        Walkers,
        changed_reset(lambda given: given[0]),
        r"reset: expected .* got <class 'numpy.ndarray'>",
    ),
    (
        Walkers,
        changed_reset(lambda given: given * 2),
        "reset: expected .* got <class 'tuple'>",
    ),
    (
        Walkers,
        changed_reset(lambda given: (given[0] + 999, {})),
        "reset: observations: expected a member of Box",
    ),
    (
        Walkers,
        changed_reset(lambda given: (given[0], [])),
        "reset: infos: expected a dict of arrays, got <class 'list'>",
    ),
    (Walkers, FOUR, "step: expected 5 values, got 4"),
    (
        Walkers,
        changed_step(seen=lambda one: one + 999),
        "step: observations: expected a member of Box",
    ),
    (
        Walkers,
        changed_step(rewards=lambda one: one[:1]),
        r"step: rewards: expected shape and type .*got \(\(1,\), dty",
    ),
    (
        Walkers,
        changed_step(rewards=lambda one: one.astype(int)),
        "step: rewards: expected shape and type .*int64",
    ),
    (
        Walkers,
        changed_step(terminated=lambda one: one * 1.0),
        "step: terminated: expected shape and type .*float64",
    ),
    (
        Walkers,
        changed_step(truncated=lambda one: one.tolist()),
        r"truncated: expected shape .* \(None, None\)",
    ),
    (
        Walkers,
        changed_step(rewards=lambda one: one / 0.0),
        "step: rewards: expected finite numbers",
    ),
    (
        Walkers,
        changed_step(infos=lambda one: one | {"k": [1]}),
        r"\['k'\]: expected an entry for each row, got \[1\]",
    ),
    (
        Walkers,
        changed_step(infos=lambda one: one | {"k": np.zeros(3)}),
        r"\['k'\]: expected an entry for each row",
    ),
    (
        Walkers,
        changed_step(infos=lambda one: one | {"_k": [True] * 2}),
        r"infos\['_k'\]: expected a mask .* got \[True, True\]",
    ),
    (
        Walkers,
        changed_step(infos=lambda one: one | {"_k": one["k"]}),
        r"step: infos\['_k'\]: expected a mask .* got array",
    ),
    (
        Walkers,
        changed_step(infos=lambda one: one | {"_k": one["_k"][:1]}),
        r"step: infos\['_k'\]: expected a mask .* got array",
    ),
    (
        Walkers,
        UNMASKED,
        r"step, more: infos\['_l'\]: expected a mask of 2 booleans, got None",
    ),
    (
        Walkers,
        {"reset": takes_one_seed},
        r"gave another episode than reset\(seed=\[s, s \+ 1",
    ),
    (Walkers, ONE_EPISODE, "reset with another seed gave the same first observations"),
    (EndsAtOnce, {}, "an episode ended in the step that had begun it"),
    (WalkersInTurn, NO_INFO, "no 'final_info'"),
    (
        WalkersInTurn,
        ended(_final_obs=np.zeros_like),
        r"\['_final_obs'\]: expected the ended rows .* got \[False False\]",
    ),
    (
        WalkersInTurn,
        ended(final_obs=lambda one: one + 999),
        r"infos\['final_obs'\]\[\d\]: expected an observation",
    ),
    (
        WalkersByHand,
        {"reset": keeps},
        "reset with a mask left a row within it as it was",
    ),
]


@pytest.mark.parametrize(
    ("kind", "changes", "message"), WRONG, ids=[message for *_, message in WRONG]
)
def test_each_promise_that_is_broken_is_named(kind, changes, message):
    broken = type("Broken", (kind,), changes)
    with (
        np.errstate(divide="ignore"),
        pytest.raises(InputError, match=f"(?s)^vector environment: .*{message}"),
    ):
        check_vector_env(broken, n_steps=30)
