"""`shipgym steer` and `shipgym simulate`: the two ends of a line of NMEA 0183."""

from math import inf, radians
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from agents.cli.command import FAILED, INTERRUPTED, TERMINATED, fail

Address = Annotated[
    str,
    Option(
        "--nmea",
        help="tcp:HOST:PORT, udp:HOST:PORT, serial:DEVICE or serial:DEVICE@BAUD.",
    ),
]
Gear = Annotated[
    str | None,
    Option(
        metavar="ADDRESS",
        help="Where rudder orders go; needed over UDP, else the --nmea connection.",
    ),
]
Heading = Annotated[
    float | None,
    Option(
        metavar="DEG",
        min=0.0,
        max=360.0,
        help="Heading to steer; default: commanded (HSC, HTC) or plotted (APB).",
    ),
]
Rate = Annotated[
    float | None,
    Option(
        "--rate-of-turn",
        metavar="DEG",
        help="deg/min, for turn-rate; with --heading the limit.",
    ),
]
RouteFile = Annotated[
    Path | None,
    Option(
        metavar="CSV",
        help=(
            "Route for preview-lq, wheel-over or mpc: columns latitude, longitude,"
            " degrees."
        ),
    ),
]
LimitValues = Annotated[
    list[str] | None,
    Option(
        metavar="NAME=VALUE",
        help="When to hand over: silence_s=3, rudder_deg=5; repeatable.",
    ),
]
Variation = Annotated[
    float | None,
    Option(
        metavar="DEG",
        min=-180.0,
        max=180.0,
        help="Magnetic variation, positive east; default: heard (RMC, HDG).",
    ),
]
RudderFeedback = Annotated[
    bool,
    Option(
        "--rudder-feedback/--no-rudder-feedback",
        help="Measure the rudder (RSA); without, nobody sees if it follows.",
    ),
]
Duration = Annotated[
    float, Option(min=0.0, help="Seconds after which to stop; default: never.")
]
SpeedUp = Annotated[
    float, Option(min=0.01, help="Times faster than real time; same at both ends.")
]

Page = Annotated[
    int | None,
    Option(
        metavar="PORT",
        min=0,
        max=65535,
        help="Show the helm on a page of this computer; 0: any free port.",
    ),
]
Log = Annotated[
    Path | None,
    Option(metavar="FILE", help="New file for all sentences, as new-ship reads."),
]


def steer_command(
    agent: Annotated[
        str,
        Argument(
            metavar="AGENT",
            help="A controller's file, or the name of a pretrained agent.",
        ),
    ],
    nmea: Address,
    gear: Gear = None,
    heading: Heading = None,
    rate: Rate = None,
    route: RouteFile = None,
    limit: LimitValues = None,
    variation: Variation = None,
    rudder_feedback: RudderFeedback = True,
    page: Page = None,
    log: Log = None,
    duration: Duration = inf,
    speed_up: SpeedUp = 1.0,
) -> None:
    """Steer over NMEA 0183.

    Reads HDT/THS, HDG/HDM, ROT, RSA, VBW, VTG/RMC, GLL, APB, XTE, BWC, BWR, HSC, HTC,
    ACN; writes ROR, HTD, ALR, ALF, ALC.

    It begins when everything that the autopilot reads is available. If a sensor falls
    silent, two disagree, the rudder does not follow or the computer is late, it raises
    the alarm (ALR), marks its order invalid and stops steering. In a terminal it shows
    the helm and takes keys; with --page a browser does. Not certified: read
    docs/deployment.md first. Exits with 1 after an alarm, with 130 after Ctrl-C and 143
    after SIGTERM; the last order is always marked invalid.
    """
    import asyncio

    from agents.agent_file import load_agent
    from agents.cli.terminal import console, say, warn
    from agents.export.panel import has_screen, helm_panel, steer_with
    from agents.export.route import Route
    from agents.export.sensors import Limits
    from shipgym.checks import check_keys
    from shipgym.files import named_values

    limits = named_values(limit or (), "--limit", "silence_s=3")
    check_keys(limits, Limits.__dataclass_fields__, "--limit")
    pilot = load_agent(agent)
    track = None
    if route is not None:
        radius = getattr(pilot, "gains", {}).get("path_radius", 0.0)
        track = Route.from_csv(route, radius)

    panel = helm_panel(
        title=f"shipgym steer {agent} on {nmea}",
        say=say,
        warn=warn,
        console=console if has_screen(console) else None,
        page=page,
        log=log,
        speed_up=speed_up,
    )
    helm = asyncio.run(
        steer_with(
            panel,
            pilot,
            nmea,
            gear=gear,
            heading=_radians(heading),
            limits=Limits(**limits),
            duration=duration,
            speed_up=speed_up,
            route=track,
            rate=None if rate is None else radians(rate) / 60.0,
            variation=_radians(variation),
            rudder_feedback=rudder_feedback,
        )
    )
    _report_end(helm)


def _radians(degrees: float | None) -> float | None:
    return None if degrees is None else radians(degrees)


def _report_end(helm: Any) -> None:
    """Say how a helm was left; other exit codes after an alarm and a signal."""
    from agents.cli.terminal import answer, say

    answer({"state": helm.state, "alarm": helm.alarm, **helm.counts})
    if helm.alarm:
        fail(f"handed over: {helm.alarm}", FAILED)
    by = helm.ended_by or "--duration"
    end = f"ended by {by}: the last order is marked invalid"
    _fail_by_signal(helm.ended_by, end)
    say(end)


def _fail_by_signal(signal: str, message: str) -> None:
    """End with the exit code of a signal, if it is one."""
    if signal.startswith("SIG"):
        code = INTERRUPTED if signal == "SIGINT" else TERMINATED
        fail(message, code)


def simulate_command(
    model: Annotated[
        str,
        Argument(metavar="MODEL", help="A model file, or the name of a shipped model."),
    ],
    nmea: Address,
    gear: Annotated[
        str | None,
        Option(
            metavar="ADDRESS",
            help="Where she receives rudder orders; default: the --nmea connection.",
        ),
    ] = None,
    leg: Annotated[
        float, Option(metavar="DEG", min=0.0, max=360.0, help="Leg on her plotter.")
    ] = 0.0,
    sea: Annotated[str, Option(help="calm, slight, moderate or rough.")] = "calm",
    seed: Annotated[int, Option(min=0, help="Seed of the sea.")] = 0,
    drop: Annotated[
        list[str] | None,
        Option(
            metavar="HDT=60",
            help="Sentence that falls silent, HDT after 60 s, say; repeatable.",
        ),
    ] = None,
    duration: Duration = inf,
    speed_up: SpeedUp = 1.0,
) -> None:
    """Simulate a ship for `shipgym steer`.

    Sends instrument readings and receives rudder orders; the rudder goes amidships when
    valid orders stop for 5 s.

    Over TCP it waits for connections; the autopilot and a chart plotter may connect at
    once. Over UDP it sends to --nmea and listens for orders at --gear.

    Exits with 130 after Ctrl-C and 143 after SIGTERM.
    """
    import asyncio

    from agents.cli.terminal import answer, say
    from agents.export.simulated import STEP, SimulatedShip, simulate_ship
    from shipgym.checks import check_number
    from shipgym.files import named_values
    from shipgym.models import load_model

    dropped = {}
    for kind, after in named_values(drop or (), "--drop", "HDT=60").items():
        dropped[kind.upper()] = check_number(after, f"--drop {kind}", at_least=0.0)
    ship = SimulatedShip(load_model(model), radians(leg), sea, seed)
    ended_by = asyncio.run(
        simulate_ship(
            ship,
            nmea,
            gear=gear,
            duration=duration,
            speed_up=speed_up,
            drop=dropped,
            log=say,
        )
    )
    seconds = ship.steps * STEP
    answer(
        {
            "model": ship.model.name,
            "duration_s": round(seconds, 1),
            "state": ship.now,
        }
    )
    sailed = f"{ship.model.name}: sailed for {seconds:.1f} s"
    _fail_by_signal(ended_by, f"{sailed}, ended by {ended_by}")
    say(sailed)
