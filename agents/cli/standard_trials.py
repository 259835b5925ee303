"""Standard manoeuvres of one model, for `shipgym trials`: runs, indices, criteria and a page of figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from agents import output
from shipgym.errors import InputError, ManoeuvreError
from shipgym.manoeuvres import Criterion, IndexInterval, standard_manoeuvres
from shipgym.manoeuvres.imo import judge_imo
from shipgym.manoeuvres.intervals import intervals_of
from shipgym.manoeuvres.spirals import Spiral
from shipgym.plots import graph_objects, history_figure, manoeuvre_figure, path_figure, pull_out_figure
from shipgym.ships import ShipModel
from shipgym.trials.trial import Trial
from shipgym.whole_file import write_text

if TYPE_CHECKING:
    from shipgym.pages import Html

HISTORIES = ("psi", "delta", "r", "speed", "drift")
#: Sections of the page, and how the names of their manoeuvres begin.
SECTIONS: dict[str, str | tuple[str, ...]] = {
    "zigzags": "zigzag",
    "circles": "turning circle",
    "spirals": ("direct spiral", "reverse spiral"),
    "pull-outs": "pull-out",
    "stops": ("inertia stop", "crash stop", "acceleration"),
}
TITLES = {
    "imo": "IMO criteria",
    "zigzags": "Zigzags",
    "circles": "Turning circles",
    "spirals": "Spirals",
    "pull-outs": "Pull-outs",
    "stops": "Stopping and acceleration",
}
CAPTIONS = {
    "zigzag": "Heading change and rudder in degrees; dotted: the heading at which the rudder is reversed.",
    "turning": "Path from above, from the position and along the heading at which the rudder was ordered.",
    "direct": "Each point a steady turn, with rudder angles there and back.",
    "reverse": "Each point a yaw rate held by a helmsman, with the mean rudder that it took.",
    "inertia": "The shaft stopped at service speed, the rudder amidships, until a tenth of it is left.",
    "crash": "The shaft ordered full astern at service speed, the rudder amidships, until dead in the water.",
    "acceleration": "From a quarter of service speed, the shaft ordered to service speed.",
}


@dataclass(frozen=True, eq=False)
class StandardTrials:
    """Standard manoeuvres of a model, and of models drawn from its covariance.

    Attributes
    ----------
    sailed : dict of str to Trial or Spiral
        By manoeuvre, as simulated with the model itself.
    indices : dict of str to dict of str to IndexInterval
        By manoeuvre and index, units in the names.
    criteria : dict of str to Criterion
        The criteria of IMO resolution MSC.137(76); none in shallow water, which they are not made for.
    refused : dict of str to str
        Why a manoeuvre could not be sailed.
    draws : int
        Models drawn.
    water_depth : float
        m.
    """

    sailed: dict[str, Trial | Spiral]
    indices: dict[str, dict[str, IndexInterval]]
    criteria: dict[str, Criterion]
    refused: dict[str, str]
    draws: int
    water_depth: float = np.inf

    @property
    def water(self) -> str:
        """Where they were sailed, in words."""
        return water_in_words(self.water_depth)

    def to_dict(self) -> dict[str, Any]:
        """As `--json` prints it."""
        return {
            "draws": self.draws,
            "water_depth": None if np.isinf(self.water_depth) else self.water_depth,
            "manoeuvres": {
                name: {index: found.to_dict() for index, found in indices.items()}
                for name, indices in self.indices.items()
            },
            "refused": self.refused,
            "imo": {name: criterion.to_dict() for name, criterion in self.criteria.items()},
        }


def standard_trials(
    model: ShipModel,
    draws: int = 0,
    seed: int = 0,
    progress: Callable[[int], None] | None = None,
    water_depth: float = np.inf,
) -> StandardTrials:
    """Sail every standard manoeuvre that suits the ship, with the model and with models drawn from it.

    Parameters
    ----------
    model : ShipModel
        The ship.
    draws : int
        Models drawn from its covariance; a ship without one has none.
    seed : int
        Of the draws.
    progress : callable, optional
        Told the number of draws done.
    water_depth : float
        m, for ships that know shallow water.

    Raises
    ------
    InputError
        For water that is too shallow, or shallow water in a ship that knows none.
    UnstableModelError
        If the ship itself runs away.
    """
    manoeuvres = standard_manoeuvres(model, water_depth)
    sailed: dict[str, Trial | Spiral] = {}
    own: dict[str, dict[str, float | None]] = {}
    refused: dict[str, str] = {}
    for name, manoeuvre in manoeuvres.items():
        own[name] = manoeuvre.nothing
        try:
            sailed[name] = manoeuvre.sail(model)
            own[name] = asdict(manoeuvre.indices(sailed[name]))
        except (InputError, ManoeuvreError) as error:
            refused[name] = str(error)
    drawn = model.sample(draws, seed) if draws and model.covariance is not None else []
    assessed = {name: manoeuvre.judge for name, manoeuvre in manoeuvres.items()}
    found = intervals_of(own, drawn, assessed, progress)
    criteria = judge_imo(model, found) if np.isinf(water_depth) else {}
    return StandardTrials(sailed, found, criteria, refused, len(drawn), water_depth)


def water_in_words(water_depth: float) -> str:
    """Say that the water is deep, or how deep it is."""
    return "deep water" if np.isinf(water_depth) else f"water of {water_depth:g} m"


def check_page(path: Path) -> None:
    """Refuse a file for figures that cannot be written, before any work.

    Raises
    ------
    InputError
        If plotly is missing, the ending is not .html, or the folder cannot be written.
    """
    graph_objects()
    output.check_page(path)


def write_page(model: ShipModel, found: StandardTrials, path: Path) -> None:
    """Write indices, criteria and figures as one self-contained page."""
    from shipgym.pages import page

    write_text(page(f"{model.name}: standard manoeuvres", _body(model, found), TITLES), path)


def _body(model: ShipModel, found: StandardTrials) -> dict[str, Html]:
    """The sections of the page."""
    from shipgym.pages import header, section

    drawn = f" Intervals: 95 % of {found.draws} models drawn from its covariance." if found.draws else ""
    ship = model.particulars
    lead = (
        f"Simulated from service speed, {ship['speed']:.4g} m/s, in {found.water}; "
        f"ship length {ship['length']:.5g} m.{drawn}"
    )
    body = {"header": header("Standard manoeuvres", model.name, lead)}
    if found.criteria:
        body["imo"] = section("imo", TITLES["imo"], _criteria(found.criteria))
    for name, start in SECTIONS.items():
        chosen = [key for key in found.indices if key.startswith(start)]
        if chosen:
            body[name] = section(name, TITLES[name], *_section(name, chosen, found))
    return body


def _criteria(criteria: Mapping[str, Criterion]) -> Html:
    """The table of criteria."""
    from agents.verification.figures import CRITERIA
    from shipgym.pages import NONE, Html, badge, fixed, html, percent, table

    rows = []
    for name, criterion in criteria.items():
        note = f"; {criterion.note}" if criterion.note else ""
        verdict = badge("not assessable", "plain")
        if criterion.passed is not None:
            verdict = badge("passes", "good") if criterion.passed else badge("fails", "bad")
        share = criterion.share_passed
        rows.append(
            [
                Html(f"{html(CRITERIA[name])}<br><span class=sub>{html(criterion.source + note)}</span>"),
                verdict,
                fixed(criterion.value, 2),
                _interval(criterion.interval),
                Html(f"≤ {fixed(criterion.limit, 1)}"),
                criterion.unit,
                Html(NONE) if share is None else percent(share),
            ]
        )
    head = ["criterion", "verdict", "value", "95 % interval", "limit", "unit", "draws that pass"]
    return table(head, rows, text_columns=2, caption="The worse of both sides.")


def _interval(interval: tuple[float, float] | None) -> Html:
    from shipgym.pages import NONE, Html, fixed

    return Html(NONE) if interval is None else Html(f"{fixed(interval[0], 2)} to {fixed(interval[1], 2)}")


def _section(name: str, chosen: list[str], found: StandardTrials) -> list[Html]:
    """Indices and figures of one family of manoeuvres."""
    from shipgym.pages import figure, note

    parts = [_indices(chosen, found)]
    parts += [note(f"{key}: {found.refused[key]}", "warn") for key in chosen if key in found.refused]
    shown = [key for key in chosen if key in found.sailed]
    trials: dict[str, Trial] = {}
    for key in shown:
        run = found.sailed[key]
        if isinstance(run, Trial):
            trials[key] = run
    if name == "pull-outs" and trials:
        caption = "Yaw rate, deg/s. Sides that end apart show a ship that is unstable on a straight course."
        parts.append(figure(pull_out_figure(trials), name, caption))
    else:
        for k, key in enumerate(shown):
            caption = f"{key[0].upper()}{key[1:]}. {CAPTIONS[key.split()[0]]}"
            parts.append(figure(manoeuvre_figure(found.sailed[key]), f"{name}-{k}", caption))
    if trials and name != "pull-outs":
        parts.append(figure(path_figure(trials), f"{name}-paths", "Paths from above, north up, in metres."))
    histories = trials or {
        key: run.trial for key, run in found.sailed.items() if key in shown and isinstance(run, Spiral)
    }
    if histories:
        caption = "Time histories: heading, rudder, yaw rate, speed and drift angle."
        parts.append(figure(history_figure(histories, HISTORIES), f"{name}-histories", caption))
    return parts


def _indices(chosen: list[str], found: StandardTrials) -> Html:
    """One row for each index, one column for each manoeuvre."""
    from shipgym.pages import Html, fixed, table

    def cell(index: IndexInterval) -> Html:
        lost = index.n_ran_away + index.n_never_reached
        text = str(fixed(index.value, 2))
        if index.interval is not None:
            text += f"<br><span class=sub>{_interval(index.interval)}</span>"
        if lost:
            text += f"<br><span class=sub>{lost} of {found.draws} draws without value</span>"
        return Html(text)

    names = {index: None for key in chosen for index in found.indices[key]}
    rows = [
        [
            _readable(name),
            *(cell(found.indices[key][name]) if name in found.indices[key] else None for key in chosen),
        ]
        for name in names
    ]
    return table(["index", *chosen], rows)


UNITS = {"_deg_s": "deg/s", "_deg": "deg", "_lengths": "ship lengths", "_s": "s"}


def _readable(name: str) -> str:
    """The name of an index as words with its unit."""
    for ending, unit in UNITS.items():
        if name.endswith(ending):
            return f"{name.removesuffix(ending).replace('_', ' ')}, {unit}"
    return name.replace("_", " ") + (", m/s" if name == "final_speed" else "")
