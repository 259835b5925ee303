import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from shipgym import InputError, check_vector_env

pytestmark = pytest.mark.interpreted


class Walker(gymnasium.Env):
    """Draws where it begins and when it ends; what it costs is its distance."""

    observation_space = Box(-99.0, 99.0, (2,), np.float32)
    action_space = Box(-1.0, 1.0, (1,), np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.x, self.k = self.np_random.random(), 0
        self.last = 3 + self.np_random.integers(4)
        return self.seen(), {"k": self.k}

    def seen(self):
        return np.array([self.x, self.k], np.float32)

    def step(self, action):
        if np.isnan(action).any():
            raise ValueError("action: expected a number")
        self.x += 0.1 * float(action[0])
        self.k += 1
        return self.seen(), -(self.x**2), self.k >= self.last, False, {"k": self.k}


class Walkers(SyncVectorEnv):
    """Two walkers, as promised."""

    mode = AutoresetMode.NEXT_STEP

    def __init__(self):
        super().__init__([Walker] * 2, autoreset_mode=self.mode)


class SameStep(Walkers):
    mode = AutoresetMode.SAME_STEP


class Disabled(Walkers):
    mode = AutoresetMode.DISABLED


@pytest.mark.parametrize("kind", [Walkers, SameStep, Disabled])
def test_an_environment_that_keeps_its_promises_passes(kind):
    assert check_vector_env(kind, Walker, n_steps=60) is None


def changed(index, change):
    """Methods of which one value of a step's answer is another."""

    def step(self, actions):
        answer = list(SyncVectorEnv.step(self, actions))
        answer[index] = change(answer[index])
        return tuple(answer)

    return {"step": step}


def without_final(infos):
    return {name: value for name, value in infos.items() if name != "final_info"}


WRONG = [
    (Walkers, {"metadata": {}}, r"metadata\['autoreset_mode'\]: expected a member"),
    (
        Walkers,
        {"reset": lambda self, **given: SyncVectorEnv.reset(self, **given)[0]},
        r"reset: expected \(observations, infos\)",
    ),
    (
        Walkers,
        {"reset": lambda self, **given: SyncVectorEnv.reset(self, seed=5)},
        "reset: observations: expected row 0 as the single environment's",
    ),
    (
        Walkers,
        {"step": lambda self, actions: SyncVectorEnv.step(self, actions)[:4]},
        "step 1: expected 5 values, got 4",
    ),
    (Walkers, changed(0, lambda one: one + 9), "step 1: observations: expected row 0"),
    (Walkers, changed(1, lambda one: one[:1]), "step 1: rewards: shape and type"),
    (Walkers, changed(2, lambda one: one * 1.0), "step 1: terminated: shape and type"),
    (Walkers, changed(4, lambda one: []), "step 1: infos: expected a dict of arrays"),
    (Walkers, changed(4, lambda one: {"k": one["k"]}), r"infos\['_k'\]: expected a ma"),
    (SameStep, changed(4, without_final), "'final_info' in infos, as an episode ended"),
    (Disabled, changed(2, np.zeros_like), "terminated: expected row"),
]


@pytest.mark.parametrize(
    ("kind", "changes", "message"), WRONG, ids=[message for *_, message in WRONG]
)
def test_each_promise_that_is_broken_is_named(kind, changes, message):
    broken = type("Broken", (kind,), {})

    def make():
        env = broken()
        for name, change in changes.items():
            bound = change.__get__(env) if callable(change) else change
            setattr(env, name, bound)
        return env

    with pytest.raises(InputError, match=f"(?s)^vector environment: .*{message}"):
        check_vector_env(make, Walker, n_steps=30)


def test_a_returned_array_stays_as_it_was():
    class Reused(Walkers):
        def __init__(self):
            super().__init__()
            self.mine = np.zeros(2)

        def step(self, actions):
            seen, rewards, *rest = super().step(actions)
            self.mine[:] = rewards
            return seen, self.mine, *rest

    with pytest.raises(InputError, match="expected earlier arrays as they were"):
        check_vector_env(Reused, Walker, n_steps=30)
