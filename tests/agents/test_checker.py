"""The conformance suite finds each broken promise and passes controllers that keep
them."""

import numpy as np
import pytest

from agents import LQ, LQG, PID, check_controller
from shipgym.errors import InputError
from shipgym.models import load_model
from shipgym.tasks import path_following_task
from shipgym.tasks.scales import OBSERVATION_NAMES

MARINER = load_model("mariner")


@pytest.mark.parametrize("kind", [PID, LQ, LQG])
def test_our_controllers_pass_in_both_tasks(kind):
    controller = kind.from_model(MARINER)
    check_controller(controller, n_steps=20)
    check_controller(controller, MARINER, path_following_task(), n_steps=20)


class Helmsman:
    """A user's own: rudder like heading error."""

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return self.answer(np.asarray(observation), state)

    def answer(self, seen, state):
        return seen[..., :1], state


class Moody(Helmsman):
    def __init__(self):
        self.calls = 0

    def answer(self, seen, state):
        self.calls += 1
        return seen[..., :1] * (1.0 - 1e-3 * self.calls), state


class Herd(Helmsman):
    def answer(self, seen, state):
        return np.broadcast_to(seen[..., :1].mean(), seen[..., :1].shape), state


class Hanger(Helmsman):
    """Remembers the last heading error, also beyond the episode."""

    def answer(self, seen, state):
        before = seen[..., :1] if state is None else state
        return 0.5 * (seen[..., :1] + before), seen[..., :1].copy()


class Vandal(Helmsman):
    def answer(self, seen, state):
        action = seen[..., :1].copy()
        seen *= 1.0
        seen[..., -1] = 0.123
        return action, state


class Divider(Helmsman):
    def answer(self, seen, state):
        return seen[..., :1] * np.nan, state


class Hard(Helmsman):
    def answer(self, seen, state):
        return 100.0 * seen[..., :1], state


class Wordy(Helmsman):
    def answer(self, seen, state):
        return [["port"]] * len(seen) if seen.ndim == 2 else ["port"], state


class Flat(Helmsman):
    def answer(self, seen, state):
        return seen[..., 0], state


class Curt(Helmsman):
    def answer(self, seen, state):
        return seen[..., :1]


class Triple(Helmsman):
    def answer(self, seen, state):
        return seen[..., :1], state, "and more"


class Misnamed(Helmsman):
    observation_names = ("heading_error", *OBSERVATION_NAMES[1:])


class Misscaled(Helmsman):
    observation_names = OBSERVATION_NAMES
    observation_scales = (1.0, 2.0)


def test_a_user_s_own_passes():
    check_controller(Helmsman())
    check_controller(Helmsman(), load_model("kvlcc2"), n_steps=3)
    check_controller(Helmsman(), n_steps=2)
    with pytest.raises(InputError, match=r"^n_steps: "):
        check_controller(Helmsman(), n_steps=1)


@pytest.mark.parametrize(
    ("controller", "message"),
    [
        (Moody(), "expected the same action for the same state"),
        (
            Herd(),
            (
                "ship 0 alone: .* rows of a batch and episodes must be independent of"
                " each other"
            ),
        ),
        (Hanger(), "episode_start True and the state of another episode: expected"),
        (Vandal(), "expected the observation left as it was"),
        (Divider(), "step 0: expected parts .*, got .*nan.*; look for a division"),
        (Hard(), r"expected parts of the rudder limit in \[-1, 1\]"),
        (Wordy(), "expected an array of numbers, got list"),
        (Flat(), r"expected actions of shape \(3, 1\), got \(3,\)"),
        (Curt(), "expected a pair: action and state, got ndarray"),
        (Triple(), "expected a pair: action and state, got tuple"),
        (object(), "expected a method predict"),
        (
            Misnamed(),
            "observation 0: expected 'heading_error', got 'heading_error_sin'",
        ),
        (Misscaled(), "scale of 'heading_error_cos': expected 2, got 1"),
    ],
    ids=lambda value: type(value).__name__ if not isinstance(value, str) else "",
)
def test_a_broken_promise_is_named(controller, message):
    with pytest.raises(InputError, match=message):
        check_controller(controller, MARINER)


def test_a_predict_of_other_arguments_is_named():
    class Own:
        def predict(self, observation):
            return observation, None

    with pytest.raises(InputError, match=r"Own.predict: expected predict\(observation"):
        check_controller(Own())
