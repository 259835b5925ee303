"""The helm as a helmsman sees it: one record, and its form in a terminal."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import degrees, inf
from typing import Any, NamedTuple

from rich.console import Group
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from agents.export.heard import HeardSentences
from agents.export.helm import Helm
from agents.export.helm_commands import MANUAL, STANDBY, STEERING
from agents.export.nmea import NmeaSource
from agents.export.sensors import HelmSensors
from shipgym.trials.nmea import NMEA_QUANTITIES
from shipgym.trials.units import UNITS

#: Keys by command, and what they do; the page has them as buttons.
KEYS = {
    "stand-by": ("space", "stand-by"),
    "steer": ("s", "steer"),
    "port-10": ("<", "-10°"),
    "port-1": ("-", "-1°"),
    "starboard-1": ("+", "+1°"),
    "starboard-10": (">", "+10°"),
    "next-leg": ("n", "next leg"),
    "confirm": ("y", "confirm"),
    "cancel": ("c", "cancel"),
    "quit": ("q", "quit"),
}


class SourceView(NamedTuple):
    """An instrument: what it says, since when, and if it is steered by."""

    quantity: str
    value: str
    source: str
    age_s: float
    is_fresh: bool
    is_used: bool


class Missing(NamedTuple):
    """A quantity that is needed and missing, and what was heard instead."""

    quantity: str
    heard: tuple[str, ...]

    @property
    def text(self) -> str:
        """What was heard instead."""
        return "; ".join(self.heard) or "nothing heard"


@dataclass(frozen=True)
class HelmView:
    """Helm as it is shown at one moment; None for what is not known.

    Attributes
    ----------
    state, alarm, warnings, obstacle
        As of a `Helm`.
    heading, set_point, rudder, order : float or None
        rad. The order only while it steers.
    yaw_rate : float or None
        rad/s.
    cross_track : float or None
        m, positive if the ship is to starboard of her track.
    leads : str
        Where the set-point comes from.
    sources : tuple of SourceView
    missing : tuple of Missing
    question : str
        What the helmsman has to confirm.
    note : str
        Answer to his last command.
    """

    state: str
    alarm: str
    warnings: tuple[str, ...]
    obstacle: str
    heading: float | None
    set_point: float | None
    yaw_rate: float | None
    rudder: float | None
    order: float | None
    cross_track: float | None
    leads: str
    sources: tuple[SourceView, ...]
    missing: tuple[Missing, ...]
    question: str = ""
    note: str = ""

    @classmethod
    def of(
        cls, helm: Helm, heard: HeardSentences, now: float, note: str = ""
    ) -> "HelmView":
        """View of a helm at a time, s."""
        inputs = helm.inputs(now)
        sensors = helm.sensors

        def known(quantity: str) -> float | None:
            return inputs.get(quantity, sensors.value(quantity, now))

        # its own heading is that of the moment when it begins again
        is_own = helm.heading is not None and helm.has_steered
        has_set_point = helm.state == STEERING or not is_own
        return cls(
            state=helm.state,
            alarm=helm.alarm,
            warnings=tuple(helm.warnings),
            obstacle=helm.obstacle,
            heading=known("heading"),
            set_point=known("set_point") if has_set_point else None,
            yaw_rate=known("yaw_rate"),
            rudder=known("rudder"),
            order=helm.order if helm.state == STEERING else None,
            cross_track=known("cross_track"),
            leads=_leader(helm),
            sources=tuple(_sources(helm, now)),
            missing=tuple(_missing(helm, heard, now, inputs)),
            question=str(helm.question or ""),
            note=note,
        )

    @property
    def headline(self) -> str:
        """State in capitals; after a fault the alarm."""
        if self.state == MANUAL:
            return "ALARM: TAKE THE WHEEL"
        return {STEERING: "STEERING", STANDBY: "STAND-BY"}[self.state]

    @property
    def details(self) -> list[str]:
        """Alarm, warnings, and what has to be done to steer; two lines at most."""
        if self.state == STEERING:
            return [", ".join(self.warnings) or "all is well"]
        ready = "all is well: s steers"
        if self.leads == "own":
            ready = "all is well: s steers the heading of now"
        if self.obstacle:
            ready = f"cannot steer: {self.obstacle}"
        if not self.alarm:
            return [ready]
        if self.alarm == self.obstacle:
            return [self.alarm]
        return [self.alarm, ready]

    @property
    def gauges(self) -> dict[str, str]:
        """Texts of the numbers by name."""
        return {
            "heading": _known(bearing, self.heading),
            f"set-point ({self.leads})": _known(bearing, self.set_point),
            "rate of turn": _known(per_minute, self.yaw_rate),
            "rudder": _known(sided, self.rudder),
            "order": _known(sided, self.order),
            "cross-track": _known(off_track, self.cross_track),
        }


def _known(form: Callable[[float], str], value: float | None) -> str:
    """Text of a value, or that there is none."""
    return "--" if value is None else form(value)


def bearing(angle: float) -> str:
    """A direction, rad, as 045.0°."""
    tenths = round(degrees(angle) * 10.0) % 3600
    return f"{tenths / 10.0:05.1f}°"


def sided(angle: float) -> str:
    """A rudder angle, rad, as 3.0° stbd."""
    size = abs(degrees(angle))
    if size < 0.05:
        return "0.0°"
    side = "stbd" if angle > 0.0 else "port"
    return f"{size:.1f}° {side}"


def per_minute(rate: float) -> str:
    """A rate of turn, rad/s, as +12.0°/min."""
    size = round(60.0 * degrees(rate), 1) + 0.0  # no -0.0
    return f"{size:+.1f}°/min"


def off_track(distance: float) -> str:
    """A cross-track error, m, as 12 m to port."""
    side = "stbd" if distance >= 0.0 else "port"
    return f"{abs(distance):.0f} m to {side}"


def _leader(helm: Helm) -> str:
    """Where the set-point comes from."""
    if helm.route is not None:
        return "route"
    if helm.heading is not None:
        return "own"
    return "rate" if helm.rate is not None else "plotter"


def _sources(helm: Helm, now: float) -> Iterator[SourceView]:
    """Instruments of what the autopilot needs, and after them the others."""
    sensors = helm.sensors
    followed = list(dict.fromkeys(helm.needed))
    if helm.heading is None:
        followed += helm.plotter_quantities
    for quantity in followed:
        newest = sensors.newest.get(quantity, {})
        first = next(iter(newest), None)
        for source, instrument in newest.items():
            is_fresh = source in sensors.fresh(quantity, now)
            if is_fresh or sensors.value(quantity, now) is not None:
                yield SourceView(
                    quantity=quantity.replace("_", " "),
                    value=reading_text(quantity, instrument.value),
                    source=str(source),
                    age_s=max(now - instrument.time, 0.0),
                    is_fresh=is_fresh,
                    is_used=source == first,
                )
    yield from _others(sensors, followed, now)


def _others(
    sensors: HelmSensors, followed: Sequence[str], now: float
) -> Iterator[SourceView]:
    """Instruments of what the autopilot does not need, each in one row."""
    quantities: dict[NmeaSource, list[str]] = {}
    times: dict[NmeaSource, float] = {}
    for quantity in sensors.newest.keys() - set(followed):
        for source, instrument in sensors.newest[quantity].items():
            quantities.setdefault(source, []).append(quantity.replace("_", " "))
            times[source] = max(instrument.time, times.get(source, -inf))
    for source in sorted(quantities):
        age_s = max(now - times[source], 0.0)
        yield SourceView(
            quantity=", ".join(sorted(quantities[source])),
            value="",
            source=str(source),
            age_s=age_s,
            is_fresh=age_s <= sensors.limits.silence_s,
            is_used=False,
        )


def reading_text(quantity: str, value: float) -> str:
    """A reading in the units of a bridge."""
    if quantity in ("surge", "sway", "speed"):
        knots = round(value / UNITS["speed"]["kn"], 1) + 0.0  # no -0.0
        return f"{knots:.1f} kn"
    if quantity == "yaw_rate":
        return per_minute(value)
    if quantity in ("rudder", "order", "released"):
        return sided(value)
    if quantity in ("latitude", "longitude"):
        return f"{degrees(value):.4f}°"
    if quantity == "cross_track":
        return off_track(value)
    is_distance = NMEA_QUANTITIES[quantity].largest > 1000.0
    return f"{value:.0f} m" if is_distance else bearing(value)


def _missing(
    helm: Helm, heard: HeardSentences, now: float, inputs: Mapping[str, float | None]
) -> Iterator[Missing]:
    """Inputs that are not known, and what was heard instead."""
    speeds = ["course", "speed"]
    other_names = {
        "surge": speeds,
        "sway": speeds,
        "set_point": helm.plotter_quantities,
    }
    for name, value in inputs.items():
        if value is None:
            quantities = [name, *other_names.get(name, [])]
            instead = heard.instead_of(quantities, now)
            yield Missing(name.replace("_", " "), tuple(instead))


def rendered(view: HelmView, title: str, lines: int = 24) -> Group:
    """View in a terminal of so many lines."""
    answer = _line(view.note, "italic")
    if view.question:
        question = f"{view.question}   y: confirm   c: cancel"
        answer = _line(question, "bold black on yellow")
    fixed_lines = 16  # all but the instruments
    return Group(
        _line(title, "dim"),
        _banner(view),
        _gauges(view),
        Text(),
        _instruments(view, max(lines - fixed_lines, 1)),
        Text(),
        answer,
        _keys(),
    )


def _banner(view: HelmView) -> Panel:
    """State and alarm."""
    styles = {
        STEERING: "bold white on dark_green",
        STANDBY: "bold black on grey70",
        MANUAL: "bold white on red",
    }
    style = styles[view.state]
    if view.state == STEERING and view.warnings:
        style = "bold black on yellow"
    lines = [_line(text) for text in (view.headline, *view.details)]
    for line in lines:
        line.justify = "center"
    return Panel(Group(*lines), style=style)


def _line(text: str, style: str = "") -> Text:
    """A text that takes one line, and is cut where it is too long."""
    plain = " ".join(text.split())
    return Text(plain, style=style, no_wrap=True, overflow="ellipsis")


def _gauges(view: HelmView) -> Table:
    """The six numbers in two rows."""
    table = Table.grid(expand=True, padding=(0, 1))
    gauges = list(view.gauges.items())
    per_row = 3
    for _ in range(per_row):
        table.add_column(ratio=1, no_wrap=True)
    for begin in range(0, len(gauges), per_row):
        row = gauges[begin : begin + per_row]
        table.add_row(*[_line(name, "dim") for name, _ in row])
        table.add_row(*[_line(text, "bold") for _, text in row])
    return table


def _instruments(view: HelmView, most: int) -> Table:
    """What is missing, and each source with its age, in so many lines."""
    table = Table.grid(expand=True, padding=(0, 1))
    for ratio in (5, 3, 9, 2):
        table.add_column(ratio=ratio, no_wrap=True, overflow="ellipsis")

    rows: list[tuple[list[str], str]] = []
    for missing in view.missing:
        cells = [missing.quantity, "MISSING", missing.text, ""]
        rows.append((cells, "bold red"))
    for one in view.sources:
        age = f"{one.age_s:.1f} s"
        cells = [one.quantity, one.value, one.source, age]
        style = "" if one.is_used else "dim"
        if not one.is_fresh:
            style = "red"
        rows.append((cells, style))

    shown = rows if len(rows) <= most else rows[: most - 1]
    for cells, style in shown:
        table.add_row(*map(_line, cells), style=style)
    if len(shown) < len(rows):
        hidden = len(rows) - len(shown)
        table.add_row(Text(f"{hidden} more"), style="dim")
    return table


def _keys() -> Text:
    """The keys, and what they do."""
    text = Text(no_wrap=False)
    for command, (key, label) in KEYS.items():
        if command == "confirm":
            text.append("\n")
        text.append(f" {key} ", style="reverse")
        text.append(f" {label}  ")
    return text


def as_json(view: HelmView, title: str) -> dict[str, Any]:
    """View as texts by name, for a page."""
    sources = []
    for one in view.sources:
        entry = one._asdict() | {"age": f"{one.age_s:.1f} s"}
        sources.append(entry)
    missing = []
    for lack in view.missing:
        missing.append({"quantity": lack.quantity, "heard": lack.text})
    level = "warning" if view.warnings else view.state
    return {
        "title": title,
        "state": view.state,
        "level": level,
        "headline": view.headline,
        "detail": "; ".join(view.details),
        "gauges": view.gauges,
        "sources": sources,
        "missing": missing,
        "question": view.question,
        "note": view.note,
    }
