"""What a vector environment gives away never changes, and arrays nobody holds are used
again."""

import gymnasium
import numpy as np
import pytest

import shipgym  # noqa: F401
from shipgym.errors import InputError


@pytest.fixture
def env():
    env = gymnasium.make_vec(
        "shipgym/CourseKeeping-v0", num_envs=3, vectorization_mode="vector_entry_point"
    )
    env.reset(seed=0)
    return env


def step(env, command=0.5):
    return env.step(np.full((3, 1), command, dtype=np.float32))


@pytest.mark.parametrize(
    "hold",
    [
        lambda out: out[0],
        lambda out: out[3],
        lambda out: out[4]["heading_error"],
        lambda out: out[4]["heading_error"][1:],
        lambda out: out[4]["extrapolating"],
        lambda out: memoryview(out[0]),
    ],
)
def test_what_is_held_stays_as_it_is(env, hold):
    held = hold(step(env))
    before = np.array(held)
    for _ in range(8):
        step(env, -1.0)
    np.testing.assert_array_equal(held, before)


def test_what_nobody_holds_is_used_again(env):
    used = {step(env)[0].ctypes.data for _ in range(8)}
    assert len(used) <= 2


def test_a_refused_command_changes_nothing(env):
    step(env)
    before = env.unwrapped.physical_state()
    with pytest.raises(InputError, match="got nan in lane 0"):
        step(env, np.nan)
    after = env.unwrapped.physical_state()
    assert all(np.array_equal(before[name], after[name]) for name in before)
