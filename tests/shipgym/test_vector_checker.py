import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from shipgym import InputError, check_vector_env


def single():
    return gymnasium.make("shipgym/CourseKeeping-v0", episode_steps=30, disable_env_checker=True)


class Right(SyncVectorEnv):
    """Three ships by Gymnasium's own means."""

    mode = AutoresetMode.NEXT_STEP

    def __init__(self):
        super().__init__([single] * 3, autoreset_mode=self.mode)


class WithoutMode(Right):
    def __init__(self):
        super().__init__()
        self.metadata = {}


class ShowsItsBuffer(Right):
    def __init__(self):
        SyncVectorEnv.__init__(self, [single] * 3, copy=False, autoreset_mode=self.mode)


class PaysForTheReset(Right):
    def step(self, actions):
        observations, rewards, *rest = super().step(actions)
        return observations, rewards + 1.0, *rest


class ForgetsTheSeed(Right):
    def reset(self, *, seed=None, options=None):
        return super().reset(seed=None, options=options)


class TakesAnything(Right):
    def step(self, actions):
        return super().step(np.nan_to_num(np.asarray(actions)[:3]))


class MasksNothing(Right):
    def step(self, actions):
        *outcome, infos = super().step(actions)
        return *outcome, {key: value for key, value in infos.items() if not key.startswith("_")}


class SameStep(Right):
    mode = AutoresetMode.SAME_STEP


class HidesTheEnd(SameStep):
    def step(self, actions):
        *outcome, infos = super().step(actions)
        return *outcome, {key: value for key, value in infos.items() if "final" not in key}


class Disabled(Right):
    mode = AutoresetMode.DISABLED


class ResetsAll(Disabled):
    def reset(self, *, seed=None, options=None):
        return super().reset(seed=seed)


@pytest.mark.parametrize("kind", [Right, SameStep, Disabled])
def test_what_is_right_passes(kind):
    check_vector_env(kind, single, n_steps=70)


@pytest.mark.parametrize(
    ("kind", "fault"),
    [
        (WithoutMode, "autoreset_mode"),
        (ShowsItsBuffer, "changed an array"),
        (PaysForTheReset, "begins an episode earned"),
        (ForgetsTheSeed, "same seed"),
        (TakesAnything, "expected an error"),
        (MasksNothing, "expected a mask"),
        (HidesTheEnd, "no 'final_obs'"),
        (ResetsAll, "changed rows outside"),
    ],
)
def test_what_is_wrong_is_named(kind, fault):
    with pytest.raises(InputError, match=fault):
        check_vector_env(kind, n_steps=70)


def test_rows_that_are_other_ships_are_named():
    def tanker():
        return gymnasium.make("shipgym/CourseKeeping-v0", model="tanker", disable_env_checker=True)

    with pytest.raises(InputError, match="row 0 shows"):
        check_vector_env(Right, tanker, n_steps=5)


def test_a_single_ship_is_enough_of_a_batch():
    class Alone(Right):
        def __init__(self):
            SyncVectorEnv.__init__(self, [single], autoreset_mode=self.mode)

    check_vector_env(Alone, n_steps=5)
