"""PID autopilot by pole placement on the ship's Nomoto model.

Source: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 12.2
(pole placement); van Amerongen 1982, Adaptive steering of ships, chapter 3 (bandwidth
from the steering cost).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from agents.controllers.controller import Controller
from agents.controllers.helm import (
    HelmSettings,
    known,
    logged_noise,
    noise_setting,
)
from agents.controllers.linear_loop import (
    checked_interval,
    rate_weight,
    sample_ship,
)
from agents.settings import Step, setting
from shipgym import ShipModel
from shipgym.instruments.noise import SEA_TRIAL
from shipgym.models.by_name import takes_name
from shipgym.models.linear import Nomoto, nomoto
from shipgym.tasks.scales import RUDDER_WEIGHT


@dataclass(frozen=True)
class PIDSettings(HelmSettings):
    """Settings of PID."""

    frequency: float | None = setting(
        "natural frequency of the dominant pair of poles, rad/s; by default near that"
        " which the environment's cost asks for, lower where the lag is long",
        None,
        above=0.0,
        search=Step(0.5),
    )
    damping: float | None = setting(
        "its damping ratio, by default that which the cost asks for",
        None,
        above=0.0,
        search=Step(0.5),
    )
    integral_lengths: float = setting(
        "time for an offset to decay, in times to travel one ship length",
        20.0,
        above=0.0,
        search=Step(1.0),
    )

    noise: float | None = noise_setting()
    rudder_time: float | None = setting(
        "time constant of a low-pass on the order, in times to travel one ship length;"
        " by default that with which noise moves the rudder by 10 deg a minute",
        None,
        at_least=0.0,
        search=Step(1.2, start=0.05),
    )

    def completed(self, model: ShipModel, dt: float) -> Self:
        """Fill in what follows from a model and the control interval, s.

        Measured by the environment's cost on ships stable and unstable, gears slow and
        fast, and lags up to half a ship length: with these the PID costs at most 1.1
        times its best, 1.2 times in course changes of 5 deg.
        """
        response = nomoto(model)
        optimal, damping = optimal_poles(response, rate_weight(model))
        if self.damping is not None:
            damping = self.damping
        frequency = self.frequency
        if frequency is None:
            # of the optimal regulator, which feeds back the rudder too and can be
            # faster
            frequency_share = 0.85
            # up to which the gear's pole, by the sum of the roots, is no slower
            sum_of_roots = 1.0 / lag_of(model, dt) + 1.0 / response.T
            slow = self.integral_pole(model)
            largest = (sum_of_roots - slow) / (2.0 * damping + 1.0)
            frequency = min(frequency_share * optimal, largest)
        noise = logged_noise(model) if self.noise is None else self.noise
        return replace(self, frequency=frequency, damping=damping, noise=noise)

    def integral_pole(self, model: ShipModel) -> float:
        """Pole of the integral action, 1/s."""
        return 1.0 / (self.integral_lengths * model.travel_time)


@dataclass(frozen=True, eq=False)
class PID(Controller):
    """Proportional, integral and derivative feedback of the heading error.

    order = neutral rudder + proportional * error + integral * (integral of error) -
    derivative * yaw rate.
    """

    kind = "pid"
    settings_type = PIDSettings
    feedback: ClassVar[Mapping[str, tuple[str, float]]] = {
        "proportional": ("heading_error", 1.0),
        "integral": ("heading_error_integral", 1.0),
        "derivative": ("yaw_rate", -1.0),
    }

    @classmethod
    @takes_name
    def from_model(
        cls, model: ShipModel, *, dt: float | None = None, **settings: Any
    ) -> Self:
        """Design on a model, about straight running.

        The poles are placed on the first-order Nomoto form with half of the steering
        gear's lag and half a control interval for the held command.

        Raises InputError if the model has no straight course, a setting is out of its
        range, or the poles asked for leave the ship unstable.

        Parameters
        ----------
        model : ShipModel
        dt : float, optional
            Control interval, s; by default that of the environment.
        **settings
            Fields of `PIDSettings`.
        """
        interval = checked_interval(model, dt)
        ship = sample_ship(model, interval)
        own: Any = PIDSettings(**settings).completed(model, interval)
        lag = lag_of(model, interval)
        gains = place_poles(
            nomoto(model),
            lag,
            own.frequency,
            own.damping,
            slow=own.integral_pole(model),
        )
        gains |= own.helm(model, interval)
        if own.rudder_time is None:
            gains["rudder_update"] = quiet_update(gains, own.noise, interval)
        else:
            low_pass = own.rudder_time * model.travel_time
            gains["rudder_update"] = interval / (interval + low_pass)
        return cls.designed(model, ship, gains, {**known(own), "lag": lag})


def lag_of(model: ShipModel, dt: float) -> float:
    """Lag of the gear that is made up for, and of the held command, s.

    All of the gear's would make the ship slow.
    """
    lag_share = 0.5
    return lag_share * model.steering.time_constant + 0.5 * dt


def quiet_update(gains: Mapping[str, float], noise: float, dt: float) -> float:
    """Share of a new order in a low-pass with which noise moves the rudder little.

    `noise`: in multiples of a sea trial's sensors; `dt`: s. An order of noise of
    standard deviation s moves by 0.8 a s (2 / (2 - a))^(1/2) in the mean. The low-pass
    takes at most a fifth of the time by which the derivative leads.
    """
    by_rate = gains["derivative"] * SEA_TRIAL["yaw_rate"]
    by_heading = gains["proportional"] * SEA_TRIAL["heading"]
    of_sensors = float(np.hypot(by_rate, by_heading))
    deviation = noise * of_sensors
    allowed_rate = np.radians(10.0) / 60.0
    allowed = allowed_rate * dt
    lead = gains["derivative"] / gains["proportional"]
    longest = 0.2 * lead
    least = dt / (dt + longest)
    moved = max(0.8 * deviation, 1e-12)
    share = allowed / moved
    return float(np.clip(share, least, 1.0))


def optimal_poles(response: Nomoto, rate_weight: float) -> tuple[float, float]:
    """Natural frequency, rad/s, and damping of the poles that the steering cost asks.

    They are those of the LQ regulator with weights on heading error, rudder and rudder
    rate (`rate_weight`, s^2), for the first-order Nomoto form with the rudder rate as
    input.
    """
    import control  # here, because it takes a second to import

    # states: yaw rate, heading error, rudder
    yaw_damping = 1.0 / response.T
    A = np.array(
        [
            [-yaw_damping, 0.0, response.rudder_effect],
            [-1.0, 0.0, 0.0],
            [0.0, 0.0, 0.0],
        ]
    )
    B = np.array([[0.0], [0.0], [1.0]])
    Q = np.diag([0.0, 1.0, RUDDER_WEIGHT])
    R = np.array([[rate_weight]])
    _, _, poles = control.lqr(A, B, Q, R)

    pair = poles[np.abs(poles.imag) > 0.0]
    if len(pair) == 0:
        slowest_first = np.argsort(np.abs(poles))
        pair = poles[slowest_first[:2]]

    # (s - p1) (s - p2) = s^2 + 2 damping frequency s + frequency^2
    frequency = float(np.sqrt(np.prod(pair).real))
    decay = float(-np.sum(pair).real)
    return frequency, decay / (2.0 * frequency)


def place_poles(
    response: Nomoto, lag: float, frequency: Any, damping: Any, slow: float
) -> dict[str, float]:
    """PID gains for a pair of poles and a slow one on Nomoto's form with a gear.

    The form is that of first order. The characteristic polynomial
    s^2 (s + 1/T) (lag s + 1) + K/T (Kd s^2 + Kp s + Ki) has a fixed sum of roots, which
    leaves the fourth to the gear.

    Parameters
    ----------
    response : Nomoto
    lag : float
        Of the gear and the held command, s.
    frequency, damping : float
        Of the pair of poles, rad/s and ratio.
    slow : float
        Pole of the integral action, 1/s.

    Returns
    -------
    dict of str to float
        `proportional` (rad/rad), `integral` (1/s), `derivative` (s).
    """
    sum_of_roots = 1.0 / lag + 1.0 / response.T
    sum_of_pair = 2.0 * damping * frequency
    fourth = sum_of_roots - sum_of_pair - slow
    pair = [1.0, sum_of_pair, frequency**2]
    others = np.polymul([1.0, slow], [1.0, fourth])
    polynomial = np.polymul(pair, others)
    _, _, quadratic, linear, constant = polynomial.tolist()

    own_damping = 1.0 / (lag * response.T)  # of ship and gear
    per_rudder = lag / response.rudder_effect
    return {
        "proportional": linear * per_rudder,
        "integral": constant * per_rudder,
        "derivative": (quadratic - own_damping) * per_rudder,
    }
