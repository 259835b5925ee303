"""The command `shipgym`: each subcommand imports what it needs when it is called.

Exit codes: 0 done; 1 the work ran and failed its check; 2 wrong input or usage, with
one message on standard error and nothing written; 130 interrupted (Ctrl-C, SIGTERM).
"""

import os
import sys

try:
    import signal
    import warnings
    from _thread import interrupt_main
    from collections.abc import Callable
    from io import TextIOWrapper
    from pathlib import Path
    from socket import socketpair
    from threading import Event, Thread, Timer
    from typing import Annotated, Any

    import typer
    from typer import Argument, Option

    from agents.cli.autopilot import autopilot_command
    from agents.cli.benchmark import benchmark_command
    from agents.cli.command import (
        FAILED,
        INTERRUPTED,
        CommandGroup,
        report_os_error,
        shared_options,
    )
    from agents.cli.export import export_command
    from agents.cli.identification import (
        advise_command,
        identify_command,
        reduce_command,
    )
    from agents.cli.logs import look_command, new_ship_command
    from agents.cli.reproduction import reproduce_command
    from agents.cli.terminal import answer, say, warn
    from agents.cli.training import train_command, tune_command
    from agents.cli.trials import trials_command
except KeyboardInterrupt:  # Ctrl-C before any command began
    sys.exit(130)

ENDING = (signal.SIGINT, signal.SIGTERM)
PATIENCE = 5.0  # s until a process that does not hear Ctrl-C ends

app = typer.Typer(
    cls=CommandGroup,
    epilog=(
        "Example: shipgym new-ship zigzag.csv, then shipgym autopilot ship.toml --out"
        " report/"
    ),
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        import shipgym

        typer.echo(f"shipgym {shipgym.__version__}")
        raise typer.Exit


@app.callback()
def shipgym_command(
    version: Annotated[
        bool,
        Option(
            "--version",
            callback=_print_version,
            is_eager=True,
            help="Print the version and exit.",
        ),
    ] = False,
) -> None:
    """From recorded ship trials to an identified model and verified autopilots."""


def replay_command(
    episodes: Annotated[
        list[Path],
        Argument(metavar="EPISODE.JSON", help="Episodes that RecordEpisode wrote."),
    ],
    out: Annotated[Path, Option(metavar="REPLAY.HTML", help="The page to write.")],
) -> None:
    """Replay recorded episodes in one HTML page.

    Chart, time slider and time histories, several episodes overlaid.
    """
    from agents.rollouts.replay_page import write_replay

    write_replay(episodes, out)
    answer({"written": str(out)})
    say(f"written: {out}")


def doctor_command() -> None:
    """Check the installation: versions, cache, optional packages, import names.

    Exits with 1 if something does not work.
    """
    from agents.cli.doctor import examine_installation

    findings = examine_installation()
    answer({"findings": [finding._asdict() for finding in findings]})
    say(*(finding.line() for finding in findings))
    if any(finding.state == "wrong" for finding in findings):
        raise typer.Exit(FAILED)


#: Commands by name, in the order of the help, each with an example of its arguments.
COMMANDS: dict[str, tuple[Callable[..., None], str]] = {
    "new-ship": (new_ship_command, "zigzag.csv circle.csv --length 160.9"),
    "look": (look_command, "ship.toml --out look.html"),
    "identify": (identify_command, "ship.toml --structure abkowitz --out my_ship/"),
    "advise": (advise_command, "ship.toml --number 2"),
    "reduce": (reduce_command, "ship.toml --tolerance 1e-4 --out my_ship/"),
    "trials": (trials_command, "my_ship/model.json --out trials.html"),
    "autopilot": (autopilot_command, "ship.toml --draws 200 --out report/"),
    "export": (export_command, "report/lq.json --c lq/"),
    "train": (
        train_command,
        "sac --env path-following --model my_ship/model.json --out run/",
    ),
    "tune": (tune_command, "sac --trials 40 --out study/"),
    "benchmark": (
        benchmark_command,
        "--suite shipgym-v1 --controllers pid,lq,ppo --out results/",
    ),
    "reproduce": (reproduce_command, "cao2015 --markdown tables.md"),
    "replay": (replay_command, "recordings/episode-00000.json --out replay.html"),
    "doctor": (doctor_command, "--json"),
}

for name, (command, example) in COMMANDS.items():
    epilog = f"Example: shipgym {name} {example}"
    app.command(name, epilog=epilog)(shared_options(command))


def _unraisable(failed: Any) -> None:
    """Interrupt again after a function that a library in C called, as LLVM does.

    Python would print a traceback there and go on.
    """
    if failed.exc_type is KeyboardInterrupt:
        Timer(0.1, interrupt_main).start()
    else:
        sys.__unraisablehook__(failed)


def _listen() -> None:
    """Clean up on Ctrl-C and SIGTERM; end the process where Python does not hear them.

    Compiled code of a user's task, in a loop that does not end, keeps them from it.
    """
    heard = Event()
    ears, mouth = socketpair()

    def interrupt(*_: Any) -> None:
        heard.set()
        raise KeyboardInterrupt

    def listen() -> None:
        while ears.recv(1)[0] not in ENDING:
            continue
        if not heard.wait(PATIENCE):
            os.write(2, b"Error: interrupted in a loop that does not end\n")
            os._exit(INTERRUPTED)

    mouth.setblocking(False)
    signal.set_wakeup_fd(mouth.detach())  # told at once, whatever Python does
    for number in ENDING:
        if signal.getsignal(number) != signal.SIG_IGN:  # as of a job in the background
            signal.signal(number, interrupt)
    Thread(target=listen, daemon=True).start()


def main() -> None:
    """Run the command line."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # names of files may have any bytes
            stream.reconfigure(errors="backslashreplace")
    os.environ["PYTHONSAFEPATH"] = "1"  # for processes that libraries start
    # names in it come from files
    warnings.showwarning = lambda message, *_, **__: warn(str(message))
    # joblib's, of a job that ended with an error, which is said anyway
    warnings.filterwarnings("ignore", "A worker stopped while some jobs")
    sys.unraisablehook = _unraisable
    _listen()
    try:
        app(prog_name="shipgym")
    except OSError as error:  # of the help, which no command prints
        sys.exit(report_os_error(error))
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
