"""What every heading autopilot does to its order, and the gear that it knows.

Source: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 11.2
(low-pass and notch filters against waves), 13.2 (dead-band).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from agents.controllers.law import Biquad
from agents.settings import Settings, Step, setting
from shipgym import ShipModel
from shipgym.checks import check_number, check_table
from shipgym.instruments.noise import SEA_TRIAL

LONGEST_WAVE = 60.0  # s, with which a sea is met
#: Corners of the wave filter that are tried, over the frequency of the waves.
CORNERS = (0.5, 0.7, 1.0, 1.4, 2.0)
#: Gains of the helm in a controller's file, least and largest.
HELM = {
    "rudder_update": (0.0, 1.0),
    "rudder_band": (0.0, np.pi),
    "wave_period": (0.0, LONGEST_WAVE),
    "wave_corner": (CORNERS[0], CORNERS[-1]),
    "schedule": (0.0, 1.0),
    "gear_share": (0.0, 1.0),
    "gear_step": (0.0, 1e9),
}


@dataclass(frozen=True)
class HelmSettings(Settings):
    """Settings of every heading autopilot."""

    wave_period: float | None = setting(
        "of the waves as they are met, s, whose yawing is not answered with rudder; by"
        " default that of the task's sea, else that which the trials show, else 0: no"
        " filter",
        None,
        at_least=0.0,
        at_most=LONGEST_WAVE,
        search=Step(0.3, reach=3.0),
    )
    schedule: float = setting(
        "1 for gains that follow the measured speed, 0 for the same at all speeds",
        1.0,
        at_least=0.0,
        at_most=1.0,
    )

    def helm(self, model: ShipModel, dt: float) -> dict[str, float]:
        """Gains of the helm on a model; `dt`: control interval, s.

        Raises InputError for a wave that the interval cannot follow.
        """
        period = self.wave_period
        if period is None:
            shown = logged(model, "wave_period", at_most=LONGEST_WAVE)
            period = shown if shown > 2.0 * dt else 0.0
        check_wave(period, dt)
        gear = model.steering
        lag = gear.time_constant
        share = 1.0 - np.exp(-dt / lag) if lag > 0.0 else 1.0
        return {
            "rudder_update": 1.0,
            "rudder_band": 0.0,
            "wave_period": period,
            "wave_corner": CORNERS[0],
            "schedule": self.schedule,
            "gear_share": float(share),
            "gear_step": gear.rate * dt,
        }


def check_wave(period: float, dt: float) -> None:
    """Refuse a wave of a period, s, that a control interval of dt cannot follow."""
    if period != 0.0:
        hint = "two control intervals, in s; 0 for no filter"
        check_number(period, "wave_period", above=2.0 * dt, hint=hint)


def noise_setting(search: Step | None = None) -> Any:
    """Setting of designs that know their sensors."""
    return setting(
        "of heading and yaw rate, in multiples of a sea trial's sensors (`SEA_TRIAL`);"
        " by default what the trials of the model show, at least 1 and at most 10",
        None,
        above=0.0,
        search=search,
    )


def logged_noise(model: ShipModel) -> float:
    """Noise of heading and yaw rate in a model's trials, as settings have it.

    The larger of the two, and at least 1: what a log smooths, the autopilot still sees.
    """
    heading = logged(model, "noise", "psi") / SEA_TRIAL["heading"]
    yaw_rate = logged(model, "noise", "r") / SEA_TRIAL["yaw_rate"]
    return float(np.clip(max(heading, yaw_rate), 1.0, 10.0))


def logged(model: ShipModel, *place: str, at_most: float = 1e9) -> float:
    """Number in a model's provenance; 0 where there is none."""
    found = model.provenance or {}
    where = f"model '{model.name}': provenance"
    for name in place:
        found = check_table(found, where).get(name) or {}
        where = f"{where}.{name}"
    return check_number(found or 0.0, where, at_least=0.0, at_most=at_most)


def known(settings: Settings) -> dict[str, float]:
    """Settings by name, without those that have no value."""
    values = settings.to_dict()
    return {name: value for name, value in values.items() if value is not None}


def wave_filter(period: Any, share: Any, dt: float) -> Biquad:
    """Low-pass with a notch at the waves; the identity for a period of 0.

    H(s) = (w / n)^2 (s^2 + 2 depth n s + n^2) / (s^2 + 2 damping w s + w^2), with n the
    frequency of the waves and w a share of it, by the bilinear transform.
    """
    depth, damping = 0.2, 0.6
    is_asked = np.greater(period, 0.0)
    notch = np.tan(np.pi * dt / np.where(is_asked, period, 4.0 * dt))
    corner = share * notch
    norm = 1.0 + 2.0 * damping * corner + corner * corner
    gain = share * share / norm
    square = notch * notch
    numbers = (
        gain * (1.0 + 2.0 * depth * notch + square),
        gain * 2.0 * (square - 1.0),
        gain * (1.0 - 2.0 * depth * notch + square),
        2.0 * (corner * corner - 1.0) / norm,
        (1.0 - 2.0 * damping * corner + corner * corner) / norm,
    )
    return Biquad(
        *[
            np.where(is_asked, one, none)[()]
            for one, none in zip(numbers, Biquad(), strict=True)
        ]
    )
