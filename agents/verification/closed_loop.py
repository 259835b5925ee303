"""Designs in closed loop with the models drawn.

A covariance reaches further than the trials allow: a model that runs away in a trial
that the ship was put through, or gathers speed without end on a straight course, does
not count, since no autopilot steers the speed.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from agents.controllers.controller import Controller
from agents.rollouts.course_keeping import Episodes, sail
from agents.verification.tracks import Track, judged_task, keep_track
from identification.samples.prediction import predict
from shipgym.arrays import Flags, Integers
from shipgym.errors import InputError, UnstableModelError
from shipgym.models import ShipModel
from shipgym.models.simulate import orders, simulate
from shipgym.trials.trial import Trial

#: Share of the models drawn that an autopilot may lose control of.
MOST_LOST = 0.05


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """The models drawn that designs are judged on.

    Of those that a design loses, the ones that the ship cannot be do not count.
    """

    model: ShipModel  # the identified one
    draws: Sequence[ShipModel]
    seeds: Integers  # of the episode of each
    trials: Sequence[Trial] = ()  # that the ship was put through
    #: whether models that a design lost are possible, by number
    possible: dict[int, bool] = field(default_factory=dict)

    @property
    def counted(self) -> Flags:
        """Models that count, shape (n_draws,)."""
        numbers = range(len(self.draws))
        return np.array([self.possible.get(number, True) for number in numbers])

    def sail(self, autopilot: Controller) -> Episodes:
        """An episode of each model under a heading autopilot."""
        return sail(autopilot, self.draws, judged_task(), self.seeds)

    def led(self, guide: Controller) -> Track:
        """Track of the identified model and of the models drawn under a guide."""
        return keep_track(guide, [self.model, *self.draws])

    def look_at(self, lost: Flags) -> None:
        """Find out which models that a design lost are possible, shape (n_draws,)."""
        for number in np.flatnonzero(lost).tolist():
            if number not in self.possible:
                self.possible[number] = is_possible(
                    self.draws[number],
                    self.trials,
                )

    def of_counted(self, track: Track) -> Track:
        """Track of the identified model and of the models that count."""
        counted = np.concatenate([[True], self.counted])
        return replace(
            track,
            largest=track.largest[counted],
            rms=track.rms[counted],
            arrived=track.arrived[counted],
        )


def loses_too_many(lost: Flags, counted: Flags) -> bool:
    """Return True if a design loses too many of the models that count.

    Where less than a quarter of the models counts, nothing is known.
    """
    if np.mean(counted) < 0.25:
        return True
    return bool(np.mean(lost[counted]) > MOST_LOST)


def lost_tracks(track: Track) -> Flags:
    """Models drawn that a guide did not lead to the end of the track.

    All of them, if it did not lead the identified one there.
    """
    if not track.arrived[0]:
        return np.ones(len(track.arrived) - 1, dtype=np.bool_)
    return ~track.arrived[1:]


def is_possible(model: ShipModel, trials: Sequence[Trial]) -> bool:
    """Return False for a model that runs away in a trial or straight ahead."""
    if gathers_speed(model):
        return False
    return all(not _runs_away(model, trial) for trial in trials)


def _runs_away(model: ShipModel, trial: Trial) -> bool:
    try:
        return predict(model, trial) is None
    except InputError:  # it lacks a channel that the simulation needs
        return False


def gathers_speed(model: ShipModel) -> bool:
    """Return True if a model's speed runs away with the rudder amidships.

    One that turns off its course before may still be steered.
    """
    steps_per_length = 30
    amidships = np.zeros(100 * steps_per_length)
    try:
        simulate(
            model,
            orders(model, amidships),
            model.travel_time / steps_per_length,
        )
    except UnstableModelError as error:
        turned = abs(error.state.get("r", 0.0)) * model.travel_time
        return bool(turned < 1.0)
    return False
