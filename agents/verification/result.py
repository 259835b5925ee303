"""Result of the whole chain: the model, its certainty and its autopilots."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from agents.controllers.controller import Controller
from agents.rollouts.course_keeping import Episodes, StepResponses
from agents.verification.figures import criteria_panel, step_panels, track_panels
from agents.verification.tracks import Track
from identification import IdentificationResult
from shipgym.arrays import Flags, finite
from shipgym.checks import check_choice
from shipgym.manoeuvres import Criterion
from shipgym.manoeuvres.quantiles import upper_95
from shipgym.models import ShipModel
from shipgym.models.linear import Nomoto
from shipgym.plots import Panel, draw
from shipgym.trials.ship_file import ShipFile

STEP_DEG = 20.0


@dataclass(frozen=True, eq=False)
class Pilot:
    """One autopilot and what it costs over the models drawn."""

    key: str  # its kind, the name in metrics
    controller: Controller
    episodes: Episodes  # one episode on each model drawn
    # of the identified model, first, and of the stable models drawn
    step: StepResponses

    @property
    def name(self) -> str:
        """Short name, in capitals as the field writes it."""
        return self.key.upper()


@dataclass(frozen=True, eq=False)
class Verification:
    """Findings about a stable model and its autopilots."""

    draws: int  # number of models drawn from the coefficient covariance
    seed: int  # of the draw and of the episodes
    #: IMO criteria that her equations allow, each with its interval over the draws
    criteria: dict[str, Criterion]
    #: draws that run away in one of their manoeuvres, shape (n_draws,)
    unstable: Flags
    #: draws that do not hold a straight course with the rudder held, shape (n_draws,)
    course_unstable: Flags
    nomoto: Nomoto  # of the identified model
    pilots: tuple[Pilot, ...]  # ranked: fewest lost, then the lowest median cost
    #: autopilots that could not be designed on the model, and why
    refused: dict[str, str]
    #: draws that count against a design: the others run away whatever steers them,
    #: shape (n_draws,)
    counted: Flags
    tracks: tuple[Track, ...] = ()  # of autopilots that keep to a track
    run_next: str = ""  # the trials that would help most, in words

    @property
    def left_out(self) -> int:
        """Number of draws that do not count."""
        return int(np.sum(~self.counted))

    @property
    def by_name(self) -> list[Pilot]:
        """Autopilots in an order apart from the ranking, for their colours."""
        return sorted(self.pilots, key=lambda pilot: pilot.name, reverse=True)

    def panels(self, length: float) -> dict[str, Panel]:
        """Panels of figures by name; `length`: of the ship, m."""
        responses = {
            pilot.name: (pilot.step.heading, pilot.step.rudder)
            for pilot in self.by_name
        }
        heading, rudder = step_panels(
            self.pilots[0].step.t,
            responses,
            STEP_DEG,
        )
        shown = {
            "criteria": criteria_panel(self.criteria),
            "heading": heading,
            "rudder": rudder,
        }
        if self.tracks:
            tracks = {track.key.upper(): track for track in self.tracks}
            track, error = track_panels(tracks, length)
            shown |= {"track": track, "cross-track error": error}
        return shown


@dataclass(frozen=True, eq=False)
class AutopilotResult:
    """Everything in the report."""

    ship: ShipFile  # what was read
    identification: IdentificationResult  # trials, model and its predictions
    # why the model must not be used; None where it is stable
    instability: str | None = None
    # none where the model is unstable or refused
    verification: Verification | None = None
    # why no autopilot is given although the model is stable, and what would help
    refusal: str | None = None

    @property
    def model(self) -> ShipModel:
        """The identified model."""
        return self.identification.model

    @property
    def stable(self) -> bool:
        """True if the model can be used."""
        return self.instability is None

    def plot(self, name: str = "heading", ax: Any = None) -> Any:
        """Draw a figure of the report on axes of matplotlib, and return these.

        Raises InputError for an unknown one, or where no autopilot was verified.

        Parameters
        ----------
        name : {"heading", "rudder", "criteria", "track", "cross-track error"}
            Response to a change of course, IMO criteria, or track keeping.
        ax : matplotlib.axes.Axes, optional
            By default the current ones.
        """
        shown = {}
        if self.verification is not None:
            shown = self.verification.panels(self.model.particulars["length"])
        return draw(shown[check_choice(name, shown, "plot")], ax)

    @property
    def metrics(self) -> dict[str, Any]:
        """The contents of metrics.json."""
        fit = self.identification
        metrics = {
            **fit.metrics,
            "stable": self.stable,
            "instability": self.instability,
            "refusal": self.refusal,
            "diagnostics": {
                quantity: diagnosis.to_dict()
                for quantity, diagnosis in fit.diagnostics.items()
            },
        }
        if self.verification is not None:
            metrics |= verification_metrics(self.verification)
        return metrics


def verification_metrics(found: Verification) -> dict[str, Any]:
    """Contents of metrics.json about a verification."""
    return {
        "draws": {
            "count": found.draws,
            "seed": found.seed,
            "unstable": int(found.unstable.sum()),
            "course_unstable": int(found.course_unstable.sum()),
            "left_out": found.left_out,
        },
        "nomoto": _finite(asdict(found.nomoto)),
        "imo": {
            name: criterion.to_dict() for name, criterion in found.criteria.items()
        },
        "controllers": {pilot.key: pilot_metrics(pilot) for pilot in found.pilots},
        "ranking": [pilot.key for pilot in found.pilots],
        "refused": found.refused,
        "run_next": found.run_next,
        "tracks": {track.key: track_metrics(track) for track in found.tracks},
    }


def track_metrics(track: Track) -> dict[str, Any]:
    """Cross-track errors of one path autopilot on the identified and drawn models."""
    drawn = track.largest[1:]
    if not len(drawn):
        drawn = track.largest
    return {
        "gains": track.controller.gains,
        "cross_track_largest_m": float(track.largest[0]),
        "cross_track_rmse_m": float(track.rms[0]),
        "cross_track_largest_m_quantile_95": upper_95(drawn),
        "arrived": bool(track.arrived[0]),
        "not_arrived": int(np.sum(~track.arrived[1:])),
    }


def pilot_metrics(pilot: Pilot) -> dict[str, Any]:
    """Gains and margins of one autopilot, and its episodes over the models drawn."""
    episodes = pilot.episodes
    rmse_deg = episodes.heading_rmse_deg
    return {
        "gains": pilot.controller.gains,
        "margins": _finite(asdict(pilot.controller.margins)),
        "cost_mean": float(np.mean(episodes.cost)),
        "cost_median": float(np.median(episodes.cost)),
        "cost_quantile_95": upper_95(episodes.cost),
        "heading_rmse_deg_mean": float(np.mean(rmse_deg)),
        "heading_rmse_deg_quantile_95": upper_95(rmse_deg),
        "rudder_travel_deg_min_mean": float(np.mean(episodes.rudder_travel_deg_min)),
        "extrapolating_mean": float(np.mean(episodes.extrapolating)),
        "lost_control": int(np.sum(episodes.terminated)),
    }


def _finite(values: dict[str, float]) -> dict[str, float | None]:
    """Values as JSON knows them."""
    return {name: finite(value) for name, value in values.items()}
